"""Where a measured caster shimmies: it swings back and forth many times a second.

In: a run's trial. Out: the stretches in which it does, and how its casters turn at a time. What a
chair does there hangs on very little of its state, so that windows must be short, and how casters
swing is a part of the state.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mjchair.measurement.trial import Trial

Array = NDArray[np.float64]
SWING = 0.1  # rad, the least swing from side to side; a sensor scatters less
FASTEST = 0.35  # s, the longest swing: no person steers so fast (assumption)
SWINGS = 5  # that follow each other, at least
ROUND = 0.75  # swings back and forth, to either side of a time, that tell how a caster turns there
FEWEST = 9  # samples that do, at least: a swing that grows or fades has six numbers
RHYTHMS = np.linspace(0.75, 1.3, 23)  # frequencies that are tried, over that of the median swing

CASTERS = ("left_caster_angle", "right_caster_angle")


@dataclass(frozen=True)
class Stretch:
    """A stretch in which a caster shimmies: from when to when, and its median swing, all in s."""

    begin: float
    end: float
    swing: float


class Turned(NamedTuple):
    """How a caster turns: angle (rad), rate (rad/s) and acceleration (rad/s^2)."""

    angle: float
    rate: float
    acceleration: float


def stretches(trial: Trial) -> list[Stretch]:
    """Where a caster shimmies, in order; those of two casters that overlap are one."""
    out: list[Stretch] = []
    for channel in CASTERS:
        if channel in trial.channels:
            time, angle = trial.samples(channel)
            out += _fast(time[_turns(np.unwrap(angle))])
    return _joined(sorted(out, key=lambda s: s.begin))


def turned(trial: Trial, channel: str, when: float, swing: float) -> Turned:
    """How a measured caster turns at a time (s), by a swing that grows or fades.

    Args:
      swing: about how long one lasts from side to side, s.
    """
    time, angle = trial.samples(channel)
    near = np.argsort(np.abs(time - when))
    t, a = time[near] - when, np.unwrap(angle)[near]
    rate, fits = trial.rate(channel), []
    for omega in np.pi / swing * RHYTHMS:
        count = max(round(4.0 * np.pi * ROUND / omega * rate), FEWEST)
        fits.append(_harmonic(t[:count], a[:count], omega))
    return min(fits, key=lambda fit: fit[0])[1]


def _harmonic(t: Array, a: Array, omega: float) -> tuple[float, Turned]:
    """Mean square that a swing of omega (rad/s) leaves, and how a caster turns at time 0.

    Args:
      t: s. a: angles, rad, (n,) each.
    """
    cos, sin = np.cos(omega * t), np.sin(omega * t)
    basis = np.column_stack([np.ones_like(t), t, cos, sin, t * cos, t * sin])
    c = np.linalg.lstsq(basis, a)[0]
    left = float(np.mean((basis @ c - a) ** 2))
    there = c[0] + c[2], c[1] + omega * c[3] + c[4], omega * (2.0 * c[5] - omega * c[2])
    return left, Turned(*(float(value) for value in there))


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


def _fast(turns: Array) -> list[Stretch]:
    """Stretches of at least SWINGS swings, each no longer than FASTEST; turns: s."""
    parts = np.split(turns, np.flatnonzero(np.diff(turns) > FASTEST) + 1)
    return [
        Stretch(float(part[0]), float(part[-1]), float(np.median(np.diff(part))))
        for part in parts
        if part.size > SWINGS
    ]


def _joined(some: list[Stretch]) -> list[Stretch]:
    """Stretches in order, those that overlap made one, with the shorter swing."""
    out: list[Stretch] = []
    for s in some:
        if out and s.begin <= out[-1].end:
            last = out[-1]
            end, swing = max(last.end, s.end), min(last.swing, s.swing)
            out[-1] = replace(last, end=end, swing=swing)
        else:
            out.append(s)
    return out
