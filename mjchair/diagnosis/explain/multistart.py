"""The nonlinear fit of a hypothesis from several starts, of which the best counts.

In: a hypothesis, the linear algebra that tells where to begin, and what was fitted before. Out: the
best fit, or None where this chair cannot have these effects.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from operator import attrgetter

import numpy as np

from mjchair.diagnosis.explain import hypotheses, search_rules
from mjchair.diagnosis.explain.hypotheses import Hypothesis
from mjchair.diagnosis.explain.near_fit import NearFit
from mjchair.diagnosis.explain.screening import Base, Say, gain, goes_far, silent, starting_variant
from mjchair.diagnosis.fit.bench import Bench
from mjchair.diagnosis.fit.column_ids import ColumnId
from mjchair.diagnosis.fit.nonlinear import Fitted, placed, refit
from mjchair.diagnosis.fit.variant import Term, Variant
from mjchair.diagnosis.replay.derivatives import Column
from mjchair.diagnosis.replay.window_states import Track
from mjchair.errors import MjchairError

SHARES = (0.875, 0.75, 0.625, 0.5, 0.375, 0.25, 0.125)  # of linear coefficients, for a new start
ANEW = 3  # times that a fit which goes far begins again where it ended, as long as that brings much
ALIKE = 0.1  # of chi2, and of standard deviations, by which two ends are one
SMALLER = 0.1  # of an effect, where a fit begins once more that went astray


@dataclass(frozen=True, kw_only=True)
class MultiStart:
    """The fit of one hypothesis, from as many starts as it needs.

    Attributes:
      base: around which. hypothesis: what is fitted.
      near: the linear algebra that tells where to begin; None: that of the base.
      part: the best fit of some of the effects; None: none was made.
      best: fit of another hypothesis; what cannot come near it is not started again. None: none.
      behind: chi2 by which linear algebra says that the hypothesis is worse than that one.
      note: is called with a line for each start or end that is left out.
    """

    base: Base
    hypothesis: Hypothesis
    near: NearFit | None
    part: Fitted | None
    best: Fitted | None
    behind: float
    note: Say

    def fit(self) -> Fitted | None:
        """The best fit; from a second start where the first misses what was promised."""
        return self._or_where_best_is(self._or_beside_part(self._best_start()))

    def _best_start(self) -> Fitted | None:
        """The better of two starts; of one, where it gets to what was promised.

        The second is the best place on the line from no effect to what linear algebra promises: a
        tire with a quarter of its friction slides where one with a third of it does not.
        """
        begun = self._begun(1.0)
        first = self._followed(begun)
        if self.near is not None:
            return self._or_from_afar(first)
        many = len(self.hypothesis.starts) > 1 and self.best is not None  # one start is enough
        short = first is None or search_rules.fell_short(
            total=first.total, promised=self._promised, gain=self.hypothesis.gain
        )
        if first is not None and (many or not short or self._is_hopeless(first)):
            return first
        share = self._best_share()
        other = None if share is None else self._begun(share)
        if begun is not None and other is not None and _end_alike(begun, other):
            return first
        second = self._followed(other)
        fits = [f for f in (first, second) if f is not None]
        if len(fits) > 1 and search_rules.starts_disagree(fits[0].total, fits[1].total):
            ends = " and ".join(f"{f.total:.0f}" for f in fits)
            names = self.hypothesis.label
            self.note(f"fits of {names} from two starts end at chi2 of {ends}; the less is used")
        return _better(first, second)

    def _or_from_afar(self, near: Fitted | None) -> Fitted | None:
        """The fit that began near another, or one from afar where that one is stuck.

        What the others had to be without this effect may be a valley of its own: with another
        wheel a caster lifts off. A fit that is clearly better than the part near which it began
        has left that valley.
        """
        if near is not None and gain(self.base, near) >= 0.0:
            better = self.part is not None and self.part.total - near.total > search_rules.WORTH
            if better or not search_rules.is_stuck(total=near.total, promised=near.promised):
                return near
        afar = replace(self, near=None)
        return _better(near, afar._followed(afar._begun(1.0)))

    def _or_beside_part(self, fitted: Fitted | None) -> Fitted | None:
        """The fit, or a better one that begins where a part of the hypothesis was fitted.

        With one effect more nothing fits worse, so a fit that does has gone astray. It then begins
        near no effect: the size that linear algebra promised led astray.
        """
        part = self.part
        if part is None or (fitted is not None and fitted.total <= part.total):
            return fitted
        taken = {term.effect.key for term in part.variant.terms}
        more = [_smaller(t) for t in self._terms() if t.effect.key not in taken]
        start = replace(part.variant, terms=(*part.variant.terms, *more))
        return _better(fitted, made_anew(self.base.bench, start, part.track))

    def _or_where_best_is(self, fitted: Fitted | None) -> Fitted | None:
        """The fit, or a better one that begins where the best ended, with its own effects there.

        A window's state may have more than one valley, as where a caster turns over or not. Of two
        effects that linear algebra hardly tells apart, only one may have come to the deeper one.
        """
        best = self.best
        if best is None or not search_rules.ends_elsewhere(
            behind=np.inf if fitted is None else fitted.total - best.total,
            promised=self.behind,
            gain=gain(self.base, best),
        ):
            return fitted
        known = {term.effect.key: term for term in best.variant.terms}
        terms = tuple(_as_in(known.get(t.effect.key), t) for t in self._terms())
        start = replace(best.variant, terms=terms)
        return _better(fitted, made_anew(self.base.bench, start, best.track))

    def _best_share(self) -> float | None:
        """The share of the linear coefficients that fits best as it stands; None: none can be.

        Shares that end at the same bounds are one start, and the whole is known already.
        """
        if len(self.hypothesis.starts) > 1:  # the simulations are worth it for a single effect only
            return 0.5
        totals, known = {}, [self._values(1.0)]
        for share in SHARES:
            if self._values(share) in known:
                continue
            known.append(self._values(share))
            try:
                totals[share] = self._chi2_at(share)
            except (MjchairError, np.linalg.LinAlgError):
                continue
        return min(totals, key=totals.__getitem__, default=None)

    def _values(self, share: float) -> list[Mapping[str, float]]:
        """The effects' parameters at a share of the linear fit's coefficients."""
        return [t.values for t in self._at(share).terms]

    def _begun(self, share: float) -> Fitted | None:
        """The fit that begins at a share of the linear fit's coefficients; None: none can be.

        The columns of what is roughly known are those that stand already: none is made anew.
        """
        try:
            return self._refit(share)
        except (MjchairError, np.linalg.LinAlgError) as error:
            why = str(error).partition(";")[0]  # what a user would do about it is no use here
            self.note(f"a start of the fit of {self.hypothesis.label} was left out: {why}")
            return None

    def _followed(self, fitted: Fitted | None) -> Fitted | None:
        """A fit that was begun, with everything made anew where that may bring something."""
        if fitted is None or self._is_behind(fitted):
            return fitted  # what it would gain if all were made anew decides nothing
        if goes_far(fitted):
            return self._around_terms(fitted)
        if search_rules.is_stuck(total=fitted.total, promised=fitted.promised):
            return made_anew(self.base.bench, fitted.variant, fitted.track) or fitted
        return fitted

    def _refit(self, share: float) -> Fitted:
        """The nonlinear fit that begins at a share of the linear fit's coefficients.

        Raises:
          MjchairError: there no chair can be.
        """
        base, reach = self.base, self._reach()
        if self.near is not None:
            return self.near.refit(self.hypothesis.starts, self.part, reach)
        best = base.best
        if best is not None and best.starts == self.hypothesis.starts and share == 1.0:
            # it was fitted already, with the noise that stood before
            start, before = best.fitted.variant, best.fitted.track
        else:
            start, before = self._at(share), base.around.track
        return refit(
            base.bench,
            start,
            before,
            base.nuisances,
            part=self.part,
            reach=reach,
            nothing=base.reduced.total,
        )

    def _chi2_at(self, share: float) -> float:
        """Chi2 at a share of the linear fit's coefficients, as it stands.

        Raises:
          MjchairError: there no chair can be.
        """
        base = self.base
        return placed(base.bench, self._at(share), base.around.track, base.nuisances).total

    def _at(self, share: float) -> Variant:
        """The chair with the effects at a share of the linear fit's coefficients."""
        return starting_variant(self.base, self.base.reduced, self.hypothesis, share)

    def _terms(self) -> tuple[Term, ...]:
        """The effects with the values that linear algebra promises."""
        if self.near is not None:
            return self.near.terms(self.hypothesis.starts)
        return hypotheses.terms(self.base.reduced, self.hypothesis)

    def _is_behind(self, fitted: Fitted) -> bool:
        """Whether a fit ends, by its own promise, too far behind the best to come near it."""
        return fitted.promised > self._reach()

    @property
    def _promised(self) -> float:
        """Chi2 that linear algebra around the chair without effects promises."""
        return self.base.reduced.total - self.hypothesis.gain

    def _is_hopeless(self, fitted: Fitted) -> bool:
        """Whether a fit that ends too far behind the best is not started again elsewhere.

        Where linear algebra says that the effect is about as good, a fit that went astray says less
        than that: a centre of mass 48 mm aside ended 961 of chi2 behind a torque's gain from one
        start, and 102 before it from another.
        """
        base, best = self.base, self.best
        if best is None or not self._is_behind(fitted):
            return False
        return not search_rules.may_be_as_good(
            promised=self.behind,
            behind=self._promised - best.total,
            gain=self.hypothesis.gain,
            brought=gain(base, best),
        )

    def _reach(self) -> float:
        """Chi2 that a fit must promise to come near the best."""
        if self.best is None:
            return np.inf
        return search_rules.reach(best=self.best.total, gain=gain(self.base, self.best))

    def _around_terms(self, fitted: Fitted) -> Fitted:
        """The fit from the effects that were reached, what is roughly known as given; the better.

        A large effect changes how a chair answers to its centre of mass or its inertia. Columns
        that were made without it then push these numbers far from what they are known to be, and
        those that are made once anew are still of a chair that is not the one they lead to.
        """
        start = replace(fitted.variant, offsets={})
        for _ in range(ANEW):
            again = made_anew(self.base.bench, start, fitted.track, reach=self._reach())
            if again is None:
                return fitted
            if fitted.total - again.total < search_rules.WORTH:
                if start is fitted.variant and not self._is_behind(again):
                    fitted.anew = again  # nobody need make it a second time
                return min(fitted, again, key=attrgetter("total"))
            fitted, start = again, again.variant
            if self._is_behind(fitted):
                break
        return fitted


def made_anew(
    bench: Bench,
    start: Variant,
    before: Track,
    columns: dict[ColumnId, Column] | None = None,
    note: Say = silent,
    reach: float = np.inf,
) -> Fitted | None:
    """The fit from a variant, all columns made there; None: no chair can be so.

    Args:
      columns: of what is roughly known, to be used instead; None: they are made there too.
      note: is called with the reason where no chair can be so.
      reach: chi2; a fit that promises more after a round ends there.
    """
    try:
        return refit(bench, start, before, columns, reach=reach)
    except (MjchairError, np.linalg.LinAlgError) as error:
        note(str(error))
        return None


def _end_alike(one: Fitted, other: Fitted) -> bool:
    """Whether two fits of the same effects end in the same place.

    Whatever is made anew around both then ends in one place too, so it is made around one of them.
    """
    sizes = zip(one.variant.terms, other.variant.terms, strict=True)
    apart = [
        abs(a.values[p.name] - b.values[p.name]) / max(one.std[key], 1e-300)
        for a, b in sizes
        for key, p in a.parameters
    ]
    theirs = other.variant.offsets
    apart += [abs(by - theirs.get(name, 0.0)) for name, by in one.variant.offsets.items()]
    return abs(one.total - other.total) < ALIKE and max(apart, default=0.0) < ALIKE


def _better(*fits: Fitted | None) -> Fitted | None:
    """The best of the fits that could be made; None: none could."""
    return min((f for f in fits if f is not None), key=attrgetter("total"), default=None)


def _as_in(other: Term | None, term: Term) -> Term:
    """A term with the values that it has in another fit, if it is in it in the same form."""
    if other is None or other.effect is not term.effect:
        return term
    return replace(term, values=other.values)


def _smaller(term: Term) -> Term:
    """A tenth of an effect, in the place and at the time where it is."""
    values = {
        p.name: p.neutral + SMALLER * (term.values[p.name] - p.neutral)
        for _, p in term.parameters
        if p.sized
    }
    return replace(term, values={**term.values, **values})
