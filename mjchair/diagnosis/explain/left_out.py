"""What effects bring on data that they were not fitted to: each run, or manoeuvre, in turn.

In: linear systems with and without the effects. Out: the drop of chi2 on what was left out.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis.explain.screening import Base
from mjchair.diagnosis.fit import bounded
from mjchair.diagnosis.fit.bench import Bench
from mjchair.diagnosis.fit.nonlinear import Fitted
from mjchair.diagnosis.fit.system import System

Array = NDArray[np.float64]
ALONE = 0.05  # share of a column that the other parts must show, for a part to be held out


def held_out(
    bench: Bench,
    plain: tuple[System, Sequence[int]],
    full: tuple[System, Sequence[int]],
    by: str = "run",
) -> Array:
    """Drop of chi2 on windows that a fit did not see: each run (or manoeuvre) in turn.

    Args:
      plain, full: a system, and its columns that are fitted besides its nuisances.
      by: "run" or "manoeuvre". Of a part that alone shows a column every other window is left out
        in turn; where these alone show it they count 0.

    Returns:
      (windows,) of those that are fitted to.
    """
    runs, windows = bench.simulator.study.runs, bench.windows
    label = [int(full[0].run[i]) for i in windows]
    parts = np.array([str(r) if by == "run" else runs[r].manoeuvre for r in label])
    if np.unique(parts).size < 2:  # a single part: every other window
        parts = np.array([str(k % 2) for k in range(len(windows))])
    size = np.array([np.diag(full[0].G[i])[list(full[1])] for i in windows])
    gains = np.zeros(len(windows))
    for inside in _left_out(parts, size):
        before, after = (bounded.solve(s, windows[~inside], c)[0] for s, c in (plain, full))
        for k in np.flatnonzero(inside):
            i = int(windows[k])
            gains[k] = bounded.chi2(plain[0], i, before) - bounded.chi2(full[0], i, after)
    return gains


def _left_out(parts: NDArray[np.str_], size: Array) -> Iterator[NDArray[np.bool_]]:
    """Which windows (windows,) are left out together, so that the others show every column.

    Args:
      parts: (windows,). size: (windows, columns), of each column in each window.
    """
    odd = np.arange(len(parts)) % 2 == 1
    for part in np.unique(parts):
        mine = parts == part
        for inside in (mine,) if _shown(size, ~mine) else (mine & odd, mine & ~odd):
            if inside.any() and _shown(size, ~inside):
                yield inside


def _shown(size: Array, there: NDArray[np.bool_]) -> bool:
    """Whether the windows that are there show every column."""
    return bool((size[there].sum(axis=0) >= ALONE * size.sum(axis=0)).all())


def with_terms(fitted: Fitted) -> tuple[System, list[int]]:
    """The system of a fit, and the columns of its effects."""
    return fitted.system, list(range(fitted.system.nuisance, len(fitted.system.columns)))


def held_out_gain(base: Base, fitted: Fitted, by: str = "run") -> float:
    """Drop of chi2 that a fit brings on the parts that it did not see."""
    return float(held_out(base.bench, (base.plain.system, []), with_terms(fitted), by).sum())
