"""Hypotheses weighed around a fit of several effects instead of around the chair without any.

In: a fit with its effects as columns, and the columns of all others. Out: the chi2 that a
hypothesis gains, the values from which its fit begins, and that fit. Around a chair without any,
a large effect is wrong by more than a small one brings; here all that stays is where it was fitted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis.explain.candidates import Start
from mjchair.diagnosis.explain.hypotheses import Hypothesis, priced
from mjchair.diagnosis.explain.screening import Base, Found, nuisances_of
from mjchair.diagnosis.fit import bounded
from mjchair.diagnosis.fit.bounded import Reduced
from mjchair.diagnosis.fit.column_ids import ColumnId
from mjchair.diagnosis.fit.nonlinear import Fitted, refit
from mjchair.diagnosis.fit.variant import Term

Array = NDArray[np.float64]


@dataclass(kw_only=True)
class NearFit:
    """The linear algebra around a fit.

    Attributes:
      base: whose columns. found: the effects that are in, and their fit.
      reduced: effects that are in (by their parameters), and all others, as columns.
    """

    base: Base
    found: Found
    reduced: Reduced

    def weigh(self, starts: Sequence[Start]) -> Hypothesis:
        """The hypothesis; as in `hypotheses.weigh` it gains over the chair without effects."""
        which, _, total = self._solved(starts)
        if (np.diag(self.reduced.G)[which] < 1e-8).any():
            return Hypothesis(tuple(starts), 0.0, -np.inf)
        return priced(starts, self.base.reduced.total - total)

    def terms(self, starts: Sequence[Start]) -> tuple[Term, ...]:
        """The effects with the values that the linear fit gives them."""
        _, values, _ = self._solved(starts)
        out, at = [], 0
        known = {t.effect.key: t for t in self.found.fitted.variant.terms}
        for start in starts:
            count = len(self._columns(start))
            mine = values[at : at + count]
            out.append(known[start.effect.key] if self._is_in(start) else start.term(mine))
            at += count
        return tuple(out)

    def refit(self, starts: Sequence[Start], part: Fitted | None, reach: float) -> Fitted:
        """The nonlinear fit that begins there; what is given with `starts` as `refit` takes it."""
        near = self.found.fitted
        start = replace(near.variant, terms=self.terms(starts))
        known = nuisances_of(self.base, near)
        return refit(self.base.bench, start, near.track, known, part=part, reach=reach)

    def physical(self, starts: Sequence[Start]) -> bool:
        """Whether what is new lies on the allowed side of its parameters, not far beyond them."""
        _, values, _ = self._solved(starts)
        at = 0
        for start in starts:
            count = len(self._columns(start))
            mine = values[at : at + count]
            if not self._is_in(start) and not (start.allows(mine) and start.can_be(mine)):
                return False
            at += count
        return True

    def _is_in(self, start: Start) -> bool:
        return any(s.columns == start.columns for s in self.found.starts)

    def _columns(self, start: Start) -> list[ColumnId]:
        """The columns of an effect: of its parameters where it is in."""
        if not self._is_in(start):
            return list(start.columns)
        key = start.effect.key
        term = next(t for t in self.found.fitted.variant.terms if t.effect.key == key)
        return [parameter for parameter, _ in term.parameters]

    def _solved(self, starts: Sequence[Start]) -> tuple[list[int], Array, float]:
        """Places of the columns of effects, their coefficients, and chi2.

        Effects that are in and not among these are taken out: set back by what they are. What only
        shapes them, as a place does, stays: without them it means nothing.
        """
        r = self.reduced
        which = r.index([c for s in starts for c in self._columns(s)])
        keys = {s.effect.key for s in starts if self._is_in(s)}
        out, back = [], []
        for term in self.found.fitted.variant.terms:
            if term.effect.key not in keys:
                for key, p in term.parameters:
                    if p.sized:
                        out.append(r.index([key])[0])
                        back.append((p.neutral - term.values[p.name]) / p.change)
        by = np.array(back)
        b = r.b - r.G[:, out] @ by
        total = r.total - 2.0 * r.b[out] @ by + by @ r.G[np.ix_(out, out)] @ by
        values = bounded.scaled_solve(r.G[np.ix_(which, which)], b[which])
        return which, values, float(total - b[which] @ values)


def near_fit(base: Base, found: Found) -> NearFit:
    """The linear algebra around a fit."""
    columns = {**found.fitted.columns, **base.columns_around(found.fitted)}
    system = base.bench.system(
        found.fitted.track, columns, len(base.nuisances), found.fitted.variant
    )
    return NearFit(base=base, found=found, reduced=bounded.reduce(system, base.bench.windows))
