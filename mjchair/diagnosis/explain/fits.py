"""The fits of hypotheses: each is made once and kept, and those that cannot be are noted.

In: the screened columns. Out: a fit for each hypothesis that is asked for, or None where this chair
cannot have its effects; how much a hypothesis gains by the linear algebra that stands here: around
the chair without effects, or around a fit.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from operator import attrgetter

import numpy as np

from mjchair.diagnosis.explain import (
    columns_anew,
    hypotheses,
    open_ended,
    profile,
    search_rules,
    whole_sizes,
)
from mjchair.diagnosis.explain.candidates import Start
from mjchair.diagnosis.explain.choice import Tried, is_there
from mjchair.diagnosis.explain.gap import Gap
from mjchair.diagnosis.explain.hypotheses import Hypothesis
from mjchair.diagnosis.explain.multistart import MultiStart, made_anew
from mjchair.diagnosis.explain.near_fit import NearFit, near_fit
from mjchair.diagnosis.explain.screening import (
    Base,
    Found,
    Say,
    gain,
    gap_after,
    goes_far,
    nuisances_of,
)
from mjchair.diagnosis.fit.nonlinear import Fitted, held_by_bounds, placed
from mjchair.diagnosis.replay.window_states import Track
from mjchair.errors import MjchairError


class Fits:
    """Fits hypotheses, and notes those that cannot be.

    Attributes:
      base: around which. say: is called with the name of a fit as it begins.
      tried: every fit that was made. impossible: starts of those that this chair cannot have.
      again: of some of them, the fit with everything made anew around it.
      begun: for each fit that began where one of more effects had ended: its effects, and that end.
      dropped: a line for each hypothesis that this chair cannot have.
      exchanged: fits, each with a track in whose states it was tried.
      gaps: that fits leave, each with its fit.
      least: fits of which the least sizes were sought, as they then stand.
      ended: whether the search ended before it had come to its end.
      near: the linear algebra that weighs; None: that of the base. latest: the last around a fit.
    """

    def __init__(self, base: Base, say: Say) -> None:
        """Nothing is tried yet."""
        self.base, self.say = base, say
        self.tried: list[Tried] = []
        self.impossible: list[tuple[Start, ...]] = []
        self.again: list[Tried] = []
        self.begun: list[tuple[tuple[Start, ...], Fitted]] = []
        self.dropped: list[str] = []
        self.exchanged: list[tuple[Fitted, Track]] = []
        self.gaps: list[tuple[Fitted, Gap]] = []
        self.least: list[Fitted] = []
        self.ended = False
        self.near = near_fit(base, base.found) if base.found else None
        self.latest: NearFit | None = None

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

    @contextmanager
    def near_to(self, tried: Tried) -> Iterator[None]:
        """Weigh, and begin fits, by the linear algebra around a fit with everything made anew."""
        before, self.near = self.near, self._around_fit(tried)
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

    def fit(self, hypothesis: Hypothesis, best: Tried | None = None) -> Tried | None:
        """The nonlinear fit; None where this chair cannot have these effects: that is noted.

        Args:
          best: so far; a fit that cannot come near it is not started again.
        """
        known = _of(hypothesis, self.tried)
        if known is not None:
            return Tried(hypothesis, known)
        if hypothesis.starts in self.impossible:
            return None
        self.say(f"fit of {hypothesis.label}")
        fitted = self._from_starts(hypothesis, best)
        if fitted is not None and gain(self.base, fitted) < 0.0:
            self._note(f"{hypothesis.label} fits worse than nothing and is left out")
            fitted = None
        if fitted is None:
            self.impossible.append(hypothesis.starts)
            return None
        tried = Tried(hypothesis, fitted)
        self.tried.append(tried)
        return tried

    def _from_starts(self, hypothesis: Hypothesis, best: Tried | None) -> Fitted | None:
        """The best fit from several starts; None: this chair cannot have these effects."""
        starts = MultiStart(
            base=self.base,
            hypothesis=hypothesis,
            near=self.near,
            part=self._part(hypothesis),
            best=None if best is None else best.fitted,
            behind=0.0 if best is None else self._behind(hypothesis, best),
            note=self._note,
        )
        return starts.fit()

    def _behind(self, hypothesis: Hypothesis, best: Tried) -> float:
        """Chi2 by which linear algebra says that a hypothesis brings less than the best."""
        here = best.hypothesis if self.near is None else self.weigh(best.hypothesis.starts)
        return max(0.0, here.gain - hypothesis.gain)

    def _part(self, hypothesis: Hypothesis) -> Fitted | None:
        """The best fit of some effects of a hypothesis; None: none was made."""
        keys, every = set(hypothesis.keys), (*self.tried, *self.again)
        parts = [t.fitted for t in every if set(t.hypothesis.keys) < keys]
        return min(parts, key=attrgetter("total"), default=None)

    def believed(self, hypothesis: Hypothesis, best: Tried | None = None) -> Tried | None:
        """The fit, where every parameter is off its bounds and known better than beforehand.

        Or its least sizes, where it would be the best and far larger ones fit as well: these are
        known, though nothing tells by how much a caster is held that never turned.
        """
        tried = self.fit(hypothesis, best)
        if tried is None or believable(tried.fitted):
            return tried
        if best is None or tried.price < best.price:
            least = self.with_least_sizes(tried)
            if believable(least.fitted):
                return least
        self._note(f"{hypothesis.label} is no answer: a number of it is not determined")
        return None

    def with_least_sizes(self, tried: Tried) -> Tried:
        """The fit with the least sizes that fit alike, which takes its place; it is sought once."""
        if any(tried.fitted is known for known in self.least):
            return tried
        fitted = open_ended.with_least_sizes(self.base, tried.fitted)
        self.least.append(fitted)
        least = Tried(tried.hypothesis, fitted)
        self.tried[:] = [least if t.fitted is tried.fitted else t for t in self.tried]
        return least

    def begin_at(self, fewer: Hypothesis, more: Fitted) -> None:
        """Make the fit of fewer effects from where more of them ended, if that can be.

        An effect that is hardly there may have helped the fit past the place where it was stuck.
        A fit of the same effects from the same end is made once.
        """
        if any(starts == fewer.starts and end is more for starts, end in self.begun):
            return
        self.begun.append((fewer.starts, more))
        keys = set(fewer.keys)
        terms = tuple(t for t in more.variant.terms if t.effect.key in keys)
        start, columns = replace(more.variant, terms=terms), nuisances_of(self.base, more)
        fitted = made_anew(self.base.bench, start, more.track, columns)
        if fitted is None:
            return
        exact = self._columns_hold(fitted)
        if not exact:
            again = made_anew(self.base.bench, fitted.variant, fitted.track) or fitted
            fitted = min(fitted, again, key=attrgetter("total"))
        self.keep_better(Tried(fewer, fitted), anew=not exact)

    def keep_better(self, made: Tried, anew: bool = True) -> None:
        """Keep a fit that was made elsewhere, unless a better one of its effects is known.

        Args:
          anew: whether all its columns were made around it.
        """
        known = _of(made.hypothesis, self.tried)
        if known is None or made.fitted.total < known.total:
            self.tried.insert(0, made)
            if anew:
                self.again.insert(0, made)

    def in_states_of(self, tried: Tried, other: Tried) -> Tried:
        """The fit, or a better one from the states that windows begin with in another fit.

        The state of a window may have more than one valley, and its search stays in the one where
        it began. That is asked only of fits with a touchy window. A load of 40 kg was 30 of chi2
        behind a torque's gain for one window of 15, in which the chair stands after a spin, and is
        20 before it in the valley that the gain had found.
        """
        fitted, states = tried.fitted, other.fitted.track
        if fitted.track is states or not fitted.track.touchy | states.touchy:
            return tried
        if any(one is fitted and track is states for one, track in self.exchanged):
            return tried
        self.exchanged.append((fitted, states))
        bench, columns = self.base.bench, nuisances_of(self.base, fitted)
        try:
            there = placed(bench, fitted.variant, states, columns)
        except (MjchairError, np.linalg.LinAlgError):  # in another's states no chair need be
            return tried
        if there.total > fitted.total - search_rules.NOTHING:
            return tried
        self.say(f"fit of {tried.hypothesis.label}, from where {other.hypothesis.label} begins")
        made = made_anew(bench, fitted.variant, there.track)
        if made is None or made.total >= fitted.total:
            return tried
        better = Tried(tried.hypothesis, made)
        self.keep_better(better)
        return better

    def anew(self, tried: Tried) -> Fitted:
        """The fit with everything made anew around it, where that may change what it says."""
        return tried.fitted if self._columns_hold(tried.fitted) else self._remade(tried)

    def _columns_hold(self, fitted: Fitted) -> bool:
        """Whether small effects stand where all columns are as good as they would be anew."""
        missed = fitted.total - fitted.promised
        small = search_rules.columns_hold(gain=gain(self.base, fitted), missed=missed)
        return small and not goes_far(fitted)

    def _remade(self, tried: Tried) -> Fitted:
        """The fit with everything made anew around it; the fit itself where that cannot be."""
        hypothesis, first = tried.hypothesis, tried.fitted
        known = _of(hypothesis, self.again)
        if known is None:
            known = first.anew or self._made_around(tried)
            self.again.append(Tried(hypothesis, known))
        return known

    def _made_around(self, tried: Tried) -> Fitted:
        """The fit that begins where another ended, all columns made there; else that one."""
        label, first = tried.hypothesis.label, tried.fitted
        self.say(f"fit of {label}, with everything made anew around it")

        def note(why: str) -> None:
            self._note(f"the fit of {label} was not made anew: {why}")

        made = made_anew(self.base.bench, first.variant, first.track, note=note)
        return first if made is None else made

    def last_fit(self, tried: Tried) -> Fitted:
        """The fit with everything made anew, or a better one from beside its sizes.

        Sizes that are open upwards have a least one.
        """
        fitted = whole_sizes.compared(self.base, self._remade(tried))
        fitted = profile.followed(self.base, fitted)
        return with_form_errors(open_ended.with_least_sizes(self.base, fitted))

    def screen_anew(self, fitted: Fitted) -> bool:
        """Weigh by columns around a fit, if its chair answers otherwise; False: it does not."""
        if not columns_anew.make(self.base, fitted, self.say):
            return False
        self.gaps = [known for known in self.gaps if known[0] is not fitted]
        self.latest = None
        return True

    def must_end(self) -> bool:
        """Whether the search has simulated so much that it ends here; then it has `ended`."""
        base = self.base
        stepped = base.bench.simulator.stepped
        if search_rules.is_too_long(stepped=stepped, patience=base.patience):
            self.ended = True
        return self.ended

    def gap_after(self, fitted: Fitted) -> Gap:
        """The gap that a fit leaves, sought once."""
        known = next((gap for other, gap in self.gaps if other is fitted), None)
        if known is None:
            known = gap_after(self.base, fitted)
            self.gaps.append((fitted, known))
        return known

    def _note(self, line: str) -> None:
        if line not in self.dropped:
            self.dropped.append(line)


def _of(hypothesis: Hypothesis, fits: Sequence[Tried]) -> Fitted | None:
    """The fit of a hypothesis among others; None: it is not there."""
    return next((t.fitted for t in fits if t.hypothesis.starts == hypothesis.starts), None)


def with_form_errors(fitted: Fitted) -> Fitted:
    """The fit, with standard errors that the form of its effects allows.

    At hundreds of standard errors the data tell a size better than its effect tells what a chair
    does. The errors of sensors have the form that they are given. What the data do not tell is
    known to its bounds.
    """
    std = dict(fitted.std)
    for term in fitted.variant.terms:
        for key, p in term.parameters:
            if p.sized and term.effect.sensor is None:
                size = abs(term.values[p.name] - p.neutral)
                std[key] = math.hypot(std[key], search_rules.SIZE_BY_FORM * size)
            std[key] = min(std[key], p.high - p.low)
    return replace(fitted, std=std)


def believable(fitted: Fitted) -> bool:
    """Whether every size is there, off its bounds, and known better than beforehand.

    A size than which far larger ones fit as well need not be known: the least one is.
    """
    sized = [(key, p) for term in fitted.variant.terms for key, p in term.parameters if p.sized]
    closed = [(key, p) for key, p in sized if key not in fitted.at_least]
    return (
        is_there(fitted)
        and not held_by_bounds(fitted)
        and all(
            search_rules.believable(std=fitted.std[key], change=p.change, width=p.high - p.low)
            for key, p in closed
        )
    )
