"""Friction in the bearings of the rear wheels, independent of the load: of both, or of one alone.

Two forms, one name: what ages brakes both wheels, and what rubs on one of them that one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import mujoco

from mjchair.effects.effect import Effect, Parameter
from mjchair.effects.left_and_right import size_words, wheel_words
from mjchair.model import parts


def edit(spec: mujoco.MjSpec, coulomb: float, viscous: float) -> None:
    """Add `coulomb` (N m) and `viscous` (N m s/rad) to each rear wheel's joint."""
    for wheel in parts.REAR:
        joint = parts.named(spec.joints, wheel, "joint")
        joint.frictionloss += coulomb
        joint.damping[0] += viscous  # [0] is linear in speed, the others are higher


def of_one_side(spec: mujoco.MjSpec, left: float, right: float) -> None:
    """Add `left` and `right` (N m) to the friction of the rear wheels' joints."""
    for wheel, coulomb in zip(parts.REAR, (left, right), strict=True):
        parts.named(spec.joints, wheel, "joint").frictionloss += coulomb


def _of_one_side(values: Mapping[str, float], std: Mapping[str, float]) -> str:
    sizes = size_words(values, std, 1.0, "+.3f N m")
    return f"{sizes}, {wheel_words(values)}, as where something rubs on it"


EFFECT = Effect(
    name="bearing_friction",
    parameters=(
        Parameter("coulomb", "N m", 0.2, 0.0, 10.0),
        Parameter("viscous", "N m s/rad", 0.05, 0.0, 5.0),
    ),
    signature="torque on a rear wheel, independent of its load; a viscous part grows with speed",
    source="sizes assumed: a dragging brake is 0.1-1 N m, a dry hub less",
    edit=edit,
    by_hand="lift each rear wheel, spin it by hand and record how it slows down",
)
# of a power chair a brake that drags stands for a drag on one side
ONE_SIDED = replace(
    EFFECT,
    parameters=(
        Parameter("left", "N m", 0.5, 0.0, 20.0),
        Parameter("right", "N m", 0.5, 0.0, 20.0),
    ),
    signature="torque on one rear wheel, independent of its load, which the chair turns towards",
    source="sizes assumed: a brake shoe that touches the tire is 0.3-3 N m",
    edit=of_one_side,
    drive=False,
    remark=_of_one_side,
)
