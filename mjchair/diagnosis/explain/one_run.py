"""An effect that acts in one run alone: a brake that rubs, another floor, a tire that lost air.

In: the screened columns, and the choice of effects that act in all runs. Out: the effects that
explain more by acting in one run than any choice does by acting in all. The other runs rule these
out: where they only do not show an effect, it brings as much in all runs, and is no finding here.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis import rules
from mjchair.diagnosis.explain import event, hypotheses
from mjchair.diagnosis.explain.choice import Choice
from mjchair.diagnosis.explain.gap import Gap
from mjchair.diagnosis.explain.hypotheses import Hypothesis
from mjchair.diagnosis.explain.screening import Base, gain
from mjchair.diagnosis.fit import bounded
from mjchair.diagnosis.fit.bounded import Reduced
from mjchair.diagnosis.fit.system import System
from mjchair.diagnosis.fit.variant import Term
from mjchair.effects.effect import step

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class InOneRun:
    """Effects, each of which explains most of the gap by acting in one run alone.

    Attributes:
      trial: name of the run. run: its index.
      reduced: the linear algebra of columns that act there alone.
      options: one effect each, best first; these runs do not tell them apart.
      gain: chi2 that the best brings. others: that the choice brings in all runs.
      by: chi2 by which the best is better, both less what their parameters must bring.
      sure: whether no choice stands against it. alike: whether it is a rival of the choice. Where
        it is neither, only a choice that is no answer gives way to it.
    """

    trial: str
    run: int
    reduced: Reduced
    options: list[Hypothesis]
    gain: float
    others: float
    by: float
    sure: bool
    alike: bool

    def change(self, base: Base) -> list[Array]:
        """What the best effect changes, (rows, channels) of each window."""
        which = self.options[0].columns
        sizes = self.reduced.solve(self.reduced.index(which))
        return [
            sum(s * base.columns[c][i] for s, c in zip(sizes, which, strict=True))
            * (w.run == self.run)
            for i, w in enumerate(base.bench.simulator.windows)
        ]

    def term(self, option: Hypothesis) -> tuple[Term, dict[str, float]]:
        """One of the effects, and standard errors of its sizes where linear algebra tells them."""
        (start,) = option.starts
        (term,) = hypotheses.terms(self.reduced, option)
        if start.effect.seeds is not None or len(start.columns) != len(start.free):
            return term, {}
        at = self.reduced.index(start.columns)
        errors = np.sqrt(np.diag(np.linalg.inv(self.reduced.G[np.ix_(at, at)])))
        sizes = [abs(step(start.effect.parameter(name))) for name in start.free]
        return term, dict(zip(start.free, (errors * sizes).tolist(), strict=True))


def in_one_run(base: Base, gap: Gap, choice: Choice | None) -> InOneRun | None:
    """Effects that explain more in one run alone than all else; None: nothing does.

    What happened once, in two seconds of a run, is no effect that acts throughout it.
    """
    fitted = choice.fitted if choice else base.plain
    price = fitted.total + (choice.hypothesis.penalty if choice else 0.0)
    found = max(_runs(base), key=lambda found: found[2][0].score, default=None)
    if found is None:
        return None
    run, reduced, options = found
    best = options[0]
    by = price - (base.reduced.total - best.score)
    brings, others = base.plain.total - base.reduced.total + best.gain, gain(base, fitted)
    sure = rules.is_of_one_run(by=by, gain=best.gain)
    if event.largest(base).gain > brings:
        return None
    fewer = choice is not None and best.free < choice.hypothesis.free
    rival = rules.fits_alike_in_one_run(by=by, fewer=fewer)
    excess = max(gap.excess, others)
    if not (sure or rival or rules.may_be_of_one_run(by=by, gain=brings, excess=excess)):
        return None
    alike = [h for h in options if best.gain - h.gain < rules.not_ruled_out(gain=best.gain)]
    return InOneRun(
        trial=base.bench.simulator.study.runs[run].trial.name,
        run=run,
        reduced=reduced,
        options=alike,
        gain=brings,
        others=others,
        by=by,
        sure=sure,
        alike=rival,
    )


def _runs(base: Base) -> Iterator[tuple[int, Reduced, list[Hypothesis]]]:
    """Each run of the fit: index, linear algebra of columns that act there alone, and effects."""
    windows = base.bench.windows
    fitted = np.unique(base.system.run[windows])
    for run in fitted if len(fitted) > 1 else ():
        reduced = bounded.reduce(_alone(base.system, run), windows)
        options = hypotheses.singles(reduced, base.starts)
        if options:
            yield int(run), reduced, options


def _alone(system: System, run: int) -> System:
    """The system in which nothing but what is only roughly known acts outside one run."""
    first, outside = system.nuisance, system.run != run
    G, b = system.G.copy(), system.b.copy()
    G[outside, first:, :] = 0.0
    G[outside, :, first:] = 0.0
    b[outside, first:] = 0.0
    return replace(system, G=G, b=b)
