"""A drive (or a torque sensor) that gives more or less than it says."""

from __future__ import annotations

from collections.abc import Mapping

import mujoco

from mjchair.effects.effect import Effect, Parameter
from mjchair.effects.left_and_right import size_words
from mjchair.model import edits, parts


def edit(spec: mujoco.MjSpec, left: float, right: float) -> None:
    """Change the torque of the rear wheels' actuators by these fractions (1)."""
    for wheel, change in zip(parts.REAR, (left, right), strict=True):
        edits.scale_torque(spec, wheel, change)


def _sizes(values: Mapping[str, float], std: Mapping[str, float]) -> str:
    """Both gains in per cent, and of two their difference."""
    return size_words(values, std, 100.0, "+.1f %")


EFFECT = Effect(
    name="torque_gain",
    parameters=(
        Parameter("left", "1", 0.1, -0.9, 3.0),
        Parameter("right", "1", 0.1, -0.9, 3.0),
    ),
    signature="yaw and thrust in proportion to torque",
    source="uncalibrated torque sensors are within 10 %; assumed",
    edit=edit,
    driven=True,
    drive=False,
    shared={"torque": ("left", "right")},
    remark=_sizes,
    by_hand="hang a known weight on each push rim and compare the torque",
)
