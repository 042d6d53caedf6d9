"""Pulses of force on a chair, and what they change in the measured channels."""

import numpy as np
import pytest

import mjchair
from mjchair.diagnosis.data.study import Run, make_study
from mjchair.diagnosis.replay import noise, pulses
from mjchair.diagnosis.replay.pulses import Force, Pulse
from mjchair.diagnosis.replay.simulator import WindowSimulator
from mjchair.diagnosis.replay.window_states import track
from mjchair.effects import rider_motion
from mjchair.measurement.trial import Trial
from mjchair.model import parts
from mjchair.simulation.initial import Initial
from mjchair.tire import block

CHANNELS = ("left_wheel_speed", "right_wheel_speed", "imu_gyro.z")


@pytest.fixture(scope="module")
def coast():
    """Windows of a coast of 4 s, during which a person sits still."""
    run = mjchair.simulate(mjchair.load_spec("manual"), None, 4.0, initial={"speed": 1.0})
    still = {"rider_motion": np.zeros(run.time.size)}
    measured = {c: np.asarray(run.channels[c]) for c in CHANNELS}
    trial = Trial("coast", run.time, measured, None, still)
    made = Run(trial, "coast", False, Initial(speed=1.0), frozenset({"speed"}))
    study = make_study(mjchair.load_spec("manual"), [made], dict.fromkeys(CHANNELS, 0.01))
    simulator = WindowSimulator(study, threads=1)
    return simulator, track(simulator, simulator.base, noise.estimate(study))


def test_a_pulse_acts_on_the_same_joint_of_a_chair_with_more_joints(coast):
    """A person who may move and does not answers as a rigid one; the joint stands before others."""
    simulator, found = coast
    asked = [Pulse(force, 0, 1.0, 0.2) for force in (Force.FORWARD, Force.YAW)]
    rigid = pulses.pulse_answers(simulator, found, asked)
    moving = pulses.pulse_answers(
        simulator, found, asked, lambda spec: rider_motion.measured(spec, 20.0)
    )
    for pulse, one, other in zip(asked, rigid, moving, strict=True):
        assert np.abs(one).max() > 0.0
        assert np.abs(other - one).max() < 0.05 * np.abs(one).max(), pulse.force


@pytest.mark.parametrize(("force", "at"), [(Force.YAW, 1.0), (Force.LEFTWARD, 1.6)])
def test_a_pulse_that_begins_later_answers_as_one_simulated_from_the_start(
    coast, monkeypatch, force, at
):
    """Before it begins nothing changes, so it goes on from the course without it."""
    simulator, found = coast
    asked = [
        Pulse(force, 0, _time(simulator, 0, at), 0.2),
        Pulse(force, 1, _time(simulator, 1, at), 0.2),
    ]
    late = pulses.pulse_answers(simulator, found, asked)
    monkeypatch.setattr(pulses, "_begin", lambda *_: 0)
    whole = pulses.pulse_answers(simulator, found, asked)
    for pulse, one, other in zip(asked, late, whole, strict=True):
        w = simulator.windows[pulse.window]
        time = simulator.study.runs[w.run].trial.time[w.rows]
        assert (one[time < pulse.time - pulse.width - 0.01] == 0.0).all()
        assert np.abs(other).max() > 0.0
        assert np.abs(other - one).max() < 1e-8 * np.abs(other).max()


def _time(simulator, window, after):
    """A time (s) of a run, this long after a window begins."""
    return simulator.windows[window].first + after


def test_windows_that_are_not_asked_for_stay_as_they_were(coast):
    """A heavier chair's states in one window alone are those that it has in a track of all."""
    simulator, found = coast
    assert len(simulator.windows) > 1
    model = simulator.compile(lambda spec: parts.add_to_tires(spec, block.ROLLING_RESISTANCE, 0.01))
    known = noise.estimate(simulator.study)
    every = track(simulator, model, known, before=found, anew=True)
    one = track(simulator, model, known, before=found, anew=True, only=[0])
    assert (one.predicted[0] == every.predicted[0]).all()
    assert (one.states[0].qvel == every.states[0].qvel).all()
    assert one.predicted[1] is found.predicted[1] and one.slow[1] is found.slow[1]
    assert not np.array_equal(every.predicted[1], found.predicted[1])
