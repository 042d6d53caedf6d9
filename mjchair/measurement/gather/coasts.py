"""Free rolling in a run whose torque was not measured.

In: the speed of a wheel over time. Out: the parts in which the chair only slows, evenly. Between
two pushes a hand is off the rim for less than a second, and trunk and arms move all the time, so a
part counts from 1.5 s on.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from mjchair.measurement.stretches import in_a_gap, stretches

Array = NDArray[np.float64]

SHORTEST = 1.5  # s
SLOWEST = 0.5  # rad/s: slower, and a chair may be held
RADIUS = 0.3  # m, to speak of acceleration in m/s^2
GAINS = 0.06  # m/s^2, above which something drives; a bump gives less over a quarter of a second
BRAKES = 1.0  # m/s^2, beyond which something brakes
EVEN = 0.20  # m/s^2, within which a coast's deceleration stays about its middle
CUTOFF = 2.0  # Hz, of the speed that is judged
PUSH, PUSHED = 0.3, 0.1  # m/s^2 and s, which a push is at least; a coast's slowing is below it
FEW = 10  # samples, of which none tells a push or a coast
GAP = 0.25  # s between samples, in which a hand may have been on the rim
MARGIN = 0.15  # s, left out at both ends


def coasts(time: Array, speed: Array) -> list[tuple[float, float]]:
    """Begin and end (s) of the parts of a run in which the wheel rolls freely.

    Args:
      time: (n,), s. speed: (n,), rad/s, forward or backward.
    """
    if time.size < FEW:
        return []
    step = float(np.median(np.diff(time)))
    even = np.arange(time[0], time[-1], max(step, 0.005))
    smooth = smoothed(even, np.interp(even, time, speed))
    gained = RADIUS * np.gradient(np.abs(smooth), even)
    free = (gained < GAINS) & (gained > -BRAKES) & (np.abs(smooth) > SLOWEST)
    free &= ~in_a_gap(even, time, max(GAP, 3.0 * step))
    found = []
    for first, after in stretches(free):
        found += _even_parts(even, gained, first, after - 1)
    return found


def pushes(time: Array, pull: Array) -> int:
    """How often a chair is pushed, by its acceleration along the way alone.

    Args:
      time: (n,), s. pull: (n,), m/s^2, forward or backward positive, with any offset.
    """
    if time.size < FEW:
        return 0
    even = np.linspace(time[0], time[-1], max(FEW, min(time.size, int(200.0 * np.ptp(time)))))
    smooth = smoothed(even, np.interp(even, time, pull))
    smooth = smooth - np.median(smooth)
    counts = []
    for way in (1.0, -1.0):
        parts = stretches(way * smooth > PUSH)
        counts.append(sum(bool(even[b - 1] - even[a] >= PUSHED) for a, b in parts))
    return max(counts)


def smoothed(even: Array, values: Array) -> Array:
    """Values (n,) at even times (n,), s, below CUTOFF, without a lag."""
    rate = 1.0 / float(even[1] - even[0])
    sos = butter(2, min(CUTOFF, 0.4 * rate), fs=rate, output="sos")
    return np.asarray(sosfiltfilt(sos, values, padlen=min(100, even.size - 2)))


def _even_parts(time: Array, gained: Array, first: int, last: int) -> list[tuple[float, float]]:
    """The longest part about whose middle the deceleration stays even, if that is long enough."""
    begin, end = time[first] + MARGIN, time[last] - MARGIN
    inside = (time >= begin) & (time <= end)
    if end - begin < SHORTEST or not inside.any():
        return []
    off = np.abs(gained - np.median(gained[inside])) > EVEN
    parts = [(float(time[a]), float(time[b - 1])) for a, b in stretches(inside & ~off)]
    return [(a, b) for a, b in parts if b - a >= SHORTEST]
