"""SmartWheel recordings: an instrumented push rim, 24 columns at 240 Hz.

Format as in Kinetics Toolkit (Chénier, `data/pushrimkinetics`): no header, comma separated.
Columns, from 1: 1-2 sample counters; 3 encoder ticks (4096 a revolution); 4 wheel angle (deg);
5 running-average speed (m/s); 6 flag; 7-12 raw and 13-18 filtered channels; 19-21 Fx Fy Fz (N)
and 22-24 Mx My Mz (N m) on the hub in the wheel's fixed frame. Rolling forward the angle
increases, and a propulsive moment has Mz > 0.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from mjchair.errors import MjchairError
from mjchair.measurement.trial import Trial
from mjchair.simulation.inputs import Inputs
from mjchair.simulation.table import frozen

Array = NDArray[np.float64]

RATE = 240.0  # Hz
TICKS = 4096  # encoder ticks a revolution
COLUMNS = 24
FORCES = slice(18, 24)  # Fx Fy Fz Mx My Mz
SPEED_WINDOW = 0.1  # s, of the local parabola that turns ticks into speed
STILL = 0.02  # m/s of column 5, below which the wheel stands


@dataclass(frozen=True)
class PushRim:
    """A recording of one instrumented wheel.

    Attributes:
      time: (n,), s, from the sample counter; 0 at the first sample.
      angle: (n,), rad, unwrapped from the encoder, 0 at the first sample, forward positive.
      speed: (n,), rad/s, from the angle by a local parabola over 0.1 s.
      absolute: (n,), rad, encoder angle as counted, for what repeats every revolution.
      forces: (n, 6), Fx Fy Fz (N) Mx My Mz (N m) on the hub.
      ground_speed: (n,), m/s, the instrument's own running average.
      source: the file.
    """

    time: Array
    angle: Array
    speed: Array
    absolute: Array
    forces: Array
    ground_speed: Array
    source: str

    @property
    def torque(self) -> Array:
        """Moment of the hand about the axle, N m, positive drives forward, (n,)."""
        return self.forces[:, 5]


class Baseline(NamedTuple):
    """What the channels show with no hand on the rim.

    Attributes:
      offset: (6,), N and N m. cosine, sine: (6,), once-per-revolution terms, N and N m.
    """

    offset: Array
    cosine: Array
    sine: Array

    def at(self, absolute: Array) -> Array:
        """The baseline at encoder angles (n,) rad, (n, 6)."""
        wave = np.outer(np.cos(absolute), self.cosine) + np.outer(np.sin(absolute), self.sine)
        return self.offset + wave


def read_smartwheel(path: str | os.PathLike[str]) -> PushRim:
    """Read a SmartWheel file.

    Raises:
      MjchairError: no such file, another number of columns, a cell that is not a number, a sample
        counter that jumps, or fewer samples than a speed needs.
    """
    path = Path(path)
    if not path.is_file():
        raise MjchairError(f"no file {path}; give a SmartWheel CSV")
    data = _numbers(path)
    counter, ticks = data[:, 0], data[:, 2]
    jumps = np.flatnonzero(np.diff(counter) != 1.0)
    if jumps.size:
        row = int(jumps[0])
        raise MjchairError(
            f"{path}: the sample counter goes from {counter[row]:g} to {counter[row + 1]:g} in row "
            f"{row + 2}; it must count every sample"
        )
    absolute = ticks * (2.0 * np.pi / TICKS)
    window = 2 * round(0.5 * SPEED_WINDOW * RATE) + 1
    speed = savgol_filter(absolute, window, 2, deriv=1, delta=1.0 / RATE)
    return PushRim(
        time=frozen((counter - counter[0]) / RATE),
        angle=frozen(absolute - absolute[0]),
        speed=frozen(speed),
        absolute=frozen(absolute),
        forces=frozen(data[:, FORCES]),
        ground_speed=frozen(data[:, 4]),
        source=str(path),
    )


def _numbers(path: Path) -> Array:
    rows = []
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise MjchairError(f"cannot read {path}: {error}") from None
    for number, line in enumerate(lines, start=1):
        if not line.strip():
            continue
        cells = line.strip().rstrip(",").split(",")
        if len(cells) != COLUMNS:
            raise MjchairError(
                f"{path}: row {number} has {len(cells)} columns; a SmartWheel file has {COLUMNS}"
            )
        try:
            rows.append([float(cell) for cell in cells])
        except ValueError:
            raise MjchairError(f"{path}: row {number} has a cell that is not a number") from None
        if not np.isfinite(rows[-1]).all():
            raise MjchairError(f"{path}: row {number} has a number that is not finite")
    least = 2 * round(0.5 * SPEED_WINDOW * RATE) + 1
    if len(rows) < least:
        raise MjchairError(f"{path}: {len(rows)} samples; a speed needs at least {least}")
    return np.array(rows)


def fit_baseline(run: PushRim) -> Baseline:
    """Offset and once-per-revolution term of a recording with no hand on the rim.

    Least squares over every sample; a recording of less than a turn gives the offset alone.
    """
    if np.ptp(run.absolute) < 2.0 * np.pi:
        return Baseline(run.forces.mean(axis=0), np.zeros(6), np.zeros(6))
    terms = np.column_stack(
        [np.ones_like(run.absolute), np.cos(run.absolute), np.sin(run.absolute)]
    )
    offset, cosine, sine = np.linalg.lstsq(terms, run.forces, rcond=None)[0]
    return Baseline(offset, cosine, sine)


def still_baseline(run: PushRim) -> Baseline:
    """Offset from where the wheel stands at the start; no once-per-revolution term.

    Raises:
      MjchairError: the wheel does not stand for a tenth of a second at the start.
    """
    moving = np.flatnonzero(run.ground_speed >= STILL)
    count = int(moving[0]) if moving.size else run.time.size
    if count < 0.1 * RATE:
        raise MjchairError(
            f"{run.source}: the wheel moves after {count / RATE:g} s; give a baseline recording"
        )
    return Baseline(run.forces[:count].mean(axis=0), np.zeros(6), np.zeros(6))


def without_baseline(run: PushRim, baseline: PushRim | None = None) -> PushRim:
    """The recording with the baseline taken off its forces.

    The encoder's zero stays where it is between two recordings made in a row, so a baseline is
    taken at the same wheel angle.

    Args:
      run: the recording. baseline: one with no hand on the rim; None: the wheel at rest at the
        start of `run` gives the offset.
    """
    found = still_baseline(run) if baseline is None else fit_baseline(baseline)
    return replace(run, forces=frozen(run.forces - found.at(run.absolute)))


def push_inputs(run: PushRim) -> Inputs:
    """The measured moment as torque on both rear wheels.

    Only one wheel is instrumented; the other is assumed to get the same torque, so the chair goes
    straight whatever the person did.
    """
    torque = run.torque
    return Inputs(run.time, {"left_wheel": torque, "right_wheel": torque}, run.source)


def as_trial(run: PushRim, side: str, name: str) -> Trial:
    """The recording as a measured run: angle (rad) and torque (N m) of the wheel of that side."""
    return Trial(
        name=name,
        time=run.time,
        channels=MappingProxyType({f"{side}_wheel_angle": run.angle}),
        inputs=Inputs(run.time, {f"{side}_wheel": run.torque}, run.source),
        other=MappingProxyType({}),
    )
