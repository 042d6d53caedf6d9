"""Which explanation the noise of a study is taken around; levels are told instead of estimated."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from mjchair.diagnosis.explain import screening
from mjchair.diagnosis.explain.screening import LOUD, QUIETER
from mjchair.diagnosis.fit.variant import Term
from mjchair.diagnosis.replay import noise_left
from mjchair.diagnosis.replay.noise import Noise
from mjchair.effects.effect import Effect, Parameter
from mjchair.errors import MjchairError


def taken(monkeypatch, first, other, promised=0.0):
    """Power of the noise that is taken, and how many explanations were looked at.

    Args:
      first: power that the best explanation leaves. other: the best of a chair hardly shaken.
      promised: what linear algebra promises of that.
    """
    looked = []
    by_columns = SimpleNamespace(power=promised)
    monkeypatch.setattr(screening, "best_of_sizes", lambda *_: [None])
    monkeypatch.setattr(screening, "_quieter_but_for_one_run", lambda *_: None)
    monkeypatch.setattr(screening, "_left_by_columns", lambda *_: by_columns)

    def noise_left(base, bench, reduced, options):
        looked.append(bench)
        return SimpleNamespace(power=other if bench == "hushed" else first), None

    monkeypatch.setattr(screening, "_noise_left", noise_left)
    monkeypatch.setattr(screening, "_reduced_anew", lambda base: base)
    monkeypatch.setattr(screening, "replace", lambda base, **_: base)
    monkeypatch.setattr(screening, "refit", lambda bench, *_: bench)
    monkeypatch.setattr(screening.noise_shown, "loudness", lambda bench: bench.power)
    monkeypatch.setattr(screening.noise_shown, "hushed", lambda bench: "hushed")
    chosen = []
    monkeypatch.setattr(screening, "_on", lambda base, bench: chosen.append(bench) or base)
    plain = SimpleNamespace(variant=None, track=None, columns=None)
    base = SimpleNamespace(bench="as shown", reduced=None, plain=plain, starts=())
    screening._with_noise_left(base)
    return chosen[-1].power, len(looked)


@pytest.mark.parametrize(
    ("first", "other", "power", "looks"),
    [
        (0.5 * LOUD, 0.0, 0.5 * LOUD, 1),  # hardly shaken: nothing can hide
        (0.5, 0.9 * QUIETER * 0.5, 0.9 * QUIETER * 0.5, 2),  # it explains what passed for noise
        (0.5, 1.1 * QUIETER * 0.5, 0.5, 2),  # a little less is left by any further effect
    ],
)
def test_an_explanation_that_leaves_far_less_noise_is_taken(
    monkeypatch, first, other, power, looks
):
    assert taken(monkeypatch, first, other) == (power, looks)


@pytest.mark.parametrize(
    ("first", "promised", "looks"),
    [
        (0.5, 0.4 * 0.5, 2),
        (0.5, 0.6 * 0.5, 1),  # no fit brings what linear algebra does not see at all
        (1.5, 1.5, 2),  # but where a wheel slides it sees nothing
    ],
)
def test_fits_of_a_quiet_chair_are_made_where_linear_algebra_promises_one(
    monkeypatch, first, promised, looks
):
    assert taken(monkeypatch, first, 0.0, promised)[1] == looks


def told(total, promised=None, bound=(), offset=0.0):
    """A fit by its numbers."""
    return SimpleNamespace(
        total=total,
        promised=total if promised is None else promised,
        at_bound=bound,
        variant=SimpleNamespace(offsets={"mass": offset}, terms=()),
    )


@pytest.mark.parametrize(
    ("fits", "best"),
    [
        ([told(300.0), told(100.0)], 0),  # the first holds: no other is fitted
        ([told(900.0, promised=300.0), told(310.0)], 1),  # it promises far more than it brings
        ([told(300.0, bound=("angle",)), told(310.0)], 1),  # a size no chair can have
        ([told(300.0, offset=-3.0), told(310.0)], 1),  # the mass went to its wall for it
        ([told(900_000.0), told(310.0)], 1),  # linear algebra promised what it does not bring
        ([MjchairError("no chair"), told(310.0)], 1),
        ([told(350.0, offset=3.0), told(310.0, offset=3.0)], 1),  # none holds: the better one
        ([MjchairError("no chair"), MjchairError("no chair")], None),
    ],
)
def test_the_noise_is_taken_around_an_explanation_that_holds(monkeypatch, fits, best):
    """Camber of -0.3 rad, and a mass at its wall, stood in for two rims of different gain."""
    assert around_which(monkeypatch, fits) == best


@pytest.mark.parametrize(
    ("fits", "best"),
    [
        ([told(310.0)], 1),  # it leaves what the one on a bound promises: that is not fitted
        ([told(90_000.0), told(300.0)], 0),  # the one on a bound promises more, and holds
        ([told(90_000.0), told(300.0, bound=("angle",))], 1),  # it does not hold
        ([MjchairError("no chair"), told(300.0)], 0),
    ],
)
def test_what_linear_algebra_puts_on_a_bound_waits(monkeypatch, fits, best):
    """A toe of -0.15 rad took two minutes of a study in which rolling resistance was missing."""
    assert around_which(monkeypatch, fits, on_bound=(0,), count=2) == best


def around_which(monkeypatch, fits, on_bound=(), count=None):
    """Which option the noise is taken around; None: around none.

    Args:
      fits: what the options end at, in the order in which they are fitted; no other is fitted.
      on_bound: options that linear algebra puts there. count: of options; None: one a fit.
    """
    answers = iter(fits)

    def refit(*_, reach, nothing):
        # linear algebra leaves 300; what promises to miss a tenth of the gain is not followed
        assert reach == pytest.approx(300.0 + 0.1 * 1e6)
        answer = next(answers)
        if isinstance(answer, MjchairError):
            raise answer
        return answer

    monkeypatch.setattr(screening, "refit", refit)
    monkeypatch.setattr(screening.hypotheses, "terms", lambda _, h: h.starts)
    monkeypatch.setattr(screening, "starting_variant", lambda *_: SimpleNamespace(terms=()))
    monkeypatch.setattr(screening, "_off_bounds", lambda terms, ended: terms)
    monkeypatch.setattr(screening, "on_bound", lambda k: k in on_bound)
    monkeypatch.setattr(screening, "replace", lambda variant, **_: variant)
    options = [
        SimpleNamespace(starts=(k,), name=str(k), gain=1e6, score=1e6, free=1, penalty=10.0)
        for k in range(count or len(fits))
    ]
    around = SimpleNamespace(variant=None, track=None)
    base = SimpleNamespace(around=around, nuisances={})
    reduced = SimpleNamespace(total=1_000_300.0)
    found = screening._first_that_holds(base, None, reduced, options)
    return found and found.starts[0]


def test_an_effect_on_a_bound_begins_where_it_ended_beside_another():
    """A caster's trail on its bound was fitted anew beside each of five others."""
    size = Parameter("length", "m", 0.01, -0.04, 0.04)
    trail, toe = (Effect(n, (size,), "", "", lambda spec, length: None) for n in ("trail", "toe"))
    bound, inside, ended = (
        Term(effect, {"length": value}, ("length",))
        for effect, value in ((trail, -0.04), (toe, 0.01), (trail, -0.03))
    )
    assert screening._off_bounds((bound, inside), []) == (bound, inside)
    before = [ended, replace(inside, values={"length": 0.02})]
    assert screening._off_bounds((bound, inside), before) == (ended, inside)


def test_a_window_in_which_the_chair_goes_another_way_tells_no_noise():
    """A chair that tipped back in one window of four gave an encoder 1.1 rad/s of noise."""
    random = np.random.default_rng(4)
    quiet = [0.05 * random.normal(size=230) for _ in range(3)]
    wild = np.sin(np.arange(230)) * 2.3
    known = Noise(0.01, 0.0, 1.0, "a guess")
    found = noise_left._refined(known, [wild, *quiet], "left_wheel_speed")
    assert found.total == pytest.approx(0.05, rel=0.1)
