"""Figures of the tire rig, in the style of Figures 10 to 13 of Silva & Dedini (2007).

In: runs of the rig. Out: matplotlib figures of cell readings over time, of lateral force against
slip angle, and of forces against longitudinal slip.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from mjchair.report.colours import AXIS_LINE, SERIES
from mjchair.report.figure import Figure
from mjchair.simulation.rig import Run
from mjchair.tire import Tire, law

Array = NDArray[np.float64]

MARKERS = ("o", "^", "s", "D", "v", "P")
LINES = ("-", "--", ":", "-.")
CELLS = (SERIES[0], SERIES[1], SERIES[2])
SIGN = "lateral force, -Fy (N)"  # the paper's sign: positive for a positive angle


def load_colour(index: int) -> str:
    """The colour of a load, by its place among the loads of a figure."""
    return SERIES[index % len(SERIES)]


def traces(runs: Sequence[Run]) -> Figure:
    """Raw cell traces over time, a panel for each load at the smallest angle (Figure 10).

    Args:
      runs: of one sweep; those of the slowest speed are shown.
    """
    slowest = min(run.point.speed for run in runs)
    of_speed = [run for run in runs if run.point.speed == slowest]
    angles = sorted({run.point.angle for run in of_speed}, key=abs)
    shown = sorted({angles[0], angles[-1]}, key=abs)
    loads = sorted({run.point.load for run in of_speed})
    size = (3.4 * len(loads) + 0.6, 2.5 * len(shown) + 0.9)
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.subplots(len(shown), len(loads), sharex=True, squeeze=False)
    for row, angle in enumerate(shown):
        for column, load in enumerate(loads):
            here = [r for r in of_speed if r.point.angle == angle and r.point.load == load]
            axis = axes[row, column]
            _trace(axis, here[0]) if here else axis.set_axis_off()
            axis.set_title(f"{angle:g} deg, {load:g} N", fontsize=10)
        axes[row, 0].set_ylabel("cell reading (N)")
    for axis in axes[-1]:
        axis.set_xlabel("time (s)")
    lines = next(axis.lines[:3] for axis in axes.flat if axis.lines)
    figure.legend(handles=lines, loc="outside lower center", ncols=3, fontsize=9, frameon=False)
    figure.suptitle(f"Readings of the three load cells, table at {1000 * slowest:g} mm/s")
    return figure


def _trace(axis: Axes, run: Run) -> None:
    for i, name in enumerate(("cell 1, lateral", "cell 2, lateral", "cell 3, longitudinal")):
        style = "--" if i == 1 else "-"
        axis.plot(run.time, run.cells[:, i], style, color=CELLS[i], lw=1.2, label=name)
    axis.axhline(0.0, color=AXIS_LINE, lw=0.8, zorder=0)


def lateral(runs: Sequence[Run], tire: Tire | None = None) -> Figure:
    """Lateral force against slip angle, per load and speed (Figure 11).

    Args:
      runs: of one sweep. tire: its curves are drawn behind the points, with peak, knee and slope at
        the largest load; None: no curves.
    """
    figure = Figure(figsize=(7.6, 5.0), layout="constrained")
    axis = figure.subplots()
    _points(axis, runs)
    if tire is not None:
        loads = sorted({run.point.load for run in runs})
        reach = max(15.0, max(abs(run.point.angle) for run in runs))
        angles = np.linspace(0.0, reach, 301)
        for i, load in enumerate(loads):
            force = -tire.forces(load, 0.0, np.radians(angles)).Fy
            axis.plot(angles, force, color=load_colour(i), lw=1.0, alpha=0.7, zorder=1)
        _mark(axis, tire, loads[-1], reach)
    _finish(axis, "Lateral force against slip angle" + (f": {tire.name}" if tire else ""))
    return figure


def _points(axis: Axes, runs: Sequence[Run], label: str = "", filled: bool = True) -> None:
    loads = sorted({run.point.load for run in runs})
    speeds = sorted({run.point.speed for run in runs})
    for i, load in enumerate(loads):
        for k, speed in enumerate(speeds):
            here = [r for r in runs if r.point.load == load and r.point.speed == speed]
            colour = load_colour(i)
            axis.plot(
                [run.point.angle for run in here],
                [-run.force[1] for run in here],
                MARKERS[k % len(MARKERS)],
                color=colour,
                markerfacecolor=colour if filled and k == 0 else "none",
                markersize=7 + 3 * k,
                linestyle="none",
                label=f"{label}{load:g} N, {1000 * speed:g} mm/s",
            )


def _mark(axis: Axes, tire: Tire, load: float, reach: float) -> None:
    """Peak, knee and slope of the tire's curve at a load."""
    _, c_alpha, _, d_y = law.family_stiffness(tire.block(), load, 0.0, 1.0)
    slope, knee = np.radians(1.0) * c_alpha, np.degrees(d_y / c_alpha)
    axis.plot([0.0, knee], [0.0, d_y], color="0.35", lw=1.0, ls="--")
    axis.axhline(d_y, color="0.35", lw=1.0, ls=":")
    axis.annotate(
        f"knee {knee:.1f} deg",
        (knee, d_y),
        xytext=(4, 6),
        textcoords="offset points",
        fontsize=9,
        color="0.25",
    )
    axis.annotate(
        f"peak {d_y:.1f} N",
        (reach, d_y),
        xytext=(0, 6),
        textcoords="offset points",
        ha="right",
        fontsize=9,
        color="0.25",
    )
    axis.annotate(
        f"slope {slope:.1f} N/deg",
        (0.45 * knee, 0.45 * d_y),
        xytext=(-6, 4),
        textcoords="offset points",
        ha="right",
        fontsize=9,
        color="0.25",
        rotation=0,
    )


def _finish(axis: Axes, title: str) -> None:
    axis.axhline(0.0, color=AXIS_LINE, lw=0.8, zorder=0)
    axis.axvline(0.0, color=AXIS_LINE, lw=0.8, zorder=0)
    axis.margins(y=0.12)
    axis.set_xlabel("slip angle (deg)")
    axis.set_ylabel(SIGN)
    axis.set_title(title)
    axis.legend(fontsize=8, frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))
    for side in ("top", "right"):
        axis.spines[side].set_visible(False)


def compared(first: Sequence[Run], second: Sequence[Run], names: tuple[str, str]) -> Figure:
    """Two tires on the rig, such as rigid and flexible (Figure 12), at their slowest speed."""
    figure = Figure(figsize=(7.6, 5.0), layout="constrained")
    axis = figure.subplots()
    for runs, name, filled, style in (
        (first, names[0], True, "-"),
        (second, names[1], False, "--"),
    ):
        slowest = min(run.point.speed for run in runs)
        loads = sorted({run.point.load for run in runs})
        for i, load in enumerate(loads):
            here = [r for r in runs if r.point.load == load and r.point.speed == slowest]
            here.sort(key=lambda run: run.point.angle)
            colour = load_colour(i)
            axis.plot(
                [run.point.angle for run in here],
                [-run.force[1] for run in here],
                style,
                marker="o" if filled else "s",
                markerfacecolor=colour if filled else "white",
                color=colour,
                lw=1.2,
                label=f"{name}, {load:g} N",
            )
    _finish(axis, f"Lateral force: {names[0]} against {names[1]}")
    return figure


def longitudinal(runs: Sequence[Run]) -> Figure:
    """Longitudinal and lateral force against longitudinal slip, where the wheel was driven.

    Every load and slip angle has a colour, a marker and a line of its own.
    """
    driven = [run for run in runs if run.point.kappa is not None]
    figure = Figure(figsize=(10.4, 4.4), layout="constrained")
    axes = figure.subplots(1, 2, sharex=True)
    series = sorted({(run.point.load, run.point.angle) for run in driven})
    for k, (load, angle) in enumerate(series):
        here = [r for r in driven if (r.point.load, r.point.angle) == (load, angle)]
        here.sort(key=lambda run: run.point.kappa or 0.0)
        for axis, part in zip(axes, (0, 1), strict=True):
            axis.plot(
                [run.point.kappa for run in here],
                [run.force[part] for run in here],
                MARKERS[k % len(MARKERS)] + LINES[k % len(LINES)],
                color=SERIES[k % len(SERIES)],
                ms=4.5,
                lw=1.1,
                label=f"{load:g} N, {angle:g} deg",
            )
    for axis, text in zip(axes, ("longitudinal force Fx (N)", "lateral force Fy (N)"), strict=True):
        axis.set_xlabel("longitudinal slip kappa (1)")
        axis.set_ylabel(text)
        axis.axhline(0.0, color=AXIS_LINE, lw=0.8, zorder=0)
    axes[1].legend(fontsize=8, frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))
    figure.suptitle("Driven and braked: force against longitudinal slip")
    return figure
