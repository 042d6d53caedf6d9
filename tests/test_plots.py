import matplotlib.pyplot as plt
import numpy as np
import pytest

import mjchair
from mjchair.errors import MjchairError
from mjchair.report import plots
from mjchair.report.forces import COLOURS


@pytest.fixture(scope="module")
def run():
    torque = mjchair.constant({"left_wheel": 14.0, "right_wheel": 4.0}, 2.0)
    return mjchair.simulate(mjchair.load_spec("manual"), torque, initial={"speed": 1.0})


@pytest.fixture(autouse=True)
def closed():
    yield
    plt.close("all")


def test_wheel_speed_shows_both_and_says_units(run):
    measured = (np.array([0.0, 1.0]), np.array([1.0, 2.0]))
    figure = plots.wheel_speed(run, measured, "title", "a note")
    top, bottom = figure.axes
    labels = [line.get_label() for line in top.lines]
    assert labels == ["measured", "simulated, left wheel", "simulated, right wheel"]
    assert top.get_ylabel() == "wheel speed (rad/s)"
    assert bottom.get_ylabel() == "axle torque (N m)"
    assert bottom.get_xlabel() == "time (s)"
    np.testing.assert_array_equal(top.lines[1].get_ydata(), run["left_wheel_speed"])


def test_arrows_point_the_way_the_force_does(run):
    figure = plots.trajectory(run, components=("lateral",), arrows=3)
    (axes,) = figure.axes
    arrows = [a for a in axes.texts if getattr(a, "arrow_patch", None) is not None]
    assert arrows
    # the weaker right side: the chair turns right, so the rear tires push it to its right
    for arrow in arrows:
        heading = run["heading"][-1]
        across = np.array([-np.sin(heading), np.cos(heading)])
        start, end = np.array(arrow.xyann), np.array(arrow.xy)
        assert arrow.arrow_patch.get_facecolor()[:3] == pytest.approx(COLOURS["lateral"])
        assert (end - start) @ across < 0.0 or np.linalg.norm(end - start) < 0.1


def test_a_top_view_has_units_a_legend_and_a_scale(run):
    figure = plots.trajectory(run, "title", "a note")
    (axes,) = figure.axes
    assert axes.get_xlabel() == "x (m)" and axes.get_ylabel() == "y (m)"
    legend = [text.get_text() for text in axes.get_legend().get_texts()]
    assert "lateral force on the tire" in legend
    assert any(type(artist).__name__ == "AnchoredSizeBar" for artist in axes.artists)


def test_a_chair_that_stays_can_be_drawn(tmp_path):
    still = mjchair.simulate(mjchair.load_spec("manual"), None, 0.1)
    plots.save(plots.trajectory(still), tmp_path / "a.png")
    assert (tmp_path / "a.png").stat().st_size > 5000


def test_other_suffixes_are_refused(run, tmp_path):
    with pytest.raises(MjchairError, match="a figure ends in one of"):
        plots.save(plots.wheel_speed(run), tmp_path / "a.xyz")
    assert not list(tmp_path.iterdir())
