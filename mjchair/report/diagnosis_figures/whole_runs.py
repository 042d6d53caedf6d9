"""Whole runs, measured and as the chair before and after the correction goes through them.

In: a diagnosis. Out: a figure with a row a run and the channels that tell most. Where the channel
itself covers far more than the differences, such as a position over 5 m, the differences are drawn.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from mjchair.diagnosis.result import Diagnosis, WholeRun
from mjchair.report.colours import AFTER, BEFORE, MEASURED
from mjchair.report.figure import Figure

Array = NDArray[np.float64]

CAPTION = (
    "Of each run the channels in which simulation and measurement, or the two chairs, differ most. "
    "Where the differences would be lost in the channel's range they are drawn themselves; grey: "
    "twice the noise."
)
COLUMNS = 2
HIDDEN = 8.0  # times the largest difference, beyond which a channel's range hides it
PLACES = ("position", "heading", "angle")  # parts of names of what adds up over a run


def figure(diagnosis: Diagnosis) -> Figure | None:
    """Runs in one go from their first state."""
    if diagnosis.evidence is None or not diagnosis.evidence.runs:
        return None
    runs = diagnosis.evidence.runs
    shown = [telling(run, COLUMNS) for run in runs]
    columns = max(len(s) for s in shown)
    if not columns:
        return None
    drawn = Figure(figsize=(9.4, 2.3 * len(runs) + 0.7), layout="constrained")
    axes = drawn.subplots(len(runs), columns, squeeze=False)
    for row, run, channels in zip(axes, runs, shown, strict=True):
        for ax, channel in zip(row, channels, strict=False):
            draw_run(ax, run, channel)
        for ax in row[len(channels) :]:
            ax.set_axis_off()
    for ax in axes[-1][: len(shown[-1])]:
        ax.set_xlabel("time (s)")
    handles = {line.get_label(): line for ax in axes.flat for line in ax.lines}
    named = [line for label, line in handles.items() if not str(label).startswith("_")]
    drawn.legend(
        handles=named,
        loc="outside upper left",
        ncols=3,
        frameon=False,
        fontsize=8.5,
        markerscale=3.0,
    )
    return drawn


def telling(run: WholeRun, most: int, at_fault: Collection[str] = ()) -> list[int]:
    """The channels with the largest difference against noise, one of a kind, rates before places.

    Left and right of the same channel are one kind.

    Args:
      at_fault: channels that stand before all others.
    """
    against = run.measured if run.after is None else run.after
    miss = (against - run.before) / run.noise
    miss = np.where(np.isnan(run.measured), np.nan, miss)
    size = {
        k: float(np.nanmean(column**2))
        for k, column in enumerate(miss.T)
        if np.isfinite(column).any()
    }

    def rank(k: int) -> tuple[bool, bool, float]:
        name = run.channels[k]
        return name not in at_fault, _is_place(name), -size[k]

    order = sorted(size, key=rank)
    kinds: dict[str, int] = {}
    for k in order:
        kinds.setdefault(run.channels[k].removeprefix("left_").removeprefix("right_"), k)
    return list(kinds.values())[:most]


def _is_place(channel: str) -> bool:
    return any(part in channel for part in PLACES)


def draw_run(ax: Axes, run: WholeRun, k: int) -> None:
    """One channel of one run, or the differences where its range would hide them."""
    there = ~np.isnan(run.measured[:, k])
    time, measured = run.time[there], run.measured[there, k]
    lines = [("chair as it was", BEFORE, "-", run.before[there, k])]
    if run.after is not None:
        lines.append(("corrected chair", AFTER, "--", run.after[there, k]))
    largest = max(float(np.abs(values - measured).max()) for *_, values in lines)
    hidden = float(np.ptp(measured)) > HIDDEN * largest
    unit = f"({run.units[k]})"
    if hidden:
        ax.axhspan(-2.0 * run.noise[k], 2.0 * run.noise[k], color="0.9", zorder=0)
        ax.axhline(0.0, color=MEASURED, lw=1.0)
        ax.set_ylabel(f"{run.channels[k]},\nsimulated less measured {unit}", fontsize=8.5)
    else:
        ax.plot(time, measured, ".", ms=2.5, color=MEASURED, label="measured")
        ax.set_ylabel(f"{run.channels[k]} {unit}", fontsize=8.5)
    for label, colour, style, values in lines:
        shown = values - measured if hidden else values
        ax.plot(time, shown, style, color=colour, lw=1.5, label=label)
    ax.set_title(run.trial + (", held out" if run.held_out else ""), loc="left", fontsize=9)
    ax.ticklabel_format(axis="y", useOffset=False)
    ax.grid(alpha=0.3)
