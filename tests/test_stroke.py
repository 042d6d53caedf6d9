"""The rider pushes: hands go with the rims in the push, and come back above them."""

import csv

import mujoco
import numpy as np
import pytest

import mjchair
from mjchair.cli import main
from mjchair.errors import MjchairError
from mjchair.rider.rider import Rider
from mjchair.rider.stroke import Stroke, push_motion

STROKE = Stroke(period=1.15, push=0.46, start=0.2, duration=4.0)
TIME = np.linspace(0.0, 4.0, 801)


@pytest.fixture(scope="module")
def model():
    return mjchair.load_spec("manual", rider="moving").compile()


@pytest.fixture(scope="module")
def motion(model):
    return push_motion(model, STROKE, TIME)


def grips(model, motion):
    """Places (n, 3) m of both grips in the chair's frame."""
    data = mujoco.MjData(model)
    out = {"left": [], "right": []}
    for k in range(len(TIME)):
        for name, angles in motion.items():
            data.joint(name).qpos[0] = angles[k]
        mujoco.mj_kinematics(model, data)
        for side, places in out.items():
            places.append(data.site(f"rider_{side}_grip").xpos.copy())
    return {side: np.array(places) for side, places in out.items()}


def test_hands_are_on_the_rims_while_they_push_and_off_them_else(model, motion):
    """The rim of the shipped chair: radius 0.26 m about (0, +-0.315, 0.30)."""
    torque = mjchair.push_strokes({"left_wheel": 1.0}, 4.0, period=1.15, push=0.46, start=0.2)
    pushed = torque.controls["left_wheel"] > 1e-6
    assert np.array_equal(torque.time, TIME) and pushed.sum() == 273
    middle = np.mod(TIME - 0.2, 1.15) - 0.46 - 0.5 * (1.15 - 0.46)
    recovering = (np.abs(middle) < 0.1) & (TIME > 0.2)
    for side, y in (("left", 0.315), ("right", -0.315)):
        place = grips(model, motion)[side]
        away = np.hypot(np.hypot(place[:, 0], place[:, 2] - 0.30) - 0.26, place[:, 1] - y)
        assert away[pushed].max() < 2e-3
        assert away[recovering].min() > 0.02
        angle = np.unwrap(np.arctan2(place[:, 0], place[:, 2] - 0.30))
        speed = np.gradient(angle, TIME)
        assert speed[pushed] == pytest.approx(np.radians(70.0) / 0.46, rel=0.05)
        assert np.degrees(angle[pushed].min()) == pytest.approx(-30.0, abs=1.0)


def test_the_motion_is_smooth_and_begins_and_ends_at_rest(motion):
    fastest = max(np.abs(np.gradient(angles, TIME)).max() for angles in motion.values())
    for angles in motion.values():
        speed = np.gradient(angles, TIME)
        assert np.abs(speed[[0, -1]]).max() < 0.1 * fastest
        assert np.abs(np.diff(speed)).max() < 1.0  # rad/s from one sample to the next


def test_strokes_that_cannot_be(model):
    with pytest.raises(MjchairError, match=r"push lasts 2 s"):
        Stroke(period=1.0, push=2.0, start=0.0, duration=3.0)
    with pytest.raises(MjchairError, match=r"leave ahead"):
        Stroke(1.15, 0.46, 0.2, 4.0, contact=0.5, release=0.4)
    far = Stroke(1.15, 0.46, 0.2, 4.0, release=np.radians(100.0))
    with pytest.raises(MjchairError, match=r"left hand misses .* choose a smaller angle"):
        push_motion(model, far, TIME)
    with pytest.raises(MjchairError, match="no push rims"):
        push_motion(mjchair.load_spec("power", rider=Rider()).compile(), STROKE, TIME)
    with pytest.raises(MjchairError, match="rider is rigid"):
        push_motion(mjchair.load_spec().compile(), STROKE, TIME)


def test_the_command_moves_the_rider(tmp_path):
    out = tmp_path / "run"
    given = ["simulate", "--rider", "moving", "--push", "8,8", "--duration", "0.8"]
    assert main([*given, "--sample-rate", "100", "--out", str(out)]) == 0
    with (out / "recording.csv").open() as file:
        rows = list(csv.DictReader(file))
    bend = np.array([float(row["rider_trunk_flexion_angle"]) for row in rows])
    assert np.degrees(bend.max()) == pytest.approx(12.0, abs=0.5)
    assert bend.argmax() == pytest.approx(66, abs=2)  # at the release, 0.66 s
