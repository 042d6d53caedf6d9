"""Drive inputs: what each actuator is given, over time."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjchair.errors import MjchairError, nearest
from mjchair.model.wheels import base_name
from mjchair.simulation import names
from mjchair.simulation.table import Array, check_time, frozen, read_table

# Period of a push cycle, s, and the share of it in which the hand is on the rim, 1: overground
# pushing at a self-chosen speed near 1 m/s (period from the SmartWheel recording in data/;
# the share is an assumption within the published 0.25-0.45).
PUSH_PERIOD = 1.15
PUSH_SHARE = 0.4


@dataclass(frozen=True)
class Inputs:
    """Controls of named actuators over time; for wheels, torque about the axle in N m.

    Between samples a control is interpolated linearly. Outside the times of its own samples it is
    zero: nothing drives the chair before the first sample or after the last one.

    Attributes:
      time: (n,), s, strictly increasing.
      controls: actuator name -> (n,), NaN where a sample is missing; names without the prefix that
        attachment gives are accepted.
      source: where they come from, for error lines.

    Raises:
      MjchairError: time that does not increase, a control of another length or not finite, or
        with no samples at all.
    """

    time: Array
    controls: Mapping[str, Array]
    source: str = "inputs"

    def __post_init__(self) -> None:
        """Freeze the arrays and check them."""
        time = frozen(self.time)
        if time.ndim != 1 or time.size == 0:
            raise MjchairError(f"{self.source}: no samples; inputs need at least one")
        check_time(time, self.source)
        controls = {name: frozen(values) for name, values in self.controls.items()}
        for name, values in controls.items():
            if values.shape != time.shape:
                raise MjchairError(
                    f"{self.source}: {name} has shape {values.shape}; time has {time.shape}"
                )
            if np.isinf(values).any() or np.isnan(values).all():
                raise MjchairError(f"{self.source}: {name} has no finite samples, or infinite ones")
        object.__setattr__(self, "time", time)
        object.__setattr__(self, "controls", MappingProxyType(controls))

    @property
    def end(self) -> float:
        """Time of the last sample, s."""
        return float(self.time[-1])

    def at(self, name: str, time: ArrayLike) -> NDArray[np.float64]:
        """The control `name` at the times given (s), of their shape."""
        there = ~np.isnan(self.controls[name])
        known = self.time[there], self.controls[name][there]
        return np.interp(np.asarray(time, float), *known, left=0.0, right=0.0)

    def control_array(self, model: mujoco.MjModel, time: ArrayLike) -> NDArray[np.float64]:
        """Controls of every actuator of the model at the times given.

        Args:
          model: whose actuators are driven.
          time: (n,), s.

        Returns:
          (n, nu); zero for actuators that these inputs do not name.

        Raises:
          MjchairError: an actuator that the model does not have.
        """
        known = names.actuators(model)
        out = np.zeros((np.size(time), model.nu))
        for name in self.controls:
            out[:, self._actuator(model, name, known)] = self.at(name, time)
        return out

    def _actuator(self, model: mujoco.MjModel, name: str, known: list[str]) -> int:
        index = names.find(name, known, "actuator")
        if model.actuator_dyntype[index] == mujoco.mjtDyn.mjDYN_USER:
            raise MjchairError(
                f"{self.source}: actuator {name!r} is the state of a tire and takes no input"
                + nearest(name, drivable(model))
            )
        return index


def drivable(model: mujoco.MjModel) -> list[str]:
    """Names of the actuators that take an input: all but the states of tires."""
    user = int(mujoco.mjtDyn.mjDYN_USER)
    return [n for i, n in enumerate(names.actuators(model)) if model.actuator_dyntype[i] != user]


def constant(controls: Mapping[str, float], duration: float) -> Inputs:
    """Controls that stay the same from 0 to `duration` (s).

    Raises:
      MjchairError: a duration that is not positive, a control that is not finite.
    """
    if not duration > 0.0 or not np.isfinite(duration):
        raise MjchairError(f"duration is {duration:g} s; it must be positive")
    values = {name: np.full(2, float(value)) for name, value in controls.items()}
    return Inputs(np.array([0.0, duration]), values, "constant")


def push_strokes(
    peak: Mapping[str, float],
    duration: float,
    *,
    period: float = PUSH_PERIOD,
    push: float = PUSH_PERIOD * PUSH_SHARE,
    start: float = 0.2,
    rate: float = 200.0,
) -> Inputs:
    """Push strokes: bells of torque with a recovery between them.

    Each stroke is ``peak * sin(pi t / push)^2``, smooth at both ends; its impulse is half of
    peak times push.

    Args:
      peak: actuator -> peak torque, N m.
      duration: of the whole, s; strokes that would not end within it are left out.
      period: from one stroke's start to the next, s.
      push: of one stroke, s; the recovery is period - push.
      start: of the first stroke, s.
      rate: samples a second, Hz.

    Raises:
      MjchairError: a time that is not positive, or a push longer than the period.
    """
    for name, value in (("duration", duration), ("period", period), ("push", push)):
        if not value > 0.0:
            raise MjchairError(f"{name} is {value:g} s; it must be positive")
    if push > period:
        raise MjchairError(f"push lasts {push:g} s; it must end within the period, {period:g} s")
    if start < 0.0:
        raise MjchairError(f"start is {start:g} s; it must not be negative")
    time = np.linspace(0.0, duration, max(2, round(duration * rate) + 1))
    stroke, phase = np.divmod(time - start, period)
    whole = start + stroke * period + push <= duration
    on = (time >= start) & (phase < push) & whole
    bell = np.where(on, np.sin(np.pi * phase / push) ** 2, 0.0)
    return Inputs(time, {name: value * bell for name, value in peak.items()}, "push strokes")


def read_inputs(path: str | os.PathLike[str], model: mujoco.MjModel) -> Inputs:
    """The columns of a table that drive actuators of the model.

    A table may also hold measurements: columns named after sensors are left alone here.

    Args:
      path: a table, see mjchair.simulation.table.
      model: whose actuators and sensors the columns are named after.

    Raises:
      MjchairError: a column that is neither, a table that drives nothing, or as read_table does.
    """
    table = read_table(path)
    driven = {base_name(name) for name in drivable(model)} | set(drivable(model))
    sensed = {base_name(name) for name in names.sensors(model)} | set(names.sensors(model))
    controls = {}
    for name, values in table.columns.items():
        if name in driven:
            controls[name] = values
        elif name.split(".")[0] not in sensed and name not in OTHER_COLUMNS:
            raise MjchairError(
                f"{path}: unknown channel {name!r}" + nearest(name, {*drivable(model), *sensed})
            )
    if not controls:
        raise MjchairError(
            f"{path}: no column drives an actuator; name one of {', '.join(drivable(model))}"
        )
    return Inputs(table.time, controls, str(path))


def as_inputs(
    given: Inputs | Mapping[str, float] | str | os.PathLike[str] | None,
    model: mujoco.MjModel,
    duration: float | None,
) -> Inputs | None:
    """Inputs from what `simulate` takes: inputs, constant controls by name, or a table's path.

    Raises:
      MjchairError: constant controls without a duration, or as constant and read_inputs do.
    """
    if given is None or isinstance(given, Inputs):
        return given
    if isinstance(given, Mapping):
        if duration is None:
            raise MjchairError("constant controls do not say how long; give a duration in s")
        return constant(given, duration)
    return read_inputs(given, model)


# Columns of a measured run that are neither an actuator nor a sensor: forward displacement of the
# rider's centre of mass in the chair frame (m).
OTHER_COLUMNS = frozenset({"rider_motion"})
