"""Manual propulsion: hands push on the rims, let go, and come back; effort costs."""

from __future__ import annotations

import math

import mujoco
import numpy as np
from dm_control.utils import rewards
from dm_env import specs
from numpy.typing import NDArray

from mjchair.model.spec import load_spec
from mjchair.tasks.arena import CONTROL_STEP
from mjchair.tasks.physics import REAR, Physics
from mjchair.tasks.quantity import Quantity
from mjchair.tasks.task import ChairTask

TIME_LIMIT = 15.0  # s
PUSH = 0.40  # s, hand on the rim; assumption within the published 0.25-0.45 of a 1.15 s cycle
RECOVERY = 0.55  # s, at least, until the hand can push again; assumption
TRIGGER = 1.0  # N m, less than which is no push
PEAK = 25.0  # N m; measured push-rim moments of level pushing peak at 10-20 N m
SPEEDS = (0.7, 1.2)  # m/s, of the speed asked for

Array = NDArray[np.float64]


class Push(ChairTask):
    """Keep a speed on the straight with strokes.

    An action is the peak torque of the next stroke of each hand. A hand that is free takes it up
    (from 1 N m on); the stroke is peak sin^2(pi t / 0.4 s), and its hand is then away for 0.55 s,
    whatever the action says.

    Reward: at the asked speed and on the line, less a fifth for full effort.

    Attributes:
      target: speed asked for, m/s. since: (2,) since each stroke began, s. peaks: (2,) N m.
      effort: integral of both hands' torques, N m s.
    """

    torque = PEAK

    def __init__(self, random: np.random.RandomState | int | None = None) -> None:
        """Begin with the task's random state, or a seed for one."""
        self.target, self.effort = 1.0, 0.0
        self.since, self.peaks = np.full(2, 2.0), np.zeros(2)
        self._mean = 0.0
        super().__init__(random=random)

    def own_quantities(self) -> tuple[Quantity, ...]:
        """The speed asked for, the line and the hands."""
        return (
            Quantity("excess", "m/s", -5.0, 5.0, "speed above the one asked for", self.excess),
            Quantity("drift", "m", -5.0, 5.0, "to the left of the line", self.drift),
            Quantity(
                "direction",
                "rad",
                -math.pi,
                math.pi,
                "heading of the chair from the line's direction",
                Physics.heading,
            ),
            Quantity(
                "hands",
                "1",
                -1.0,
                1.0,
                "each hand: -1 to 0 through its stroke, 0 to 1 until it is free again",
                self.hands,
                2,
            ),
        )

    def action_spec(self, physics: Physics) -> specs.BoundedArray:
        """Peak torque of the next stroke of the left and the right hand, N m."""
        return specs.BoundedArray((2,), np.float64, np.zeros(2), np.full(2, PEAK), "\t".join(REAR))

    def begin(self, physics: Physics) -> None:
        """At rest, hands free, another speed to reach."""
        super().begin(physics)
        self.target = float(self.random.uniform(*SPEEDS))
        self.since, self.peaks, self.effort = np.full(2, PUSH + RECOVERY), np.zeros(2), 0.0
        self._mean = 0.0

    def torques(self, action: Array, physics: Physics) -> Array:
        """What the hands do now: begin strokes where they may, go on with those begun."""
        asked = np.clip(action, 0.0, PEAK)
        free = (self.since >= PUSH + RECOVERY - 1e-9) & (asked >= TRIGGER)
        self.peaks[free] = asked[free]
        self.since[free] = 0.0
        on = self.since < PUSH
        return np.where(on, self.peaks * np.sin(math.pi * self.since / PUSH) ** 2, 0.0)

    def after_step(self, physics: Physics) -> None:
        """Let the hands move on, and keep the mean speed of the last seconds."""
        step = CONTROL_STEP
        torque = [float(physics.named.data.ctrl[wheel]) for wheel in REAR]
        self.effort += step * sum(torque)
        self.since = np.minimum(self.since + step, PUSH + RECOVERY)
        self._mean += (physics.speed() - self._mean) * step / 1.5
        super().after_step(physics)

    def hands(self, physics: Physics) -> Array:
        """Phase of each hand; see own_quantities."""
        stroke = self.since / PUSH - 1.0
        return np.where(self.since < PUSH, stroke, (self.since - PUSH) / RECOVERY)

    def excess(self, physics: Physics) -> float:
        """Speed above the one asked for, m/s."""
        return physics.speed() - self.target

    def drift(self, physics: Physics) -> float:
        """To the left of the line, m."""
        return float(physics.position()[1])

    def get_reward(self, physics: Physics) -> float:
        """In [0, 1]."""
        quick = rewards.tolerance(self.excess(physics), (-0.15, 0.15), margin=0.7)
        straight = rewards.tolerance(self.drift(physics), (-0.2, 0.2), margin=1.0)
        torque = [float(physics.named.data.ctrl[wheel]) for wheel in REAR]
        effort = float(np.mean(np.square(torque))) / PEAK**2
        return float(quick * straight * (1.0 - 0.2 * effort))

    def solved(self, physics: Physics) -> bool:
        """The mean speed of the last seconds within 15 %, and within 0.4 m of the line."""
        return bool(
            abs(self._mean - self.target) < 0.15 * self.target and abs(self.drift(physics)) < 0.4
        )


def spec() -> mujoco.MjSpec:
    """The manual chair on a level floor."""
    return load_spec()
