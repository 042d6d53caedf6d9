"""Dry friction in the swivels of the casters."""

from __future__ import annotations

import mujoco

from mjchair.effects.effect import Effect, Parameter
from mjchair.model import parts


def edit(spec: mujoco.MjSpec, moment: float) -> None:
    """Add `moment` (N m) of dry friction to each swivel.

    MuJoCo's friction is soft: under 0.1 of 0.2 N m the lifted swivel of the shipped chair turns at
    0.055 rad/s. A harder one (`solimp_friction` 0.99) turns at a tenth of that, but fits, which
    follow slopes, then find less of it: 0.06 of 0.187 N m on the benchmark's other chair (seed
    5311, number 6), where they find 0.13.
    """
    for caster in parts.CASTERS:
        joint = parts.named(spec.joints, f"{caster}_swivel", "joint")
        joint.frictionloss += moment


EFFECT = Effect(
    name="caster_friction",
    parameters=(Parameter("moment", "N m", 0.2, 0.0, 10.0),),
    signature="hysteresis when the swivel reverses its direction",
    source="a tight headset holds 0.1-0.5 N m; assumed",
    edit=edit,
    everywhere=True,
    by_hand="lift each caster and turn it about its stem with a spring balance",
)
