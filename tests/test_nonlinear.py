"""Where a nonlinear fit begins, on totals that are told: nothing is simulated."""

from types import SimpleNamespace

import pytest

from mjchair.diagnosis.fit import nonlinear
from mjchair.diagnosis.fit.nonlinear import ASTRAY, NEARER, Placed, refit
from mjchair.diagnosis.fit.variant import Term, Variant
from mjchair.effects.effect import Effect, Parameter

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

    monkeypatch.setattr(nonlinear, "_placed", placed)
    monkeypatch.setattr(nonlinear, "_around", around)
    monkeypatch.setattr(nonlinear, "_after_linear_step", lambda bench, fitted: fitted.variant)
    start = Variant((), terms=(Term(TRAIL, {"length": 1.0}, ("length",)),))
    bench = SimpleNamespace(simulator=None)
    found = refit(bench, start, None, {}, nothing=NOTHING)
    assert found.variant.terms[0].values["length"] == pytest.approx(share)
    as_it_was = refit(bench, start, None, {})
    assert as_it_was.variant.terms[0].values["length"] == 1.0
