"""Backward elimination: a hypothesis without the effects that it can do without.

In: fits, and a hypothesis with its fit. Out: the same, or one of fewer effects.
"""

from __future__ import annotations

from mjchair.diagnosis import rules
from mjchair.diagnosis.explain import search_rules
from mjchair.diagnosis.explain.choice import Tried
from mjchair.diagnosis.explain.fits import Fits


def without_needless(fits: Fits, tried: Tried) -> Tried:
    """The hypothesis without the effects that it can do without."""
    hypothesis = tried.hypothesis
    if len(hypothesis.starts) == 1:
        return tried
    fitted = fits.anew(tried)
    for start in hypothesis.starts:
        sigmas = fitted.sigmas[start.effect.key]
        fewer = fits.weigh([s for s in hypothesis.starts if s is not start])
        parameters = hypothesis.free - fewer.free
        less = hypothesis.gain - fewer.gain
        if search_rules.surely_needed(sigmas=sigmas, lost=less, parameters=parameters):
            continue
        if sigmas < rules.SIGMAS:
            fits.begin_at(fewer, fitted)
        other = fits.fit(fewer)
        if other is None:
            continue
        lost = fits.anew(other).total - fitted.total
        if search_rules.can_be_dropped(lost=lost, parameters=parameters):
            return without_needless(fits, other)
    return tried
