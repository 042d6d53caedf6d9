"""Drive inputs: the control of each actuator over time.

In: arrays, a table, or the shape of push strokes. Out: `Inputs`, and their values at any time.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjchair.drive.block import JOYSTICK
from mjchair.errors import MjchairError, nearest
from mjchair.model import torque_timing
from mjchair.model.wheels import base_name
from mjchair.rider.anatomy import JOINT_NAMES
from mjchair.simulation import names
from mjchair.simulation.frozen import FrozenRecord
from mjchair.simulation.table import (
    Array,
    check_time,
    check_units,
    frozen,
    leave_out,
    read_table,
)

# Period of a push cycle, s, and the share of it in which the hand is on the rim, 1: overground
# pushing at a self-chosen speed near 1 m/s (period from the SmartWheel recording in data/;
# the share is an assumption within the published 0.25-0.45).
PUSH_PERIOD = 1.15
PUSH_SHARE = 0.4
PUSH_START = 0.2  # s, of the first stroke
ROUNDING = 1e-9  # s


@dataclass(frozen=True, eq=False, repr=False)
class Inputs(FrozenRecord):
    """Controls of named actuators over time; for wheels, torque about the axle in N m.

    Between two samples a control is interpolated linearly; with `hold` it keeps the value of the
    earlier sample, as a logged command does. Before its first and after its last sample it is zero,
    so nothing drives the chair there. A missing sample (NaN) is skipped: the control is
    interpolated, or held, between the samples before and after it. A position (an angle of the
    moving rider, rad) is interpolated by cubics without overshoot, so that its speed has no steps;
    `hold` has no effect on it. Before its first and after its last sample it keeps the value of
    that sample.

    Attributes:
      time: (n,), s, strictly increasing.
      controls: actuator name -> (n,), NaN where a sample is missing; names without the prefix that
        attachment gives are accepted.
      source: origin of the inputs, for error messages.
      hold: keep each value until the next sample; False: straight lines.

    Raises:
      MjchairError: time that does not increase, a control of another length or not finite, or with
        no samples at all.
    """

    time: Array
    controls: Mapping[str, Array]
    source: str = "inputs"
    hold: bool = False

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

    def __repr__(self) -> str:
        """One line."""
        between = "held" if self.hold else "straight lines"
        return (
            f"<Inputs {self.source}: {', '.join(self.controls)}; {self.time.size} samples to "
            f"{self.end:g} s, {between}>"
        )

    @property
    def end(self) -> float:
        """Time of the last sample, s."""
        return float(self.time[-1])

    def samples(self, name: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Times (s) and values of the samples of a control that are there."""
        there = ~np.isnan(self.controls[name])
        return self.time[there], self.controls[name][there]

    def at(self, name: str, time: ArrayLike) -> NDArray[np.float64]:
        """The control `name` at the times given (s), of their shape."""
        times, values = self.samples(name)
        wanted = np.asarray(time, float)
        if not self.hold:
            return np.asarray(np.interp(wanted, times, values, left=0.0, right=0.0))
        # by rounding, a step may end slightly before or after the sample to which it belongs
        last = np.searchsorted(times, wanted + ROUNDING, side="right") - 1
        inside = (last >= 0) & (wanted <= times[-1] + ROUNDING)
        return np.asarray(np.where(inside, values[np.maximum(last, 0)], 0.0))

    def control_array(self, model: mujoco.MjModel, time: ArrayLike) -> NDArray[np.float64]:
        """Controls of every actuator of the model at the times given.

        Args:
          model: the model whose actuators are driven. Where it says that torques were recorded late
            (`torque_delay`), each acts so much earlier than its column says.
          time: (n,), s.

        Returns:
          (n, nu); zero for actuators that these inputs do not name.

        Raises:
          MjchairError: an actuator that the model does not have, a position out of its range.
        """
        known = names.actuators(model)
        out = np.zeros((np.size(time), model.nu))
        for name in self.controls:
            index = self._actuator(model, name, known)
            if is_position(model, index):
                self._check_reach(model, name, index)
                out[:, index] = self.position(name, time)
            else:
                if base_name(name) in JOYSTICK:
                    self._check_stick(name)
                late = torque_timing.recorded_late(model, index)
                out[:, index] = self.at(name, np.asarray(time, float) + late)
        return out

    def position(self, name: str, time: ArrayLike) -> NDArray[np.float64]:
        """The control `name` at the times given (s), of their shape, taken as a position."""
        known, values = self.samples(name)
        inside = np.clip(np.asarray(time, float), known[0], known[-1])
        if known.size == 1:
            return np.full(inside.shape, values[0])
        from scipy.interpolate import PchipInterpolator  # slow to import, and seldom needed

        return np.asarray(PchipInterpolator(known, values)(inside))

    def _check_stick(self, name: str) -> None:
        outside = np.flatnonzero(np.abs(np.nan_to_num(self.controls[name])) > 1.0)
        if outside.size:
            at = outside[0]
            raise MjchairError(
                f"{self.source}: {name} is {self.controls[name][at]:.4g} at {self.time[at]:g} s; a "
                "joystick goes from -1 to 1 (a log in percent: name the column "
                f"'{name} [%]')"
            )

    def _check_reach(self, model: mujoco.MjModel, name: str, index: int) -> None:
        low, high = model.actuator_ctrlrange[index]
        values = np.nan_to_num(self.controls[name], nan=0.5 * (low + high))
        outside = np.flatnonzero((values < low) | (values > high))
        if model.actuator_ctrllimited[index] and outside.size:
            at = outside[0]
            raise MjchairError(
                f"{self.source}: {name} is {values[at]:.4g} rad at {self.time[at]:g} s; a body "
                f"reaches {low:.4g} to {high:.4g} rad from the posture of the shipped chair"
            )

    def _actuator(self, model: mujoco.MjModel, name: str, known: list[str]) -> int:
        index = names.find(name, known, "actuator")
        if model.actuator_dyntype[index] == mujoco.mjtDyn.mjDYN_USER:
            raise MjchairError(
                f"{self.source}: actuator {name!r} is the state of a tire or of the drive and "
                "takes no input" + nearest(name, drivable(model))
            )
        return index


def is_position(model: mujoco.MjModel, actuator: int) -> bool:
    """Whether an actuator's control is a position or an angle to which a joint is driven."""
    gain, bias = model.actuator_gainprm[actuator], model.actuator_biasprm[actuator]
    affine = model.actuator_biastype[actuator] == mujoco.mjtBias.mjBIAS_AFFINE
    on_joint = model.actuator_trntype[actuator] == mujoco.mjtTrn.mjTRN_JOINT
    return bool(affine and on_joint and gain[0] > 0.0 and bias[1] == -gain[0])


def drivable(model: mujoco.MjModel) -> list[str]:
    """Names of the actuators that take an input: all but the states of tires and of the drive."""
    user = int(mujoco.mjtDyn.mjDYN_USER)
    return [n for i, n in enumerate(names.actuators(model)) if model.actuator_dyntype[i] != user]


def control_units(model: mujoco.MjModel) -> dict[str, str]:
    """SI unit of every actuator that turns a hinge and of joysticks, with and without prefix."""
    units, hinge = {}, int(mujoco.mjtJoint.mjJNT_HINGE)
    for i, name in enumerate(names.actuators(model)):
        on_joint = model.actuator_trntype[i] == mujoco.mjtTrn.mjTRN_JOINT
        if on_joint and model.jnt_type[model.actuator_trnid[i, 0]] == hinge:
            units[name] = "rad" if is_position(model, i) else "N m"
        if base_name(name) in JOYSTICK:
            units[name] = "1"
    return units | {base_name(name): unit for name, unit in units.items()}


def constant(controls: Mapping[str, float], duration: float) -> Inputs:
    """Controls that stay the same from 0 to `duration` (s).

    Raises:
      MjchairError: a duration that is not positive, a control that is not one finite number.
    """
    if not duration > 0.0 or not np.isfinite(duration):
        raise MjchairError(f"duration is {duration:g} s; it must be positive")
    for name, value in controls.items():
        if np.ndim(value):
            raise MjchairError(
                f"{name} is {np.size(value)} values; a constant control is one number. For values "
                "over time give mjchair.Inputs(time, {name: values})"
            )
    values = {name: np.full(2, float(value)) for name, value in controls.items()}
    return Inputs(np.array([0.0, duration]), values, "constant")


def push_strokes(
    peak: Mapping[str, float],
    duration: float,
    *,
    period: float = PUSH_PERIOD,
    push: float = PUSH_PERIOD * PUSH_SHARE,
    start: float = PUSH_START,
    rate: float = 200.0,
) -> Inputs:
    """Push strokes: torque pulses with a recovery between them.

    The torque of a stroke is ``peak * sin(pi t / push)^2``, smooth at both ends; its impulse is
    peak times push over 2.

    Args:
      peak: actuator -> peak torque, N m.
      duration: of all strokes together, s; a stroke that would end later is left out.
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


def read_inputs(path: str | os.PathLike[str], model: mujoco.MjModel, hold: bool = False) -> Inputs:
    """The columns of a table that drive actuators of the model.

    A table may also hold measurements: columns named after sensors are ignored here.

    Args:
      path: a table, see mjchair.simulation.table.
      model: whose actuators and sensors the columns are named after.
      hold: keep each value until the next sample, which is right for a log of commands; False:
        linear interpolation.

    Raises:
      MjchairError: a column whose name is nearly that of an actuator or sensor (other unknown
        columns are left out, with a note); a table that drives no actuator; or as read_table does.
    """
    table = read_table(path)
    driven = {base_name(name) for name in drivable(model)} | set(drivable(model))
    sensed = {base_name(name) for name in names.sensors(model)} | set(names.sensors(model))
    check_units(table, {**control_units(model), **OTHER_COLUMNS})
    controls = {name: values for name, values in table.columns.items() if name in driven}
    unknown = [
        name
        for name in table.columns
        if name not in driven and name.split(".")[0] not in sensed and name not in OTHER_COLUMNS
    ]
    for name in unknown:
        if name in JOYSTICK:
            raise MjchairError(
                f"{path}: {name} is the joystick of a power chair's drive, and this chair has "
                'none; take a power chair with its drive, as load_spec("power", drive="normal") '
                "(--model power --profile normal)"
            )
        if name in JOINT_NAMES:
            raise MjchairError(
                f"{path}: {name} moves a joint of the rider, who is rigid here; build the chair "
                'with rider="moving" (--rider moving)'
            )
    possible = {*drivable(model), *sensed, *JOYSTICK}
    if unknown and not controls:
        raise MjchairError(
            f"{path}: unknown channel {unknown[0]!r}" + nearest(unknown[0], possible)
        )
    leave_out(unknown, possible, str(path))
    if not controls:
        raise MjchairError(
            f"{path}: no column drives an actuator; name one of {', '.join(drivable(model))}"
        )
    return Inputs(table.time, controls, str(path), hold)


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
    if not isinstance(given, Mapping | str | os.PathLike):
        raise MjchairError(
            f"inputs is a {type(given).__name__}; give Inputs, a mapping such as "
            "{'left_wheel': 4.0}, or the path of a table"
        )
    if isinstance(given, Mapping):
        if duration is None:
            raise MjchairError("constant controls need a duration; give one in s")
        return constant(given, duration)
    return read_inputs(given, model)


# Total force of a hand on a push rim, from which `mjchair outcomes` cuts pushes.
HAND_FORCES = MappingProxyType({"left_wheel_force": "N", "right_wheel_force": "N"})
# Columns of a measured run that are neither an actuator nor a sensor, with their units: forward
# displacement of the rider's centre of mass in the chair frame, speed and heading in the laboratory
# of the chair as measured by markers, forces of the hands.
OTHER_COLUMNS = MappingProxyType(
    {"rider_motion": "m", "chair_speed": "m/s", "chair_heading": "rad", **HAND_FORCES}
)
