"""Casters whose wheels stand further behind (or nearer) their stems."""

from __future__ import annotations

import mujoco
import numpy as np

from mjchair.effects import parts
from mjchair.effects.effect import Effect, Parameter


def edit(spec: mujoco.MjSpec, length: float) -> None:
    """Add `length` (m) to the trail of both casters."""
    for caster in parts.CASTERS:
        body = parts.named(spec.bodies, caster, "body")
        body.pos = np.asarray(body.pos, float) - [length, 0.0, 0.0]


EFFECT = Effect(
    name="caster_trail",
    parameters=(Parameter("length", "m", 0.015, -0.04, 0.1),),
    signature="swivel dynamics",
    source="casters have 0.04-0.06 m of trail",
    edit=edit,
)
