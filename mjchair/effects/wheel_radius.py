"""Rear wheels of another size: tire pressure, wear, another tire."""

from __future__ import annotations

import mujoco

from mjchair.effects.effect import Effect, Parameter
from mjchair.model import edits, parts


def edit(spec: mujoco.MjSpec, left: float, right: float) -> None:
    """Add `left` and `right` (m) to the radii of the rear wheels; their hubs stay in place."""
    for wheel, change in zip(parts.REAR, (left, right), strict=True):
        edits.add_radius(spec, wheel, change)


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
)
