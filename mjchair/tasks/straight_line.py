"""The task `straight_line`: drive 5 m straight ahead, and stop.

In: two torques. Out: the task (observations and reward) and its scene.
"""

from __future__ import annotations

import mujoco
import numpy as np
from dm_control.utils import rewards

from mjchair.model.spec import load_spec
from mjchair.tasks import arena
from mjchair.tasks.physics import Physics
from mjchair.tasks.quantity import Quantity
from mjchair.tasks.task import ChairTask

DISTANCE = 5.0  # m
TIME_LIMIT = 12.0  # s


class StraightLine(ChairTask):
    """The reward is high on the line near the goal, and highest at rest at the goal."""

    def own_quantities(self) -> tuple[Quantity, ...]:
        """Position of the goal, and the heading from the line's direction."""
        return (
            Quantity(
                "goal",
                "m",
                -20.0,
                20.0,
                "position of the goal in the chair frame: x, y",
                self.goal,
                2,
            ),
            Quantity(
                "direction",
                "rad",
                -np.pi,
                np.pi,
                "heading of the chair from the line's direction",
                Physics.heading,
            ),
        )

    def goal(self, physics: Physics) -> np.ndarray:
        """Position (2,) of the goal in the chair frame, m."""
        return physics.from_chair(np.array([DISTANCE, 0.0]))

    def get_reward(self, physics: Physics) -> float:
        """The reward, between 0 and 1."""
        x, y = physics.position()
        near = rewards.tolerance(x, (DISTANCE - 0.1, DISTANCE + 0.1), margin=DISTANCE)
        straight = rewards.tolerance(y, (-0.05, 0.05), margin=0.5)
        there = rewards.tolerance(x, (DISTANCE - 0.1, DISTANCE + 0.1), margin=0.2)
        still = rewards.tolerance(physics.speed(), (-0.02, 0.02), margin=0.5)
        return float(straight * near * (1.0 - there + there * still))

    def solved(self, physics: Physics) -> bool:
        """Whether the chair is at rest, within 0.1 m of the goal along and across the line."""
        x, y = physics.position()
        return abs(x - DISTANCE) < 0.1 and abs(y) < 0.1 and abs(physics.speed()) < 0.03


def spec() -> mujoco.MjSpec:
    """The manual chair on a level floor, with the line, and a plate where it has to stop."""
    built = load_spec()
    arena.add_line(built, DISTANCE)
    arena.add_goal(built, half=(0.1, 0.4), at=(DISTANCE, 0.0))
    return built
