"""Start up a ramp, hold there without brakes, and go on."""

from __future__ import annotations

import math

import mujoco
import numpy as np
from dm_control.utils import rewards

from mjchair.model.spec import load_spec
from mjchair.tasks.physics import Physics
from mjchair.tasks.quantity import Quantity
from mjchair.tasks.task import ChairTask

TIME_LIMIT = 14.0  # s
GRADE = 1.0 / 12.0  # rise over run
HOLD = (4.0, 9.0)  # s, within which the first goal has to be held
NEAR = 0.05  # m


class RampHold(ChairTask):
    """Reward: at the goal along the slope, and slow where it is to hold.

    The first goal is 1 m up the slope (varied by 0.2 m); after the hold the second lies 1 m
    further.

    Attributes:
      goals: of both parts, m along the slope. strayed: largest error while holding, m.
    """

    torque = 40.0

    def __init__(self, random: np.random.RandomState | int | None = None) -> None:
        """Begin with the task's random state, or a seed for one."""
        self.goals, self.strayed = (1.0, 2.0), 0.0
        super().__init__(random=random)

    def own_quantities(self) -> tuple[Quantity, ...]:
        """The goal and how long it stays."""
        return (
            Quantity("goal", "m", -5.0, 5.0, "distance to go along the slope", self.to_go),
            Quantity("drift", "m", -5.0, 5.0, "to the left of the middle of the ramp", self.drift),
            Quantity(
                "direction",
                "rad",
                -math.pi,
                math.pi,
                "heading of the chair from straight up the slope",
                Physics.heading,
            ),
            Quantity("time_left", "s", 0.0, HOLD[1], "until the goal moves on", self.time_left),
        )

    def begin(self, physics: Physics) -> None:
        """On the slope; wheels free. It may roll from the first moment."""
        assert self._settled is not None
        physics.data.qpos[:], physics.data.act[:] = self._settled
        physics.data.qvel[:] = 0.0
        first = 1.0 + self.random.uniform(-0.2, 0.2)
        self.goals, self.strayed = (first, first + 1.0), 0.0

    def along(self, physics: Physics) -> float:
        """Distance up the slope from the start, m."""
        return float(physics.position()[0] * math.hypot(1.0, GRADE))

    def to_go(self, physics: Physics) -> float:
        """To the goal of now, along the slope, m."""
        goal = self.goals[physics.time() >= HOLD[1]]
        return float(goal - self.along(physics))

    def drift(self, physics: Physics) -> float:
        """Across the slope, m."""
        return float(physics.position()[1])

    def time_left(self, physics: Physics) -> float:
        """Until the goal moves on, s; 0 when it has."""
        return max(0.0, HOLD[1] - float(physics.time()))

    def after_step(self, physics: Physics) -> None:
        """Keep the largest error of the hold."""
        if HOLD[0] <= physics.time() < HOLD[1]:
            self.strayed = max(self.strayed, abs(self.to_go(physics)))
        super().after_step(physics)

    def get_reward(self, physics: Physics) -> float:
        """In [0, 1]."""
        error = self.to_go(physics)
        near = rewards.tolerance(error, (-NEAR, NEAR), margin=1.0)
        there = rewards.tolerance(error, (-NEAR, NEAR), margin=0.1)
        still = rewards.tolerance(physics.speed(), (-0.01, 0.01), margin=0.3)
        middle = rewards.tolerance(self.drift(physics), (-0.1, 0.1), margin=0.5)
        return float(middle * near * (1.0 - there + there * still))

    def solved(self, physics: Physics) -> bool:
        """At the second goal, having held the first one within 5 cm."""
        late = physics.time() > HOLD[1]
        return bool(late and self.strayed < NEAR and abs(self.to_go(physics)) < NEAR)


def spec() -> mujoco.MjSpec:
    """The manual chair on a ramp of 1:12."""
    return load_spec(scene="ramp", grade=GRADE)
