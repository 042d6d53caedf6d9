"""The search for effects: from one to as many as the data need, compared with rivals.

In: the screened columns and the gap. Out: a `Choice`, or None where no effect brings anything. The
rules that decide stand in rules.py; a hypothesis that this chair cannot have is dropped and noted.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace
from operator import attrgetter

import numpy as np

from mjchair.diagnosis import rules
from mjchair.diagnosis.explain import hypotheses, open_ended, whole_sizes
from mjchair.diagnosis.explain.candidates import Start
from mjchair.diagnosis.explain.choice import Choice, Rival, is_there
from mjchair.diagnosis.explain.gap import Gap
from mjchair.diagnosis.explain.hypotheses import Hypothesis
from mjchair.diagnosis.explain.left_out import held_out, with_terms
from mjchair.diagnosis.explain.near_fit import NearFit, near_fit
from mjchair.diagnosis.explain.null_ensemble import confirmed
from mjchair.diagnosis.explain.screening import (
    FAR,
    Base,
    Found,
    Say,
    gain,
    gap_after,
    nuisances_of,
)
from mjchair.diagnosis.fit import bounded
from mjchair.diagnosis.fit.bounded import Reduced
from mjchair.diagnosis.fit.column_ids import ColumnId
from mjchair.diagnosis.fit.nonlinear import ROUNDS, Fitted, refit
from mjchair.diagnosis.fit.variant import Term, Variant
from mjchair.diagnosis.replay.derivatives import Column
from mjchair.diagnosis.replay.window_states import Track
from mjchair.errors import MjchairError

TRIED = 3  # hypotheses of one size, where the first leaves a gap
LISTED = 6  # hypotheses of one size, until one can be
REFITTED = 5  # rivals of an effect that is alone
GROWN = 3  # pairs from which hypotheses of three are grown
BESIDE = 3  # rivals of each effect that has others beside it
SHARES = (0.875, 0.75, 0.625, 0.5, 0.375, 0.25, 0.125)  # of linear coefficients, for a new start
APART = 10.0  # times the chi2 of most windows: there a chair went another way (assumption)
SMALLER = 0.1  # of an effect, where a fit begins once more that went astray
NARROW = 1.0  # standard deviations: a wall for what may have taken an effect for itself
SWAPS = 2  # times that a rival takes the place of the chosen hypothesis


@dataclass(frozen=True)
class Tried(Rival):
    """A hypothesis and its fit."""

    @property
    def price(self) -> float:
        """Chi2 with the penalty of the parameters, less for effects that are common."""
        penalty = rules.PENALTY * self.hypothesis.free - self.hypothesis.prior
        return self.fitted.total + penalty


WithGap = tuple[Tried, Gap]  # a fit, and the gap that it leaves


def choose(base: Base, gap: Gap, say: Say, search: Search | None = None) -> Choice | None:
    """Grow from one effect to as many as the data ask for; None: no effect brings anything.

    Args:
      search: around the base, with fits that were made already; None: none were.
    """
    search = search or Search(base, say)
    grown = _grown(search)
    if grown is None:
        return None
    best, rivals = search.against_rivals(search.without_needless(grown[0]))
    say("the last fit, with everything made anew around it")
    fitted = search.last_fit(best)
    return Choice(
        hypothesis=best.hypothesis,
        fitted=fitted,
        after=confirmed(base, fitted, gap_after(base, fitted)),
        rivals=rivals,
        own_gains=[search.own_gain(best, start) for start in best.hypothesis.starts],
        tried=search.tried,
        dropped=search.dropped,
    )


def _grown(search: Search) -> WithGap | None:
    """The best hypothesis, grown effect by effect, and the gap that it leaves; None: there is none.

    It grows as long as it leaves a gap and a further effect is worth it.
    """
    if not search.promises():
        return None
    here = search.found()
    size = len(here[0].hypothesis.starts) if here else 0
    while size < rules.MOST and (here is None or here[1].exists):
        size += 1
        more = search.further(here[0] if here else None, size)
        if size == 1:
            more = search.or_by_most_windows(search.or_as_given(more))
        if more is None and here is None:
            continue
        if more is None or (here is not None and not search.is_worth(here[0], more[0])):
            more = search.beyond_bound(here, size) if here is not None else None
            size += 1
        if more is None:
            break  # where no second effect stands beside the first, no third does
        here = search.settled(more)
        if size == 1:
            here = search.or_whole(search.or_left_over(here))
    return here


def _closes(more: WithGap | None, best: Tried) -> bool:
    """Whether a larger hypothesis is better than the best and leaves no gap.

    One that is worse may leave none as well, by what its own next step promises.
    """
    return more is not None and not more[1].exists and more[0].price < best.price


def _better(one: WithGap | None, other: WithGap | None) -> WithGap | None:
    """The one with the lower price; None: there is neither."""
    return min((t for t in (one, other) if t is not None), key=lambda t: t[0].price, default=None)


class Search:
    """Fits hypotheses, and notes those that cannot be.

    Attributes:
      base: around which. dropped: a line for each hypothesis that this chair cannot have.
      tried: every fit that was made. impossible: starts of those that this chair cannot have.
      again: of some of them, the fit with everything made anew around it.
      listed: hypotheses by their size, once they were asked for.
      near: the linear algebra that weighs; None: that of the base. latest: the last around a fit.
    """

    def __init__(self, base: Base, say: Say) -> None:
        """Nothing is tried yet."""
        self.base, self.say = base, say
        self.dropped: list[str] = []
        self.tried: list[Rival] = []
        self.impossible: list[tuple[Start, ...]] = []
        self.again: list[Rival] = []
        self.near = near_fit(base, base.found) if base.found else None
        self.listed: dict[int, Sequence[Hypothesis]] = {}
        self.latest: NearFit | None = None

    def best_single(self) -> Hypothesis | None:
        """The effect with which the search begins; None: none brings anything."""
        options = self.options(1)
        return _commonest(self, options) if options and options[0].score > 0.0 else None

    def promises(self) -> bool:
        """Whether any effect may bring anything, alone or beside those that were found before."""
        known = self.base.found is not None or _goes_far(self.base.plain)
        return known or self.best_single() is not None

    def found(self) -> WithGap | None:
        """The effects that were found before the search, and the gap that they leave."""
        known = self.base.found
        if known is None:
            return None
        best = Tried(self.weigh(known.starts), known.fitted)
        self.tried.append(best)
        return best, gap_after(self.base, best.fitted)

    def options(self, size: int) -> Sequence[Hypothesis]:
        """Hypotheses of this many effects around the chair without any, best first."""
        if size not in self.listed:
            reduced, starts = self.base.reduced, self.base.starts
            if size == 1:
                self.listed[size] = hypotheses.singles(reduced, starts)
            elif size == 2:
                self.listed[size] = hypotheses.pairs(reduced, starts)
            else:
                best = [h.starts for h in self.options(size - 1)[:GROWN]]
                self.listed[size] = hypotheses.grown(reduced, starts, best)
        return self.listed[size]

    def further(self, best: Tried | None, size: int) -> WithGap | None:
        """The best hypothesis of this many effects, and the gap that it leaves; None: none can be.

        Args:
          best: of one effect less; None: there is none.
        """
        if best is not None and self.near is not None:
            return self.best_of(self._promising(best), patient=False)
        top = None if best is None else _better(self.beside(best), self._fitted_before(size))
        if best is not None and _closes(top, best):
            return top
        # perhaps the first effect stands in for two others
        return _better(top, self.best_of(self.options(size), patient=best is None))

    def beyond_bound(self, here: WithGap, size: int) -> WithGap | None:
        """The best hypothesis of so many effects, with one more, where a size of it is on a bound.

        Two rims of different gain pushed the mass that moves on a chair to its bound.

        Args:
          here: the best so far, of fewer effects, to which the larger one must be worth adding.
        """
        bound = [
            t
            for t in self.tried
            if len(t.hypothesis.starts) == size < rules.MOST
            and t.fitted.total < here[0].fitted.total
            and t.fitted.at_bound
        ]
        if not bound:
            return None
        best = min(bound, key=lambda t: t.fitted.total)
        more = self.beside(Tried(best.hypothesis, best.fitted))
        return more if more is not None and self.is_worth(here[0], more[0]) else None

    def _fitted_before(self, size: int) -> WithGap | None:
        """What was best while the noise was sought, if of so many effects, and the gap it leaves.

        The first effect may stand in for two others, whose fit is at hand.
        """
        known, left = self.base.best, self._left_over()
        if known is None or size not in (len(left), len(known.starts)):
            return None
        every = self.weigh(left if len(left) == size else known.starts)
        self._begin_at(every, known.fitted)
        tried = self.believed(every)
        return None if tried is None else (tried, gap_after(self.base, tried.fitted))

    def _left_over(self) -> list[Start]:
        """The effects that are clear of what was best while the noise was sought.

        There the best hypothesis of any size is fitted. In it, effects that only made up for a
        large one being no linear one come to nothing.
        """
        known = self.base.best
        if known is None:
            return []
        return [s for s in known.starts if known.fitted.sigmas[s.effect.key] > rules.SIGMAS]

    def settled(self, here: WithGap) -> WithGap:
        """A fit with the gap that it leaves once everything is made anew around it.

        A gap is not laid to a further effect before this one is fitted well.
        """
        best, left = here
        return best, gap_after(self.base, self.anew(best)) if left.exists else left

    def or_as_given(self, here: WithGap | None) -> WithGap | None:
        """The single effect, or a better one that leaves what is roughly known nearly as given.

        What is roughly known may take an effect for itself, some numbers far from what they are
        known to be. Then linear algebra that is wrong by little of a large effect does not see the
        effect; with nearer walls it does. From there on it weighs with these.
        """
        wide = self.base
        if not _goes_far(wide.plain):
            return here
        if here is not None and not here[1].exists and not _goes_far(here[0].fitted):
            return here
        return self._or_weighed_by(wide.reduced.narrowed(NARROW), here)

    def or_by_most_windows(self, here: WithGap | None) -> WithGap | None:
        """The single effect, or a better one by the linear algebra of most windows alone.

        Where a chair went another way, as where a caster swivels to the other side, no small change
        explains what is seen, and the windows in which it did hide what the others say: the angle
        sensor of the caster was taken for what a wheel did that is 2 mm larger.
        """
        wide = self.base
        most = _most_windows(wide)
        if len(most) == len(wide.bench.windows) or (here is not None and not here[1].exists):
            return here
        return self._or_weighed_by(bounded.reduce(wide.system, most), here)

    def _or_weighed_by(self, reduced: Reduced, here: WithGap | None) -> WithGap | None:
        """The single effect, or a better one by other linear algebra, which then weighs on."""
        before = self.base
        self.base = replace(before, reduced=reduced)
        other = self.best_of(hypotheses.singles(reduced, before.starts), patient=False)
        best = _better(here, other)
        if best is here:
            self.base = before
        else:
            self.listed.clear()
        return best

    def or_left_over(self, here: WithGap) -> WithGap:
        """The single effect, or a better one that was left over while the noise was sought.

        By linear algebra another may be the best alone.
        """
        known, left = self.base.best, self._left_over()
        if not here[1].exists or known is None or len(known.starts) == 1 or len(left) != 1:
            return here
        alone = self.weigh(left)
        self._begin_at(alone, known.fitted)
        tried = self.fit(alone)
        if tried is None or tried.price >= here[0].price or not believable(tried.fitted):
            return here
        return tried, gap_after(self.base, self.anew(tried))

    def or_whole(self, here: WithGap) -> WithGap:
        """The single effect, or one of a whole size that is better.

        These are tried where the first leaves a gap or a caster shimmies. Small changes do not lead
        there, and what they lead to may stand in for it: a patch of the floor for wheels that
        shimmy once.
        """
        if not here[1].exists and not whole_sizes.shimmies(self.base):
            return here
        best = here[0]
        for start, fitted in whole_sizes.fits(self.base, self.anew(best)):
            tried = Tried(self.weigh([start]), fitted)
            known = _of(tried.hypothesis, self.tried)
            if known is None or fitted.total < known.total:
                self.tried.insert(0, tried)
                self.again.insert(0, tried)
            if tried.price < best.price and believable(fitted):
                best = tried
        return here if best is here[0] else (best, gap_after(self.base, best.fitted))

    def beside(self, best: Tried) -> WithGap | None:
        """The best hypothesis with one effect more, by the linear algebra around a fit.

        Around a chair without effects, a large effect is wrong by more than a small one brings: a
        payload of 40 kg hides that the centre of mass is 80 mm aside.

        Args:
          best: whose effects stay; everything is made anew around it.
        """
        with self.near_to(best):
            return self.best_of(self._promising(best), patient=False)

    def _promising(self, best: Tried) -> list[Hypothesis]:
        """Hypotheses of one effect more that may be worth it by the linear algebra around a fit."""
        here = self.weigh(best.hypothesis.starts)
        return [
            more
            for more in _with_one_more(self, best.hypothesis.starts)
            if rules.may_be_worth_adding(
                promised=more.gain - here.gain,
                parameters=more.free - here.free,
                gain=more.gain,
            )
        ]

    @contextmanager
    def near_to(self, tried: Tried | None) -> Iterator[None]:
        """Weigh, and begin fits, by the linear algebra around a fit with everything made anew.

        Args:
          tried: the fit; None: around the chair without effects.
        """
        before = self.near
        self.near = None if tried is None else self._around_fit(tried)
        try:
            yield
        finally:
            self.near = before

    def _around_fit(self, tried: Tried) -> NearFit:
        """The linear algebra around a fit; the last is kept, since it is asked for in a row."""
        fitted = self.anew(tried)
        if self.latest is None or self.latest.found.fitted is not fitted:
            self.latest = near_fit(self.base, Found(tried.hypothesis.starts, fitted))
        return self.latest

    def weigh(self, starts: Sequence[Start]) -> Hypothesis:
        """The hypothesis by linear algebra: around the effects that were found, if any."""
        if self.near is not None:
            return self.near.weigh(starts)
        return hypotheses.weigh(self.base.reduced, starts)

    def is_physical(self, hypothesis: Hypothesis) -> bool:
        """Whether its linear coefficients are of such effects."""
        if self.near is not None:
            return self.near.physical(hypothesis.starts)
        return hypotheses.physical(self.base.reduced, hypothesis)

    def best_of(self, options: Sequence[Hypothesis], patient: bool = True) -> WithGap | None:
        """The best hypothesis with its fit, and the gap that it leaves; None: none can be.

        Where the first leaves a gap, the linear order may be wrong, and the next are fitted too.

        Args:
          patient: whether, where none of these can be, the list is gone on along.
        """
        if not options or options[0].score <= 0.0:
            return None
        first = _commonest(self, options)
        top = self.believed(first)
        if top is not None:
            left = gap_after(self.base, top.fitted)
            if not left.exists:
                return top, left
        near = [
            h
            for h in options
            if h.keys != first.keys
            and rules.worth_trying(score=h.score, best=first.score, gain=first.gain)
        ]
        tried = top
        for other in near[: TRIED - 1]:
            more = self.believed(other, top)
            if more is not None and (top is None or more.price < top.price):
                top = more
        if top is None and patient:  # favourites that cannot be say nothing of the others
            fits = (self.believed(other) for other in options[:LISTED])
            top = next((fit for fit in fits if fit is not None), None)
        if top is None:
            return None
        return top, left if top is tried else gap_after(self.base, top.fitted)

    def believed(self, hypothesis: Hypothesis, best: Tried | None = None) -> Tried | None:
        """The fit, where every parameter is off its bounds and known better than beforehand."""
        tried = self.fit(hypothesis, best)
        if tried is None or believable(tried.fitted):
            return tried
        self._note(
            f"{' and '.join(hypothesis.keys)} is no answer: a number of it is not determined"
        )
        return None

    def is_worth(self, best: Tried, more: Tried) -> bool:
        """Whether a larger hypothesis brings enough; both with everything made anew."""
        one, other = self.anew(best), self.anew(more)
        fewer, full = with_terms(self.base, one), with_terms(self.base, other)
        held = held_out(self.base.bench, fewer, full)
        return rules.worth_adding(
            gained=one.total - other.total,
            parameters=more.hypothesis.free - best.hypothesis.free,
            held=held,
            gain=gain(self.base, other),
        )

    def without_needless(self, tried: Tried) -> Tried:
        """The hypothesis without the effects that it can do without."""
        hypothesis = tried.hypothesis
        if len(hypothesis.starts) == 1:
            return tried
        fitted = self.anew(tried)
        for start in hypothesis.starts:
            rest = [s for s in hypothesis.starts if s is not start]
            fewer = self.weigh(rest)
            parameters = hypothesis.free - fewer.free
            if rules.surely_needed(
                sigmas=fitted.sigmas[start.effect.key],
                lost=hypothesis.gain - fewer.gain,
                parameters=parameters,
            ):
                continue
            if fitted.sigmas[start.effect.key] < rules.SIGMAS:
                self._begin_at(fewer, fitted)
            other = self.fit(fewer)
            if other is None:
                continue
            lost = self.anew(other).total - fitted.total
            if rules.can_be_dropped(lost=lost, parameters=parameters):
                return self.without_needless(other)
        return tried

    def _begin_at(self, fewer: Hypothesis, more: Fitted) -> None:
        """Make the fit of fewer effects from where more of them ended, if that can be.

        An effect that is hardly there may have helped the fit past the place where it was stuck.
        """
        keys = set(fewer.keys)
        terms = tuple(t for t in more.variant.terms if t.effect.key in keys)
        start = replace(more.variant, terms=terms)
        fitted = self._made_anew(start, more.track, columns=nuisances_of(self.base, more))
        if fitted is None:
            return
        exact = self._columns_hold(fitted)
        if not exact:
            again = self._made_anew(fitted.variant, fitted.track) or fitted
            fitted = min(fitted, again, key=attrgetter("total"))
        known = _of(fewer, self.tried)
        if known is None or fitted.total < known.total:
            found = Tried(fewer, fitted)
            self.tried.insert(0, found)
            if not exact:
                self.again.insert(0, found)

    def own_gain(self, chosen: Tried, start: Start) -> float:
        """Chi2 that one effect of the chosen hypothesis brings beside the others."""
        starts = chosen.hypothesis.starts
        whole = gain(self.base, chosen.fitted)
        others = [s for s in starts if s is not start]
        if not others:
            return whole
        with self.near_to(chosen):
            own = self.weigh(starts).gain - self.weigh(others).gain
        return float(np.clip(own, 0.0, max(whole, 0.0)))

    def against_rivals(self, chosen: Tried) -> tuple[Tried, list[list[Rival]]]:
        """The best of the chosen hypothesis and what could stand in its places, with its rivals.

        Linear algebra chose; a rival that fits better once both are made anew takes the place.
        """
        rivals = self.rivals(chosen)
        for _ in range(SWAPS):
            better = self._better_rival(chosen, [r for group in rivals for r in group])
            if better is None:
                break
            chosen = self.without_needless(better)
            rivals = self.rivals(chosen)
        return chosen, rivals

    def _better_rival(self, chosen: Tried, rivals: Sequence[Rival]) -> Tried | None:
        """The best of the rivals that are better than the choice; None: none is.

        Columns that were made without the effects are wrong by some chi2, more for one hypothesis
        than for another, so of those that are near everything is made anew.
        """
        tried = [Tried(r.hypothesis, r.fitted) for r in rivals if believable(r.fitted)]
        near = [t for t in tried if t.price < chosen.price + rules.RIVAL_CHI2]
        if not near:
            return None
        best = min(near, key=self._price_anew)
        return best if self._price_anew(best) < self._price_anew(chosen) else None

    def _price_anew(self, tried: Tried) -> float:
        return replace(tried, fitted=self.anew(tried)).price

    def rivals(self, chosen: Tried) -> list[list[Rival]]:
        """For every effect of the choice: what could stand in its place, best first.

        In the place of all but the largest effect, it is weighed around the fit: around a chair
        without effects, the largest is wrong by more than the others bring.
        """
        starts = chosen.hypothesis.starts
        own = [self.own_gain(chosen, start) for start in starts]
        out = []
        for start, brought in zip(starts, own, strict=True):
            near = nullcontext() if brought == max(own) else self.near_to(chosen)
            with near:
                out.append(self._rivals(chosen, start, brought))
        return out

    def _rivals(self, chosen: Tried, start: Start, own: float) -> list[Rival]:
        """What could stand in the place of one effect, which brings `own` of chi2."""
        starts = chosen.hypothesis.starts
        others = tuple(s for s in starts if s is not start)
        here = chosen.hypothesis if self.near is None else self.weigh(starts)
        options = _replacements(self, start, others)
        near = [h for h in options if _close(here, h, own)]
        if others and not near:  # the first is always fitted: linear algebra tells little of it
            near = [h for h in options[:1] if rules.may_be_alike(less=here.gain - h.gain, own=own)]
        tried = [self.fit(h, chosen) for h in near[: REFITTED if not others else BESIDE]]
        tried += self._in_place_of(start, others, [h.keys for h in near])
        return [
            Rival(t.hypothesis, t.fitted)
            for t in tried
            if t is not None and is_there(t.fitted) and _not_ruled_out(t, chosen, own)
        ]

    def _in_place_of(
        self, start: Start, others: Sequence[Start], but: Collection[Sequence[str]]
    ) -> list[Tried]:
        """The best of what was fitted before of the others with another effect.

        Linear algebra around a fit may not see how two large effects replace one another.

        Args:
          but: keys of hypotheses that are left out.
        """
        stay, seen = {s.effect.key for s in others}, [set(keys) for keys in but]
        fits = [
            Tried(t.hypothesis, t.fitted)
            for t in self.tried
            if len(t.hypothesis.starts) == len(others) + 1
            and stay < set(t.hypothesis.keys)
            and start.effect.key not in t.hypothesis.keys
            and set(t.hypothesis.keys) not in seen
        ]
        best = {frozenset(t.hypothesis.keys): t for t in sorted(fits, key=lambda t: -t.price)}
        return list(best.values())

    def fit(self, hypothesis: Hypothesis, best: Tried | None = None) -> Tried | None:
        """The nonlinear fit; from a second start where the first misses what was promised.

        Args:
          best: so far; a fit that cannot come near it is not started again.

        Returns:
          None where this chair cannot have these effects; that is noted.
        """
        known = _of(hypothesis, self.tried)
        if known is not None:
            return Tried(hypothesis, known)
        if hypothesis.starts in self.impossible:
            return None
        self.say("fit of " + " and ".join(hypothesis.keys))
        fitted = self._beside_part(hypothesis, self._best_start(hypothesis, best))
        if fitted is not None and gain(self.base, fitted) < 0.0:
            self._note(f"{' and '.join(hypothesis.keys)} fits worse than nothing and is left out")
            fitted = None
        if fitted is None:
            self.impossible.append(hypothesis.starts)
            return None
        self.tried.append(Tried(hypothesis, fitted))
        return Tried(hypothesis, fitted)

    def _best_start(self, hypothesis: Hypothesis, best: Tried | None) -> Fitted | None:
        """The better of two starts; of one, where it gets to what was promised.

        The second is the best place on the line from no effect to what linear algebra promises: a
        tire with a quarter of its friction slides where one with a third of it does not.
        """
        first = self._from(hypothesis, 1.0, best)
        if self.near is not None:
            return self._or_from_afar(hypothesis, first, best)
        promised = self.base.reduced.total - hypothesis.gain
        beside = len(hypothesis.starts) > 1 and best is not None  # of many: one start is enough
        short = first is None or rules.fell_short(
            total=first.total, promised=promised, gain=hypothesis.gain
        )
        if first is not None and (beside or not short or self._is_behind(first, best)):
            return first
        share = self._best_share(hypothesis)
        second = None if share is None else self._from(hypothesis, share, best)
        fits = [f for f in (first, second) if f is not None]
        if len(fits) > 1 and rules.starts_disagree(fits[0].total, fits[1].total):
            ends = " and ".join(f"{f.total:.0f}" for f in fits)
            names = " and ".join(hypothesis.keys)
            self._note(f"fits of {names} from two starts end at chi2 of {ends}; the less is used")
        return min(fits, key=lambda f: f.total) if fits else None

    def _or_from_afar(
        self, hypothesis: Hypothesis, near: Fitted | None, best: Tried | None
    ) -> Fitted | None:
        """The fit that began near another, or one from afar where that one is stuck.

        What the others had to be without this effect may be a valley of its own: with another
        wheel a caster lifts off.
        """
        if (
            near is not None
            and gain(self.base, near) >= 0.0
            and not rules.is_stuck(total=near.total, promised=near.promised)
        ):
            return near
        with self.near_to(None):
            afar = self._from(hypothesis, 1.0, best)
        fits = [f for f in (near, afar) if f is not None]
        return min(fits, key=attrgetter("total"), default=None)

    def _beside_part(self, hypothesis: Hypothesis, fitted: Fitted | None) -> Fitted | None:
        """The fit, or a better one that begins where a part of the hypothesis was fitted.

        With one effect more nothing fits worse, so a fit that does has gone astray. It then begins
        near no effect: the size that linear algebra promised led astray.
        """
        part = self._part(hypothesis)
        if part is None or (fitted is not None and fitted.total <= part.total):
            return fitted
        taken = {term.effect.key for term in part.variant.terms}
        more = [_smaller(t) for t in self._terms(hypothesis) if t.effect.key not in taken]
        start = replace(part.variant, terms=(*part.variant.terms, *more))
        fits = [f for f in (fitted, self._made_anew(start, part.track)) if f is not None]
        return min(fits, key=lambda f: f.total, default=None)

    def _part(self, hypothesis: Hypothesis) -> Fitted | None:
        """The best fit of some effects of a hypothesis; None: none was made."""
        keys, every = set(hypothesis.keys), (*self.tried, *self.again)
        parts = [t.fitted for t in every if set(t.hypothesis.keys) < keys]
        return min(parts, key=attrgetter("total"), default=None)

    def _best_share(self, hypothesis: Hypothesis) -> float | None:
        """The share of the linear coefficients that fits best as it stands; None: none can be."""
        if len(hypothesis.starts) > 1:  # the simulations are worth it for a single effect only
            return 0.5
        totals = {}
        for share in SHARES:
            try:
                totals[share] = self._refit(hypothesis, share, rounds=0).total
            except (MjchairError, np.linalg.LinAlgError):
                continue
        return min(totals, key=totals.__getitem__, default=None)

    def _terms(self, hypothesis: Hypothesis) -> tuple[Term, ...]:
        """The effects with the values that linear algebra promises."""
        if self.near is not None:
            return self.near.terms(hypothesis.starts)
        return hypotheses.terms(self.base.reduced, hypothesis)

    def _refit(self, hypothesis: Hypothesis, share: float, rounds: int = ROUNDS) -> Fitted:
        """The nonlinear fit that begins at a share of the linear fit's coefficients."""
        base, part = self.base, self._part(hypothesis)
        most = np.inf if part is None else part.total
        if self.near is not None:
            return self.near.refit(hypothesis.starts, rounds, most)
        terms = hypotheses.terms(base.reduced, hypothesis, share)
        start = replace(base.around.variant, terms=terms)
        return refit(base.bench, start, base.around.track, base.nuisances, rounds, most)

    def _note(self, line: str) -> None:
        if line not in self.dropped:
            self.dropped.append(line)

    def _is_behind(self, fitted: Fitted, best: Tried | None) -> bool:
        """Whether a fit ends, by its own promise, too far behind the best to come near it."""
        return best is not None and rules.out_of_reach(
            promised=fitted.promised,
            best=best.fitted.total,
            gain=gain(self.base, best.fitted),
        )

    def _from(self, hypothesis: Hypothesis, share: float, best: Tried | None) -> Fitted | None:
        """The fit that begins at a share of the linear fit's coefficients."""
        try:
            fitted = self._refit(hypothesis, share)
        except (MjchairError, np.linalg.LinAlgError) as error:
            self._note(f"{' and '.join(hypothesis.keys)} was not tried further: {error}")
            return None
        if self._is_behind(fitted, best):
            pass  # what it would gain if all were made anew decides nothing
        elif _walled(fitted):
            fitted = self._around_terms(fitted)
        elif rules.is_stuck(total=fitted.total, promised=fitted.promised):
            fitted = self._made_anew(fitted.variant, fitted.track) or fitted
        return fitted

    def _around_terms(self, fitted: Fitted) -> Fitted:
        """The fit from the effects that were reached, what is roughly known as given; the better.

        A large effect changes how a chair answers to its centre of mass or its inertia. Columns
        that were made without it then push these numbers to the ends of what they may be.
        """
        again = self._made_anew(replace(fitted.variant, offsets={}), fitted.track)
        return fitted if again is None else min(fitted, again, key=lambda f: f.total)

    def anew(self, tried: Tried) -> Fitted:
        """The fit with everything made anew around it, where that may change what it says."""
        return tried.fitted if self._columns_hold(tried.fitted) else self._remade(tried)

    def _columns_hold(self, fitted: Fitted) -> bool:
        """Whether small effects stand where all columns are as good as they would be anew."""
        missed = fitted.total - fitted.promised
        small = rules.columns_hold(gain=gain(self.base, fitted), missed=missed)
        return small and not _goes_far(fitted)

    def _remade(self, tried: Tried) -> Fitted:
        """The fit with everything made anew around it; the fit itself where that cannot be."""
        hypothesis, first = tried.hypothesis, tried.fitted
        known = _of(hypothesis, self.again)
        if known is None:
            name = f"the fit of {' and '.join(hypothesis.keys)}"
            known = self._made_anew(first.variant, first.track, name) or first
            self.again.append(Rival(hypothesis, known))
        return known

    def last_fit(self, tried: Tried) -> Fitted:
        """The fit with everything made anew, or a better one from beside its whole sizes.

        Sizes that are open upwards have a least one.
        """
        fitted = whole_sizes.compared(self.base, self._remade(tried))
        return open_ended.with_least_sizes(self.base, fitted)

    def _made_anew(
        self,
        start: Variant,
        before: Track,
        noted: str = "",
        columns: dict[ColumnId, Column] | None = None,
    ) -> Fitted | None:
        """The fit from a variant, all columns made there; None: no chair can be so.

        Args:
          noted: what the note calls it where that fails; empty: no note.
          columns: of what is roughly known, to be used instead; None: they are made there too.
        """
        try:
            return refit(self.base.bench, start, before, columns)
        except (MjchairError, np.linalg.LinAlgError) as error:
            if noted:
                self._note(f"{noted} was not made anew: {error}")
            return None


def _smaller(term: Term) -> Term:
    """A tenth of an effect, in the place and at the time where it is."""
    values = {
        p.name: p.neutral + SMALLER * (term.values[p.name] - p.neutral)
        for _, p in term.parameters
        if p.sized
    }
    return replace(term, values={**term.values, **values})


def _most_windows(base: Base) -> list[int]:
    """The windows that are fitted to, but for those that disagree far more than most do."""
    chi2 = base.plain.chi2
    return [int(i) for i in base.bench.windows[chi2 <= APART * np.median(chi2)]]


def _goes_far(fitted: Fitted) -> bool:
    """Whether anything that is only roughly known is far from what it is known to be."""
    return any(abs(by) >= FAR for by in fitted.variant.offsets.values())


def _walled(fitted: Fitted) -> bool:
    """Whether anything that is only roughly known stands on its wall."""
    return any(abs(by) >= bounded.WALL for by in fitted.variant.offsets.values())


def _of(hypothesis: Hypothesis, fits: Sequence[Rival]) -> Fitted | None:
    """The fit of a hypothesis among others; None: it is not there."""
    return next((t.fitted for t in fits if t.hypothesis.starts == hypothesis.starts), None)


def believable(fitted: Fitted) -> bool:
    """Whether every size is there, off its bounds, and known better than beforehand."""
    sized = [(key, p) for term in fitted.variant.terms for key, p in term.parameters if p.sized]
    return (
        is_there(fitted)
        and not fitted.at_bound
        and all(
            rules.believable(std=fitted.std[key], change=p.change, width=p.high - p.low)
            for key, p in sized
        )
    )


def _commonest(search: Search, options: Sequence[Hypothesis]) -> Hypothesis:
    """Of the hypotheses that fit alike, the one whose effects stand first in the library."""
    order = {s.effect.key: k for k, s in reversed(list(enumerate(search.base.starts)))}
    alike = [h for h in options if rules.alike(h.score, options[0].score)]
    best = min(alike, key=lambda h: sorted(order[k] for k in h.keys))
    for start in best.starts:
        best = _freed(search, best, start)
    return best


def _freed(search: Search, hypothesis: Hypothesis, start: Start) -> Hypothesis:
    """The hypothesis with more of an effect's parameters free, where others of them fit alike.

    A left drive 3 % weak and a right one 3 % strong differ by what the mass may be: then neither
    number alone has the uncertainty that it shows.
    """
    others = tuple(s for s in hypothesis.starts if s is not start)
    same = [s for s in search.base.starts if s.group == start.group and s.effect.seeds is None]
    weighed = {s.columns: search.weigh((*others, s)) for s in same}
    alike = {
        column
        for columns, h in weighed.items()
        if len(columns) <= len(start.columns) and rules.alike(h.score, hypothesis.score)
        for column in columns
    }
    richer = [c for c in weighed if alike <= set(c)]
    return weighed[min(richer, key=len)] if len(alike) > len(start.columns) else hypothesis


def _not_ruled_out(rival: Tried, chosen: Tried, brought: float) -> bool:
    """Whether the data leave a rival standing.

    Args:
      brought: chi2, by the effect in whose place the rival would stand. It is the form of this
        effect that may be wrong; what others bring beside it is no measure of that.

    It is also out where all windows but the one that tells most against it rule it out: that one
    makes the scatter over windows so large that it hides what the others say.
    """
    theirs, ours = rival.fitted.chi2, chosen.fitted.chi2
    behind = rival.price - chosen.price
    most = int(np.argmax(theirs - ours))
    cases = (
        (behind, theirs, ours),
        (behind - (theirs - ours)[most], np.delete(theirs, most), np.delete(ours, most)),
    )
    return all(
        rules.stays_a_rival(
            behind=by,
            gain=brought,
            errors=rules.paired_errors(other, own),
            beyond_bound=bool(rival.fitted.at_bound and not chosen.fitted.at_bound),
        )
        for by, other, own in cases
    )


def _replacements(search: Search, start: Start, others: tuple[Start, ...]) -> list[Hypothesis]:
    """The others with another effect instead of `start`, best first."""
    return _with_one_more(search, others, {start.effect.key})


def _with_one_more(
    search: Search, others: tuple[Start, ...], but: Collection[str] = ()
) -> list[Hypothesis]:
    """The others with each further effect, but for the effects of these keys; best first."""
    taken = {*but, *(s.effect.key for s in others)}
    pool: dict[str, Hypothesis] = {}
    for other in search.base.starts:
        key = other.effect.key
        if key in taken:
            continue
        more = search.weigh((*others, other))
        if not np.isfinite(more.score) or not search.is_physical(more):
            continue
        if key not in pool or more.score > pool[key].score:
            pool[key] = more
    return sorted(pool.values(), key=lambda h: -h.score)


def _close(chosen: Hypothesis, other: Hypothesis, own: float) -> bool:
    """Whether a rival is near enough, by linear algebra, to be fitted.

    Args:
      own: chi2 that the effect brings in whose place it would stand.
    """
    behind, less = chosen.score - other.score, chosen.gain - other.gain
    return rules.worth_refitting(behind=behind, gain=own, rival_gain=own - less)
