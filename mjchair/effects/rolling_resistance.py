"""More (or less) rolling resistance under every wheel, in proportion to its load."""

from __future__ import annotations

import mujoco

from mjchair.effects.effect import Effect, Parameter
from mjchair.model import parts
from mjchair.tire import block


def edit(spec: mujoco.MjSpec, coefficient: float) -> None:
    """Add `coefficient` (1) to the rolling resistance of all tires."""
    parts.add_to_tires(spec, block.ROLLING_RESISTANCE, coefficient)


EFFECT = Effect(
    name="rolling_resistance",
    parameters=(Parameter("coefficient", "1", 0.005, -0.015, 0.15),),
    signature="-sign(v), in proportion to the load of each wheel, in any heading",
    source="whole chairs 0.006-0.02 (coast-down 0.0070, treadmill 0.0106), carpet up to 0.1",
    edit=edit,
    common=4.0,
)
