"""The search for effects: from one to as many as the data need, compared with rivals.

In: fits around the screened columns. Out: the gap, and a `Choice`, or None where there is no gap or
no effect brings anything. The rules that decide stand in rules.py; a hypothesis that this chair
cannot have is dropped and noted.
"""

from __future__ import annotations

from dataclasses import replace

from mjchair.diagnosis import rules
from mjchair.diagnosis.explain import alternatives, one_run, search_rules
from mjchair.diagnosis.explain.backward_elimination import without_needless
from mjchair.diagnosis.explain.candidates import Start
from mjchair.diagnosis.explain.choice import Choice, Tried
from mjchair.diagnosis.explain.fits import Fits
from mjchair.diagnosis.explain.forward_selection import grown
from mjchair.diagnosis.explain.gap import Gap
from mjchair.diagnosis.explain.left_out import plain_gap
from mjchair.diagnosis.explain.multistart import made_anew
from mjchair.diagnosis.explain.null_ensemble import confirmed
from mjchair.diagnosis.explain.probable import better_than
from mjchair.diagnosis.explain.rivals import against_rivals, own_gains
from mjchair.diagnosis.explain.screening import Base, nuisances_of
from mjchair.diagnosis.explain.shortlist import freed
from mjchair.diagnosis.fit.nonlinear import Fitted


def explained(fits: Fits) -> tuple[Base, Gap, Choice | None]:
    """The chair without effects, the gap that it leaves, and the choice of effects that close it.

    Where none of these is surely there, they may only have helped the fit past a place where the
    chair without effects was stuck. If that fits better from there, all begins again around it.

    Args:
      fits: around the screened columns.
    """
    fits.say("the gap")
    gap = plain_gap(fits.base)
    fits.say("effects, one and two at a time")
    choice = choose(fits) if gap.exists and not one_run.is_clear(fits.base, gap) else None
    if choice is None or max(choice.fitted.sigmas.values()) > rules.SIGMAS:
        return fits.base, gap, choice
    plain = plain_from(fits.base, choice.fitted)
    if plain is None:
        return fits.base, gap, choice
    return explained(Fits(replace(fits.base, plain=plain), fits.say))


def plain_from(base: Base, fitted: Fitted) -> Fitted | None:
    """The chair without effects from where they ended, if it fits better there; None: it does not.

    Args:
      fitted: with effects.
    """
    start = replace(fitted.variant, terms=())
    plain = made_anew(base.bench, start, fitted.track, nuisances_of(base, fitted))
    if plain is None or base.plain.total - plain.total <= search_rules.WORTH:
        return None
    return plain


def choose(fits: Fits) -> Choice | None:
    """Grow from one effect to as many as the data ask for; None: no effect brings anything.

    Args:
      fits: around the base; those that were made already are used.
    """
    here = grown(fits)
    if here is None:
        return None
    formed = alternatives.or_other_form_beside(fits, here[0])
    best, rivals = against_rivals(fits, without_needless(fits, formed))
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
        unfinished=fits.ended,
    )


def _with_both_sides(fits: Fits, best: Tried) -> Tried:
    """The choice with both sides of an effect free, where the data leave open which side it is.

    A rival may have come in by one side alone: of two wheels that differ by 1 mm nothing tells
    whether one is larger or the other smaller than was said.
    """
    if not _with_more(fits, best):
        return best
    with fits.near_to(best):
        both = freed(fits, best.hypothesis)
        tried = None if both.free == best.hypothesis.free else fits.fit(both, best)
    if tried is not None and tried.fitted.total <= best.fitted.total + search_rules.NOTHING:
        best = tried
    richer = _with_more(fits, best)
    if not richer:
        return best
    with fits.near_to(best):
        unclear = [(s, more) for s, more in richer if _is_unclear(fits, best, s, more)]
    for start, more in unclear:
        best = _freed_in_place(fits, best, start, more) or best
    return best


def _with_more(fits: Fits, best: Tried) -> list[tuple[Start, Start]]:
    """The starts of the chosen effects of which more can be free, each with the one that is."""
    starts = best.hypothesis.starts
    return [(s, more) for s in starts if (more := _richest(fits, s)) is not None]


def _richest(fits: Fits, start: Start) -> Start | None:
    """The start of the same effect that frees most; None: this one does."""
    same = [s for s in fits.base.starts if s.group == start.group and s.effect.seeds is None]
    more = max(same, key=lambda s: len(s.columns), default=start)
    return more if set(more.columns) > set(start.columns) else None


def _is_unclear(fits: Fits, best: Tried, start: Start, more: Start) -> bool:
    """Whether linear algebra around the choice does not tell what freeing more brings.

    With more parameters free nothing fits worse, so where it says that something does, it tells
    nothing.
    """
    starts = best.hypothesis.starts
    others = tuple(s for s in starts if s is not start)
    return fits.weigh((*others, more)).gain < fits.weigh(starts).gain - search_rules.NOTHING


def _freed_in_place(fits: Fits, best: Tried, start: Start, more: Start) -> Tried | None:
    """The choice with more of one effect free, from where it stands; None: it stays as it is.

    It stays where what was free before is surely away from neutral beside the rest as well, and
    where the fit is worse. Nothing fits worse with more free, so what fits alike has not come to
    its end: the sides of two wheels 2.7 mm apart, which the data leave open, were 2.6 behind.

    Args:
      start: which of the chosen. more: with more parameters free.
    """
    key, chosen = start.effect.key, best.fitted
    terms = tuple(
        replace(t, free=more.free) if t.effect.key == key else t for t in chosen.variant.terms
    )
    made = made_anew(fits.base.bench, replace(chosen.variant, terms=terms), chosen.track)
    if made is None or not search_rules.alike(-made.total, -chosen.total):
        return None
    (term,) = (t for t in made.variant.terms if t.effect.key == key)
    if any(
        abs(term.values[p.name] - p.neutral) > rules.SIGMAS * made.std[i]
        for i, p in term.parameters
        if p.name in start.free
    ):
        return None
    starts = tuple(more if s is start else s for s in best.hypothesis.starts)
    tried = Tried(replace(best.hypothesis, starts=starts), made)
    fits.keep_better(tried)
    return tried
