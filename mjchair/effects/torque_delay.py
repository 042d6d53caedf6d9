"""Torques that were recorded late against all other columns, or early.

Rim and chair are often recorded by two devices that were started by hand, or one was filtered and
the other was not.
"""

from __future__ import annotations

from collections.abc import Mapping

import mujoco

from mjchair.effects.effect import Effect, Parameter
from mjchair.model import torque_timing


def edit(spec: mujoco.MjSpec, delay: float) -> None:
    """Let both rear wheels' torques act so much earlier (s) than their column says."""
    torque_timing.record_late(spec, delay)


def _size(values: Mapping[str, float], std: Mapping[str, float]) -> str:
    """Late or early, in words: a sign is easily taken for the other."""
    delay = values["delay"]
    side = "later" if delay > 0.0 else "earlier"
    return (
        f"the torques were recorded {1e3 * abs(delay):.1f} ± {1e3 * std.get('delay', 0.0):.2g} ms "
        f"{side} than the other columns"
    )


EFFECT = Effect(
    name="torque_delay",
    parameters=(Parameter("delay", "s", 0.02, -0.3, 0.3),),
    signature="speed and acceleration lead or lag behind torque by one time, in every stroke",
    source="two devices that a person starts are 0.02-0.2 s apart, a low-pass of 6 Hz is 0.03 s "
    "late; assumed",
    edit=edit,
    driven=True,
    commanded=False,
    drive=False,
    recording=True,
    covers=("input_timing",),
    example={"delay": 0.06},
    remark=_size,
)
