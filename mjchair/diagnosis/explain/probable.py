"""Hypotheses that are probable beside the choice by linear algebra alone, fitted.

In: fits, and the choice. Out: a hypothesis that is better than the choice, or None; what was fitted
stands among the fits. Constant and viscous friction of a bearing are nearly a rolling resistance
with the drag of the air, so one effect may close the gap that two others made. No pair is fitted
then, and what linear algebra around the chair without effects promises of it is rough.
"""

from __future__ import annotations

from mjchair.diagnosis.explain import hypotheses
from mjchair.diagnosis.explain.choice import Choice, Tried
from mjchair.diagnosis.explain.fits import Fits
from mjchair.diagnosis.explain.hypotheses import Hypothesis
from mjchair.diagnosis.explain.probability import probabilities, shown
from mjchair.diagnosis.explain.rivals import better_of

FITTED = 3  # hypotheses, at most


def better_than(fits: Fits, choice: Choice) -> Tried | None:
    """The best of the probable hypotheses that is better than the choice; None: none is."""
    chosen = Tried(choice.hypothesis, choice.fitted)
    made = [fits.fit(hypothesis, chosen) for hypothesis in _not_yet_fitted(fits, choice)]
    found = [(t, choice.brought_beyond(t.hypothesis)) for t in made if t is not None]
    return better_of(fits, chosen, found)


def _not_yet_fitted(fits: Fits, choice: Choice) -> list[Hypothesis]:
    """The probable hypotheses that linear algebra alone has weighed, most probable first."""
    probability = probabilities(fits.base, choice)
    known = {t.hypothesis.name for t in fits.tried}
    worth = shown(probability, choice.hypothesis.name) - known
    if not worth:
        return []
    reduced, starts = fits.base.reduced, fits.base.starts
    weighed = (*hypotheses.singles(reduced, starts), *hypotheses.pairs(reduced, starts))
    found = [h for h in weighed if h.name in worth]
    return sorted(found, key=lambda h: -probability[h.name])[:FITTED]
