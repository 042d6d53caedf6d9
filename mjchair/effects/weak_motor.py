"""A motor of a power chair that is weak: worn brushes, corroded plugs, a bad lead."""

from __future__ import annotations

import mujoco

from mjchair.drive import block
from mjchair.effects.drive_numbers import change
from mjchair.effects.effect import Effect, Parameter


def edit(spec: mujoco.MjSpec, left: float, right: float) -> None:
    """Add resistance (ohm) to the left and the right motor; the controller does not know it."""
    for motor, more in zip(block.MOTORS, (left, right), strict=True):
        change(spec, motor, "resistance", lambda ohm, more=more: ohm + more)  # type: ignore[misc]


EFFECT = Effect(
    name="weak_motor",
    parameters=(
        Parameter("left", "ohm", 0.1, -0.05, 2.0),
        Parameter("right", "ohm", 0.1, -0.05, 2.0),
    ),
    signature="slower under load, and a turn towards the weaker side in proportion to it",
    source="controllers compensate 0.05 (good) to 0.3 ohm (poor motor), Dynamic DX manual",
    edit=edit,
    driven=True,
    drive=True,
    example={"left": 0.3, "right": 0.0},
)
