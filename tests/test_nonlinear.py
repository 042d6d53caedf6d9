"""Where a nonlinear fit begins, on totals that are told, and its standard errors by the other side.

Nothing is simulated.
"""

from types import SimpleNamespace

import numpy as np
import pytest

from mjchair.diagnosis.fit import nonlinear
from mjchair.diagnosis.fit.column_ids import ParameterId, RoughlyKnown
from mjchair.diagnosis.fit.nonlinear import ASTRAY, NEARER, Placed, from_other_side, refit
from mjchair.diagnosis.fit.system import System
from mjchair.diagnosis.fit.variant import Term, Variant
from mjchair.effects.effect import Effect, Parameter
from mjchair.effects.library import find

NOTHING = 100.0
TRAIL = Effect(
    name="trail",
    parameters=(Parameter("length", "m", 0.01, -1.0, 1.0),),
    signature="",
    source="",
    edit=lambda spec, length: None,
)


@pytest.mark.parametrize(
    ("total", "share"), [(0.9 * ASTRAY, 1.0), (1.1 * ASTRAY, NEARER[0]), (1e5, NEARER[0])]
)
def test_an_effect_that_linear_algebra_makes_far_too_large_begins_smaller(
    total, share, monkeypatch
):
    """At its bound a caster's trail made chi2 ten thousand times what it is without."""

    def placed(bench, variant, before, nuisances):
        length = variant.terms[0].values["length"]
        return Placed(variant, None, NOTHING * (total if length == 1.0 else 1.0))

    def around(bench, here, nuisances, known=None):
        return SimpleNamespace(variant=here.variant, total=here.total, promised=here.total)

    monkeypatch.setattr(nonlinear, "placed", placed)
    monkeypatch.setattr(nonlinear, "_around", around)
    monkeypatch.setattr(nonlinear, "_after_linear_step", lambda bench, fitted: fitted.variant)
    start = Variant((), terms=(Term(TRAIL, {"length": 1.0}, ("length",)),))
    bench = SimpleNamespace(simulator=None)
    found = refit(bench, start, None, {}, nothing=NOTHING)
    assert found.variant.terms[0].values["length"] == pytest.approx(share)
    as_it_was = refit(bench, start, None, {})
    assert as_it_was.variant.terms[0].values["length"] == 1.0


@pytest.mark.parametrize("smaller", [0.5, 1.0, 4.0])
def test_columns_of_the_other_side_tell_their_own_standard_errors(smaller, monkeypatch):
    """Four samples that move by the noise for a typical change tell half of it."""
    key, slope = ParameterId("trail", "length"), {1.0: 1.0, -1.0: smaller}

    def columns(bench, track, variant, known=None, side=1.0):
        return {key: [np.full((4, 1), slope[side])]}

    def system(track, columns, count, variant, only=None):
        (column,) = columns[key]
        power = float((column**2).sum())
        return System(
            columns=[key], nuisance=0, G=np.full((1, 1, 1), power), b=np.zeros((1, 1)),
            c=np.zeros(1), run=np.zeros(1, int), back=np.zeros(0),
        )  # fmt: skip

    monkeypatch.setattr(nonlinear, "term_columns", columns)
    bench = SimpleNamespace(system=system, windows=np.array([0]))
    fitted = SimpleNamespace(
        variant=Variant((), terms=(Term(TRAIL, {"length": 0.1}, ("length",)),)),
        columns=columns(bench, None, None),
        track=None,
        std={key: 0.005},
        system=SimpleNamespace(nuisance=0),
    )
    assert from_other_side(bench, fitted) == {key: pytest.approx(0.005 / smaller, rel=1e-6)}


def test_what_an_effect_covers_is_not_fitted_beside_it():
    """Torques 25 ms late came as 16.7 beside 6.5 that the timing of inputs took."""
    columns = {RoughlyKnown(n): [np.ones((3, 2))] for n in ("input_timing", "mass")}
    late = Variant((), terms=(Term(find("torque_delay"), {"delay": 0.02}, ("delay",)),))
    for variant, left in ((late, 0.0), (Variant(()), 1.0)):
        beside = nonlinear._beside(variant, columns)
        assert np.all(beside[RoughlyKnown("input_timing")][0] == left)
        assert np.all(beside[RoughlyKnown("mass")][0] == 1.0)
