"""Checks of a measured run: its span, its clock, channels without a signal, and its inputs.

In: a trial as it was read. Out: the trial as it is used and notes on what was left out, or one line
on why it cannot be used.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np
from scipy.integrate import cumulative_trapezoid

from mjchair.errors import MjchairError
from mjchair.measurement import table_wheels
from mjchair.measurement.trial import Trial
from mjchair.model.wheels import base_name
from mjchair.rider.anatomy import JOINT_NAMES
from mjchair.simulation.inputs import Inputs
from mjchair.simulation.table import Array

SHORTEST = 1.0  # s, of a run: less holds no window
SLOWEST = 0.1  # s, between samples: slower holds too few for a window
GAP = 0.5  # s without any sample, beyond which a clock jumps
COVERS = 0.1  # s, of a run's start and end that its inputs may leave open
SPAN = 0.25  # s, over which a channel is averaged to see whether the chair moves
STILL = {  # averages below which a channel says that the chair stands, SI
    "_speed": 0.1,
    "velocity.x": 0.03,
    "velocity.y": 0.03,
    "gyro.z": 0.1,
    "accelerometer.x": 0.2,
}
STAYS = {"_angle": 0.1, "position.x": 0.05, "position.y": 0.05, "heading": 0.05}  # ranges, SI
MOVES = (*STILL, "_angle", "position.x", "accelerometer.z")  # a rolling chair's are not zero
SAMPLES = 10  # of one value, of which fewer say nothing
BIAS = 0.2  # rad/s, that a gyroscope may tell at rest (assumption)
SPEEDS = ("_speed", "velocity.x")
CHANGES = 5.0  # times what stands still, 0.15 m/s, by which a speed changes (assumption)
SIDES = {"left": "right", "right": "left"}
ALIKE = 0.2  # rms of the difference of both torques over their mean: pushes alike (assumption)
TURNS = {"imu_gyro.z", "heading", "position.y", "velocity.y"}  # tell how a chair turns


def measured_part(trial: Trial) -> tuple[Trial, list[str]]:
    """The run from its first to its last measurement, and a note where its inputs go beyond."""
    there = np.any([~np.isnan(v) for v in trial.channels.values()], axis=0)
    rows = np.flatnonzero(there)
    kept = slice(int(rows[0]), int(rows[-1]) + 1)
    if kept == slice(0, trial.time.size):
        return trial, []
    time = trial.time[kept]
    part = replace(
        trial,
        time=time,
        channels=_rows(trial.channels, kept),
        other=_rows(trial.other, kept),
    )
    return part, [
        f"{trial.name}: nothing was measured before {time[0]:g} s or after {time[-1]:g} s; "
        "what the table has there is left out"
    ]


def _rows(columns: Mapping[str, Array], kept: slice) -> Mapping[str, Array]:
    return MappingProxyType({name: values[kept] for name, values in columns.items()})


def check(trial: Trial) -> None:
    """Refuse a run whose clock cannot be right, or whose inputs leave a part of it open.

    Raises:
      MjchairError: too short, too few samples, a clock that jumps, inputs outside the run's time.
    """
    check_length(trial)
    _check_clock(trial)
    if trial.inputs is not None:
        _check_inputs(trial, trial.inputs)


def check_length(trial: Trial) -> None:
    """Refuse a run that holds no window.

    Raises:
      MjchairError: it is too short.
    """
    lasts = float(trial.time[-1] - trial.time[0])
    if lasts < SHORTEST:
        raise MjchairError(
            f"trial {trial.name} lasts {lasts:.2g} s; it must last at least {SHORTEST:g} s, "
            "which is one window"
        )


def _check_clock(trial: Trial) -> None:
    steps = np.diff(trial.time)
    usual, worst = float(np.median(steps)), int(np.argmax(steps))
    if usual > SLOWEST:
        unit = "is it in ms? name it time [ms]" if usual > 1.0 else "sample it faster"
        raise MjchairError(
            f"{trial.name}: a sample comes every {usual:g} s; at most {SLOWEST:g} s may lie "
            f"between two; {unit}"
        )
    if steps[worst] > GAP:
        raise MjchairError(
            f"{trial.name}: the clock jumps from {trial.time[worst]:g} to "
            f"{trial.time[worst + 1]:g} s; cut the trial in two there"
        )


def _check_inputs(trial: Trial, inputs: Inputs) -> None:
    first, last = float(trial.time[0]), float(trial.time[-1])
    for name in inputs.controls:
        if base_name(name) in JOINT_NAMES:  # held before and after, and interpolated between
            continue
        time, _ = inputs.samples(name)
        if time[0] > first + COVERS or time[-1] < last - COVERS:
            raise MjchairError(
                f"{trial.name}: {name} is there from {time[0]:g} to {time[-1]:g} s, and the run "
                f"lasts from {first:g} to {last:g} s; write 0 where nothing drives, or cut the run"
            )
        inside = time[(time >= first - GAP) & (time <= last + GAP)]
        if inside.size > 1 and np.diff(inside).max() > GAP:
            at = int(np.argmax(np.diff(inside)))
            raise MjchairError(
                f"{trial.name}: {name} is not there from {inside[at]:g} to {inside[at + 1]:g} s; "
                "write 0 where nothing drives, or cut the trial in two there"
            )


def averaged(time: Array, values: Array, span: float = SPAN) -> tuple[Array, Array]:
    """Times (s), a fifth of the span apart, and the means of a channel over the span around them.

    Args:
      time, values: samples that are there, (n,).
    """
    grid = np.arange(time[0] + 0.5 * span, time[-1] - 0.5 * span, 0.2 * span)
    total = cumulative_trapezoid(values, time, initial=0.0)
    after, before = (np.interp(grid + s * span, time, total) for s in (0.5, -0.5))
    return grid, np.asarray((after - before) / span)


def _end(name: str, endings: Iterable[str]) -> str | None:
    return next((end for end in endings if name.endswith(end)), None)


def _stands(trial: Trial) -> bool:
    """Whether every channel, where it can tell, says that the chair stands."""
    for name in trial.channels:
        _, mean = averaged(*trial.samples(name))
        if not mean.size:
            continue
        end = _end(name, STILL)
        if end and np.abs(mean).max() > STILL[end]:
            return False
        end = _end(name, STAYS)
        if end and np.ptp(mean) > STAYS[end]:
            return False
    return True


def without_dead(trial: Trial) -> tuple[Trial, list[str]]:
    """The run without channels that are one value throughout while the chair moves.

    A channel of zeros, and a gyroscope that shows a bias alone, are left out where another channel
    says that the chair moves; a speed of one value, where another says that the speed changes.

    Raises:
      MjchairError: no channel is left.
    """
    ones = {n: _one_value(trial.samples(n)[1]) for n in trial.channels}
    still = {n: one for n, one in ones.items() if one is not None}
    if len(still) == len(ones) and not any(still.values()):
        raise MjchairError(f"{trial.name}: every channel is zero throughout; nothing was measured")
    others = _with_channels(trial, set(trial.channels) - set(still))
    dead = [n for n in still if _end(n, MOVES) and _is_dead(n, still[n], trial, others)]
    if not dead:
        return trial, []
    said = [
        f"{trial.name}: {n} is exactly {f'{still[n]:.4g}' if still[n] else 'zero'} throughout; it "
        "is left out"
        for n in dead
    ]
    return _with_channels(trial, set(trial.channels) - set(dead)), said


def _one_value(values: Array) -> float | None:
    """The value that all samples (n,) have; None where they differ, or are too few to say."""
    if not values.any():
        return 0.0
    return float(values[0]) if values.size >= SAMPLES and not np.ptp(values) else None


def _is_dead(name: str, value: float, trial: Trial, others: Trial) -> bool:
    """Whether a channel of one value cannot be right, by the others of its run."""
    if value == 0.0:
        return not _stands(trial)
    if name.startswith("imu_gyro"):
        return abs(value) < BIAS and not _stands(others)
    return bool(_end(name, SPEEDS)) and _changes(others)


def _changes(trial: Trial) -> bool:
    """Whether a wheel, or the chair, is seen to change its speed."""
    for name in trial.channels:
        end = _end(name, SPEEDS)
        _, mean = averaged(*trial.samples(name))
        if end and mean.size and np.ptp(mean) > CHANGES * STILL[end]:
            return True
    return False


def _with_channels(trial: Trial, names: set[str]) -> Trial:
    channels = {n: v for n, v in trial.channels.items() if n in names}
    return replace(trial, channels=MappingProxyType(channels))


def with_angles_counted_on(trial: Trial) -> tuple[Trial, list[str]]:
    """The run with wheels' angles that do not start again once a turn, and a note on each."""
    channels, said = table_wheels.unwrapped(trial.time, trial.channels, trial.name)
    return (replace(trial, channels=MappingProxyType(channels)), said) if said else (trial, [])


def tells_turning(channels: Iterable[str]) -> bool:
    """Whether these channels tell how the chair turns."""
    names = set(channels)
    return len(_sides_seen(names)) == 2 or bool(TURNS & names)


def _sides_seen(channels: Iterable[str]) -> list[str]:
    """The sides whose rear wheel was measured."""
    names = set(channels)
    return [s for s in SIDES if {f"{s}_wheel_speed", f"{s}_wheel_angle"} & names]


def with_copied_wheel(trial: Trial) -> Trial:
    """The run with the channels of its one measured wheel copied to the other one.

    Assumed alike means no turn: were the other wheel left free, a turn that dies out would pass for
    a deceleration. A run that tells how it turns, or measures no wheel, stays as it is.
    """
    seen = _sides_seen(trial.channels)
    if len(seen) != 1 or tells_turning(trial.channels) or not _driven_alike(trial):
        return trial
    side = seen[0]
    more = {
        f"{SIDES[side]}{name.removeprefix(side)}": values
        for name, values in trial.channels.items()
        if name in (f"{side}_wheel_speed", f"{side}_wheel_angle")
    }
    return replace(trial, channels=MappingProxyType({**trial.channels, **more}))


def driven_sides(trial: Trial) -> list[str]:
    """The sides whose wheel has a torque."""
    return [s for s in SIDES if trial.inputs is not None and f"{s}_wheel" in trial.inputs.controls]


def _driven_alike(trial: Trial) -> bool:
    """Whether nothing says that the two wheels are driven unlike: one torque stands for both."""
    if trial.inputs is None or len(driven_sides(trial)) < 2:
        return True
    left, right = (trial.inputs.at(f"{side}_wheel", trial.time) for side in SIDES)
    unlike, common = (np.sqrt(np.mean(np.square(t))) for t in (left - right, 0.5 * (left + right)))
    return bool(unlike <= ALIKE * common)


def other_side(trial: Trial) -> tuple[Trial, list[str]]:
    """The run with the wheel that was not measured taken to be like the other one, and a note.

    Where nothing tells how the chair turns, one instrumented wheel stands for both, unless both
    are driven and not alike. Where the other wheel or a turn was measured, that tells (one_torque).
    """
    driven, seen = driven_sides(trial), _sides_seen(trial.channels)
    if tells_turning(trial.channels):
        return trial, []
    if len(seen) != 1 and len(driven) != 1:
        return trial, []
    side = seen[0] if len(driven) == 2 else (driven or seen)[0]
    said = f"{trial.name}: only the {side} wheel was measured; the {SIDES[side]} one is "
    if not _driven_alike(trial):
        said += "driven unlike it, so it is simulated; nothing tells how the chair turns"
        return trial, [said]
    said += "assumed alike, and nothing tells how the chair turns"
    if trial.inputs is None or len(driven) != 1:
        return trial, [said]
    return with_torque_on_both(trial, side), [said]


def with_torque_on_both(trial: Trial, side: str) -> Trial:
    """The run with the torque of one side on both wheels."""
    assert trial.inputs is not None
    torque = {f"{SIDES[side]}_wheel": trial.inputs.controls[f"{side}_wheel"]}
    return replace(
        trial, inputs=replace(trial.inputs, controls={**trial.inputs.controls, **torque})
    )
