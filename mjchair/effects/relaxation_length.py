"""A larger relaxation length: side force builds up over a longer distance."""

from __future__ import annotations

import mujoco

from mjchair.effects.effect import Effect, Parameter
from mjchair.model import parts
from mjchair.tire import block


def edit(spec: mujoco.MjSpec, length: float) -> None:
    """Add `length` (m) to the lateral relaxation length of all tires."""
    parts.add_to_tires(spec, block.RELAXATION_Y, length)


EFFECT = Effect(
    name="relaxation_length",
    parameters=(
        Parameter("length", "m", 0.1, -0.03, 1.0, whole=(0.04, 0.06, 0.08, 0.1, 0.13, 0.18)),
    ),
    signature="Fy lags, in proportion to omega sigma / v",
    source="car tires half a metre, bicycle tires 0.1-0.2 m (Pacejka 2006)",
    edit=edit,
    turning=True,
    example={"length": 0.04},  # with more the casters shimmy
)
