"""Effects of a whole size beside one other effect, with windows that are told and not simulated.

A moment that stops a turn stands beside a rolling resistance: in the direction of the moment, small
sizes fit worse than none. In: what windows show at each size. Out: where fits begin.
"""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import linear_system
import numpy as np
import pytest
from linear_system import start

from mjchair.diagnosis.explain import whole_beside, whole_sizes
from mjchair.diagnosis.fit.variant import Term, Variant
from mjchair.diagnosis.replay.window_states import Track

MOMENT, ROLLING = 4.3, 0.004  # N m, 1
COLUMNS = np.linalg.qr(np.random.default_rng(3).standard_normal((40, 3)))[0]


SCRUB, RESISTANCE = start("turning_scrub"), start("rolling_resistance")


def residual(moment, rolling):
    """Of a chair of such a moment: turns that stop, whose angle a little of it makes worse."""
    angle = np.cos(np.pi * moment / MOMENT)
    change = RESISTANCE.effect.fitted[0].change
    turned = 20.0 * (angle - np.cos(np.pi)) if moment < 2.0 * MOMENT else 40.0
    return turned * COLUMNS[:, 1] + 300.0 * (rolling / change) * COLUMNS[:, 0]


@pytest.fixture
def base(monkeypatch):
    """A chair whose windows are told by the moment that it has."""

    def system(here, columns, nuisance, variant, only):
        J = np.stack([300.0 * COLUMNS[:, 0], COLUMNS[:, 1] - 5.0 * COLUMNS[:, 2]], axis=1)
        return linear_system.system(columns, J, residual(here, ROLLING))

    monkeypatch.setattr(
        whole_sizes, "track_of", lambda _, variant, __: variant.terms[0].values["moment"]
    )
    monkeypatch.setattr(whole_sizes, "fit_from", lambda _, begin, *__: begin)
    return SimpleNamespace(
        bench=SimpleNamespace(system=system, windows=np.arange(1)),
        around=SimpleNamespace(variant=Variant(()), track=0.0),
        plain=SimpleNamespace(total=0.0),
        nuisances={},
        columns=dict.fromkeys([*RESISTANCE.columns, *SCRUB.columns]),
        starts=[RESISTANCE, SCRUB],
    )


def test_beside_a_shimmy_calm_windows_tell_the_other_effect(monkeypatch):
    """In the first window, which shimmies, more of a drag stands for what is left of the swing."""
    brake, drag, shimmy = start("back_emf"), start("air_drag"), start("relaxation_length")
    columns = [*shimmy.columns, *brake.columns, *drag.columns]
    J = 10.0 * COLUMNS
    shown = np.array([[3.0, 0.0, 9.0], [0.0, 2.0, 0.0]])  # of each column in each window
    both = [linear_system.system(columns, J, J @ of) for of in shown]
    system = replace(
        both[0],
        **{
            name: np.concatenate([getattr(s, name) for s in both])
            for name in ("G", "b", "c", "run")
        },
    )
    windows = [SimpleNamespace(shimmies=True), SimpleNamespace(shimmies=False)]
    base = SimpleNamespace(
        bench=SimpleNamespace(windows=np.arange(2), simulator=SimpleNamespace(windows=windows)),
        system=system,
        starts=[shimmy, drag, brake],
    )
    term = Term(shimmy.effect, {"length": 0.096}, ("length",))
    track = Track([], [], [], [])
    single = SimpleNamespace(variant=Variant((), offsets={"mass": 2.3}, terms=(term,)), track=track)
    monkeypatch.setattr(whole_beside, "made_anew", lambda _, begin, before: (begin, before))
    ((starts, (begin, before)),) = whole_beside.beside_shimmy(base, single)
    assert starts == (shimmy, brake)
    assert begin.terms[0] is term
    coefficient = begin.terms[1].values["coefficient"]
    assert coefficient == pytest.approx(2.0 * brake.effect.fitted[0].change, rel=1e-4)
    assert not begin.offsets  # the mass had taken the brake
    assert before.touchy == {0}


def begun(base, monkeypatch, best):
    """Where fits begin, beside a best explanation that leaves this chi2."""
    monkeypatch.setattr(whole_sizes, "chi2", lambda *_: best)
    single = SimpleNamespace(chi2=np.ones(1))
    return list(
        whole_beside.fits(base, single, SimpleNamespace(variant=None, track=None, total=0.0))
    )


def test_a_moment_that_shows_beside_a_rolling_resistance_is_found(base, monkeypatch):
    ((starts, begin),) = begun(base, monkeypatch, best=90.0)
    assert [s.effect.key for s in starts] == ["turning_scrub", "rolling_resistance"]
    moment, rolling = begin.terms
    assert moment.values["moment"] == pytest.approx(MOMENT, abs=0.6)
    assert rolling.values["coefficient"] == pytest.approx(ROLLING, rel=1e-6)


def test_it_must_bring_half_of_what_several_effects_bring_beyond_one(base, monkeypatch):
    """One effect leaves 1600 of chi2 here; these leave 1600 less than nothing."""
    assert begun(base, monkeypatch, best=-2000.0) == []


def test_a_moment_alone_stands_alone(base, monkeypatch):
    monkeypatch.setattr(f"{__name__}.ROLLING", 0.0)
    ((starts, begin),) = begun(base, monkeypatch, best=90.0)
    assert [s.effect.key for s in starts] == ["turning_scrub"]
    assert len(begin.terms) == 1


def test_a_size_that_no_chair_can_have_begins_no_fit(base, monkeypatch):
    monkeypatch.setattr(whole_sizes, "track_of", lambda *_: None)
    assert begun(base, monkeypatch, best=90.0) == []
