"""The task `ramp_hold`: drive up a ramp, stay there without brakes, and drive on.

In: two torques. Out: the task (observations, reward and goals) and its scene.
"""

from __future__ import annotations

import math

import mujoco
import numpy as np
from dm_control.utils import rewards

from mjchair.model.spec import load_spec
from mjchair.tasks import arena
from mjchair.tasks.physics import Physics
from mjchair.tasks.quantity import Quantity
from mjchair.tasks.task import ChairTask

TIME_LIMIT = 14.0  # s
GRADE = 1.0 / 12.0  # rise over run
HOLD = (4.0, 9.0)  # s, begin and end of the time in which the chair has to stay at the first goal
NEAR = 0.05  # m; a chair within this distance is at the goal


class RampHold(ChairTask):
    """The reward is high near the present goal, and highest at rest there.

    The first goal is 1 m up the slope, with a random difference of at most 0.2 m. After 9 s the
    goal is 1 m further up.

    Attributes:
      goals: the two goals, m along the slope.
      strayed: largest distance from the first goal between 4 and 9 s, m.
    """

    torque = 40.0

    def __init__(self, random: np.random.RandomState | int | None = None) -> None:
        """Begin with the task's random state, or a seed for one."""
        self.goals, self.strayed = (1.0, 2.0), 0.0
        super().__init__(random=random)

    def own_quantities(self) -> tuple[Quantity, ...]:
        """Differences from the present goal and from the middle, and how long the goal stays."""
        return (
            Quantity("goal", "m", -5.0, 5.0, "distance to the goal, up the slope", self.to_go),
            Quantity(
                "drift", "m", -5.0, 5.0, "distance to the left of the ramp's middle", self.drift
            ),
            Quantity(
                "direction",
                "rad",
                -math.pi,
                math.pi,
                "heading of the chair from straight up the slope",
                Physics.heading,
            ),
            Quantity("time_left", "s", 0.0, HOLD[1], "time until the goal changes", self.time_left),
        )

    def begin(self, physics: Physics) -> None:
        """Place the chair on the slope with free wheels: without torque it rolls back at once."""
        assert self._settled is not None
        physics.data.qpos[:], physics.data.act[:] = self._settled
        physics.data.qvel[:] = 0.0
        first = 1.0 + self.random.uniform(-0.2, 0.2)
        self.goals, self.strayed = (first, first + 1.0), 0.0
        self.show_goal(physics)

    def along(self, physics: Physics) -> float:
        """Distance up the slope from the start, m."""
        return float(physics.position()[0] * math.hypot(1.0, GRADE))

    def to_go(self, physics: Physics) -> float:
        """Distance to the present goal, positive up the slope, m."""
        return float(self.goal(physics) - self.along(physics))

    def goal(self, physics: Physics) -> float:
        """The present goal, m along the slope from the origin."""
        return float(self.goals[physics.time() >= HOLD[1]])

    def show_goal(self, physics: Physics) -> None:
        """Move the plate that pictures show to the present goal."""
        arena.move_goal(physics, self.goal(physics) / math.hypot(1.0, GRADE), GRADE)

    def drift(self, physics: Physics) -> float:
        """Distance to the left of the ramp's middle, m."""
        return float(physics.position()[1])

    def time_left(self, physics: Physics) -> float:
        """Time until the goal changes, s; 0 after that."""
        return max(0.0, HOLD[1] - float(physics.time()))

    def after_step(self, physics: Physics) -> None:
        """Show the present goal, and update the largest distance from the first one."""
        self.show_goal(physics)
        if HOLD[0] <= physics.time() < HOLD[1]:
            self.strayed = max(self.strayed, abs(self.to_go(physics)))
        super().after_step(physics)

    def get_reward(self, physics: Physics) -> float:
        """The reward, between 0 and 1."""
        error = self.to_go(physics)
        near = rewards.tolerance(error, (-NEAR, NEAR), margin=1.0)
        there = rewards.tolerance(error, (-NEAR, NEAR), margin=0.1)
        still = rewards.tolerance(physics.speed(), (-0.01, 0.01), margin=0.3)
        middle = rewards.tolerance(self.drift(physics), (-0.1, 0.1), margin=0.5)
        return float(middle * near * (1.0 - there + there * still))

    def solved(self, physics: Physics) -> bool:
        """Whether the chair is at the second goal and stayed within 5 cm of the first one."""
        late = physics.time() > HOLD[1]
        return bool(late and self.strayed < NEAR and abs(self.to_go(physics)) < NEAR)


def spec() -> mujoco.MjSpec:
    """The manual chair on a ramp of 1:12, with a line in its middle and a plate at the goal."""
    built = load_spec(scene="ramp", grade=GRADE)
    arena.add_line(built, 3.0, GRADE)
    arena.add_goal(built, half=(NEAR, 0.4), grade=GRADE)
    return built
