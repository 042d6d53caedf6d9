"""Hypotheses around a fit of several effects, on a linear problem whose answer least squares knows;
and whether what shakes a chair is noise or further effects, by prices that are told."""

from types import SimpleNamespace

import numpy as np
import pytest

from mjchair.diagnosis.explain import further_effects
from mjchair.diagnosis.explain.candidates import Start
from mjchair.diagnosis.explain.column_ids import EffectColumn, EffectGroup
from mjchair.diagnosis.explain.near_fit import NearFit
from mjchair.diagnosis.explain.screening import LOUD, Found
from mjchair.diagnosis.fit.bounded import Sums
from mjchair.diagnosis.fit.column_ids import ParameterId
from mjchair.diagnosis.fit.variant import Term, Variant
from mjchair.effects.effect import Effect, Parameter

ROWS = 60
FITTED = {"one": 2.0, "two": 3.0}  # a fit that is not the best
SIZE = Parameter("size", "N", 1.0, -100.0, 100.0)
PLACE = Parameter("place", "m", 0.5, -1e3, 1e3, sized=False)


def start(name, *parameters):
    effect = Effect(
        name=name,
        parameters=parameters or (SIZE,),
        signature="",
        source="",
        edit=lambda spec, size: None,
    )
    group = EffectGroup(name, 0)
    return Start(
        effect=effect,
        group=group,
        columns=(EffectColumn(group, 0),),
        combine=lambda c: {"size": float(c[0])},
        free=("size",),
    )


@pytest.fixture
def problem():
    """Starts, their columns (ROWS,) by name, what was measured, and the linear algebra."""
    rng = np.random.default_rng(0)
    starts = {name: start(name) for name in ("one", "two", "three")}
    J = {name: rng.standard_normal(ROWS) for name in starts}
    y = 1.0 * J["one"] + 4.0 * J["three"] + 0.1 * rng.standard_normal(ROWS)
    ids = [ParameterId(name, "size") for name in FITTED]
    ids += [s.columns[0] for s in starts.values()]
    columns = np.column_stack([*(J[name] for name in FITTED), *J.values()])
    r = y - sum(size * J[name] for name, size in FITTED.items())
    reduced = Sums(
        columns=ids, count=0, G=columns.T @ columns, b=columns.T @ r, c=float(r @ r),
        back=np.zeros(0), precision=np.zeros(0), wall=np.zeros(0),
    ).plain()  # fmt: skip
    terms = tuple(Term(starts[n].effect, {"size": v}, ("size",)) for n, v in FITTED.items())
    found = Found(
        tuple(starts[n] for n in FITTED), SimpleNamespace(variant=Variant((), terms=terms))
    )
    base = SimpleNamespace(reduced=SimpleNamespace(total=float(y @ y)))
    return starts, J, y, NearFit(base=base, found=found, reduced=reduced)


@pytest.mark.parametrize("names", [("one",), ("one", "two"), ("one", "three"), ("three",)])
def test_a_hypothesis_gains_what_least_squares_gains(problem, names):
    starts, J, y, near = problem
    columns = np.column_stack([J[n] for n in names])
    best, *_ = np.linalg.lstsq(columns, y, rcond=None)
    left = y - columns @ best
    gain = near.weigh([starts[n] for n in names]).gain
    assert gain == pytest.approx(float(y @ y - left @ left), rel=1e-6)


def test_what_is_new_begins_at_its_linear_value_and_the_rest_stays(problem):
    starts, J, y, near = problem
    terms = near.terms([starts["one"], starts["three"]])
    best, *_ = np.linalg.lstsq(np.column_stack([J["one"], J["three"]]), y, rcond=None)
    assert terms[0].values["size"] == FITTED["one"]
    assert terms[1].values["size"] == pytest.approx(best[1], rel=1e-6)


SMALL = SimpleNamespace(effect=SimpleNamespace(fitted=()))


def test_a_place_is_not_set_back_with_what_stands_there():
    """By its column a wind was still at its drag area's neutral value, which made up for it."""
    rng = np.random.default_rng(1)
    one, patch = start("one"), start("patch", SIZE, PLACE)
    J = rng.standard_normal((ROWS, 3))  # of one, of the patch's size and of its place
    values = {"size": 3.0, "place": 40.0}
    r = 0.1 * rng.standard_normal(ROWS)
    ids = [ParameterId("patch", "size"), ParameterId("patch", "place"), one.columns[0]]
    columns = J[:, [1, 2, 0]]
    reduced = Sums(
        columns=ids, count=0, G=columns.T @ columns, b=columns.T @ r, c=float(r @ r),
        back=np.zeros(0), precision=np.zeros(0), wall=np.zeros(0),
    ).plain()  # fmt: skip
    variant = Variant((), terms=(Term(patch.effect, values, ("size", "place")),))
    y = r + values["size"] * J[:, 1]  # without the patch
    near = NearFit(
        base=SimpleNamespace(reduced=SimpleNamespace(total=float(y @ y))),
        found=Found((patch,), SimpleNamespace(variant=variant)),
        reduced=reduced,
    )
    left = y - J[:, 0] * (J[:, 0] @ y) / (J[:, 0] @ J[:, 0])
    assert near.weigh([one]).gain == pytest.approx(y @ y - left @ left)


def explained(count, power, price):
    fitted = SimpleNamespace(variant=None, track=None, columns={})
    return SimpleNamespace(
        starts=(SMALL,) * count, fitted=fitted, bench=SimpleNamespace(power=power), price=price
    )


def put(one, **changes):
    """Like `replace`, of stubs."""
    return SimpleNamespace(**vars(one) | changes)


def begun(monkeypatch, first, power=1.0, windows=()):
    """What the search begins with, where `first` is the best effect; None: with nothing.

    Args:
      power: of what shakes the chair. windows: of the study.
    """
    monkeypatch.setattr(further_effects.noise_shown, "loudness", lambda bench: bench.power)
    monkeypatch.setattr(further_effects, "_first", lambda _: first)
    monkeypatch.setattr(further_effects, "refit", lambda *_: first.fitted)
    monkeypatch.setattr(
        further_effects, "replace", lambda one, found=None, **changes: found or put(one, **changes)
    )
    monkeypatch.setattr(further_effects, "with_noise", lambda base, bench: bench)
    monkeypatch.setattr(further_effects, "Fits", lambda found, _: found)
    simulator = SimpleNamespace(windows=windows)
    bench = SimpleNamespace(power=power, simulator=simulator, windows=range(len(windows)))
    base = SimpleNamespace(bench=bench, nuisances={})
    fits = SimpleNamespace(base=base, say=lambda _: None)
    found = further_effects.without_hidden(fits)
    return None if found is fits else found


@pytest.mark.parametrize(
    ("power", "price", "quieter"),
    [
        (0.2, 90.0, True),  # the effects earn it, and leave far less noise
        (0.2, 110.0, False),  # less noise, but noise is the more probable
        (0.9, 90.0, False),  # more probable, but noise was not what hid them
    ],
)
def test_noise_gives_way_to_effects_that_earn_it(monkeypatch, power, price, quieter):
    one, more = explained(1, 1.0, 100.0), explained(3, power, price)
    monkeypatch.setattr(further_effects.noise_shown, "hushed", lambda bench: bench)
    monkeypatch.setattr(further_effects, "_around", lambda *_: None)
    monkeypatch.setattr(further_effects, "_promising", lambda *_: [(None, None)])
    monkeypatch.setattr(further_effects, "_fitted", lambda *_: more)
    monkeypatch.setattr(further_effects, "_agreed", lambda _, best: best)
    found = begun(monkeypatch, one)
    assert (found is not None) == quieter
    if quieter:
        assert found.starts == more.starts


WHOLE = SimpleNamespace(effect=SimpleNamespace(fitted=(SimpleNamespace(whole=(0.3,)),)))


@pytest.mark.parametrize(
    ("start", "power", "adopted"),
    [
        (SMALL, 0.4, True),  # once it is fitted, what shook the chair is gone
        (SMALL, 0.9, False),  # the search finds it again, with the noise as it was
        (WHOLE, 0.9, True),  # which the search would not find
    ],
)
def test_one_effect_is_what_the_search_begins_with(monkeypatch, start, power, adopted):
    one = explained(1, power, 100.0)
    one.starts = (start,)
    monkeypatch.setattr(further_effects, "_further", lambda *_: None)
    assert (begun(monkeypatch, one) is not None) == adopted


def test_a_chair_that_is_hardly_shaken_is_not_looked_at_again(monkeypatch):
    monkeypatch.setattr(further_effects.noise_shown, "loudness", lambda bench: bench)
    monkeypatch.setattr(further_effects.whole_sizes, "shimmies", lambda _: False)
    fits = SimpleNamespace(base=SimpleNamespace(bench=0.5 * LOUD))
    assert further_effects.without_hidden(fits) is fits


@pytest.mark.parametrize(
    ("shimmying", "apart"),
    [
        ((True, False), True),
        ((True, True), False),  # no window tells the noise without a shimmy
        ((False, False), False),
    ],
)
def test_what_is_left_of_a_shimmy_is_no_noise_of_other_windows(monkeypatch, shimmying, apart):
    """It hid a moment of 3.3 N m against turning beside a relaxation length of 0.09 m."""
    one = explained(1, 0.5 * LOUD, 100.0)
    one.starts = (WHOLE,)
    asked = []

    def noise(base, fitted, own, apart=False):
        asked.append(apart)
        return SimpleNamespace(power=0.5 * LOUD), 0.0

    monkeypatch.setattr(further_effects, "_noise", noise)
    monkeypatch.setattr(further_effects, "_further", lambda *_: None)
    windows = [SimpleNamespace(shimmies=s) for s in shimmying]
    found = begun(monkeypatch, one, 0.5 * LOUD, windows)
    assert (found is not None) == any(shimmying)  # a chair that is hardly shaken
    assert asked == [True] * apart
