"""A controller for every task, from what it observes and nothing else.

Chair numbers are the manual chair's (models/manual/README.md). Gains were chosen by hand.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjchair.errors import MjchairError, nearest
from mjchair.tasks import follow_path, ramp_hold, slalom, tight_turn

Array = NDArray[np.float64]
Observation = Mapping[str, Array]
Controller = Callable[[Observation], Array]

RADIUS, TRACK, MASS, AHEAD = 0.30, 0.56, 90.0, 0.12  # m, m, kg, m of the mass before the axle
SPEED_GAIN = 30.0  # N m each per m/s
YAW_GAIN = 12.0  # N m each per rad/s


@dataclass
class Drive:
    """Torques for a speed and a yaw rate.

    Attributes:
      integral: N m each, of the speed error. integral_gain: N m each per m.
      yaw_gain: N m each per rad/s.
      lateral: cancel the moment that the rear tires' lateral forces make about the centre of
        mass, which lies before the axle: on a cross slope and in a curve they turn the chair.
    """

    integral: float = 0.0
    integral_gain: float = 6.0
    yaw_gain: float = YAW_GAIN
    lateral: bool = False

    def __call__(self, seen: Observation, speed: float, yaw_rate: float) -> Array:
        """Torques (2,), N m, towards a speed (m/s) and a yaw rate (rad/s)."""
        error = speed - float(seen["speed"][0])
        self.integral = float(np.clip(self.integral + 0.02 * self.integral_gain * error, -30, 30))
        common = SPEED_GAIN * error + self.integral
        turn = self.yaw_gain * (yaw_rate - float(seen["yaw_rate"][0]))
        if self.lateral:
            moment = AHEAD * float(seen["lateral_forces"].sum())
            turn += moment * RADIUS / TRACK
        return np.array([common - turn, common + turn])


def straight_line(seen: Observation, drive: Drive) -> Array:
    """Steer back to the line, slow down before the goal."""
    heading = float(seen["direction"][0])
    x, y = seen["goal"]
    to_go = math.cos(heading) * x - math.sin(heading) * y
    left = -(math.sin(heading) * x + math.cos(heading) * y)
    speed = float(np.clip(0.9 * to_go, -0.3, 1.0))
    return drive(seen, speed, -1.5 * heading - 1.0 * left)


def pursue(seen: Observation, drive: Drive, speed: float, which: int) -> Array:
    """Turn towards the `which`-th point ahead on the path (pure pursuit)."""
    x, y = seen["path_ahead"][2 * which : 2 * which + 2]
    curvature = 2.0 * y / max(x * x + y * y, 1e-3)
    now = max(float(seen["speed"][0]), 0.2)
    return drive(seen, speed, float(np.clip(now * curvature, -2.5, 2.5)))


def ramp_up(seen: Observation, drive: Drive) -> Array:
    """Creep to the goal and stand there on the motors."""
    speed = float(np.clip(1.5 * seen["goal"][0], -0.5, 0.5))
    turn = -1.5 * float(seen["direction"][0]) - 0.8 * float(seen["drift"][0])
    return drive(seen, speed, turn)


def push(seen: Observation, drive: Drive) -> Array:
    """Stronger strokes when slow, a stronger hand to steer with."""
    common = float(np.clip(7.0 - 22.0 * seen["excess"][0], 0.0, 22.0))
    turn = -10.0 * (float(seen["direction"][0]) + 0.5 * float(seen["drift"][0]))
    turn -= 4.0 * float(seen["yaw_rate"][0])
    return np.clip([common - turn, common + turn], 0.0, 25.0)


def _lift(grade: float) -> float:
    """Torque each (N m) that holds the chair on a grade."""
    return 0.5 * MASS * 9.81 * math.sin(math.atan(grade)) * RADIUS


RULES: Mapping[str, tuple[Callable[..., Array], dict[str, Any], dict[str, Any]]] = {
    # name -> rule, its own arguments, those of Drive
    "straight_line": (straight_line, {}, {}),
    "follow_path": (pursue, {"speed": follow_path.SPEED, "which": 1}, {"lateral": True}),
    "slalom": (pursue, {"speed": slalom.SPEED, "which": 1}, {"lateral": True}),
    "tight_turn": (pursue, {"speed": tight_turn.SPEED, "which": 0}, {}),
    "ramp_hold": (
        ramp_up,
        {},
        {"integral": _lift(ramp_hold.GRADE), "integral_gain": 60.0},
    ),
    "push": (push, {}, {}),
}


def baseline(name: str, **drive: Any) -> Controller:
    """A fresh controller for one episode of a task.

    Args:
      name: of the task. drive: fields of Drive in place of its own, such as lateral=False.

    Raises:
      MjchairError: an unknown task.
    """
    if name not in RULES:
        raise MjchairError(f"no baseline for task {name!r}" + nearest(name, RULES))
    rule, arguments, chosen = RULES[name]
    driver = Drive(**{**chosen, **drive})
    return lambda seen: rule(seen, driver, **arguments)
