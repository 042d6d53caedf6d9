"""Casters whose wheels are further behind their stems, or nearer to them."""

from __future__ import annotations

import mujoco

from mjchair.effects.effect import Effect, Parameter
from mjchair.model import edits, parts


def edit(spec: mujoco.MjSpec, length: float) -> None:
    """Add `length` (m) to the trail of both casters."""
    for caster in parts.CASTERS:
        edits.add_trail(spec, caster, length)


EFFECT = Effect(
    name="caster_trail",
    # at -0.05 the wheels of usual casters stand under their stems, and shimmy
    parameters=(Parameter("length", "m", 0.015, -0.06, 0.1, whole=(-0.05, -0.035, -0.02)),),
    signature="swivel dynamics",
    source="casters have 0.04-0.06 m of trail",
    edit=edit,
    turning=True,
    by_hand="measure how far the axle of each caster is behind its stem",
)
