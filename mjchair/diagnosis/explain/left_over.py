"""Effects that were left over while the noise was sought, in the search for effects.

While the noise is sought, the best hypothesis of any size is fitted. In it, effects that only made
up for a large one being no linear one come to nothing; what is clear is left over. In: fits. Out:
the fit of what was left over, with the gap that it leaves, or None where that is no answer.
"""

from __future__ import annotations

from mjchair.diagnosis import rules
from mjchair.diagnosis.explain import whole_sizes
from mjchair.diagnosis.explain.candidates import Start
from mjchair.diagnosis.explain.fits import Fits
from mjchair.diagnosis.explain.screening import Base
from mjchair.diagnosis.explain.shortlist import WithGap, best_single, is_worth


def effects(base: Base) -> list[Start]:
    """The effects that are clear of what was best while the noise was sought."""
    known = base.best
    if known is None:
        return []
    return [s for s in known.starts if known.fitted.sigmas[s.effect.key] > rules.SIGMAS]


def of_size(fits: Fits, size: int) -> WithGap | None:
    """What was left over, or what it was left over of, if of so many effects; None: it is not.

    The first effect of a search may stand in for two others, whose fit is at hand. A single effect
    that nothing else was fitted with is one with which the search begins anyway.
    """
    known, left = fits.base.best, effects(fits.base)
    if known is None or size not in (len(left), len(known.starts)) or len(known.starts) == 1:
        return None
    every = fits.weigh(left if len(left) == size else known.starts)
    fits.begin_at(every, known.fitted)
    tried = fits.believed(every)
    return None if tried is None else (tried, fits.gap_after(tried.fitted))


def several(fits: Fits) -> WithGap | None:
    """Several effects that were left over and leave no gap; None: one may be enough.

    Where the best single effect leaves a gap and these leave none, the usual way from one effect
    to several is not gone. Of a caster that shimmies small changes tell nothing.
    """
    count = len(effects(fits.base))
    single = best_single(fits)
    if count < 2 or single is None or whole_sizes.shimmies(fits.base):
        return None
    alone = fits.believed(single)
    if alone is not None and not fits.gap_after(alone.fitted).exists:
        return None
    together = of_size(fits, count)
    if together is None or together[1].exists:
        return None
    return together if alone is None or is_worth(fits, alone, together[0]) else None
