"""Friction in the bearings of the rear wheels, independent of the load."""

from __future__ import annotations

import mujoco

from mjchair.effects.effect import Effect, Parameter
from mjchair.model import parts


def edit(spec: mujoco.MjSpec, coulomb: float, viscous: float) -> None:
    """Add `coulomb` (N m) and `viscous` (N m s/rad) to each rear wheel's joint."""
    for wheel in parts.REAR:
        joint = parts.named(spec.joints, wheel, "joint")
        joint.frictionloss += coulomb
        joint.damping[0] += viscous  # [0] is linear in speed, the others are higher


EFFECT = Effect(
    name="bearing_friction",
    parameters=(
        Parameter("coulomb", "N m", 0.2, 0.0, 10.0),
        Parameter("viscous", "N m s/rad", 0.05, 0.0, 5.0),
    ),
    signature="torque on a rear wheel, independent of its load; a viscous part grows with speed",
    source="sizes assumed: a dragging brake is 0.1-1 N m, a dry hub less",
    edit=edit,
)
