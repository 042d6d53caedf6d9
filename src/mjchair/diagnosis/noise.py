"""How much each channel scatters: white noise, its correlated part, and rounding.

White noise comes from third differences, which smooth motion does not reach. What is correlated
(drift within a window, autoregressive noise) is seen where the chair stands still; without a
still stretch it is estimated from the study itself, and said so.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis.study import Study

Array = NDArray[np.float64]

# no instrument, and no simulation at 2 ms, is better than this (SI, by the end of the name)
FLOORS = {
    "angle": 1e-3,
    "speed": 3e-3,
    "gyro": 1e-3,
    "accelerometer": 1e-2,
    "position": 5e-4,
    "velocity": 5e-4,
    "heading": 3e-4,
    "tire": 0.3,
}
STILL = 0.5  # s, the shortest still stretch that is used


@dataclass(frozen=True)
class Noise:
    """Noise of one channel.

    Attributes:
      white: standard deviation, SI. slow: of the correlated part. time: its correlation time, s.
      source: how it was found.
    """

    white: float
    slow: float
    time: float
    source: str

    @property
    def total(self) -> float:
        """Standard deviation of white and correlated noise together."""
        return float(np.hypot(self.white, self.slow))

    def covariance(self, time: Array) -> Array:
        """Covariance (n, n) of samples at these times (s)."""
        apart = np.abs(time[:, None] - time[None, :])
        return np.asarray(
            self.white**2 * np.eye(time.size) + self.slow**2 * np.exp(-apart / self.time)
        )


def floor(channel: str) -> float:
    """The least noise that a channel is trusted to have."""
    sensor = channel.rsplit(".", 1)[0] if "." in channel else channel
    return next((v for end, v in FLOORS.items() if sensor.endswith(end)), 1e-3)


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
    pieces = [study.runs[i].trial.samples(channel) for i in telling(study, channel)]
    values = [np.unwrap(v) if channel.endswith("heading") else v for _, v in pieces]
    steps = [float(np.median(np.diff(t))) for t, _ in pieces if t.size > 1]
    step = float(np.median(steps or [0.01]))
    rounding = max((_lattice(v) for v in values), default=0.0)
    white = _white(values)
    least = max(floor(channel), rounding / np.sqrt(12.0))
    given = study.noise.get(channel, study.noise.get(channel.rsplit(".", 1)[0]))
    still = _still(study, channel)
    slow, time, source = rounding / np.sqrt(12.0), 0.3, "third differences"
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


def _white(values: Sequence[Array]) -> float:
    differences = [np.diff(v, 3) for v in values if v.size > 8]
    if not differences:
        return 0.0
    joined = np.concatenate(differences)
    robust = 1.4826 * float(np.median(np.abs(joined)))
    plain = float(np.sqrt(np.mean(np.clip(joined, -6 * robust, 6 * robust) ** 2)))
    return max(robust, plain) / np.sqrt(20.0)


def _lattice(values: Array) -> float:
    """Step of rounding, or 0 where the values do not lie on a lattice of few points."""
    levels = np.unique(values)
    if levels.size < 3 or levels.size > 0.5 * values.size:
        return 0.0
    return float(np.median(np.diff(levels)))


def _still(study: Study, channel: str) -> tuple[float, float] | None:
    """Scatter and lag-one correlation where the chair stands still; None: it never does."""
    found = []
    for run in (study.runs[i] for i in telling(study, channel)):
        for stretch in _still_rows(run.trial.time, run.trial.channels):
            v = run.trial.channels[channel][stretch]
            v = v[~np.isnan(v)]
            if v.size >= 25:
                ramp = np.arange(v.size)
                found.append(v - np.polyval(np.polyfit(ramp, v, 1), ramp))
    if not found:
        return None
    power = sum(float(v @ v) for v in found) / sum(v.size - 2 for v in found)
    if power == 0.0:
        return None
    rho = sum(float(v[1:] @ v[:-1]) for v in found) / sum(float(v @ v) for v in found)
    return float(np.sqrt(power)), rho


def _still_rows(time: Array, channels: Mapping[str, Array]) -> list[NDArray[np.int64]]:
    moving = np.zeros(time.size, bool)
    seen = False
    for name, limit in (
        ("left_wheel_speed", 0.05),
        ("right_wheel_speed", 0.05),
        ("velocity.x", 0.02),
    ):
        if name in channels:
            seen = True
            filled = np.interp(time, time[~np.isnan(channels[name])], _there(channels[name]))
            width = max(3, int(0.1 / max(float(np.median(np.diff(time))), 1e-4)))
            smooth = np.convolve(filled, np.ones(width) / width, mode="same")
            moving |= np.abs(smooth) > limit
    if not seen:
        return []
    edges = np.flatnonzero(np.diff(np.r_[1, moving.astype(int), 1]))
    out = []
    for a, b in zip(edges[::2], edges[1::2], strict=False):
        if time[b - 1] - time[a] > STILL + 0.3:
            rows = np.arange(a, b)
            out.append(rows[time[rows] > time[a] + 0.3])
    return out


def _there(values: Array) -> Array:
    return np.asarray(values[~np.isnan(values)])


def refined(shooter, track, known: dict[str, Noise]) -> dict[str, Noise]:  # type: ignore[no-untyped-def]
    """Noise from what a first pass leaves above the band of chair motion.

    A channel that scatters otherwise than assumed gets the scatter that it has, and a correlated
    part where neighbouring samples go together.
    """
    from mjchair.diagnosis.shooting import residual

    pieces: dict[str, list[Array]] = {c: [] for c in shooter.channels}
    tells = {c: telling(shooter.study, c) for c in shooter.channels}
    for i, w in enumerate(shooter.windows):
        miss = residual(shooter.measured(w), track.predicted[i], shooter.channels)
        for k, channel in enumerate(shooter.channels):
            if w.run not in tells[channel]:
                continue
            r = miss[:, k][~np.isnan(miss[:, k])]
            if r.size >= 30:
                pieces[channel].append(_fast(r, w.last - w.first))
    return {c: _refined(known[c], pieces[c], shooter, c) for c in shooter.channels}


FAST = 5.0  # Hz, above which no effect of a chair is looked for


def _fast(values: Array, span: float) -> Array:
    n = values.size
    k = min(n // 3, max(3, round(2.0 * span * FAST)))
    phase = np.pi * (np.arange(n)[:, None] + 0.5) * np.arange(k)[None, :] / n
    waves, _ = np.linalg.qr(np.cos(phase))
    return np.asarray((values - waves @ (waves.T @ values)) / np.sqrt(1.0 - k / n))


def _refined(known: Noise, pieces: list[Array], shooter, channel: str) -> Noise:  # type: ignore[no-untyped-def]
    if not pieces:
        return known
    joined = np.concatenate(pieces)
    size = float(np.sqrt(np.mean(np.clip(joined, *np.percentile(joined, [0.5, 99.5])) ** 2))) * 1.03
    ratio = size / known.total
    if 0.87 < ratio < 1.15 or size < floor(channel):
        return known
    if known.source == "study.toml" and ratio < 1.0:
        return known  # rounding and correlation hide noise from this look: believe the study
    scale = max(ratio, floor(channel) / known.total)
    return Noise(
        known.white * scale, known.slow * scale, known.time, "what a first pass leaves above 5 Hz"
    )
