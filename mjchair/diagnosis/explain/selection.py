"""The search for effects: from one to as many as the data need, compared with rivals.

In: fits around the screened columns. Out: a `Choice`, or None where no effect brings anything. The
rules that decide stand in rules.py; a hypothesis that this chair cannot have is dropped and noted.
"""

from __future__ import annotations

from dataclasses import replace

from mjchair.diagnosis import rules
from mjchair.diagnosis.explain.backward_elimination import without_needless
from mjchair.diagnosis.explain.choice import Choice, Tried
from mjchair.diagnosis.explain.fits import Fits
from mjchair.diagnosis.explain.forward_selection import grown
from mjchair.diagnosis.explain.null_ensemble import confirmed
from mjchair.diagnosis.explain.probable import better_than
from mjchair.diagnosis.explain.rivals import against_rivals, own_gains
from mjchair.diagnosis.explain.shortlist import freed
from mjchair.diagnosis.fit.nonlinear import Fitted


def choose(fits: Fits) -> Choice | None:
    """Grow from one effect to as many as the data ask for; None: no effect brings anything.

    Args:
      fits: around the base; those that were made already are used.
    """
    here = grown(fits)
    if here is None:
        return None
    best, rivals = against_rivals(fits, without_needless(fits, here[0]))
    better = better_than(fits, _choice(fits, best, fits.anew(best), rivals))
    if better is not None:
        best, rivals = against_rivals(fits, without_needless(fits, better))
    best = _with_both_sides(fits, best)
    fits.say("the last fit, with everything made anew around it")
    found = _choice(fits, best, fits.last_fit(best), rivals)
    return replace(found, after=confirmed(fits.base, found.fitted, found.after))


def _choice(fits: Fits, best: Tried, fitted: Fitted, rivals: list[list[Tried]]) -> Choice:
    """The best hypothesis as the choice.

    Args:
      fitted: its fit with everything made anew around it. rivals: of each of its effects.
    """
    return Choice(
        hypothesis=best.hypothesis,
        fitted=fitted,
        after=fits.gap_after(fitted),
        rivals=rivals,
        own_gains=own_gains(fits, best),
        tried=fits.tried,
        dropped=fits.dropped,
    )


def _with_both_sides(fits: Fits, best: Tried) -> Tried:
    """The choice with both sides of an effect free, where the data leave open which side it is.

    A rival may have come in by one side alone: of two wheels that differ by 1 mm nothing tells
    whether one is larger or the other smaller than was said.
    """
    both = freed(fits, best.hypothesis)
    if both.free == best.hypothesis.free:
        return best
    tried = fits.fit(both, best)
    if tried is None or tried.fitted.total > best.fitted.total + rules.NOTHING:
        return best
    return tried
