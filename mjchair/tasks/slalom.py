"""The task `slalom`: pass four posts, alternately on their left and right, without touching one.

In: two torques. Out: the task (observations, reward and end of the episode) and its scene.
"""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from mjchair.model.spec import load_spec
from mjchair.tasks import arena
from mjchair.tasks.course import Course
from mjchair.tasks.follow_path import MARKS, FollowPath
from mjchair.tasks.physics import Physics
from mjchair.tasks.quantity import Quantity

TIME_LIMIT = 25.0  # s
POSTS = 4
FIRST, SPACING = 2.0, 1.8  # m, x of the first post, and the distance between two
SWING = 0.65  # m, distance of the proposed path from each post
SPEED = 0.8  # m/s


class Slalom(FollowPath):
    """The reward is high near a proposed path between the posts, and at SPEED along it.

    Attributes:
      sides: for every post, +1 to pass it on its left, -1 on its right.
      passed: number of posts behind the rear axle. wrong: whether one was passed on the wrong side.
    """

    def __init__(self, random: np.random.RandomState | int | None = None) -> None:
        """Begin with the task's random state, or a seed for one."""
        self.sides = np.array([1.0, -1.0] * POSTS)[:POSTS]
        self.passed, self.wrong = 0, False
        super().__init__(random=random, speed=SPEED)

    def own_quantities(self) -> tuple[Quantity, ...]:
        """The path, and the next post with the side on which to pass it."""
        return (
            *super().own_quantities(),
            Quantity(
                "post",
                "m",
                -20.0,
                20.0,
                "position of the next post in the chair frame: x, y",
                self.post,
                2,
            ),
            Quantity(
                "side", "1", -1.0, 1.0, "1: pass the next post on its left, -1: right", self.side
            ),
        )

    def new_course(self) -> Course:
        """Draw the side of the first post at random; the proposed path follows from it."""
        self.sides = self.random.choice([-1.0, 1.0]) * np.array([1.0, -1.0] * POSTS)[:POSTS]
        self.passed, self.wrong = 0, False
        x = FIRST + SPACING * np.arange(POSTS)
        beside = [(float(at), float(SWING * side)) for at, side in zip(x, self.sides, strict=True)]
        end = float(x[-1]) + SPACING
        return Course([(0.0, 0.0), (0.6, 0.0), *beside, (end, 0.0), (end + 0.6, 0.0)])

    def after_step(self, physics: Physics) -> None:
        """Count the posts behind the rear axle, and check the side on which each was passed."""
        x, y = physics.position()
        while self.passed < POSTS and x > FIRST + SPACING * self.passed:
            self.wrong = self.wrong or y * self.sides[self.passed] < 0.0
            self.passed += 1
        super().after_step(physics)

    def post(self, physics: Physics) -> np.ndarray:
        """Position (2,) of the next post, or of the last one, in the chair frame, m."""
        x = FIRST + SPACING * min(self.passed, POSTS - 1)
        return physics.from_chair(np.array([x, 0.0]))

    def side(self, physics: Physics) -> float:
        """Side on which to pass the next post: 1 left, -1 right; 0 after the last one."""
        return float(self.sides[self.passed]) if self.passed < POSTS else 0.0

    def get_reward(self, physics: Physics) -> float:
        """The reward, between 0 and 1; 0 if a post is touched or was passed on the wrong side."""
        if self.wrong or physics.touches():
            return 0.0
        return super().get_reward(physics)

    def solved(self, physics: Physics) -> bool:
        """Whether the end is reached and all posts were passed on their correct sides."""
        return self.passed == POSTS and not self.wrong and self.at_end()


def spec(model: str = "manual", **options: Any) -> mujoco.MjSpec:
    """A chair on a level floor with posts and the marks of the proposed path.

    Args:
      model, options: of load_spec.
    """
    built = load_spec(model, **options)
    for k in range(POSTS):
        arena.add_post(built, str(k), FIRST + SPACING * k, 0.0)
    arena.add_marks(built, MARKS)
    return built
