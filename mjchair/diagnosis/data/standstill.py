"""Where a measured chair stands, and where it comes to rest.

In: a run. Out: stretches of its samples in which the chair stands, and the times around each stop
that no fit uses. A tire that stops pushes the chair back a little and the chair rocks; how much and
how long is an assumption in every model and differs from chair to chair.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mjchair.measurement.trial import Trial

SLOWEST = {  # channel -> average below which the chair stands, rad/s and m/s
    "left_wheel_speed": 0.05,
    "right_wheel_speed": 0.05,
    "velocity.x": 0.02,
}
SPAN = 0.1  # s, over which they are averaged
STANDS = 0.8  # s, the shortest stand: a chair that turns back stands for less
ROCKING = 3.0  # times those averages: a chair that rocks to rest is slower
ROLLS = 1.0  # s, at least, before a stop: less holds no window
BEFORE = 0.1  # s before the chair stands, as long as the average
ROCKS = 2.0  # s after that: the chairs that ship rock for about as long, by assumed tire damping


def still_stretches(trial: Trial, shortest: float = STANDS) -> list[tuple[int, int]]:
    """First sample, and the one after the last, of every stretch in which the chair stands.

    Args:
      shortest: such stretch, s. A run of which no channel tells its speed has none.
    """
    time = trial.time
    return [(a, b) for a, b in _stretches(_slower(trial)) if time[b - 1] - time[a] > shortest]


def rests(trial: Trial) -> list[tuple[float, float]]:
    """From when to when (s) a run is left out, for each time that the chair comes to rest.

    A run that begins at rest does not come to rest there.
    """
    time, slow, rocking = trial.time, _slower(trial), _stretches(_slower(trial, ROCKING))
    out: dict[int, int] = {}
    for first, after in still_stretches(trial):
        # it first stood where it began to rock
        begins = max(a for a, b in rocking if a <= first < b)
        out[begins + int(np.argmax(slow[begins:]))] = after
    return [
        (float(time[a]) - BEFORE, min(float(time[a]) + ROCKS, float(time[b - 1])))
        for a, b in out.items()
        if time[a] - time[0] > ROLLS
    ]


def _slower(trial: Trial, factor: float = 1.0) -> NDArray[np.bool_]:
    """Which samples are slower than `factor` times SLOWEST in every channel; none if no channel."""
    time = trial.time
    seen = [name for name in SLOWEST if name in trial.channels]
    slow = np.full(time.size, bool(seen))
    width = max(3, int(SPAN / max(float(np.median(np.diff(time))), 1e-4)))
    for name in seen:
        filled = np.interp(time, *trial.samples(name))
        smooth = np.convolve(filled, np.ones(width) / width, mode="same")
        slow &= np.abs(smooth) <= factor * SLOWEST[name]
    return slow


def _stretches(held: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First sample, and the one after the last, of every stretch that is True."""
    edges = np.flatnonzero(np.diff(np.r_[0, held.astype(int), 0]))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
