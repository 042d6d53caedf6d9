"""A floor with less or more friction, which changes the peak of the tire force."""

from __future__ import annotations

import mujoco

from mjchair.effects.effect import Effect, Parameter
from mjchair.model import parts
from mjchair.tire import block


def edit(spec: mujoco.MjSpec, factor: float) -> None:
    """Multiply the peak friction of all tires by `factor` (1)."""
    parts.scale_tires(spec, block.FRICTION_FACTOR, factor)


EFFECT = Effect(
    name="tire_friction",
    parameters=(
        Parameter(
            "factor", "1", 0.4, 0.02, 2.0, 1.0, probe=1.0, whole=(0.6, 0.45, 0.33, 0.25, 0.18)
        ),
    ),
    signature="the peak only; visible where a tire slides",
    source="wet or dusty floors 0.2-0.5 against 0.8",
    edit=edit,
    example={"factor": 0.3},
)
