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
from mjchair.simulation.initial import Initial

CHANNELS = ("left_wheel_speed", "right_wheel_speed", "imu_gyro.z")


@pytest.fixture(scope="module")
def coast():
    """Windows of a coast of 2 s, during which a person sits still."""
    run = mjchair.simulate(mjchair.load_spec("manual"), None, 2.0, initial={"speed": 1.0})
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
    asked = [Pulse(force, 0, 1.0, 0.2) for force in (Force.FORWARD, Force.YAW, Force.LEFT_WHEEL)]
    rigid = pulses.pulse_answers(simulator, found, asked)
    moving = pulses.pulse_answers(
        simulator, found, asked, lambda spec: rider_motion.measured(spec, 20.0)
    )
    for pulse, one, other in zip(asked, rigid, moving, strict=True):
        assert np.abs(one).max() > 0.0
        assert np.abs(other - one).max() < 0.05 * np.abs(one).max(), pulse.force
