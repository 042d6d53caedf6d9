"""Windows: stretches of a run whose initial state is free.

In: runs. Out: windows of about two seconds, shorter in runs in which a caster shimmies. Over a
whole run every small error adds up and everything becomes significant; over a second or two only
forces show. A window is simulated from a little before it begins (the lead), so that what is fast
in the chair has settled on the slow state when its first sample counts. A chair that stands rocks
on its tires for far longer, so a stand has a longer lead, and is one window.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis.data import shimmy
from mjchair.diagnosis.data.first_state import stops
from mjchair.diagnosis.data.standstill import BEFORE, ROCKS, ROLLS, rests, still_stretches
from mjchair.diagnosis.data.study import Run

Array = NDArray[np.float64]
Stands = Sequence[tuple[float, float]]  # from when to when a chair stands, s

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
# s, by which torques may have been recorded late: what acts at the end of a run comes after it
LATE = 0.2


@dataclass(frozen=True)
class Window:
    """A stretch of a run.

    Attributes:
      run: index of the run in the study. index: of the window in its run.
      start: where its simulation starts, s. first, last: where its samples count, s.
      rows: indices of the samples, in the run's time. shimmies: whether a caster does, there.
      stands: whether the chair does, throughout.
    """

    run: int
    index: int
    start: float
    first: float
    last: float
    rows: NDArray[np.int64]
    shimmies: bool = False
    stands: bool = False


def cut(
    runs: Sequence[Run], step: float, length: float = LENGTH, measured: bool = False
) -> list[Window]:
    """Cut every run into windows of about `length` (s), on a grid of simulation steps (s).

    What a chair does as it comes to rest is in none of them (standstill.py), nor is how a model
    settles on its tires where a run begins with a stand. Torques that were measured may have been
    recorded late, so a run of them ends so much earlier.

    Args:
      measured: whether the torques that drive runs were.
    """
    windows: list[Window] = []
    for i, run in enumerate(runs):
        time, mine, shaken = run.trial.time, list[Window](), shimmy.stretches(run.trial)
        stands = [(float(time[a]), float(time[b - 1])) for a, b in still_stretches(run.trial)]
        last = float(time[-1]) - (LATE if measured and run.trial.inputs is not None else 0.0)
        for edges in _edges(run, step, _length(length, shaken), stands, last):
            for begin, end in pairwise(edges):
                at_start = begin == time[0]
                there = any(s.begin < end and begin < s.end for s in shaken)
                lead = max(BRIEF if there else LEAD, _stood(begin, step, stands))
                first = begin + (lead if at_start else 0.0)
                rows = np.flatnonzero((time >= first) & (time < end))
                if rows.size < FEWEST:
                    continue
                start = begin - (0.0 if at_start else lead)
                still = any(a <= begin and end - step <= b for a, b in stands)
                place = (i, len(mine), float(start), float(first), float(end))
                mine.append(Window(*place, rows, shimmies=there, stands=still))
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


def _stood(begin: float, step: float, stands: Stands) -> float:
    """How long the chair has stood as a window begins, s in steps, ROCKS at most."""
    stood = next((begin - a for a, b in stands if a < begin <= b), 0.0)
    return float(np.floor(min(stood, ROCKS) / step) * step)


def _edges(run: Run, step: float, length: float, stands: Stands, last: float) -> list[Array]:
    """Edges (s) of the windows of every stretch of a run, between which it comes to rest.

    A stretch that begins with a stand has an edge where the chair leaves it, if it stands for long.

    Args:
      last: s, after which no sample counts.
    """
    begin = zero = float(run.trial.time[0])
    out = []
    for rest, onward in [*rests(run.trial), (stops(run) or last, np.inf)]:
        stop = min(rest, last)
        if stop < begin:
            break
        stands_until = next((b - BEFORE for a, b in stands if a <= begin < b), begin)
        leaves = min(stands_until, stop)
        settled = min(begin + ROCKS, leaves) if begin == zero else begin
        moves = leaves if leaves - settled > ROLLS else settled
        settled, moves = (zero + round((at - zero) / step) * step for at in (settled, moves))
        count = round((stop - moves) / length)
        inner = moves + np.round((stop - moves) * np.arange(count) / max(count, 1) / step) * step
        out.append(np.unique(np.r_[settled, inner, stop + step]))
        begin += np.ceil((onward - begin) / step) * step
    return out
