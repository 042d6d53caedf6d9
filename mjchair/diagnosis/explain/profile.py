"""A fit that is stuck, from beside its sizes, and the standard errors that chi2 itself shows there.

In: a fit. Out: the fit, or a better one that was found by holding one size after the other a
little smaller and a little larger while all else is fitted. Where the fit was stuck, each standard
error is at least what chi2 beside it shows.

A fit is stuck where its own linear step promises clearly less than what is reached. In a fast turn
a caster may be about to lift, and the columns of what is only roughly known are then wrong by as
much as tells two sizes apart. A fit with one size held needs no such difference: it goes along the
valley, and shows how steep the sides are.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from mjchair.diagnosis import rules
from mjchair.diagnosis.explain.multistart import made_anew
from mjchair.diagnosis.explain.screening import Base, nuisances_of
from mjchair.diagnosis.fit.column_ids import ParameterId
from mjchair.diagnosis.fit.nonlinear import Fitted
from mjchair.effects.effect import Parameter

AWAY = 3.0  # standard errors that a size is held beside where it was found, at first
FARTHER = 2.0  # times that, where this led on
ROUNDS = 3  # of holding sizes and freeing the best


@dataclass(frozen=True)
class Held:
    """A fit with one size held.

    Attributes:
      key: which. side: -1 or 1, smaller or larger than where it was found. size: SI. fitted: the
        fit of all else.
    """

    key: ParameterId
    side: float
    size: float
    fitted: Fitted


def followed(base: Base, fitted: Fitted) -> Fitted:
    """The fit along the valley of a stuck one, with standard errors that chi2 shows.

    Of fits that are alike the one nearest to where the valley was entered is taken. A fit that is
    not stuck comes back as it is.
    """
    if not rules.is_stuck(total=fitted.total, promised=fitted.promised):
        return fitted
    path, seen, away = [fitted], list[Held](), AWAY
    sides = [(key, side) for key in _sizes(fitted) for side in (-1.0, 1.0)]
    for _ in range(ROUNDS):
        held = [h for h in (_held(base, path[-1], *s, away) for s in sides) if h is not None]
        seen += held
        least = min(held, key=lambda h: h.fitted.total, default=None)
        if least is None or least.fitted.total >= path[-1].total - rules.NOTHING:
            break
        freed = _freed(base, least.fitted, fitted)
        if freed is None or freed.total >= path[-1].total:
            break
        path.append(freed)
        sides, away = [(least.key, least.side)], FARTHER * away
    alike = path[-1].total + rules.TIE
    return _with_errors(next(f for f in path if f.total <= alike), path[-1], seen)


def _sizes(fitted: Fitted) -> dict[ParameterId, Parameter]:
    """The free sizes of a fit, without those that `whole_sizes` looks at."""
    every = (pair for term in fitted.variant.terms for pair in term.parameters)
    return {key: p for key, p in every if p.sized and not p.whole}


def _value(fitted: Fitted, key: ParameterId) -> float:
    terms = fitted.variant.terms
    return next(t.values[key.parameter] for t in terms if t.effect.key == key.effect)


def _held(base: Base, fitted: Fitted, key: ParameterId, side: float, away: float) -> Held | None:
    """The fit with a size held some standard errors away; None: no chair can be so."""
    p = _sizes(fitted)[key]
    size = _value(fitted, key) + side * away * fitted.std[key]
    if not p.low <= size <= p.high:
        return None
    terms = tuple(
        replace(
            t,
            values={**t.values, key.parameter: size},
            free=tuple(name for name in t.free if name != key.parameter),
        )
        if t.effect.key == key.effect
        else t
        for t in fitted.variant.terms
    )
    start, nuisances = replace(fitted.variant, terms=terms), nuisances_of(base, fitted)
    there = made_anew(base.bench, start, fitted.track, nuisances)
    return None if there is None else Held(key, side, size, there)


def _freed(base: Base, held: Fitted, like: Fitted) -> Fitted | None:
    """The fit from where one size was held, all sizes free as in another fit, columns made anew."""
    terms = tuple(
        replace(t, free=other.free)
        for t, other in zip(held.variant.terms, like.variant.terms, strict=True)
    )
    return made_anew(base.bench, replace(held.variant, terms=terms), held.track)


def _with_errors(fitted: Fitted, last: Fitted, seen: Sequence[Held]) -> Fitted:
    """The fit with standard errors at least as large as chi2 beside it shows.

    Args:
      last: where the valley was left, which fits alike. seen: fits with one size held.
    """
    beside = [(key, _value(last, key), last.total) for key in _sizes(fitted)]
    beside += [(held.key, held.size, held.fitted.total) for held in seen]
    std, sigmas = dict(fitted.std), dict(fitted.sigmas)
    for key, size, total in beside:
        differs = max(abs(total - fitted.total), 1.0)
        std[key] = max(std[key], abs(size - _value(fitted, key)) / math.sqrt(differs))
    for key, error in std.items():
        narrower = fitted.std[key] / error
        sigmas[key.effect] = min(sigmas[key.effect], fitted.sigmas[key.effect] * narrower)
    return replace(fitted, std=std, sigmas=sigmas)
