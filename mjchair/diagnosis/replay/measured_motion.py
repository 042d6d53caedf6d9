"""Smoothed motions that were measured besides the channels, such as `rider_motion`.

In: a measured run. Out: `Motion` by name: place and speed at any time.

A column of a table that is neither sensor nor input is a motion (m). Where a model has an actuator
of the column's name, that follows it; a joint of the name starts at its place and speed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from mjchair.diagnosis.data.study import Run

Array = NDArray[np.float64]
SMOOTHING = 0.12  # s, half width of the parabola through a measured motion
FEWEST = 8  # samples


@dataclass(frozen=True)
class Motion:
    """A measured motion on an even grid: time (n,) s, place (n,) m, speed (n,) m/s."""

    time: Array
    place: Array
    speed: Array

    def place_at(self, time: Array) -> Array:
        """Place at times (s), m."""
        return np.asarray(np.interp(time, self.time, self.place))

    def start(self, time: float) -> tuple[float, float]:
        """Place (m) and speed (m/s) at a time (s)."""
        place, speed = (np.interp(time, self.time, v) for v in (self.place, self.speed))
        return float(place), float(speed)


def motions(run: Run) -> dict[str, Motion]:
    """The motions of a run, by the name of their column; none of a column with few samples."""
    smoothed = {name: _smoothed(run.trial.time, values) for name, values in run.trial.other.items()}
    return {name: motion for name, motion in smoothed.items() if motion is not None}


def _smoothed(time: Array, values: Array) -> Motion | None:
    there = ~np.isnan(values)
    time, place = time[there], values[there]
    if time.size < FEWEST:
        return None
    rate = 1.0 / float(np.median(np.diff(time)))
    grid = np.arange(time[0], time[-1], 1.0 / rate)
    even = np.interp(grid, time, place)
    width = min(2 * max(2, round(SMOOTHING * rate)) + 1, 2 * ((even.size - 1) // 2) - 1)
    smooth = savgol_filter(even, width, 3) if width > 3 else even
    return Motion(grid, smooth, np.gradient(smooth, grid))
