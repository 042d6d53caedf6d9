"""Hypotheses that are probable beside the choice by linear algebra alone, or nearly so, fitted.

In: fits, and the choice. Out: a hypothesis that is better than the choice, or None; what was fitted
stands among the fits. Constant and viscous friction of a bearing are nearly a rolling resistance
with the drag of the air, so one effect may close the gap that two others made. No pair is fitted
then, and what linear algebra around the chair without effects promises of it is rough. So a pair
that it promises to be about as good is fitted as well where it is hardly probable, since single
effects are more common: an air drag of 0.9 m^2 with a rolling resistance promised 13 of chi2 more
than a bearing's friction of 95 %, and brings 15 more; one of 0.8 m^2 promised 6 less with the price
of its numbers, and fits as well. An effect whose answer is no straight line of its
size brings more than that: a wind of 3.6 m/s came 5 % behind a slope with a bearing's friction, and
was better than both once it was fitted. Where several effects were found while the noise was
sought, single ones that are near the best single one were not fitted either: a centre of mass 48 mm
aside promised 785 of chi2 beside 808 of a torque's gain, and brings 1339, more than that gain with
the drag of the air.
"""

from __future__ import annotations

from mjchair.diagnosis import rules
from mjchair.diagnosis.explain import hypotheses, search_rules
from mjchair.diagnosis.explain.calibration import holds
from mjchair.diagnosis.explain.choice import Choice, Tried
from mjchair.diagnosis.explain.fits import Fits
from mjchair.diagnosis.explain.hypotheses import Hypothesis
from mjchair.diagnosis.explain.probability import probabilities, shown
from mjchair.diagnosis.explain.rivals import better_of

FITTED = 3  # hypotheses, at most
LEAST = 5e-4  # probability of what is weighed for that


def better_than(fits: Fits, choice: Choice) -> Tried | None:
    """The best of the probable hypotheses that is better than the choice; None: none is."""
    chosen = choice.own
    made = [fits.fit(h, _best_of_size(fits, h, chosen)) for h in _not_yet_fitted(fits, choice)]
    found = [(t, choice.brought_beyond(t.hypothesis)) for t in made if t is not None]
    return better_of(fits, chosen, found)


def _best_of_size(fits: Fits, hypothesis: Hypothesis, chosen: Tried) -> Tried:
    """The best fit of as many effects, of which linear algebra is alike wrong; else the choice."""
    size = len(hypothesis.starts)
    alike = [t for t in fits.tried if len(t.hypothesis.starts) == size]
    return min(alike, key=lambda t: t.fitted.total, default=chosen)


def _not_yet_fitted(fits: Fits, choice: Choice) -> list[Hypothesis]:
    """What linear algebra alone has weighed, most probable first: the probable, and what promises
    about as much as the choice. Then single effects that are just behind several, or behind the
    best single one."""
    probability = probabilities(fits.base, choice)
    known = {t.hypothesis.name for t in fits.tried}
    unfitted = {n for n, p in probability.items() if p > LEAST} - known
    reduced, starts = fits.base.reduced, fits.base.starts
    singles = hypotheses.singles(reduced, starts)
    pairs = hypotheses.pairs(reduced, starts) if unfitted else []
    found = [h for h in (*singles, *pairs) if h.name in unfitted]
    if found:
        worth = shown(probability, choice.hypothesis.name)
        promised = fits.weigh(choice.hypothesis.starts)
        found = [h for h in found if h.name in worth or _is_near(h, promised)]
    beside = known.union(h.name for h in found)
    left = [h for h in singles if h.name not in beside and _may_be_better(h, singles, choice)]
    return [*sorted(found, key=lambda h: -probability[h.name]), *left][:FITTED]


def _is_near(hypothesis: Hypothesis, chosen: Hypothesis) -> bool:
    """Whether linear algebra promises about as much of other effects as of those chosen."""
    near = hypothesis.score > chosen.score - rules.RIVAL_CHI2
    return near and not holds(hypothesis.name, chosen.name)


def _may_be_better(single: Hypothesis, singles: list[Hypothesis], choice: Choice) -> bool:
    """Whether a single effect may be better than the several that were chosen."""
    chosen, best = choice.hypothesis, singles[0]
    if len(chosen.starts) == 1 or single.name in chosen.keys:
        return False
    return search_rules.is_just_behind(
        gain=single.gain, best=chosen.gain
    ) or search_rules.worth_trying(score=single.score, best=best.score, gain=best.gain)
