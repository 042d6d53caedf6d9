"""The columns of a fit: by how little a parameter is moved for one, and which are rounding."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import mjchair
from mjchair.diagnosis.data import roughly_known
from mjchair.diagnosis.explain import search_rules
from mjchair.diagnosis.fit import nonlinear
from mjchair.diagnosis.fit.column_ids import ParameterId, RoughlyKnown
from mjchair.diagnosis.fit.parameter_columns import shared_columns
from mjchair.diagnosis.fit.system import taken_whole
from mjchair.diagnosis.fit.variant import LEAST, NUDGE, Term, Variant, nudged
from mjchair.effects import library, mass_offset, wheel_radius
from mjchair.errors import MjchairError

LEFT = wheel_radius.EFFECT.parameter("left")  # 3 mm is worth finding, 50 mm the bound


@pytest.mark.parametrize(
    ("at", "std", "by"),
    [
        (0.0, None, NUDGE * 0.003),
        (0.0, 1e-4, 3e-4),  # where a caster lifts off half a millimetre further, this is too near
        (0.0, 1.0, NUDGE * 0.003),
        (0.0, 0.0, LEAST * 0.003),
        (0.05, 1e-4, -3e-4),
    ],
)
def test_a_derivative_is_taken_over_a_few_standard_errors(at, std, by):
    term = Term(wheel_radius.EFFECT, {"left": at, "right": 0.0}, ("left",))
    beside, factor = nudged(Variant((), terms=(term,)), term, LEFT, std)
    assert beside.terms[0].values["left"] - at == pytest.approx(by)
    assert factor * by == pytest.approx(LEFT.change)
    other, factor = nudged(Variant((), terms=(term,)), term, LEFT, std, side=-1.0)
    away = other.terms[0].values["left"] - at
    assert away == pytest.approx(-abs(by))  # no bound is in the way there
    assert factor * away == pytest.approx(LEFT.change)


def test_a_drag_is_no_rounding_where_channels_are_precise_and_the_chair_is_shaken():
    """Places to 2 mm tell a drag to 2400 standard errors, all but 14 of which shaking may be."""
    left, raw = np.array([198.0, 2.8e-10]), np.array([5.8e6, 2.2e5])  # a drag, an encoder's zero
    assert taken_whole(left, raw).tolist() == [False, True]


SHARED = [(e, *pair) for e in library.MECHANICAL for pair in e.shared.items()]


@pytest.mark.parametrize(("effect", "nuisance", "parameters"), SHARED, ids=lambda v: str(v)[:16])
def test_what_an_effect_shares_with_the_roughly_known_is_the_same(effect, nuisance, parameters):
    every = (*roughly_known.MECHANICAL, roughly_known.TORQUE)
    known = next(n for n in every if n.name == nuisance)
    by = 0.5 * known.std
    one, other = mjchair.load_spec("manual"), mjchair.load_spec("manual")
    known.edit(one, by)
    effect.apply(other, dict.fromkeys(parameters, by))
    assert one.to_xml() == other.to_xml() != mjchair.load_spec("manual").to_xml()


def test_data_do_not_tell_a_wheel_from_what_is_roughly_known_of_both():
    """Where one wheel alone is asked about, they do."""
    both = Term(wheel_radius.EFFECT, {"left": 0.002, "right": 0.0}, ("left", "right"))
    one = Term(wheel_radius.EFFECT, {"left": 0.002, "right": 0.0}, ("left",))
    columns = {
        ParameterId("wheel_radius", side): [np.full((3, 1), answer)]
        for side, answer in (("left", 4.0), ("right", -2.0))
    }
    known = roughly_known.nuisances((), {"rolling_radius": 0.0015})
    made = shared_columns(Variant(known, terms=(both,)), columns)
    assert list(made) == [RoughlyKnown("rolling_radius")]
    assert made[RoughlyKnown("rolling_radius")][0] == pytest.approx(0.5 * (4.0 - 2.0))
    assert not shared_columns(Variant(known, terms=(one,)), columns)


def test_a_fit_takes_the_columns_that_an_effect_shares(monkeypatch):
    """Not those that were made before it, which differ by rounding."""
    term = Term(mass_offset.EFFECT, {"x": 0.01, "y": 0.0}, ("x",))
    known = roughly_known.nuisances((), {})
    before = {RoughlyKnown(n.name): [np.ones((3, 1))] for n in known}
    answer = {ParameterId("mass_offset", "x"): [np.full((3, 1), 6.0)]}
    monkeypatch.setattr(nonlinear, "term_columns", lambda *_: answer)
    asked = {}

    def system(here, columns, count, variant):
        asked.update(columns)
        raise InterruptedError

    here = nonlinear.Placed(Variant(known, terms=(term,)), SimpleNamespace(), 0.0)
    with pytest.raises(InterruptedError):
        nonlinear._around(SimpleNamespace(system=system), here, before)
    assert asked[RoughlyKnown("centre_x")][0] == pytest.approx(6.0 * 0.01 / 0.03)
    assert asked[RoughlyKnown("centre_y")][0] == pytest.approx(1.0)


@pytest.mark.parametrize(("speed", "there"), [(2.0, True), (0.02, False)])
def test_a_wind_is_there_though_its_drag_area_is_not_known(speed, there):
    """Half the area and 1.4 times the wind push alike; without wind no area is one of a wind.

    In sizes worth finding the wind is known to 0.1 with the area held, and to 0.8 without.
    """
    values = {"x": speed, "y": 0.0, "drag_area": 0.6}
    term = Term(library.find("wind"), values, ("x", "y", "drag_area"))
    wind, area = np.array([10.0, 0.0, 0.0]), np.array([9.9, 0.0, 1.25])
    J = np.stack([wind, [0.0, 10.0, 0.0], area], axis=1)
    system = SimpleNamespace(index=lambda keys: list(range(len(keys))))
    sigmas = nonlinear._sigmas(term, system, np.linalg.inv(J.T @ J))
    assert sigmas == pytest.approx(speed / term.effect.parameter("x").change / 0.1)
    assert search_rules.is_there(sigmas=sigmas) == there


@pytest.fixture
def descent(monkeypatch):
    """A fit that comes down by 1 in every round, from 1000, and promises 500 all the time."""
    totals = iter(range(1000, 0, -1))

    def placed(*_):
        total = float(next(totals))
        return SimpleNamespace(total=total, promised=500.0, track=None, std={}, variant=None)

    monkeypatch.setattr(nonlinear, "placed", placed)
    monkeypatch.setattr(nonlinear, "_around", lambda _, here, *__: here)
    monkeypatch.setattr(nonlinear, "_after_linear_step", lambda *_: None)
    monkeypatch.setattr(nonlinear, "_between", lambda *_: None)
    monkeypatch.setattr(nonlinear, "_nearer", lambda _, here, *__: here)


@pytest.mark.parametrize(("most", "looked"), [(90.0, 1 + nonlinear.FEW), (np.inf, 13)])
def test_a_fit_that_stays_worse_than_a_part_of_it_is_not_followed(most, looked, descent):
    bench, part = SimpleNamespace(simulator=None), SimpleNamespace(total=most)
    found = nonlinear.refit(bench, Variant(()), None, {}, part=part)
    assert found.total == 1001.0 - looked


@pytest.mark.parametrize(
    ("reach", "most", "looked"),
    [(499.0, np.inf, 2), (501.0, np.inf, 13), (499.0, 90.0, 1 + nonlinear.FEW)],
)
def test_a_fit_that_promises_too_little_ends_after_a_round(reach, most, looked, descent):
    """One that is still worse than a part of it has a promise that says nothing."""
    bench, part = SimpleNamespace(simulator=None), SimpleNamespace(total=most)
    found = nonlinear.refit(bench, Variant(()), None, {}, part=part, reach=reach)
    assert found.total == 1001.0 - looked


def test_a_start_that_fits_worse_than_a_part_of_its_effects_is_moved_towards_it(monkeypatch):
    """Linear algebra asks for a tire without friction; a tenth less helps, a half does not."""
    friction = library.find("tire_friction")
    rolling = Term(library.find("rolling_resistance"), {"coefficient": 0.004}, ("coefficient",))
    tried = []

    def placed(bench, variant, *_):
        less = 1.0 - variant.terms[1].values["factor"]
        tried.append(round(less, 6))
        assert variant.terms[0].values["coefficient"] <= 0.005
        total = 1e6 if less > 0.2 else 100.0 - 50.0 * less
        return SimpleNamespace(total=total, promised=total, track=None, std={}, variant=variant)

    monkeypatch.setattr(nonlinear, "placed", placed)
    monkeypatch.setattr(nonlinear, "_around", lambda _, here, *__: here)
    monkeypatch.setattr(nonlinear, "_after_linear_step", lambda _, best: best.variant)
    start = Variant(
        (),
        terms=(
            replace(rolling, values={"coefficient": 0.005}),
            Term(friction, {"factor": 0.02}, ("factor",)),
        ),
    )
    part = SimpleNamespace(total=100.0, variant=Variant((), terms=(rolling,)))
    found = nonlinear.refit(SimpleNamespace(simulator=None), start, None, {}, part=part)
    assert found.total < 100.0
    assert tried[:3] == [0.98, round(0.3 * 0.98, 6), round(0.1 * 0.98, 6)]


def test_after_a_short_step_the_next_is_twice_as_long_and_not_whole(monkeypatch):
    """Every second round was lost on a whole step where only a fifth of one helped."""
    aim, tried = 10.0, []

    def placed(bench, variant, *_):
        at = variant.offsets.get("mass", 0.0)
        tried.append(at)
        step = aim - at
        # no step of more than 2.5 helps: there a caster turns over
        far = len(tried) > 1 and abs(at - best[-1]) > 2.5
        total = 1e4 if far else 100.0 + step**2
        if not far:
            best.append(at)
        return SimpleNamespace(total=total, promised=100.0, track=None, std={}, variant=variant)

    best = [0.0]
    monkeypatch.setattr(nonlinear, "placed", placed)
    monkeypatch.setattr(nonlinear, "_around", lambda _, here, *__: here)
    monkeypatch.setattr(
        nonlinear, "_after_linear_step", lambda *_: Variant((), offsets={"mass": aim})
    )
    found = nonlinear.refit(SimpleNamespace(simulator=None), Variant(()), None, {})
    failed = sum(t not in best for t in tried)
    assert failed <= 4 and found.total < 105.0


def test_a_better_place_beside_which_no_chair_can_be_is_a_step_that_failed(monkeypatch):
    """Each step would fit better, but its columns cannot be made: after FAILS of them it ends."""
    totals = iter(range(1000, 0, -1))
    start = SimpleNamespace(total=1000.0, promised=0.0, track=None, std={}, variant=None)

    def placed(*_):
        return SimpleNamespace(total=float(next(totals)))

    def around(bench, here, *_):
        if here.total < 1000.0:
            raise MjchairError("no chair")
        return start

    monkeypatch.setattr(nonlinear, "placed", placed)
    monkeypatch.setattr(nonlinear, "_around", around)
    monkeypatch.setattr(nonlinear, "_after_linear_step", lambda *_: None)
    monkeypatch.setattr(nonlinear, "_between", lambda *_: None)
    assert nonlinear.refit(SimpleNamespace(simulator=None), Variant(()), None, {}) is start
    assert next(totals) == 1000 - 1 - nonlinear.FAILS


@pytest.mark.parametrize(
    ("effect", "value", "on"),
    [
        ("camber", -0.3, True),
        ("camber", -0.29982, True),  # as a line search ended that went on to the bound
        ("camber", -0.29, False),
        ("camber", 0.0, False),
        ("caster_friction", 0.0, False),  # there the effect is not there
        ("caster_friction", 9.995, True),
    ],
)
def test_a_size_ends_on_a_bound_or_beside_it(effect, value, on):
    effect = library.find(effect)
    p = effect.parameters[0]
    assert bool(nonlinear.on_bound(Term(effect, {p.name: value}, (p.name,)))) == on
