"""A size beyond which nothing changes has a least one; chi2 is told instead of simulated."""

from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import numpy as np
import pytest

from mjchair.diagnosis import decide, notes
from mjchair.diagnosis.explain import open_ended
from mjchair.diagnosis.fit.column_ids import ParameterId
from mjchair.diagnosis.fit.variant import Term, Variant
from mjchair.diagnosis.result import Estimate
from mjchair.effects import bearing_friction, caster_friction
from mjchair.effects.library import find
from mjchair.errors import MjchairError

MOMENT = ParameterId("caster_friction", "moment")
PLAIN = 8000.0
RESOLVED = open_ended.SMALLEST ** -(0.5**open_ended.HALVINGS) - 1.0


@dataclass
class End:
    """What a fit says that ended with a caster's friction (N m)."""

    variant: Variant
    total: float
    promised: float
    track: object = None
    std: dict = field(default_factory=lambda: {MOMENT: 0.03})
    at_least: dict = field(default_factory=dict)


def ended(moment, total, promised=None):
    term = Term(find("caster_friction"), {"moment": moment}, ("moment",))
    return End(Variant((), terms=(term,)), total, total if promised is None else promised)


def looked(monkeypatch, chi2, size=0.5, std=0.03):
    """What is found where an effect held at a size leaves `chi2`, and the sizes held.

    Args:
      std: of the size where it is looked at.
    """
    held = []

    def refit(bench, begin, track, nuisances, rounds=None):
        moment = begin.terms[0].values["moment"]
        if begin.terms[0].free:  # once it is found nothing moves
            assert rounds == 0 and moment in held
        else:
            held.append(moment)
        return ended(moment, chi2(moment))

    monkeypatch.setattr(open_ended, "refit", refit)
    monkeypatch.setattr(open_ended, "nuisances_of", lambda *_: {})
    base = SimpleNamespace(bench=None, plain=SimpleNamespace(total=PLAIN))
    begun = replace(ended(size, chi2(size)), std={MOMENT: std})
    return open_ended.with_least_sizes(base, begun), held


def test_a_size_near_its_bound_is_not_open(monkeypatch):
    """A person of whom 73 kg move, and could 81, was known to 8 kg instead of 2."""
    high = next(p.high for p in find("caster_friction").parameters if p.name == "moment")
    found, held = looked(monkeypatch, lambda moment: 3000.0, size=0.6 * high)
    assert held == [] and found.std[MOMENT] == 0.03 and not found.at_least


def test_a_size_near_its_bound_that_changes_nothing_is_open(monkeypatch):
    """A stuck caster of 4 N m, which had come to 6.3 of at most 10, was named 6.3 +- 3e9 N m."""
    found, held = looked(
        monkeypatch, lambda moment: 3000.0 if moment > 0.36 else PLAIN, size=6.3, std=3e9
    )
    assert held[0] == 10.0
    assert found.at_least[MOMENT] == pytest.approx(0.36, rel=RESOLVED)
    value = found.variant.terms[0].values["moment"]
    assert value + found.std[MOMENT] == pytest.approx(10.0)


def test_a_stuck_caster_has_at_least_the_friction_at_which_it_sticks(monkeypatch):
    found, _ = looked(monkeypatch, lambda moment: 3000.0 if moment > 0.36 else PLAIN)
    assert found.at_least[MOMENT] == pytest.approx(0.36, rel=RESOLVED)
    assert found.at_least[MOMENT] > 0.36
    # the error reaches to what was looked at
    value = found.variant.terms[0].values["moment"]
    assert value + found.std[MOMENT] == pytest.approx(open_ended.FURTHER * 0.5)


@pytest.mark.parametrize("size", [0.5, 2.0, 5.0])
def test_of_sizes_that_fit_alike_the_least_stands_in_the_chair(monkeypatch, size):
    """A caster of 0.3 N m and a camber were `unknown`: the fit ended at 2.0 N m.

    Casters stuck in all runs but the one that was held out, where the chair reversed.
    """

    def chi2(moment):
        sticks = 3000.0 - 1.5 * np.log(moment / 0.3)
        return sticks if moment > 0.3 else sticks + 1e5 * (0.3 - moment) ** 2

    found, _ = looked(monkeypatch, chi2, size=size)
    value = found.variant.terms[0].values["moment"]
    assert value == pytest.approx(0.3, rel=RESOLVED)
    assert 0.2 < found.at_least[MOMENT] < value
    assert found.variant.terms[0].free == ("moment",)


def test_an_effect_of_an_open_size_is_as_sure_as_what_it_brings():
    """No standard error tells that a caster is stuck: by it, the caster seemed to be free."""
    fitted = SimpleNamespace(sigmas={"caster_friction": 1.3, "camber": 10.0}, at_least={})
    brought = {"camber": 98.0, "caster_friction": 3600.0}
    choice = SimpleNamespace(fitted=fitted, brought=brought)
    assert decide._sigmas(choice) == (1.3, 10.0)
    fitted.at_least[MOMENT] = 0.25
    assert decide._sigmas(choice) == (60.0, 10.0)


def test_of_sizes_that_are_open_upwards_only_the_least_is_told():
    """Casters held fast were named "left +2.32 ± 8.2 N m, left less right +1.86 ± 9.1 N m"."""
    effect, values = caster_friction.ONE_SIDED, {"left": 2.3, "right": 0.46, "slope": 1.9}
    term = Term(effect, values, tuple(values))
    keys = {side: ParameterId(effect.key, side) for side in ("left", "right")}
    fitted = SimpleNamespace(
        std={key: 3.0 for key in keys.values()}, at_least={}, std_of_difference=lambda *_: 4.0
    )
    assert "left less right" in notes.remark(fitted, term)
    fitted.at_least = dict.fromkeys(keys.values(), 0.24)
    assert notes.remark(fitted, term) == ""


def test_a_size_that_data_tell_is_left_alone_after_one_look(monkeypatch):
    found, held = looked(monkeypatch, lambda moment: 3000.0 + 1e4 * (moment - 0.5) ** 2)
    assert found.at_least == {} and found.std == {MOMENT: 0.03}
    assert held == [open_ended.FURTHER * 0.5]


def test_a_bound_ends_the_look(monkeypatch):
    _, held = looked(monkeypatch, lambda moment: 3000.0 if moment < 9.0 else PLAIN, size=4.0)
    assert held == [10.0]  # the largest that a caster's friction may be


@pytest.mark.parametrize("error", [MjchairError("does not compile"), np.linalg.LinAlgError()])
def test_what_no_chair_can_have_does_not_fit(monkeypatch, error):
    def refuse(moment):
        if moment > 0.5:
            raise error
        return 3000.0

    found, _ = looked(monkeypatch, refuse)
    assert found.at_least == {}


def test_each_caster_that_is_stuck_has_a_least_size_of_its_own(monkeypatch):
    """Two casters of 4 N m, which never turned, were named 0.79 +- 0.80 and 0.47 +- 0.09 N m."""
    effect, shape = caster_friction.ONE_SIDED, {"slope": 2.0}
    keys = {side: ParameterId(effect.key, side) for side in ("left", "right")}

    def end(values, free):
        term = Term(effect, {**values, **shape}, free)
        total = 3000.0 if values["left"] > 0.3 else PLAIN
        total += 1e4 * (values["right"] - 0.5) ** 2
        known = {key: 0.03 for key in keys.values()}
        return End(Variant((), terms=(term,)), total, total, std=known)

    def refit(bench, begin, track, nuisances, rounds=None):
        (term,) = begin.terms
        assert "slope" not in term.free or rounds == 0
        return end({side: term.values[side] for side in keys}, term.free)

    monkeypatch.setattr(open_ended, "refit", refit)
    monkeypatch.setattr(open_ended, "nuisances_of", lambda *_: {})
    base = SimpleNamespace(bench=None, plain=SimpleNamespace(total=PLAIN))
    begun = end({"left": 0.5, "right": 0.5}, ("left", "right", "slope"))
    found = open_ended.with_least_sizes(base, begun)
    assert set(found.at_least) == {keys["left"]}
    assert found.at_least[keys["left"]] == pytest.approx(0.3, rel=RESOLVED)
    assert found.std[keys["left"]] > 3.0 and found.std[keys["right"]] == 0.03


def test_a_side_on_which_there_is_nothing_is_not_looked_at(monkeypatch):
    """A fit clips the second side to its bound, which is no size: 0 was divided by 0."""
    term = Term(bearing_friction.ONE_SIDED, {"left": 0.5, "right": 0.0}, ("left", "right"))
    held = []

    def refit(bench, begin, track, nuisances, rounds=None):
        held.append(begin.terms[0].values)
        return End(begin, PLAIN, PLAIN)

    monkeypatch.setattr(open_ended, "refit", refit)
    monkeypatch.setattr(open_ended, "nuisances_of", lambda *_: {})
    base = SimpleNamespace(bench=None, plain=SimpleNamespace(total=PLAIN))
    known = {ParameterId("bearing_friction", side): 0.03 for side in ("left", "right")}
    begun = End(Variant((), terms=(term,)), 3000.0, 3000.0, std=known)
    assert open_ended.with_least_sizes(base, begun) is begun
    assert {values["right"] for values in held} == {0.0}


def test_a_size_in_two_directions_is_not_looked_at(monkeypatch):
    monkeypatch.setattr(open_ended, "refit", None)
    term = Term(find("floor_slope"), {"x": 0.01, "y": 0.0}, ("x",))
    one = End(Variant((), terms=(term,)), 3000.0, 3000.0)
    assert open_ended.with_least_sizes(SimpleNamespace(), one) is one


def test_diagnosis_json_has_it_only_where_there_is_one():
    told = Estimate(value=0.5, std=0.03, unit="N m")
    assert set(told.to_dict()) == {"value", "std", "unit"}
    stuck = Estimate(value=0.5, std=3.5, unit="N m", at_least=0.36)
    assert stuck.to_dict()["at_least"] == 0.36
