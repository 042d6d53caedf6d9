"""Which hypotheses are fitted, and in which order: those first that linear algebra likes best.

In: fits, and the linear algebra that stands there. Out: hypotheses, best first, of such a list the
best that can be, with its fit and the gap that it leaves, and whether a larger one is worth it.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from itertools import islice

import numpy as np

from mjchair.diagnosis.explain import hypotheses, search_rules
from mjchair.diagnosis.explain.candidates import Start
from mjchair.diagnosis.explain.choice import Tried
from mjchair.diagnosis.explain.fits import Fits
from mjchair.diagnosis.explain.gap import Gap
from mjchair.diagnosis.explain.hypotheses import Hypothesis
from mjchair.diagnosis.explain.left_out import held_out, with_terms
from mjchair.diagnosis.explain.screening import gain

TRIED = 3  # hypotheses of one size, where the first leaves a gap
LISTED = 6  # hypotheses of one size, until one can be, or where the linear order is coarse

WithGap = tuple[Tried, Gap]  # a fit, and the gap that it leaves


def of_size(fits: Fits, size: int) -> Sequence[Hypothesis]:
    """Hypotheses of this many effects around the chair without any, best first."""
    every = hypotheses.by_size(fits.base.reduced, fits.base.starts)
    return next(islice(every, size - 1, None))


def best_single(fits: Fits) -> Hypothesis | None:
    """The effect with which the search begins; None: none brings anything."""
    options = of_size(fits, 1)
    return _commonest(fits, options) if options and options[0].score > 0.0 else None


def with_one_more(
    fits: Fits, others: tuple[Start, ...], but: Collection[str] = ()
) -> list[Hypothesis]:
    """The others with each further effect, but for the effects of these keys; best first."""
    taken = {*but, *(s.effect.key for s in others)}
    pool: dict[str, Hypothesis] = {}
    for other in fits.base.starts:
        key = other.effect.key
        if key in taken:
            continue
        more = fits.weigh((*others, other))
        if not np.isfinite(more.score) or not fits.is_physical(more):
            continue
        if key not in pool or more.score > pool[key].score:
            pool[key] = more
    return sorted(pool.values(), key=lambda h: -h.score)


def promising(fits: Fits, best: Tried) -> list[Hypothesis]:
    """Hypotheses of one effect more that may be worth it by the linear algebra around a fit."""
    here = fits.weigh(best.hypothesis.starts)
    return [
        more
        for more in with_one_more(fits, best.hypothesis.starts)
        if search_rules.may_be_worth_adding(
            promised=more.gain - here.gain,
            parameters=more.free - here.free,
            gain=more.gain,
        )
    ]


def everywhere(fits: Fits, best: Tried) -> list[Hypothesis]:
    """Hypotheses of one effect more that every chair has a little of, the first form of each.

    What these runs do not show at all is left out.
    """
    starts = best.hypothesis.starts
    first = {s.effect.key: s for s in reversed(fits.base.starts) if s.effect.everywhere}
    more = [fits.weigh((*starts, s)) for k, s in first.items() if k not in best.hypothesis.keys]
    return [h for h in more if np.isfinite(h.score)]


def best_of(
    fits: Fits,
    options: Sequence[Hypothesis],
    patient: bool = True,
    but: Collection[str] = (),
    coarse: bool = False,
) -> WithGap | None:
    """The best hypothesis with its fit, and the gap that it leaves; None: none can be.

    Where the first leaves a gap, the linear order may be wrong, and the next are fitted too.

    Args:
      patient: whether, where none of these can be, the list is gone on along.
      but: effects; a hypothesis that has all of them is not fitted. Empty: any may be fitted.
      coarse: whether the linear order is of a chair far from the data: then more are fitted.
    """
    if not options or options[0].score <= 0.0:
        return None
    few = _first_few(fits, options, coarse)
    listed = [h for h in few if not but or not set(but) <= set(h.keys)]
    top = left = None
    for h in listed:
        if top is not None and fits.must_end():
            break
        more = fits.believed(h, top)
        if more is not None and (top is None or more.price < top.price):
            top, left = more, None
        if top is not None and h is listed[0]:
            left = fits.gap_after(top.fitted)
            if not left.exists:
                return top, left
    if top is None and patient:  # favourites that cannot be say nothing of the others
        believed = (fits.believed(other) for other in options[:LISTED])
        top = next((fit for fit in believed if fit is not None), None)
    return None if top is None else (top, left or fits.gap_after(top.fitted))


def _first_few(fits: Fits, options: Sequence[Hypothesis], coarse: bool) -> list[Hypothesis]:
    """The hypotheses that are fitted: the best, and those that may be as good."""
    first = _commonest(fits, options)
    near = [
        h
        for h in options
        if h.keys != first.keys
        and search_rules.worth_trying(
            score=h.score, best=first.score, gain=first.gain, coarse=coarse
        )
    ]
    return [first, *near[: (LISTED if coarse else TRIED) - 1]]


def better(one: WithGap | None, other: WithGap | None) -> WithGap | None:
    """The one with the lower price; None: there is neither."""
    return min((t for t in (one, other) if t is not None), key=lambda t: t[0].price, default=None)


def is_worth(fits: Fits, best: Tried, more: Tried) -> bool:
    """Whether a larger hypothesis brings enough; both with everything made anew."""
    base, one, other = fits.base, fits.anew(best), fits.anew(more)
    held = held_out(base.bench, with_terms(base, one), with_terms(base, other))
    return search_rules.worth_adding(
        gained=one.total - other.total,
        parameters=more.hypothesis.free - best.hypothesis.free,
        held=held,
        gain=gain(base, other),
    )


def _commonest(fits: Fits, options: Sequence[Hypothesis]) -> Hypothesis:
    """Of the hypotheses that fit alike, the one whose effects stand first in the library."""
    order = {s.effect.key: k for k, s in reversed(list(enumerate(fits.base.starts)))}
    alike = [h for h in options if search_rules.alike(h.score, options[0].score)]
    return freed(fits, min(alike, key=lambda h: sorted(order[k] for k in h.keys)))


def freed(fits: Fits, hypothesis: Hypothesis) -> Hypothesis:
    """The hypothesis with both sides of an effect free, where one or the other fit alike."""
    for start in hypothesis.starts:
        hypothesis = _freed(fits, hypothesis, start)
    return hypothesis


def _freed(fits: Fits, hypothesis: Hypothesis, start: Start) -> Hypothesis:
    """The hypothesis with more of an effect's parameters free, where others of them fit alike.

    A left drive 3 % weak and a right one 3 % strong differ by what the mass may be: then neither
    number alone has the uncertainty that it shows.
    """
    others = tuple(s for s in hypothesis.starts if s is not start)
    same = [s for s in fits.base.starts if s.group == start.group and s.effect.seeds is None]
    weighed = {s.columns: fits.weigh((*others, s)) for s in same}
    alike = {
        column
        for columns, h in weighed.items()
        if len(columns) <= len(start.columns) and search_rules.alike(h.score, hypothesis.score)
        for column in columns
    }
    richer = [c for c in weighed if alike <= set(c)]
    return weighed[min(richer, key=len)] if len(alike) > len(start.columns) else hypothesis
