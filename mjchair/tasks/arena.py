"""Walls, posts and marks that the tasks add to a scene, and the physics of the scene.

In: a specification from load_spec. Out: the specification with walls and posts, and with the goal,
the line or the path that a picture shows; and its physics for dm_control.
"""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np
from dm_control.mujoco import wrapper
from numpy.typing import NDArray

from mjchair.engine.install import install
from mjchair.model.visual_geoms import without_visual_geoms
from mjchair.tasks.physics import Physics

CONTROL_STEP = 0.02  # s, duration of an action
WALL_HEIGHT = 0.5  # m, half of the height

GOAL_LIFT = 0.003  # m above the floor, so that the floor does not hide the plate

Array = NDArray[np.float64]


def physics(spec: mujoco.MjSpec, visual_geoms: bool = True) -> Physics:
    """The physics of a specification; installs the native callbacks of the tires.

    Args:
      spec: from load_spec. visual_geoms: False leaves out the display geoms, which is faster.
    """
    install()
    model = (spec if visual_geoms else without_visual_geoms(spec)).compile()
    return Physics.from_model(wrapper.MjModel(model))  # type: ignore[no-any-return]


def add_wall(spec: mujoco.MjSpec, name: str, begin: Sequence[float], end: Sequence[float]) -> None:
    """Add a wall `wall_<name>`, 4 cm thick, between two points (2,) of the floor, m."""
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
    """Add a post `post_<name>` of 4 cm radius and 0.8 m height at x, y (m)."""
    spec.worldbody.add_geom(
        name=f"post_{name}",
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=(0.04, 0.4, 0.0),
        pos=(x, y, 0.4),
        condim=3,
        rgba=(0.90, 0.45, 0.10, 1.0),
    )


def add_goal(
    spec: mujoco.MjSpec, half: Sequence[float], at: Sequence[float] = (0.0, 0.0), grade: float = 0.0
) -> None:
    """Add a flat green plate `goal` on the floor, without contacts; `move_goal` moves it.

    Args:
      half: (2,), half of its size along x and y, m. at: (2,), x and y of its middle, world, m.
      grade: rise over run of the floor along +x.
    """
    turn = 0.5 * np.arctan(grade)
    body = spec.worldbody.add_body(
        name="goal",
        mocap=True,
        pos=(*at, at[0] * grade + GOAL_LIFT),
        quat=(np.cos(turn), 0.0, -np.sin(turn), 0.0),
    )
    body.add_geom(
        name="goal",
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=(*half, 0.001),
        contype=0,
        conaffinity=0,
        rgba=(0.10, 0.62, 0.30, 1.0),
    )


def move_goal(physics: Physics, x: float, grade: float = 0.0) -> None:
    """Move the middle of the plate `goal` to x (world, m).

    Args:
      physics: of the scene. x: m. grade: rise over run of the floor along +x.
    """
    at = physics.model.body_mocapid[physics.model.name2id("goal", "body")]
    physics.data.mocap_pos[at, 0] = x
    physics.data.mocap_pos[at, 2] = grade * x + GOAL_LIFT


def add_line(spec: mujoco.MjSpec, length: float, grade: float = 0.0) -> None:
    """Add a thin blue line `line` on the floor from the origin along +x, without contacts.

    Args:
      length: along the floor, m. grade: rise over run of the floor along +x.
    """
    turn, along = 0.5 * np.arctan(grade), 0.5 * length
    middle = along / np.hypot(1.0, grade)
    spec.worldbody.add_geom(
        name="line",
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=(along, 0.015, 0.0005),
        pos=(middle, 0.0, grade * middle + 0.0015),
        quat=(np.cos(turn), 0.0, -np.sin(turn), 0.0),
        contype=0,
        conaffinity=0,
        rgba=(0.10, 0.45, 0.90, 1.0),
    )


def add_marks(spec: mujoco.MjSpec, count: int) -> None:
    """Add flat marks `mark_<k>`, without contacts, with which `draw` shows a path."""
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
    """Show a path: spread the marks evenly over its points (n, 2), world, m."""
    data = physics.data
    count = len(data.mocap_pos)
    if count:
        chosen = np.linspace(0, len(points) - 1, count).round().astype(int)
        data.mocap_pos[:, :2] = points[chosen]
        data.mocap_pos[:, 2] = 0.003
