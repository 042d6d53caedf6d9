"""The search for effects, with fits that are told instead of simulated.

In: totals (chi2) of fits, given by name. Out: which fit the search takes.
"""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace
from types import SimpleNamespace
from unittest import mock

import linear_system
import numpy as np
import pytest

from mjchair.diagnosis import decide, rules
from mjchair.diagnosis.data.roughly_known import Nuisance
from mjchair.diagnosis.explain import (
    alternatives,
    backward_elimination,
    choice,
    columns_anew,
    event,
    forward_selection,
    hypotheses,
    left_out,
    left_over,
    multistart,
    open_ended,
    probable,
    rivals,
    screening,
    search_rules,
    selection,
    shortlist,
    whole_beside,
    whole_sizes,
)
from mjchair.diagnosis.explain import fits as fits_of_hypotheses
from mjchair.diagnosis.explain.choice import Choice, Tried
from mjchair.diagnosis.explain.fits import Fits
from mjchair.diagnosis.explain.hypotheses import Hypothesis
from mjchair.diagnosis.explain.screening import Found
from mjchair.diagnosis.fit import bounded, nonlinear
from mjchair.diagnosis.fit.column_ids import ParameterId, RoughlyKnown
from mjchair.diagnosis.fit.variant import Term, Variant
from mjchair.effects import air_drag, wind
from mjchair.effects.library import find
from mjchair.errors import MjchairError


def effect(name, common=1.0):
    return SimpleNamespace(
        effect=SimpleNamespace(key=name, name=name, common=common, fitted=()),
        free=("size",),
        group=name,
        columns=(name,),
    )


ROLLING, MOTOR, WIND = effect("rolling"), effect("motor"), effect("wind")
ONE = Hypothesis((ROLLING,), gain=500.0, score=490.0)
BOTH = Hypothesis((ROLLING, MOTOR), gain=900.0, score=880.0)


class Named(str):
    """A track by its name."""

    touchy = frozenset()


def fit(total, *keys, promised=None):
    terms = tuple(SimpleNamespace(effect=SimpleNamespace(key=k), parameters=()) for k in keys)
    return SimpleNamespace(
        total=total,
        confined=0.0,
        promised=total if promised is None else promised,
        variant=Variant((), terms=terms),
        track=Named(f"track of {'+'.join(sorted(keys))}"),
        sigmas=dict.fromkeys(keys, 3.0),
        at_bound=(),
        at_least={},
        correlation={},
        anew=None,
    )


@pytest.fixture
def fits(monkeypatch):
    """Fits as `refit` is asked for them; each answers (start, before, nuisances) with a fit."""
    asked, answers, reaches = [], {}, []
    found = SimpleNamespace(asked=asked, answers=answers, reaches=reaches, most=1.0)

    def refit(
        bench,
        start,
        before,
        nuisances=None,
        rounds=nonlinear.ROUNDS,
        part=None,
        reach=np.inf,
        nothing=np.inf,
    ):
        keys = "+".join(sorted(t.effect.key for t in start.terms))
        asked.append((keys, before))
        reaches.append(reach)
        answer = answers[keys, before]
        if answer is None:
            raise MjchairError("no chair")
        return answer

    def terms(reduced, hypothesis, share=1.0):
        return tuple(
            Term(s.effect, {"size": min(share, found.most)}, ()) for s in hypothesis.starts
        )

    monkeypatch.setattr(search_rules, "NOTHING", 0.0)  # no effect is so small that columns hold
    monkeypatch.setattr(forward_selection, "_happened_once", lambda *_: False)
    monkeypatch.setattr(columns_anew, "make", lambda *_: False)
    monkeypatch.setattr(probable, "probabilities", lambda *_: {})
    monkeypatch.setattr(whole_sizes, "fits", lambda *_: ())
    monkeypatch.setattr(whole_beside, "fits", lambda *_: ())
    monkeypatch.setattr(whole_sizes, "compared", lambda _, fitted: fitted)
    monkeypatch.setattr(open_ended, "with_least_sizes", lambda _, fitted: fitted)
    monkeypatch.setattr(fits_of_hypotheses, "with_form_errors", lambda fitted: fitted)
    monkeypatch.setattr(multistart, "refit", refit)
    monkeypatch.setattr(multistart, "placed", refit)
    monkeypatch.setattr(hypotheses, "terms", terms)
    return found


def put(one, **changes):
    """Like `replace`, of stubs as well."""
    stub = isinstance(one, SimpleNamespace)
    return SimpleNamespace(**vars(one) | changes) if stub else replace(one, **changes)


def believe(monkeypatch, believable):
    """Take these fits for believable, wherever that is asked."""
    for module in (fits_of_hypotheses, alternatives, rivals):
        monkeypatch.setattr(module, "believable", believable)


def reduced(total):
    """Linear algebra in which nothing is only roughly known."""
    return SimpleNamespace(total=total, index=list, step=lambda _: (np.zeros(0), total))


def searching():
    base = SimpleNamespace(
        bench=SimpleNamespace(
            simulator=SimpleNamespace(windows=[], stepped=0), windows=np.arange(4)
        ),
        nuisances={},
        plain=SimpleNamespace(total=2000.0, variant=Variant(()), chi2=np.full(4, 500.0)),
        reduced=reduced(2000.0),
        system=SimpleNamespace(places={}, run=np.arange(4) // 2),
        around=SimpleNamespace(track="as given", variant=Variant(())),
        found=None,
        best=None,
        anew={},
        patience=1.0,
    )
    return Fits(base, lambda line: None)


def test_two_effects_that_fit_worse_than_one_start_again_from_it(fits):
    fits.answers.update(
        {
            ("rolling", "as given"): fit(1500.0, "rolling"),
            ("motor+rolling", "as given"): fit(1600.0, "rolling", "motor"),
            ("motor+rolling", "track of rolling"): fit(1110.0, "rolling", "motor"),
        }
    )
    looking = searching()
    assert looking.fit(ONE).fitted.total == 1500.0
    assert looking.fit(BOTH).fitted.total == 1110.0


def test_a_rival_is_followed_as_far_as_it_can_come_near_the_best(fits):
    """The best brings 900; a rival that promises 3 times 2 % of that more is out of reach."""
    fits.answers.update(
        {("rolling", "as given"): fit(1500.0, "rolling"), ("wind", "as given"): fit(1400.0, "wind")}
    )
    looking = searching()
    best = Tried(replace(ONE, gain=900.0), fit(1100.0, "rolling"))
    looking.fit(ONE)
    looking.fit(Hypothesis((WIND,), gain=500.0, score=490.0), best)
    assert fits.reaches[0] == np.inf
    assert fits.reaches[-1] == pytest.approx(1100.0 + 3.0 * 0.02 * 900.0)


@pytest.mark.parametrize("near", [False, True])
def test_more_effects_are_to_fit_better_than_the_best_part_of_them(fits, monkeypatch, near):
    """A hypothesis without one of these effects may fit worse."""
    asked = {}

    def refit(bench, start, before, nuisances, part, reach, nothing):
        asked["+".join(sorted(t.effect.key for t in start.terms))] = part and part.total
        return fit(1400.0)

    def refit_near(starts, part, reach):
        asked["+".join(sorted(s.effect.key for s in starts))] = part and part.total
        return fit(1400.0)

    looking = searching()
    part = Hypothesis((ROLLING,), gain=500.0, score=490.0)
    looking.tried = [Tried(part, fit(1500.0, "rolling"))]
    looking.again = [Tried(part, fit(1450.0, "rolling"))]
    looking.near = SimpleNamespace(refit=refit_near) if near else None
    monkeypatch.setattr(multistart, "refit", refit)
    looking.fit(BOTH)
    looking.fit(Hypothesis((MOTOR, WIND), gain=900.0, score=880.0))
    assert asked == {"motor+rolling": 1450.0, "motor+wind": None}


@pytest.mark.parametrize(
    ("known", "promised", "fewest", "most"),
    [
        (50.0, 900.0, 2, 2),  # it brings far more than linear algebra promises of both
        (800.0, 400.0, 2, 2),  # linear algebra says that it is worse
        (800.0, 900.0, 9, 10),
        (None, 900.0, 8, 9),
    ],
)
def test_what_fits_worse_than_nothing_is_begun_again_only_where_it_may_be_best(
    fits, known, promised, fewest, most
):
    """Shares of an effect were tried although the best was 94 000 better than its promise.

    It begins once more, where the best ended. A centre of mass aside that promised as much as the
    best ended 961 behind it from one start, and 102 before it from another.
    """
    fits.answers["wind", "as given"] = fit(2010.0, "wind", promised=2005.0)
    fits.answers["wind", "track of rolling"] = fit(2010.0, "wind", promised=2005.0)
    looking = searching()
    best = Tried(ONE, fit(known, "rolling")) if known else None
    assert looking.fit(Hypothesis((WIND,), gain=promised, score=promised - 20.0), best) is None
    assert fewest <= len(fits.asked) <= most
    assert looking.dropped == ["wind fits worse than nothing and is left out"]


def test_shares_that_end_at_the_same_bound_are_one_start(fits):
    """Of a size of at most 0.5, shares of 0.375, 0.25 and 0.125 are new, and the best is fitted."""
    fits.answers["wind", "as given"] = fit(2010.0, "wind", promised=2005.0)
    fits.most = 0.5
    searching().fit(Hypothesis((WIND,), gain=900.0, score=880.0))
    assert len(fits.asked) == 1 + 3 + 1


def test_a_fit_that_went_astray_begins_once_more_near_no_effect():
    """The length of a trail that linear algebra promised turned casters over."""
    values = {"x": 4.0, "y": -2.0, "drag_area": 0.9}
    here = multistart._smaller(Term(wind.EFFECT, values, ("x", "y", "drag_area")))
    assert here.values == pytest.approx({"x": 0.4, "y": -0.2, "drag_area": 0.9})


def test_where_the_best_ended_a_term_has_its_values_and_frees_what_is_asked():
    ended = Term(wind.EFFECT, {"x": 4.0, "y": 0.0, "drag_area": 0.9}, ("x",))
    asked = Term(wind.EFFECT, {"x": 1.0, "y": 1.0, "drag_area": 0.6}, ("x", "y"))
    assert multistart._as_in(ended, asked) == replace(asked, values=ended.values)
    assert multistart._as_in(Term(air_drag.EFFECT, {}, ()), asked) is asked
    assert multistart._as_in(None, asked) is asked


def test_what_others_were_weighed_beside_is_not_fitted_with_them_from_afar(monkeypatch):
    """The best is rolling and motor: with wind beside both, the algebra around it has decided."""
    asked = []
    with_wind = Hypothesis((ROLLING, MOTOR, WIND), gain=950.0, score=920.0)
    two = Hypothesis((MOTOR, WIND), gain=940.0, score=915.0)
    gap = SimpleNamespace(exists=True)

    def believed(hypothesis, top):
        asked.append(hypothesis.keys)
        return SimpleNamespace(price=100.0, fitted=None)

    fits = SimpleNamespace(believed=believed, must_end=lambda: False, gap_after=lambda _: gap)
    monkeypatch.setattr(shortlist, "_first_few", lambda _, options, coarse: list(options))
    assert shortlist.best_of(fits, [with_wind, two], but=BOTH.keys)[1] is gap
    assert asked == [two.keys]
    assert shortlist.best_of(fits, [with_wind], patient=False, but=BOTH.keys) is None
    shortlist.best_of(fits, [with_wind, two])
    assert asked[1:] == [with_wind.keys, two.keys]


def test_a_fit_begins_once_where_more_effects_ended(monkeypatch):
    made = []
    monkeypatch.setattr(fits_of_hypotheses, "nuisances_of", lambda *_: {})
    monkeypatch.setattr(fits_of_hypotheses, "made_anew", lambda *args: made.append(args))
    search, more = searching(), fit(1000.0, "rolling", "motor")
    for end in (more, more, fit(1000.0, "rolling", "motor")):
        search.begin_at(ONE, end)
    assert len(made) == 2


@pytest.mark.parametrize(
    ("touchy", "placed", "made", "total"),
    [
        (True, 1451.0, 1434.0, 1434.0),
        (True, 1451.0, 1490.0, 1486.0),  # it leads to nothing better
        (True, 1487.0, 1434.0, 1486.0),  # the states are no better
        (True, None, 1434.0, 1486.0),  # in which this chair cannot be
        (False, 1451.0, 1434.0, 1486.0),  # no window is touchy, and nothing is simulated
    ],
)
def test_a_fit_takes_the_states_of_another_where_they_are_better(
    fits, monkeypatch, touchy, placed, made, total
):
    """Of one window, in which the chair stands, two fits had found different valleys."""
    there = None if placed is None else fit(placed, "rolling")
    fits.answers |= {
        ("rolling", "track of motor"): there,
        ("rolling", "track of rolling"): fit(made, "rolling"),
    }
    monkeypatch.setattr(fits_of_hypotheses, "nuisances_of", lambda *_: {})
    monkeypatch.setattr(fits_of_hypotheses, "placed", multistart.placed)
    one = put(fit(1486.0), variant=Variant((), terms=fit(0.0, "rolling").variant.terms))
    other = fit(1456.0, "motor")
    other.track.touchy = frozenset({3} if touchy else ())
    looking, mine, theirs = searching(), Tried(ONE, one), Tried(ONE, other)
    better = looking.in_states_of(mine, theirs)
    assert better.fitted.total == total
    assert looking.in_states_of(mine, theirs) is mine  # it was tried, and what is better is kept
    assert [t.fitted.total for t in looking.tried] == [total] * (better is not mine)
    assert [before for _, before in fits.asked].count("track of motor") == int(touchy)
    assert looking.in_states_of(theirs, theirs) is theirs


def test_what_cannot_be_is_tried_once(fits):
    fits.answers[("rolling", "as given")] = None
    looking = searching()
    assert looking.fit(ONE) is None
    tries = len(fits.asked)
    assert looking.fit(ONE) is None
    assert len(fits.asked) == tries
    assert looking.dropped == ["a start of the fit of rolling was left out: no chair"]


def test_a_fit_that_still_promises_is_made_anew(fits):
    fits.answers[("rolling", "as given")] = fit(1530.0, "rolling", promised=1500.0)
    fits.answers[("rolling", "track of rolling")] = fit(1501.0, "rolling")
    assert searching().fit(ONE).fitted.total == 1501.0


@pytest.mark.parametrize(("offset", "end"), [(2.9, 1290.0), (2.0, 1500.0)])
def test_a_fit_that_goes_far_is_made_anew_as_long_as_that_brings_much(fits, offset, end):
    """Columns of the chair as given led a scrub of 4.7 N m to 3.7, its centre of mass 3 sd off."""
    totals = (1500.0, 1400.0, 1300.0, 1290.0, 1200.0)
    for total, before in zip(totals, ("as given", *totals), strict=False):
        ended = fit(total, "rolling")
        ended.variant = replace(ended.variant, offsets={"centre_x": offset})
        ended.track = total
        fits.answers["rolling", before] = ended
    assert searching().fit(ONE).fitted.total == end


@pytest.mark.parametrize(
    ("last", "reach", "kept"), [(1405.0, np.inf, True), (1405.0, 1402.0, False)]
)
def test_what_was_made_anew_around_a_fit_and_is_no_better_is_not_made_twice(
    fits, monkeypatch, last, reach, kept
):
    """Unless it ended early, too far behind the best."""
    monkeypatch.setattr(multistart.MultiStart, "_reach", lambda _: reach)
    for total, before in ((1500.0, "as given"), (1400.0, 1500.0), (last, 1400.0)):
        ended = fit(total, "rolling", promised=min(total, 1401.0) if total != last else last)
        ended.variant = replace(ended.variant, offsets={"centre_x": 2.9})
        ended.track = total
        fits.answers["rolling", before] = ended
    looking = searching()
    found = looking.fit(ONE)
    assert found.fitted.total == 1400.0
    asked = len(fits.asked)
    assert looking.anew(found).total == last
    assert (len(fits.asked) == asked) == kept


def test_what_is_made_anew_around_a_fit_that_goes_far_ends_as_soon_as_the_fit(fits):
    """A promise too far behind the best ends a fit, wherever its columns are made."""
    for total, before in ((1400.0, "as given"), (1300.0, 1400.0), (1299.0, 1300.0)):
        ended = fit(total, "rolling")
        ended.variant = replace(ended.variant, offsets={"centre_x": 2.9})
        ended.track = total
        fits.answers["rolling", before] = ended
    best = Tried(Hypothesis((MOTOR,), gain=610.0, score=600.0), fit(1390.0, "motor"))
    searching().fit(ONE, best)
    assert fits.reaches == [search_rules.reach(best=1390.0, gain=610.0)] * 3


def test_where_the_linear_order_is_coarse_more_are_fitted(monkeypatch):
    gains = (1000.0, 950.0, 940.0, 930.0, 850.0, 820.0, 810.0, 700.0)
    options = [Hypothesis((effect(f"effect {k}"),), gain=g, score=g) for k, g in enumerate(gains)]
    monkeypatch.setattr(shortlist, "_commonest", lambda _, options: options[0])
    assert shortlist._first_few(None, options, coarse=False) == options[:3]
    assert shortlist._first_few(None, options, coarse=True) == options[:6]
    assert shortlist._first_few(None, [options[0], *options[5:]], coarse=True) == [
        options[0],
        *options[5:7],
    ]


def test_a_gap_is_laid_to_a_further_effect_only_once_the_first_is_fitted_anew(fits, monkeypatch):
    """With columns that are too old a second effect seems to bring much, and brings nothing."""
    first, anew = fit(1500.0, "rolling"), fit(1110.0, "rolling")
    fits.answers[("rolling", "as given")] = first
    fits.answers[("rolling", "track of rolling")] = anew
    monkeypatch.setattr(hypotheses, "singles", lambda *_: [ONE])
    monkeypatch.setattr(hypotheses, "pairs", lambda *_: [BOTH])
    monkeypatch.setattr(
        fits_of_hypotheses, "gap_after", lambda _, f: SimpleNamespace(exists=f is first)
    )
    monkeypatch.setattr(shortlist, "_commonest", lambda _, options: options[0])
    believe(monkeypatch, lambda _: True)
    monkeypatch.setattr(rivals, "with_one_more", lambda *_: [])
    base = searching().base
    base.starts = ()
    chosen = selection.choose(Fits(base, lambda line: None))
    assert chosen.hypothesis is ONE and chosen.fitted is anew
    assert "motor+rolling" not in {keys for keys, _ in fits.asked}


@pytest.mark.parametrize(
    ("sigmas", "from_there", "begins_again"),
    [
        (1.5, 1110.0, True),  # the chair without effects was stuck
        (1.5, 1990.0, False),  # it is no better there
        (30.0, 1110.0, False),  # the effect is surely there
    ],
)
def test_a_chair_without_effects_is_fitted_from_where_effects_ended_that_are_hardly_there(
    monkeypatch, sigmas, from_there, begins_again
):
    """A gain of 1.5 +- 1.0 % brought 1243, since it had come to another valley of states."""
    gaps = []

    def gap(base):
        gaps.append(base.plain.total)
        return SimpleNamespace(exists=base.plain.total > 1500.0)

    helped = SimpleNamespace(fitted=fit(1100.0, "rolling"))
    helped.fitted.sigmas, helped.fitted.columns = {"rolling": sigmas}, {}
    monkeypatch.setattr(selection, "plain_gap", gap)
    monkeypatch.setattr(selection.one_run, "is_clear", lambda *_: False)
    monkeypatch.setattr(selection, "choose", lambda _: helped)
    monkeypatch.setattr(selection, "made_anew", lambda *_: fit(from_there))
    monkeypatch.setattr(selection, "replace", put)
    base, last, chosen = selection.explained(searching())
    if begins_again:
        assert gaps == [2000.0, from_there]
        assert base.plain.total == from_there and chosen is None and not last.exists
    else:
        assert gaps == [2000.0] and chosen is helped


@pytest.mark.parametrize(
    ("total", "promised", "far", "again"),
    [
        (1500.0, 1499.5, 0.0, False),
        (1500.0, 1498.0, 0.0, True),  # it still promises
        (1500.0, 1499.5, 2.6, True),  # what is roughly known went far
        (-4000.0, -4000.0, 0.0, True),  # a large effect
    ],
)
def test_columns_are_made_anew_only_where_that_may_change_a_fit(
    fits, monkeypatch, total, promised, far, again
):
    monkeypatch.setattr(search_rules, "NOTHING", 1.0)
    first = fit(total, "rolling", promised=promised)
    first.variant = replace(first.variant, offsets={"mass": far})
    fits.answers["rolling", "track of rolling"] = anew = fit(total - 0.1, "rolling")
    assert searching().anew(Tried(ONE, first)) is (anew if again else first)
    assert searching().last_fit(Tried(ONE, first)) is anew


def motor_brings_nothing(fits, monkeypatch, *, alone, anew, beside):
    """Rolling resistance with a motor that ends at 1104.

    Args:
      alone, anew: totals of rolling resistance, from the chair as given and made anew there.
      beside: its total from where both ended.
    """
    fits.answers.update(
        {
            ("rolling", "as given"): fit(alone, "rolling"),
            ("rolling", "track of rolling"): fit(anew, "rolling"),
            ("motor+rolling", "as given"): fit(1105.0, "rolling", "motor"),
            ("motor+rolling", "track of motor+rolling"): fit(1104.0, "rolling", "motor"),
            ("motor", "as given"): None,
            ("motor", "track of motor+rolling"): None,
            ("rolling", "track of motor+rolling"): fit(beside, "rolling"),
        }
    )
    monkeypatch.setattr(
        hypotheses, "weigh", lambda _, starts: Hypothesis(tuple(starts), 870.0, 850.0)
    )


def test_an_effect_that_brings_nothing_once_all_is_made_anew_is_dropped(fits, monkeypatch):
    motor_brings_nothing(fits, monkeypatch, alone=1200.0, anew=1110.0, beside=1115.0)
    looking = searching()
    chosen = backward_elimination.without_needless(looking, looking.fit(BOTH))
    assert chosen.hypothesis.keys == ("rolling",)


def test_an_effect_that_helped_a_stuck_fit_is_dropped(fits, monkeypatch):
    """Alone, rolling resistance is stuck at 1400; from where both ended it fits as well as both."""
    motor_brings_nothing(fits, monkeypatch, alone=1400.0, anew=1400.0, beside=1106.0)
    looking = searching()
    looking.fit(ONE)
    chosen = backward_elimination.without_needless(looking, looking.fit(BOTH))
    assert chosen.hypothesis.keys == ("rolling",) and chosen.fitted.total == 1106.0
    assert looking.fit(ONE).fitted.total == 1106.0


@pytest.mark.parametrize(("rival", "takes"), [(1108.0, True), (1108.5, False), (1111.0, False)])
def test_a_rival_takes_the_place_only_once_both_are_made_anew(rival, takes, fits, monkeypatch):
    """With old columns rolling resistance is 2 ahead of a motor; with new ones that may turn."""
    motor = Hypothesis((MOTOR,), gain=500.0, score=490.0)
    fits.answers[("rolling", "track of rolling")] = fit(1108.4, "rolling")
    fits.answers[("motor", "track of motor")] = fit(rival, "motor")
    believe(monkeypatch, lambda _: True)
    looking = searching()
    chosen = Tried(ONE, fit(1110.0, "rolling"))
    others = {"rolling": [Tried(motor, fit(1112.0, "motor"))], "motor": [chosen]}
    monkeypatch.setattr(rivals, "rivals_of", lambda _, best: [others[best.hypothesis.keys[0]]])
    best, _ = rivals.against_rivals(looking, chosen)
    assert best.hypothesis is (motor if takes else ONE)


def test_the_chosen_effects_take_the_states_of_their_rivals(fits, monkeypatch):
    """Stuck, they would give way to a rival that fits worse than they do in its states."""
    for name in ("rolling", "motor"):
        fits.answers[name, f"track of {name}"] = fit(1108.0, name)
    believe(monkeypatch, lambda _: True)
    looking = searching()
    chosen, better = (Tried(ONE, fit(total, "rolling")) for total in (1130.0, 1100.0))
    rival = Tried(Hypothesis((MOTOR,), gain=500.0, score=490.0), fit(1110.0, "motor"))
    monkeypatch.setattr(rivals, "rivals_of", lambda *_: [[rival]])
    looking.in_states_of = lambda one, other: better if (one, other) == (chosen, rival) else one
    fits.answers["rolling", "track of rolling"] = better.fitted
    assert rivals.against_rivals(looking, chosen)[0] is better


@pytest.mark.parametrize(("behind", "takes"), [(3.0, True), (30.0, True), (80.0, False)])
def test_the_more_common_of_two_effects_comes_first_within_their_form(
    behind, takes, fits, monkeypatch
):
    """Rolling resistance is four times as common as a motor's fault, which is 2.8 of chi2.

    The motor brings 10 000, of which 2 % are the form's: 30 of chi2 count as 1.5 there.
    """
    motor = Tried(Hypothesis((MOTOR,), 500.0, 490.0), fit(0.0, "motor"))
    rolling = Tried(
        Hypothesis((effect("rolling", common=4.0),), 500.0, 490.0), fit(behind, "rolling")
    )
    for name, total in (("motor", 0.0), ("rolling", behind)):
        fits.answers[(name, f"track of {name}")] = fit(total, name)
    believe(monkeypatch, lambda _: True)
    looking = searching()
    looking.base.plain.total = looking.base.reduced.total = 10_000.0
    others = {"rolling": [motor], "motor": [rolling]}
    monkeypatch.setattr(rivals, "rivals_of", lambda _, best: [others[best.hypothesis.keys[0]]])
    best, _ = rivals.against_rivals(looking, motor)
    assert best.hypothesis.keys == (("rolling",) if takes else ("motor",))


@pytest.mark.parametrize(("behind", "takes"), [(-11.0, True), (1.0, False)])
def test_one_effect_that_fits_better_than_two_comes_first_though_it_is_rare(
    behind, takes, monkeypatch
):
    """A wind was 11 of chi2 better than a bearing's friction with a slope, which came first.

    It is a tenth as common as others, and both together bring 5000, of which 2 % are the form's.
    """
    slope, wind = effect("slope", common=2.0), effect("wind", common=0.1)
    pair = Tried(Hypothesis((ROLLING, slope), 5000.0, 4980.0), fit(0.0, "rolling", "slope"))
    alone = Tried(Hypothesis((wind,), 4990.0, 4980.0), fit(behind, "wind"))
    monkeypatch.setattr(rivals, "believable", lambda _: True)
    looking = SimpleNamespace(anew=lambda tried: tried.fitted)
    assert rivals.better_of(looking, pair, [(alone, 5000.0)]) is (alone if takes else None)
    assert rivals.better_of(looking, alone, [(pair, 5000.0)]) is (None if takes else pair)


@pytest.mark.parametrize(("confined", "first"), [(0.0, "shimmy"), (47.0, "rolling")])
def test_what_fits_for_few_beginnings_of_its_windows_is_no_better(confined, first, monkeypatch):
    """A long relaxation fitted a plain coast by 32 of chi2 better than a rolling resistance."""
    shimmy = Tried(
        Hypothesis((effect("shimmy"),), 500.0, 490.0),
        SimpleNamespace(total=111.5, confined=confined),
    )
    rolling = Tried(
        Hypothesis((effect("rolling"),), 500.0, 490.0),
        SimpleNamespace(total=144.1, confined=0.0),
    )
    monkeypatch.setattr(rivals, "believable", lambda _: True)
    looking = SimpleNamespace(anew=lambda tried: tried.fitted)
    one, other = (rolling, shimmy) if first == "shimmy" else (shimmy, rolling)
    assert rivals.better_of(looking, one, [(other, 500.0)]) is other
    assert rivals.better_of(looking, other, [(one, 500.0)]) is None
    assert (shimmy.price < rolling.price) == (first == "shimmy")


@pytest.mark.parametrize(("total", "both_sides"), [(1099.5, True), (1100.5, True), (1102.0, False)])
def test_both_sides_are_free_where_the_data_leave_open_which_it_is(total, both_sides, monkeypatch):
    """Of two wheels that differ by 1 mm, a rival came in by the right one alone."""
    right = Tried(Hypothesis((MOTOR,), 500.0, 490.0), SimpleNamespace(confined=0.0, total=1100.0))
    both = Hypothesis((SimpleNamespace(effect=MOTOR.effect, free=("left", "right")),), 500.0, 480.0)
    looking = SimpleNamespace(
        fit=lambda h, best: Tried(h, SimpleNamespace(confined=0.0, total=total)),
        near_to=lambda _: nullcontext(),
        weigh=lambda _: SimpleNamespace(gain=500.0),
        base=SimpleNamespace(starts=()),
    )
    monkeypatch.setattr(selection, "_richest", lambda *_: both.starts[0])
    monkeypatch.setattr(selection, "freed", lambda _, hypothesis: both)
    assert (selection._with_both_sides(looking, right).hypothesis is both) == both_sides
    monkeypatch.setattr(selection, "freed", lambda _, hypothesis: hypothesis)
    assert selection._with_both_sides(looking, right) is right


def chosen(hypothesis, tried, own_gains):
    """A choice without rivals of what was fitted, (hypothesis, chi2) each, all really there."""
    fits_made = [
        Tried(h, SimpleNamespace(confined=0.0, total=total, variant=Variant(())))
        for h, total in tried
    ]
    return Choice(
        hypothesis=hypothesis,
        fitted=SimpleNamespace(confined=0.0, total=1e3, variant=Variant(())),
        after=None,
        rivals=[[] for _ in hypothesis.starts],
        own_gains=own_gains,
        tried=fits_made,
    )


@pytest.mark.parametrize(
    ("gained", "std", "total", "both_sides"),
    [
        (-1.5e6, 1.5, 1099.5, True),  # around the fit linear algebra says nothing
        (-1.5e6, 0.03, 1099.5, False),  # it is the right one
        (-1.5e6, 1.5, 1102.6, True),  # the fit has not come to its end
        (-1.5e6, 1.5, 1200.0, False),  # no chair is so
        (510.0, 1.5, 1099.5, False),  # linear algebra has compared them
    ],
)
def test_both_sides_are_freed_by_a_fit_where_linear_algebra_says_nothing(
    gained, std, total, both_sides, monkeypatch
):
    """A left wheel 1.27 mm smaller was a right one 1.27 +- 0.03 mm larger, beside a patch."""
    parameter = SimpleNamespace(neutral=0.0)
    sides = SimpleNamespace(
        key="wheel", seeds=None, common=1.0, fitted=(), parameter=lambda _: parameter
    )
    right, both = (
        SimpleNamespace(effect=sides, group="wheel", free=free, columns=free)
        for free in (("right",), ("left", "right"))
    )
    at = Term(sides, {"left": 0.0, "right": 1.27}, ("right",))
    chosen = SimpleNamespace(
        confined=0.0, total=1100.0, variant=Variant((), terms=(at,)), track="track"
    )
    best = Tried(Hypothesis((right,), 500.0, 490.0), chosen)
    kept = []

    def made(bench, start, before):
        parameters = [ParameterId("wheel", side) for side in start.terms[0].free]
        assert before == "track" and len(parameters) == 2
        parameter.name = "right"
        return SimpleNamespace(
            confined=0.0, total=total, variant=start, std=dict.fromkeys(parameters, std)
        )

    monkeypatch.setattr(selection, "freed", lambda _, hypothesis: hypothesis)
    monkeypatch.setattr(selection, "made_anew", made)
    looking = SimpleNamespace(
        near_to=lambda _: nullcontext(),
        weigh=lambda starts: SimpleNamespace(gain=500.0 if starts == (right,) else gained),
        base=SimpleNamespace(starts=(right, both), bench=None),
        keep_better=kept.append,
    )
    found = selection._with_both_sides(looking, best)
    assert (found is not best) == both_sides
    assert found.hypothesis.starts == ((both,) if both_sides else (right,))
    assert kept == ([found] if both_sides else [])


def test_what_was_fitted_and_is_probable_stands_in_the_set():
    """A wheel radius that chi2 rules out by its form, with 17 %, beside an encoder's scale."""
    motor, wind = Hypothesis((MOTOR,), 500.0, 490.0), Hypothesis((WIND,), 400.0, 390.0)
    choice = chosen(ONE, [(h, 1e3) for h in (ONE, motor, wind)], [500.0])
    probability = {"rolling": 0.8, "motor": 0.17, "wind": 0.03}
    found = rivals.with_probable(choice, probability)
    assert [[r.hypothesis.keys for r in group] for group in found.rivals] == [[("motor",)]]
    assert not found.others
    # it is there once
    assert rivals.with_probable(found, probability).rivals == found.rivals


def test_two_effects_may_stand_in_the_place_of_one():
    """Rolling resistance and the drag of the air pass for the friction of a bearing."""
    pair = Hypothesis((MOTOR, WIND), 490.0, 470.0)
    choice = chosen(ONE, [(ONE, 1e3), (pair, 1020.0), (pair, 1010.0)], [500.0])
    found = rivals.with_probable(choice, {"rolling": 0.9, pair.name: 0.07, "outside": 0.03})
    assert [t.fitted.total for t in found.others] == [1010.0]  # the better fit, once
    ((without, instead, rival),) = rivals.exchanged(found)
    assert (without, instead) == ([ROLLING], [MOTOR, WIND])
    assert rival is found.others[0]
    assert decide._alternatives(found, once=False, alone=None) == [["rolling", "motor+wind"]]
    alone = decide._alternatives(found, once=False, alone=SimpleNamespace())
    assert alone[1:] == [["rolling", "one_run"]]


@pytest.mark.parametrize(
    ("common", "total", "stands"),
    [
        ((4.0, 4.0), 995.0, True),
        ((4.0, 4.0), 1020.0, False),  # chi2 rules it out
        ((4.0, 1.0), 995.0, False),  # not every chair has it: that it takes two counts
    ],
)
def test_of_what_every_chair_has_two_effects_stand_in_the_place_of_one(common, total, stands):
    """A bearing's viscous friction of 96 % was named; rolling resistance and drag were there."""
    usual = Hypothesis((effect("motor", common[0]), effect("wind", common[1])), 500.0, 480.0)
    choice = chosen(ONE, [(ONE, 1e3), (usual, total)], [500.0])
    found = rivals.with_probable(choice, {"rolling": 0.96, usual.name: 0.01})
    assert bool(found.others) == stands
    # what holds the choice and more says that it is there
    more = Hypothesis((ROLLING, effect("motor", 4.0)), 500.0, 480.0)
    beside = chosen(ONE, [(ONE, 1e3), (more, 995.0)], [500.0])
    assert not rivals.with_probable(beside, {"rolling": 0.96}).others


@pytest.mark.parametrize(
    ("probability", "score", "fitted", "cannot_be"),
    [
        (0.12, 470.0, True, False),
        (0.12, 470.0, True, True),
        (0.011, 479.0, False, False),
        (0.011, 481.0, True, False),  # linear algebra promises about as much as of what is chosen
        (0.004, 491.0, True, False),
        (0.0004, 491.0, False, False),
    ],
)
def test_what_linear_algebra_finds_probable_or_better_is_fitted_before_the_verdict(
    probability, score, fitted, cannot_be, monkeypatch
):
    """The friction of a bearing closed the gap, so no pair had been fitted."""
    motor, wind = Hypothesis((MOTOR,), 480.0, 470.0), Hypothesis((WIND,), 400.0, 390.0)
    pair = Hypothesis((MOTOR, WIND), 490.0, score)
    more = replace(BOTH, score=2.0 * score)  # with the choice in it: that is no other
    known = {"rolling": 0.7, "motor": 0.14, "wind": 0.01, "outside": 0.03, more.name: 0.01}
    known[pair.name] = probability
    monkeypatch.setattr(probable, "probabilities", lambda *_: known)
    monkeypatch.setattr(hypotheses, "singles", lambda *_: [ONE, motor, wind])
    monkeypatch.setattr(hypotheses, "pairs", lambda *_: [more, pair])
    choice = chosen(ONE, [(ONE, 1e3), (motor, 1010.0)], [500.0])
    asked = []
    looking = SimpleNamespace(
        base=SimpleNamespace(reduced=None, starts=()),
        tried=choice.tried,
        weigh=lambda starts: ONE,
        fit=lambda h, best: asked.append(h.name) or (None if cannot_be else Tried(h, best.fitted)),
    )
    monkeypatch.setattr(probable, "better_of", lambda fits, chosen, found: found)
    found = probable.better_than(looking, choice)
    assert asked == [pair.name] * fitted  # the motor was fitted before, and wind is not probable
    there = fitted and not cannot_be
    assert [(t.hypothesis, by) for t, by in found] == ([(pair, 500.0)] if there else [])


def test_the_same_error_of_two_sensors_is_two_alternatives():
    """One encoder or the other was told as [["sensor_scale"]], and the report could not be made."""
    left, right = (effect(f"sensor_scale:{side}_wheel_speed") for side in ("left", "right"))
    for one in (left, right):
        one.effect.name = "sensor_scale"
    first, second = Hypothesis((left,), 500.0, 490.0), Hypothesis((right,), 499.0, 489.0)
    choice = chosen(first, [(first, 1e3), (second, 1001.0)], [500.0])
    found = rivals.with_probable(choice, {first.name: 0.5, second.name: 0.5})
    sets = decide._alternatives(found, once=False, alone=None)
    assert sets == [["sensor_scale:left_wheel_speed", "sensor_scale:right_wheel_speed"]]


def test_one_effect_may_stand_in_the_place_of_two_and_nothing_in_that_of_one():
    wind = Hypothesis((WIND,), 490.0, 470.0)
    choice = chosen(BOTH, [(BOTH, 1e3), (wind, 1020.0), (ONE, 1030.0)], [400.0, 30.0])
    found = rivals.with_probable(choice, {BOTH.name: 0.7, "wind": 0.2, "rolling": 0.1})
    sets = decide._alternatives(found, once=False, alone=None)
    assert sorted(sets) == [["motor", "none"], ["rolling+motor", "wind"]]
    assert found.brought == {"rolling": 400.0, "motor": 30.0}


@pytest.mark.parametrize("alone", [None, 1500.0])
def test_an_effect_brings_what_the_others_lose_without_it(alone, monkeypatch):
    """Around a caster that is stuck linear algebra says that nothing is lost if it is free."""
    linear = {2: BOTH, 1: replace(BOTH, gain=BOTH.gain - 2.0)}
    looking = searching()
    monkeypatch.setattr(looking, "near_to", lambda _: nullcontext())
    monkeypatch.setattr(looking, "weigh", lambda starts: linear[len(starts)])
    if alone is not None:
        motor = Hypothesis((MOTOR,), gain=500.0, score=490.0)
        looking.tried.append(Tried(motor, fit(alone, "motor")))
    own = rivals._own_gain(looking, Tried(BOTH, fit(1104.0, "rolling", "motor")), ROLLING)
    assert own == (2.0 if alone is None else alone - 1104.0)


def test_a_second_effect_is_weighed_around_the_fit_of_the_first(fits, monkeypatch):
    """Around the chair without effects, the pair that is right is not even listed."""
    fits.answers.update(
        {
            ("rolling", "as given"): fit(1500.0, "rolling"),
            ("rolling", "track of rolling"): fit(1500.0, "rolling"),
            ("motor+rolling", "track of motor+rolling"): fit(1110.0, "rolling", "motor"),
        }
    )
    both = fit(1110.0, "rolling", "motor")
    near = SimpleNamespace(refit=lambda starts, most, reach: both, weigh=lambda starts: ONE)
    monkeypatch.setattr(fits_of_hypotheses, "near_fit", lambda base, found: near)
    monkeypatch.setattr(hypotheses, "singles", lambda *_: [ONE])
    monkeypatch.setattr(hypotheses, "pairs", lambda *_: [])
    monkeypatch.setattr(shortlist, "with_one_more", lambda *_: [BOTH])
    monkeypatch.setattr(
        fits_of_hypotheses, "gap_after", lambda _, f: SimpleNamespace(exists=f is not both)
    )
    monkeypatch.setattr(shortlist, "_commonest", lambda _, options: options[0])
    believe(monkeypatch, lambda _: True)
    monkeypatch.setattr(forward_selection, "is_worth", lambda *_: True)
    looking = searching()
    looking.base.starts = ()
    best, left = forward_selection.grown(looking)
    assert best.hypothesis is BOTH and best.fitted is both
    assert not left.exists and looking.near is None


def rolling_alone_first(monkeypatch, closes):
    """Fits of which rolling resistance is the best single one.

    Args:
      closes: the fit that leaves no gap; None: all leave one.
    """
    monkeypatch.setattr(
        hypotheses, "weigh", lambda _, starts: Hypothesis(tuple(starts), 870.0, 850.0)
    )
    monkeypatch.setattr(hypotheses, "singles", lambda *_: [ONE])
    monkeypatch.setattr(shortlist, "_commonest", lambda _, options: options[0])
    believe(monkeypatch, lambda _: True)
    monkeypatch.setattr(
        fits_of_hypotheses, "gap_after", lambda _, f: SimpleNamespace(exists=f is not closes)
    )
    looking = searching()
    looking.base.starts = ()
    return looking


def test_a_single_effect_may_be_what_the_search_for_noise_left_over(fits, monkeypatch):
    """By linear algebra rolling resistance is best; beside it a motor ended as the only one."""
    motor = fit(1110.0, "motor")
    fits.answers.update(
        {
            ("rolling", "as given"): fit(1500.0, "rolling"),
            ("rolling", "track of rolling"): fit(1500.0, "rolling"),
            ("motor", "track of motor+rolling"): motor,
            ("motor", "track of motor"): motor,
        }
    )
    looking = rolling_alone_first(monkeypatch, closes=motor)
    both = fit(1105.0, "rolling", "motor")
    both.sigmas = {"rolling": 0.5, "motor": 30.0}
    looking.base.best = SimpleNamespace(starts=(ROLLING, MOTOR), fitted=both)
    best, left = forward_selection.grown(looking)
    assert best.hypothesis.keys == ("motor",) and best.fitted is motor and not left.exists


@pytest.mark.parametrize("closes", [True, False])
def test_effects_left_over_while_the_noise_was_sought_come_before_pairs(fits, monkeypatch, closes):
    """Where one effect leaves a gap and these leave none, no pair is built on the single effect.

    On a person who pushes, singles and pairs took minutes before the right three were looked at.
    """
    rolling, together = fit(1500.0, "rolling"), fit(1110.0, "motor", "wind")
    fits.answers.update(
        {
            ("rolling", "as given"): rolling,
            ("rolling", "track of rolling"): rolling,
            ("motor+wind", "track of motor+wind"): together,
        }
    )
    monkeypatch.setattr(left_over, "is_worth", lambda *_: True)
    further = mock.Mock(return_value=None)
    monkeypatch.setattr(forward_selection, "further", further)
    looking = rolling_alone_first(monkeypatch, closes=together if closes else None)
    best = fit(1105.0, "motor", "wind")
    best.sigmas = {"motor": 30.0, "wind": 20.0}
    looking.base.best = SimpleNamespace(starts=(MOTOR, WIND), fitted=best)
    here = forward_selection.grown(looking)
    assert further.called != closes
    assert not closes or here[0].hypothesis.keys == ("motor", "wind")


@pytest.mark.parametrize(("beside", "pair"), [(1600.0, True), (1150.0, True), (1050.0, False)])
def test_a_pair_that_was_fitted_while_the_noise_was_sought_may_be_the_better_one(
    fits, monkeypatch, beside, pair
):
    """A wind stood in for slope and toe, and drives that are 20 % weak for a load of 40 kg.

    What stands beside these leaves no gap either, and may fit worse than they do alone.
    """
    both = Hypothesis((MOTOR, WIND), gain=900.0, score=880.0)
    fits.answers.update(
        {
            ("rolling", "as given"): fit(1500.0, "rolling"),
            ("rolling", "track of rolling"): fit(1500.0, "rolling"),
            ("motor+wind", "track of motor+wind"): fit(1105.0, "motor", "wind"),
        }
    )
    other = Tried(BOTH, fit(beside, "rolling", "motor"))
    monkeypatch.setattr(hypotheses, "weigh", lambda _, starts: both)
    monkeypatch.setattr(
        forward_selection, "beside", lambda *_: (other, SimpleNamespace(exists=False))
    )
    believe(monkeypatch, lambda _: True)
    monkeypatch.setattr(fits_of_hypotheses, "gap_after", lambda *_: SimpleNamespace(exists=False))
    looking = searching()
    looking.base.best = SimpleNamespace(starts=both.starts, fitted=fit(1105.0, "motor", "wind"))
    first = looking.fit(ONE)
    found, left = forward_selection.further(looking, first, 2)
    assert (found.hypothesis is both) == pair
    assert found.fitted.total == min(beside, 1105.0) and not left.exists


@pytest.mark.parametrize(
    ("offset", "narrow", "best"),
    [
        (3.0, 1110.0, "motor"),  # on its wall: with nearer walls another effect is the best
        (3.0, 1600.0, "rolling"),  # which fits worse
        (1.0, 1110.0, "rolling"),  # nothing is far from what it is known to be
    ],
)
def test_what_is_roughly_known_hides_no_effect(fits, monkeypatch, offset, narrow, best):
    """Linear algebra with wide walls laid a motor on a centre of mass."""
    fits.answers.update(
        {
            ("rolling", "as given"): fit(1500.0, "rolling"),
            ("motor", "as given"): fit(narrow, "motor"),
        }
    )
    other = Hypothesis((MOTOR,), gain=24_000.0, score=24_000.0)

    monkeypatch.setattr(alternatives, "replace", put)
    monkeypatch.setattr(hypotheses, "singles", lambda *_: [other])
    monkeypatch.setattr(shortlist, "_commonest", lambda _, options: options[0])
    believe(monkeypatch, lambda _: True)
    monkeypatch.setattr(
        fits_of_hypotheses, "gap_after", lambda _, f: SimpleNamespace(exists=f.total > 1200.0)
    )
    looking = searching()
    looking.base.plain.variant = Variant((), offsets={"centre_x": offset})
    looking.base.starts = ()
    wide = looking.base.reduced
    wide.narrowed = lambda wall: reduced(26_000.0)
    first = looking.fit(ONE)
    found, _ = alternatives.or_as_given(looking, (first, SimpleNamespace(exists=True)))
    assert found.hypothesis.keys == (best,)
    assert (looking.base.reduced is wide) == (best == "rolling")


@pytest.mark.parametrize(
    ("far", "total", "best"),
    [
        (9000.0, 1110.0, "motor"),  # by the other windows another effect is the best
        (9000.0, 1600.0, "rolling"),  # which fits worse
        (900.0, 1110.0, "rolling"),  # no window is far off
    ],
)
def test_windows_in_which_a_chair_goes_another_way_hide_no_effect(
    fits, monkeypatch, far, total, best
):
    """A caster that swivels to the other side was laid to its sensor."""
    fits.answers.update(
        {
            ("rolling", "as given"): fit(1500.0, "rolling"),
            ("motor", "as given"): fit(total, "motor"),
        }
    )
    by = []

    def reduce(system, windows):
        by.append(windows)
        return reduced(400.0)

    motor = Hypothesis((MOTOR,), gain=90.0, score=90.0)
    monkeypatch.setattr(alternatives, "replace", put)
    monkeypatch.setattr(bounded, "reduce", reduce)
    monkeypatch.setattr(hypotheses, "singles", lambda *_: [motor])
    monkeypatch.setattr(shortlist, "_commonest", lambda _, options: options[0])
    believe(monkeypatch, lambda _: True)
    monkeypatch.setattr(
        fits_of_hypotheses, "gap_after", lambda _, f: SimpleNamespace(exists=f.total > 1200.0)
    )
    looking = searching()
    looking.base.bench.windows = np.array([0, 1, 2, 5])
    looking.base.plain.chi2 = np.array([100.0, 110.0, far, 120.0])
    looking.base.starts, looking.base.system = (), None
    wide = looking.base.reduced
    here = (looking.fit(ONE), SimpleNamespace(exists=True))
    found, _ = alternatives.or_by_most_windows(looking, here)
    assert found.hypothesis.keys == (best,)
    assert by == ([[0, 1, 5]] if far > 1000.0 else [])
    assert (looking.base.reduced is wide) == (best == "rolling")


@pytest.mark.parametrize("shimmies", [False, True])
@pytest.mark.parametrize("total", [1110.0, 1600.0])
def test_an_effect_of_a_whole_size_may_be_the_better_one(fits, monkeypatch, total, shimmies):
    """A patch of the floor stood for casters that shimmy, and left no gap in one run."""
    fits.answers.update(
        {
            ("rolling", "as given"): fit(1500.0, "rolling"),
            ("rolling", "track of rolling"): fit(1500.0, "rolling"),
        }
    )
    whole = fit(total, "motor")
    monkeypatch.setattr(whole_sizes, "fits", lambda *_: [(MOTOR, whole)])
    monkeypatch.setattr(hypotheses, "weigh", lambda *_: Hypothesis((MOTOR,), 9.0, 9.0))
    believe(monkeypatch, lambda _: True)
    monkeypatch.setattr(fits_of_hypotheses, "gap_after", lambda *_: SimpleNamespace(exists=False))
    looking = searching()
    here = (looking.fit(ONE), SimpleNamespace(exists=True))
    found, left = alternatives.or_whole(looking, here)
    assert (found.fitted is whole and not left.exists) == (total < 1500.0)
    monkeypatch.setattr(whole_sizes, "shimmies", lambda _: shimmies)
    closed = (here[0], SimpleNamespace(exists=False))
    # where nothing asks for one, none is looked for
    stays = alternatives.or_whole(looking, closed) is closed
    assert stays == (not shimmies or total > 1500.0)
    # an inertia three deviations off stood, with a centre of mass, for a turn that a scrub ends
    far = replace(here[0].fitted.variant, offsets={"inertia": 3.0})
    pushed = replace(here[0], fitted=SimpleNamespace(**{**vars(here[0].fitted), "variant": far}))
    closed = (pushed, SimpleNamespace(exists=False))
    assert (alternatives.or_whole(looking, closed) is closed) == (total > 1500.0)


@pytest.mark.parametrize("total", [1110.0, 1600.0])
def test_an_effect_of_a_whole_size_may_be_better_than_several(fits, monkeypatch, total):
    """Weak drives and a rider who sways stood for tires that resist turning."""
    several = Tried(BOTH, fit(1500.0, "rolling", "motor"))
    whole = fit(total, "wind")
    looked = []

    def made(base, single, best):
        looked.append((single.total, best.total))
        return [((WIND,), whole)]

    monkeypatch.setattr(whole_beside, "fits", made)
    monkeypatch.setattr(hypotheses, "weigh", lambda *_: Hypothesis((WIND,), 9.0, 9.0))
    believe(monkeypatch, lambda _: True)
    monkeypatch.setattr(fits_of_hypotheses, "gap_after", lambda *_: SimpleNamespace(exists=False))
    monkeypatch.setattr(Fits, "anew", lambda _, tried: tried.fitted)
    looking = searching()
    closed = SimpleNamespace(exists=False)
    found, left = alternatives.or_whole_beside(looking, (several, closed))
    assert (found.fitted is whole and not left.exists) == (total < 1500.0)
    looking.tried.append(Tried(ONE, fit(1700.0, "rolling")))
    alternatives.or_whole_beside(looking, (several, closed))
    assert [single for single, _ in looked] == [2000.0, min(1700.0, total)]
    # one effect that leaves nothing is not doubted
    one = (Tried(ONE, fit(1500.0, "rolling")), closed)
    assert alternatives.or_whole_beside(looking, one) is one
    assert len(looked) == 2


@pytest.mark.parametrize(
    ("event_brings", "left"),
    [
        (400.0, "two"),  # the effect brings far more
        (505.0, "one"),  # as much: it may have happened once
        (1000.0, "none"),
    ],
)
def test_beside_what_happened_once_no_second_effect_is_sought(
    fits, monkeypatch, event_brings, left
):
    """A knock in one run came as a relaxation length with a caster's friction, after 616 s."""
    monkeypatch.undo()
    monkeypatch.setattr(forward_selection.event, "largest", lambda _: event.Event(event_brings))
    monkeypatch.setattr(forward_selection.left_out, "held_out_shows", lambda _: False)
    gap = SimpleNamespace(exists=True, excess=500.0)
    monkeypatch.setattr(fits_of_hypotheses, "gap_after", lambda *_: gap)
    monkeypatch.setattr(forward_selection, "is_worth", lambda *_: True)
    monkeypatch.setattr(forward_selection, "_settled", lambda _, here: here)
    monkeypatch.setattr(forward_selection, "_or_left_over", lambda _, here: here)
    monkeypatch.setattr(columns_anew, "make", lambda *_: False)
    for name in ("or_as_given", "or_by_most_windows", "or_other_form", "or_whole"):
        monkeypatch.setattr(alternatives, name, lambda _, here: here)
    one = Tried(ONE, fit(1500.0, "rolling")), gap
    two = Tried(BOTH, fit(1100.0, "rolling", "motor")), SimpleNamespace(exists=False)
    monkeypatch.setattr(forward_selection, "further", lambda _, best, size: (one, two)[size - 1])
    expected = {"two": two, "one": one, "none": None}[left]
    assert forward_selection._grown_from(searching(), None) == expected


@pytest.mark.parametrize("shimmies", [False, True])
def test_beside_what_makes_casters_shimmy_another_effect_is_sought(fits, monkeypatch, shimmies):
    """A rider who moves stood in for a motor's back EMF."""
    monkeypatch.setattr(
        whole_sizes, "parameter_of", lambda e: "whole" if e.key == "rolling" else None
    )
    monkeypatch.setattr(whole_sizes, "shimmies", lambda _: shimmies)
    brake = effect("brake")
    better, looked = fit(1200.0, "rolling", "brake"), []

    def made(base, single):
        looked.append(single.total)
        return [((ROLLING, brake), better)]

    monkeypatch.setattr(whole_beside, "beside_shimmy", made)
    monkeypatch.setattr(hypotheses, "weigh", lambda *_: Hypothesis((ROLLING, brake), 9.0, 9.0))
    believe(monkeypatch, lambda _: True)
    monkeypatch.setattr(fits_of_hypotheses, "gap_after", lambda *_: SimpleNamespace(exists=False))
    looking = searching()
    looking.tried += [
        Tried(ONE, fit(1700.0, "rolling")),
        Tried(BOTH, fit(1500.0, "rolling", "motor")),
    ]
    looking.tried.append(Tried(Hypothesis((WIND,), 9.0, 9.0), fit(1600.0, "wind")))
    here = (looking.tried[1], SimpleNamespace(exists=False))
    found = alternatives.or_whole_beside(looking, here)
    assert found[0].fitted is (better if shimmies else here[0].fitted)
    assert looked == ([1700.0] if shimmies else [])


def test_a_fit_that_cannot_come_near_the_best_is_not_started_again(fits):
    """It promises 1450 beside a best of 1000, of a gain of 1000 where 2 % keep a rival."""
    fits.answers[("motor", "as given")] = fit(1500.0, "motor", promised=1450.0)
    fits.answers[("motor", "track of motor")] = fit(1440.0, "motor")
    rival = Hypothesis((MOTOR,), gain=560.0, score=550.0)
    best = Tried(replace(ONE, gain=1000.0), fit(1000.0, "rolling"))
    assert searching().fit(rival, best).fitted.total == 1500.0
    assert searching().fit(rival).fitted.total == 1440.0


@pytest.mark.parametrize(
    ("gained", "there"),
    [
        (950.0, 1003.0),  # alike, by linear algebra, and 500 worse by its fit: it is stuck
        (480.0, 1500.0),  # as far behind as linear algebra says
    ],
)
def test_a_rival_that_ends_in_another_valley_begins_where_the_best_ended(fits, gained, there):
    """Casters turned over for one wheel that is smaller, and not for the other that is larger."""
    fits.answers[("motor", "as given")] = fit(1500.0, "motor", promised=1450.0)
    fits.answers[("motor", "track of rolling")] = fit(1003.0, "motor")
    best = Tried(replace(ONE, gain=1000.0), fit(1000.0, "rolling"))
    rival = Hypothesis((MOTOR,), gain=gained, score=gained - 10.0)
    assert searching().fit(rival, best).fitted.total == there


@pytest.mark.parametrize(
    ("worse", "stays"),
    [
        ([30.0] * 12, False),
        ([5000.0, *[30.0] * 12], False),  # one window hides what the others say
        ([5000.0, *[1.0, -1.0] * 6], True),  # one window alone decides nothing
        ([2.0] * 12, True),
    ],
)
def test_one_window_neither_rules_a_rival_out_nor_keeps_it(worse, stays):
    scatter = np.resize([4.0, -4.0], len(worse))
    ours = np.full(len(worse), 100.0)
    total = ours.sum()
    bare = {"at_bound": (), "variant": Variant(()), "track": Named("alike")}
    chosen = Tried(ONE, SimpleNamespace(confined=0.0, total=total, chi2=ours, **bare))
    theirs = ours + np.array(worse) + scatter
    rival = Tried(
        Hypothesis((MOTOR,), 400.0, 390.0),
        SimpleNamespace(confined=0.0, total=theirs.sum(), chi2=theirs, **bare),
    )
    assert rivals._not_ruled_out(rival, chosen, 12_000.0) == stays


@pytest.mark.parametrize(
    ("theirs", "stays"),
    [
        ([500.0, 500.0, 100.0, 100.0], True),  # no better than nothing in a run
        ([500.0, 900.0, 100.0, 100.0], False),  # worse than nothing there
        ([900.0, 100.0, 100.0, 100.0], True),  # in one of its windows, and better in the other
    ],
)
def test_a_rival_that_fits_a_run_worse_than_nothing_does_is_out(theirs, stays):
    """Toe as large as a coast asked for fitted a spin worse than no effect at all."""

    base = searching().base
    chosen, rival = _single(ROLLING, [100.0] * 4), _single(MOTOR, theirs)
    harm = rivals._harm(base, rival.fitted, chosen.fitted)
    assert rivals._not_ruled_out(rival, chosen, 9000.0, harm) == stays


def _single(start, chi2, **offsets):
    """A fit of one effect, with roughly known numbers moved by standard deviations."""
    variant = Variant((), offsets=offsets)
    fitted = SimpleNamespace(
        confined=0.0,
        total=sum(chi2),
        chi2=np.array(chi2),
        at_bound=(),
        at_least={},
        variant=variant,
    )
    return Tried(Hypothesis((start,), gain=900.0, score=890.0), fitted)


@pytest.mark.parametrize(
    ("behind", "theirs", "ours", "stays"),
    [
        (19.0, 2.9, 0.0, True),
        (19.0, 3.0, 0.0, False),
        (19.0, -3.0, 3.0, True),  # what pushes it is missing beside both
        (9.0, 3.0, 0.0, True),  # it fits as well as forms are right
    ],
)
def test_a_rival_with_a_number_on_its_wall_lacks_what_pushes_it_there(behind, theirs, ours, stays):
    """A turning scrub with the centre of mass at its wall stood beside one that is aside."""
    chosen = _single(ROLLING, [100.0] * 4, centre_x=ours)
    rival = _single(MOTOR, [100.0 + behind, 100.0, 100.0, 100.0], centre_x=theirs)
    wind = _single(WIND, [100.0 + behind, 100.0, 100.0, 100.0], centre_x=theirs)
    assert rivals._not_ruled_out(rival, chosen, 320.0) == stays
    choice = chosen_by([chosen, wind])
    found = rivals.with_probable(choice, {"rolling": 0.8, "wind": 0.2})
    assert [len(group) for group in found.rivals] == [int(stays)]


def chosen_by(tried):
    """A choice of the first of what was tried, which brings 320."""
    first = tried[0]
    return replace(chosen(first.hypothesis, [], [320.0]), fitted=first.fitted, tried=tried)


@pytest.mark.parametrize(
    ("open_upwards", "best", "believed"),
    [
        (True, None, True),
        (False, None, False),  # nothing is known of it, and no larger size fits as well
        (True, 1400.0, False),  # another fits better, so nobody asks
    ],
)
def test_a_size_that_is_open_upwards_is_believed_at_its_least(
    fits, monkeypatch, open_upwards, best, believed
):
    """Casters held fast by 4 N m brought 4000 of chi2, and were no answer: not determined."""
    fits.answers[("rolling", "as given")] = unknown = fit(1500.0, "rolling")
    fits.answers[("rolling", "track of rolling")] = unknown
    key = ParameterId("rolling", "size")
    least = fit(1503.0, "rolling")
    least.at_least = {key: 0.3} if open_upwards else {}
    asked = []

    def with_least_sizes(_, fitted):
        asked.append(fitted)
        return least

    monkeypatch.setattr(fits_of_hypotheses.open_ended, "with_least_sizes", with_least_sizes)
    monkeypatch.setattr(fits_of_hypotheses, "believable", lambda f: bool(f.at_least))
    looking = searching()
    top = None if best is None else Tried(replace(ONE, gain=600.0), fit(best, "motor"))
    found = looking.believed(ONE, top)
    assert (found is not None) == believed and bool(asked) == (best is None)
    if believed:
        assert found.fitted is least and looking.believed(ONE).fitted is least
        assert len(asked) == 1


@pytest.mark.parametrize("patience", [1.0, 3.0])
def test_a_search_that_has_become_long_ends_with_what_it_has(fits, monkeypatch, patience):
    """Twice as many steps as a usual search may take: the second effect waits for more patience."""
    for before in ("as given", "track of rolling", "track of motor+rolling"):
        fits.answers[("rolling", before)] = fit(1500.0, "rolling")
        fits.answers[("motor+rolling", before)] = fit(1110.0, "rolling", "motor")
    monkeypatch.setattr(hypotheses, "singles", lambda *_: [ONE])
    monkeypatch.setattr(hypotheses, "pairs", lambda *_: [BOTH])
    monkeypatch.setattr(
        fits_of_hypotheses, "gap_after", lambda _, f: SimpleNamespace(exists=f.total > 1200.0)
    )
    monkeypatch.setattr(selection, "confirmed", lambda _base, _fitted, gap: gap)
    monkeypatch.setattr(shortlist, "_commonest", lambda _, options: options[0])
    monkeypatch.setattr(forward_selection, "is_worth", lambda *_: True)
    believe(monkeypatch, lambda _: True)
    monkeypatch.setattr(fits_of_hypotheses, "near_fit", lambda *_: None)
    monkeypatch.setattr(
        forward_selection, "promising", lambda _, best: [BOTH] if best.hypothesis is ONE else []
    )
    looking = searching()
    looking.base.starts = ()
    looking.base.patience = patience
    looking.base.bench.simulator.stepped = int(2.0 * search_rules.LONGEST)
    here = forward_selection.grown(looking)
    assert looking.ended is (patience == 1.0)
    assert here[0].hypothesis is (ONE if looking.ended else BOTH)


def test_where_no_second_effect_stands_no_third_is_tried(fits, monkeypatch):
    """The second effect is not determined."""
    third = Hypothesis((ROLLING, MOTOR, effect("scrub")), gain=950.0, score=920.0)
    fits.answers[("rolling", "as given")] = fit(1500.0, "rolling")
    fits.answers[("rolling", "track of rolling")] = fit(1490.0, "rolling")
    fits.answers[("motor+rolling", "as given")] = fit(1110.0, "rolling", "motor")
    monkeypatch.setattr(hypotheses, "singles", lambda *_: [ONE])
    monkeypatch.setattr(hypotheses, "pairs", lambda *_: [BOTH])
    monkeypatch.setattr(hypotheses, "grown", lambda *_: [third])
    monkeypatch.setattr(fits_of_hypotheses, "gap_after", lambda *_: SimpleNamespace(exists=True))
    monkeypatch.setattr(selection, "confirmed", lambda _base, _fitted, gap: gap)
    monkeypatch.setattr(shortlist, "_commonest", lambda _, options: options[0])
    believe(monkeypatch, lambda f: len(f.variant.terms) == 1)
    monkeypatch.setattr(rivals, "with_one_more", lambda *_: [])
    near = SimpleNamespace(weigh=lambda starts: ONE)
    monkeypatch.setattr(fits_of_hypotheses, "near_fit", lambda *_: near)
    monkeypatch.setattr(shortlist, "with_one_more", lambda *_: [])
    base = searching().base
    base.starts = ()
    chosen = selection.choose(Fits(base, lambda line: None))
    assert chosen.hypothesis is ONE
    assert "motor+rolling+scrub" not in {keys for keys, _ in fits.asked}


@pytest.mark.parametrize(
    ("otherwise", "offset", "total", "both"),
    [
        (True, 0.0, 1010.0, True),  # the chair answers otherwise than the one given
        (False, 3.0, 1010.0, True),  # a number stands on its wall
        (False, 2.9, 1010.0, False),
        (True, 3.0, 1100.0, False),  # the further effect is not worth it
    ],
)
def test_beside_effects_that_leave_no_gap_one_may_hide(
    fits, monkeypatch, otherwise, offset, total, both
):
    first = fit(1110.0, "rolling")
    first.variant = replace(first.variant, offsets={"mass": offset})
    fits.answers[("rolling", "as given")] = fits.answers[("rolling", "track of rolling")] = first
    fits.answers[("motor+rolling", "as given")] = fit(total, "rolling", "motor")

    def make(base, fitted, _):
        keys = frozenset(t.effect.key for t in fitted.variant.terms)
        return otherwise and base.anew.setdefault(keys, {}) is not None

    monkeypatch.setattr(columns_anew, "make", make)
    monkeypatch.setattr(hypotheses, "singles", lambda *_: [ONE])
    gap = SimpleNamespace(exists=False)
    monkeypatch.setattr(fits_of_hypotheses, "gap_after", lambda *_: gap)
    monkeypatch.setattr(fits_of_hypotheses, "near_fit", lambda *_: None)
    monkeypatch.setattr(shortlist, "_commonest", lambda _, options: options[0])
    monkeypatch.setattr(forward_selection, "promising", lambda *_: [])
    monkeypatch.setattr(
        forward_selection, "everywhere", lambda _, best: [BOTH] if best.hypothesis is ONE else []
    )
    monkeypatch.setattr(
        forward_selection, "is_worth", lambda _, one, more: one.price - more.price > 50.0
    )
    monkeypatch.setattr(alternatives, "or_whole_beside", lambda _, here: here)
    monkeypatch.setattr(Fits, "anew", lambda _, tried: tried.fitted)
    believe(monkeypatch, lambda _: True)
    looking = searching()
    looking.base.starts = ()
    best, _ = forward_selection.grown(looking)
    assert best.hypothesis is (BOTH if both else ONE)


@pytest.mark.parametrize(("score", "there"), [(480.0, True), (-np.inf, False)])
def test_what_every_chair_has_is_tried_beside_where_the_runs_show_it(score, there):
    """Whatever linear algebra promises of it, and by the first of its forms."""
    first, other = effect("scrub"), effect("scrub")
    for start, everywhere in ((ROLLING, False), (first, True), (other, True)):
        start.effect.everywhere = everywhere
    looking = SimpleNamespace(
        base=SimpleNamespace(starts=[ROLLING, first, other]),
        weigh=lambda starts: Hypothesis(tuple(starts), gain=500.0, score=score),
    )
    found = shortlist.everywhere(looking, Tried(ONE, fit(1110.0, "rolling")))
    assert [h.starts for h in found] == ([(ROLLING, first)] if there else [])


@pytest.mark.parametrize("total", [1005.0, 1490.0])
def test_beyond_a_pair_that_ends_on_a_bound_one_more_is_tried(fits, monkeypatch, total):
    """A gain of the rims pushed the mass that moves to its bound; without a bound none is tried."""
    third = Tried(
        Hypothesis((ROLLING, MOTOR, WIND), gain=950.0, score=920.0),
        fit(total, "rolling", "motor", "wind"),
    )
    fits.answers[("rolling", "as given")] = fit(1500.0, "rolling")
    fits.answers[("rolling", "track of rolling")] = fit(1500.0, "rolling")
    fits.answers[("motor+rolling", "as given")] = fit(1110.0, "rolling", "motor")
    left = SimpleNamespace(exists=False)
    monkeypatch.setattr(forward_selection, "beside", lambda *_: (third, left))
    monkeypatch.setattr(forward_selection, "is_worth", lambda _, a, b: b.price < a.price)
    looking = searching()
    here = (looking.fit(ONE), SimpleNamespace(exists=True))
    pair = looking.fit(BOTH)
    assert forward_selection.beyond_bound(looking, here, 2) is None
    pair.fitted.at_bound = ("mass",)
    assert (forward_selection.beyond_bound(looking, here, 2) == (third, left)) == (total < 1400.0)
    assert forward_selection.beyond_bound(looking, here, 3) is None


@pytest.mark.parametrize(("worse", "stays"), [(60.0, True), (200.0, False)])
def test_a_rival_of_one_effect_is_weighed_against_what_that_effect_brings(
    worse, stays, monkeypatch
):
    """The motor brings 4000 beside a rolling resistance that brings 60 000."""
    scrub = effect("scrub")
    gains = {("rolling",): 60_000.0, ("motor",): 5_000.0, ("motor", "rolling"): 64_000.0}
    other = Hypothesis((ROLLING, scrub), gain=64_000.0 - worse, score=63_990.0 - worse)
    looking = searching()
    looking.base.plain.total = 65_000.0
    looking.weigh = lambda starts: Hypothesis(
        tuple(starts), gains[tuple(sorted(s.effect.key for s in starts))], 0.0
    )
    looking.near_to = lambda tried: mock.patch.object(looking, "near", looking)
    near = {}
    of_all = np.resize([4.0, -4.0], 4)
    bare = {"at_bound": (), "variant": Variant(()), "track": Named("alike")}
    ours = SimpleNamespace(confined=0.0, total=1_000.0, chi2=np.full(4, 250.0), **bare)
    theirs = SimpleNamespace(
        confined=0.0, total=1_000.0 + worse, chi2=250.0 + worse / 4.0 + of_all, **bare
    )
    both = Hypothesis((ROLLING, MOTOR), gain=64_000.0, score=63_990.0)

    def with_one_more(at, others, but):
        (key,) = but
        near[key] = at.near is not None
        return [other] if key == "motor" else []

    monkeypatch.setattr(rivals, "with_one_more", with_one_more)
    looking.fit = lambda hypothesis, best=None: Tried(hypothesis, theirs)
    chosen = Tried(both, ours)
    assert rivals.own_gains(looking, chosen)[1] == 4_000.0
    assert [len(group) for group in rivals.rivals_of(looking, chosen)] == [0, int(stays)]
    assert near == {"rolling": False, "motor": True}  # around the fit: of the one that brings less


@pytest.mark.parametrize("overstated", [0.0, 900.0])
def test_the_best_replacement_of_a_lone_effect_is_fitted(overstated, monkeypatch):
    """A payload missed 5 % by linear algebra, and fitted better; no rival was fitted.

    Around a chair that is 900 from its own fit linear algebra is worth nothing, around a fit it is.
    """
    looking = searching()
    looking.base.plain.total = 2_000.0
    looking.base.reduced.total = 2_000.0 + overstated
    chosen = Hypothesis((ROLLING,), gain=1_000.0, score=990.0)
    other = Hypothesis((effect("payload"),), gain=800.0, score=790.0)
    looking.weigh = lambda starts: chosen
    looking.near_to = lambda tried: mock.patch.object(looking, "near", looking)
    near = []

    def with_one_more(at, others, but):
        near.append(at.near is not None)
        return [other]

    monkeypatch.setattr(rivals, "with_one_more", with_one_more)
    fit = {"at_bound": (), "variant": Variant(()), "chi2": np.full(4, 250.0)}
    fit["track"] = Named("alike")
    looking.fit = lambda hypothesis, best=None: Tried(
        hypothesis, SimpleNamespace(confined=0.0, total=995.0, **fit)
    )
    (group,) = rivals.rivals_of(
        looking, Tried(chosen, SimpleNamespace(confined=0.0, total=1_000.0, **fit))
    )
    assert [t.hypothesis for t in group] == [other]
    assert near == [overstated > 0.0]


@pytest.mark.parametrize(("sigmas", "there"), [(1.8, False), (12.0, True)])
def test_a_wind_that_ends_nearly_still_is_no_wind(sigmas, there):
    """It has a drag area, which then stands for the drag of the air; a drag has no such number."""
    blows = Term(wind.EFFECT, wind.EFFECT.neutral(), ("x", "y", "drag_area"))
    still = Term(air_drag.EFFECT, air_drag.EFFECT.neutral(), ("drag_area",))
    for term, expected in ((blows, there), (still, True)):
        ended = SimpleNamespace(
            variant=Variant((), terms=(term,)), sigmas={term.effect.key: sigmas}, at_least={}
        )
        assert choice.is_there(ended) is expected


@pytest.mark.parametrize(
    ("total", "promised", "afar"),
    [
        (1400.0, 1395.0, False),  # it gets to what it promises
        (1400.0, 1300.0, False),  # stuck, and clearly better than the part
        (1490.0, 1300.0, True),  # stuck where the part was
        (2100.0, 2100.0, True),  # worse than nothing
    ],
)
def test_a_fit_begins_from_afar_only_where_the_near_one_is_stuck(
    monkeypatch, total, promised, afar
):
    begun = []

    def begin(self, share):
        begun.append(self.near)
        return fit(total, promised=promised) if self.near else fit(1200.0)

    monkeypatch.setattr(multistart.MultiStart, "_begun", begin)
    monkeypatch.setattr(multistart.MultiStart, "_followed", lambda _, fitted: fitted)
    starts = multistart.MultiStart(
        base=searching().base, hypothesis=BOTH, near="near", part=fit(1500.0), best=None,
        behind=0.0, note=print,
    )  # fmt: skip
    assert starts.fit().total == (1200.0 if afar else total)
    assert begun == (["near", None] if afar else ["near"])


@pytest.mark.parametrize(("second", "followed"), [(1300.05, 1), (1290.0, 2)])
def test_a_second_start_that_ends_where_the_first_did_is_not_followed(
    monkeypatch, second, followed
):
    ends = {1.0: fit(1300.0, "rolling"), 0.5: fit(second, "rolling")}
    seen = []
    kind = multistart.MultiStart
    monkeypatch.setattr(kind, "_begun", lambda _, share: ends[share])
    monkeypatch.setattr(kind, "_best_share", lambda _: 0.5)
    monkeypatch.setattr(kind, "_followed", lambda _, fitted: seen.append(fitted) or fitted)
    one = Hypothesis((ROLLING,), gain=900.0, score=890.0)
    starts = multistart.MultiStart(
        base=searching().base, hypothesis=one, near=None, part=None, best=None, behind=0.0,
        note=print,
    )  # fmt: skip
    assert starts.fit().total == min(1300.0, 1300.0 if followed == 1 else second)
    assert len(seen) == followed


def test_what_was_fitted_while_the_noise_was_sought_begins_where_it_ended(fits):
    looking = searching()
    ended = fit(1200.0, "rolling")
    ended.variant = replace(ended.variant, offsets={"mass": 0.4})
    looking.base.best = Found((ROLLING,), ended)
    fits.answers["rolling", "track of rolling"] = fit(1190.0, "rolling")
    assert looking.fit(ONE).fitted.total == 1190.0
    assert fits.asked == [("rolling", "track of rolling")]


def test_the_gap_that_a_fit_leaves_is_sought_once(monkeypatch):
    looking, asked = searching(), []
    monkeypatch.setattr(
        fits_of_hypotheses, "gap_after", lambda _, fitted: asked.append(fitted) or len(asked)
    )
    one, other = fit(1200.0, "rolling"), fit(1200.0, "rolling")
    assert [looking.gap_after(f) for f in (one, other, one)] == [1, 2, 1]


@pytest.mark.parametrize(("share", "moved"), [(1.0, 1.0), (0.5, 0.55)])
def test_a_fit_begins_with_what_is_roughly_known_where_its_effects_leave_it(share, moved):
    """Beside the drag a mass at 0.1 belongs at 1; of a drag at its bound that is not known."""
    rng = np.random.default_rng(5)
    drag, mass = linear_system.start("air_drag"), RoughlyKnown("mass")
    (area,) = drag.effect.fitted
    drag = replace(drag, combine=lambda c: {"drag_area": min(area.change * c[0], area.high)})
    J = 50.0 * rng.standard_normal((80, 2))
    r = J @ np.array([0.9, 0.25 / area.change])
    algebra = linear_system.system([mass, *drag.columns], J, r)
    algebra = replace(algebra, nuisance=1, back=np.array([0.1]))
    known = (Nuisance("mass", 1.0, "", edit=lambda spec, by: None),)
    around = SimpleNamespace(variant=Variant(known, offsets={"mass": 0.1}))
    base = SimpleNamespace(around=around, system=algebra)
    small = bounded.reduce(algebra, [0])
    hypothesis = hypotheses.weigh(small, [drag])
    begun = screening.starting_variant(base, small, hypothesis, share)
    assert begun.terms[0].values["drag_area"] == pytest.approx(share * 0.25, rel=1e-2)
    assert begun.offsets["mass"] == pytest.approx(moved, rel=1e-2)
    huge = bounded.reduce(replace(algebra, b=1000.0 * algebra.b), [0])
    begun = screening.starting_variant(base, huge, hypothesis, share)
    assert begun.terms[0].values["drag_area"] == area.high
    assert begun.offsets == {"mass": 0.1}


@pytest.mark.parametrize(
    ("name", "free", "counted"),
    [
        ("turning_scrub", ("moment", "rate"), 1),
        ("caster_friction", ("moment", "slope"), 1),
        ("surface_patch", ("x", "y", "radius", "coefficient"), 4),  # a place is looked for
        ("wind", ("x", "drag_area"), 2),  # at several drag areas
        ("toe", ("symmetric", "asymmetric"), 2),
    ],
)
def test_what_only_shapes_an_effect_is_no_further_number(name, free, counted):
    """A scrub that a single turn shows came behind two unequal wheels once its rate was free."""
    one = SimpleNamespace(effect=find(name), free=free, columns=free)
    weighed = hypotheses.priced([one], 900.0)
    assert weighed.free == counted
    assert weighed.score - weighed.prior == pytest.approx(900.0 - search_rules.PENALTY * counted)


def test_what_data_do_not_tell_of_a_shape_is_known_to_its_bounds():
    term = Term(find("turning_scrub"), {"moment": 2.0, "rate": 0.05}, ("moment", "rate"))
    (moment, _), (rate, p) = term.parameters
    told = SimpleNamespace(variant=Variant((), terms=(term,)), std={moment: 0.2, rate: 2.6e8})
    with mock.patch.object(fits_of_hypotheses, "replace", put):
        std = fits_of_hypotheses.with_form_errors(told).std
    assert std[rate] == p.high - p.low
    assert std[moment] == pytest.approx(np.hypot(0.2, 2.0 * search_rules.SIZE_BY_FORM))


def test_no_size_is_known_less_than_to_its_bounds():
    """A caster that was held fast had 6.3 +- 3e9 N m."""
    term = Term(find("caster_friction"), {"moment": 6.3, "slope": 2.0}, ("moment",))
    ((moment, p),) = term.parameters
    told = SimpleNamespace(variant=Variant((), terms=(term,)), std={moment: 3e9})
    with mock.patch.object(fits_of_hypotheses, "replace", put):
        assert fits_of_hypotheses.with_form_errors(told).std[moment] == p.high - p.low


@pytest.mark.parametrize("at_bound", [False, True])
def test_a_size_that_is_open_upwards_need_not_be_known(at_bound):
    """No standard error tells by how much a caster is held that never turned."""
    term = Term(find("caster_friction"), {"moment": 6.3, "slope": 2.0}, ("moment", "slope"))
    (moment, _), (slope, _) = term.parameters
    held = SimpleNamespace(
        variant=Variant((), terms=(term,)),
        sigmas={"caster_friction": 0.1},
        std={moment: 8.0, slope: 0.1},
        at_bound=(moment,) if at_bound else (),
        at_least={},
    )
    assert not fits_of_hypotheses.believable(held)
    held.at_least[moment] = 0.24
    assert fits_of_hypotheses.believable(held)


def test_ends_are_alike_within_a_tenth_of_a_standard_error():
    term = Term(air_drag.EFFECT, {"drag_area": 0.5}, ("drag_area",))
    ((key, _),) = term.parameters

    def end(size, moved=0.0):
        variant = Variant((), offsets={"mass": moved}, terms=(replace(term, values=size),))
        return SimpleNamespace(total=1000.0, variant=variant, std={key: 0.1})

    one = end({"drag_area": 0.5})
    assert multistart._end_alike(one, end({"drag_area": 0.509}))
    assert not multistart._end_alike(one, end({"drag_area": 0.511}))
    assert not multistart._end_alike(one, end({"drag_area": 0.5}, moved=0.11))


@pytest.mark.parametrize(
    ("first_leaves", "total", "leaves", "taken"),
    [
        (True, 1040.0, False, True),
        (True, 1040.0, True, False),  # no better
        (True, 1020.0, True, True),  # it is better, and a further effect may follow
        (True, 1060.0, False, False),  # its parameters bring too little
        (False, 900.0, False, False),  # the first is enough
    ],
)
def test_another_form_of_an_effect_stands_in_where_the_first_leaves_a_gap(
    first_leaves, total, leaves, taken
):
    wave, whole = (
        SimpleNamespace(
            effect=SimpleNamespace(key="motion", common=1.0, fitted=()),
            free=tuple("abcdef"[:count]),
            columns=tuple("abcdef"[:count]),
        )
        for count in (2, 6)
    )
    priced = {id(s): hypotheses.priced([s], gain=900.0) for s in (wave, whole, WIND)}
    gaps = {1080.0: first_leaves, total: leaves}
    asked = []

    def believed(hypothesis, _best):
        asked.append(hypothesis.starts)
        return Tried(hypothesis, fit(total, "motion"))

    fits = SimpleNamespace(
        base=SimpleNamespace(starts=[WIND, wave, whole]),
        weigh=lambda starts: priced[id(starts[0])],
        is_physical=lambda _: True,
        believed=believed,
        anew=lambda tried: tried.fitted,
        gap_after=lambda fitted: SimpleNamespace(exists=gaps[fitted.total]),
    )
    here = Tried(priced[id(wave)], fit(1080.0, "motion")), SimpleNamespace(exists=first_leaves)
    best, gap = alternatives.or_other_form(fits, here)
    assert best.hypothesis.starts == ((whole,) if taken else (wave,))
    assert gap.exists == gaps[best.fitted.total]
    assert asked == ([(whole,)] if first_leaves else [])


@pytest.mark.parametrize(
    ("several", "total", "promised", "fitted", "taken"),
    [
        (True, 1030.0, 880.0, True, True),
        (True, 1045.0, 880.0, True, False),  # its parameters bring too little
        (True, 1030.0, 700.0, False, False),  # linear algebra has it far behind
        (False, 1030.0, 880.0, False, False),  # of a single effect this was asked before
    ],
)
def test_a_wrong_form_of_one_of_several_effects_gives_way(several, total, promised, fitted, taken):
    """One caster that sticks, with a late angle of the other, was named for two that stick."""
    one, both = (
        SimpleNamespace(
            effect=SimpleNamespace(key="caster_friction", common=1.0, fitted=()),
            free=(name,),
            columns=(name,),
        )
        for name in ("right", "moment")
    )
    chosen = (one, WIND) if several else (one,)
    priced = {id(one): hypotheses.priced(chosen, gain=900.0)}
    priced[id(both)] = hypotheses.priced([both if s is one else s for s in chosen], gain=promised)
    asked = []

    def made(hypothesis, _best):
        asked.append(hypothesis.starts)
        return Tried(hypothesis, fit(total, "caster_friction", "wind"))

    fits = SimpleNamespace(
        base=SimpleNamespace(starts=[WIND, one, both]),
        weigh=lambda starts: priced[id(starts[0])],
        is_physical=lambda _: True,
        fit=made,
    )
    best = Tried(priced[id(one)], fit(1040.0, "caster_friction", "wind"))
    formed = alternatives.or_other_form_beside(fits, best)
    assert formed.hypothesis.starts[0] is (both if taken else one)
    assert asked == ([(both, WIND)] if fitted else [])


@pytest.mark.parametrize(
    ("name", "promised", "best", "several", "looked"),
    [
        ("wind", 1017.0, 1200.0, True, True),  # it misses 5 % of what both bring
        ("wind", 900.0, 1017.0, True, False),
        ("wind", 900.0, 940.0, True, True),  # the best single effect brings about as much
        ("wind", 1017.0, 1017.0, False, False),  # a rival of one effect is fitted as such
        ("floor_slope", 1017.0, 1017.0, True, False),  # it is one of them
    ],
)
def test_a_single_effect_just_behind_several_or_the_best_one_is_fitted(
    name, promised, best, several, looked
):
    """A wind of 3.6 m/s stood in no set: a slope with a bearing's friction was chosen."""
    keys = ("floor_slope", "bearing_friction")[: 2 if several else 1]
    chosen = SimpleNamespace(keys=keys, starts=keys, gain=1069.0)
    single = SimpleNamespace(name=name, gain=promised, score=promised - 10.0)
    first = SimpleNamespace(name="torque_gain", gain=best, score=best - 10.0)
    choice = SimpleNamespace(hypothesis=chosen)
    assert probable._may_be_better(single, [first, single], choice) is looked


@pytest.mark.parametrize(
    ("brings", "grown_from"),
    [
        (1900.0, True),  # 5 % behind the patch alone
        (1500.0, False),
    ],
)
def test_an_effect_of_a_whole_size_a_little_behind_is_grown_from_too(
    monkeypatch, brings, grown_from
):
    """A patch of the floor stood for wheels that shimmied and were toed, and nothing was named."""
    shimmy = hypothesis_of("relaxation_length", whole=True)
    best = Tried(hypothesis_of("surface_patch"), SimpleNamespace(confined=0.0, total=0.0))
    other = Tried(hypothesis_of("toe"), SimpleNamespace(confined=0.0, total=50.0))
    whole = Tried(shimmy, SimpleNamespace(confined=0.0, total=2000.0 - brings))
    looking = SimpleNamespace(base=None, tried=[best, other, whole])
    monkeypatch.setattr(forward_selection, "gain", lambda _, fitted: 2000.0 - fitted.total)
    asked = []
    monkeypatch.setattr(forward_selection, "beside", lambda _, tried: asked.append(tried))
    monkeypatch.setattr(left_over, "of_size", lambda *_: None)
    monkeypatch.setattr(forward_selection, "of_size", lambda *_: [])
    looking.near = None
    assert forward_selection.further(looking, best, 2) is None
    assert asked == ([best, whole] if grown_from else [best])


def hypothesis_of(name, whole=False):
    """A single effect, with a size that small changes lead to, or with whole sizes."""
    effect = SimpleNamespace(key=name, fitted=[SimpleNamespace(whole=(1.0,) if whole else ())])
    return SimpleNamespace(keys=(name,), starts=[SimpleNamespace(effect=effect)])


def test_what_is_fitted_beside_several_effects_is_held_against_the_best_of_as_many(monkeypatch):
    """Beside two effects that were well fitted no single one seemed worth a second start."""
    tried = [
        Tried(hypothesis_of("toe"), SimpleNamespace(confined=0.0, total=1050.0)),
        Tried(hypothesis_of("torque_gain"), SimpleNamespace(confined=0.0, total=1040.0)),
    ]
    asked = []
    looking = SimpleNamespace(tried=tried, fit=lambda _, best: asked.append(best))
    pair = SimpleNamespace(starts=(1, 2))
    single = hypothesis_of("mass_offset")
    monkeypatch.setattr(probable, "_not_yet_fitted", lambda *_: [single, pair])
    monkeypatch.setattr(probable, "better_of", lambda *_: None)
    fitted = SimpleNamespace(confined=0.0, total=1000.0)
    several = Choice(hypothesis=pair, fitted=fitted, after=None, rivals=[], own_gains=[])
    probable.better_than(looking, several)
    assert asked == [tried[1], Tried(pair, several.fitted)]


@pytest.mark.parametrize(("after", "spoken_against"), [(490.0, True), (60.0, False)])
def test_an_effect_that_held_out_trials_speak_against_may_be_nothing(
    after, spoken_against, monkeypatch
):
    """Beside casters that shimmied, torques 8 and 12 % larger than told were named."""
    drive, shimmy = (SimpleNamespace(effect=SimpleNamespace(key=k)) for k in ("drive", "shimmy"))
    both, alone = (Hypothesis(s, 0.0, 0.0) for s in ((shimmy, drive), (shimmy,)))
    bare = SimpleNamespace(total=900.0, confined=0.0)
    fewer = Tried(alone, bare)
    known = Tried(Hypothesis((drive,), 0.0, 0.0), bare)
    choice = Choice(
        hypothesis=both, fitted="both", after=None, rivals=[[], [known]], own_gains=[1.0, 1.0],
        tried=[fewer, Tried(both, bare)],
    )  # fmt: skip
    held = rules.HeldOut(before=500.0, after=after, dof=50.0, changed=400.0)
    asked = []
    monkeypatch.setattr(left_out, "on_held_out", lambda *a: asked.append(a[1:]) or held)
    monkeypatch.setattr(Hypothesis, "penalty", 0.0)
    found = rivals.with_spoken_against("base", choice)
    assert asked == [("both", bare)]  # without the shimmy nothing was fitted
    assert found.rivals == [[], [known, fewer] if spoken_against else [known]]
    twice = rivals.with_spoken_against("base", replace(choice, others=[fewer]))
    assert twice.rivals == [[], [known]]  # it is a rival already
