"""Rear wheels of another size: tire pressure, wear, another tire."""

from __future__ import annotations

import mujoco

from mjchair.effects import parts
from mjchair.effects.effect import Effect, Parameter
from mjchair.model.wheels import SUFFIX
from mjchair.tire import block


def edit(spec: mujoco.MjSpec, left: float, right: float) -> None:
    """Add `left` and `right` (m) to the radii of the rear wheels."""
    for wheel, change in zip(parts.REAR, (left, right), strict=True):
        geom = parts.named(spec.geoms, wheel + SUFFIX, "tire geom")
        size = list(geom.size)
        geom.size = [size[0] + change, size[1] + change, size[2]]
    parts.add_to_tires(spec, block.RADIUS, left, parts.REAR[:1])
    parts.add_to_tires(spec, block.RADIUS, right, parts.REAR[1:])


EFFECT = Effect(
    name="wheel_radius",
    parameters=(
        Parameter("left", "m", 0.003, -0.05, 0.05),
        Parameter("right", "m", 0.003, -0.05, 0.05),
    ),
    signature="encoder and motion disagree, in proportion to v",
    source="a 24-inch tire is 1-3 mm smaller at half pressure; assumed",
    edit=edit,
)
