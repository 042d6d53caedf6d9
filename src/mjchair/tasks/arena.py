"""Where tasks take place: a scene with a chair, and what is added to it."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np
from dm_control.mujoco import wrapper
from numpy.typing import NDArray

from mjchair.engine.install import install
from mjchair.model.looks import without_looks
from mjchair.tasks.physics import Physics

TIMESTEP = 0.002  # s
CONTROL_STEP = 0.02  # s
WALL_HEIGHT = 0.5  # m, half of it

Array = NDArray[np.float64]


def physics(spec: mujoco.MjSpec, looks: bool = True) -> Physics:
    """The physics of a specification, with the native tires in place in this process.

    Args:
      spec: from load_spec. looks: False leaves out what is only seen, for speed.
    """
    install()
    model = (spec if looks else without_looks(spec)).compile()
    return Physics.from_model(wrapper.MjModel(model))  # type: ignore[no-any-return]


def add_wall(spec: mujoco.MjSpec, name: str, begin: Sequence[float], end: Sequence[float]) -> None:
    """A wall `wall_<name>`, 4 cm thick, between two points (2,) of the floor, m."""
    a, b = np.asarray(begin, dtype=float), np.asarray(end, dtype=float)
    middle, along = 0.5 * (a + b), b - a
    half = 0.5 * np.arctan2(along[1], along[0])
    spec.worldbody.add_geom(
        name=f"wall_{name}",
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=(0.5 * np.hypot(*along) + 0.02, 0.02, WALL_HEIGHT),
        pos=(*middle, WALL_HEIGHT),
        quat=(np.cos(half), 0.0, 0.0, np.sin(half)),
        condim=3,
        rgba=(0.55, 0.60, 0.66, 0.55),
    )


def add_post(spec: mujoco.MjSpec, name: str, x: float, y: float) -> None:
    """A post `post_<name>` of 4 cm radius and 0.8 m height at x, y (m)."""
    spec.worldbody.add_geom(
        name=f"post_{name}",
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=(0.04, 0.4, 0.0),
        pos=(x, y, 0.4),
        condim=3,
        rgba=(0.90, 0.45, 0.10, 1.0),
    )


def add_marks(spec: mujoco.MjSpec, count: int) -> None:
    """Flat marks `mark_<k>` to draw a path with; bodies of their own, moved by `draw`."""
    for k in range(count):
        body = spec.worldbody.add_body(name=f"mark_{k}", mocap=True)
        body.add_geom(
            name=f"mark_{k}",
            type=mujoco.mjtGeom.mjGEOM_CYLINDER,
            size=(0.03, 0.002, 0.0),
            contype=0,
            conaffinity=0,
            rgba=(0.10, 0.45, 0.90, 1.0),
        )


def draw(physics: Physics, points: Array) -> None:
    """Put the marks on points (n, 2), m, spread over as many marks as there are."""
    data = physics.data
    count = len(data.mocap_pos)
    if count:
        chosen = np.linspace(0, len(points) - 1, count).round().astype(int)
        data.mocap_pos[:, :2] = points[chosen]
        data.mocap_pos[:, 2] = 0.003
