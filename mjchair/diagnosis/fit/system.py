"""All windows as linear algebra around one chair: products of white columns, window by window.

In: the columns of every window of a chair. Out: `System`, the products of each window.

Only little is kept of a window: the products of its columns with one another and with the
residual. Every later test, fit and score is made of sums of these (bounded.py).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis.fit.column_ids import ColumnId, RoughlyKnown
from mjchair.diagnosis.fit.elimination import eliminate_window
from mjchair.diagnosis.fit.process import Process
from mjchair.diagnosis.fit.slow_part import BAND, Cells, cells, slow_components
from mjchair.diagnosis.fit.whitening import Whitener
from mjchair.diagnosis.replay.derivatives import Column
from mjchair.diagnosis.replay.sampling import residual
from mjchair.diagnosis.replay.simulator import WindowSimulator
from mjchair.diagnosis.replay.window_states import Track

Array = NDArray[np.float64]
# share of a column's power that must survive the elimination: less is the curvature of a free
# state. With precise channels and a shaken chair a drag of 14 standard errors keeps 3e-5
SEEN = 1e-6


@dataclass(kw_only=True, eq=False)
class System:
    """Products of white columns, window by window.

    Attributes:
      columns: p of them. nuisance: how many, at the start, are nuisances with unit prior.
      free: how many of those, the last, are effects that are in, without prior.
      G: (windows, p, p). b: (windows, p). c: (windows,) chi2 of the residual.
      run: (windows,) index of the run. back: (nuisance,) where the model already stands from the
        centre of its priors, in standard deviations.
      confined: (windows,) how much narrower data make what each window is free in, as chi2.
      slow: slow components of the windows. cells: slow parts, with the best nuisances put in.
    """

    columns: list[ColumnId]
    nuisance: int
    free: int = 0
    G: Array
    b: Array
    c: Array
    run: NDArray[np.int64]
    back: Array
    confined: Array = field(default_factory=lambda: np.zeros(0))
    slow: list[list[Array]] = field(default_factory=list)
    cells: list[Cells] = field(default_factory=list)

    @cached_property
    def places(self) -> dict[ColumnId, int]:
        """Place of every column."""
        return {c: i for i, c in enumerate(self.columns)}

    def set_cells(self, step: Array) -> None:
        """Take the slow parts with the nuisances at `step` (nuisances,)."""
        self.cells = [cells(components, step) for components in self.slow]

    def index(self, columns: Sequence[ColumnId]) -> list[int]:
        """Places of columns."""
        return [self.places[c] for c in columns]

    def of_data(self, k: int, first: int) -> System:
        """The system of data that show what nuisance `k` changes; without the `first` columns.

        The other nuisances stand in the centre of their priors. Cells are not set.
        """
        return replace(
            self,
            columns=self.columns[first:],
            nuisance=self.nuisance - first,
            G=self.G[:, first:, first:],
            b=self.G[:, first:, k],
            c=self.G[:, k, k],
            back=np.zeros(self.nuisance - first),
            slow=[
                [np.column_stack([band[:, 1 + k], band[:, 1 + first :]]) for band in window]
                for window in self.slow
            ],
            cells=[],
        )


def build(
    simulator: WindowSimulator,
    track: Track,
    whitener: Whitener,
    columns: Mapping[ColumnId, Column],
    *,
    shown: Column,
    nuisance: int,
    offsets: Mapping[str, float],
    free: int = 0,
    process: Process | None = None,
    only: Collection[int] | None = None,
) -> System:
    """Eliminate every window's state and disturbances and form the products.

    Args:
      columns: (rows, channels) a window; nuisances first, scaled by their priors.
      shown: what the channels show of the chair of the track, (rows, channels) a window.
      nuisance: how many are. offsets: where nuisances already are, in standard deviations.
      free: how many of the nuisances, the last, are effects that are in.
      process: what shakes the chair; None: nothing.
      only: windows that are asked about; the others tell nothing. None: all.

    Returns:
      The system without cells; that of some windows `only` has no slow part either.
    """
    ids = list(columns)
    p, count = len(ids), len(simulator.windows)
    G, b, c = np.zeros((count, p, p)), np.zeros((count, p)), np.zeros(count)
    confined = np.zeros(count)
    slow: list[list[Array]] = [[] for _ in simulator.windows]
    raw = np.zeros(p)
    for i, w in enumerate(simulator.windows):
        if only is not None and i not in only:
            continue
        miss = residual(simulator.measured(w), shown[i], simulator.channels)
        stacked = np.stack([columns[n][i] for n in ids], axis=2)
        window = eliminate_window(simulator, track, whitener, i, miss, stacked, process)
        G[i], b[i], c[i] = window.G, window.b, window.chi2
        confined[i] = window.confined
        raw += (window.J * window.J).sum(axis=0)
        if only is None:
            slow[i] = slow_components(window, nuisance, whitener.slow(i, BAND))
    hidden = taken_whole(G.sum(axis=0).diagonal(), raw)
    hidden[:nuisance] = False
    G[:, hidden, :], G[:, :, hidden], b[:, hidden] = 0.0, 0.0, 0.0
    system = System(
        columns=ids,
        nuisance=nuisance,
        free=free,
        G=G,
        b=b,
        c=c,
        run=np.array([w.run for w in simulator.windows]),
        back=np.array([_offset(n, offsets) for n in ids[:nuisance]]),
        confined=confined,
        slow=slow,
    )
    return system


def taken_whole(left: Array, raw: Array) -> NDArray[np.bool_]:
    """Which columns a free initial state takes away whole: what is left of them is rounding.

    Args:
      left, raw: (p,) power of the columns after the elimination, and before.
    """
    return np.asarray(left < SEEN * raw)


def _offset(column: ColumnId, offsets: Mapping[str, float]) -> float:
    return offsets.get(column.name, 0.0) if isinstance(column, RoughlyKnown) else 0.0
