"""Where a measured caster shimmies: it swings back and forth many times a second.

In: a run's trial. Out: the stretches in which it does. What a chair does there hangs on very little
of its state, so that windows must be short.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mjchair.measurement.trial import Trial

Array = NDArray[np.float64]
SWING = 0.1  # rad, the least swing from side to side; a sensor scatters less
FASTEST = 0.35  # s, the longest swing: no person steers so fast (assumption)
SWINGS = 5  # that follow each other, at least

CASTERS = ("left_caster_angle", "right_caster_angle")


def stretches(trial: Trial) -> list[tuple[float, float]]:
    """From when to when (s) a caster shimmies; each caster by itself."""
    out: list[tuple[float, float]] = []
    for channel in CASTERS:
        if channel in trial.channels:
            time, angle = trial.samples(channel)
            out += _fast(time[_turns(np.unwrap(angle))])
    return out


def _turns(angle: Array) -> NDArray[np.int64]:
    """Samples at which an angle turns back by SWING or more."""
    out: list[int] = []
    way = 0
    low = high = 0  # samples of the extremes since the last turn
    for k, value in enumerate(angle):
        low, high = (k if value < angle[low] else low), (k if value > angle[high] else high)
        if way <= 0 and value - angle[low] > SWING:
            out, way, high = [*out, low], 1, k
        elif way >= 0 and angle[high] - value > SWING:
            out, way, low = [*out, high], -1, k
    return np.array(out, np.int64)


def _fast(turns: Array) -> list[tuple[float, float]]:
    """Stretches of at least SWINGS swings, each no longer than FASTEST; turns: s."""
    out = []
    for part in np.split(turns, np.flatnonzero(np.diff(turns) > FASTEST) + 1):
        if part.size > SWINGS:
            out.append((float(part[0]), float(part[-1])))
    return out
