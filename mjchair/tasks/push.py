"""The task `push`: manual propulsion, in which two hands push on the rims, let go and return.

In: peak torques of the next strokes. Out: the task (observations, reward, and the torques of the
strokes) and its scene.
"""

from __future__ import annotations

import math

import mujoco
import numpy as np
from dm_control.utils import rewards
from dm_env import specs
from numpy.typing import NDArray

from mjchair.model.spec import load_spec
from mjchair.tasks import arena
from mjchair.tasks.arena import CONTROL_STEP
from mjchair.tasks.physics import REAR, Physics
from mjchair.tasks.quantity import Quantity
from mjchair.tasks.task import ChairTask

TIME_LIMIT = 15.0  # s
PUSH = 0.40  # s, with the hand on the rim; assumption within the published 0.25-0.45 of 1.15 s
RECOVERY = 0.55  # s, with the hand off the rim, at least; assumption
TRIGGER = 1.0  # N m, smallest peak torque that begins a stroke
PEAK = 25.0  # N m; measured push-rim moments on level ground have peaks of 10-20 N m
SPEEDS = (0.7, 1.2)  # m/s, range of the target speed
AVERAGING_TIME = 1.5  # s, of the mean speed that decides whether the task is solved

Array = NDArray[np.float64]


class Push(ChairTask):
    """Keep a target speed on a straight line by push strokes.

    An action is the peak torque of the next stroke of each hand. A free hand begins its stroke when
    the peak is at least 1 N m. The torque of a stroke is peak sin^2(pi t / 0.4 s); then the hand is
    off the rim for 0.55 s. Actions during this time have no effect.

    The reward is high at the target speed and on the line; full effort lowers it by a fifth.

    Attributes:
      target: speed, m/s. since: (2,), time since each hand's last stroke began, s.
      peaks: (2,), of the last strokes, N m. effort: time integral of both torques, N m s.
    """

    torque = PEAK

    def __init__(self, random: np.random.RandomState | int | None = None) -> None:
        """Begin with the task's random state, or a seed for one."""
        self.target, self.effort = 1.0, 0.0
        self.since, self.peaks = np.full(2, 2.0), np.zeros(2)
        self._mean_speed = 0.0
        super().__init__(random=random)

    def own_quantities(self) -> tuple[Quantity, ...]:
        """Differences from the target speed and from the line, and the state of the hands."""
        return (
            Quantity("excess", "m/s", -5.0, 5.0, "speed above the target speed", self.excess),
            Quantity("drift", "m", -5.0, 5.0, "distance to the left of the line", self.drift),
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
                "left, right: rises from -1 to 0 in the stroke, then to 1 until the hand is free",
                self.hands,
                2,
            ),
        )

    def action_spec(self, physics: Physics) -> specs.BoundedArray:
        """Peak torque of the next stroke of the left and the right hand, N m."""
        return specs.BoundedArray((2,), np.float64, np.zeros(2), np.full(2, PEAK), "\t".join(REAR))

    def begin(self, physics: Physics) -> None:
        """Place the chair at rest with free hands, and draw the target speed."""
        super().begin(physics)
        self.target = float(self.random.uniform(*SPEEDS))
        self.since, self.peaks, self.effort = np.full(2, PUSH + RECOVERY), np.zeros(2), 0.0
        self._mean_speed = 0.0
        arena.move_goal(physics, 0.0)

    def torques(self, action: Array, physics: Physics) -> Array:
        """Torques (2,), N m, of the strokes; free hands begin a new stroke as the action says."""
        peaks = np.clip(action, 0.0, PEAK)
        begins = (self.since >= PUSH + RECOVERY - 1e-9) & (peaks >= TRIGGER)
        self.peaks[begins] = peaks[begins]
        self.since[begins] = 0.0
        on_rim = self.since < PUSH
        return np.where(on_rim, self.peaks * np.sin(math.pi * self.since / PUSH) ** 2, 0.0)

    def after_step(self, physics: Physics) -> None:
        """Move the hands and the plate, and update the effort and the mean speed."""
        arena.move_goal(physics, self.target * physics.time())
        step = CONTROL_STEP
        torque = [float(physics.named.data.ctrl[wheel]) for wheel in REAR]
        self.effort += step * sum(torque)
        self.since = np.minimum(self.since + step, PUSH + RECOVERY)
        self._mean_speed += (physics.speed() - self._mean_speed) * step / AVERAGING_TIME
        super().after_step(physics)

    def hands(self, physics: Physics) -> Array:
        """State of each hand (2,), between -1 and 1; see own_quantities."""
        stroke = self.since / PUSH - 1.0
        return np.where(self.since < PUSH, stroke, (self.since - PUSH) / RECOVERY)

    def excess(self, physics: Physics) -> float:
        """Speed above the target speed, m/s."""
        return physics.speed() - self.target

    def drift(self, physics: Physics) -> float:
        """Distance to the left of the line, m."""
        return float(physics.position()[1])

    def get_reward(self, physics: Physics) -> float:
        """The reward, between 0 and 1."""
        quick = rewards.tolerance(self.excess(physics), (-0.15, 0.15), margin=0.7)
        straight = rewards.tolerance(self.drift(physics), (-0.2, 0.2), margin=1.0)
        torque = [float(physics.named.data.ctrl[wheel]) for wheel in REAR]
        effort = float(np.mean(np.square(torque))) / PEAK**2
        return float(quick * straight * (1.0 - 0.2 * effort))

    def solved(self, physics: Physics) -> bool:
        """Whether the mean speed is within 15 % of the target, and the chair 0.4 m of the line."""
        error = abs(self._mean_speed - self.target)
        return bool(error < 0.15 * self.target and abs(self.drift(physics)) < 0.4)


def spec() -> mujoco.MjSpec:
    """The manual chair on a level floor, with a line and a plate that moves at the target speed."""
    built = load_spec()
    arena.add_line(built, SPEEDS[1] * TIME_LIMIT)
    arena.add_goal(built, half=(0.05, 0.4))
    return built
