"""The figure of a chair's path seen from above, with an arrow for every tire's force.

In: a recording. Out: a matplotlib figure. Arrows have the forces' true directions and one scale,
which a bar below the axes shows; a force that would reach far beyond the others' arrows is cut,
and its size is written at its tip.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from mpl_toolkits.axes_grid1.anchored_artists import AnchoredSizeBar

from mjchair.report.colours import FORCES, PATH, WHEEL
from mjchair.report.figure import Figure
from mjchair.report.forces import Array, WheelForces, round_up, wheel_forces
from mjchair.report.notes import add_title_and_note
from mjchair.simulation.recording import Recording

HORIZONTAL = ("lateral", "longitudinal")
MARGIN = 0.75  # m, about the path, for the chair itself
USUAL = 90.0  # percentile of the drawn forces for which the scale is made
LONGEST = 2.0  # times the arrow of this usual force; longer arrows are cut
LENGTH = 1.0 / 9.0  # of the picture's width, at most: the arrow of the usual force
SPACED = 0.8  # of the distance between two places, at most, so that arrows do not run together
LEAST_FORCE = 10.0  # N; the scale is never made for less, so that a chair at rest shows none
STAYS = 0.1  # m; a chair that moves less than this stays where it is
APART = 0.06  # of the picture's width, between two numbers
SHORTEST = 0.02  # of the usual force; smaller forces are not drawn


@dataclass(frozen=True)
class Arrow:
    """One force to draw: component, start (2,) in m and force (2,) in N, world."""

    component: str
    start: Array
    force: Array


def trajectory(
    recording: Recording,
    title: str = "",
    note: str = "",
    arrows: int = 10,
    components: tuple[str, ...] = HORIZONTAL,
) -> Figure:
    """The path of the chair from above, with the forces of every tire in their true directions.

    Each arrow starts at its tire's contact. The load is perpendicular to the picture, so it is not
    drawn; forces below 2 % of the usual size are not drawn either.

    Args:
      recording: what was simulated.
      title: of the figure. note: a sentence below it.
      arrows: places along the path at which forces are drawn.
      components: which forces are drawn, of HORIZONTAL.
    """
    path = recording.vector("position")[:, :2]
    figure = Figure(figsize=(9.0, _height(path)), layout="constrained")
    axes = figure.subplots()
    axes.plot(*path.T, color=PATH, lw=1.2, zorder=3)
    axes.plot(*path[0], "o", color=PATH, ms=4, zorder=3)
    model = recording.model.load()
    data = mujoco.MjData(model)
    wheels: list[WheelForces] = []
    for sample in _places(recording, path, arrows):
        data.qpos[:] = recording.qpos[sample]
        mujoco.mj_kinematics(model, data)
        wheels += wheel_forces(model, data, recording, sample)
    for wheel in wheels:
        _draw_wheel(axes, model, wheel)
    drawn = [
        Arrow(component, wheel.contact[:2], wheel.forces[component][:2])
        for wheel in wheels
        for component in components
    ]
    usual = usual_force(drawn)
    metre = round_up(usual / _arrow_length(path, arrows))
    _draw_arrows(axes, drawn, usual, metre, float(np.ptp(path, axis=0).max()) + 2.0 * MARGIN)
    _frame(axes, path)
    _legend(figure, components)
    _scale_bar(axes, usual, metre)
    add_title_and_note(figure, axes, title, note)
    return figure


def _arrow_length(path: Array, places: int) -> float:
    """Length of the arrow of a usual force, m."""
    wide = float(np.ptp(path, axis=0).max()) + 2.0 * MARGIN
    spacing = _walked(path)[-1] / places
    if spacing < STAYS / places:
        return LENGTH * wide
    return float(min(LENGTH * wide, max(SPACED * spacing, 0.05 * wide)))


def _walked(path: Array) -> Array:
    """Distance along the path (n,), m."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])


def _height(path: Array) -> float:
    """Height of the figure in inches, for the path's shape."""
    wide, high = np.ptp(path, axis=0) + 2.0 * MARGIN
    return float(np.clip(8.0 * high / wide + 2.0, 4.2, 8.5))


def usual_force(arrows: list[Arrow]) -> float:
    """The force, N, that most of those drawn stay below; at least LEAST_FORCE."""
    sizes = np.array([np.linalg.norm(a.force) for a in arrows])
    sizes = sizes[sizes > SHORTEST * LEAST_FORCE]
    return max(float(np.percentile(sizes, USUAL)), LEAST_FORCE) if sizes.size else LEAST_FORCE


def _places(recording: Recording, path: Array, count: int) -> list[int]:
    """Samples at equal distances along the path; at equal times where the chair stays."""
    walked = _walked(path)
    clock = walked if walked[-1] > STAYS else recording.time
    # not the first sample, in which no force has built up yet
    at = np.linspace(clock[0], clock[-1], count + 1)[1:]
    return sorted({int(i) for i in np.clip(np.searchsorted(clock, at), 0, clock.size - 1)})


def _draw_wheel(axes: Axes, model: mujoco.MjModel, wheel: WheelForces) -> None:
    """The wheel as a bar along its plane."""
    forward = np.array([wheel.left[1], -wheel.left[0]])
    half = 0.5 * model.geom_size[model.geom(f"{wheel.wheel}_tire").id, 0] * forward
    ends = np.array([wheel.contact[:2] - half, wheel.contact[:2] + half])
    axes.plot(*ends.T, color=WHEEL, lw=2.2, zorder=2)


def _draw_arrows(axes: Axes, arrows: list[Arrow], usual: float, metre: float, wide: float) -> None:
    """Every force that is large enough; the longest are cut and carry their number.

    Args:
      usual: N, the force that the scale is made for. metre: N that a metre of arrow stands for.
      wide: m, of the picture.
    """
    longest = LONGEST * usual
    written: list[Array] = []
    for arrow in sorted(arrows, key=lambda a: -float(np.linalg.norm(a.force))):
        size = float(np.linalg.norm(arrow.force))
        if size < SHORTEST * usual:
            continue
        shown = arrow.force * min(1.0, longest / size) / metre
        tip = arrow.start + shown
        _draw_arrow(axes, arrow.start, shown, FORCES[arrow.component])
        if size > longest and all(np.linalg.norm(tip - w) > APART * wide for w in written):
            _write_size(axes, tip, shown, f"{size:.0f} N", FORCES[arrow.component])
            written.append(tip)


def _draw_arrow(axes: Axes, start: Array, along: Array, colour: str) -> None:
    """One arrow; a short one shrinks as a whole, so that it keeps its shaft."""
    axes.quiver(
        *start,
        *along,
        color=colour,
        angles="xy",
        scale_units="xy",
        scale=1.0,
        units="dots",
        width=2.6,
        headwidth=4.5,
        headlength=6.0,
        headaxislength=5.4,
        minlength=0.5,
        zorder=4,
    )
    axes.update_datalim([start + along])


def _write_size(axes: Axes, tip: Array, along: Array, text: str, colour: str) -> None:
    """The size of a force whose arrow is cut, beyond its tip."""
    unit = along / np.linalg.norm(along)
    axes.annotate(
        text,
        (float(tip[0]), float(tip[1])),
        xytext=(9.0 * float(unit[0]), 9.0 * float(unit[1])),
        textcoords="offset points",
        color=colour,
        fontsize=8,
        ha="left" if unit[0] > 0.3 else "right" if unit[0] < -0.3 else "center",
        va="bottom" if unit[1] > 0.3 else "top" if unit[1] < -0.3 else "center",
        annotation_clip=False,
    )


def _frame(axes: Axes, path: Array) -> None:
    """Equal axes with room for the chair about the path."""
    axes.update_datalim([path.min(axis=0) - MARGIN, path.max(axis=0) + MARGIN])
    axes.set_aspect("equal", adjustable="datalim")
    axes.autoscale_view()
    axes.set_xlabel("x (m)")
    axes.set_ylabel("y (m)")
    axes.ticklabel_format(useOffset=False)
    axes.grid(alpha=0.3)


def _legend(figure: Figure, components: tuple[str, ...]) -> None:
    """Above the axes, where it covers nothing."""
    lines = [(FORCES[c], 2.6, f"{c} force on the tire") for c in components]
    lines += [(WHEEL, 2.2, "wheel"), (PATH, 1.2, "middle of the rear axle, from its dot")]
    entries = [Line2D([], [], color=colour, lw=lw, label=label) for colour, lw, label in lines]
    figure.legend(
        handles=entries, loc="outside upper left", ncols=len(entries), frameon=False, fontsize=9
    )


def _scale_bar(axes: Axes, usual: float, metre: float) -> None:
    """A bar as long as the arrow of a round force, with its number, below the axes' right end."""
    force = round_up(0.5 * usual)
    bar = AnchoredSizeBar(
        axes.transData,
        force / metre,
        f"{force:g} N",
        "upper right",
        pad=0.0,
        borderpad=2.2,
        sep=4,
        frameon=False,
        size_vertical=0.0,
        bbox_to_anchor=(1.0, 0.0),
        bbox_transform=axes.transAxes,
    )
    axes.add_artist(bar)
