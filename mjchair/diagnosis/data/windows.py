"""Windows: stretches of a run whose initial state is free.

In: runs. Out: windows of about two seconds. Over a whole run every small error adds up and
everything becomes significant; over a second or two only forces show. A window is simulated from a
little before it begins (the lead), so that what is fast in the chair has settled on the slow state
when its first sample counts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis.data.first_state import stops
from mjchair.diagnosis.data.study import Run

Array = NDArray[np.float64]

LENGTH = 2.0  # s, of a window
LEAD = 0.2  # s


@dataclass(frozen=True)
class Window:
    """A stretch of a run.

    Attributes:
      run: index of the run in the study. index: of the window in its run.
      start: where its simulation starts, s. first, last: where its samples count, s.
      rows: indices of the samples, in the run's time.
    """

    run: int
    index: int
    start: float
    first: float
    last: float
    rows: NDArray[np.int64]


def cut(runs: Sequence[Run], step: float, length: float = LENGTH) -> list[Window]:
    """Cut every run into windows of about `length` (s), on a grid of simulation steps (s)."""
    windows = []
    for i, run in enumerate(runs):
        time = run.trial.time
        begin, end = float(time[0]), stops(run) or float(time[-1])
        count = max(1, round((end - begin) / length))
        inner = begin + np.round((end - begin) * np.arange(1, count) / count / step) * step
        edges = np.r_[begin, inner, end + step]
        for k in range(count):
            first = edges[k] + (LEAD if k == 0 else 0.0)
            rows = np.flatnonzero((time >= first) & (time < edges[k + 1]))
            if rows.size < 5:
                continue
            start = begin if k == 0 else edges[k] - LEAD
            windows.append(Window(i, k, float(start), float(first), float(edges[k + 1]), rows))
    return windows
