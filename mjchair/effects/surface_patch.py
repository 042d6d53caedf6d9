"""A place where the floor has more rolling resistance: a mat, a carpet, dirt."""

from __future__ import annotations

import mujoco
import numpy as np

from mjchair.effects.effect import Effect, Parameter, Place, Values
from mjchair.model import parts
from mjchair.tire import block

RADIUS = 0.5  # m, radius of a patch in the search
SHARE = 0.02  # drag of a carpet over the weight


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


def _at(x: float, y: float, coefficient: float) -> Values:
    """Values of a patch at a place; the coefficient 1 is a carpet."""
    added = min(max(SHARE * coefficient, -0.04), 0.4)
    return {"x": x, "y": y, "radius": RADIUS, "coefficient": added}


EFFECT = Effect(
    name="surface_patch",
    parameters=(
        Parameter("x", "m", 0.5, -1e3, 1e3, sized=False),
        Parameter("y", "m", 0.5, -1e3, 1e3, sized=False),
        Parameter("radius", "m", RADIUS, 0.05, 20.0, RADIUS, sized=False),
        Parameter("coefficient", "1", 0.02, -0.05, 0.5),
    ),
    signature="bound to a place, repeats in every pass",
    source="carpet adds 0.01-0.05 to the rolling resistance of a hard floor",
    edit=edit,
    place=Place(RADIUS, SHARE, ("x", "y", "radius", "coefficient"), _at),
    example={"x": 3.0, "y": 0.0, "radius": 0.6, "coefficient": 0.03},
)
