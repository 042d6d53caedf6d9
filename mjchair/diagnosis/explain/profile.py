"""A fit from beside its sizes, and the standard errors that chi2 itself shows there.

In: a fit. Out: the fit, or a better one that was found by holding one size after the other a
little smaller and a little larger while all else is fitted. Where the fit was stuck, or a size
makes up for another number of its effect or something roughly known for it, or its two sides say
different standard errors, each standard error is at least what chi2 beside it shows.

A fit is stuck where its own linear step promises clearly less than what is reached. In a fast turn
a caster may be about to lift, and the columns of what is only roughly known are then wrong by as
much as tells two sizes apart. A fit with one size held needs no such difference: it goes along the
valley, and shows how steep the sides are.

A size that makes up for another number, as a wind does for the area that it meets, is known by a
small part of each of two columns, which is as small as what is wrong in them: with a little less
noise than is estimated now, fits of one wind from four starts ended within 2 of chi2 and 0.9 m/s
apart, four of its standard errors.

A load is known by a small part of its column as well, since the mass of the chair, which is only
roughly known, stands in for nearly all of it. It is held as far off as it would be where that mass
is off by what it is known to, and all columns are made anew there: of a load of 40 kg, beside a
mass known to 5 %, columns told 46.4 +- 0.8 kg, and with 40 kg chi2 was 7 less.

A column that is taken where the motion jumps, as where a caster lifts off, holds the jump, which no
other number makes up for, so that the size seems better known than it is: of one camber the column
to the one side told a standard error of 0.0014 rad, that to the other 0.0067, and chi2 0.01.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mjchair.diagnosis.explain import search_rules
from mjchair.diagnosis.explain.multistart import made_anew
from mjchair.diagnosis.explain.screening import Base, nuisances_of
from mjchair.diagnosis.fit import bounded
from mjchair.diagnosis.fit.column_ids import ColumnId, ParameterId, RoughlyKnown
from mjchair.diagnosis.fit.nonlinear import Fitted, from_other_side
from mjchair.diagnosis.fit.variant import Term
from mjchair.diagnosis.replay.derivatives import Column
from mjchair.effects.effect import Parameter, clip
from mjchair.effects.left_and_right import SIDES
from mjchair.errors import MjchairError

AWAY = 3.0  # standard errors that a size is held beside where it was found, at first
FARTHER = 2.0  # times that, where this led on
MAKES_UP = 0.85  # correlation of two numbers of one effect, beyond which chi2 is asked (assumption)
UNEVEN = 1.5  # ratio of a size's standard errors by its two sides, beyond which chi2 is asked
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
    """The fit along its valley, with standard errors that chi2 shows.

    Of fits that are alike the one nearest to where the valley was entered is taken. A fit that is
    not stuck, of whose sizes none makes up for another, and whose two sides say the same, comes
    back as it is.
    """
    stuck = search_rules.is_stuck(total=fitted.total, promised=fitted.promised)
    sizes = _sizes(fitted)
    if not sizes:
        return fitted
    two_sided = _two_sided(base, fitted)
    doubtful = _make_up(fitted) | _uneven(fitted.std, two_sided)
    looked = [key for key in sizes if stuck or key in doubtful]
    looked += [key for key in _stood_in_for(fitted) if key not in looked]
    if not looked:
        return fitted
    fitted = _widened(fitted, two_sided)
    path, seen, away = [fitted], list[Held](), AWAY
    sides = [(key, side) for key in looked for side in (-1.0, 1.0)]
    for _ in range(ROUNDS):
        held = [h for h in (_held(base, path[-1], *s, away) for s in sides) if h is not None]
        seen += held
        least = min(held, key=lambda h: h.fitted.total, default=None)
        if least is None or least.fitted.total >= path[-1].total + search_rules.TIE:
            break
        freed = _freed(base, least.fitted, fitted)
        if freed is None or freed.total >= path[-1].total:
            break
        path.append(_widened(freed, _two_sided(base, freed)))
        sides, away = [(least.key, least.side)], FARTHER * away
    alike = path[-1].total + search_rules.TIE
    return _with_errors(next(f for f in path if f.total <= alike), path[-1], seen)


def _make_up(fitted: Fitted) -> set[ParameterId]:
    """The numbers that make up for another one of their effect."""
    pairs = fitted.correlation
    return {key for pair in pairs if abs(_together(fitted, pair)) > MAKES_UP for key in pair}


def _together(fitted: Fitted, pair: frozenset[ParameterId]) -> float:
    """Correlation of two numbers; of a left and a right one that of their mean and difference.

    What both sides share is often only roughly known, as the radius of both wheels is, and makes
    left and right correlate though neither makes up for the other.
    """
    r, (one, other) = fitted.correlation[pair], pair
    if {one.parameter, other.parameter} != set(SIDES):
        return r
    a, b = fitted.std[one], fitted.std[other]
    across = math.sqrt(max((a * a + b * b) ** 2 - (2.0 * r * a * b) ** 2, 0.0))
    return (a * a - b * b) / max(across, 1e-300)


def _stood_in_for(fitted: Fitted) -> list[ParameterId]:
    """The numbers of effects that something roughly known stands in for.

    A load on the chair and the mass of the chair differ by little of each of their columns.
    """
    return [
        key for term in fitted.variant.terms if term.effect.instead for key, _ in term.parameters
    ]


def _two_sided(base: Base, fitted: Fitted) -> dict[ParameterId, float]:
    """Standard errors by the columns of the other side, as they are where these cannot be."""
    try:
        return from_other_side(base.bench, fitted)
    except (MjchairError, np.linalg.LinAlgError):
        return fitted.std


def _uneven(
    one: Mapping[ParameterId, float], other: Mapping[ParameterId, float]
) -> set[ParameterId]:
    """The numbers of which two sides say standard errors that are not alike."""
    return {k for k, std in one.items() if not std / UNEVEN <= other[k] <= UNEVEN * std}


def _wider(fitted: Fitted, key: ParameterId, std: Mapping[ParameterId, float]) -> Iterator[float]:
    """By how much numbers for which one makes up are less well known than the fit says."""
    for pair, r in fitted.correlation.items():
        if key in pair:
            (other,) = pair - {key}
            yield abs(r) * std[other] / fitted.std[other]


def _numbers(fitted: Fitted) -> dict[ParameterId, Parameter]:
    """The free parameters of a fit."""
    return {key: p for term in fitted.variant.terms for key, p in term.parameters}


def _sizes(fitted: Fitted) -> dict[ParameterId, Parameter]:
    """The free sizes of a fit, without those that `whole_sizes` looks at."""
    return {key: p for key, p in _numbers(fitted).items() if p.sized and not p.whole}


def _value(fitted: Fitted, key: ParameterId) -> float:
    terms = fitted.variant.terms
    return next(t.values[key.parameter] for t in terms if t.effect.key == key.effect)


def _held(base: Base, fitted: Fitted, key: ParameterId, side: float, away: float) -> Held | None:
    """The fit with a size held some standard errors away; None: no chair can be so.

    Where something roughly known stands in for the size, it is held as far off as that may be.
    """
    p = _numbers(fitted)[key]
    known: dict[ColumnId, Column] | None = nuisances_of(base, fitted)
    stood_in = _by_what_stands_in(base, fitted, key) / AWAY
    if stood_in > fitted.std[key]:
        away *= stood_in / fitted.std[key]
        known = None
    size = _value(fitted, key) + side * away * fitted.std[key]
    if not p.low <= size <= p.high:
        return None
    terms = tuple(
        replace(
            t,
            values={**t.values, **_along(fitted, t, key, side * away), key.parameter: size},
            free=tuple(name for name in t.free if name != key.parameter),
        )
        if t.effect.key == key.effect
        else t
        for t in fitted.variant.terms
    )
    start = replace(fitted.variant, terms=terms)
    there = made_anew(base.bench, start, fitted.track, known)
    return None if there is None else Held(key, side, size, there)


def _by_what_stands_in(base: Base, fitted: Fitted, key: ParameterId) -> float:
    """By how much a size is other, SI, where what stands in for it is a standard deviation off.

    The standard deviation is that of what is known beforehand; where nothing stands in, 0.
    """
    p = _numbers(fitted)[key]
    (term,) = (t for t in fitted.variant.terms if t.effect.key == key.effect)
    if not p.sized or not term.effect.instead:
        return 0.0
    places, others = fitted.system.places, map(RoughlyKnown, term.effect.instead)
    covariance = bounded.covariance(fitted.system, base.bench.windows)
    own, known = places[key], [places[name] for name in others if name in places]
    per = [abs(float(covariance[own, k] / covariance[k, k])) for k in known]
    return p.change * max(per, default=0.0)


def _along(fitted: Fitted, term: Term, key: ParameterId, by: float) -> dict[str, float]:
    """Where the other numbers of an effect go, by their correlation, with one of them.

    Args:
      key: which. by: how many standard errors it goes.
    """
    out = {}
    for other, p in term.parameters:
        r = fitted.correlation.get(frozenset((key, other)), 0.0)
        out[p.name] = clip(p, term.values[p.name] + r * by * fitted.std[other])
    return out


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
    std = dict(fitted.std)
    for key, size, total in beside:
        differs = max(abs(total - fitted.total), 1.0)
        std[key] = max(std[key], abs(size - _value(fitted, key)) / math.sqrt(differs))
    for key in std.keys() - _sizes(fitted).keys():  # no size: as far as it makes up for one
        std[key] *= max([1.0, *_wider(fitted, key, std)])
    return _as_lost(_widened(fitted, std), fitted, seen)


def _as_lost(wider: Fitted, fitted: Fitted, seen: Sequence[Held]) -> Fitted:
    """The fit with wider errors, its effects as certain as what less of them loses in chi2 says.

    Between 17 and 27 kg chi2 of a load hardly changes, and below it rises steeply.

    Args:
      fitted: the fit with the errors that it had. seen: fits with one size held.
    """
    sigmas = dict(wider.sigmas)
    for held in seen:
        p = _numbers(fitted)[held.key]
        less, size = held.size - p.neutral, _value(fitted, held.key) - p.neutral
        if not p.sized or abs(less) >= abs(size) or less * size < 0.0:
            continue
        lost = math.sqrt(max(held.fitted.total - fitted.total, 0.0))
        effect = held.key.effect
        sigmas[effect] = max(sigmas[effect], min(lost, fitted.sigmas[effect]))
    return replace(wider, sigmas=sigmas)


def _widened(fitted: Fitted, std: Mapping[ParameterId, float]) -> Fitted:
    """The fit with standard errors that are at least these, and effects as much less certain.

    What only shapes an effect, as the height of a load, says nothing of whether it is there: a load
    that brought 1400 of chi2, of 24.3 +- 4.6 kg, was no answer because its height was not known.
    """
    numbers = _numbers(fitted)
    wider = {key: max(error, std[key]) for key, error in fitted.std.items()}
    sigmas = dict(fitted.sigmas)
    for key, error in wider.items():
        if numbers[key].sized:
            narrower = fitted.std[key] / error
            sigmas[key.effect] = min(sigmas[key.effect], fitted.sigmas[key.effect] * narrower)
    return replace(fitted, std=wider, sigmas=sigmas)
