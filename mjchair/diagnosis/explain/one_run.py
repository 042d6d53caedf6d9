"""An effect that acts in one run alone: a brake that rubs, another floor, a tire that lost air.

In: the screened columns, and the choice of effects that act in all runs. Out: the effects that
explain more by acting in one run than any choice does by acting in all. The other runs rule these
out: where they only do not show an effect, it brings as much in all runs, and is no finding here.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import stats

from mjchair.diagnosis.explain import event, hypotheses, search_rules
from mjchair.diagnosis.explain.choice import Choice
from mjchair.diagnosis.explain.gap import Gap
from mjchair.diagnosis.explain.hypotheses import Hypothesis
from mjchair.diagnosis.explain.in_each_run import ActingIn
from mjchair.diagnosis.explain.screening import Base, best_of_sizes, gain, overstated
from mjchair.diagnosis.fit.variant import Term
from mjchair.effects.effect import step


@dataclass(frozen=True, kw_only=True)
class InOneRun:
    """Effects, each of which explains most of the gap by acting in one run alone.

    Attributes:
      trial: name of the run. acting: all effects there.
      options: those that these runs do not tell apart, best first.
      gain: chi2 that the best brings. others: that the choice brings in all runs.
      by: chi2 by which the best is better, both less what their parameters must bring.
      p: that noise alone brings as much by the best of all effects in all runs.
      sure: whether no choice stands against it. alike: whether it is a rival of the choice. Where
        it is neither, only a choice that is no answer gives way to it.
    """

    trial: str
    acting: ActingIn
    options: list[Hypothesis]
    gain: float
    others: float
    by: float
    p: float
    sure: bool
    alike: bool

    def term(self, option: Hypothesis) -> tuple[Term, dict[str, float]]:
        """One of the effects, and standard errors of its sizes where linear algebra tells them."""
        (start,) = option.starts
        (term,) = hypotheses.terms(self.acting.reduced, option)
        if start.effect.seeds is not None or len(start.columns) != len(start.sizes):
            return term, {}
        at = self.acting.reduced.index(start.columns)
        errors = np.sqrt(np.diag(np.linalg.inv(self.acting.reduced.G[np.ix_(at, at)])))
        sizes = [abs(step(p)) for p in start.sizes]
        names = [p.name for p in start.sizes]
        return term, dict(zip(names, (errors * sizes).tolist(), strict=True))


def is_clear(base: Base, gap: Gap) -> bool:
    """Whether an effect in one run alone explains so much more that no other need be fitted.

    What the fit of roughly known numbers brings alone is no part of what it explains: of a wheel
    2 mm larger that left 29 000 of chi2, an effect in one run seemed to explain 87 000.
    """
    acting = base.acting_alone
    if acting is None:
        return False
    best = acting.options[0]
    everywhere = best_of_sizes(base.reduced, base.starts)
    by = best.score - max((h.score for h in everywhere), default=0.0)
    brings = best.gain - overstated(base)
    clearly = search_rules.is_clearly_of_one_run(by=by, gain=brings, excess=gap.excess)
    return clearly and event.largest(base).gain <= brings


def in_one_run(base: Base, gap: Gap, choice: Choice | None) -> InOneRun | None:
    """Effects that explain more in one run alone than all else; None: nothing does.

    What happened once, in two seconds of a run, is no effect that acts throughout it.
    """
    fitted = choice.fitted if choice else base.plain
    price = fitted.total + (choice.hypothesis.penalty if choice else 0.0)
    acting = _ruled_out_elsewhere(base)
    if acting is None:
        return None
    best = acting.options[0]
    by = price - (base.reduced.total - best.score)
    brings, others = base.plain.total - base.reduced.total + best.gain, gain(base, fitted)
    sure = search_rules.is_of_one_run(by=by, gain=best.gain)
    if event.largest(base).gain > brings:
        return None
    fewer = choice is not None and best.free < choice.hypothesis.free
    rival = search_rules.fits_alike_in_one_run(by=by, fewer=fewer)
    excess = max(gap.excess, others)
    if not (sure or rival or search_rules.may_be_of_one_run(by=by, gain=brings, excess=excess)):
        return None
    alike = [
        h for h in acting.options if best.gain - h.gain < search_rules.not_ruled_out(gain=best.gain)
    ]
    return InOneRun(
        trial=base.bench.simulator.study.runs[acting.run].trial.name,
        acting=acting,
        options=alike,
        gain=brings,
        others=others,
        by=by,
        p=_by_chance(base, acting),
        sure=sure,
        alike=rival,
    )


def _ruled_out_elsewhere(base: Base) -> ActingIn | None:
    """The effects in the run in which one brings most that the other runs rule out; None: none.

    What acts in all runs fits as well where the others only do not show it: of a slalom and two
    coasts, one shows what the left motor lacks.
    """
    acting = base.acting_alone
    if acting is None:
        return None
    everywhere = {h.name: h.score for h in hypotheses.singles(base.reduced, base.starts)}
    options = [
        h
        for h in acting.options
        if h.score > max(everywhere.get(h.name, 0.0), 0.0) + search_rules.TIE
    ]
    return replace(acting, options=options) if options else None


def _by_chance(base: Base, acting: ActingIn) -> float:
    """Chance that noise alone brings as much by the best of these effects, each in every run."""
    best = acting.options[0]
    tests = len(acting.options) * np.unique(base.system.run[base.bench.windows]).size
    return min(1.0, tests * float(stats.chi2.sf(best.gain, best.free)))
