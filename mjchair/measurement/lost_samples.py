"""Samples that are no measurement: spikes of a lost bit, and a value that a broken line repeats.

In: a trial or the columns of a table, and the rear axle of the chair. Out: the same without them,
and a note on each channel. A spike passes what a wheelchair shows at all, or is far from its
neighbours on both sides and they are not. Of an accelerometer a shock of one sample is real, so
there the first alone counts; where many samples are so, the unit is wrong and not the sample. A
value is held where a rate that else changes from sample to sample stays the same to the last digit,
and then jumps. An angle or a torque may rest; of these a value is held where it comes and goes by a
jump that none makes, as the code -9999 of a missing sample does.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from mjchair.measurement.sensors import limit_of, sensor
from mjchair.measurement.stretches import stretches
from mjchair.measurement.torque import TORQUE
from mjchair.measurement.trial import Trial
from mjchair.model.rolling import RearAxle

Array = NDArray[np.float64]

AROUND = 7  # samples, whose median a sample is compared with; a spike is of 3 at most
RARE = 0.01  # of the samples, that may be spikes (assumption)
SCATTER = 90.0  # percentile of the distance from that median: what is usual
FAR = 30.0  # times the usual, beyond which a sample is alone (assumption)
STEP = 0.1  # of what a chair shows at most, by which a rate does not change and come back
SHOCKS = "m/s^2"  # unit of what may be far off for one sample
HELD = 0.25  # s, and samples, for which no rate of a chair that moves stays the same (assumption)
HELD_SAMPLES = 10
CHANGES = 0.9  # of the other steps of such a channel, in which it changes
JUMP = 10.0  # times its usual step, by which it goes on after that
MOVES = 0.2  # of what it usually shows; below it the chair may stand
LEAP = 20.0  # rad, three turns, by which no angle changes from sample to sample (assumption)
WHEELS = ("left_wheel", "right_wheel")  # columns of a table that are torques


def without_lost(trial: Trial, axle: RearAxle) -> tuple[Trial, list[str]]:
    """The run without samples that are no measurement, and a note on each channel that had some.

    Args:
      axle: of the chair, for the limits of its wheels.
    """
    channels, said = _measured(trial.time, trial.channels, trial.name, axle)
    out = replace(trial, channels=channels) if said else trial
    if trial.inputs is None:
        return out, said
    controls, more = _measured(trial.inputs.time, trial.inputs.controls, trial.name, None)
    if more:
        out = replace(out, inputs=replace(trial.inputs, controls=controls))
    return out, said + more


def table_without_lost(
    time: Array, columns: Mapping[str, Array], name: str, axle: RearAxle
) -> tuple[dict[str, Array], list[str]]:
    """The same of the columns (n,) of a table, SI, at times (n,), s; `name`: of its file."""
    driven = {column: values for column, values in columns.items() if column in WHEELS}
    sensed = {column: values for column, values in columns.items() if column not in WHEELS}
    channels, said = _measured(time, sensed, name, axle)
    torques, more = _measured(time, driven, name, None)
    both = {**channels, **torques}
    return {column: both[column] for column in columns}, said + more


def _measured(
    time: Array, columns: Mapping[str, Array], run: str, axle: RearAxle | None
) -> tuple[Mapping[str, Array], list[str]]:
    """Columns with NaN in place of both kinds, and a note on each; no axle: they are torques."""
    clean, said = _cleaned(time, columns, run, axle)
    clean, held = _without_held(time, clean, run, driven=axle is None)
    return clean, said + held


def _cleaned(
    time: Array, columns: Mapping[str, Array], run: str, axle: RearAxle | None
) -> tuple[Mapping[str, Array], list[str]]:
    """Columns with NaN in place of spikes, and a note on each; no axle: they are torques."""
    out, said = dict(columns), []
    for name, values in columns.items():
        there = np.flatnonzero(np.isfinite(values))
        alone = _torques(values[there]) if axle is None else _spikes(name, time, values, axle)
        if not alone.size or alone.size > max(1.0, RARE * there.size):
            continue
        at = there[alone]
        out[name] = values.copy()
        out[name][at] = np.nan
        worst = at[int(np.argmax(np.abs(values[at])))]
        count = "a sample" if at.size == 1 else f"{at.size} samples"
        said.append(
            f"{run}: {count} of {name} left out that no chair can show, as {values[worst]:.4g} "
            f"at {time[worst]:.2f} s"
        )
    return MappingProxyType(out), said


def _torques(values: Array) -> NDArray[np.int64]:
    return np.flatnonzero(np.abs(values) > TORQUE)


def _spikes(name: str, time: Array, values: Array, axle: RearAxle) -> NDArray[np.int64]:
    """Which samples of a channel, of those that are there, are spikes."""
    there, kind = np.isfinite(values), sensor(name)
    seen = values[there]
    if seen.size < AROUND or (kind.most is None and kind.fastest is None):
        return np.zeros(0, np.int64)
    beyond = np.zeros(seen.size, bool)
    if kind.most is not None:
        most = limit_of(name, kind.most, axle)
        beyond, step = np.abs(seen) > most, STEP * most
    else:
        assert kind.fastest is not None
        fastest = limit_of(name, kind.fastest, axle)
        step = (AROUND // 2) * fastest * float(np.median(np.diff(time[there])))
    if kind.unit == SHOCKS:
        return np.flatnonzero(beyond)
    course = np.unwrap(seen) if kind.wraps else seen
    away = np.abs(course - median_filter(course, AROUND, mode="nearest"))
    return np.flatnonzero(beyond | (away > max(FAR * np.percentile(away, SCATTER), step)))


def _without_held(
    time: Array, columns: Mapping[str, Array], run: str, driven: bool
) -> tuple[Mapping[str, Array], list[str]]:
    """Columns with NaN where one value is repeated, and a note on each; `driven`: torques."""
    out, said = dict(columns), []
    for name, values in columns.items():
        there = np.flatnonzero(np.isfinite(values))
        for first, last in _parts(name, time[there], values[there], driven):
            at = there[first : last + 1]
            out[name] = np.where(np.isin(np.arange(values.size), at), np.nan, out[name])
            said.append(
                f"{run}: {name} repeats {values[at[0]]:.4g} from {time[at[0]]:.2f} to "
                f"{time[at[-1]]:.2f} s and then jumps; left out there"
            )
    return MappingProxyType(out), said


def _parts(name: str, time: Array, values: Array, driven: bool) -> list[tuple[int, int]]:
    """First and last sample of each part of a channel that is no measurement."""
    kind = sensor(name)
    if driven:
        return _coded(time, values, TORQUE)
    if kind.unit == "rad":
        return _coded(time, values, LEAP)
    return [] if kind.most is None else _held(time, values)


def _coded(time: Array, values: Array, least: float) -> list[tuple[int, int]]:
    """The parts that repeat one value and come and go by jumps of more than `least`."""
    steps = np.r_[0.0, np.abs(np.diff(values)), 0.0]
    parts = [] if values.size < 2 * HELD_SAMPLES else _repeated(time, values)
    ends = {0, values.size}
    return [
        (a, b)
        for a, b in parts
        if (a, b + 1) != (0, values.size)
        and all(edge in ends or steps[edge] > least for edge in (a, b + 1))
    ]


def _repeated(time: Array, values: Array) -> list[tuple[int, int]]:
    """The parts in which a channel repeats one value for HELD and for HELD_SAMPLES."""
    return [
        (a, b)
        for a, b in stretches(np.diff(values) == 0.0)
        if b - a >= HELD_SAMPLES and time[b] - time[a] >= HELD
    ]


def _held(time: Array, values: Array) -> list[tuple[int, int]]:
    """First and last sample of each part in which a channel repeats one value."""
    if values.size < 2 * HELD_SAMPLES:
        return []
    steps, parts = np.diff(values), _repeated(time, values)
    same = np.zeros(steps.size, bool)
    for a, b in parts:
        same[a:b] = True
    others = np.abs(steps[~same])
    if not parts or others.size == 0 or (others > 0.0).mean() < CHANGES:
        return []
    usual, size = float(np.median(others)), float(np.percentile(np.abs(values), 95.0))
    return [
        (a, b)
        for a, b in parts
        if b < steps.size and abs(steps[b]) > JUMP * usual and abs(values[a]) > MOVES * size
    ]
