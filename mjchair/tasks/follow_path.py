"""The task `follow_path`: follow a path at a given speed, on a floor that may slope across it.

In: a path of the user, or None for random paths, and a speed. Out: the task (observations, reward
and end of the episode) and its scene.
"""

from __future__ import annotations

import math
from typing import Any

import mujoco
import numpy as np
from dm_control.utils import rewards
from numpy.typing import ArrayLike

from mjchair.model.spec import load_spec
from mjchair.tasks import arena
from mjchair.tasks.course import Course
from mjchair.tasks.physics import Physics
from mjchair.tasks.quantity import Quantity
from mjchair.tasks.task import ChairTask

TIME_LIMIT = 20.0  # s
SPEED = 1.0  # m/s
AHEAD = (0.3, 0.6, 1.0, 1.5)  # m along the path from the chair to the observed points
MARKS = 60  # number of marks that show the path in pictures
LARGEST_OFFSET = 0.25  # m; the task is solved when the offset from the path stays below this
CROSS_SLOPE = 0.04  # rise over run, to the left of the chair at the start


class FollowPath(ChairTask):
    """The reward is high near the path and at the given speed along it.

    Attributes:
      given: the path of the user, or None. course: the path of the episode; random if `given` is
        None. speed: target speed, m/s. progress: arc length of the nearest point, m.
      worst: largest offset from the path in the episode, m.
    """

    def __init__(
        self,
        random: np.random.RandomState | int | None = None,
        path: ArrayLike | None = None,
        speed: float = SPEED,
    ) -> None:
        """Make the task.

        Args:
          random: the task's random state, or the seed of one.
          path: points (k, 2), m; the path begins near the origin along +x; None: random paths.
          speed: target speed, m/s.
        """
        self.given = None if path is None else Course(path)
        self.course = self.given or Course([(0, 0), (1, 0), (2, 0)])
        self.speed, self.progress, self.worst = speed, 0.0, 0.0
        super().__init__(random=random)

    def own_quantities(self) -> tuple[Quantity, ...]:
        """Offset and direction from the path, and points ahead on it."""
        return (
            Quantity(
                "offset",
                "m",
                -3.0,
                3.0,
                "distance of the axle to the left of the path",
                self.offset,
            ),
            Quantity(
                "direction",
                "rad",
                -math.pi,
                math.pi,
                "heading of the chair from the path's direction",
                self.direction,
            ),
            Quantity(
                "path_ahead",
                "m",
                -10.0,
                10.0,
                "points 0.3, 0.6, 1.0 and 1.5 m ahead on the path, in the chair frame: x, y each",
                self.path_ahead,
                2 * len(AHEAD),
            ),
        )

    def begin(self, physics: Physics) -> None:
        """Choose the path of the episode, and place the chair near its start."""
        self.course = self.new_course()
        super().begin(physics)
        self.progress = self.worst = 0.0
        arena.draw(physics, self.course.points)

    def new_course(self) -> Course:
        """The path of an episode: that of the user, or a random one."""
        return self.given or Course(random_path(self.random))

    def after_step(self, physics: Physics) -> None:
        """Update the nearest point of the path and the largest offset."""
        self.progress = self.course.nearest(physics.position(), self.progress)
        self.worst = max(self.worst, abs(self.offset(physics)))
        super().after_step(physics)

    def offset(self, physics: Physics) -> float:
        """Distance of the rear axle's middle from the path, positive to the left, m."""
        return self.course.offset(physics.position(), self.progress)

    def direction(self, physics: Physics) -> float:
        """Heading of the chair from the path's direction, rad."""
        turn = physics.heading() - self.course.at(self.progress)[1]
        return math.remainder(turn, 2.0 * math.pi)

    def path_ahead(self, physics: Physics) -> np.ndarray:
        """Points ahead on the path in the chair frame, x and y of each (2 k,), m."""
        points = [self.course.at(self.progress + s)[0] for s in AHEAD]
        return np.concatenate([physics.from_chair(point) for point in points])

    def get_reward(self, physics: Physics) -> float:
        """The reward, between 0 and 1."""
        if self.at_end():
            return 1.0
        near = rewards.tolerance(self.offset(physics), (-0.05, 0.05), margin=0.5)
        along = physics.speed() * math.cos(self.direction(physics))
        quick = rewards.tolerance(
            along, (0.9 * self.speed, 1.2 * self.speed), margin=self.speed, sigmoid="linear"
        )
        return float(near * quick)

    def at_end(self) -> bool:
        """Whether the chair is within 0.1 m of the end of the path."""
        return self.progress > self.course.length - 0.1

    def get_termination(self, physics: Physics) -> float | None:
        """Discount 1 at the end of the path; otherwise as for every task."""
        ended = super().get_termination(physics)
        return 1.0 if ended is None and self.at_end() else ended

    def solved(self, physics: Physics) -> bool:
        """Whether the end is reached with offsets below LARGEST_OFFSET all the time."""
        return self.at_end() and self.worst < LARGEST_OFFSET


def random_path(random: np.random.RandomState) -> np.ndarray:
    """Points (k, 2), m, of a winding path of about 10 m that starts along +x."""
    points, heading = [(0.0, 0.0), (0.8, 0.0)], 0.0
    for _ in range(8):
        heading += random.uniform(-0.75, 0.75)
        x, y = points[-1]
        points.append((x + 1.2 * math.cos(heading), y + 1.2 * math.sin(heading)))
    return np.array(points)


def spec(**options: Any) -> mujoco.MjSpec:
    """The manual chair on a cross slope, which is made by turning gravity.

    Args:
      options: of load_spec, which replace those of this task.
    """
    chosen = {"scene": "cross_slope", "grade": CROSS_SLOPE, "tilt": "gravity", **options}
    built = load_spec(**chosen)
    arena.add_marks(built, MARKS)
    return built
