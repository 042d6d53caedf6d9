"""The task `tight_turn`: drive round the corner of a corridor without touching its walls.

In: two torques. Out: the task (observations, reward and end of the episode) and its scene.
"""

from __future__ import annotations

import math

import mujoco
import numpy as np

from mjchair.model.spec import load_spec
from mjchair.tasks import arena
from mjchair.tasks.follow_path import MARKS, FollowPath
from mjchair.tasks.physics import Physics
from mjchair.tasks.quantity import Quantity

TIME_LIMIT = 25.0  # s
# m, of the corridor; ADA 2010, section 403.5.2, requires 42 to 48 inches (1.07-1.22 m) at turns
WIDTH = 1.2
CORNER = 2.5  # m, x of the point where the middle lines of both parts of the corridor meet
BEYOND = 2.5  # m, length of the second part, from CORNER
CUT = 0.45  # m, radius of the proposed path's arc round the corner
SPEED = 0.5  # m/s
FEELERS = (0.0, 0.7, -0.7, 1.5, -1.5)  # rad from the chair's x axis, of the distances
FAR = 3.0  # m, largest distance that is observed


class TightTurn(FollowPath):
    """The reward is high near a proposed path round the corner and at SPEED along it."""

    def __init__(self, random: np.random.RandomState | int | None = None) -> None:
        """Begin with the task's random state, or a seed for one."""
        super().__init__(random=random, path=corner_path(), speed=SPEED)

    def own_quantities(self) -> tuple[Quantity, ...]:
        """The path, and the distances to the walls."""
        return (
            *super().own_quantities(),
            Quantity(
                "walls",
                "m",
                0.0,
                FAR,
                "distance from the axle's middle at 0, 40, -40, 86 and -86 deg from the chair's x",
                self.walls,
                len(FEELERS),
            ),
        )

    def walls(self, physics: Physics) -> np.ndarray:
        """Distances (5,) to the nearest wall in the directions of FEELERS, at most FAR, m."""
        point = np.array([*physics.position(), 0.3])
        group = np.array([0, 1, 0, 0, 0, 0], dtype=np.uint8)  # only walls are in group 1
        hit, distances = np.zeros(1, dtype=np.int32), []
        for angle in FEELERS:
            turn = physics.heading() + angle
            ray = np.array([math.cos(turn), math.sin(turn), 0.0])
            distance = mujoco.mj_ray(
                physics.model.ptr, physics.data.ptr, point, ray, group, 1, -1, hit
            )
            distances.append(FAR if distance < 0.0 else min(distance, FAR))
        return np.array(distances)

    def get_reward(self, physics: Physics) -> float:
        """The reward, between 0 and 1; 0 if a wall is touched."""
        return 0.0 if physics.touches() else super().get_reward(physics)

    def solved(self, physics: Physics) -> bool:
        """Whether the end of the path is reached; touching a wall ends an episode before that."""
        return self.at_end() and not physics.touches()


def corner_path() -> np.ndarray:
    """Points (k, 2), m: straight, an arc of a quarter turn to the left, straight."""
    before = [(x, 0.0) for x in np.linspace(0.0, CORNER - CUT - 0.15, 6)]
    turn = np.linspace(0.0, 0.5 * math.pi, 9)
    arc = [(CORNER - CUT + CUT * math.sin(a), CUT - CUT * math.cos(a)) for a in turn]
    behind = [(CORNER, y) for y in np.linspace(CUT + 0.15, BEYOND - 0.8, 5)]
    return np.array([*before, *arc, *behind])


def spec() -> mujoco.MjSpec:
    """The manual chair in a corridor that turns left, with the marks of the proposed path."""
    built = load_spec()
    half = 0.5 * WIDTH
    arena.add_wall(built, "outer_1", (-1.0, -half), (CORNER + half, -half))
    arena.add_wall(built, "outer_2", (CORNER + half, -half), (CORNER + half, BEYOND))
    arena.add_wall(built, "inner_1", (-1.0, half), (CORNER - half, half))
    arena.add_wall(built, "inner_2", (CORNER - half, half), (CORNER - half, BEYOND))
    for geom in built.geoms:
        if geom.name.startswith("wall_"):
            geom.group = 1
    arena.add_marks(built, MARKS)
    return built
