"""Where a flag stands in samples, and where samples are missing.

In: a flag for each sample, or their times. Out: places of every stretch of True, from its first
sample to its last; a flag of the times that lie in a gap. Nothing is measured here.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def stretches(flag: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First sample, and the one after the last, of every stretch that is True of a flag (n,)."""
    edges = np.flatnonzero(np.diff(np.r_[False, flag, False].astype(int)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def in_a_gap(
    time: NDArray[np.float64], seen: NDArray[np.float64], longest: float
) -> NDArray[np.bool_]:
    """Which times (n,), s, lie between two samples at `seen` (m,), s, that are further apart.

    Args:
      longest: s between samples that make no gap.
    """
    wide = np.flatnonzero(np.diff(seen) > longest)
    at = np.searchsorted(seen, time, side="right") - 1
    return np.asarray(np.isin(at, wide) & (time > seen[at]))
