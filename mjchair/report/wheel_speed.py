"""The figure of wheel speed over time, with the torques that drove the wheels below it.

In: a recording, and a measured wheel speed to compare with. Out: a matplotlib figure.
"""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from mjchair.report.colours import MEASURED, SIDES
from mjchair.report.figure import Figure
from mjchair.report.forces import Array
from mjchair.report.notes import add_title_and_note
from mjchair.simulation.names import same
from mjchair.simulation.recording import Recording

STYLES = {"left_wheel": "-", "right_wheel": "--"}
LEAST_SPEED = 0.1  # rad/s; an axis shows at least this range, else rounding errors fill it
LEAST_TORQUE = 0.5  # N m


def wheel_speed(
    recording: Recording,
    measured: tuple[Array, Array] | None = None,
    title: str = "",
    note: str = "",
) -> Figure:
    """Wheel speed over time, with the torque on each wheel below it.

    Args:
      recording: what was simulated.
      measured: times (s) and wheel speed (rad/s), each (n,), to compare with; None: none.
      title: of the figure. note: a sentence below it.
    """
    figure = Figure(figsize=(9.0, 5.6), layout="constrained")
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    if measured is not None:
        top.plot(*measured, color=MEASURED, lw=1.8, label="measured")
    for wheel, colour in SIDES.items():
        style, name = STYLES[wheel], wheel.replace("_", " ")
        speed = recording[f"{wheel}_speed"]
        top.plot(recording.time, speed, style, color=colour, lw=1.6, label=f"simulated, {name}")
        for actuator, torque in recording.controls.items():
            if same(actuator, wheel):
                bottom.plot(recording.time, torque, style, color=colour, lw=1.2, label=name)
    top.set_ylabel("wheel speed (rad/s)")
    bottom.set_ylabel("axle torque (N m)")
    bottom.set_xlabel("time (s)")
    for axes, least in ((top, LEAST_SPEED), (bottom, LEAST_TORQUE)):
        axes.grid(alpha=0.3)
        show_at_least(axes, least)
    figure.legend(handles=top.lines, loc="outside upper left", ncols=3, frameon=False, fontsize=9)
    add_title_and_note(figure, top, title, note)
    return figure


def show_at_least(axes: Axes, least: float) -> None:
    """Widen the vertical axis to +-`least` where everything drawn is smaller."""
    low, high = axes.get_ylim()
    sizes = [np.abs(np.asarray(line.get_ydata(), float)) for line in axes.lines]
    largest = max((float(np.nanmax(s, initial=0.0)) for s in sizes), default=0.0)
    if largest < least:
        axes.set_ylim(-least, least)
    else:
        axes.set_ylim(low, high)
    axes.ticklabel_format(axis="y", useOffset=False)
