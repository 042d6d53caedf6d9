"""Fits that begin at whole sizes, with chi2 that is told instead of simulated.

In: chi2 of an effect's sizes. Out: the size at which a fit begins.
"""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from mjchair.diagnosis.explain import whole_sizes
from mjchair.diagnosis.fit.variant import Variant
from mjchair.effects.library import MECHANICAL, find
from mjchair.errors import MjchairError


def begun(monkeypatch, effect, chi2, other=None):
    """The size at which a fit of the effect begins; None: none is better than no effect.

    other: chi2 of a fit of other effects.
    """
    (parameter,) = [p for p in effect.fitted if p.whole]

    def told(base, variant, windows):
        return chi2(variant.terms[0].values[parameter.name])

    monkeypatch.setattr(whole_sizes, "_at", told)
    plain = SimpleNamespace(variant=Variant(()), track=None, chi2=np.arange(6.0))
    rival = None if other is None else SimpleNamespace(variant=None, track=None)
    monkeypatch.setattr(
        whole_sizes,
        "_chi2",
        lambda _, variant, *__: chi2(parameter.neutral) if variant is plain.variant else other,
    )
    base = SimpleNamespace(
        plain=plain,
        around=SimpleNamespace(variant=Variant(())),
        bench=SimpleNamespace(windows=np.arange(6)),
    )
    start = SimpleNamespace(effect=effect, free=(parameter.name,))
    best = whole_sizes._best_size(base, start, parameter, rival)
    return None if best is None else best.terms[0].values[parameter.name]


@pytest.mark.parametrize("truth", [0.055, 0.083, 0.12])
def test_a_fit_begins_next_to_the_size_that_is_there(monkeypatch, truth):
    """A valley of a shimmy is narrow: nothing at half of the size tells of it."""
    effect = find("relaxation_length")
    size = begun(
        monkeypatch, effect, lambda v: 2000.0 - 1500.0 * math.exp(-(((v - truth) / 0.01) ** 2))
    )
    assert size == pytest.approx(truth, abs=0.008)


@pytest.mark.parametrize(("other", "begins"), [(1400.0, True), (200.0, False)])
def test_a_size_that_misses_half_of_what_others_bring_begins_no_fit(monkeypatch, other, begins):
    def chi2(size):
        return 2000.0 - 500.0 * math.exp(-(((size - 0.08) / 0.01) ** 2))

    size = begun(monkeypatch, find("relaxation_length"), chi2, other)
    assert (size is not None) == begins


def test_a_size_that_brings_nothing_begins_no_fit(monkeypatch):
    assert begun(monkeypatch, find("tire_friction"), lambda v: 1000.0 + 50.0 * abs(v - 1.0)) is None


def test_the_windows_that_disagree_most_are_looked_at():
    base = SimpleNamespace(
        plain=SimpleNamespace(chi2=np.array([5.0, 90.0, 20.0, 70.0, 60.0, 1.0])),
        bench=SimpleNamespace(windows=np.array([0, 1, 3, 4, 7, 8])),
    )
    assert whole_sizes._worst_windows(base) == [1, 4, 7, 3]


def test_a_size_that_no_chair_can_have_fits_nothing():
    def refused(edit):
        raise MjchairError("no chair")

    simulator = SimpleNamespace(compile=refused, channels=())
    base = SimpleNamespace(
        bench=SimpleNamespace(simulator=simulator, noise={}), around=SimpleNamespace(track=None)
    )
    assert whole_sizes._at(base, Variant(()), [0]) == math.inf


def test_whole_sizes_are_sizes_that_can_be():
    for effect in MECHANICAL:
        for p in effect.parameters:
            assert all(p.low < size < p.high and size != p.neutral for size in p.whole)
