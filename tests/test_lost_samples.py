"""Samples that are no measurement are left out; all that a chair can show stays."""

import numpy as np
import pytest

from mjchair.measurement.lost_samples import table_without_lost, without_lost
from mjchair.measurement.trial import Trial
from mjchair.model.rolling import RearAxle
from mjchair.simulation.inputs import Inputs

AXLE = RearAxle(0.3, 0.3, 0.56)


def a_trial(rate=100.0, torque=None, **channels):
    time = np.arange(0.0, 8.0, 1.0 / rate)
    rng = np.random.default_rng(0)
    made = {name: make(time, rng) for name, make in channels.items()}
    inputs = None if torque is None else Inputs(time, {"left_wheel": torque(time)}, "a")
    return Trial("a", time, made, inputs, {})


def pushed(time, rng):
    """Speed of a wheel, rad/s: a person pushes once a second."""
    return 3.0 + np.abs(np.sin(np.pi * time)) + 0.03 * rng.standard_normal(time.size)


def ticks(time, rng):
    """The same from a slow encoder that shows either nothing or one tick."""
    return np.where(rng.random(time.size) < 0.1, 2.6, 0.0)


def stops(time, rng):
    """Without noise: it rolls, and stands from one sample to the next."""
    return np.where(time < 4.0, 3.0, 0.0)


def turns(time, rng):
    """A heading that wraps, rad."""
    return (2.0 * time + np.pi) % (2.0 * np.pi) - np.pi + 1e-3 * rng.standard_normal(time.size)


def again(time, rng):
    """A wheel's angle that starts again once a turn, rad."""
    return (6.0 * time) % (2.0 * np.pi)


@pytest.mark.parametrize("rate", [10.0, 100.0, 1000.0])
@pytest.mark.parametrize(
    ("name", "make"),
    [
        *(("left_wheel_speed", make) for make in (pushed, ticks, stops)),
        ("heading", turns),
        ("left_wheel_angle", again),
        ("left_caster_angle", lambda t, rng: 0.4 * np.sin(40.0 * t)),  # it shimmies
        ("imu_accelerometer.x", lambda t, rng: np.where(np.abs(t - 3.0) < 1e-6, 60.0, 0.1)),
    ],
)
def test_what_a_chair_can_show_stays(name, make, rate):
    trial = a_trial(rate, **{name: make})
    kept, said = without_lost(trial, AXLE)
    assert kept is trial and not said


@pytest.mark.parametrize(
    ("name", "make", "value"),
    [
        ("left_wheel_speed", pushed, -655.36),
        ("left_wheel_speed", pushed, 12.0),  # which a fast wheel may show, but not for one sample
        ("imu_gyro.z", lambda t, rng: 1e-3 * rng.standard_normal(t.size), 1e4),
        ("heading", turns, -2.0),
        ("imu_accelerometer.x", lambda t, rng: 0.1 * rng.standard_normal(t.size), 327.68),
    ],
)
@pytest.mark.parametrize("last", [402, 404])
def test_a_spike_is_left_out_and_said_and_nothing_else(name, make, value, last):
    trial = a_trial(**{name: make})
    trial.channels[name][402:last:2] = value
    trial.channels[name][402] = value
    (kept, said), bad = without_lost(trial, AXLE), trial.channels[name] == value
    np.testing.assert_array_equal(np.isnan(kept.channels[name]), bad)
    assert len(said) == 1 and name in said[0] and "no chair can show" in said[0]
    assert not np.isnan(trial.channels[name]).any()  # the run that was given is as it was


def test_a_spike_of_a_torque_is_left_out():
    trial = a_trial(torque=lambda t: np.where(t == 2.0, 9e9, 5.0), left_wheel_speed=pushed)
    kept, said = without_lost(trial, AXLE)
    assert "a sample of left_wheel left out" in said[0]
    assert kept.inputs.at("left_wheel", 2.0) == 5.0


def test_a_channel_in_another_unit_is_no_row_of_spikes():
    trial = a_trial(left_wheel_speed=lambda t, rng: np.degrees(pushed(t, rng)))
    kept, said = without_lost(trial, AXLE)
    assert kept is trial and not said


def test_a_value_that_is_held_and_then_jumps_is_left_out_and_said():
    trial = a_trial(left_wheel_speed=pushed)
    speed = trial.channels["left_wheel_speed"]
    speed[230:300] = speed[230]
    kept, said = without_lost(trial, AXLE)
    gone = np.isnan(kept.channels["left_wheel_speed"])
    np.testing.assert_array_equal(np.flatnonzero(gone), np.arange(230, 300))
    assert said == [
        f"a: left_wheel_speed repeats {speed[230]:.4g} from 2.30 to 2.99 s and then "
        "jumps; left out there"
    ]


def steady(time, rng):
    """A power chair gains speed, holds it to the last digit of its encoder, and slows down."""
    return np.round(np.interp(time, [0.0, 2.0, 5.0, 8.0], [0.0, 3.0, 3.0, 0.0]), 3)


def held(time, rng):
    """Sampled at 10 Hz and written at 100 Hz."""
    return pushed(np.floor(10.0 * time) / 10.0, np.random.default_rng(0)).round(3)


@pytest.mark.parametrize("make", [steady, held, stops])
def test_a_rate_that_rests_or_is_written_more_often_than_measured_stays(make):
    trial = a_trial(left_wheel_speed=make)
    kept, said = without_lost(trial, AXLE)
    assert kept is trial and not said


@pytest.mark.parametrize("span", [(0, 40), (230, 300), (760, 800)])
def test_a_code_for_missing_samples_is_no_angle_and_no_torque(span):
    trial = a_trial(torque=lambda t: 5.0 * np.sin(t), left_wheel_angle=lambda t, rng: 3.0 * t)
    for values in (trial.channels["left_wheel_angle"], trial.inputs.controls["left_wheel"]):
        values.flags.writeable = True
        values[slice(*span)] = -9999.0
    kept, said = without_lost(trial, AXLE)
    gone = np.isnan(kept.channels["left_wheel_angle"])
    np.testing.assert_array_equal(np.flatnonzero(gone), np.arange(*span))
    np.testing.assert_array_equal(np.isnan(kept.inputs.controls["left_wheel"]), gone)
    assert len(said) == 2 and all("repeats -9999" in line for line in said)


def test_an_angle_and_a_torque_that_rest_stay():
    trial = a_trial(
        torque=lambda t: np.where(t < 4.0, 0.0, 9.0),
        left_wheel_angle=lambda t, rng: np.maximum(0.0, 3.0 * (t - 4.0)),
    )
    kept, said = without_lost(trial, AXLE)
    assert kept is trial and not said


def test_a_table_has_the_same_rule():
    trial = a_trial(torque=lambda t: 5.0 * np.sin(t), left_wheel_speed=pushed)
    columns = {**trial.channels, "left_wheel": trial.inputs.controls["left_wheel"].copy()}
    columns["left_wheel_speed"][230:300] = -9999.0
    columns["left_wheel"][100] = 9e9
    kept, said = table_without_lost(trial.time, columns, "a.csv", AXLE)
    assert list(kept) == list(columns)
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(kept["left_wheel"])), [100])
    gone = np.flatnonzero(np.isnan(kept["left_wheel_speed"]))
    np.testing.assert_array_equal(gone, np.arange(230, 300))
    assert len(said) == 2
