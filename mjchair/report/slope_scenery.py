"""Scenery that makes a tilted floor visible as tilted.

In: a model whose floor is a plane, and the path of the chair. Out: the floor as a ramp with ends,
walls below its rims and level ground about it. An endless tilted plane looks like a level one with
a tilted horizon; so the horizon and the surrounding ground are drawn level, and the ramp tilted.
Only the film's copy of the model is changed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import mujoco
import numpy as np

from mjchair.report.forces import Array
from mjchair.simulation import names

LEAST = 0.002  # grade below which a floor is drawn without scenery
BEYOND = 1.1  # m, from the path to the rims, so that a chair on it has room
GROUND = 150.0  # m, half length of the level ground
SLAB = 0.03  # m, between the floor's surface and the top of a wall
WALL = 0.01  # m, half thickness
PIECES = 60  # of a wall along one rim
CONCRETE, LEVEL = (0.45, 0.43, 0.40), (0.42, 0.46, 0.40)


@dataclass(frozen=True)
class Box:
    """A box to draw: middle (3,) m, half sizes (3,) m, axes (3, 3) in columns, colour."""

    middle: Array
    half: Array
    axes: Array
    colour: tuple[float, float, float]


def floor_plane(model: mujoco.MjModel) -> int | None:
    """Id of the plane `floor`, or None where there is none."""
    for i, name in enumerate(names.geoms(model)):
        if names.same(name, "floor") and model.geom_type[i] == mujoco.mjtGeom.mjGEOM_PLANE:
            return i
    return None


def grade_of(model: mujoco.MjModel, data: mujoco.MjData) -> float:
    """The grade of the plane `floor`: rise over run; 0 where it is level or there is none."""
    plane = floor_plane(model)
    if plane is None:
        return 0.0
    normal = data.geom_xmat[plane].reshape(3, 3)[:, 2]
    grade = float(np.hypot(*normal[:2]) / max(normal[2], 1e-6))
    return grade if grade > LEAST else 0.0


def build_ramp(model: mujoco.MjModel, data: mujoco.MjData, path: Array) -> list[Box]:
    """Give the endless floor of `model` ends, and return what else is to be drawn.

    Args:
      model: a copy of the film's own, changed in place. data: with its kinematics.
      path: (n, 3), m, of the chair, world.
    """
    plane = floor_plane(model)
    assert plane is not None, "a model with a grade has a plane"
    axes = data.geom_xmat[plane].reshape(3, 3).copy()
    origin = data.geom_xpos[plane].copy()
    along = (path - origin) @ axes[:, :2]
    low, high = along.min(axis=0) - BEYOND, along.max(axis=0) + BEYOND
    middle = origin + axes[:, :2] @ (0.5 * (low + high))
    half = 0.5 * (high - low)
    model.geom_pos[plane] = middle
    model.geom_size[plane, :2] = half
    model.geom_sameframe[plane] = 0
    corners = [
        middle + axes[:, :2] @ (half * sign) for sign in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    ]
    ground = float(min(corner[2] for corner in corners)) - SLAB
    thick = 0.01
    at = np.array([middle[0], middle[1], ground - thick])
    boxes = [Box(at, np.array([GROUND, GROUND, thick]), np.eye(3), LEVEL)]
    for start, end in zip(corners, [*corners[1:], corners[0]], strict=True):
        boxes += _wall(start, end, ground)
    return boxes


def _wall(start: Array, end: Array, ground: float) -> list[Box]:
    """Upright boxes side by side from the level ground to just below a rim."""
    run = end - start
    level = math.hypot(run[0], run[1])
    forward = np.array([run[0] / level, run[1] / level, 0.0])
    axes = np.column_stack([forward, np.cross([0.0, 0.0, 1.0], forward), [0.0, 0.0, 1.0]])
    boxes = []
    for k in range(PIECES):
        top = min(float((start + run * (k + side) / PIECES)[2]) for side in (0, 1)) - 0.002
        height = top - ground
        if height > 0.005:
            middle = start + run * (k + 0.5) / PIECES
            middle[2] = ground + 0.5 * height
            half = np.array([0.5 * level / PIECES, WALL, 0.5 * height])
            boxes.append(Box(middle, half, axes, CONCRETE))
    return boxes
