"""A place where the floor rolls harder: a mat, a carpet, dirt."""

from __future__ import annotations

import mujoco
import numpy as np

from mjchair.effects import parts
from mjchair.effects.effect import Effect, Parameter
from mjchair.tire import block


def edit(spec: mujoco.MjSpec, x: float, y: float, radius: float, coefficient: float) -> None:
    """Add rolling resistance `coefficient` (1) within `radius` (m) of (x, y) (m, world)."""
    floor = parts.named(spec.geoms, "floor", "geom")
    road = np.array(floor.userdata, dtype=float)
    if not road.size or road[0] != block.ROAD_TAG:
        road = np.zeros(block.ROAD_PATCHES)
        road[0] = block.ROAD_TAG
    count = int(road[block.ROAD_COUNT])
    used = block.ROAD_PATCHES + count * block.ROAD_STRIDE
    data = np.r_[road[:used], x, y, radius, coefficient, 1.0]
    data[block.ROAD_COUNT] = count + 1
    parts.write_geom(spec, floor, data)


EFFECT = Effect(
    name="surface_patch",
    parameters=(
        Parameter("x", "m", 0.5, -1e3, 1e3),
        Parameter("y", "m", 0.5, -1e3, 1e3),
        Parameter("radius", "m", 0.5, 0.05, 20.0, 0.5),
        Parameter("coefficient", "1", 0.02, -0.05, 0.5),
    ),
    signature="locked to a place, repeats over passes",
    source="carpet adds 0.01-0.05 to the rolling resistance of a hard floor",
    edit=edit,
    tags={"place": "x y"},
)
