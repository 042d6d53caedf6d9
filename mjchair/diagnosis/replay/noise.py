"""How much each channel scatters: white noise, its correlated part, and rounding.

In: a study. Out: the noise of every channel, with a word on where it comes from. White noise comes
from third differences, which smooth motion does not reach; that of a caster that shimmies does, so
samples from there are left out. What is correlated (drift within a window, autoregressive noise) is
seen where the chair stands still; without a still stretch it is estimated from the study itself,
and said so.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis.data import shimmy
from mjchair.diagnosis.data.standstill import still_stretches
from mjchair.diagnosis.data.study import Study
from mjchair.measurement.sensors import sensor
from mjchair.measurement.trial import Trial

Array = NDArray[np.float64]

STILL = 0.5  # s, the shortest still stretch that is used
FEW = 50  # samples: fewer, where no caster shimmies, do not tell a channel's noise
SETTLES = 0.3  # s, at its start, that are not
EDGES = (3.0, 6.0, 10.0)  # Hz, upper edges of the bands in which a study shows its noise


@dataclass(frozen=True)
class Noise:
    """Noise of one channel.

    Attributes:
      white: standard deviation, SI. slow: of the correlated part. time: its correlation time, s.
      source: where the numbers come from.
      bands: power that the study itself shows below each of EDGES (SI squared, as of samples with
        that variance); empty: that of white and correlated noise.
      shimmying: what stands for it in windows in which a caster shimmies; None: it itself.
    """

    white: float
    slow: float
    time: float
    source: str
    bands: tuple[float, ...] = ()
    shimmying: Noise | None = None

    def where(self, shimmies: bool) -> Noise:
        """The noise of a window in which a caster shimmies, or in which none does."""
        return self.shimmying if shimmies and self.shimmying is not None else self

    @property
    def total(self) -> float:
        """Standard deviation of white and correlated noise together."""
        return float(np.hypot(self.white, self.slow))

    def power(self, frequency: Array, step: float) -> Array:
        """Variance of orthonormal cosines of samples `step` (s) apart, at frequencies (Hz), (n,).

        Of an autoregressive process of first order beside white noise, or the measured bands.
        """
        if self.bands:
            which = np.searchsorted(EDGES, frequency, side="right")
            return np.asarray(np.array(self.bands)[np.minimum(which, len(self.bands) - 1)])
        keep = np.exp(-step / self.time)
        turn = np.cos(2.0 * np.pi * np.asarray(frequency) * step)
        slow = self.slow**2 * (1.0 - keep**2) / (1.0 + keep**2 - 2.0 * keep * turn)
        return np.asarray(self.white**2 + slow)


def estimate(study: Study) -> dict[str, Noise]:
    """Noise of every channel, from the runs that are fitted to.

    Runs that are held out tell nothing, but for a channel that no other run has.
    """
    return {c: _channel(study, c) for c in study.channels}


def telling(study: Study, channel: str) -> tuple[int, ...]:
    """Indices of the runs that tell the noise of a channel."""
    have = tuple(i for i, run in enumerate(study.runs) if channel in run.trial.channels)
    return tuple(i for i in have if i in study.fitted) or have


def _channel(study: Study, channel: str) -> Noise:
    pieces = _calm([study.runs[i].trial for i in telling(study, channel)], channel)
    values = [np.unwrap(v) if sensor(channel).wraps else v for _, v in pieces]
    steps = [float(np.median(np.diff(t))) for t, _ in pieces if t.size > 1]
    step = float(np.median(steps or [0.01]))
    rounding = max((_lattice(v) for v in values), default=0.0)
    white = _white(values)
    least = max(sensor(channel).floor, rounding / np.sqrt(12.0))
    given = study.noise_given(channel)
    # at rest an encoder stays on one tick, which tells nothing of a wheel that turns
    still = None if sensor(channel).free_zero else _still(study, channel)
    slow, time, source = rounding / np.sqrt(12.0), _held(values, step), "third differences"
    if still is not None:
        drift, rho = still
        if rho > 0.2:  # autoregressive: most of the scatter is correlated
            total = max(drift, white)
            slow = max(slow, total * np.sqrt(min(rho, 0.98)))
            time = max(-step / np.log(min(max(rho, 0.05), 0.98)), 0.5 * step)
            white = min(white, total * np.sqrt(1.0 - min(rho, 0.98)))
            source = "a still stretch (autoregressive)"
        else:
            white, source = max(white, drift), "third differences and a still stretch"
    if given is not None:
        white, source = max(given, 0.7 * white), "study.toml"
        if given < 0.7 * white:
            source = "the data, which scatter more than study.toml says"
    return Noise(max(white, least), slow, max(time, 1e-3), source)


def _calm(trials: Sequence[Trial], channel: str) -> list[tuple[Array, Array]]:
    """Times and samples of a channel, apart where a caster shimmies; all where little is left."""
    whole = [trial.samples(channel) for trial in trials]
    parts: list[tuple[Array, Array]] = []
    for trial, (time, values) in zip(trials, whole, strict=True):
        edges = [edge for s in shimmy.stretches(trial) for edge in (s.begin, s.end)]
        at = np.searchsorted(time, edges)
        calm = slice(None, None, 2)  # a stretch with a shimmy follows each one without
        parts += zip(np.split(time, at)[calm], np.split(values, at)[calm], strict=True)
    return parts if sum(v.size for _, v in parts) > FEW else whole


def _white(values: Sequence[Array]) -> float:
    differences = [np.diff(v, 3) for v in values if v.size > 8]
    if not differences:
        return 0.0
    joined = np.concatenate(differences)
    robust = 1.4826 * float(np.median(np.abs(joined)))
    plain = float(np.sqrt(np.mean(np.clip(joined, -6 * robust, 6 * robust) ** 2)))
    return float(max(robust, plain) / np.sqrt(20.0))


def _lattice(values: Array) -> float:
    """Step of rounding, or 0 where the values do not lie on a lattice of few points."""
    levels = np.unique(values)
    if levels.size < 3 or levels.size > 0.5 * values.size:
        return 0.0
    return float(np.median(np.diff(levels)))


def _held(values: Sequence[Array], step: float) -> float:
    """Mean time (s) for which samples `step` (s) apart keep one value.

    The error of rounding stays the same for as long. In a wheel's angle that is less than a sample
    while it rolls, in the heading of a chair that goes straight it is seconds.
    """
    changes = sum(np.count_nonzero(np.diff(v)) for v in values)
    return step * sum(v.size for v in values) / max(changes, 1)


def _still(study: Study, channel: str) -> tuple[float, float] | None:
    """Scatter and lag-one correlation where the chair stands still; None: it never does."""
    stretches = []
    for run in (study.runs[i] for i in telling(study, channel)):
        for stretch in _still_rows(run.trial):
            v = run.trial.channels[channel][stretch]
            v = v[~np.isnan(v)]
            if v.size >= 25:
                ramp = np.arange(v.size)
                stretches.append(v - np.polyval(np.polyfit(ramp, v, 1), ramp))
    if not stretches:
        return None
    power = sum(float(v @ v) for v in stretches) / sum(v.size - 2 for v in stretches)
    if power == 0.0:
        return None
    rho = sum(float(v[1:] @ v[:-1]) for v in stretches) / sum(float(v @ v) for v in stretches)
    return float(np.sqrt(power)), rho


def _still_rows(trial: Trial) -> list[NDArray[np.int64]]:
    """Samples of every stretch in which the chair stands, once it has settled."""
    time, out = trial.time, []
    for first, after in still_stretches(trial, STILL + SETTLES):
        rows = np.arange(first, after)
        out.append(rows[time[rows] > time[first] + SETTLES])
    return out
