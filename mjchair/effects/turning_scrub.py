"""Contact patches with a moment against turning on the spot."""

from __future__ import annotations

import mujoco

from mjchair.effects.effect import Effect, Parameter
from mjchair.model import parts
from mjchair.tire import block


def edit(spec: mujoco.MjSpec, moment: float) -> None:
    """Let the rear tires together resist yaw by `moment` (N m)."""
    parts.add_to_tires(spec, block.TURNING_MOMENT, 0.5 * moment, parts.REAR)


EFFECT = Effect(
    name="turning_scrub",
    parameters=(Parameter("moment", "N m", 1.0, 0.0, 50.0, whole=(2.0, 4.0, 8.0)),),
    signature="-sign(yaw rate), also near v = 0",
    source="a patch of 8 cm under 300 N at friction 0.8 gives some 5 N m; assumed",
    edit=edit,
    everywhere=True,
)
