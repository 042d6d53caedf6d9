"""Rear wheels of another size: tire pressure, wear, another tire.

Two forms, one name. A frame that is rigid stands on three wheels where one is larger, so that loads
move from one diagonal to the other; a frame that twists stands on all four as before. How stiff a
frame is in torsion nobody measures, so the diagnosis tries both.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import mujoco
import numpy as np

from mjchair.effects.effect import Effect, Parameter
from mjchair.effects.left_and_right import size_words
from mjchair.model import edits, parts


def edit(spec: mujoco.MjSpec, left: float, right: float) -> None:
    """Add `left` and `right` (m) to the radii of the rear wheels; their hubs stay in place."""
    for wheel, change in zip(parts.REAR, (left, right), strict=True):
        edits.add_radius(spec, wheel, change)


def twisting(spec: mujoco.MjSpec, left: float, right: float) -> None:
    """The same on a frame that twists, so that all wheels stand on the floor as before.

    The hub of the larger wheel rises by half of the difference, and the other one goes down as far.
    """
    edit(spec, left, right)
    half = 0.5 * (left - right)
    for wheel, rise in zip(parts.REAR, (half, -half), strict=True):
        body = parts.named(spec.bodies, wheel, "body")
        body.pos = np.asarray(body.pos, float) + np.array([0.0, 0.0, rise])


def _sizes(values: Mapping[str, float], std: Mapping[str, float]) -> str:
    """Both radii in mm, and of two their difference."""
    return size_words(values, std, 1e3, "+.2f mm")


def _sizes_on_a_frame_that_twists(values: Mapping[str, float], std: Mapping[str, float]) -> str:
    return f"{_sizes(values, std)}, on a frame that twists, so that all wheels keep their loads"


EFFECT = Effect(
    name="wheel_radius",
    parameters=(
        Parameter("left", "m", 0.003, -0.05, 0.05),
        Parameter("right", "m", 0.003, -0.05, 0.05),
    ),
    signature="encoder and motion disagree, in proportion to v",
    source="a 24-inch tire is 1-3 mm smaller at half pressure; assumed",
    edit=edit,
    common=2.0,
    shared={"rolling_radius": ("left", "right")},
    remark=_sizes,
    by_hand="roll the loaded chair ten turns of each rear wheel and measure the way",
)
TWISTING = replace(EFFECT, edit=twisting, remark=_sizes_on_a_frame_that_twists)
