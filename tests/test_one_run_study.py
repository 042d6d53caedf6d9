"""A whole diagnosis of four coasts, one of which rolls on another floor."""

from dataclasses import replace

import numpy as np
import pytest

import mjchair
from mjchair.diagnosis import decide
from mjchair.diagnosis.data.study import Run, make_study
from mjchair.diagnosis.diagnose import diagnose
from mjchair.diagnosis.fit.column_ids import ParameterId
from mjchair.diagnosis.fit.nonlinear import refit
from mjchair.diagnosis.fit.variant import Term
from mjchair.diagnosis.rules import Verdict
from mjchair.effects.library import find
from mjchair.measurement.trial import Trial
from mjchair.simulation.initial import Initial

CARPET = 0.008  # more of the rolling resistance coefficient, in one run
SPEEDS = {"a": 1.5, "b": 1.2, "c": 1.6, "d": 1.4}
CHANNELS = ("left_wheel_speed", "right_wheel_speed", "imu_gyro.z")
NOISE = {"left_wheel_speed": 0.05, "right_wheel_speed": 0.05, "imu_gyro.z": 0.01}


@pytest.fixture(scope="module")
def found():
    rng, runs = np.random.default_rng(6), []
    for name, speed in SPEEDS.items():
        spec = mjchair.load_spec("manual")
        if name == "b":
            effect = find("rolling_resistance").on(spec)
            effect.apply(spec, {**effect.neutral(), "coefficient": CARPET})
        rolled = mjchair.simulate(
            spec, duration=4.0, initial=Initial(speed=speed), timestep=0.001, sample_rate=100.0
        )
        seen = {c: rolled[c] + NOISE[c] * rng.standard_normal(rolled.time.size) for c in CHANNELS}
        runs.append(
            Run(
                Trial(name, rolled.time, seen, None, {}),
                "coast",
                name == "d",
                Initial(),
                frozenset(),
            )
        )
    study = make_study(mjchair.load_spec("manual"), runs, NOISE)
    return diagnose(replace(study, indoors=True))


def test_the_floor_of_one_run_is_no_effect_of_all_runs_and_no_noise(found):
    assert found.verdict == Verdict.UNKNOWN and found.one_run.trial == "b"
    assert "b differs from the other runs" in found.notes[-1]
    assert "without b" in found.next_experiment
    assert next(iter(found.probability)) == "one_run"


def test_its_size_is_told_with_the_effects_that_fit_alike(found):
    sizes = {e.name: e.parameters for e in found.one_run.effects}
    carpet = sizes["rolling_resistance"]["coefficient"]
    assert abs(carpet.value - CARPET) < max(3.0 * carpet.std, 0.05 * CARPET)
    assert "floor_slope" in sizes
    assert found.material.value == pytest.approx(CARPET * 9.81 * 90.0, rel=0.25)


def test_no_run_alone_shakes_the_others(found):
    """A force of 7 N in one run had all runs shaken by 2 N."""
    assert found.process["drive"].value < 0.5


def test_it_shows_though_all_runs_together_scatter_like_noise(found, monkeypatch):
    """A wheel that rubbed with 1 N m in one coast of three was nothing that matters."""
    monkeypatch.setattr(decide, "gap_foretold", lambda base: 1.0)
    base, gap = found.stages.base, replace(found.stages.gap, p=1e-5, excess=0.0)
    said = decide.conclude(base, gap, None)
    assert said.verdict == Verdict.UNKNOWN and said.one_run.trial == "b"


def test_two_sizes_of_an_effect_are_as_alike_as_their_columns_leave_them(found):
    """By the inverse of what all windows tell, with the priors of what is only roughly known."""
    base = found.stages.base
    effect = next(s.effect for s in base.starts if s.free == ("left", "right"))
    term = Term(effect, {"left": 0.002, "right": 0.001}, ("left", "right"))
    variant = replace(base.plain.variant, terms=(term,))
    fitted = refit(base.bench, variant, base.plain.track, base.nuisances, rounds=0)
    system = fitted.system
    priors = np.diag([float(k < system.nuisance) for k in range(len(system.columns))])
    known = np.linalg.inv(priors + sum(system.G[i] for i in base.bench.windows))
    left, right = (system.places[ParameterId(effect.key, name)] for name in term.free)
    together = known[left, right] / np.sqrt(known[left, left] * known[right, right])
    assert abs(together) > 0.05
    assert list(fitted.correlation.values()) == [pytest.approx(together, rel=0.05)]
