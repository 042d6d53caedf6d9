"""Outcomes of wheelchair propulsion, stroke by stroke, of measured and simulated runs alike.

In: angle, speed and moment of a driven wheel over time, and the hand's total force where it was
measured. Out: a table with a row a stroke: push and recovery time, cadence, peak and mean moment,
power, work, contact angle, and how the speed changes within the stroke.

Strokes are cut as Kinetics Toolkit's `cycles.detect_cycles` cuts them, with the thresholds of its
push-rim tutorial: a push begins where the hand's force rises to 5 N and ends where it falls to 2 N;
a phase of less than 0.1 s or a push whose peak is below 25 N is none. Without a force the moment
stands for it, on a push rim of 0.27 m, as far as it drives, and a rim that rings as it is let go is
not touched again. A hand's total force is larger than its part along the rim, so that this counts
fewer pushes.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

from mjchair.errors import MjchairError, nearest, note
from mjchair.measurement.smartwheel import PushRim, hand_force
from mjchair.measurement.stretches import in_a_gap
from mjchair.measurement.torque import check_torques
from mjchair.measurement.trial import Trial
from mjchair.simulation.recording import Recording
from mjchair.simulation.table import frozen
from mjchair.storage import write_whole

Array = NDArray[np.float64]

RISES, FALLS, PEAK = 5.0, 2.0, 25.0  # N: a push begins, ends, and must reach
SHORTEST = 0.1  # s, of a push and of a recovery
GAP = 5.0  # times the usual step, and SHORTEST, beyond which a wheel is not seen between samples
RIM = 0.27  # m, radius of a push rim on a 24-inch wheel: 0.26-0.28, assumption
UNITS = {
    "push": "1",
    "start": "s",
    "push_time": "s",
    "recovery_time": "s",
    "cadence": "1/min",
    "peak_moment": "N m",
    "mean_moment": "N m",
    "peak_power": "W",
    "mean_power": "W",
    "work": "J",
    "contact_angle": "deg",
    "mean_speed": "rad/s",
    "speed_change": "rad/s",
    "peak_speed_at": "1",
}
MEANING = {
    "push": "number of the push",
    "start": "time at which the push begins",
    "push_time": "how long the hand is on the rim",
    "recovery_time": "from the end of the push to the next push",
    "cadence": "pushes a minute, from this stroke's duration",
    "peak_moment": "largest moment of the push",
    "mean_moment": "mean moment over the push",
    "peak_power": "largest product of moment and wheel speed in the push",
    "mean_power": "mean of that product over the push",
    "work": "that product integrated over the push",
    "contact_angle": "how far the wheel turns in the push",
    "mean_speed": "mean wheel speed over the stroke",
    "speed_change": "largest less smallest wheel speed within the stroke",
    "peak_speed_at": "when the speed is largest, as a share of the stroke",
}


@dataclass(frozen=True)
class Rim:
    """What one driven wheel did: all arrays (n,), forward positive.

    Attributes:
      time: s. angle: rad. speed: rad/s, NaN where the wheel is not seen. moment: of the hand about
        the axle, N m.
      force: the hand's total force, N; None: not measured. name: of the wheel.
    """

    time: Array
    angle: Array
    speed: Array
    moment: Array
    force: Array | None
    name: str

    def __post_init__(self) -> None:
        """Check the lengths."""
        for item in fields(self):
            value = getattr(self, item.name)
            if isinstance(value, np.ndarray) and value.shape != self.time.shape:
                raise MjchairError(
                    f"{self.name}: {item.name} has shape {value.shape}; time has {self.time.shape}"
                )


class Stroke(NamedTuple):
    """Samples at which a stroke begins, its push ends, and the next stroke begins (-1: none)."""

    begin: int
    release: int
    end: int


@dataclass(frozen=True)
class Outcomes:
    """A row a stroke.

    Attributes:
      columns: name -> (strokes,), in the units of UNITS; NaN where the recording ends within the
        stroke, and where the wheel is not seen in a part of it. wheel: its name.
      smaller: pushes that are not counted, as they stay below what a push must reach. least: that.
    """

    columns: dict[str, Array]
    wheel: str
    smaller: int = 0
    least: str = ""

    def __len__(self) -> int:
        """Number of strokes."""
        return int(self.columns["push"].size)

    def __getitem__(self, name: str) -> Array:
        """The column `name`, (strokes,).

        Raises:
          MjchairError: there is none.
        """
        if name not in self.columns:
            raise MjchairError(f"no outcome {name!r}" + nearest(name, self.columns))
        return self.columns[name]

    def mean(self, name: str) -> float:
        """The mean of an outcome over the strokes that have it."""
        return float(np.nanmean(self[name]))

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Write the table, whole; units in the header, an empty cell for NaN.

        Raises:
          MjchairError: a folder that cannot be written.
        """
        write_whole(path, self.csv())

    def csv(self) -> str:
        """The table as CSV."""
        header = ",".join(f"{name} [{UNITS[name]}]" for name in self.columns)
        rows = zip(*self.columns.values(), strict=True)
        lines = [",".join("" if x != x else f"{x:.9g}" for x in row) for row in rows]
        return "\n".join([header, *lines]) + "\n"

    def text(self) -> str:
        """The table for people: a row an outcome, with mean, spread and range over strokes."""
        out = [f"{self.wheel}: {len(self)} strokes"]
        if self.smaller:
            pushes = (
                "1 smaller push is" if self.smaller == 1 else f"{self.smaller} smaller pushes are"
            )
            out[0] += f"; {pushes} not counted, below {self.least}"
        rows = []
        for name, values in self.columns.items():
            there = values[np.isfinite(values)]
            if name in ("push", "start") or not there.size:
                continue
            spread = float(there.std(ddof=1)) if there.size > 1 else 0.0
            numbers = (there.mean(), spread, there.min(), there.max())
            rows.append((name, UNITS[name], [f"{v:.3f}" for v in numbers]))
        wide = max([8, *(len(cell) for *_, cells in rows for cell in cells)]) + 1
        for name, unit, cells in [("outcome", "unit", ["mean", "sd", "least", "most"]), *rows]:
            out.append(f"{name:<15}{unit:<7}" + "".join(f"{cell:>{wide}}" for cell in cells))
        return "\n".join(out)


def outcomes(rim: Rim) -> Outcomes:
    """The outcomes of every stroke of a wheel.

    Raises:
      MjchairError: there is no stroke.
    """
    every = _pushes(rim)
    found = [stroke for stroke, counts in every if counts]
    least = f"{PEAK:g} N" if rim.force is not None else f"{PEAK * RIM:.1f} N m"
    if not found:
        raise MjchairError(
            f"{rim.name}: no push of {SHORTEST:g} s that reaches {least}; there are no outcomes"
        )
    rows = [_row(rim, number, stroke) for number, stroke in enumerate(found, start=1)]
    columns = {name: frozen([row[name] for row in rows]) for name in UNITS}
    return Outcomes(columns, rim.name, len(every) - len(found), least)


def strokes(rim: Rim) -> list[Stroke]:
    """Where strokes begin and end; see the module's docstring."""
    return [stroke for stroke, counts in _pushes(rim) if counts]


def _pushes(rim: Rim) -> list[tuple[Stroke, bool]]:
    """Every stroke that is long enough, and whether its push reaches what one must reach."""
    scale = 1.0 if rim.force is not None else RIM
    hand = rim.force if rim.force is not None else _driving(rim.moment)
    events = _crossings(np.asarray(hand), RISES * scale, FALLS * scale)
    touches = [
        (begin, release, float(np.max(hand[begin : release + 1])) >= PEAK * scale)
        for begin, release in zip(events[::2], events[1::2], strict=False)
    ]
    if rim.force is None:  # a rim rings as it is let go, which is no next push
        touches = [
            (begin, release, high)
            for begin, release, high in touches
            if high or rim.time[release] - rim.time[begin] >= SHORTEST
        ]
    begins = [begin for begin, _, _ in touches] + (events[-1:] if len(events) % 2 else [])
    found = []
    for i, (begin, release, high) in enumerate(touches):
        end = begins[i + 1] if i + 1 < len(begins) else -1
        push = rim.time[release] - rim.time[begin]
        recovery = rim.time[end] - rim.time[release] if end >= 0 else np.inf
        if push >= SHORTEST and recovery >= SHORTEST:
            found.append((Stroke(begin, release, end), high))
    return found


def _driving(moment: Array) -> Array:
    """The part of a moment (n,) that drives: what brakes the wheel, as a hand lets go, is no push.

    It drives the way in which it acts in all: forward, but for a run that goes back.
    """
    return np.asarray(np.maximum(moment * np.sign(moment.sum()), 0.0))


def _crossings(hand: Array, rises: float, falls: float) -> list[int]:
    """Samples at which pushes begin and end in turn; one under way at the first sample is left."""
    events: list[int] = []
    off = True
    for i, value in enumerate(hand):
        if off and value >= rises:
            events.append(i)
            off = False
        elif not off and value <= falls:
            events.append(i)
            off = True
    return events[2:] if events and events[0] == 0 else events


def _row(rim: Rim, number: int, stroke: Stroke) -> dict[str, float]:
    begin, release, end = stroke
    push = slice(begin, release + 1)
    whole = slice(begin, end + 1) if end >= 0 else None
    moment, power = rim.moment[push], rim.moment[push] * rim.speed[push]
    turned = rim.angle[release] - rim.angle[begin] if np.isfinite(power).all() else np.nan
    row = {
        "push": float(number),
        "start": rim.time[begin],
        "push_time": rim.time[release] - rim.time[begin],
        "peak_moment": moment.max(),
        "mean_moment": moment.mean(),
        "peak_power": power.max(),
        "mean_power": power.mean(),
        "work": np.trapezoid(power, rim.time[push]),
        "contact_angle": np.degrees(turned),
    }
    names = ("recovery_time", "cadence", "mean_speed", "speed_change", "peak_speed_at")
    if whole is None:
        return row | dict.fromkeys(names, np.nan)
    speed, lasts = rim.speed[whole], rim.time[end] - rim.time[begin]
    fastest = (rim.time[begin + int(np.argmax(speed))] - rim.time[begin]) / lasts
    if np.isnan(speed).any():
        fastest = np.nan
    values = (rim.time[end] - rim.time[release], 60.0 / lasts, speed.mean(), np.ptp(speed), fastest)
    return row | dict(zip(names, values, strict=True))


def of_push_rim(run: PushRim, name: str = "wheel") -> Rim:
    """The rim of a recording whose signs and baseline are put right."""
    return Rim(run.time, run.angle, run.speed, run.torque, hand_force(run), name)


def of_recording(recording: Recording, wheel: str = "left_wheel") -> Rim:
    """The rim of a simulated run.

    Raises:
      MjchairError: the wheel was not driven, or the recording does not tell how it turned.
    """
    if wheel not in recording.controls:
        raise MjchairError(f"{wheel} was not driven" + nearest(wheel, recording.controls))
    angle, speed = recording[f"{wheel}_angle"], recording[f"{wheel}_speed"]
    return Rim(recording.time, angle, speed, recording.controls[wheel], None, wheel)


def of_trial(trial: Trial, wheel: str = "left_wheel") -> Rim:
    """The rim of a measured run that has a wheel's torque, and its angle or speed.

    Raises:
      MjchairError: it has not, or its torque is in N mm.
    """
    if trial.inputs is None or wheel not in trial.inputs.controls:
        known = trial.inputs.controls if trial.inputs is not None else ()
        raise MjchairError(f"{trial.name}: no torque of {wheel}" + nearest(wheel, known))
    check_torques({wheel: trial.inputs.controls[wheel]}, trial.name)
    time, moment = trial.inputs.samples(wheel)
    if f"{wheel}_angle" in trial.channels:
        seen, turned = trial.samples(f"{wheel}_angle")
        angle = np.interp(time, seen, turned)
        speed = _speed(time, angle)
    elif f"{wheel}_speed" in trial.channels:
        seen, speeds = trial.samples(f"{wheel}_speed")
        speed = np.interp(time, seen, speeds)
        angle = cumulative_trapezoid(speed, time, initial=0.0)
    else:
        raise MjchairError(f"{trial.name}: neither {wheel}_angle nor {wheel}_speed is there")
    return Rim(time, angle, np.where(_unseen(time, seen), np.nan, speed), moment, None, wheel)


def _unseen(time: Array, seen: Array) -> NDArray[np.bool_]:
    """Which times (n,), s, lie in a gap of the times at which a wheel is seen, (m,), s."""
    if seen.size < 2:
        return np.ones(time.size, bool)
    return in_a_gap(time, seen, max(SHORTEST, GAP * float(np.median(np.diff(seen)))))


def _speed(time: Array, angle: Array) -> Array:
    """Speed of an angle, by the local parabola over 1/12 s that push-rim recordings have."""
    from scipy.signal import savgol_filter

    rate = 1.0 / float(np.median(np.diff(time)))
    window = 2 * max(1, round(rate / 24.0)) + 1
    even = np.arange(time[0], time[-1], 1.0 / rate)
    window = min(window, 2 * ((even.size - 1) // 2) + 1)
    if window < 3:
        return np.asarray(np.gradient(angle, time))
    smooth = savgol_filter(np.interp(even, time, angle), window, 2, deriv=1, delta=1.0 / rate)
    return np.asarray(np.interp(time, even, smooth))


def read_rim(
    path: str | os.PathLike[str],
    baseline: str | os.PathLike[str] | None = None,
    wheel: str = "left_wheel",
) -> Rim:
    """The rim in a file: a recording (.npz), a SmartWheel file, or a table of a study.

    Args:
      path: the file. baseline: of a SmartWheel file; None: see `baseline.without_baseline`.
      wheel: "left_wheel" or "right_wheel", of a recording or a table with both.

    Raises:
      MjchairError: it is none of these, or as its reader does.
    """
    from mjchair.measurement.baseline import without_baseline
    from mjchair.measurement.smartwheel import (
        at_its_end,
        oriented,
        read_smartwheel,
        without_moment,
    )
    from mjchair.simulation.recording import load_recording

    path = Path(path)
    if path.suffix == ".npz":
        return of_recording(load_recording(path), wheel)
    if _has_time(path):
        return _of_table(path, wheel)
    still = read_smartwheel(baseline) if baseline is not None else None
    raw = read_smartwheel(path)
    if without_moment(raw):
        raise MjchairError(f"{path.name}: {without_moment(raw)}")
    for line in at_its_end(raw):
        note(line)
    run = oriented(without_baseline(raw, still))
    return of_push_rim(run, path.stem)


def _has_time(path: Path) -> bool:
    """Whether a file is a table of a study: Parquet, or CSV whose header begins with time."""
    if path.suffix.lower() == ".parquet":
        return True
    try:
        with path.open(encoding="utf-8-sig", errors="replace") as file:
            return file.readline().strip().lower().startswith("time")
    except OSError as error:
        raise MjchairError(f"cannot read {path}: {error.strerror}") from None


def _of_table(path: Path, wheel: str) -> Rim:
    """The rim of a table of a study, with the hand's force where the table has it."""
    from mjchair.measurement.table_wheels import put_right
    from mjchair.measurement.trial import trial_from_table
    from mjchair.model.spec import load_spec
    from mjchair.simulation.table import read_table

    table = read_table(path)
    columns, said = put_right(table.time, table.columns, path.name)
    for line in said:
        note(line)
    table = replace(table, columns=columns)
    rim = of_trial(trial_from_table(table, load_spec("manual").compile(), path.stem), wheel)
    if f"{wheel}_force" not in columns:
        return rim
    return replace(rim, force=np.interp(rim.time, *table.samples(f"{wheel}_force")))
