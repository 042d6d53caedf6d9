"""Windows: stretches of a run whose initial state is free.

In: runs. Out: windows of about two seconds, shorter in runs in which a caster shimmies. Over a
whole run every small error adds up and everything becomes significant; over a second or two only
forces show. A window is simulated from a little before it begins (the lead), so that what is fast
in the chair has settled on the slow state when its first sample counts.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis.data import shimmy
from mjchair.diagnosis.data.first_state import stops
from mjchair.diagnosis.data.standstill import rests
from mjchair.diagnosis.data.study import Run

Array = NDArray[np.float64]

LENGTH = 2.0  # s, of a window
# where a caster shimmies: over many swings a chair that is a little other gets out of step, and a
# fit finds no way to the size of an effect
SWINGS = 6
SHORT = (0.2, 0.7)  # s, within which such windows are
LEAD = 0.2  # s
# s, lead of a window in which a caster shimmies: how it swings is a part of the state and need not
# settle, and over 0.2 s it gets out of step
BRIEF = 0.06
FEWEST = 5  # samples of a window


@dataclass(frozen=True)
class Window:
    """A stretch of a run.

    Attributes:
      run: index of the run in the study. index: of the window in its run.
      start: where its simulation starts, s. first, last: where its samples count, s.
      rows: indices of the samples, in the run's time. shimmies: whether a caster does, there.
    """

    run: int
    index: int
    start: float
    first: float
    last: float
    rows: NDArray[np.int64]
    shimmies: bool = False


def cut(runs: Sequence[Run], step: float, length: float = LENGTH) -> list[Window]:
    """Cut every run into windows of about `length` (s), on a grid of simulation steps (s).

    What a chair does as it comes to rest is in none of them (standstill.py).
    """
    windows: list[Window] = []
    for i, run in enumerate(runs):
        time, mine, shaken = run.trial.time, list[Window](), shimmy.stretches(run.trial)
        for edges in _edges(run, step, _length(length, shaken)):
            for begin, end in pairwise(edges):
                at_start = begin == time[0]
                there = any(s.begin < end and begin < s.end for s in shaken)
                lead = BRIEF if there else LEAD
                first = begin + (lead if at_start else 0.0)
                rows = np.flatnonzero((time >= first) & (time < end))
                if rows.size < FEWEST:
                    continue
                start = begin - (0.0 if at_start else lead)
                mine.append(
                    Window(i, len(mine), float(start), float(first), float(end), rows, there)
                )
        windows += mine
    return windows


def calm(windows: Sequence[Window], which: Collection[int]) -> list[int]:
    """Of some windows, those in which no caster shimmies; all of them where every one does."""
    quiet = [int(i) for i in which if not windows[i].shimmies]
    return quiet or [int(i) for i in which]


def shimmying(windows: Sequence[Window]) -> bool:
    """Whether a caster shimmies in any of the windows."""
    return any(w.shimmies for w in windows)


def _length(usual: float, shaken: Sequence[shimmy.Stretch]) -> float:
    """Length (s) of the windows of a run.

    A shimmy grows out of swings too small to be seen, so all windows of a run with one are short.

    Args:
      usual: s. shaken: where casters shimmy; nothing: nowhere.
    """
    if not shaken:
        return usual
    swing = min(s.swing for s in shaken)
    return min(usual, float(np.clip(SWINGS * swing, *SHORT)))


def _edges(run: Run, step: float, length: float) -> list[Array]:
    """Edges (s) of the windows of every stretch of a run, between which it comes to rest."""
    time = run.trial.time
    begin, out = float(time[0]), []
    for stop, onward in [*rests(run.trial), (stops(run) or float(time[-1]), np.inf)]:
        count = max(1, round((stop - begin) / length))
        inner = begin + np.round((stop - begin) * np.arange(1, count) / count / step) * step
        out.append(np.r_[begin, inner, stop + step])
        begin += np.ceil((onward - begin) / step) * step
    return out
