"""Wind between posts, alternately left and right of them, without touching one."""

from __future__ import annotations

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
FIRST, SPACING = 2.0, 1.8  # m
SWING = 0.65  # m, of the proposed path beside each post
SPEED = 0.8  # m/s


class Slalom(FollowPath):
    """Reward: near a proposed path between the posts, and at speed along it.

    Attributes:
      sides: for every post, +1 to pass it on its left, -1 on its right.
      passed: how many posts lie behind, each on the right side; wrong: one was not.
    """

    def __init__(self, random: np.random.RandomState | int | None = None) -> None:
        """Begin with the task's random state, or a seed for one."""
        self.sides = np.array([1.0, -1.0] * POSTS)[:POSTS]
        self.passed, self.wrong = 0, False
        super().__init__(random=random, speed=SPEED)

    def own_quantities(self) -> tuple[Quantity, ...]:
        """The path, the next post and the side on which to pass it."""
        return (
            *super().own_quantities(),
            Quantity(
                "post", "m", -20.0, 20.0, "position of the next post, chair frame", self.post, 2
            ),
            Quantity("side", "1", -1.0, 1.0, "1: pass it on its left", self.side),
        )

    def new_course(self) -> Course:
        """Draw the side of the first post; a path between the posts from it."""
        self.sides = self.random.choice([-1.0, 1.0]) * np.array([1.0, -1.0] * POSTS)[:POSTS]
        self.passed, self.wrong = 0, False
        x = FIRST + SPACING * np.arange(POSTS)
        beside = [(float(at), float(SWING * side)) for at, side in zip(x, self.sides, strict=True)]
        end = float(x[-1]) + SPACING
        return Course([(0.0, 0.0), (0.6, 0.0), *beside, (end, 0.0), (end + 0.6, 0.0)])

    def after_step(self, physics: Physics) -> None:
        """Count the posts that lie behind the axle."""
        x, y = physics.position()
        while self.passed < POSTS and x > FIRST + SPACING * self.passed:
            self.wrong = self.wrong or y * self.sides[self.passed] < 0.0
            self.passed += 1
        super().after_step(physics)

    def post(self, physics: Physics) -> np.ndarray:
        """Where the next post is, or the last, in the chair frame, m."""
        at = FIRST + SPACING * min(self.passed, POSTS - 1)
        return physics.from_chair(np.array([at, 0.0]))

    def side(self, physics: Physics) -> float:
        """On which to pass the next post; 0 behind the last."""
        return float(self.sides[self.passed]) if self.passed < POSTS else 0.0

    def get_reward(self, physics: Physics) -> float:
        """In [0, 1]; 0 when a post is touched or was passed on the wrong side."""
        if self.wrong or physics.touches():
            return 0.0
        return super().get_reward(physics)

    def solved(self, physics: Physics) -> bool:
        """Past all posts on the right sides, none touched, at the end."""
        return self.passed == POSTS and not self.wrong and self.at_end()


def spec() -> mujoco.MjSpec:
    """The manual chair on a level floor with posts."""
    built = load_spec()
    for k in range(POSTS):
        arena.add_post(built, str(k), FIRST + SPACING * k, 0.0)
    arena.add_marks(built, MARKS)
    return built
