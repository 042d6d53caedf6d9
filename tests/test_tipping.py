"""Windows in which the chair of the model tips, and no channel shows it."""

import math
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest

import mjchair
from mjchair.diagnosis.fit.bench import Bench
from mjchair.diagnosis.replay import tipping

CHAIR = mjchair.load_spec().compile()


def turned(axis, angles):
    """Places (n, 7) of a chair that is turned by angles (n,) rad about an axis."""
    half = 0.5 * np.asarray(angles)
    quaternion = np.column_stack([np.cos(half), np.sin(half)[:, None] * np.asarray(axis)])
    return np.hstack([np.zeros((half.size, 3)), quaternion])


def simulator(*channels):
    """A study of one run in two windows."""
    run = SimpleNamespace(trial=SimpleNamespace(channels=dict.fromkeys(channels)))
    study = SimpleNamespace(runs=[run], fitted=(0,))
    windows = [SimpleNamespace(run=0)] * 2
    return SimpleNamespace(study=study, windows=windows, base=CHAIR)


def track(*leans):
    """A track of windows with a chair that leans back by so much (rad) and comes down again."""
    traces = [turned([0.0, 1.0, 0.0], [0.0, -lean, 0.0]) for lean in leans]
    return SimpleNamespace(trace=[{"qpos": qpos} for qpos in traces])


@pytest.mark.parametrize("axis", [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.6, 0.8, 0.0]])
def test_the_lean_is_the_angle_about_any_level_axis(axis):
    found = tipping.largest_lean(CHAIR, turned(axis, [0.1, 0.05, -0.2]))
    assert found == pytest.approx(0.3, abs=1e-9)


def test_a_chair_that_turns_on_the_floor_does_not_lean():
    assert tipping.largest_lean(CHAIR, turned([0.0, 0.0, 1.0], [0.0, 1.0, 3.0])) < 1e-7


def test_a_window_that_tips_is_no_window_to_fit_to():
    tips = tipping.tipped(simulator("left_wheel_speed"), track(0.1, 0.005))
    assert tips == {0: pytest.approx(0.1)}
    assert Bench(simulator(), {}, (), tipped=tips).windows.tolist() == [1]


def test_where_all_tip_all_are_fitted_to():
    assert Bench(simulator(), {}, (), tipped={0: 0.1, 1: 0.1}).windows.tolist() == [0, 1]


def test_a_gyroscope_that_shows_the_lean_tells_what_it_was():
    assert tipping.tipped(simulator("imu_gyro.y"), track(0.1, 0.1)) == {}


@pytest.mark.parametrize(("solid", "tips"), [(0, True), (1, False)])
def test_a_chair_that_rolls_over_something_leans_and_does_not_tip(solid, tips):
    spec = mjchair.load_spec()
    size = [0.5, 1.0, 0.02]
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX, size=size, contype=solid, conaffinity=solid
    )
    over = SimpleNamespace(**{**vars(simulator()), "base": spec.compile()})
    assert bool(tipping.tipped(over, track(0.1, 0.0))) == tips


def test_strokes_do_not_count_as_tipping():
    """R = 0.3 m, 87 kg: strokes of up to 20 N m a wheel lean the shipped chair by 0.4 degrees."""
    assert tipping.tipped(simulator(), track(math.radians(0.4), math.radians(2.9))) == {}
