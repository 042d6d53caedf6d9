"""Dry friction in the swivels of the casters."""

from __future__ import annotations

import mujoco

from mjchair.effects.effect import Effect, Parameter
from mjchair.model import parts


def edit(spec: mujoco.MjSpec, moment: float) -> None:
    """Add `moment` (N m) of dry friction to each swivel."""
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
)
