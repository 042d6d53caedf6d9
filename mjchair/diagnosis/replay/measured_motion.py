"""Smoothed motions that were measured besides the channels, such as `rider_motion`.

In: a measured run. Out: `Motion` by name: place and speed at any time.

A column of a table that is neither sensor nor input is a motion (m). Where a model has an actuator
of the column's name, that follows it; a joint of the name starts at its place and speed.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import butter, sosfiltfilt

from mjchair.diagnosis.data.study import Run

Array = NDArray[np.float64]
CUTOFF = 6.0  # Hz, below which a body moves: usual for markers on trunk and arms (Winter 2009)
NYQUIST = 0.8  # of half the sample rate: a cutoff above it smooths nothing
FEWEST = 8  # samples


@dataclass(frozen=True)
class Motion:
    """A motion on an even grid: time (n,) s, place (n,) in its unit.

    Between the samples it is a cubic spline, whose acceleration has no steps: straight lines would
    push the chair at every sample. Before and after them it keeps its speed.
    """

    time: Array
    place: Array

    @cached_property
    def _spline(self) -> CubicSpline:
        return CubicSpline(self.time, self.place)

    def place_at(self, time: Array) -> Array:
        """Place at times (s)."""
        inside = np.clip(time, self.time[0], self.time[-1])
        return np.asarray(self._spline(inside) + (time - inside) * self._spline(inside, 1))

    def start(self, time: float) -> tuple[float, float]:
        """Place, and speed (1/s), at a time (s)."""
        inside = float(np.clip(time, self.time[0], self.time[-1]))
        return float(self.place_at(np.array(time))), float(self._spline(inside, 1))


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
    smooth = even
    if NYQUIST * 0.5 * rate > CUTOFF:  # once forward and once back, so that nothing is late
        low_pass = butter(2, CUTOFF, fs=rate, output="sos")
        smooth = sosfiltfilt(low_pass, even, padlen=min(round(rate), even.size - 1))
    return Motion(grid, smooth)
