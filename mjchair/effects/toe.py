"""Toe of the rear wheels: they do not point straight ahead."""

from __future__ import annotations

import mujoco

from mjchair.effects.effect import Effect, Parameter
from mjchair.model import edits, parts


def edit(spec: mujoco.MjSpec, symmetric: float, asymmetric: float) -> None:
    """Toe in by `symmetric` (rad) each; turn both to the left by `asymmetric` (rad)."""
    for wheel, side in parts.SIDE.items():
        edits.steer_wheel(spec, wheel, asymmetric - side * symmetric)


EFFECT = Effect(
    name="toe",
    parameters=(
        Parameter("symmetric", "rad", 0.015, -0.15, 0.15, probe=1.0),
        Parameter("asymmetric", "rad", 0.01, -0.15, 0.15),
    ),
    signature="symmetric: drag that grows in turns; asymmetric: side force and yaw at v > 0",
    source="Vander Wiel et al., RESNA 2016: 1 deg of toe increases rolling resistance by a quarter",
    edit=edit,
    by_hand="measure how far apart the rear rims are in front of the hubs and behind them",
)
