"""Effects that linear algebra around the chair without effects does not see, or sees small.

In: fits, and the effect that is best so far, with the gap that it leaves. Out: the same, or a
better one: with what is only roughly known nearly as given, by most windows alone, in another form,
or of a whole size, alone or beside one other.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import replace
from operator import attrgetter

import numpy as np

from mjchair.diagnosis import rules
from mjchair.diagnosis.explain import hypotheses, search_rules, whole_beside, whole_sizes
from mjchair.diagnosis.explain.candidates import Start
from mjchair.diagnosis.explain.choice import Tried
from mjchair.diagnosis.explain.fits import Fits, believable
from mjchair.diagnosis.explain.hypotheses import Hypothesis
from mjchair.diagnosis.explain.screening import Base, goes_far
from mjchair.diagnosis.explain.shortlist import WithGap, best_of, better
from mjchair.diagnosis.fit import bounded
from mjchair.diagnosis.fit.bounded import Reduced
from mjchair.diagnosis.fit.nonlinear import Fitted

APART = 10.0  # times the chi2 of most windows: there a chair went another way (assumption)
NARROW = 1.0  # standard deviations: a wall for what may have taken an effect for itself


def or_as_given(fits: Fits, here: WithGap | None) -> WithGap | None:
    """The single effect, or a better one that leaves what is roughly known nearly as given.

    What is roughly known may take an effect for itself, some numbers far from what they are
    known to be. Then linear algebra that is wrong by little of a large effect does not see the
    effect; with nearer walls it does. From there on it weighs with these. The chair as given is
    then far from the data, and the order of effects around it is coarse: more of them are fitted.
    """
    wide = fits.base
    if not goes_far(wide.plain):
        return here
    if here is not None and not here[1].exists and not goes_far(here[0].fitted):
        return here
    return _or_weighed_by(fits, wide.reduced.narrowed(NARROW), here, coarse=True)


def or_by_most_windows(fits: Fits, here: WithGap | None) -> WithGap | None:
    """The single effect, or a better one by the linear algebra of most windows alone.

    Where a chair went another way, as where a caster swivels to the other side, no small change
    explains what is seen, and the windows in which it did hide what the others say: the angle
    sensor of the caster was taken for what a wheel did that is 2 mm larger.
    """
    wide = fits.base
    most = _most_windows(wide)
    if len(most) == len(wide.bench.windows) or (here is not None and not here[1].exists):
        return here
    return _or_weighed_by(fits, bounded.reduce(wide.system, most), here)


def _or_weighed_by(
    fits: Fits, reduced: Reduced, here: WithGap | None, coarse: bool = False
) -> WithGap | None:
    """The single effect, or a better one by other linear algebra, which then weighs on."""
    before = fits.base
    fits.base = replace(before, reduced=reduced)
    options = hypotheses.singles(reduced, before.starts)
    other = best_of(fits, options, patient=False, coarse=coarse)
    best = better(here, other)
    if best is here:
        fits.base = before
    return best


def or_other_form(fits: Fits, here: WithGap) -> WithGap:
    """The single effect, or another form of it that is better or leaves no gap.

    A wave in step with the strokes has few parameters and is enough for few strokes; many show
    its harmonics as well. A form that leaves no gap must come near in chi2 with the penalty of its
    parameters.
    """
    best, left = here
    if not left.exists:
        return here
    for hypothesis in _other_forms(fits, best):
        other = fits.believed(hypothesis, best)
        if other is None or other.price >= best.price + rules.RIVAL_CHI2:
            continue
        after = fits.gap_after(fits.anew(other))
        if not after.exists:
            return other, after
        if other.price < here[0].price:
            here = other, after
    return here


def or_other_form_beside(fits: Fits, best: Tried) -> Tried:
    """Several effects, or the same with one of them in another form that is better.

    A further effect may have made up for a wrong form: one caster that sticks, with the late angle
    of the other, stood 50 of chi2 behind two casters that stick alike.
    """
    if len(best.hypothesis.starts) == 1:
        return best
    for hypothesis in _other_forms(fits, best):
        other = fits.fit(hypothesis, best)
        if other is not None and other.price < best.price:
            best = other
    return best


def _other_forms(fits: Fits, best: Tried) -> list[Hypothesis]:
    """The effects with one of them in another form, if it may be as good, best first."""
    starts, firsts = best.hypothesis.starts, []
    for own in starts:
        forms: dict[int, list[Hypothesis]] = {}
        for start in fits.base.starts:
            if start.effect.key == own.effect.key and start.effect is not own.effect:
                weighed = fits.weigh([start if s is own else s for s in starts])
                forms.setdefault(id(start.effect), []).append(weighed)
        firsts += [max(weighed, key=lambda h: h.score) for weighed in forms.values()]
    near = [
        h
        for h in firsts
        if fits.is_physical(h)
        and search_rules.worth_trying(
            score=h.score, best=best.hypothesis.score, gain=best.hypothesis.gain
        )
    ]
    return sorted(near, key=lambda h: -h.score)


def or_whole(fits: Fits, here: WithGap) -> WithGap:
    """The single effect, or one of a whole size that is better.

    These are tried where the first leaves a gap or what is roughly known far away, or a caster
    shimmies. Small changes do not lead there, and what they lead to may stand in for it: a patch of
    the floor for wheels that shimmy once, a centre of mass and an inertia for a turn that ends.
    """
    settled = not here[1].exists and not goes_far(here[0].fitted)
    if settled and not whole_sizes.shimmies(fits.base):
        return here
    made = whole_sizes.fits(fits.base, fits.anew(here[0]))
    return _or_made(fits, here, (((start,), fitted) for start, fitted in made))


def or_whole_beside(fits: Fits, here: WithGap) -> WithGap:
    """The effects, or a better one of a whole size, alone or beside one other.

    These are tried where it takes several effects, or one leaves a gap. What small changes lead to
    may then stand in for both: a centre of mass, a drive and a rolling resistance for bearings that
    rub and tires that resist turning, and a drive with a rider who sways for these tires alone.
    Beside one that is in already, and makes casters shimmy, another may stand in for the right one.
    """
    best = here[0]
    starts = best.hypothesis.starts
    if len(starts) == 1 and not here[1].exists:
        return here
    whole = {s.effect.key for s in starts if whole_sizes.parameter_of(s.effect) is not None}
    if whole:
        return _or_beside_shimmy(fits, here, whole)
    single = _best_single(fits) or fits.base.plain
    return _or_made(fits, here, whole_beside.fits(fits.base, single, fits.anew(best)))


def _or_beside_shimmy(fits: Fits, here: WithGap, whole: Collection[str]) -> WithGap:
    """The effects, or a better one beside what makes casters shimmy, if any do.

    Args:
      whole: effects of a whole size that are in.
    """
    single = _best_single(fits, whole)
    if single is None or not whole_sizes.shimmies(fits.base):
        return here
    return _or_made(fits, here, whole_beside.beside_shimmy(fits.base, single))


def _best_single(fits: Fits, keys: Collection[str] = ()) -> Fitted | None:
    """The best fit of a single effect, of these keys if there are any; None: none was made."""
    singles = [t for t in fits.tried if len(t.hypothesis.starts) == 1]
    some = [t.fitted for t in singles if not keys or t.hypothesis.keys[0] in keys]
    return min(some, key=attrgetter("total"), default=None)


def _or_made(
    fits: Fits, here: WithGap, made: Iterable[tuple[tuple[Start, ...], Fitted]]
) -> WithGap:
    """The effects, or a better one of fits that were made elsewhere, which are kept."""
    best = here[0]
    for starts, fitted in made:
        tried = Tried(fits.weigh(starts), fitted)
        fits.keep_better(tried)
        if tried.price < best.price and believable(fitted):
            best = tried
    return here if best is here[0] else (best, fits.gap_after(best.fitted))


def _most_windows(base: Base) -> list[int]:
    """The windows that are fitted to, but for those that disagree far more than most do."""
    chi2 = base.plain.chi2
    return [int(i) for i in base.bench.windows[chi2 <= APART * np.median(chi2)]]
