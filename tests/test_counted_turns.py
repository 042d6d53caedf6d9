"""A heading whose gain is off, over more than a turn: turns are counted as in the table."""

import numpy as np
import pytest

import mjchair
from mjchair.diagnosis.data.study import Run, make_study
from mjchair.diagnosis.replay import noise
from mjchair.diagnosis.replay.sampling import TURN, beside, course
from mjchair.diagnosis.replay.sensor_errors import SensorErrors
from mjchair.diagnosis.replay.simulator import WindowSimulator
from mjchair.diagnosis.replay.window_states import track
from mjchair.measurement.trial import Trial
from mjchair.simulation.initial import Initial

CHANNELS = ("left_wheel_speed", "right_wheel_speed", "heading")
GAIN = 1.02
TORQUES = {"left_wheel": -8.0, "right_wheel": 8.0}


def spin(wrapped):
    """A study of a chair that turns on the spot, its heading shown with a gain."""
    time = np.arange(0.0, 8.0, 0.02)
    driven = {wheel: np.full(time.size, torque) for wheel, torque in TORQUES.items()}
    turning = mjchair.Inputs(time, driven)
    run = mjchair.simulate(mjchair.load_spec("manual"), turning, 7.9, sample_rate=50.0)
    measured = {c: np.asarray(run.channels[c]) for c in CHANNELS}
    measured["heading"] = GAIN * np.unwrap(measured["heading"])
    assert np.ptp(measured["heading"]) > 1.5 * TURN
    if wrapped:
        measured["heading"] = (measured["heading"] + np.pi) % TURN - np.pi
    trial = Trial("spin", run.time, measured, turning, {})
    made = Run(trial, "spin", False, Initial(), frozenset({"speed"}))
    return make_study(mjchair.load_spec("manual"), [made], dict.fromkeys(CHANNELS, 0.01))


@pytest.mark.parametrize("wrapped", [False, True])
def test_predicted_headings_count_the_turns_as_the_table_does(wrapped):
    """A gain of 2 % is 0.13 rad more in every further turn, whichever window it lies in."""
    study = spin(wrapped)
    simulator = WindowSimulator(study, threads=1)
    errors = SensorErrors(simulator.channels, scale={"heading": GAIN - 1.0})
    found = track(simulator, simulator.base, noise.estimate(study), errors)
    whole = course(study.runs[0].trial.channels["heading"])
    heading = list(simulator.channels).index("heading")
    assert len(simulator.windows) > 2
    for w, predicted in zip(simulator.windows, found.predicted, strict=True):
        assert np.abs(whole[w.rows] - predicted[:, heading]).max() < 0.03


def test_a_course_passes_over_gaps_and_an_angle_without_samples_stays():
    seen = np.array([3.0, np.nan, -3.0, np.nan, -2.9])
    counted = course(seen)
    np.testing.assert_allclose(counted, [3.0, np.nan, TURN - 3.0, np.nan, TURN - 2.9])
    predicted = np.array([-3.1, -3.0])
    np.testing.assert_allclose(beside(predicted, counted[2:4]), TURN + predicted)
    assert (beside(predicted, np.full(2, np.nan)) == predicted).all()


def test_a_first_sample_beyond_the_wrap_does_not_count_as_a_turn():
    """A chair that begins at 180 degrees: noise puts its first sample on the other side."""
    seen = np.r_[3.1, np.full(40, -3.12)]
    np.testing.assert_allclose(course(seen), np.r_[3.1 - TURN, np.full(40, -3.12)])
    turns = np.linspace(0.5, 0.5 + 2.0 * TURN, 100)
    np.testing.assert_allclose(course((turns + np.pi) % TURN - np.pi), turns)
