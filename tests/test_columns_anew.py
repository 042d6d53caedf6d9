"""Columns of effects made anew around a fit whose chair answers otherwise than the one given."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from noisy_run import NOISE, noisy_run

import mjchair
from mjchair.diagnosis import diagnose
from mjchair.diagnosis.data.study import make_study
from mjchair.diagnosis.explain import columns_anew
from mjchair.diagnosis.fit.column_ids import RoughlyKnown
from mjchair.diagnosis.fit.variant import Term, Variant
from mjchair.diagnosis.replay.derivatives import differences, effect_points
from mjchair.diagnosis.replay.window_states import track
from mjchair.effects.library import find
from mjchair.simulation.initial import Initial

EFFECTS = ("payload", "floor_slope", "turning_scrub", "caster_friction")


@pytest.fixture(scope="module")
def base():
    rng = np.random.default_rng(3)
    start = Initial(speed=1.5, yaw_rate=0.8)
    runs = [noisy_run(rng, mjchair.load_spec(), f"turn_{k}", start, 3.0) for k in range(2)]
    bench, first = diagnose.prepare(make_study(mjchair.load_spec(), runs, NOISE))
    return diagnose.screen_columns(bench, first, [find(name) for name in EFFECTS])


def fitted(base, effect, **values):
    variant = Variant(base.bench.nuisances, {}, (Term(effect, values, tuple(values)),))
    simulator = base.bench.simulator
    return SimpleNamespace(
        variant=variant, track=track(simulator, simulator.compile(variant.edit), base.bench.noise)
    )


def test_around_a_load_the_columns_of_others_are_those_of_a_chair_with_it(base):
    base.anew.clear()
    loaded = fitted(base, find("payload"), mass=60.0, height=0.9)
    said = []
    assert columns_anew.make(base, loaded, said.append) and len(said) == 1
    assert not columns_anew.make(base, loaded, said.append)  # they are kept
    here = base.columns_around(loaded)
    scrub = find("turning_scrub")
    points = effect_points(base.bench.simulator, scrub, scrub.starts()[0])
    (asked,) = differences(base.bench.simulator, loaded.track, points, loaded.variant.edit)
    (name,) = (n for n in here if getattr(n.group, "effect", "") == "turning_scrub")
    for made, there in zip(here[name], asked, strict=True):
        assert np.array_equal(made, there)
    kept = {n for n in here if here[n] is base.columns[n]}
    assert {n.group.effect for n in here.keys() - kept} == {*EFFECTS} - {"payload"}


def test_more_effects_have_the_columns_around_some_of_them_and_others_have_not(base):
    base.anew.clear()
    loaded = fitted(base, find("payload"), mass=60.0, height=0.9)
    columns_anew.make(base, loaded, lambda _: None)
    slope = Term(find("floor_slope"), {"x": 0.01}, ("x",))
    both = SimpleNamespace(variant=Variant((), {}, (*loaded.variant.terms, slope)))
    assert base.columns_around(both) == base.columns_around(loaded)
    assert base.columns_around(SimpleNamespace(variant=Variant((), {}, (slope,)))) == base.columns


def test_a_chair_that_answers_alike_keeps_the_columns(base):
    base.anew.clear()
    slope = fitted(base, find("floor_slope"), x=0.004, y=0.0)
    late = fitted(base, find("sensor_bias", "heading"), bias=0.1)
    for alike in (slope, late):
        assert not columns_anew.make(base, alike, lambda _: None)
    assert base.anew == {} and RoughlyKnown("mass") not in base.columns
