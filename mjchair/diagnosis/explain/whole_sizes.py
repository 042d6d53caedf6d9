"""Effects of a size at which a chair does what no small change foretells: it slides or shimmies.

In: the screened columns, or a fit that was chosen. Out: fits that begin at such a size, where the
size alone already brings more than it costs, and not far less than another explanation does; how
far the ends of fits that begin a little beside the chosen one lie apart.

Linear algebra is blind to these: a tire with a little less friction does nothing until it slides,
a relaxation length does little until the wheels shimmy, and a moment against turning ends a turn
where a little of it only slows it. So the windows that disagree most are
simulated at a few sizes (`Parameter.whole`), their states fitted anew at each, and then between
those that are better than their neighbours and these.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mjchair.diagnosis import rules
from mjchair.diagnosis.data.shimmy import CASTERS
from mjchair.diagnosis.data.windows import shimmying
from mjchair.diagnosis.explain import search_rules
from mjchair.diagnosis.explain.candidates import Start
from mjchair.diagnosis.explain.multistart import made_anew
from mjchair.diagnosis.explain.screening import Base, gain
from mjchair.diagnosis.fit import bounded
from mjchair.diagnosis.fit.column_ids import ParameterId
from mjchair.diagnosis.fit.nonlinear import Fitted
from mjchair.diagnosis.fit.variant import Term, Variant
from mjchair.diagnosis.replay.window_states import Track, track
from mjchair.effects.effect import Effect, Parameter
from mjchair.errors import MjchairError

SWINGS = 0.5  # of what measured casters swing
LOOKED = 4  # windows, those that disagree most
BESIDE = 0.1  # of a size, by which fits begin beside the one that was chosen
BETWEEN = 2  # times that the best size is compared with the middles to its neighbours
VALLEYS = 2  # sizes that are better than their neighbours, at which fits begin


@dataclass(frozen=True)
class Seen:
    """A chair with an effect at a whole size.

    Attributes:
      chi2: of the windows that are looked at; infinite where no chair is so. variant: the chair.
      beside: another effect that is in it.
    """

    chi2: float
    variant: Variant
    beside: tuple[Start, ...] = ()


def shimmies(base: Base) -> bool:
    """Whether a caster shimmies in any window."""
    return shimmying(base.bench.simulator.windows)


def shimmies_as_measured(base: Base, here: Track) -> bool:
    """Whether a chair's casters swing half as much as the measured ones, wherever these shimmy."""
    simulator, power = base.bench.simulator, np.zeros(2)
    at = [i for i, c in enumerate(simulator.channels) if c in CASTERS]
    for i in (k for k in base.bench.windows if simulator.windows[k].shimmies):
        both = simulator.measured(simulator.windows[i])[:, at], here.predicted[i][:, at]
        measured, shown = (np.diff(y, axis=0) for y in both)
        power += [np.nansum(measured**2), np.sum(shown[~np.isnan(measured)] ** 2)]
    return bool(power[1] >= SWINGS**2 * power[0])


def fits(base: Base, other: Fitted | None = None) -> Iterator[tuple[Start, Fitted]]:
    """Fits of single effects that begin at whole sizes.

    Args:
      other: a fit of other effects; a size that misses half of what it brings begins no fit. One
        that does not shimmy where measured casters do is no measure of one that may.
    """
    windows = worst_windows(base, base.plain)
    nothing = chi2(base, base.plain.variant, base.plain.track, windows)
    most, reach = 0.0, np.inf
    if other is not None and shimmies_as_measured(base, other.track):
        most = nothing - chi2(base, other.variant, other.track, windows)
        reach = search_rules.reach_of_whole(best=other.total, gain=gain(base, other))

    def weigh(variant: Variant, here: Track) -> Seen:
        return Seen(chi2(base, variant, here, windows), variant)

    def look(term: Term) -> Seen:
        key = (term.effect.key, *term.values.values())
        if key not in base.looked:
            base.looked[key] = looked_at(base, windows, weigh, term)
        seen: Seen = base.looked[key]
        return seen

    begun = [(s, at) for s in starts(base) for at in best_sizes(s, look, nothing, most)]
    # what misses half of what another size brings in the same windows begins no fit either
    brings = rules.REPLACES * max((nothing - at.chi2 for _, at in begun), default=0.0)
    for start, at in begun:
        if nothing - at.chi2 < brings:
            continue
        made = fit_from(base, at.variant, windows, reach)
        if made is not None:
            yield start, made


def looked_at(
    base: Base, windows: Sequence[int], weigh: Callable[[Variant, Track], Seen], term: Term
) -> Seen:
    """Windows of a chair with an effect at a size; of infinite chi2 where no chair is so.

    Args:
      weigh: a chair and its track.
    """
    variant = replace(base.around.variant, terms=(term,))
    here = track_of(base, variant, windows)
    nothing = Seen(np.inf, variant)
    try:
        return nothing if here is None else weigh(variant, here)
    except np.linalg.LinAlgError:  # of a chair that hardly simulates
        return nothing


def starts(base: Base) -> Iterator[Start]:
    """The first start of every effect that has whole sizes."""
    seen = set()
    for start in base.starts:
        key = start.effect.key
        if key not in seen and parameter_of(start.effect) is not None:
            seen.add(key)
            yield start


def fit_from(base: Base, begin: Variant, windows: Sequence[int], reach: float) -> Fitted | None:
    """The fit that begins at a chair; None: this chair cannot have it.

    Args:
      windows: in which it slides or shimmies: there coarse derivatives lead a fit astray.
      reach: chi2; a fit that promises more after a round ends there.
    """
    before = replace(base.around.track, touchy=frozenset(windows))
    return made_anew(base.bench, begin, before, reach=reach)


def compared(base: Base, fitted: Fitted) -> Fitted:
    """The best of a fit and of those that begin a little beside its whole sizes.

    Where a wheel slides or shimmies, chi2 has many valleys, and a fit ends in the one in which it
    began. Ends that fit as well as a rival may say how well a size is known: its standard error is
    at least the distance between them.
    """
    fits = [fitted, *_beside(base, fitted)]
    if len(fits) == 1:
        return fitted
    best = min(fits, key=lambda f: f.total)
    most = search_rules.not_ruled_out(gain=gain(base, best))
    near = [f for f in fits if f.total - best.total < most]
    std, sigmas = dict(best.std), dict(best.sigmas)
    for k, term, p in _whole(best):
        sizes = [f.variant.terms[k].values[p.name] for f in near]
        key = ParameterId(term.effect.key, p.name)
        std[key] = max(std[key], max(sizes) - min(sizes))
        away = abs(term.values[p.name] - p.neutral) / std[key]
        sigmas[term.effect.key] = min(sigmas[term.effect.key], away)
    return replace(best, std=std, sigmas=sigmas)


def _beside(base: Base, fitted: Fitted) -> Iterator[Fitted]:
    """Fits that begin at sizes a little smaller and larger than a fit has; those that can be."""
    terms = fitted.variant.terms
    for k, term, p in _whole(fitted):
        for share in (1.0 - BESIDE, 1.0 + BESIDE):
            moved = replace(term, values={**term.values, p.name: share * term.values[p.name]})
            begin = replace(fitted.variant, terms=(*terms[:k], moved, *terms[k + 1 :]))
            made = made_anew(base.bench, begin, fitted.track)
            if made is not None:
                yield made


def _whole(fitted: Fitted) -> Iterator[tuple[int, Term, Parameter]]:
    """The effects of a fit whose whole sizes are free: place, effect, parameter."""
    for k, term in enumerate(fitted.variant.terms):
        p = parameter_of(term.effect)
        if p is not None and p.name in term.free:
            yield k, term, p


def parameter_of(effect: Effect) -> Parameter | None:
    """The parameter of an effect that has whole sizes; None: it has none."""
    return next((p for p in effect.fitted if p.whole), None)


def best_sizes(
    start: Start, look: Callable[[Term], Seen], nothing: float, most: float
) -> list[Seen]:
    """What is seen at the best sizes of an effect; none where no size brings more than it costs.

    Casters that shimmy at one size may do so at another in the same rhythm: 0.13 m of a relaxation
    length fitted as well as 0.08 where 0.09 was hidden, and 0.1 did not.

    Args:
      look: at the effect at a size. nothing: chi2 of the same windows without it. most: what other
        effects bring there.
    """
    parameter = parameter_of(start.effect)
    assert parameter is not None
    neutral = start.effect.neutral()
    totals = {parameter.neutral: nothing}
    seen: dict[float, Seen] = {}

    def add(size: float) -> None:
        seen[size] = look(Term(start.effect, {**neutral, parameter.name: size}, start.free))
        totals[size] = seen[size].chi2

    for size in parameter.whole:
        add(size)
    ends = []
    for best in _valleys(totals)[:VALLEYS]:
        for _ in range(BETWEEN if totals[best] < nothing else 0):
            near = _middles(sorted(totals), best)
            for size in near:
                add(size)
            best = min(best, *near, key=totals.__getitem__)
        ends.append(best)
    least = max(search_rules.needed(len(start.free)), rules.REPLACES * most)
    return [seen[size] for size in ends if nothing - totals[size] > least]


def _valleys(totals: Mapping[float, float]) -> list[float]:
    """The sizes whose chi2 is below that of the next smaller and larger, best first."""
    sizes = sorted(totals)
    around = [math.inf, *(totals[size] for size in sizes), math.inf]
    lows = [
        size
        for size, below, here, above in zip(sizes, around, around[1:], around[2:], strict=False)
        if here < min(below, above)
    ]
    return sorted(lows, key=totals.__getitem__)


def worst_windows(base: Base, fitted: Fitted) -> list[int]:
    """The windows that may be fitted to and disagree most with a fit."""
    order = np.argsort(-fitted.chi2)
    return [int(i) for i in base.bench.windows[order[:LOOKED]]]


def _middles(sizes: Sequence[float], best: float) -> list[float]:
    """The middles between a size and those next to it."""
    at = sizes.index(best)
    near = [sizes[k] for k in (at - 1, at + 1) if 0 <= k < len(sizes)]
    return [0.5 * (best + other) for other in near]


def track_of(base: Base, variant: Variant, windows: Sequence[int]) -> Track | None:
    """Windows of a variant, their states fitted anew; None where no chair is so."""
    simulator = base.bench.simulator
    errors = variant.sensor_errors(simulator.channels)
    before = base.around.track
    try:
        model = simulator.compile(variant.edit)
        here = track(simulator, model, base.bench.noise, errors, before, anew=True, only=windows)
    except MjchairError:
        return None
    finite = all(np.isfinite(here.predicted[i]).any() for i in windows)
    return here if finite else None


def chi2(base: Base, variant: Variant, here: Track, windows: Sequence[int]) -> float:
    """Chi2 of windows with what is roughly known put where it fits best, priors included."""
    count = len(base.nuisances)
    system = base.bench.system(here, base.nuisances, count, variant, only=windows)
    return bounded.reduce(system, windows).total
