"""Figures of a recording: what they show, and that it can be read on the worst of inputs."""

import dataclasses

import matplotlib.pyplot as plt
import numpy as np
import pytest
from figure_layout import Layout, assert_legible
from matplotlib.figure import Figure
from matplotlib.quiver import Quiver

import mjchair
from mjchair.errors import MjchairError
from mjchair.report.colours import FORCES, rgb
from mjchair.report.figure_file import save
from mjchair.report.trajectory import trajectory
from mjchair.report.wheel_speed import wheel_speed

PNG = b"\x89PNG"
NOTE = "A sentence of the length that the demonstration has, with what was assumed. " * 4


@pytest.fixture(scope="module")
def run():
    torque = mjchair.constant({"left_wheel": 14.0, "right_wheel": 4.0}, 2.0)
    spec = mjchair.load_spec("manual")
    return mjchair.simulate(spec, torque, initial={"speed": 1.0}, sample_rate=100.0)


@pytest.fixture(scope="module")
def rest():
    return mjchair.simulate(mjchair.load_spec("manual"), None, 0.3)


def test_a_figure_shows_itself_in_a_notebook(run):
    assert trajectory(run)._repr_png_().startswith(PNG)


def with_force(run, channel, value, where=slice(None)):
    """The recording with another force in a channel."""
    changed = run[channel].copy()
    changed[where] = value
    return dataclasses.replace(run, channels={**run.channels, channel: changed})


def only(run, channel):
    """The recording with this force alone."""
    nothing = np.zeros(run.time.size)
    forces = (".Fx", ".Fy", ".Fz")
    channels = {
        name: nothing if name.endswith(forces) and name != channel else values
        for name, values in run.channels.items()
    }
    return dataclasses.replace(run, channels=channels)


def arrows(figure):
    """Start (2,), vector (2,) in m, and colour of every arrow."""
    found = [a for a in figure.axes[0].collections if isinstance(a, Quiver)]
    return [
        (q.get_offsets()[0], np.array([q.U[0], q.V[0]]), tuple(q.get_facecolor()[0][:3]))
        for q in found
    ]


def newtons_a_metre(figure):
    """From the bar below the axes: its number over its length."""
    (bar,) = (a for a in figure.axes[0].artists if type(a).__name__ == "AnchoredSizeBar")
    force = float(bar.txt_label.get_text().removesuffix(" N"))
    return force / bar.size_bar.get_children()[0].get_width()


def test_wheel_speed_shows_both_and_says_units(run):
    measured = (np.array([0.0, 1.0]), np.array([1.0, 2.0]))
    figure = wheel_speed(run, measured, "title", "a note")
    top, bottom = figure.axes
    labels = [line.get_label() for line in top.lines]
    assert labels == ["measured", "simulated, left wheel", "simulated, right wheel"]
    assert top.get_ylabel() == "wheel speed (rad/s)"
    assert bottom.get_ylabel() == "axle torque (N m)"
    assert bottom.get_xlabel() == "time (s)"
    np.testing.assert_array_equal(top.lines[1].get_ydata(), run["left_wheel_speed"])


def test_a_chair_at_rest_shows_no_mountains_of_rounding(rest):
    top, bottom = wheel_speed(rest).axes
    assert np.abs(rest["left_wheel_speed"]).max() < 0.01  # rad/s: this is what is to be drawn
    for axes, least in ((top, 0.1), (bottom, 0.5)):
        low, high = axes.get_ylim()
        assert low <= -least and high >= least
    assert not arrows(trajectory(rest))


@pytest.mark.parametrize("side", ["left_wheel", "right_wheel"])
@pytest.mark.parametrize(("component", "letter"), [("lateral", "Fy"), ("longitudinal", "Fx")])
def test_an_arrow_is_the_force_in_the_worlds_axes(run, side, component, letter):
    """Against the heading alone: rear wheels without toe and camber point along the chair."""
    channel = f"{side}_tire.{letter}"
    figure = trajectory(only(run, channel), components=(component,), arrows=5)
    unit = newtons_a_metre(figure)
    drawn = sorted(arrows(figure), key=lambda a: a[0][0])  # the chair drives along x
    assert len(drawn) == 5
    middle, half = run.vector("position")[:, :2], 0.28  # m, of the track
    for start, vector, colour in drawn:
        assert colour == pytest.approx(rgb(FORCES[component]))
        sides = np.column_stack([-np.sin(run["heading"]), np.cos(run["heading"])])
        wheel = middle + (half if side == "left_wheel" else -half) * sides
        sample = int(np.argmin(np.linalg.norm(wheel - start, axis=1)))
        assert np.linalg.norm(wheel[sample] - start) < 0.02  # m
        heading = run["heading"][sample]
        axis = [np.cos(heading), np.sin(heading)] if letter == "Fx" else sides[sample]
        expected = run[channel][sample] * np.array(axis)
        np.testing.assert_allclose(vector * unit, expected, atol=0.02 * np.linalg.norm(expected))


def test_one_giant_force_neither_stretches_the_axes_nor_shrinks_the_others(run):
    before = trajectory(run)
    after = trajectory(with_force(run, "left_wheel_tire.Fy", 9000.0, slice(60, 110)))
    assert newtons_a_metre(after) < 2.5 * newtons_a_metre(before)
    for plain, giant in zip(
        before.axes[0].dataLim.bounds, after.axes[0].dataLim.bounds, strict=True
    ):
        assert abs(plain - giant) < 1.0  # m
    assert "9000 N" in [text.get_text() for text in after.axes[0].texts]
    assert_legible(after)


@pytest.mark.parametrize(
    "case", ["turn", "rest", "giant", "far", "title and note", "straight and long"]
)
def test_a_view_from_above_can_be_read(run, rest, case):
    path = run.vector("position")
    moved = {f"position.{axis}": 40.0 * path[:, k] for k, axis in enumerate("xyz")}
    straight = {
        "position.y": np.zeros(run.time.size),
        "position.x": np.linspace(0, 60, path[:, 0].size),
    }
    recording = {
        "turn": run,
        "rest": rest,
        "giant": with_force(run, "right_caster_tire.Fx", -900.0, slice(50, 150)),
        "far": dataclasses.replace(run, channels={**run.channels, **moved}),
        "title and note": run,
        "straight and long": dataclasses.replace(run, channels={**run.channels, **straight}),
    }[case]
    words = ("A run from above, with the tires' forces", NOTE) if "note" in case else ("", "")
    assert_legible(trajectory(recording, *words))


@pytest.mark.parametrize("words", [("", ""), ("A measured push rim drives the chair", NOTE)])
def test_wheel_speeds_can_be_read(run, rest, words):
    measured = (run.time, run["left_wheel_speed"] + 0.1)
    for figure in (wheel_speed(run, measured, *words), wheel_speed(rest, None, *words)):
        assert_legible(figure)


def test_the_view_from_above_has_units_a_legend_and_a_scale(run):
    figure = trajectory(run, "title", "a note")
    (axes,) = figure.axes
    assert axes.get_xlabel() == "x (m)" and axes.get_ylabel() == "y (m)"
    legend = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "lateral force on the tire" in legend
    assert newtons_a_metre(figure) > 0.0


def test_the_checks_of_a_layout_see_what_is_wrong():
    figure = Figure(figsize=(4, 3))
    axes = figure.subplots()
    axes.plot([0, 1], [0, 1], label="a line")
    axes.legend(loc="upper left")
    axes.text(0.5, 0.5, "one word")
    axes.text(0.52, 0.5, "another")
    axes.text(0.8, 0.2, "beyond the edge of the figure")
    layout = Layout(figure)
    assert ("one word", "another") in layout.overlapping()
    assert layout.cut_off() == ["beyond the edge of the figure"]
    assert layout.legends_over_axes() == ["a line"]


def test_the_same_figure_is_the_same_file(run, tmp_path):
    for name in ("a.png", "b.png"):
        save(trajectory(run), tmp_path / name)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_drawing_leaves_nobody_elses_figures_and_backend_alone(run):
    before = plt.get_fignums()
    trajectory(run)
    assert plt.get_fignums() == before


def test_other_suffixes_are_refused(run, tmp_path):
    with pytest.raises(MjchairError, match="a figure ends in one of"):
        save(wheel_speed(run), tmp_path / "a.xyz")
    assert not list(tmp_path.iterdir())
