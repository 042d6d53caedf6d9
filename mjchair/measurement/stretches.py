"""Where a flag stands in samples: every stretch of True, from its first sample to its last.

In: a flag for each sample. Out: places of the stretches. Nothing is measured here.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def stretches(flag: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First sample, and the one after the last, of every stretch that is True of a flag (n,)."""
    edges = np.flatnonzero(np.diff(np.r_[False, flag, False].astype(int)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
