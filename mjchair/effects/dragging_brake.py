"""A parking brake of a power chair that does not open fully."""

from __future__ import annotations

import mujoco

from mjchair.drive import block
from mjchair.effects.drive_numbers import change
from mjchair.effects.effect import Effect, Parameter


def edit(spec: mujoco.MjSpec, left: float, right: float) -> None:
    """Let the left and the right brake rub with these torques (N m at the wheel)."""
    for motor, torque in zip(block.MOTORS, (left, right), strict=True):
        change(spec, motor, "brake_drag", lambda drag, torque=torque: drag + torque)  # type: ignore[misc]


EFFECT = Effect(
    name="dragging_brake",
    parameters=(
        Parameter("left", "N m", 4.0, 0.0, 60.0),
        Parameter("right", "N m", 4.0, 0.0, 60.0),
    ),
    signature="the same drag at any speed and load, on one side or on both",
    source="a tenth of a parking brake's torque; assumed",
    edit=edit,
    driven=True,
    drive=True,
    example={"left": 8.0, "right": 0.0},
)
