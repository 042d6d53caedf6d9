"""Rear wheels that lean inwards."""

from __future__ import annotations

import mujoco

from mjchair.effects.effect import Effect, Parameter
from mjchair.model import edits, parts


def edit(spec: mujoco.MjSpec, angle: float) -> None:
    """Lean the tops of both rear wheels inwards by `angle` (rad)."""
    for wheel in parts.REAR:
        edits.add_camber(spec, wheel, angle)


EFFECT = Effect(
    name="camber",
    parameters=(Parameter("angle", "rad", 0.05, -0.3, 0.3, probe=1.0),),
    signature="side force from gamma Fz; cancels between left and right but for load transfer",
    source="sports chairs up to 20 deg; bent axles a degree or two",
    edit=edit,
)
