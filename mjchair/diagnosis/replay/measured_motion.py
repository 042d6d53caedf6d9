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
from scipy.fft import dst
from scipy.interpolate import CubicSpline
from scipy.signal import butter, sosfiltfilt

from mjchair.diagnosis.data.study import Run

Array = NDArray[np.float64]
# Hz, that are tried as the end of what a body moves with: 6 Hz is usual for markers on trunk and
# arms (Winter 2009)
CUTOFFS = np.geomspace(0.5, 6.0, 30)
NYQUIST = 0.8  # of half the sample rate: no cutoff is above it
ORDER = 3  # of the filter, which runs once forward and once back
END = 0.3  # s at both ends, through which a cubic goes
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

    def acceleration_at(self, time: Array) -> Array:
        """Acceleration at times (s), its unit/s^2; 0 before and after the motion."""
        there = (time >= self.time[0]) & (time <= self.time[-1])
        return np.asarray(np.where(there, self._spline(time, 2), 0.0))

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
    grid = np.arange(time[0], time[-1] + 0.5 / rate, 1.0 / rate)
    even = np.interp(grid, time, place)
    return Motion(grid, _without_noise(even, rate))


def _without_noise(place: Array, rate: float) -> Array:
    """Places (n,) m at a rate (Hz) without what is above a cutoff.

    Generalized cross-validation chooses the cutoff: a body at rest is then at rest, and its noise
    pushes no chair.
    """
    line = np.linspace(place[0], place[-1], place.size)
    waves = dst(place - line, norm="ortho")
    frequency = 0.5 * rate * np.arange(1, place.size + 1) / place.size

    def error(cutoff: float) -> float:
        passed = 1.0 / (1.0 + (frequency / cutoff) ** (2 * ORDER))
        left = float((((1.0 - passed) * waves) ** 2).sum())
        return left / float(1.0 - passed.mean()) ** 2

    possible = CUTOFFS[NYQUIST * 0.5 * rate > CUTOFFS]
    count = min(round(rate), place.size - 1)
    if not possible.size or count < 2 * FEWEST:
        return place
    low_pass = butter(ORDER, min(possible, key=error), fs=rate, output="sos")
    # turned about where the motion ends, not about its last sample with its noise
    first, last = _end(place, rate), _end(place[::-1], rate)
    before = 2.0 * first - place[count:0:-1]
    after = 2.0 * last - place[-2 : -count - 2 : -1]
    padded = sosfiltfilt(low_pass, np.r_[before, place, after], padlen=0)
    return np.asarray(padded[count:-count])


def _end(place: Array, rate: float) -> float:
    """The first place of a motion, from a cubic through END."""
    near = place[: max(FEWEST, round(END * rate))]
    return float(np.polynomial.polynomial.polyfit(np.arange(near.size), near, 3)[0])
