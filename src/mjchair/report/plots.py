"""Figures of a recording: wheel speed against a measurement, and the path seen from above."""

from __future__ import annotations

import os
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import mujoco
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from mpl_toolkits.axes_grid1.anchored_artists import AnchoredSizeBar

from mjchair.errors import MjchairError
from mjchair.report.forces import COLOURS, Array, peak, round_up, wheel_forces
from mjchair.simulation.names import same
from mjchair.simulation.recording import Recording
from mjchair.storage import whole

SIDES = {"left_wheel": "#1f4e9c", "right_wheel": "#b03060"}
MEASURED = "#222222"
HORIZONTAL = ("lateral", "longitudinal")
SHORTEST = 0.04  # share of a large force below which an arrow would be no more than a head


def save(figure: Figure, path: str | os.PathLike[str], dpi: int = 130) -> None:
    """Write a figure, whole, and close it.

    Raises:
      MjchairError: a folder that cannot be written, or a suffix matplotlib does not know.
    """
    known = figure.canvas.get_supported_filetypes()
    if Path(path).suffix.lstrip(".") not in known:
        raise MjchairError(f"{path}: a figure ends in one of {', '.join(sorted(known))}")
    with whole(path) as temporary:
        figure.savefig(temporary, dpi=dpi)
    plt.close(figure)


def wheel_speed(
    recording: Recording,
    measured: tuple[Array, Array] | None = None,
    title: str = "",
    note: str = "",
) -> Figure:
    """Wheel speed over time, with what drove the wheels below it.

    Args:
      recording: what was simulated.
      measured: times (s) and wheel speed (rad/s) to compare with; None: none.
      title: of the figure. note: a sentence below it.
    """
    figure, (top, bottom) = plt.subplots(
        2, 1, figsize=(9.0, 5.6), sharex=True, height_ratios=(2, 1), layout="constrained"
    )
    if measured is not None:
        top.plot(*measured, color=MEASURED, lw=1.8, label="measured")
    for wheel, colour in SIDES.items():
        style = "-" if wheel == "left_wheel" else "--"
        name = wheel.replace("_", " ")
        top.plot(
            recording.time,
            recording[f"{wheel}_speed"],
            style,
            color=colour,
            lw=1.6,
            label=f"simulated, {name}",
        )
        for actuator, torque in recording.controls.items():
            if same(actuator, wheel):
                bottom.plot(recording.time, torque, style, color=colour, lw=1.2, label=name)
    top.set_ylabel("wheel speed (rad/s)")
    bottom.set_ylabel("axle torque (N m)")
    bottom.set_xlabel("time (s)")
    for axes in (top, bottom):
        axes.grid(alpha=0.3)
    top.legend(loc="best", frameon=False)
    _title(figure, top, title, note)
    return figure


def trajectory(
    recording: Recording,
    title: str = "",
    note: str = "",
    arrows: int = 14,
    components: tuple[str, ...] = HORIZONTAL,
) -> Figure:
    """The path of the chair from above, with the forces of every tire in their true directions.

    Lateral forces are green, longitudinal ones orange, on one scale; each arrow starts at its
    tire's contact. The load points at the reader, so it is not drawn, and neither are arrows too
    short to have a direction.

    Args:
      recording: what was simulated.
      title: of the figure. note: a sentence below it.
      arrows: places along the path at which forces are drawn.
      components: which forces are drawn, of HORIZONTAL.
    """
    path = recording.vector("position")
    wide, high = np.ptp(path[:, :2], axis=0) + 1.5  # m, with the chair about the path
    height = float(np.clip(8.0 * high / wide + 1.6, 4.0, 8.0))
    figure, axes = plt.subplots(figsize=(9.0, height), layout="constrained")
    axes.plot(path[:, 0], path[:, 1], color="#555555", lw=1.2, label="middle of the rear axle")
    unit = _newtons_a_metre(recording, path, components)
    model = recording.model.load()
    data = mujoco.MjData(model)
    for sample in _places(recording, path, arrows):
        data.qpos[:] = recording.qpos[sample]
        mujoco.mj_kinematics(model, data)
        _draw_sample(axes, model, data, recording, sample, unit, components)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("x (m)")
    axes.set_ylabel("y (m)")
    axes.grid(alpha=0.3)
    axes.autoscale_view()
    _force_legend(axes, unit, components)
    _title(figure, axes, title, note)
    return figure


def _newtons_a_metre(recording: Recording, path: Array, components: tuple[str, ...]) -> float:
    """N a metre of arrow, such that large forces are a seventh of the path's extent."""
    size = max(peak(recording, component) for component in components)
    extent = max(float(np.ptp(path[:, :2], axis=0).max()), 1.0)
    return round_up(max(size, 1e-3) / (extent / 9.0))


def _places(recording: Recording, path: Array, count: int) -> list[int]:
    """Samples at equal distances along the path; at equal times where the chair stays."""
    walked = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    clock = walked if walked[-1] > 0.1 else recording.time
    # past the first instant, where nothing has happened yet
    at = np.linspace(clock[0], clock[-1], count + 1)[1:]
    return sorted({int(i) for i in np.clip(np.searchsorted(clock, at), 0, clock.size - 1)})


def _draw_sample(
    axes: Axes,
    model: mujoco.MjModel,
    data: mujoco.MjData,
    recording: Recording,
    sample: int,
    unit: float,
    components: tuple[str, ...],
) -> None:
    least = SHORTEST * max(peak(recording, component) for component in components)
    for wheel in wheel_forces(model, data, recording, sample):
        x, y = wheel.contact[:2]
        forward = np.array([wheel.left[1], -wheel.left[0]])
        half = 0.5 * model.geom_size[model.geom(f"{wheel.wheel}_tire").id, 0] * forward
        axes.plot([x - half[0], x + half[0]], [y - half[1], y + half[1]], color="#999999", lw=2.2)
        for component in components:
            arrow = wheel.forces[component][:2] / unit
            if np.linalg.norm(arrow) * unit < least:
                continue
            axes.annotate(
                "",
                (x + arrow[0], y + arrow[1]),
                (x, y),
                arrowprops={
                    "arrowstyle": "-|>,head_width=0.18,head_length=0.35",
                    "color": COLOURS[component],
                    "lw": 1.4,
                    "shrinkA": 0,
                    "shrinkB": 0,
                },
            )
            axes.update_datalim([(x + arrow[0], y + arrow[1])])


def _force_legend(axes: Axes, unit: float, components: tuple[str, ...]) -> None:
    entries = [
        Line2D([], [], color=COLOURS[c], lw=2, label=f"{c} force on the tire") for c in components
    ]
    entries.append(Line2D([], [], color="#999999", lw=2.2, label="wheel"))
    entries.append(Line2D([], [], color="#555555", lw=1.2, label="middle of the rear axle"))
    axes.legend(handles=entries, loc="upper left", frameon=True, fontsize=9)
    _scale_bar(axes, unit)


def _scale_bar(axes: Axes, unit: float) -> None:
    """A bar of a round force, to the axes' own scale, with its number."""
    low, high = axes.get_xlim()
    force = round_up(unit * (high - low) / 14.0)
    bar = AnchoredSizeBar(
        axes.transData, force / unit, f"{force:g} N", "lower right", sep=5, frameon=False
    )
    axes.add_artist(bar)


def _title(figure: Figure, axes: Axes, title: str, note: str) -> None:
    if title:
        axes.set_title(title, loc="left")
    if note:
        figure.supxlabel(note, fontsize=8.5, color="#333333", wrap=True, x=0.02, ha="left")
