"""Sizes beyond which nothing changes: a caster that is stuck shows that it is, and not by how much.

In: a fit. Out: the fit; where an effect of a far larger size fits as well, with the least size that
the data allow, and with a standard error that reaches to the far one.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mjchair.diagnosis import rules
from mjchair.diagnosis.explain.screening import Base, gain, nuisances_of
from mjchair.diagnosis.fit.column_ids import ParameterId
from mjchair.diagnosis.fit.nonlinear import Fitted, refit
from mjchair.diagnosis.fit.variant import Term
from mjchair.effects.effect import Parameter
from mjchair.errors import MjchairError

FURTHER = 8.0  # times the size: far beyond what a standard error may say of it
LEAST = 2.0  # times the size that bounds must allow: what is near fits nearly as well anyhow
HALVINGS = 5  # of the way from no effect to the size, until the least one is found


def with_least_sizes(base: Base, fitted: Fitted) -> Fitted:
    """The fit, with `at_least` and standard errors of sizes that are open upwards."""
    std, at_least = dict(fitted.std), {}
    for term in fitted.variant.terms:
        p = _one_sided(term)
        if p is None:
            continue
        size = term.values[p.name] - p.neutral
        far = min(max(p.neutral + FURTHER * size, p.low), p.high)
        if abs(far - p.neutral) < LEAST * abs(size):
            continue
        if not _fits(base, fitted, _held(term, p, far)):
            continue
        key = ParameterId(term.effect.key, p.name)
        at_least[key] = _least(base, fitted, term, p)
        std[key] = max(std[key], abs(far - term.values[p.name]))
    return replace(fitted, std=std, at_least=at_least) if at_least else fitted


def _one_sided(term: Term) -> Parameter | None:
    """The size of an effect that has one only, and in one direction; None: it is no such effect."""
    sized = [p for _, p in term.parameters if p.sized]
    if len(sized) != 1 or sized[0].whole or sized[0].neutral not in (sized[0].low, sized[0].high):
        return None
    return sized[0]


def _least(base: Base, fitted: Fitted, term: Term, p: Parameter) -> float:
    """The least size that fits, between no effect and the size that was found."""
    low, high = p.neutral, term.values[p.name]
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if _fits(base, fitted, _held(term, p, middle)):
            high = middle
        else:
            low = middle
    return high


def _held(term: Term, p: Parameter, size: float) -> Term:
    """The effect at a size that no fit moves."""
    return Term(term.effect, {**term.values, p.name: size}, ())


def _fits(base: Base, fitted: Fitted, held: Term) -> bool:
    """Whether an effect that is held so is not ruled out, with all else moved as it likes."""
    most = fitted.total + rules.not_ruled_out(gain=gain(base, fitted))
    terms = tuple(held if t.effect is held.effect else t for t in fitted.variant.terms)
    start = replace(fitted.variant, terms=terms)
    nuisances = nuisances_of(base, fitted)
    try:
        there = refit(base.bench, start, fitted.track, nuisances, rounds=0)
        if there.promised > most:
            return False
        there = refit(base.bench, start, there.track, nuisances)
    except (MjchairError, np.linalg.LinAlgError):
        return False  # this chair cannot have it
    return there.total < most
