"""What a study takes from its chair: radii and track, on a chair whose wheels are not 0.3 m."""

import numpy as np
import pytest

import mjchair
from mjchair.diagnosis.data import first_state
from mjchair.diagnosis.data.study import Run, make_study
from mjchair.errors import MjchairError
from mjchair.measurement.sensors import sensor
from mjchair.measurement.trial import Trial
from mjchair.model.rolling import rear_axle
from mjchair.simulation.initial import Initial
from mjchair.simulation.inputs import Inputs

TIME = np.round(np.arange(0.0, 3.0, 0.02), 6)
POWER_RADIUS = 0.17  # m, as models/power.xml has it
SPEED = 1.0 + 0.5 * np.sin(2.0 * np.pi * TIME)  # m/s
PULL = np.pi * np.cos(2.0 * np.pi * TIME)  # m/s^2


def study(channels, model="power", inputs=None):
    """A study of one run in memory."""
    trial = Trial("run", TIME, channels, inputs, {})
    run = Run(trial, "run", False, Initial(), frozenset())
    return make_study(mjchair.load_spec(model), [run])


def wheels(left, right=None):
    """Wheel speeds (rad/s) of rims that move at these speeds (m/s)."""
    right = left if right is None else right
    return {"left_wheel_speed": left / POWER_RADIUS, "right_wheel_speed": right / POWER_RADIUS}


def test_radius_and_track_are_the_models():
    manual, power = (rear_axle(mjchair.load_spec(m).compile()) for m in ("manual", "power"))
    assert (manual.left, manual.right, manual.track) == pytest.approx((0.3, 0.3, 0.56))
    assert power.left == pytest.approx(POWER_RADIUS)
    wide = mjchair.load_spec("manual")
    for side, sign in (("left", 1.0), ("right", -1.0)):
        body = wide.body(f"{side}_wheel")
        body.pos = np.add(body.pos, [0.0, 0.05 * sign, 0.0])
    assert rear_axle(wide.compile()).track == pytest.approx(0.66)


def test_the_first_speed_and_yaw_rate_are_of_this_chair():
    turn = 0.4  # rad/s
    track = rear_axle(mjchair.load_spec("power").compile()).track
    steady = np.ones(TIME.size)
    made = study(wheels((1.0 - 0.5 * turn * track) * steady, (1.0 + 0.5 * turn * track) * steady))
    begins = first_state.initial(made.runs[0], made.axle)
    assert begins.speed == pytest.approx(1.0, abs=1e-6)
    assert begins.yaw_rate == pytest.approx(turn, abs=1e-6)


def test_an_accelerometer_in_g_is_seen_on_small_wheels():
    fine = wheels(SPEED) | {"imu_accelerometer.x": PULL}
    assert study(fine).channels
    with pytest.raises(MjchairError, match=r"imu_accelerometer\.x looks like g"):
        study(fine | {"imu_accelerometer.x": PULL / 9.80665})


def test_a_fast_small_wheel_is_no_wheel_in_degrees():
    """6 m/s are 35 rad/s of these wheels, which a wheel of 0.3 m does not reach."""
    fast = wheels(6.2 - 0.2 * TIME)
    assert study(fast).channels
    with pytest.raises(MjchairError, match="left_wheel_speed looks like deg/s or rpm"):
        study(fast, "manual")


@pytest.mark.parametrize(
    ("wrong", "right"),
    [("left_wheel_sped", "left_wheel_speed"), ("imu_gyro.w", "imu_gyro"), ("headin", "heading")],
)
def test_a_misspelt_channel_is_refused_with_the_nearest_name(wrong, right):
    with pytest.raises(MjchairError, match=f"unknown channel '{wrong}'; did you mean '{right}"):
        study(wheels(SPEED) | {wrong: 0.1 * TIME})


def test_a_misspelt_input_is_refused_with_the_nearest_name():
    driven = Inputs(TIME, {"left_wheel": TIME, "right_weel": TIME})
    with pytest.raises(MjchairError, match="unknown channel 'right_weel'; did you mean 'right_wh"):
        study(wheels(SPEED), inputs=driven)


def test_a_sensor_is_known_by_the_end_of_its_name():
    assert sensor("imu_gyro.z").unit == "rad/s" and sensor("imu_gyro.z").bias
    assert sensor("robot/heading").wraps and not sensor("left_wheel_angle").wraps
    assert sensor("left_wheel_angle").free_zero and not sensor("left_caster_angle").free_zero
    assert sensor("something_else").unit == "?"
