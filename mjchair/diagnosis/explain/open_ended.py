"""Sizes beyond which nothing changes: a caster that is stuck shows that it is, and not by how much.

In: a fit. Out: the fit; where an effect of a far larger size fits as well, at the least size that
fits alike, with the least size that the data do not rule out, and with a standard error that
reaches to the far one. Left and right sizes are looked at one by one.

Of sizes that runs cannot tell apart, the least is the one that changes the chair least where no run
has been: a caster that 0.3 N m hold still turns over as the chair reverses, one that 2 hold does
not.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from mjchair.diagnosis.explain import search_rules
from mjchair.diagnosis.explain.screening import Base, gain, nuisances_of
from mjchair.diagnosis.fit.column_ids import ParameterId
from mjchair.diagnosis.fit.nonlinear import Fitted, refit
from mjchair.diagnosis.fit.variant import Term
from mjchair.effects.effect import Parameter
from mjchair.effects.left_and_right import SIDES
from mjchair.errors import MjchairError

FURTHER = 8.0  # times the size: far beyond what a standard error may say of it
LEAST = 2.0  # times the size that bounds must allow: what is near fits nearly as well anyhow
SMALLEST = 1.0 / 64.0  # of the size, at which the search for the least one begins
HALVINGS = 6  # of the way from there, on a logarithmic scale


def with_least_sizes(base: Base, fitted: Fitted) -> Fitted:
    """The fit, with `at_least` and standard errors of sizes that are open upwards."""
    best = fitted
    for term in best.variant.terms:
        for p in _one_sided_sizes(term):
            far = _far(term, p, best.std[ParameterId(term.effect.key, p.name)])
            if far is not None:
                fitted = _with_least(base, best, fitted, (term, p, far))
    return fitted


def _far(term: Term, p: Parameter, std: float) -> float | None:
    """A far larger size, within bounds; None: they leave none, or there is no size.

    Args:
      std: of the size. One that is not known at all where it is, is looked at also near a bound: a
        caster that was stuck, of 4 N m, came as 6.3 +- 3e9 of at most 10.
    """
    size = term.values[p.name] - p.neutral
    if size == 0.0:  # of two sides one may end so
        return None
    far = min(max(p.neutral + FURTHER * size, p.low), p.high)
    is_near = abs(far - p.neutral) < LEAST * abs(size)
    return None if is_near and std < abs(size) else far


def _with_least(
    base: Base, best: Fitted, fitted: Fitted, looked: tuple[Term, Parameter, float]
) -> Fitted:
    """A fit with the least size of one effect, if that is open upwards.

    Args:
      best: as it was found. fitted: the same with least sizes of other effects.
      looked: the effect, its size, and a far larger one.
    """
    term, p, far = looked
    ruled_out = best.total + search_rules.not_ruled_out(gain=gain(base, best))
    if _at(base, fitted, _held(term, p, far), ruled_out) is None:
        return fitted
    smallest = p.neutral + SMALLEST * (term.values[p.name] - p.neutral)
    ends, _ = _least(base, fitted, term, p, (smallest, ruled_out))
    least, there = _least(base, fitted, term, p, (ends, best.total + search_rules.TIE))
    at = fitted if there is None else _freed(base, there, term)
    key = ParameterId(term.effect.key, p.name)
    opened = {k: fitted.std[k] for k in fitted.at_least}
    std = at.std | opened | {key: max(at.std[key], abs(far - least))}
    return replace(at, std=std, at_least=fitted.at_least | {key: ends})


def _one_sided_sizes(term: Term) -> list[Parameter]:
    """The size of an effect that has one, or its left and its right one, if in one direction."""
    sized = [p for _, p in term.parameters if p.sized]
    if len(sized) != 1 and {p.name for p in sized} != set(SIDES):
        return []
    if any(p.whole or p.neutral not in (p.low, p.high) for p in sized):
        return []
    return [p for p in sized if p.name in term.free]


def _least(
    base: Base, fitted: Fitted, term: Term, p: Parameter, limits: tuple[float, float]
) -> tuple[float, Fitted | None]:
    """The least size that fits, up to the size that was found, and its fit; None: that size.

    Args:
      limits: a size that may be too small, and the largest chi2 of one that fits.
    """
    (low, most), high, found = limits, term.values[p.name], None
    for _ in range(HALVINGS):
        share = math.sqrt((low - p.neutral) / (high - p.neutral))
        middle = p.neutral + share * (high - p.neutral)
        there = _at(base, fitted, _held(term, p, middle), most)
        if there is None:
            low = middle
        else:
            high, found = middle, there
    return high, found


def _held(term: Term, p: Parameter, size: float) -> Term:
    """The effect at a size that no fit moves; of two sizes the other is free, and no shape is."""
    sized = {q.name for _, q in term.parameters if q.sized}
    free = tuple(name for name in term.free if name in sized and name != p.name)
    return Term(term.effect, {**term.values, p.name: size}, free)


def _at(base: Base, fitted: Fitted, held: Term, most: float) -> Fitted | None:
    """The fit with an effect that is held so, all else moved; None: its chi2 is over `most`."""
    terms = tuple(held if t.effect is held.effect else t for t in fitted.variant.terms)
    start = replace(fitted.variant, terms=terms)
    nuisances = nuisances_of(base, fitted)
    try:
        there = refit(base.bench, start, fitted.track, nuisances, rounds=0)
        if there.promised > most:
            return None
        there = refit(base.bench, start, there.track, nuisances)
    except (MjchairError, np.linalg.LinAlgError):
        return None  # this chair cannot have it
    return there if there.total < most else None


def _freed(base: Base, there: Fitted, term: Term) -> Fitted:
    """The fit where an effect was held, with its size free again, and no step taken."""
    terms = tuple(
        replace(t, free=term.free) if t.effect is term.effect else t for t in there.variant.terms
    )
    start = replace(there.variant, terms=terms)
    return refit(base.bench, start, there.track, nuisances_of(base, there), rounds=0)
