"""Effects of a whole size beside one other effect.

In: the screened columns, the best fit of a single effect, and the best fit of all. Out: fits that
begin at a whole size with the effect beside it that linear algebra finds best there.

Beside casters that shimmy the other effect is sought in the windows without a shimmy.

Alone such a size may explain nothing: a moment against turning is seen in turns, and where bearings
rub as well, every coast disagrees more. Small changes do not lead there either. So the windows that
disagree most with the best single effect are simulated at a few sizes, as `whole_sizes` does.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial

from mjchair.diagnosis.data.windows import calm
from mjchair.diagnosis.explain import hypotheses, search_rules, whole_sizes
from mjchair.diagnosis.explain.candidates import Start
from mjchair.diagnosis.explain.hypotheses import Hypothesis
from mjchair.diagnosis.explain.multistart import made_anew
from mjchair.diagnosis.explain.screening import Base, gain
from mjchair.diagnosis.explain.whole_sizes import Seen
from mjchair.diagnosis.fit import bounded
from mjchair.diagnosis.fit.bounded import Reduced
from mjchair.diagnosis.fit.nonlinear import Fitted
from mjchair.diagnosis.fit.variant import Variant
from mjchair.diagnosis.replay.window_states import Track


def fits(base: Base, single: Fitted, best: Fitted) -> Iterator[tuple[tuple[Start, ...], Fitted]]:
    """Fits of an effect at a whole size, alone or with one other effect.

    Args:
      single: the best fit of one effect. best: that of any; a size that misses half of what it
        brings beyond one effect begins no fit.
    """
    windows = whole_sizes.worst_windows(base, single)
    around = base.around
    nothing = _with_best(base, windows, base.starts, around.variant, around.track).chi2
    most = nothing - whole_sizes.chi2(base, best.variant, best.track, windows)
    reach = search_rules.reach_of_whole(best=best.total, gain=gain(base, best))
    for start in whole_sizes.starts(base):
        others = [s for s in base.starts if s.effect.key != start.effect.key]
        weigh = partial(_with_best, base, windows, others)
        look = partial(whole_sizes.looked_at, base, windows, weigh)
        for seen in whole_sizes.best_sizes(start, look, nothing, most):
            made = whole_sizes.fit_from(base, seen.variant, windows, reach)
            if made is not None:
                yield (start, *seen.beside), made


def _with_best(
    base: Base, windows: Sequence[int], others: Sequence[Start], variant: Variant, here: Track
) -> Seen:
    """A chair with the single one of other effects that fits these windows best, if any does.

    The parameters of this effect cost what they always do.
    """
    columns = {**base.nuisances, **base.columns}
    system = base.bench.system(here, columns, len(base.nuisances), variant, only=windows)
    reduced = bounded.reduce(system, windows)
    best = _best_of(reduced, others)
    if best is None:
        return Seen(reduced.total, variant)
    terms = (*variant.terms, *hypotheses.terms(reduced, best))
    return Seen(reduced.total - best.score, replace(variant, terms=terms), best.starts)


def _best_of(reduced: Reduced, others: Sequence[Start]) -> Hypothesis | None:
    """The single effect that fits best; None: none is worth its price, or the best cannot be."""
    best = next(iter(hypotheses.singles(reduced, others)), None)
    if best is None or best.score <= 0.0 or not hypotheses.can_be(reduced, best):
        return None
    return best


def beside_shimmy(base: Base, single: Fitted) -> Iterator[tuple[tuple[Start, ...], Fitted]]:
    """The fit of an effect that makes casters shimmy with what windows without a shimmy show.

    There it does little, so linear algebra around the chair as given is right. Around its own fit
    it is not: a mass 12 % too large had taken a motor's back EMF, and a rider who moves came first.

    Args:
      single: the best fit of an effect of a whole size.
    """
    (term,) = single.variant.terms
    windows = calm(base.bench.simulator.windows, base.bench.windows)
    reduced = bounded.reduce(base.system, windows)
    others = [s for s in base.starts if s.effect.key != term.effect.key]
    best = _best_of(reduced, others)
    if best is None:
        return
    begin = replace(single.variant, offsets={}, terms=(term, *hypotheses.terms(reduced, best)))
    shaken = frozenset(int(i) for i in base.bench.windows) - frozenset(windows)
    made = made_anew(base.bench, begin, replace(single.track, touchy=shaken))
    if made is not None:
        (start,) = (s for s in whole_sizes.starts(base) if s.effect.key == term.effect.key)
        yield (start, *best.starts), made
