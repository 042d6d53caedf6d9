"""Dry friction in the swivels of the casters, which give way a little before they slide.

Two forms, one name: both swivels hold alike, or each by itself, as where hair winds round one stem.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np

from mjchair.effects.effect import Effect, Parameter
from mjchair.effects.left_and_right import size_words, wheel_words
from mjchair.model import parts

# MuJoCo's own slope on the shipped chair is 1.8; a fit begins there
SLOPE = Parameter(
    "slope", "N m s/rad", 2.0, 0.3, 60.0, neutral=2.0, scale=1.0, sized=False, cautious=2.0
)
LEAST, MOST = 0.02, 0.999  # impedance of MuJoCo's constraint: less does nothing, more is stiff


def edit(spec: mujoco.MjSpec, moment: float, slope: float) -> None:
    """Add `moment` (N m) of dry friction to each swivel.

    A slow swivel is held in proportion to its rate, by `slope` (N m s/rad) up to the moment, which
    stands for how a headset, a fork and a tread give way. MuJoCo's own friction has one slope for
    all moments: on the shipped chair 0.8 N m would be in full from 0.44 rad/s on only, and act like
    a damper below. Beside friction that a swivel has already, the slope is the mean by moments.
    """
    of_one_side(spec, moment, moment, slope)


def of_one_side(spec: mujoco.MjSpec, left: float, right: float, slope: float) -> None:
    """Add `left` and `right` (N m) to the friction of the swivels, as `edit` does."""
    if left == right == 0.0:
        return
    inverse_inertia = _inverse_inertias(spec)
    for caster, moment in zip(parts.CASTERS, (left, right), strict=True):
        joint = parts.named(spec.joints, f"{caster}_swivel", "joint")
        own, total = joint.frictionloss, joint.frictionloss + moment
        if moment > 0.0:
            ratio = slope * inverse_inertia[joint.name] / _rate(joint)
            ratio = (own * _ratio(joint.solimp_friction[0]) + moment * ratio) / total
            impedance = np.array(joint.solimp_friction)
            impedance[0] = np.clip(ratio / (1.0 + ratio), LEAST, MOST)
            joint.solimp_friction = impedance
        joint.frictionloss = total


def _ratio(impedance: float) -> float:
    """What MuJoCo multiplies the slope of a friction constraint by, for an impedance d."""
    return impedance / (1.0 - impedance)


def _rate(joint: Any) -> float:
    """Rate (1/s) at which the constraint damps: MuJoCo's B, from `solref` and `solimp`.

    Source: MuJoCo's documentation, "Solver parameters".
    """
    first, second = joint.solref_friction
    most = float(joint.solimp_friction[1])
    return float(-second / most if first < 0.0 else 2.0 / (most * first))


def _inverse_inertias(spec: mujoco.MjSpec) -> dict[str, float]:
    """Name of each joint -> its inverse inertia as MuJoCo's constraints have it, 1/(kg m^2)."""
    model = spec.copy().compile()
    return {
        model.joint(j).name: float(model.dof_invweight0[model.jnt_dofadr[j]])
        for j in range(model.njnt)
    }


def _of_one_side(values: Mapping[str, float], std: Mapping[str, float]) -> str:
    return f"{size_words(values, std, 1.0, '+.2f N m')}, {wheel_words(values, 'caster')}"


EFFECT = Effect(
    name="caster_friction",
    parameters=(Parameter("moment", "N m", 0.2, 0.0, 10.0), SLOPE),
    signature="hysteresis when the swivel reverses its direction",
    source="a tight headset holds 0.1-0.5 N m; assumed",
    edit=edit,
    everywhere=True,
    by_hand="lift each caster and turn it about its stem with a spring balance",
)
ONE_SIDED = replace(
    EFFECT,
    parameters=(
        Parameter("left", "N m", 0.3, 0.0, 10.0),
        Parameter("right", "N m", 0.3, 0.0, 10.0),
        SLOPE,
    ),
    signature="hysteresis when one swivel reverses its direction, and yaw while it holds",
    source="sizes assumed, as of both",
    edit=of_one_side,
    everywhere=False,
    remark=_of_one_side,
)
