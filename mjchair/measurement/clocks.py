"""The clocks of two instruments, put together by the motion that both have seen.

In: two signals that go with one motion (a wheel's speed by two instruments, or its acceleration
and an accelerometer), each on its own clock. Out: offset and drift of the second clock with their
standard deviations, or the reason why they cannot be told.

The offset is the lag of the largest correlation of the smoothed signals, refined by a parabola. At
every lag a constant and a slope of what lies together are taken out of both: a high-pass filter
rings at the ends of a recording of 10 s, at another place in each of the two. The offset's standard
deviation is the Cramer-Rao bound of a delay in coloured noise. Strokes that come evenly make other
lags nearly as good, a stroke aside: an alignment is clear only if chance would not put another lag
that near. Drift is the slope of offsets of parts of the recording.

A coast that never stops is a straight line and has no such lag. Two instruments that read one speed
are put where they read the same (`align_slowing`); that is as sure as their speeds are equal.

A coast that stops has a lag, but a poor one: without constant and slope only the bend at its end is
left, a hump so wide that its correlation is flat over 10 ms. Where two instruments tell one course,
`mjchair.measurement.course` begins here and goes on to a tenth of a millisecond.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, correlate, detrend, sosfiltfilt

from mjchair.errors import MjchairError

Array = NDArray[np.float64]

GRID = 100.0  # Hz, on which signals are compared
FASTEST = 8.0  # Hz, of the motion of a wheelchair that is compared
TREND = 2  # columns that are taken out of both signals: a constant and a slope
OVERLAP = 3.0  # s, the least part of two recordings that must lie together
SHARE = 0.3  # of the shorter recording, the same
LEAST = 0.6  # correlation below which two signals are not of one motion
RIVAL = 0.15  # s, beyond which a lag is another one
EVIDENCE = 5.0  # log likelihood ratio to the best other lag, below which a lag is not clear
INDEPENDENT = 1.0  # independent samples a second of what two instruments see differently
PART = 8.0  # s, of the parts whose offsets show drift
NEAR = 0.25  # s, within which a part's offset is looked for
AGREES = 0.1  # s, within which the offsets of parts agree
FIVE = 5  # parts, fewer of which do not tell a drift
MOST = 0.5  # share of the parts that must agree
SLOWS = -0.95  # correlation of speed and time, above which a run does not only slow
UNLIKE = 0.01  # of the speed, by which two wheels of a chair that rolls straight differ; assumption
COURSE = 0.02  # of the mean speed, rms, beyond which two speeds are not of one motion
UNSURE = 0.2  # s, standard deviation beyond which equal speed does not tell a lag


class Signal(NamedTuple):
    """A signal on its own clock: time (n,) s and values (n,) or (n, k), in any unit."""

    time: Array
    values: Array


@dataclass(frozen=True)
class Alignment:
    """How another clock goes with the reference: t_reference = t + offset + drift * t.

    Attributes:
      offset: s. offset_std: s. drift: s a second, 0 where it does not show. drift_std: NaN where
        the recording is too short to tell it. correlation: at that lag. rival: the best lag apart
        from it, s, NaN without one. rival_correlation: there. clear: whether the lag is told.
      how: in words.
    """

    offset: float
    offset_std: float
    drift: float = 0.0
    drift_std: float = np.nan
    correlation: float = np.nan
    rival: float = np.nan
    rival_correlation: float = np.nan
    clear: bool = True
    how: str = "given"

    def to_reference(self, time: Array) -> Array:
        """Times (n,) s of the other clock on the reference."""
        return np.asarray(time + self.offset + self.drift * time)

    def text(self) -> str:
        """Offset and drift with their uncertainties."""
        drift = ""
        if np.isfinite(self.drift_std):
            drift = f", drift {1e6 * self.drift:.0f} +- {1e6 * self.drift_std:.0f} ppm"
        match = f", correlation {self.correlation:.2f}" if np.isfinite(self.correlation) else ""
        return f"offset {self.short()}{drift} ({self.how}{match})"

    def short(self) -> str:
        """The offset with its uncertainty alone."""
        return f"{self.offset:+.5f} s +- {1e3 * self.offset_std:.2g} ms"


def align(reference: Signal, other: Signal, names: tuple[str, str] = ("one", "two")) -> Alignment:
    """The alignment of two clocks by shared motion; see the module's docstring.

    Raises:
      MjchairError: recordings too short, no common motion, or a lag that is not clear; the line has
        the best lags.
    """
    found = best_alignment(reference, other)
    if not found.clear:
        why = f"correlation {found.correlation:.2f} at {found.offset:+.2f} s"
        if np.isfinite(found.rival):
            why += f", {found.rival_correlation:.2f} at {found.rival:+.2f} s"
        raise MjchairError(
            f"the clocks of {names[0]} and {names[1]} cannot be aligned: {why}; give the offset "
            f"of {names[1]} with --offset FILE=SECONDS, or leave the file out"
        )
    return found


def best_alignment(reference: Signal, other: Signal) -> Alignment:
    """The best lag there is, clear or not.

    Raises:
      MjchairError: a recording of less than 3 s.
    """
    one, two = _even(reference), _even(other)
    if min(len(one.values), len(two.values)) < OVERLAP * GRID:
        raise MjchairError(f"clocks need {OVERLAP:g} s of common motion to be aligned")
    lags, match = _correlation(one.values, two.values)
    best = int(np.argmax(match))
    start = float(one.time[0] - two.time[0])
    lag = _refined(lags, match, best) / GRID
    apart = np.abs(lags - lags[best]) > RIVAL * GRID
    peaks = np.r_[False, (match[1:-1] >= match[:-2]) & (match[1:-1] >= match[2:]), False] & apart
    rival = int(np.flatnonzero(peaks)[np.argmax(match[peaks])]) if peaks.any() else -1
    together = float(_together(len(one.values), len(two.values), int(lags[best]))) / GRID
    rho = float(min(match[best], 1.0 - 1e-9))
    other_rho = float(match[rival]) if rival >= 0 else 0.0
    evidence = 0.5 * INDEPENDENT * together * np.log((1.0 - other_rho**2) / (1.0 - rho**2))
    offset, drift, drift_std, agree = _drift(one, two, start + lag)
    return Alignment(
        offset=offset,
        offset_std=_spread(detrend(one.values[:, 0]), rho, together),
        drift=drift,
        drift_std=drift_std,
        correlation=rho,
        rival=start + float(lags[rival]) / GRID if rival >= 0 else np.nan,
        rival_correlation=other_rho if rival >= 0 else np.nan,
        clear=rho >= LEAST and agree >= MOST and (rival < 0 or evidence >= EVIDENCE),
        how="shared motion",
    )


def align_slowing(reference: Signal, other: Signal) -> Alignment | None:
    """The alignment at which two instruments read one speed, in a run that only slows.

    Args:
      reference, other: (n,), in one unit.

    Returns:
      None for a run that does more than slow, two speeds that are not alike at any lag, or one
      that changes too little to tell a lag within 0.2 s.
    """
    one, two = _smooth(reference), _smooth(other)
    first, second = one.values[:, 0], two.values[:, 0]
    if min(len(first), len(second)) < OVERLAP * GRID:
        return None
    if any(np.corrcoef(v, np.arange(len(v)))[0, 1] > SLOWS for v in (first, second)):
        return None
    lags = np.arange(len(first) + len(second) - 1) - (len(second) - 1)
    least = max(OVERLAP * GRID, 0.5 * min(len(first), len(second)))
    lags = lags[_together(len(first), len(second), lags) >= least]
    off = np.array([np.sqrt(np.mean(np.square(_apart(first, second, int(k))))) for k in lags])
    best = int(np.argmin(off))
    if best in (0, lags.size - 1):
        return None
    left = _apart(first, second, int(lags[best]))
    slope = float(first[-1] - first[0]) * GRID / (len(first) - 1)
    speed = float(np.mean(first))
    spread = UNLIKE * speed / abs(slope)
    if off[best] > COURSE * speed or spread > UNSURE:
        return None
    lag = float(lags[best]) / GRID - float(np.mean(left)) / slope
    start = float(one.time[0] - two.time[0])
    return Alignment(start + lag, spread, how="equal speed as it slows")


def _apart(first: Array, second: Array, lag: int) -> Array:
    """What lies together of two recordings at a lag, one less the other."""
    begin, end = max(0, lag), min(len(first), lag + len(second))
    return np.asarray(first[begin:end] - second[begin - lag : end - lag])


def _even(signal: Signal) -> Signal:
    """The signal on the common grid, smoothed, without its mean, (m, k)."""
    smooth = _smooth(signal)
    return Signal(smooth.time, smooth.values - smooth.values.mean(axis=0))


def _smooth(signal: Signal) -> Signal:
    """The signal on the common grid, smoothed, (m, k)."""
    time = np.arange(signal.time[0], signal.time[-1], 1.0 / GRID)
    values = np.atleast_2d(signal.values.T).T
    even = np.column_stack([np.interp(time, *_there(signal.time, v)) for v in values.T])
    if len(even) > 4 * GRID / 10:
        sos = butter(2, FASTEST, "lowpass", fs=GRID, output="sos")
        even = sosfiltfilt(sos, even, axis=0)
    return Signal(time, even)


def _there(time: Array, values: Array) -> tuple[Array, Array]:
    good = np.isfinite(values)
    return time[good], values[good]


def _correlation(one: Array, two: Array) -> tuple[NDArray[np.int64], Array]:
    """Lags (samples) and the correlation of the first column of `one` with all columns of `two`.

    It is that of what lies together, beside a constant and a slope. With several columns it is the
    multiple correlation: the best sum of them at each lag.
    """
    first = one[:, 0]
    lags = np.arange(len(first) + len(two) - 1) - (len(two) - 1)
    count = _together(len(first), len(two), lags)
    enough = np.flatnonzero(count >= max(OVERLAP * GRID, SHARE * min(len(first), len(two))))
    products, cross, power = (sums[enough] for sums in _sums(first, two))
    weights = _weights(products, cross)
    trend = _weights(products[:, :TREND, :TREND], cross[:, :TREND])
    by_trend = np.sum(trend * cross[:, :TREND], axis=1)
    by_all = np.sum(weights * cross, axis=1)
    match = np.zeros(lags.size)
    share = (by_all - by_trend) / np.maximum(power - by_trend, 1e-30)
    match[enough] = np.sqrt(np.clip(share, 0.0, 1.0))
    if two.shape[1] == 1:
        match[enough] *= np.sign(weights[:, TREND])
    return lags, match


def _sums(first: Array, two: Array) -> tuple[Array, Array, Array]:
    """Sums over what lies together, at each lag.

    Of products of the columns 1, time and `two`, (lags, k, k); of these with `first`, (lags, k);
    and of its square, (lags,).
    """
    here, there = np.ones(len(first)), np.ones(len(two))
    slope = np.linspace(-1.0, 1.0, len(first))
    # each column as what moves with the first signal's samples, and what with the second's
    columns = [(here, there), (slope, there), *((here, c) for c in two.T)]

    def summed(mine: Array, other: Array) -> Array:
        return np.asarray(correlate(mine, other, "full", "fft"))

    products = np.array([[summed(a * c, b * d) for c, d in columns] for a, b in columns])
    cross = np.array([summed(first * a, b) for a, b in columns])
    small = 1e-9 * np.eye(len(columns)) * products.diagonal().mean(axis=0)[None]
    return products.transpose(2, 0, 1) + small, cross.T, summed(first**2, there)


def _weights(products: Array, cross: Array) -> Array:
    """The best sum of columns at each lag, (lags, k)."""
    return np.asarray(np.linalg.solve(products, cross[..., None])[..., 0])


def _together(first: int, second: int, lag: NDArray[np.int64] | int) -> NDArray[np.int64] | int:
    """Samples of two recordings that lie together at a lag."""
    return np.asarray(np.minimum(first, np.asarray(lag) + second) - np.maximum(0, lag))


def _refined(lags: NDArray[np.int64], match: Array, best: int) -> float:
    if not 0 < best < len(match) - 1:
        return float(lags[best])
    left, middle, right = match[best - 1 : best + 2]
    bend = left - 2.0 * middle + right
    return float(lags[best] + (0.5 * (left - right) / bend if bend < 0.0 else 0.0))


def _spread(first: Array, rho: float, together: float) -> float:
    """Standard deviation of the lag, s: the Cramer-Rao bound, at least a tenth of a grid step.

    Args:
      first: (n,) values without their constant and slope.
    """
    bandwidth = np.std(np.diff(first)) * GRID / max(float(np.std(first)), 1e-30)  # rad/s
    noise = (1.0 - rho**2) / max(rho**2, 1e-6)
    bound = np.sqrt(noise / (max(INDEPENDENT * together, 1.0) * bandwidth**2))
    return float(max(bound, 0.1 / GRID))


def _drift(one: Signal, two: Signal, offset: float) -> tuple[float, float, float, float]:
    """Offset, drift and its standard deviation, and the share of the parts that agree.

    Drift is 0 where it does not show, and its standard deviation NaN where too few parts tell it.
    """
    begin = max(one.time[0], two.time[0] + offset)
    end = min(one.time[-1], two.time[-1] + offset)
    count = int((end - begin) / PART)
    if count < 3:
        return offset, 0.0, np.nan, 1.0
    middles, lags, spreads = [], [], []
    for k in range(count):
        window = begin + (k + np.array([0.0, 1.0])) * (end - begin) / count
        lag, spread = _local_lag(one, two, offset, window)
        if np.isfinite(lag):
            middles.append(float(window.mean()) - offset)
            lags.append(lag)
            spreads.append(spread)
    time, off = np.array(middles), np.array(lags)
    if len(lags) < FIVE:
        near = np.abs(off - np.median(off)) < AGREES if lags else np.zeros(0)
        return offset, 0.0, np.nan, float(np.sum(near)) / count
    terms = np.column_stack([np.ones_like(time), time])
    fitted = np.linalg.lstsq(terms, off, rcond=None)[0]
    left = off - terms @ fitted
    scatter = max(float(np.sqrt(left @ left / (len(off) - 2))), float(np.median(spreads)))
    spread = scatter * float(np.sqrt(np.linalg.inv(terms.T @ terms)[1, 1]))
    agree = float(np.sum(np.abs(left - np.median(left)) < AGREES)) / count
    if abs(fitted[1]) < 3.0 * spread:
        return offset, 0.0, spread, agree
    return offset + float(fitted[0]), float(fitted[1]), spread, agree


def _local_lag(one: Signal, two: Signal, offset: float, window: Array) -> tuple[float, float]:
    """How much more than `offset` a part is off, s, and its spread; NaN where it does not tell."""
    inside = (one.time >= window[0]) & (one.time <= window[1])
    first = detrend(one.values[inside, 0])
    shifts = np.arange(-round(NEAR * GRID), round(NEAR * GRID) + 1)
    match = np.zeros(shifts.size)
    for i, shift in enumerate(shifts):
        time = one.time[inside] - offset - shift / GRID
        if time[0] < two.time[0] or time[-1] > two.time[-1]:
            continue
        columns = np.column_stack([np.interp(time, two.time, c) for c in two.values.T])
        columns = detrend(columns, axis=0)
        fit = columns @ np.linalg.lstsq(columns, first, rcond=None)[0]
        match[i] = float(first @ fit) / max(
            float(np.linalg.norm(first) * np.linalg.norm(fit)), 1e-30
        )
    best = int(np.argmax(match))
    if match[best] < LEAST or best in (0, shifts.size - 1):
        return np.nan, np.nan
    spread = _spread(first, min(float(match[best]), 1.0 - 1e-9), PART)
    return _refined(shifts, match, best) / GRID, spread
