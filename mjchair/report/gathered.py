"""The picture of a gathered study: the readings of all instruments for one motion, on one clock.

In: the trials. Out: a figure with a row for each trial, those with a torque first: wheel speeds on
the left; torque, turning rate or what the wheels' sensors show on the right. Where markers show how
the rider moves, one more row has that of all these trials.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

from mjchair.measurement.gather.instruments import Instrument
from mjchair.measurement.gather.join import GatheredTrial
from mjchair.measurement.sensors import sensor
from mjchair.report.colours import FAINT, NOTE, SERIES, SIDES
from mjchair.report.figure import Figure

Array = NDArray[np.float64]

MOST = 6  # trials that are drawn
RIDER = "rider_motion"  # m, a column
ROW = 2.6  # inches a trial
STYLES = ("-", "--", ":", "-.")


def gathered_figure(trials: Sequence[GatheredTrial]) -> Figure:
    """Wheel speeds of all instruments, the torque after its baseline, and turning rates."""
    shown = sorted(_different(trials), key=lambda trial: not trial.driven)[:MOST]
    moving = [trial for trial in shown if RIDER in trial.columns]
    rows = len(shown) + bool(moving)
    figure = Figure(figsize=(12.0, ROW * rows + 0.9), layout="constrained")
    grid = figure.add_gridspec(rows, 2)
    for row, trial in enumerate(shown):
        left, right = (figure.add_subplot(grid[row, column]) for column in range(2))
        _speeds(left, trial)
        _second(right, trial)
        for one in (left, right):
            one.grid(alpha=0.3)
            one.set_xlabel("time (s)")
    if moving:
        _rider(figure.add_subplot(grid[-1, :]), moving)
    more = len(_different(trials)) - len(shown)
    text = "What the instruments say of one motion, on one clock"
    figure.suptitle(text + (f" (first {MOST} trials; {more} more)" if more else ""))
    return figure


def _rider(axes: Axes, trials: Sequence[GatheredTrial]) -> None:
    """How far the rider's centre of mass is forward, mm."""
    for number, trial in enumerate(trials):
        there = np.isfinite(trial.columns[RIDER])
        axes.plot(
            trial.time[there], 1e3 * trial.columns[RIDER][there], STYLES[number // len(SERIES)],
            lw=1.0, color=SERIES[number % len(SERIES)], label=trial.name,
        )  # fmt: skip
    axes.set_title(
        "rider's centre of mass, forward of its mean", fontsize=8, loc="left", color=NOTE
    )
    axes.set_ylabel("rider_motion (mm)")
    axes.set_xlabel("time (s)")
    axes.grid(alpha=0.3)
    axes.set_xlim(0.0, max(float(trial.time[-1]) for trial in trials))
    axes.legend(fontsize=7, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=MOST, frameon=False)


def _different(trials: Sequence[GatheredTrial]) -> list[GatheredTrial]:
    """One trial for each recording, where several trials were cut from one recording."""
    seen: list[GatheredTrial] = []
    for trial in trials:
        if not any(trial.instruments == other.instruments for other in seen):
            seen.append(trial)
    return seen


def _speeds(axes: Axes, trial: GatheredTrial) -> None:
    count: dict[str, int] = {}
    for number, one in enumerate(trial.instruments):
        for second, (side, speed) in enumerate(one.courses().items()):
            used = count[side] = count.get(side, -1) + 1
            axes.plot(
                one.time - trial.begin, speed, STYLES[(used + second) % len(STYLES)], lw=1.2,
                color=SIDES.get(f"{side}_wheel", SERIES[number % len(SERIES)]),
                label=f"{side} wheel, {one.name}" if side else one.name,
            )  # fmt: skip
    _forward(axes, trial)
    lines = [f"clock of {name}: {found.short()}" for name, found in trial.alignments.items()]
    axes.set_title("\n".join([trial.name, *lines]), fontsize=8, loc="left", color=NOTE)
    axes.set_ylabel("wheel speed (rad/s)")
    axes.set_xlim(0.0, float(np.ptp(trial.instruments[0].time)))
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize=7, loc="best", framealpha=0.8)


def _forward(axes: Axes, trial: GatheredTrial) -> None:
    """The speed from the accelerometer on the frame, without drift, scaled to the wheel speed."""
    frame = next((i for i in trial.instruments if "imu_accelerometer.x" in i.channels), None)
    motion = next((i for i in trial.instruments if i.speed is not None), None)
    if frame is None or motion is None or motion.speed is None:
        return
    there = np.isfinite(frame.channels["imu_accelerometer.x"])
    time, pull = frame.time[there], frame.channels["imu_accelerometer.x"][there]
    gained = cumulative_trapezoid(pull, time, initial=0.0)
    wheel = np.interp(time, motion.time, motion.speed)
    line = time - time.mean()
    terms = np.column_stack([gained, np.ones_like(line), line, line**2])
    fitted = terms @ np.linalg.lstsq(terms, wheel, rcond=None)[0]
    axes.plot(
        time - trial.begin, fitted, lw=0.9, color=SERIES[1],
        label=f"{frame.name}, acceleration summed",
    )  # fmt: skip


def _second(axes: Axes, trial: GatheredTrial) -> None:
    """The torque where it was measured, with times without a hand shaded; else the turning rate."""
    driven = [one for one in trial.instruments if one.torque]
    if driven or trial.driven:
        _torque(axes, trial, driven)
    else:
        _turning(axes, trial)


def _torque(axes: Axes, trial: GatheredTrial, driven: Sequence[Instrument]) -> None:
    for one in driven:
        for wheel, torque in one.torque.items():
            style = "-" if wheel == "left_wheel" else "--"
            time = one.time - trial.begin
            axes.plot(
                time, torque, style, lw=1.0, color=SIDES[wheel], label=wheel.replace("_", " ")
            )
    if not driven:
        wheel = "left_wheel" if "left_wheel" in trial.columns else "right_wheel"
        axes.plot(trial.time, trial.columns[wheel], lw=1.0, color=SIDES[wheel], label="estimated")
    free = next((one for one in driven if one.free is not None), None)
    if free is not None and free.free is not None:
        axes.fill_between(
            free.time - trial.begin, 0.0, 1.0, where=free.free, color=FAINT, alpha=0.35, lw=0,
            transform=axes.get_xaxis_transform(), label="no hand on the rim",
        )  # fmt: skip
    axes.axhline(0.0, color=NOTE, lw=0.6)
    axes.set_ylabel("torque about the axle (N m)")
    _legend_above(axes)


def _turning(axes: Axes, trial: GatheredTrial) -> None:
    """The turning rate where a sensor on the frame tells it; else what the wheels' sensors show."""
    frame = next((i for i in trial.instruments if "imu_gyro.z" in i.channels), None)
    if frame is not None:
        time = frame.time - trial.begin
        axes.plot(time, frame.channels["imu_gyro.z"], lw=1.0, color=SERIES[2], label=frame.name)
        axes.set_ylabel("turning rate (rad/s)")
        _legend_above(axes)
        return
    spans = [n for n in trial.columns if n.endswith("_speed")]
    spans = spans or [n for n in trial.columns if n.endswith("_angle")]
    for name in spans:
        wheel, kind = name.rsplit("_", 1)
        there = np.isfinite(trial.columns[name])
        axes.plot(
            trial.time[there], trial.columns[name][there], "--" if wheel == "right_wheel" else "-",
            lw=1.0, color=SIDES.get(wheel, SERIES[2]), label=name.replace("_", " "),
        )  # fmt: skip
        axes.set_ylabel(f"{kind} ({sensor(name).unit})")
    if spans:
        _legend_above(axes)


def _legend_above(axes: Axes) -> None:
    """The legend in one row above the axes, so that it hides no curve."""
    axes.legend(fontsize=7, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=4, frameon=False)
