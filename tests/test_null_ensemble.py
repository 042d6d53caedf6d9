"""The null of the gap test: what a chair shows that lacks nothing, computed otherwise."""

import copy
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from noisy_run import NOISE, noisy_run

import mjchair
from mjchair.diagnosis import rules
from mjchair.diagnosis.data.study import make_study
from mjchair.diagnosis.explain import null_ensemble
from mjchair.diagnosis.explain.screening import gap_after, prepare, screen_columns
from mjchair.effects.library import find
from mjchair.simulation.initial import Initial

STARTS = (Initial((0.0, 0.0), 0.3, 1.5), Initial((0.0, 0.5), -1.2, 1.2))
DRAG = {"coefficient": 0.002}
EFFECTS = ("rolling_resistance", "floor_slope")


@pytest.fixture(scope="module")
def base():
    """Two coasts of a chair with a little more rolling resistance than its model has."""
    rng = np.random.default_rng(5)
    spec = mjchair.load_spec()
    find("rolling_resistance").apply(spec, DRAG)
    runs = [noisy_run(rng, spec, f"coast {k}", start, 4.0) for k, start in enumerate(STARTS)]
    bench, first = prepare(make_study(mjchair.load_spec(), runs, NOISE), threads=1)
    return screen_columns(bench, first, [find(name) for name in EFFECTS])


def statistics(base):
    """The largest test that each member of the ensemble shows."""
    rng = np.random.default_rng(0)
    members = null_ensemble._answers(base, base.plain, rng)
    return [max(null_ensemble._shown(base, base.plain, [answer]).values()) for answer in members]


def test_what_a_fit_shows_is_not_simulated_again(base):
    model = base.bench.simulator.compile(base.plain.variant.edit)
    again = null_ensemble._predicted(base, base.plain, model)
    for one, other in zip(again, base.plain.track.predicted, strict=True):
        assert np.array_equal(one, other)


def test_step_integrator_and_what_is_roughly_known_make_no_gap(base):
    shown = statistics(base)
    assert len(shown) == 2 + null_ensemble.DRAWS
    assert 0.0 < max(shown) < 0.5


def test_a_gap_stays_that_no_member_shows(base, monkeypatch):
    gap = gap_after(base, base.plain)
    monkeypatch.setattr(rules, "CLEAR", gap.tests[0].sigmas + 1.0)
    assert gap.exists
    same = null_ensemble.confirmed(base, base.plain, gap)
    assert same.exists
    assert same.tests[0].sigmas == pytest.approx(gap.tests[0].sigmas, abs=0.2)


def test_a_gap_is_none_that_a_member_shows_as_well(base, monkeypatch):
    """As if half the step were to change how a tire rolls as much as the data ask for."""
    spec = base.bench.simulator.spec.copy()
    find("rolling_resistance").apply(spec, DRAG)
    otherwise = spec.compile()
    monkeypatch.setattr(null_ensemble, "_computed_otherwise", lambda _: [otherwise])
    gap = gap_after(base, base.plain)
    monkeypatch.setattr(rules, "CLEAR", gap.tests[0].sigmas + 1.0)
    assert gap.exists
    assert not null_ensemble.confirmed(base, base.plain, gap).exists


def test_nothing_is_simulated_where_a_gap_is_clear_or_is_none(base, monkeypatch):
    monkeypatch.setattr(null_ensemble, "_answers", None)
    gap = gap_after(base, base.plain)
    clear = replace(gap, tests=[replace(gap.tests[0], sigmas=1.01 * rules.CLEAR)])
    assert null_ensemble.confirmed(base, base.plain, clear) is clear
    none = replace(gap, exists=False)
    assert null_ensemble.confirmed(base, base.plain, none) is none


def test_members_are_the_same_chair():
    model = mjchair.load_spec("manual").compile()
    half, other = null_ensemble._computed_otherwise(model)
    assert half.opt.timestep == pytest.approx(0.5 * model.opt.timestep)
    assert other.opt.integrator != model.opt.integrator
    again = copy.copy(model)
    again.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER  # another one has no counterpart
    assert len(list(null_ensemble._computed_otherwise(again))) == 1


def test_a_member_that_does_not_simulate_says_nothing(base, monkeypatch):
    gap = gap_after(base, base.plain)
    monkeypatch.setattr(rules, "CLEAR", gap.tests[0].sigmas + 1.0)
    lost = [np.full_like(seen, np.nan) for seen in base.plain.track.predicted]
    monkeypatch.setattr(null_ensemble, "_answers", lambda *_: [lost])
    same = null_ensemble.confirmed(base, base.plain, gap)
    assert same.exists and same.tests[0].sigmas == gap.tests[0].sigmas
