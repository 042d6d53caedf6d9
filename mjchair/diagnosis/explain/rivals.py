"""Rivals: what could stand in the place of each effect that was chosen, and what fits better.

In: fits, and the hypothesis that was chosen. Out: the best of it and its rivals, and the rivals of
that one which the data do not rule out.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import replace
from itertools import chain
from operator import attrgetter, itemgetter

import numpy as np

from mjchair.diagnosis import rules
from mjchair.diagnosis.explain import search_rules
from mjchair.diagnosis.explain.backward_elimination import without_needless
from mjchair.diagnosis.explain.candidates import Start
from mjchair.diagnosis.explain.choice import Choice, Tried, is_pushed, is_there
from mjchair.diagnosis.explain.fits import Fits, believable
from mjchair.diagnosis.explain.hypotheses import Hypothesis
from mjchair.diagnosis.explain.left_out import speaks_against
from mjchair.diagnosis.explain.probability import shown
from mjchair.diagnosis.explain.screening import Base, gain, overstated
from mjchair.diagnosis.explain.shortlist import with_one_more
from mjchair.diagnosis.fit.nonlinear import Fitted

REFITTED = 5  # rivals of an effect that is alone
BESIDE = 3  # rivals of each effect that has others beside it
NEAR = rules.RIVAL_CHI2  # chi2 behind, at which columns that are made anew may bring a rival first
SWAPS = 2  # times that a rival takes the place of the chosen hypothesis


def against_rivals(fits: Fits, chosen: Tried) -> tuple[Tried, list[list[Tried]]]:
    """The best of the chosen hypothesis and what could stand in its places, with its rivals.

    Linear algebra chose; a rival that is better once both are made anew takes the place.
    """
    rivals = rivals_of(fits, chosen)
    for _ in range(SWAPS):
        for rival in chain.from_iterable(rivals):
            chosen = fits.in_states_of(chosen, rival)
        own = own_gains(fits, chosen)
        better = better_of(
            fits, chosen, [(r, g) for group, g in zip(rivals, own, strict=True) for r in group]
        )
        if better is None:
            break
        chosen = without_needless(fits, better)
        rivals = rivals_of(fits, chosen)
    return chosen, rivals


def better_of(fits: Fits, chosen: Tried, rivals: Sequence[tuple[Tried, float]]) -> Tried | None:
    """The best of the rivals that are better than the choice; None: none is.

    Columns that were made without the effects are wrong by some chi2, more for one hypothesis
    than for another, so of those that are near everything is made anew.

    Args:
      rivals: each with the chi2 that the effects bring in whose place it would stand.
    """

    def ahead(rival: Tried, own: float, anew: bool) -> float:
        """Chi2 by which a rival is better: as far as the form of effects lets the data count, and
        by how much more common it is."""
        made = [fits.anew(t) if anew else t.fitted for t in (chosen, rival)]
        mine, theirs = (fitted.total + fitted.confined for fitted in made)
        one, other = chosen.hypothesis, rival.hypothesis
        more_common = other.prior - one.prior
        fewer, better = len(one.starts) - len(other.starts), mine - theirs
        if fewer < 0 and better < (0.0 if anew else -NEAR):
            return -np.inf  # more effects than what fits better
        if fewer > 0 and better > 0.0:
            more_common += search_rules.TOGETHER * fewer
        by = better + one.cost - other.cost
        return search_rules.counts(by, gain=own) + more_common

    near = [(r, g) for r, g in rivals if believable(r.fitted) and ahead(r, g, False) > -NEAR]
    found = [(ahead(r, g, True), r) for r, g in near]
    best, rival = max(found, key=itemgetter(0), default=(0.0, None))
    return rival if best > 0.0 else None


def rivals_of(fits: Fits, chosen: Tried) -> list[list[Tried]]:
    """For every effect of the choice: what could stand in its place, best first.

    In the place of all but the largest effect, it is weighed around the fit: around a chair
    without effects, the largest is wrong by more than the others bring. So is the largest where
    that chair itself is far from where its fit leads.
    """
    own = own_gains(fits, chosen)
    coarse = search_rules.is_coarse(
        overstated=overstated(fits.base), gain=gain(fits.base, chosen.fitted)
    )
    out = []
    for start, brought in zip(chosen.hypothesis.starts, own, strict=True):
        around_base = brought == max(own) and not coarse
        with nullcontext() if around_base else fits.near_to(chosen):
            out.append(_rivals(fits, chosen, start, brought))
    return out


def own_gains(fits: Fits, chosen: Tried) -> list[float]:
    """Of every effect of the chosen hypothesis, the chi2 that it brings beside the others."""
    return [_own_gain(fits, chosen, start) for start in chosen.hypothesis.starts]


def _own_gain(fits: Fits, chosen: Tried, start: Start) -> float:
    starts = chosen.hypothesis.starts
    whole = gain(fits.base, chosen.fitted)
    others = [s for s in starts if s is not start]
    if not others:
        return whole
    with fits.near_to(chosen):
        own = fits.weigh(starts).gain - fits.weigh(others).gain
    # around a stuck caster, linear algebra does not see that it turns without the friction
    without = [t.fitted.total for t in _of_keys(fits.tried, {s.effect.key for s in others})]
    own = max(own, min(without, default=-np.inf) - chosen.fitted.total)
    return float(np.clip(own, 0.0, max(whole, 0.0)))


def _rivals(fits: Fits, chosen: Tried, start: Start, own: float) -> list[Tried]:
    """What could stand in the place of one effect, which brings `own` of chi2."""
    starts = chosen.hypothesis.starts
    others = tuple(s for s in starts if s is not start)
    here = chosen.hypothesis if fits.near is None else fits.weigh(starts)
    options = with_one_more(fits, others, {start.effect.key})
    near = [h for h in options if _close(here, h, own)]
    # the first is always fitted: by linear algebra a payload of 25 kg brings 53 of 1015 less than
    # torque gains 13 % low, and once it is fitted it brings 47 more
    if not near:
        near = [
            h for h in options[:1] if search_rules.may_be_alike(less=here.gain - h.gain, own=own)
        ]
    tried = [fits.fit(h, chosen) for h in near[: REFITTED if not others else BESIDE]]
    tried += _in_place_of(fits.tried, chosen.hypothesis, start, [h.keys for h in near])
    made = [fits.in_states_of(t, chosen) for t in tried if t is not None]
    return [
        t
        for t in made
        if is_there(t.fitted)
        and _not_ruled_out(t, chosen, own, _harm(fits.base, t.fitted, chosen.fitted))
    ]


def _close(chosen: Hypothesis, other: Hypothesis, own: float) -> bool:
    """Whether a rival is near enough, by linear algebra, to be fitted.

    Args:
      own: chi2 that the effect brings in whose place it would stand.
    """
    behind, less = chosen.score - other.score, chosen.gain - other.gain
    return search_rules.worth_refitting(behind=behind, gain=own, rival_gain=own - less)


def _in_place_of(
    tried: Sequence[Tried], chosen: Hypothesis, start: Start, but: Collection[Sequence[str]]
) -> list[Tried]:
    """The best of what was fitted before of the chosen effects with another in place of one.

    Linear algebra around a fit may not see how two large effects replace one another.

    Args:
      but: keys of hypotheses that are left out.
    """
    own = start.effect.key
    stay = set(chosen.keys) - {own}
    fits = [
        t
        for t in tried
        if len(t.hypothesis.starts) == len(chosen.starts)
        and stay < set(t.hypothesis.keys)
        and own not in t.hypothesis.keys
    ]
    return _best_of_each(fits, but)


def _best_of_each(tried: Sequence[Tried], but: Collection[Sequence[str]]) -> list[Tried]:
    """The best fit of each hypothesis, but for those with these keys."""
    seen = [set(keys) for keys in but]
    fits = [t for t in tried if set(t.hypothesis.keys) not in seen]
    best = {t.hypothesis.name: t for t in sorted(fits, key=lambda t: -t.price)}
    return list(best.values())


def with_probable(choice: Choice, probability: Mapping[str, float]) -> Choice:
    """The choice with the rivals besides that were fitted and have a probability worth showing.

    Chi2 may rule out what is only a little wrong in its form; how probable it is counts that in. Of
    what every chair has, that it takes more effects does not count against it; see `_is_usual`.

    Args:
      probability: of hypotheses, by their keys joined by "+".
    """
    chosen = choice.hypothesis
    worth = shown(probability, chosen.name)
    likely = [
        t
        for t in choice.tried
        if (t.hypothesis.name in worth or _is_usual(t, choice.own))
        and is_there(t.fitted)
        and not choice.is_pushed(t)
    ]
    out = []
    for start, rivals in zip(chosen.starts, choice.rivals, strict=True):
        known = [r.hypothesis.keys for r in rivals]
        out.append([*rivals, *_in_place_of(likely, chosen, start, known)])
    known = [r.hypothesis.keys for group in out for r in group]
    return replace(choice, rivals=out, others=_best_of_each(likely, known))


def _is_usual(rival: Tried, chosen: Tried) -> bool:
    """Whether a rival that fits about as well does with what every chair has.

    A rolling resistance with a drag of 0.8 m^2 fitted 1.4 of chi2 better than the viscous friction
    of a bearing, which one number made more probable (96 %) and which was not there.
    """
    known = {s.effect.key for s in chosen.hypothesis.starts}
    more = [s.effect for s in rival.hypothesis.starts if s.effect.key not in known]
    usual = bool(more) and all(e.common >= search_rules.USUAL for e in more)
    without = known - set(rival.hypothesis.keys)
    return usual and bool(without) and rival.price - chosen.price < rules.RIVAL_CHI2


def with_spoken_against(base: Base, choice: Choice) -> Choice:
    """The choice with nothing as a rival of an effect that held-out trials speak against.

    Beside casters that shimmied, torques 8 and 12 % larger than they were told came in at 280 of
    chi2: how each window begins decides such a motion, and a fit may follow it with what is not
    there. What is there shows in trials that no fit has seen.
    """
    rivals = []
    for start, known in zip(choice.hypothesis.starts, choice.rivals, strict=True):
        rest = set(choice.hypothesis.keys) - {start.effect.key}
        fewer = min(_of_keys(choice.tried, rest), key=attrgetter("price"), default=None)
        if (
            fewer is not None
            and not _of_keys(choice.others, rest)  # it is a rival already
            and speaks_against(base, choice.fitted, fewer.fitted)
        ):
            known = [*known, fewer]
        rivals.append(known)
    return replace(choice, rivals=rivals)


def _of_keys(tried: Sequence[Tried], keys: Collection[str]) -> list[Tried]:
    """The fits of these effects, in any form."""
    return [t for t in tried if set(t.hypothesis.keys) == set(keys)]


def exchanged(choice: Choice) -> list[tuple[list[Start], list[Start], Tried]]:
    """Every rival, with the chosen effects that it does without and those that it has instead."""
    own = choice.hypothesis
    return [
        (
            [s for s in own.starts if s.effect.key not in rival.hypothesis.keys],
            [s for s in rival.hypothesis.starts if s.effect.key not in own.keys],
            rival,
        )
        for rival in (*(r for group in choice.rivals for r in group), *choice.others)
    ]


def _harm(base: Base, rival: Fitted, chosen: Fitted) -> float:
    """Chi2 by which a rival fits runs worse than nothing does which the chosen effects fit.

    A toe as large as the deceleration of a coast asked for left a spin with 4470, which nothing
    leaves with 2920 and the rolling resistance that was there with 820.
    """
    label = base.system.run[base.bench.windows]
    nothing, theirs, ours = (np.bincount(label, f.chi2) for f in (base.plain, rival, chosen))
    return float(np.maximum(theirs - np.maximum(nothing, ours), 0.0).sum())


def _not_ruled_out(rival: Tried, chosen: Tried, brought: float, harm: float = 0.0) -> bool:
    """Whether the data leave a rival standing.

    Args:
      brought: chi2, by the effect in whose place the rival would stand. It is the form of this
        effect that may be wrong; what others bring beside it is no measure of that.
      harm: chi2 by which the rival fits runs worse than nothing does.

    It is also out where all windows but the one that tells most against it rule it out: that one
    makes the scatter over windows so large that it hides what the others say.
    """
    if is_pushed(rival, chosen, brought):
        return False
    difference = rival.fitted.chi2 - chosen.fitted.chi2
    behind = rival.price - chosen.price
    most = int(np.argmax(difference))
    cases = ((behind, difference), (behind - difference[most], np.delete(difference, most)))
    return all(
        search_rules.stays_a_rival(
            behind=by,
            gain=brought,
            errors=search_rules.paired_errors(by, left),
            harm=harm,
            beyond_bound=bool(rival.fitted.at_bound and not chosen.fitted.at_bound),
        )
        for by, left in cases
    )
