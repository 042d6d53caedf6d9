"""A run in which the casters shimmy: where it does, and the states from which windows begin."""

import numpy as np
import pytest

import mjchair
from mjchair.diagnosis.data import shimmy
from mjchair.diagnosis.data.shimmy import CASTERS
from mjchair.diagnosis.data.study import Run, make_study
from mjchair.diagnosis.replay import noise
from mjchair.diagnosis.replay.chair_state import SHIMMY, SLOW
from mjchair.diagnosis.replay.simulator import WindowSimulator
from mjchair.diagnosis.replay.window_search import prior
from mjchair.diagnosis.replay.window_states import track
from mjchair.effects import relaxation_length
from mjchair.measurement.trial import Trial
from mjchair.simulation.initial import Initial

CHANNELS = (*CASTERS, "left_wheel_speed", "right_wheel_speed", "imu_gyro.z")
SCATTER = 0.01  # rad, m/s and rad/s, of every sensor
LENGTH = 0.09  # m, of relaxation besides the chair's own: its casters shimmy
BEGINS = {"speed": 1.8, "yaw_rate": 1.2}
EVERY = 5  # steps a sample


def _trial(time, **angles):
    return Trial("run", time, {f"{side}_caster_angle": a for side, a in angles.items()}, None, {})


def test_two_casters_that_shimmy_together_are_one_stretch():
    time = np.arange(0.0, 6.0, 0.01)

    def swings(frequency, begin, end):
        return 0.3 * np.sin(2.0 * np.pi * frequency * time) * ((time > begin) & (time < end))

    trial = _trial(time, left=swings(8.0, 1.0, 3.0), right=swings(12.0, 2.0, 4.0))
    (one,) = shimmy.stretches(trial)
    assert one.begin == pytest.approx(1.0, abs=0.1) and one.end == pytest.approx(4.0, abs=0.1)
    assert one.swing == pytest.approx(0.5 / 12.0, abs=0.01)
    later = _trial(time, left=swings(8.0, 1.0, 2.0), right=swings(8.0, 3.0, 4.0))
    assert len(shimmy.stretches(later)) == 2


def test_how_a_caster_turns_is_read_off_its_samples():
    time = np.arange(0.0, 2.0, 0.01)
    trial = _trial(time, left=np.angle(np.exp(1j * (3.0 + 0.5 * np.sin(100.0 * time)))))
    for when in (0.0, 0.5, 0.703, 1.111):
        there = shimmy.turned(trial, CASTERS[0], when, 0.03)
        swing = 0.5 * np.array([np.sin(100.0 * when), np.cos(100.0 * when)])
        assert abs(np.angle(np.exp(1j * (there.angle - 3.0 - swing[0])))) < 0.01
        assert there.rate == pytest.approx(100.0 * swing[1], abs=1.5)
        assert there.acceleration == pytest.approx(-1e4 * swing[0], abs=150.0)


def _edit(spec):
    relaxation_length.edit(spec, LENGTH)


@pytest.fixture(scope="module")
def shaking():
    """Windows of a chair whose casters shimmy, by a model in which they do not."""
    spec = mjchair.load_spec("manual")
    _edit(spec)
    run = mjchair.simulate(spec, None, 3.0, initial=BEGINS)
    rng = np.random.default_rng(4)
    time = run.time[::EVERY]
    measured = {
        c: np.asarray(run.channels[c])[::EVERY] + SCATTER * rng.standard_normal(time.size)
        for c in CHANNELS
    }
    trial = Trial("turn", time, measured, None, {})
    made = Run(trial, "turn", False, Initial(**BEGINS), frozenset())
    study = make_study(mjchair.load_spec("manual"), [made], dict.fromkeys(CHANNELS, SCATTER))
    return WindowSimulator(study, threads=1)


def test_states_of_the_right_chair_are_found_from_those_of_one_that_does_not_shimmy(shaking):
    """At once: the casters begin as measured, with tires bent as their accelerations ask for."""
    known = noise.estimate(shaking.study)
    shimmying = [i for i, w in enumerate(shaking.windows) if w.shimmies]
    assert len(shimmying) > 5
    casters = [shaking.channels.index(c) for c in CASTERS]

    def left(found):  # of every window, over the noise
        miss = [shaking.measured(shaking.windows[i]) - found.predicted[i] for i in shimmying]
        return [np.sqrt(np.mean(np.square(m[:, casters]))) / SCATTER for m in miss]

    found = track(shaking, shaking.base, known)
    assert np.median(left(found)) > 5.0
    right = shaking.compile(_edit)
    found = track(shaking, right, known, before=found, anew=True)
    assert max(left(found)) < 1.2


def test_a_shimmy_is_no_noise(shaking):
    known = noise.estimate(shaking.study)
    assert [known[c].white for c in CHANNELS] == pytest.approx([SCATTER] * len(CHANNELS), rel=0.1)


def test_how_casters_swing_is_free_only_where_they_shimmy(shaking):
    states = track(shaking, shaking.base, noise.estimate(shaking.study)).states
    for i, (w, state) in enumerate(zip(shaking.windows, states, strict=True)):
        spread = prior(shaking, i, state)
        assert spread.shape == (len(SLOW),)
        assert (spread[SHIMMY] > 1e-3).all() == w.shimmies
