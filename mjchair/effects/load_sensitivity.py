"""Tire force over load falls (or grows) with load."""

from __future__ import annotations

import mujoco

from mjchair.effects.effect import Effect, Parameter
from mjchair.model import parts
from mjchair.model.wheels import SUFFIX, WHEELS
from mjchair.tire import block


def edit(spec: mujoco.MjSpec, exponent: float) -> None:
    """Multiply force over load of all tires by (load / nominal load) ** -`exponent` (1)."""
    for wheel in WHEELS:
        geom = parts.named(spec.geoms, wheel + SUFFIX, "tire geom")
        data = list(geom.userdata)
        data[block.LOAD_EXPONENT] += exponent
        geom.userdata = data


EFFECT = Effect(
    name="load_sensitivity",
    parameters=(Parameter("exponent", "1", 0.2, -0.8, 0.8),),
    signature="curvature in lateral acceleration",
    source="car tires 0.1-0.3; assumed similar",
    edit=edit,
    example={"exponent": 0.4},
)
