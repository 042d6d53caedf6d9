"""A second estimate of the noise, from what a first pass over the windows leaves.

In: the windows' states as fitted with a first guess of the noise. Out: the noise of every channel.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis.replay.noise import Noise, telling
from mjchair.diagnosis.replay.sampling import residual
from mjchair.diagnosis.replay.simulator import WindowSimulator
from mjchair.diagnosis.replay.window_states import Track
from mjchair.measurement.sensors import sensor

Array = NDArray[np.float64]
FAST = 5.0  # Hz, above which no effect of a chair is looked for


def refined(
    simulator: WindowSimulator, track: Track, known: Mapping[str, Noise]
) -> dict[str, Noise]:
    """Noise from what a first pass leaves above the band of chair motion, in most windows.

    Where the chair without effects goes another way (it tips back under strokes under which a
    person leans forward), what it leaves is no noise.

    A channel that scatters otherwise than assumed gets the scatter that it has, and a correlated
    part where neighbouring samples go together.
    """
    pieces: dict[str, list[Array]] = {c: [] for c in simulator.channels}
    tells = {c: telling(simulator.study, c) for c in simulator.channels}
    for i, w in enumerate(simulator.windows):
        miss = residual(simulator.measured(w), track.predicted[i], simulator.channels)
        for k, channel in enumerate(simulator.channels):
            if w.run not in tells[channel]:
                continue
            r = miss[:, k][~np.isnan(miss[:, k])]
            if r.size >= 30:
                pieces[channel].append(_fast(r, w.last - w.first))
    return {c: _refined(known[c], pieces[c], c) for c in simulator.channels}


def _fast(values: Array, span: float) -> Array:
    n = values.size
    k = min(n // 3, max(3, round(2.0 * span * FAST)))
    phase = np.pi * (np.arange(n)[:, None] + 0.5) * np.arange(k)[None, :] / n
    waves, _ = np.linalg.qr(np.cos(phase))
    return np.asarray((values - waves @ (waves.T @ values)) / np.sqrt(1.0 - k / n))


def _rms(values: Array) -> float:
    """Rms of values, the hundredth that is farthest out moved to the others."""
    return float(np.sqrt(np.mean(np.clip(values, *np.percentile(values, [0.5, 99.5])) ** 2)))


def _refined(known: Noise, pieces: Sequence[Array], channel: str) -> Noise:
    if not pieces:
        return known
    size = float(np.percentile([_rms(p) for p in pieces], 50, method="lower")) * 1.03
    ratio = size / known.total
    if 0.87 < ratio < 1.15 or size < sensor(channel).floor:
        return known
    if known.source == "study.toml" and ratio < 1.0:
        return known  # rounding and correlation hide noise from this look: believe the study
    scale = max(ratio, sensor(channel).floor / known.total)
    return Noise(
        known.white * scale, known.slow * scale, known.time, "what a first pass leaves above 5 Hz"
    )
