"""Contact patches with a moment against turning on the spot."""

from __future__ import annotations

import mujoco

from mjchair.effects.effect import Effect, Parameter
from mjchair.model import parts
from mjchair.tire import block, law


def edit(spec: mujoco.MjSpec, moment: float, rate: float) -> None:
    """Let the rear tires together resist yaw by `moment` (N m), in full well above `rate` (rad/s).

    A slow turn is resisted in proportion, as a tread and a flexing frame give way.
    """
    if moment == 0.0:
        return
    parts.add_to_tires(spec, block.TURNING_MOMENT, 0.5 * moment, parts.REAR)
    parts.edit_tires(spec, block.TURNING_RATE, lambda _: rate, parts.REAR)


EFFECT = Effect(
    name="turning_scrub",
    parameters=(
        Parameter("moment", "N m", 1.0, 0.0, 50.0, whole=(2.0, 4.0, 8.0)),
        Parameter(
            "rate",
            "rad/s",
            law.TURNING_RATE,
            0.02,
            1.0,
            neutral=law.TURNING_RATE,
            scale=0.05,
            sized=False,
            cautious=0.1,
        ),
    ),
    signature="-sign(yaw rate), also near v = 0",
    source="a patch of 8 cm under 300 N at friction 0.8 gives some 5 N m; assumed",
    edit=edit,
    everywhere=True,
    turning=True,
)
