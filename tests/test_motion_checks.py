"""A measured motion that jumps is said to, and one that is only quick or noisy is not."""

import re
from dataclasses import replace
from types import MappingProxyType

import numpy as np
import pytest

from mjchair.diagnosis.data.motion_checks import jumps
from mjchair.measurement.trial import Trial

COLUMN = "rider_motion"


def trial(rate, rider_motion):
    time = np.arange(rider_motion.size) / rate
    return Trial(
        name="c1",
        time=time,
        channels=MappingProxyType({"left_wheel_speed": np.ones(time.size)}),
        inputs=None,
        other=MappingProxyType({COLUMN: rider_motion}),
    )


def sways(rate, noise, amplitude=0.1, seconds=10.0):
    rng = np.random.default_rng(1)
    time = np.arange(round(seconds * rate)) / rate
    return amplitude * np.sin(2.0 * np.pi * time) + noise * rng.standard_normal(time.size)


@pytest.mark.parametrize("rate", [20.0, 100.0, 200.0])
@pytest.mark.parametrize("noise", [0.0, 5e-4, 2e-3])
def test_a_person_who_moves_does_not_jump(rate, noise):
    assert jumps(trial(rate, sways(rate, noise)))[1] == []


@pytest.mark.parametrize("noise", [0.0, 5e-4])
@pytest.mark.parametrize("size", [0.012, -0.03])
def test_a_jump_is_told_with_its_size_and_time(size, noise):
    motion = sways(100.0, noise)
    motion[400:] += size
    same, (note,) = jumps(trial(100.0, motion))
    said = re.match(r"c1: rider_motion jumps by (\d+) mm at 4.00 s; was a marker", note)
    assert said and float(said[1]) == pytest.approx(abs(1e3 * size), abs=0.5 + 3e3 * noise)
    assert same.other[COLUMN] is motion


def test_a_marker_that_is_lost_for_a_while_is_two_steps_and_none_once_it_is_left_empty():
    motion = sways(100.0, 5e-4)
    motion[300:330] = 0.25
    (note,) = jumps(trial(100.0, motion))[1]
    assert "one of 2 such steps" in note
    motion[300:330] = np.nan
    motion[:5] = np.nan
    assert jumps(trial(100.0, motion))[1] == []


def test_a_run_without_a_measured_motion_is_not_asked():
    plain = replace(trial(100.0, sways(100.0, 0.0)), other=MappingProxyType({}))
    assert jumps(plain) == (plain, [])
    assert jumps(trial(100.0, np.array([0.0, 1.0, 0.0])))[1] == []


@pytest.mark.parametrize("name", ["left_wheel_force", "chair_heading", "chair_speed"])
def test_what_is_no_motion_may_jump(name):
    """A hand that grips is a step of its force, and a heading goes on from pi to -pi."""
    steps = np.repeat([0.0, 6.0, 0.0], 100)
    assert jumps(replace(trial(100.0, steps), other=MappingProxyType({name: steps})))[1] == []
    assert jumps(trial(100.0, steps))[1]
