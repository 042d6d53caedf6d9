"""Dry friction in the swivels of the casters, which gives way a little before it slides."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from mjchair.effects.effect import Effect, Parameter, Seed
from mjchair.model import parts

CREEP = 0.1  # rad/s, where a fit begins
TYPICAL = 0.2  # N m
PROBE = 0.25  # of the typical moment, at which the response is taken
LEAST, MOST = 0.02, 0.999  # impedance of MuJoCo's constraint: less does nothing, more is stiff


def edit(spec: mujoco.MjSpec, moment: float, creep: float) -> None:
    """Add `moment` (N m) of dry friction to each swivel, in full from a rate of `creep` (rad/s) on.

    Below that rate the friction is proportional to the rate, which stands for how a headset, a fork
    and a tread give way. MuJoCo's own friction has one slope for all moments, so that 0.8 N m on
    the shipped chair is in full at 0.44 rad/s only: it then acts like a damper.
    """
    if moment == 0.0:
        return
    inverse_inertia = _inverse_inertias(spec)
    for caster in parts.CASTERS:
        joint = parts.named(spec.joints, f"{caster}_swivel", "joint")
        own = _ratio(joint.solimp_friction[0]) if joint.frictionloss > 0.0 else 0.0
        joint.frictionloss += moment
        ratio = own + moment / creep * inverse_inertia[joint.name] / _rate(joint)
        impedance = np.array(joint.solimp_friction)
        impedance[0] = np.clip(ratio / (1.0 + ratio), LEAST, MOST)
        joint.solimp_friction = impedance


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
    """Name of each hinge -> its inverse inertia as MuJoCo's constraints have it, 1/(kg m^2)."""
    model = spec.copy().compile()
    return {
        model.joint(j).name: float(model.dof_invweight0[model.jnt_dofadr[j]])
        for j in range(model.njnt)
    }


def _combine(coefficients: np.ndarray) -> dict[str, float]:
    return {"moment": float(np.clip(TYPICAL * coefficients[0], 0.0, 10.0)), "creep": CREEP}


EFFECT = Effect(
    name="caster_friction",
    parameters=(
        Parameter("moment", "N m", TYPICAL, 0.0, 10.0),
        Parameter("creep", "rad/s", CREEP, 0.03, 1.0, CREEP, sized=False, cautious=0.1),
    ),
    signature="hysteresis when the swivel reverses its direction",
    source="a tight headset holds 0.1-0.5 N m; assumed",
    edit=edit,
    everywhere=True,
    by_hand="lift each caster and turn it about its stem with a spring balance",
    seeds=(Seed(({"moment": PROBE * TYPICAL, "creep": CREEP},), _combine, (1.0 / PROBE,), 0.0),),
)
