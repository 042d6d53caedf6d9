"""Whitening: samples of a window as cosines over their noise, so that chi2 is a sum of squares.

In: samples of all channels, and the noise of each. Out: amplitudes of orthonormal cosines, channel
by channel, that are independent with a standard deviation of 1. Cosines above HIGHEST are left out:
no effect of a chair is faster, and a fifth of the numbers is left.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis.replay.noise import EDGES, Noise
from mjchair.diagnosis.replay.simulator import WindowSimulator

Array = NDArray[np.float64]
HIGHEST = EDGES[-1]  # Hz


class Whitener:
    """Whitens the samples of windows.

    Attributes:
      frequency: of every row of every window, Hz. channel: index of its channel.
    """

    def __init__(self, simulator: WindowSimulator, noise: Mapping[str, Noise]) -> None:
        """Make the cosines of every channel in every window, divided by their noise."""
        self.there: list[NDArray[np.bool_]] = []
        self.waves: list[list[Array]] = []
        self.frequency: list[Array] = []
        self.channel: list[NDArray[np.int64]] = []
        known: dict[tuple[int, int], Array] = {}
        for w in simulator.windows:
            there = ~np.isnan(simulator.measured(w))
            span, counts = w.last - w.first, there.sum(axis=0)
            kept = [min(int(n), max(2, round(2.0 * span * HIGHEST))) for n in counts]
            at = [np.arange(k) / (2.0 * span) for k in kept]
            waves = []
            for name, n, k, frequency in zip(simulator.channels, counts, kept, at, strict=True):
                if (n, k) not in known:
                    known[n, k] = cosines(int(n), k)
                power = noise[name].where(w.shimmies).power(frequency, span / max(int(n), 1))
                waves.append(known[n, k] / np.sqrt(power))
            self.there.append(there)
            self.waves.append(waves)
            self.frequency.append(np.concatenate(at))
            self.channel.append(np.repeat(np.arange(len(kept)), kept))

    def __call__(self, window: int, values: Array) -> Array:
        """Whitened amplitudes, stacked channel by channel.

        Args:
          values: (rows, channels, k).

        Returns:
          (amplitudes, k).
        """
        there = self.there[window]
        return np.vstack([w.T @ values[there[:, i], i] for i, w in enumerate(self.waves[window])])

    def samples(self, window: int, channel: int, amplitudes: Array) -> Array:
        """Samples (rows,) of one channel that have these whitened amplitudes (n,).

        They are 0 where nothing was measured.
        """
        waves = self.waves[window][channel]
        out = np.zeros(len(self.there[window]))
        out[self.there[window][:, channel]] = waves @ (amplitudes / (waves * waves).sum(axis=0))
        return out

    def slow(self, window: int, highest: float) -> list[NDArray[np.int64]]:
        """Rows of each channel whose cosines are below a frequency (Hz), two at least."""
        out = []
        for i in range(len(self.waves[window])):
            rows = np.flatnonzero(self.channel[window] == i)
            low = self.frequency[window][rows] < highest - 1e-9
            low[:2] = True
            out.append(rows[low])
        return out


def cosines(n: int, k: int) -> Array:
    """The first k orthonormal cosines of n samples, (n, k)."""
    phase = np.pi * (np.arange(n)[:, None] + 0.5) * np.arange(k)[None, :] / max(n, 1)
    waves = np.cos(phase) * np.sqrt(2.0 / max(n, 1))
    if n and k:
        waves[:, 0] = 1.0 / np.sqrt(n)
    return np.asarray(waves)
