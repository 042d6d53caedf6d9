"""Rear wheels that do not point ahead."""

from __future__ import annotations

import mujoco

from mjchair.effects import parts
from mjchair.effects.effect import Effect, Parameter
from mjchair.effects.turn import turn_wheel


def edit(spec: mujoco.MjSpec, symmetric: float, asymmetric: float) -> None:
    """Toe in by `symmetric` (rad) each; turn both to the left by `asymmetric` (rad)."""
    for wheel, side in parts.SIDE.items():
        turn_wheel(spec, wheel, (0.0, 0.0, 1.0), asymmetric - side * symmetric)


EFFECT = Effect(
    name="toe",
    parameters=(
        Parameter("symmetric", "rad", 0.015, -0.15, 0.15, probe=1.0),
        Parameter("asymmetric", "rad", 0.01, -0.15, 0.15),
    ),
    signature="symmetric: drag that grows in turns; asymmetric: side force and yaw at v > 0",
    source="Vander Wiel et al., RESNA 2016: 1 deg of toe costs a quarter more rolling resistance",
    edit=edit,
)
