"""Torques and speeds that go with another mass than the study's are said, or refused."""

import re
from dataclasses import replace
from types import MappingProxyType

import numpy as np
import pytest

from mjchair.diagnosis.data import mass_checks
from mjchair.errors import MjchairError
from mjchair.measurement.trial import Trial
from mjchair.model.rolling import RearAxle
from mjchair.simulation.inputs import Inputs

AXLE = RearAxle(left=0.3, right=0.3, track=0.56)
MASS, RESISTS, DRAGS = 90.0, 12.0, 1.5  # kg, N, N s/m
TIME = np.arange(0.0, 6.0, 0.01)


def pushed(mass=MASS, split=0.5, seen=("left", "right"), speeds=1.0, strokes=0.3, noise=0.05):
    """A run with strokes, by Newton's second law, of a chair of a mass (kg).

    Args:
      split: of the force, at the left wheel. seen: sides whose speed is measured.
      speeds: times what they are. strokes: amplitude of the speed, m/s. noise: rad/s.
    """
    rng = np.random.default_rng(1)
    speed = 1.0 + 0.05 * TIME + strokes * np.sin(2.0 * np.pi * TIME)
    force = mass * np.gradient(speed, TIME) + RESISTS + DRAGS * speed
    scatter = noise * rng.standard_normal((2, TIME.size))
    channels = {
        f"{side}_wheel_speed": speeds * (speed / 0.3 + scatter[k]) for k, side in enumerate(seen)
    }
    torques = {"left_wheel": 0.3 * split * force, "right_wheel": 0.3 * (1.0 - split) * force}
    inputs = Inputs(TIME, MappingProxyType(torques), "run")
    return Trial("run", TIME, MappingProxyType(channels), inputs, MappingProxyType({}))


def said(*trials, mass=MASS):
    return mass_checks.check(
        [(replace(t, name=f"run{k}"), mass) for k, t in enumerate(trials)], AXLE
    )


@pytest.mark.parametrize("mass", [60.0, 90.0, 145.0])
@pytest.mark.parametrize("seen", [("left", "right"), ("left",)])
@pytest.mark.parametrize("split", [0.5, 0.4])
def test_a_chair_may_weigh_otherwise_than_told(mass, seen, split):
    assert said(pushed(mass, split=split, seen=seen)) == []


def told(line):
    """The mass (kg) that a line says torques and speeds go with."""
    return float(re.search(r"run0: .* a mass of (\d+) kg, and the study gives", line).group(1))


def test_a_mass_in_pounds_is_said():
    (line,) = said(pushed(), mass=180.0)
    assert told(line) == pytest.approx(90.0, rel=0.02)
    assert "gives 180 kg" in line and "masses in lb" in line


@pytest.mark.parametrize(
    ("trial", "factor", "words"),
    [
        (pushed(speeds=3.6), 1.0 / 3.6, "speeds in km/h"),
        (pushed(mass=MASS / 0.27), 1.0 / 0.27, r"forces at the rim \(N\)"),
    ],
)
def test_units_that_no_chair_can_have_are_refused(trial, factor, words):
    with pytest.raises(MjchairError, match=words) as refused:
        said(trial)
    assert "\n" not in str(refused.value)
    assert told(str(refused.value)) == pytest.approx(factor * MASS, rel=0.02)


def test_one_run_of_three_does_not_speak_for_a_study():
    assert said(pushed(), pushed(speeds=3.6), pushed()) == []


@pytest.mark.parametrize(
    "trial",
    [
        pushed(speeds=3.6, strokes=0.0),  # a torque that hardly varies
        pushed(mass=-400.0),  # which no mass explains, and the signs are asked elsewhere
        pushed(speeds=0.0),
    ],
)
def test_what_tells_no_mass_says_nothing(trial):
    assert said(trial) == []


def test_a_torque_that_does_not_go_with_the_speed_tells_no_mass():
    """An eighth of a stroke late, it would go with a fifth of the mass."""
    one = pushed(speeds=3.6)
    late = Inputs(TIME + 0.12, one.inputs.controls, "run")
    assert said(Trial("run", TIME, one.channels, late, one.other)) == []
