"""Whether what seems to shake the chair is noise, or further effects beside the best.

In: fits around a screened base. Out: fits around a base with the noise that an explanation by
several effects leaves, and with this explanation, where it is the more probable one; else the fits
as they were.

The noise was taken around the best effects by linear algebra. Where several effects are there at
once, those that are not among these pass for noise, which then hides them. So the best effect is
fitted with every column made anew around it, and the next ones are sought around this fit for a
chair that is hardly shaken. Noise and effects are compared by the probability that they give to the
data (`noise_levels.deviance`): an effect must earn what it takes from the noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from operator import attrgetter

import numpy as np

from mjchair.diagnosis.data.windows import calm
from mjchair.diagnosis.explain import hypotheses, noise_shown, search_rules, whole_sizes
from mjchair.diagnosis.explain.candidates import Start
from mjchair.diagnosis.explain.fits import Fits, believable
from mjchair.diagnosis.explain.hypotheses import Hypothesis
from mjchair.diagnosis.explain.screening import (
    LOUD,
    Base,
    Found,
    effects_of,
    nuisances_of,
    system_around,
    with_noise,
)
from mjchair.diagnosis.explain.shortlist import best_single
from mjchair.diagnosis.fit import bounded
from mjchair.diagnosis.fit.bench import Bench
from mjchair.diagnosis.fit.bounded import Reduced
from mjchair.diagnosis.fit.column_ids import ColumnId
from mjchair.diagnosis.fit.nonlinear import Fitted, refit
from mjchair.diagnosis.replay.derivatives import Column
from mjchair.errors import MjchairError

HALF = 0.5  # of the power of what shakes the chair: effects that take less are no matter of noise
PROMISED = 0.7  # of that power: what linear algebra leaves at most of it
CLOSES = 0.7  # of what hardly any noise leaves: then the form is right, and only roughly placed
LOOKED = 3  # further single effects, and pairs, that are weighed against noise
SHAKEN = 0.25  # of the most power that is believed: then something large may be missing
ROUNDS = 4  # of fit and noise, at most
SETTLED = 5.0  # deviance that a further round changes no more
LINEAR = 0.1  # share of what effects earn by which linear algebra may be wrong


@dataclass(frozen=True, kw_only=True)
class Explained:
    """Effects, their fit, the noise that they leave, and its deviance with their penalties."""

    starts: tuple[Start, ...]
    fitted: Fitted
    bench: Bench
    price: float


def without_hidden(fits: Fits) -> Fits:
    """The fits, or new ones with the noise that further effects leave, where these earn it.

    Args:
      fits: of which none is made yet; those that are made here stay in them.
    """
    base = fits.base
    shimmies = whole_sizes.shimmies(base)
    if noise_shown.loudness(base.bench) <= LOUD and not shimmies:
        return fits
    fits.say("what passes for noise")
    here = _first(fits)
    # small changes do not lead to an effect of a whole size: the search would not find it again
    whole = any(whole_sizes.parameter_of(s.effect) for s in here.starts)
    here = _beside_shimmy(base, here) if whole and shimmies else _grown(base, here)
    if not here.starts or not (whole or _is_quieter(here.bench, base.bench)):
        return fits
    quieter = with_noise(base, here.bench)
    columns = nuisances_of(base, here.fitted)
    fitted = refit(here.bench, here.fitted.variant, here.fitted.track, columns)
    return Fits(replace(quieter, found=Found(here.starts, fitted)), fits.say)


def _grown(base: Base, here: Explained) -> Explained:
    """The explanation with as many further effects as are more probable than noise."""
    while len(here.starts) < search_rules.MOST and noise_shown.loudness(here.bench) > LOUD:
        further = _further(base, here)
        if further is None:
            break
        here = further
    return here


def _beside_shimmy(base: Base, here: Explained) -> Explained:
    """The explanation of a shimmy with the noise that it leaves in windows without one.

    What a fit leaves of a shimmy hangs on too little to be a further effect, and is no noise of the
    sensors in other windows: there it would hide what is missing besides.
    """
    windows = base.bench.simulator.windows
    if len(calm(windows, base.bench.windows)) == len(base.bench.windows):
        return here
    columns = nuisances_of(base, here.fitted)
    bench = _noise(base, here.fitted, effects_of(base, here.fitted), apart=True)[0]
    fitted = refit(bench, here.fitted.variant, here.fitted.track, columns)
    return replace(here, fitted=fitted, bench=bench)


def _first(fits: Fits) -> Explained:
    """The best effect with everything made anew around it, or none where it earns nothing."""
    base = fits.base
    known = [_left(base, (), base.plain)]
    best = best_single(fits)
    tried = fits.fit(best) if best and best.gain > search_rules.needed(best.free) else None
    fitted = fits.anew(tried) if tried else None
    if best and fitted:
        known.append(_left(base, best.starts, fitted))
    if whole_sizes.shimmies(base) or min(noise_shown.loudness(e.bench) for e in known) > SHAKEN:
        fits.say("effects of whole sizes")
        known += [_left(base, (s,), f) for s, f in whole_sizes.fits(base, fitted)]
    first = min(known, key=attrgetter("price"))
    return _agreed(base, first) if first.starts else first


def _further(base: Base, here: Explained) -> Explained | None:
    """One or two more effects that are more probable than the noise that they take; None: none."""
    reduced = _around(base, noise_shown.hushed(here.bench), here.fitted)
    near = [_fitted(base, here, b, h, reduced) for h, b in _promising(base, here, reduced)]
    best = min((e for e in near if e is not None), key=attrgetter("price"), default=here)
    if best.price >= here.price:
        return None
    best = _agreed(base, best)
    return best if _is_quieter(best.bench, here.bench) else None


def _is_quieter(one: Bench, other: Bench) -> bool:
    """Whether what shakes the chair has less than half of its power with one noise."""
    return noise_shown.loudness(one) < HALF * noise_shown.loudness(other)


def _promising(base: Base, here: Explained, reduced: Reduced) -> list[tuple[Hypothesis, Bench]]:
    """The further effects that are worth a fit: by linear algebra they leave less and earn it.

    Each with the noise that it leaves. The first single effect is worth one as well where it closes
    most of what hardly any noise leaves: the columns of a patch are of places a radius apart, and
    what one of them leaves beside the true place looks like noise until the place is fitted.
    """
    taken = {s.effect.key for s in here.starts}
    free = [s for s in base.starts if s.effect.key not in taken]
    options = hypotheses.singles(reduced, free)[:LOOKED]
    if len(here.starts) + 2 <= search_rules.MOST:
        options += hypotheses.pairs(reduced, free)[:LOOKED]
    own = effects_of(base, here.fitted)
    weighed = []
    brought = _brought(base, here, reduced)
    for h in options:
        if not _beyond_form(reduced, h, brought + h.gain) or not hypotheses.can_be(reduced, h):
            continue
        columns: dict[ColumnId, Column] = {**own, **{c: base.columns[c] for c in h.columns}}
        bench, deviance = _noise(base, here.fitted, columns)
        if noise_shown.loudness(bench) < PROMISED * noise_shown.loudness(here.bench):
            weighed.append((here.price - deviance - _penalty((*here.starts, *h.starts)), h, bench))
    most = max((earns for earns, *_ in weighed), default=0.0)
    worth = [(h, b) for earns, h, b in weighed if earns > 0.0 and earns > (1.0 - LINEAR) * most]
    if not worth and options and options[0].gain > CLOSES * _excess(base, here, reduced):
        worth = [(options[0], noise_shown.hushed(here.bench))]
    return worth


def _excess(base: Base, here: Explained, reduced: Reduced) -> float:
    """Chi2 that hardly any noise leaves, over what the noise of an explanation leaves."""
    fitted, count = here.fitted, len(here.fitted.columns)
    free = count - len(base.nuisances)
    system = here.bench.system(fitted.track, fitted.columns, count, fitted.variant, free=free)
    return reduced.total - bounded.reduce(system, here.bench.windows).total


def _brought(base: Base, here: Explained, reduced: Reduced) -> float:
    """Chi2 that the effects bring which are there, of a chair that is hardly shaken.

    Args:
      reduced: linear algebra of that chair around their fit.
    """
    plain, bench = base.plain, noise_shown.hushed(here.bench)
    system = bench.system(plain.track, plain.columns, len(plain.columns), plain.variant)
    return max(bounded.reduce(system, bench.windows).total - reduced.total, 0.0)


def _beyond_form(reduced: Reduced, more: Hypothesis, gain: float) -> bool:
    """Whether each of the further effects brings more than the forms of all leave.

    Args:
      gain: chi2 that all effects bring.
    """
    fewer = [hypotheses.weigh(reduced, [s for s in more.starts if s is not own]).gain
             for own in more.starts]  # fmt: skip
    return all(search_rules.beyond_form(own=more.gain - less, gain=gain) for less in fewer)


def _fitted(
    base: Base, here: Explained, bench: Bench, more: Hypothesis, reduced: Reduced
) -> Explained | None:
    """The explanation with more effects; None: no chair can be so, or a size is not determined.

    Args:
      bench: to fit with. reduced: linear algebra around `here`, which tells where to begin.
    """
    terms = (*here.fitted.variant.terms, *hypotheses.terms(reduced, more))
    columns = nuisances_of(base, here.fitted)
    try:
        start = replace(here.fitted.variant, terms=terms)
        fitted = refit(bench, start, here.fitted.track, columns)
    except (MjchairError, np.linalg.LinAlgError):
        return None
    if not believable(fitted):
        return None
    return _left(base, (*here.starts, *more.starts), fitted)


def _agreed(base: Base, one: Explained) -> Explained:
    """The explanation once its fit and the noise that it leaves agree."""
    for _ in range(ROUNDS):
        columns = nuisances_of(base, one.fitted)
        fitted = refit(one.bench, one.fitted.variant, one.fitted.track, columns)
        more = _left(base, one.starts, fitted)
        if more.price > one.price - SETTLED:
            break
        one = more
    return one


def _left(base: Base, starts: tuple[Start, ...], fitted: Fitted) -> Explained:
    """The explanation with the noise that its fit leaves."""
    bench, deviance = _noise(base, fitted, effects_of(base, fitted))
    return Explained(starts=starts, fitted=fitted, bench=bench, price=deviance + _penalty(starts))


def _noise(
    base: Base, fitted: Fitted, own: dict[ColumnId, Column], apart: bool = False
) -> tuple[Bench, float]:
    known, bench = nuisances_of(base, fitted), noise_shown.hushed(base.bench)
    return noise_shown.left_by(bench, fitted.track, known, own, given=True, apart=apart)


def _around(base: Base, bench: Bench, fitted: Fitted) -> Reduced:
    """The linear algebra of all columns around a fit whose effects are free."""
    return bounded.reduce(system_around(base, bench, fitted), bench.windows)


def _penalty(starts: Sequence[Start]) -> float:
    """What effects must earn besides their parameters, which the deviance prices."""
    prior = Hypothesis(tuple(starts), 0.0, 0.0).prior
    return search_rules.WORTH * len(starts) - prior
