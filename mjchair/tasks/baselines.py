"""Controllers that solve the tasks: one for each, by hand-made rules.

In: the name of a task. Out: a controller, which turns an observation into an action. A controller
uses what the task observes, and the radius, track and masses of the chair from its model. The gains
were chosen by hand for the manual chair.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.drive.quantities import Drive as ChairDrive
from mjchair.errors import MjchairError, nearest
from mjchair.model.mass_distribution import mass_distribution
from mjchair.model.rolling import rear_axle
from mjchair.model.spec import load_drive
from mjchair.model.visual_geoms import without_visual_geoms
from mjchair.tasks import (
    follow_path,
    joystick,
    power_doorway,
    power_slalom,
    ramp_hold,
    slalom,
    suite,
    tight_turn,
)
from mjchair.tasks.arena import CONTROL_STEP

Array = NDArray[np.float64]
Observation = Mapping[str, Array]
Controller = Callable[[Observation], Array]

SPEED_GAIN = 30.0  # N m on each wheel per m/s
YAW_GAIN = 12.0  # N m on each wheel per rad/s
LARGEST_INTEGRAL = 30.0  # N m on each wheel


@dataclass
class Drive:
    """Torques on the rear wheels for a wanted speed and yaw rate.

    A PI controller for the speed and a P controller for the yaw rate. `Drive.of` takes the numbers
    of the chair from a model.

    Attributes:
      radius: of the rear wheels, m. track: between them, m.
      arm: of the centre of mass before the rear axle, m.
      integral: of the speed error, N m on each wheel; changes at every call.
      integral_gain: N m on each wheel per m. yaw_gain: N m on each wheel per rad/s.
      lateral: whether to cancel the yaw moment of the rear tires' lateral forces. They act behind
        the centre of mass, so they turn the chair on a cross slope and in a curve.
    """

    radius: float
    track: float
    arm: float
    integral: float = 0.0
    integral_gain: float = 6.0
    yaw_gain: float = YAW_GAIN
    lateral: bool = False

    @classmethod
    def of(cls, model: mujoco.MjModel, **settings: Any) -> Drive:
        """A drive for the chair in a compiled model.

        Args:
          model: with one chair. settings: other fields than radius, track and arm.
        """
        axle = rear_axle(model)
        arm = mass_distribution(model).ahead
        return cls(0.5 * (axle.left + axle.right), axle.track, arm, **settings)

    def __call__(self, observation: Observation, speed: float, yaw_rate: float) -> Array:
        """Torques (2,), N m, of the left and right wheel for a speed (m/s) and yaw rate (rad/s)."""
        error = speed - float(observation["speed"][0])
        integral = self.integral + CONTROL_STEP * self.integral_gain * error
        self.integral = float(np.clip(integral, -LARGEST_INTEGRAL, LARGEST_INTEGRAL))
        common = SPEED_GAIN * error + self.integral
        turn = self.yaw_gain * (yaw_rate - float(observation["yaw_rate"][0]))
        if self.lateral:
            moment = self.arm * float(observation["lateral_forces"].sum())
            turn += moment * self.radius / self.track
        return np.array([common - turn, common + turn])


def holding_torque(model: mujoco.MjModel, grade: float) -> float:
    """Torque on each rear wheel that holds the chair of a model on a grade (rise over run), N m."""
    axle = rear_axle(model)
    gravity = float(np.linalg.norm(model.opt.gravity))
    force = mass_distribution(model).mass * gravity * math.sin(math.atan(grade))
    return 0.5 * force * 0.5 * (axle.left + axle.right)


def straight_line(observation: Observation, drive: Drive) -> Array:
    """Steer towards the line, and slow down before the goal."""
    heading = float(observation["direction"][0])
    x, y = observation["goal"]
    to_go = math.cos(heading) * x - math.sin(heading) * y
    left = -(math.sin(heading) * x + math.cos(heading) * y)
    speed = float(np.clip(0.9 * to_go, -0.3, 1.0))
    return drive(observation, speed, -1.5 * heading - 1.0 * left)


def pursue(observation: Observation, drive: Drive | Joystick, speed: float, which: int) -> Array:
    """Drive on the arc to a point ahead on the path (pure pursuit).

    Args:
      observation: of a task with a path. drive: makes the torques. speed: wanted, m/s.
      which: number of the point in `path_ahead`, from 0.
    """
    x, y = observation["path_ahead"][2 * which : 2 * which + 2]
    curvature = 2.0 * y / max(x * x + y * y, 1e-3)
    speed_now = max(float(observation["speed"][0]), 0.2)
    return drive(observation, speed, float(np.clip(speed_now * curvature, -2.5, 2.5)))


def ramp_up(observation: Observation, drive: Drive) -> Array:
    """Drive slowly to the goal, and stay there by the torques of the wheels."""
    speed = float(np.clip(1.5 * observation["goal"][0], -0.5, 0.5))
    yaw_rate = -1.5 * float(observation["direction"][0]) - 0.8 * float(observation["drift"][0])
    return drive(observation, speed, yaw_rate)


def push(observation: Observation, drive: Drive) -> Array:
    """Push the harder the slower the chair is, and harder on one side to steer."""
    common = float(np.clip(7.0 - 22.0 * observation["excess"][0], 0.0, 22.0))
    turn = -10.0 * (float(observation["direction"][0]) + 0.5 * float(observation["drift"][0]))
    turn -= 4.0 * float(observation["yaw_rate"][0])
    return np.clip([common - turn, common + turn], 0.0, 25.0)


@dataclass
class Joystick:
    """Deflections of a power chair's joystick for a wanted speed and yaw rate.

    The chair's controller does most of it; a proportional part takes out what is left.

    Attributes:
      drive: of the chair. speed_gain, yaw_gain: wanted more per error, 1.
    """

    drive: ChairDrive
    speed_gain: float = 0.5
    yaw_gain: float = 0.8

    def __call__(self, observation: Observation, speed: float, yaw_rate: float) -> Array:
        """Deflections (2,) for a speed (m/s) and yaw rate (rad/s)."""
        slow = speed - float(observation["speed"][0])
        late = yaw_rate - float(observation["yaw_rate"][0])
        asked = speed + self.speed_gain * slow, yaw_rate + self.yaw_gain * late
        return np.array(self.drive.joystick(*asked))


@dataclass(frozen=True)
class Rule:
    """How the controller of a task is made.

    Attributes:
      act: (observation, drive, **arguments) -> action. arguments: the further arguments of `act`.
      settings: fields of Drive that differ from its defaults.
      grade: of the floor, rise over run; the integral starts with the torque that holds there.
      joystick: the action is a joystick's.
    """

    act: Callable[..., Array]
    arguments: Mapping[str, Any] = field(default_factory=dict)
    settings: Mapping[str, Any] = field(default_factory=dict)
    grade: float = 0.0
    joystick: bool = False


RULES: Mapping[str, Rule] = {
    "straight_line": Rule(straight_line),
    "follow_path": Rule(pursue, {"speed": follow_path.SPEED, "which": 1}, {"lateral": True}),
    "slalom": Rule(pursue, {"speed": slalom.SPEED, "which": 1}, {"lateral": True}),
    "tight_turn": Rule(pursue, {"speed": tight_turn.SPEED, "which": 0}),
    "ramp_hold": Rule(ramp_up, settings={"integral_gain": 60.0}, grade=ramp_hold.GRADE),
    "push": Rule(push),
    "power_slalom": Rule(pursue, {"speed": power_slalom.SPEED, "which": 2}, joystick=True),
    "power_doorway": Rule(pursue, {"speed": power_doorway.SPEED, "which": 2}, joystick=True),
}


def baseline(name: str, model: mujoco.MjModel | None = None, **settings: Any) -> Controller:
    """A controller for one episode of a task.

    Args:
      name: of the task.
      model: with the chair that is driven, `environment.physics.model.ptr`; None: the task's own.
      settings: fields of Drive that replace those of the task's rule, such as lateral=False.

    Returns:
      A function: observation -> action.

    Raises:
      MjchairError: an unknown task.
    """
    if name not in RULES:
        raise MjchairError(f"no baseline for task {name!r}" + nearest(name, RULES))
    rule = RULES[name]
    if rule.joystick:
        stick = Joystick(load_drive(joystick.CHAIR, joystick.PROFILE), **settings)
        return lambda observation: rule.act(observation, stick, **rule.arguments)
    chair = _model(name) if model is None else model
    integral = holding_torque(chair, rule.grade)
    drive = Drive.of(chair, **{"integral": integral, **rule.settings, **settings})
    return lambda observation: rule.act(observation, drive, **rule.arguments)


@functools.cache
def _model(name: str) -> mujoco.MjModel:
    """The compiled model of a task, without what is only seen."""
    return without_visual_geoms(suite.find(name).spec()).compile()
