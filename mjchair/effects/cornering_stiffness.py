"""Tires with a larger or smaller slip stiffness."""

from __future__ import annotations

import mujoco

from mjchair.effects.effect import Effect, Parameter
from mjchair.model import parts
from mjchair.tire import block


def edit(spec: mujoco.MjSpec, front: float, rear: float) -> None:
    """Change the slip stiffness of casters and rear tires by these fractions (1)."""
    parts.scale_tires(spec, block.STIFFNESS_FACTOR, 1.0 + front, parts.CASTERS)
    parts.scale_tires(spec, block.STIFFNESS_FACTOR, 1.0 + rear, parts.REAR)


EFFECT = Effect(
    name="cornering_stiffness",
    parameters=(
        Parameter("front", "1", 0.3, -0.8, 3.0),
        Parameter("rear", "1", 0.3, -0.8, 3.0),
    ),
    signature="slope of Fy over alpha",
    source="Dressel 2013: 0.15 to 0.35 of the load per degree, for 14 tires",
    edit=edit,
    turning=True,
    shared={"caster_stiffness": ("front",), "rear_stiffness": ("rear",)},
    example={"front": 0.0, "rear": -0.4},  # casters align: their stiffness hardly shows
)
