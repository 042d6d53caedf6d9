"""More (or less) rolling resistance: under every wheel, or under a rear wheel alone.

Two forms, one name: a floor brakes every wheel in proportion to its load, and a soft tire its own.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import mujoco

from mjchair.effects.effect import Effect, Parameter
from mjchair.effects.left_and_right import size_words, wheel_words
from mjchair.model import parts
from mjchair.tire import block

LEAST, MOST = -0.015, 0.15
ROLLING = block.ROLLING_RESISTANCE


def _least(spec: mujoco.MjSpec) -> dict[str, float]:
    """No tire pushes: what is taken away is at most what the tire with least of it has."""
    return {"coefficient": -min(_of(spec, wheel) for wheel in (*parts.REAR, *parts.CASTERS))}


def _least_of_one_side(spec: mujoco.MjSpec) -> dict[str, float]:
    left, right = (-_of(spec, wheel) for wheel in parts.REAR)
    return {"left": left, "right": right}


def _of(spec: mujoco.MjSpec, wheel: str) -> float:
    """Rolling resistance (1) of a wheel's tire."""
    return float(parts.tire_geom(spec, wheel).userdata[ROLLING])


def edit(spec: mujoco.MjSpec, coefficient: float) -> None:
    """Add `coefficient` (1) to the rolling resistance of all tires."""
    parts.add_to_tires(spec, ROLLING, coefficient)


def of_one_side(spec: mujoco.MjSpec, left: float, right: float) -> None:
    """Add `left` and `right` (1) to the rolling resistance of the rear tires."""
    for wheel, added in zip(parts.REAR, (left, right), strict=True):
        parts.add_to_tires(spec, ROLLING, added, (wheel,))


def _of_one_side(values: Mapping[str, float], std: Mapping[str, float]) -> str:
    sizes = size_words(values, std, 1.0, "+.4f")
    return f"{sizes}, {wheel_words(values)}, as a soft tire rolls"


EFFECT = Effect(
    name="rolling_resistance",
    parameters=(Parameter("coefficient", "1", 0.005, LEAST, MOST),),
    signature="-sign(v), in proportion to the load of each wheel, in any heading",
    source="whole chairs 0.006-0.02 (coast-down 0.0070, treadmill 0.0106), carpet up to 0.1",
    edit=edit,
    common=4.0,
    least=_least,
)
# of a power chair a brake that drags stands for a drag on one side
ONE_SIDED = replace(
    EFFECT,
    parameters=(
        Parameter("left", "1", 0.01, LEAST, MOST),
        Parameter("right", "1", 0.01, LEAST, MOST),
    ),
    signature="-sign(v), in proportion to the load of a rear wheel, which the chair turns towards",
    source="a tire at a quarter of its pressure rolls about twice as hard; assumed",
    edit=of_one_side,
    least=_least_of_one_side,
    drive=False,
    remark=_of_one_side,
)
