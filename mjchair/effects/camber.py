"""Rear wheels that lean inwards."""

from __future__ import annotations

import mujoco

from mjchair.effects.effect import Effect, Parameter, Values
from mjchair.model import edits, parts

OUTWARDS = 0.05  # rad: no axle bends further that way (assumption)


def edit(spec: mujoco.MjSpec, angle: float) -> None:
    """Lean the tops of both rear wheels inwards by `angle` (rad)."""
    for wheel in parts.REAR:
        edits.add_camber(spec, wheel, angle)


def _least(spec: mujoco.MjSpec) -> Values:
    """Less camber than the chair has, until tops lean outwards as far as a bent axle lets them."""
    return {"angle": -min(edits.camber(spec, wheel) for wheel in parts.REAR) - OUTWARDS}


EFFECT = Effect(
    name="camber",
    parameters=(Parameter("angle", "rad", 0.05, -0.3, 0.3, probe=1.0),),
    signature="side force from gamma Fz; cancels between left and right but for load transfer",
    source="sports chairs up to 20 deg; bent axles a degree or two",
    edit=edit,
    least=_least,
    by_hand="lay a digital level against each rear wheel",
)
