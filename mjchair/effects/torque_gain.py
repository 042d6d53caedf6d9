"""A drive (or a torque sensor) that gives more or less than it says."""

from __future__ import annotations

from collections.abc import Mapping

import mujoco

from mjchair.effects.effect import Effect, Parameter
from mjchair.model import edits, parts


def edit(spec: mujoco.MjSpec, left: float, right: float) -> None:
    """Change the torque of the rear wheels' actuators by these fractions (1)."""
    for wheel, change in zip(parts.REAR, (left, right), strict=True):
        edits.scale_torque(spec, wheel, change)


def _sizes(values: Mapping[str, float], std: Mapping[str, float]) -> str:
    """Both gains; of two that are free, the difference is what a run tells best that turns."""
    said = [
        f"{side} {100.0 * v:+.1f} ± {100.0 * std.get(side, 0.0):.2g} %"
        for side, v in values.items()
        if v
    ]
    if len(said) > 1:
        said.append(f"left less right {100.0 * (values['left'] - values['right']):+.1f} %")
    return ", ".join(said)


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
)
