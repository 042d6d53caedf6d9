"""Effects that act in one run alone, by linear algebra: every single effect, in every run.

In: the linear system of all columns, and starts of effects. Out: for each run, the system's sums
with columns that act there alone, and the effects by what they bring.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis.explain import hypotheses
from mjchair.diagnosis.explain.candidates import Start
from mjchair.diagnosis.explain.hypotheses import Hypothesis
from mjchair.diagnosis.fit import bounded
from mjchair.diagnosis.fit.bounded import Reduced
from mjchair.diagnosis.fit.column_ids import ColumnId
from mjchair.diagnosis.fit.system import System
from mjchair.diagnosis.replay.derivatives import Column


@dataclass(frozen=True, kw_only=True)
class ActingIn:
    """Effects in one run.

    Attributes:
      run: its index. reduced: sums of columns that act there alone. options: best first.
    """

    run: int
    reduced: Reduced
    options: list[Hypothesis]

    @property
    def score(self) -> float:
        """Of the best effect."""
        return self.options[0].score


def best_run(
    system: System, windows: NDArray[np.int64], starts: Sequence[Start]
) -> ActingIn | None:
    """The run in which one effect alone brings most; None: there is one run, or nothing does."""
    found = _each_run(system, windows, starts)
    return max(found, key=lambda acting: acting.score, default=None)


def _each_run(
    system: System, windows: NDArray[np.int64], starts: Sequence[Start]
) -> Iterator[ActingIn]:
    runs = np.unique(system.run[windows])
    for run in runs if len(runs) > 1 else ():
        reduced = bounded.reduce(_alone(system, run), windows)
        options = hypotheses.singles(reduced, starts)
        if options:
            yield ActingIn(run=int(run), reduced=reduced, options=options)


def _alone(system: System, run: int) -> System:
    """The system in which nothing but what is only roughly known acts outside one run."""
    first, outside = system.nuisance, system.run != run
    G, b = system.G.copy(), system.b.copy()
    G[outside, first:, :] = 0.0
    G[outside, :, first:] = 0.0
    b[outside, first:] = 0.0
    return replace(system, G=G, b=b)


def columns_of(
    acting: ActingIn, run: NDArray[np.int64], columns: dict[ColumnId, Column]
) -> dict[ColumnId, Column]:
    """The columns of the best effect, zero outside its run.

    Args:
      run: (windows,) index of the run of each. columns: of all effects.
    """
    return {
        c: [window * (own == acting.run) for window, own in zip(columns[c], run, strict=True)]
        for c in acting.options[0].columns
    }
