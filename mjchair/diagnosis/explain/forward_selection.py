"""Forward selection: from one effect to as many as the data ask for.

In: fits. Out: the best hypothesis that was grown effect by effect, and the gap that it leaves. It
grows as long as it leaves a gap, or may hide a further effect, and a further effect is worth it.
"""

from __future__ import annotations

from mjchair.diagnosis import rules
from mjchair.diagnosis.explain import (
    alternatives,
    event,
    left_out,
    left_over,
    search_rules,
    whole_sizes,
)
from mjchair.diagnosis.explain.choice import Tried
from mjchair.diagnosis.explain.fits import Fits
from mjchair.diagnosis.explain.screening import gain, goes_far
from mjchair.diagnosis.explain.shortlist import (
    WithGap,
    best_of,
    best_single,
    better,
    everywhere,
    is_worth,
    of_size,
    promising,
)
from mjchair.diagnosis.fit import bounded

HIDDEN = 3  # further effects that are fitted where no gap is left


def grown(fits: Fits) -> WithGap | None:
    """The best hypothesis, grown effect by effect, and the gap that it leaves; None: there is none.

    It grows as long as a further effect is worth it.
    """
    if not _promises(fits):
        return None
    here = _grown_from(fits, _found(fits) or left_over.several(fits))
    other = alternatives.or_whole_beside(fits, here) if here else None
    return here if other is here else _grown_from(fits, other)


def _grown_from(fits: Fits, here: WithGap | None) -> WithGap | None:
    """The best hypothesis, grown from this one; None: there is none."""
    size = len(here[0].hypothesis.starts) if here else 0
    while size < search_rules.MOST and (here is None or here[1].exists or _may_hide(fits, here[0])):
        left = here is None or here[1].exists
        if size == 1 and left and _happened_once(fits, brought := _brought(fits, here)):
            return None if _is_rather_once(fits, brought) else here
        if here is not None and fits.must_end():
            break
        size += 1
        best = here[0] if here else None
        more = further(fits, best, size) if left or best is None else _hidden_beside(fits, best)
        if size == 1:
            more = alternatives.or_as_given(fits, more)
            more = alternatives.or_by_most_windows(fits, more)
        if more is None and here is None:
            continue
        if more is None or (here is not None and not is_worth(fits, here[0], more[0])):
            more = beyond_bound(fits, here, size) if here is not None else None
            size += 1
        if more is None:
            break  # where no second effect stands beside the first, no third does
        here = _settled(fits, more)
        if size == 1:
            here = alternatives.or_other_form(fits, _or_left_over(fits, here))
            here = _screened_anew(fits, alternatives.or_whole(fits, here))
    return here


def _may_hide(fits: Fits, best: Tried) -> bool:
    """Whether effects that leave no gap may hide a further one.

    Where a number that is only roughly known stands on its wall, it has closed the gap: torques
    15 % too small took a load of 20 kg for themselves, beside a rolling resistance. Where the chair
    answers otherwise than the one given, even columns around its fit tell only a part: a scrub
    promised 16 of chi2 beside a load, and brought 67.
    """
    if frozenset(best.hypothesis.keys) in fits.base.anew:
        return True
    return bool(bounded.at_walls(fits.anew(best).variant.offsets))


def _hidden_beside(fits: Fits, best: Tried) -> WithGap | None:
    """The best hypothesis with one effect more, of those that may hide beside the best.

    These are what linear algebra promises most of, and what every chair has a little of, whatever
    it promises of that. None leaves a gap, so the first is no better for leaving none.
    """
    with fits.near_to(best):
        likely = promising(fits, best)[:HIDDEN]
        known = {h.name for h in likely}
        common = [h for h in everywhere(fits, best) if h.name not in known]
        tried = [fits.believed(h, best) for h in (*likely, *common)]
    top = min((t for t in tried if t is not None), key=lambda t: t.price, default=None)
    return None if top is None else (top, fits.gap_after(top.fitted))


def _screened_anew(fits: Fits, here: WithGap) -> WithGap:
    """A fit with the gap that it leaves by columns around it, if its chair answers otherwise."""
    fitted = fits.anew(here[0])
    return (here[0], fits.gap_after(fitted)) if fits.screen_anew(fitted) else here


def _happened_once(fits: Fits, brought: float) -> bool:
    """Whether what happened once explains the gap as well as the best single effect does.

    A second effect would only follow it: a knock took 616 s of fits, and came as two effects.

    Args:
      brought: chi2 by the best single effect.
    """
    base = fits.base
    return not left_out.held_out_shows(base) and rules.is_clearly_once(
        event=event.largest(base).gain,
        gain=brought,
        excess=fits.gap_after(base.plain).excess,
    )


def _is_rather_once(fits: Fits, brought: float) -> bool:
    """Whether what happened once explains so much more that no effect is an answer."""
    once = event.largest(fits.base).gain
    return search_rules.is_of_one_run(by=once - brought, gain=once)


def _brought(fits: Fits, here: WithGap | None) -> float:
    """Chi2 that the best effects so far bring; 0: there are none."""
    return gain(fits.base, here[0].fitted) if here else 0.0


def _promises(fits: Fits) -> bool:
    """Whether any effect may bring anything, alone or beside those that were found before."""
    known = fits.base.found is not None or goes_far(fits.base.plain)
    return known or best_single(fits) is not None


def _found(fits: Fits) -> WithGap | None:
    """The effects that were found before the search, and the gap that they leave."""
    known = fits.base.found
    if known is None:
        return None
    best = Tried(fits.weigh(known.starts), known.fitted)
    fits.tried.append(best)
    return best, fits.gap_after(best.fitted)


def further(fits: Fits, best: Tried | None, size: int) -> WithGap | None:
    """The best hypothesis of this many effects, and the gap that it leaves; None: none can be.

    Args:
      best: of one effect less; None: there is none.
    """
    if best is not None and fits.near is not None:
        return best_of(fits, promising(fits, best), patient=False)
    top = None
    if best is not None:
        top = better(beside(fits, best), left_over.of_size(fits, size))
        for whole in _whole_ones_behind(fits, best):
            top = better(top, beside(fits, whole))
        if _closes(top, best):
            return top
    # Perhaps the first effect stands in for two others. Hypotheses that keep all effects of the
    # best are not fitted again here: they were weighed around its fit.
    but = () if best is None else best.hypothesis.keys
    return better(top, best_of(fits, of_size(fits, size), patient=best is None, but=but))


def beside(fits: Fits, best: Tried) -> WithGap | None:
    """The best hypothesis with one effect more, by the linear algebra around a fit.

    Around a chair without effects, a large effect is wrong by more than a small one brings: a
    payload of 40 kg hides that the centre of mass is 80 mm aside.

    Args:
      best: whose effects stay; everything is made anew around it.
    """
    with fits.near_to(best):
        return best_of(fits, promising(fits, best), patient=False)


def _whole_ones_behind(fits: Fits, best: Tried) -> list[Tried]:
    """Fits of a single effect of a whole size that brings a little less than the best single one.

    No small change leads to it beside another effect: a patch of the floor fitted wheels that
    shimmied and were toed by 6 % better than the shimmy did, and worse once both had the toe.
    """
    if len(best.hypothesis.starts) > 1:
        return []
    brings = gain(fits.base, best.fitted)
    return [
        t
        for t in fits.tried
        if t.hypothesis.keys != best.hypothesis.keys
        and len(t.hypothesis.starts) == 1
        and whole_sizes.parameter_of(t.hypothesis.starts[0].effect) is not None
        and search_rules.is_just_behind(gain=gain(fits.base, t.fitted), best=brings)
    ]


def _or_left_over(fits: Fits, here: WithGap) -> WithGap:
    """The single effect, or a better one that was left over while the noise was sought."""
    other = left_over.of_size(fits, 1) if here[1].exists else None
    if other is None or other[0].price >= here[0].price:
        return here
    return _settled(fits, other)


def _closes(more: WithGap | None, best: Tried) -> bool:
    """Whether a larger hypothesis is better than the best and leaves no gap.

    One that is worse may leave none as well, by what its own next step promises.
    """
    return more is not None and not more[1].exists and more[0].price < best.price


def beyond_bound(fits: Fits, here: WithGap, size: int) -> WithGap | None:
    """The best hypothesis of so many effects, with one more, where a size of it is on a bound.

    Two rims of different gain pushed the mass that moves on a chair to its bound.

    Args:
      here: the best so far, of fewer effects, to which the larger one must be worth adding.
    """
    bound = [
        t
        for t in fits.tried
        if len(t.hypothesis.starts) == size < search_rules.MOST
        and t.fitted.total < here[0].fitted.total
        and t.fitted.at_bound
    ]
    if not bound:
        return None
    more = beside(fits, min(bound, key=lambda t: t.fitted.total))
    return more if more is not None and is_worth(fits, here[0], more[0]) else None


def _settled(fits: Fits, here: WithGap) -> WithGap:
    """A fit with the gap that it leaves once everything is made anew around it.

    A gap is not laid to a further effect before this one is fitted well.
    """
    best, left = here
    return best, fits.gap_after(fits.anew(best)) if left.exists else left
