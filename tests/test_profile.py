"""A fit that is stuck goes along its valley, and says how steep the sides are.

In: chi2 of two sizes, told instead of simulated, and a fit that stops where it began. Out: where
`followed` ends, and its standard errors.
"""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from mjchair.diagnosis.explain import multistart, profile
from mjchair.diagnosis.explain.fits import with_form_errors
from mjchair.diagnosis.fit import bounded
from mjchair.diagnosis.fit.column_ids import ParameterId, RoughlyKnown
from mjchair.diagnosis.fit.nonlinear import Fitted
from mjchair.diagnosis.fit.variant import Term, Variant
from mjchair.effects.library import find
from mjchair.errors import MjchairError

WIND = find("wind")
NAMES = ("x", "y")
TRUTH = np.array([0.5, 0.0])
# chi2 is long and narrow: two speeds that grow together change little
ALONG, ACROSS = np.array([1.0, 0.7]), np.array([-0.7, 1.0])
BASE = SimpleNamespace(bench=None, nuisances={})


def chi2(sizes):
    away = np.asarray(sizes) - TRUTH
    return 3000.0 + (away @ ALONG / 0.06) ** 2 + (away @ ACROSS / 0.01) ** 2


def told(sizes, free, promised):
    values = dict(zip(NAMES, map(float, sizes), strict=True))
    return Fitted(
        variant=Variant((), terms=(Term(WIND, values, free),)),
        track=None,
        columns={},
        system=None,
        step=np.zeros(0),
        chi2=np.zeros(0),
        total=float(chi2(sizes)),
        promised=promised,
        std={ParameterId("wind", name): 0.01 for name in free},
        sigmas={"wind": 40.0},
        at_bound=(),
    )


@pytest.fixture
def stuck(monkeypatch):
    """With both sizes free a fit stays where it began; with one held the other is fitted."""

    def refit(bench, start, before, nuisances=None, reach=np.inf):
        (term,) = start.terms
        sizes = np.array([term.values[name] for name in NAMES])
        if len(term.free) == 1:
            k = NAMES.index(term.free[0])
            tries = np.linspace(-1.0, 1.5, 25001)
            both = np.repeat(sizes[None], tries.size, axis=0)
            both[:, k] = tries
            sizes = both[np.argmin([chi2(row) for row in both])]
        total = chi2(sizes)
        return told(sizes, term.free, promised=min(total, 3000.0))

    monkeypatch.setattr(multistart, "refit", refit)
    monkeypatch.setattr(profile, "from_other_side", lambda _, fitted: fitted.std)


def valley(at):
    """The place in the valley's middle, `at` along it from the truth."""
    return TRUTH + at * ALONG / np.hypot(*ALONG)


def test_a_stuck_fit_goes_along_the_valley_and_its_errors_cover(stuck):
    begun = told(valley(-0.3), NAMES, promised=3000.0)
    assert begun.total > 3030.0
    end = profile.followed(BASE, begun)
    assert end.total < 3015.0
    assert end.variant.terms[0].free == NAMES
    for name, truth in zip(NAMES, TRUTH, strict=True):
        away = abs(end.variant.terms[0].values[name] - truth)
        assert away < 3.0 * end.std[ParameterId("wind", name)]
        assert end.std[ParameterId("wind", name)] > 0.02
    assert end.sigmas["wind"] < 40.0


def test_a_fit_that_is_not_stuck_is_left_as_it_is(stuck):
    begun = told(valley(-0.3), NAMES, promised=chi2(valley(-0.3)) - 5.0)
    assert profile.followed(BASE, begun) is begun


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_of_sizes_that_make_up_for_one_another_chi2_tells_the_errors(stuck, sign):
    """Fits of one wind from four starts ended within 2 of chi2 and 4 standard errors apart."""
    begun = told(TRUTH, NAMES, promised=chi2(TRUTH))
    pair = frozenset(ParameterId("wind", name) for name in NAMES)
    loosely = replace(begun, correlation={pair: 0.8 * sign})
    assert profile.followed(BASE, loosely) is loosely
    end = profile.followed(BASE, replace(begun, correlation={pair: 0.97 * sign}))
    for key in pair:
        assert end.std[key] == pytest.approx(3.0 * begun.std[key], rel=0.1)  # chi2 hardly rises
    assert end.sigmas["wind"] == pytest.approx(begun.sigmas["wind"] / 3.0, rel=0.1)


@pytest.mark.parametrize(("ratio", "asked"), [(0.5, True), (1.2, False), (2.0, True)])
def test_where_two_sides_say_different_errors_chi2_tells_them(stuck, monkeypatch, ratio, asked):
    """A column that is taken across a jump told a camber eight times as well as it was known."""
    x, y = (ParameterId("wind", name) for name in NAMES)
    begun = told(TRUTH, NAMES, promised=chi2(TRUTH))
    other = {x: ratio * begun.std[x], y: begun.std[y]}
    monkeypatch.setattr(profile, "from_other_side", lambda *_: other)
    end = profile.followed(BASE, begun)
    if not asked:
        assert end is begun
        return
    away = profile.AWAY * max(other[x], begun.std[x])
    best = min(chi2(np.add(TRUTH, (away, b))) for b in np.linspace(-0.1, 0.1, 2001)) - chi2(TRUTH)
    assert end.std[x] == pytest.approx(away / math.sqrt(max(best, 1.0)), rel=0.01)
    assert end.std[y] == begun.std[y]
    assert end.sigmas["wind"] == pytest.approx(40.0 * begun.std[x] / end.std[x])


@pytest.mark.parametrize("together", [0.0, 0.5, -0.9])
def test_two_sides_make_up_for_one_another_as_their_mean_and_difference_do(together):
    """The radius of both wheels is roughly known: left and right correlate by 0.9995."""
    mean, difference = 1.5, 0.02  # mm
    shared = together * mean * difference
    left, right = (math.sqrt(mean**2 + difference**2 + s * 2.0 * shared) for s in (1.0, -1.0))
    r = (mean**2 - difference**2) / (left * right)
    pair = tuple(ParameterId("wheel_radius", side) for side in ("left", "right"))
    fitted = replace(
        told(TRUTH, NAMES, 3000.0),
        std=dict(zip(pair, (left, right), strict=True)),
        correlation={frozenset(pair): r},
    )
    assert r > 0.999
    assert abs(profile._together(fitted, frozenset(pair))) == pytest.approx(abs(together), abs=1e-6)
    assert profile._make_up(fitted) == (set(pair) if abs(together) > profile.MAKES_UP else set())


def test_a_number_that_is_no_size_is_known_no_better_than_what_makes_up_for_it():
    wind = find("wind")
    x, area = (ParameterId("wind", name) for name in ("x", "drag_area"))
    fitted = replace(
        told(TRUTH, NAMES, 3000.0),
        variant=Variant((), terms=(Term(wind, wind.neutral(), ("x", "drag_area")),)),
        std={x: 0.2, area: 0.05},
        sigmas={"wind": 20.0},
        correlation={frozenset((x, area)): -0.9},
    )
    held = replace(fitted, total=fitted.total + 4.0)
    seen = [profile.Held(x, 1.0, wind.neutral()["x"] + 1.0, held)]  # 1 m/s costs 4 of chi2
    end = profile._with_errors(fitted, fitted, seen)
    assert end.std == pytest.approx({x: 0.5, area: 0.05 * 0.9 * 2.5})


@pytest.mark.parametrize(
    ("size", "lost", "sigmas"),
    [
        (0.25, 81.0, 9.0),  # half of it is ruled out by 9 standard errors
        (0.25, 4.0, 5.0),
        (-0.1, 81.0, 5.0),  # beyond no effect: that says nothing of less of it
        (0.7, 81.0, 5.0),
        (0.25, 1e4, 40.0),  # no more than was said before
    ],
)
def test_an_effect_is_as_certain_as_less_of_it_loses(size, lost, sigmas):
    """A load is 17 to 27 kg: 2 standard errors from none, and 9 kg lost 56 of chi2."""
    fitted = told(TRUTH, NAMES, 3000.0)
    x = ParameterId("wind", "x")
    wider = profile._widened(fitted, {key: 8.0 * std for key, std in fitted.std.items()})
    assert wider.sigmas["wind"] == 5.0
    seen = [profile.Held(x, -1.0, size, replace(fitted, total=fitted.total + lost))]
    assert profile._as_lost(wider, fitted, seen).sigmas["wind"] == pytest.approx(sigmas)


def as_load(fitted, of_mass=0.0):
    """The fit as one of a load: y is no size, as its height, and a mass stands in for x.

    By `of_mass` x is other where the mass is a standard deviation off.
    """
    shape = replace(WIND.parameter("y"), sized=False)
    parameters = tuple(shape if p.name == "y" else p for p in WIND.parameters)
    load = replace(WIND, instead=("mass",), parameters=parameters)
    (term,) = fitted.variant.terms
    variant = replace(fitted.variant, terms=(replace(term, effect=load),))
    places = {ParameterId("wind", "x"): 0, RoughlyKnown("mass"): 1}
    by = of_mass / WIND.parameter("x").change  # columns are of sizes worth finding
    system = SimpleNamespace(places=places, by=by)
    return replace(fitted, variant=variant, system=system)


@pytest.fixture
def covariance(monkeypatch):
    """Of x and of the mass, which is known to half of what it was known to beforehand."""
    monkeypatch.setattr(
        bounded,
        "covariance",
        lambda system, _: np.array([[1.0, -0.25 * system.by], [-0.25 * system.by, 0.25]]),
    )


WINDOWS = SimpleNamespace(bench=SimpleNamespace(windows=[0]), nuisances={})


def test_all_numbers_of_a_load_are_asked_since_a_mass_stands_in_for_it(
    stuck, covariance, monkeypatch
):
    """Chi2 between them was flat, and columns told the load to 1.2 kg: 16 kg of 25."""
    begun = told(TRUTH, NAMES, promised=chi2(TRUTH))
    assert profile.followed(BASE, begun) is begun
    monkeypatch.setattr(profile, "_freed", lambda *_: None)
    held = []
    one = profile._held
    monkeypatch.setattr(profile, "_held", lambda *a: held.append(a[2].parameter) or one(*a))
    profile.followed(WINDOWS, as_load(begun))
    assert sorted(held) == ["x", "x", "y", "y"]


@pytest.mark.parametrize(("of_mass", "away"), [(0.2, 0.2), (0.01, 3.0 * 0.01)])
def test_a_load_is_held_as_far_off_as_the_mass_that_stands_in_may_be(
    stuck, covariance, monkeypatch, of_mass, away
):
    """By columns a load was 46.4 +- 0.8 kg; 40 kg fit better, with the mass 8 % higher."""
    begun, asked = as_load(told(TRUTH, NAMES, promised=3000.0), of_mass), []
    fit = profile.made_anew

    def made(bench, start, before, columns=None):
        asked.append((start.terms[0].values["x"], columns))
        return fit(bench, start, before, columns)

    monkeypatch.setattr(profile, "made_anew", made)
    x = ParameterId("wind", "x")
    for side in (-1.0, 1.0):
        found = profile._held(WINDOWS, begun, x, side, profile.AWAY)
        assert found.size == asked[-1][0] == pytest.approx(TRUTH[0] + side * away)
        assert (asked[-1][1] is None) == (away > 0.1)  # all columns are made there
    farther = profile._held(WINDOWS, begun, x, -1.0, 2.0 * profile.AWAY)
    assert farther.size == pytest.approx(TRUTH[0] - 2.0 * away)
    # a mass that was told exactly is no column, and stands in for nothing
    del begun.system.places[RoughlyKnown("mass")]
    assert profile._held(WINDOWS, begun, x, 1.0, 3.0).size == pytest.approx(TRUTH[0] + 0.03)


def test_what_only_shapes_an_effect_does_not_say_whether_it_is_there():
    """A load of 24.3 +- 4.6 kg stood at 3.9 sigma, because its height became less well known."""
    load = as_load(told(TRUTH, NAMES, 3000.0))
    x, y = (ParameterId("wind", name) for name in NAMES)
    assert profile._widened(load, {x: 0.01, y: 0.1}).sigmas == load.sigmas
    assert profile._widened(load, {x: 0.1, y: 0.01}).sigmas == {"wind": pytest.approx(4.0)}


def test_a_valley_that_is_flat_is_followed(stuck):
    """Where a size far away fits alike, columns that are made there may show a way down."""
    begun = told(TRUTH, NAMES, promised=chi2(TRUTH))
    freed = []
    one = profile._freed
    pair = frozenset(ParameterId("wind", name) for name in NAMES)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(profile, "_freed", lambda *a: freed.append(a) or one(*a))
        profile.followed(BASE, replace(begun, correlation={pair: 0.97}))
    assert freed


def test_where_no_chair_is_beside_it_a_fit_stays(monkeypatch):
    def never(*_, **__):
        raise MjchairError("no chair")

    monkeypatch.setattr(multistart, "refit", never)
    monkeypatch.setattr(profile, "from_other_side", never)
    begun = told(valley(-0.3), NAMES, promised=3000.0)
    end = profile.followed(BASE, begun)
    assert end.total == begun.total and end.std == begun.std


@pytest.mark.parametrize(
    ("name", "value", "own", "least"),
    [
        ("wheel_radius", 0.0022, 1e-5, 2.2e-5),  # 220 standard errors are more than a form tells
        ("wheel_radius", 0.0022, 3e-4, 3e-4),
        ("tire_friction", 0.26, 3e-4, 7.4e-3),  # the size is how far it is from no effect
    ],
)
def test_no_size_is_told_better_than_the_form_of_its_effect(name, value, own, least):
    effect = find(name)
    p = next(p for p in effect.fitted if p.sized)
    key = ParameterId(effect.key, p.name)
    fitted = told(TRUTH, NAMES, 3000.0)
    term = Term(effect, effect.neutral() | {p.name: value}, (p.name,))
    fitted.variant, fitted.std = Variant((), terms=(term,)), {key: own}
    assert with_form_errors(fitted).std[key] == pytest.approx(math.hypot(own, least), rel=0.3)
    assert with_form_errors(fitted).std[key] >= max(own, 0.99 * least)


def test_what_two_sides_differ_by_is_known_as_their_correlation_says():
    fitted = told((0.5, 0.3), NAMES, 0.0)
    one, other = (ParameterId("wind", name) for name in NAMES)
    assert fitted.std_of_difference(one, other) == 0.0  # it was not looked at
    for correlation, std in ((1.0, 0.0), (0.0, 0.01 * 2.0**0.5), (-1.0, 0.02)):
        near = replace(fitted, correlation={frozenset((one, other)): correlation})
        assert near.std_of_difference(one, other) == pytest.approx(std, abs=1e-12)
