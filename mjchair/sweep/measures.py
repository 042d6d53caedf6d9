"""Measures of a simulation: the few numbers that a sweep keeps of each run.

In: sensor channels and controls of one run (`Sensed`). Out: name -> number, in the units of UNITS.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import mujoco
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Sensed:
    """The time series of one simulation.

    Attributes:
      time: (n,), s; sample k of every channel belongs to time[k].
      channels: scalar sensor channels, name -> (n,), SI (see mjchair.simulation.channels).
      controls: actuator -> (n,); torque about the axle for wheels, N m.
      case: the values of the case, name -> value.
      model: the compiled model that was simulated, where it is known.
    """

    time: Array
    channels: Mapping[str, Array]
    controls: Mapping[str, Array]
    case: Mapping[str, float | int | str] = field(default_factory=dict)
    model: mujoco.MjModel | None = None

    @property
    def step(self) -> float:
        """Time between two samples, s."""
        return float(self.time[1] - self.time[0])


# measure of `standard` -> its unit
UNITS = {
    "distance": "m",
    "turned": "rad",
    "work": "J",
    "effort": "N m s",
    "energy_per_metre": "J/m",
    "energy_per_radian": "J/rad",
    "deceleration": "m/s^2",
    "mean_speed": "m/s",
    "end_x": "m",
    "end_y": "m",
    "largest_slip_angle": "rad",
    "least_load": "N",
}
WHEELS = ("left_wheel", "right_wheel", "left_caster", "right_caster")


def standard(sensed: Sensed) -> dict[str, float]:
    """Distance, energy and effort of a run; UNITS has their units.

    - distance: length of the path of the rear axle's middle. turned: change of the heading,
      including full turns.
    - work: work of the drive torques. effort: time integral of their absolute values, both wheels.
    - energy_per_metre: work over distance; energy_per_radian: work over the absolute value of
      `turned`. NaN where the chair did not move or turn by more than 1e-3 (m, rad).
    - deceleration: (v0^2 - v1^2) / (2 distance), with the speeds at the start and at the end. For a
      chair that coasts it is drag over mass. NaN where it did not move by more than 1e-3 m.
    - mean_speed: forward speed. end_x, end_y: position at the end, world.
    - largest_slip_angle, least_load: over all four wheels, after the first 0.2 s.
    """
    channels, step = sensed.channels, sensed.step
    x, y = channels["position.x"], channels["position.y"]
    distance = float(np.hypot(np.diff(x), np.diff(y)).sum())
    turns = np.diff(channels["heading"])
    turned = float(turns.sum() - 2.0 * math.pi * np.round(turns / (2.0 * math.pi)).sum())
    work = effort = 0.0
    for wheel, torque in sensed.controls.items():
        # not np.dot: its order of summation, hence the last bit, depends on the stride of the array
        work += float((torque * channels[f"{wheel}_speed"]).sum()) * step
        effort += float(np.abs(torque).sum()) * step
    speed = channels["velocity.x"]
    settled = min(round(0.2 / step), len(x) - 1)
    tan_alpha = [np.abs(channels[f"{w}_tire.tan_alpha"][settled:]).max() for w in WHEELS]
    loads = [channels[f"{w}_tire.Fz"][settled:].min() for w in WHEELS]
    return {
        "distance": distance,
        "turned": turned,
        "work": work,
        "effort": effort,
        "energy_per_metre": work / distance if distance > 1e-3 else math.nan,
        "energy_per_radian": work / abs(turned) if abs(turned) > 1e-3 else math.nan,
        "deceleration": float(speed[0] ** 2 - speed[-1] ** 2) / (2.0 * distance)
        if distance > 1e-3
        else math.nan,
        "mean_speed": float(speed.mean()),
        "end_x": float(x[-1]),
        "end_y": float(y[-1]),
        "largest_slip_angle": math.atan(float(max(tan_alpha))),
        "least_load": float(min(loads)),
    }
