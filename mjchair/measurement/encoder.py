"""Encoder readings of a wheel: counted through its wraps, without the jumps that some make.

In: angles (rad) at a constant rate, wrapped or not. Out: one angle that goes on, and the samples
that are no measurement. Some encoders jump at their index mark, once a turn: the reading there is
wrong, and where the counts of a jump stay, every later reading is off by them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

Array = NDArray[np.float64]

TURN = 2.0 * np.pi
RESOLUTION = TURN / 4096  # rad, the coarsest step of the encoders in use
NEIGHBOURS = 9  # samples, whose median increment a sample is compared with
LEAST = 8.0  # steps of the encoder, less than which no increment is a jump
SIGMAS = 8.0  # standard deviations of the increments, less than which none is either
ONCE = 0.04  # turns, within which jumps lie at one place of the wheel
ENOUGH = 0.6  # share of the jumps that must lie a whole number of turns apart
FEW = 0.02  # share of the samples that may be jumps at all


class Jumps(NamedTuple):
    """Jumps of an encoder.

    Attributes:
      samples: indices of the first sample after each jump. size: median, rad. place: angle of the
        wheel at which they lie, rad from 0 to 2 pi; NaN where they lie anywhere.
      stay: whether the readings after a jump are off by it.
    """

    samples: NDArray[np.int64]
    size: float
    place: float
    stay: bool

    @property
    def once_a_turn(self) -> bool:
        """Whether they lie at one place of the wheel."""
        return bool(np.isfinite(self.place))


NONE = Jumps(np.zeros(0, np.int64), 0.0, np.nan, False)


def unwrapped(angle: Array) -> Array:
    """Angles (n,) rad that go on where the counter wraps.

    A wheel that turns by less than half a turn between two samples is followed; at 50 Hz that is
    25 turns a second.
    """
    return np.asarray(np.unwrap(angle))


def find_jumps(angle: Array) -> Jumps:
    """Where an unwrapped angle (n,) rad jumps by more than the wheel can turn."""
    if angle.size < 2 * NEIGHBOURS:
        return NONE
    steps = np.diff(angle)
    beside = steps - median_filter(steps, NEIGHBOURS, mode="nearest")
    spread = 1.4826 * float(np.median(np.abs(beside)))
    limit = max(LEAST * RESOLUTION, SIGMAS * spread)
    wild = np.flatnonzero(np.abs(beside) > limit)
    if not wild.size or wild.size > FEW * angle.size + 2:
        return NONE
    first = wild[np.r_[True, np.diff(wild) > NEIGHBOURS]]
    last = np.r_[wild[np.flatnonzero(np.diff(wild) > NEIGHBOURS)], wild[-1]]
    courses = [np.cumsum(beside[a : b + 1]) for a, b in zip(first, last, strict=True)]
    size = float(np.median([course[-1] for course in courses]))
    place, stay = _once_a_turn(angle, first, size)
    stay = abs(size) > limit and (stay or not np.isfinite(place))
    if not stay:  # the reading comes back: as far as it went
        size = float(np.median([course[np.argmax(np.abs(course))] for course in courses]))
    return Jumps(wild + 1, size, place, stay)


def _once_a_turn(angle: Array, first: NDArray[np.int64], size: float) -> tuple[float, bool]:
    """The place of the wheel at which jumps lie, NaN without one, and whether they stay.

    Between two jumps the wheel makes whole turns. The angle that was read gives whole turns as it
    is where jumps do not stay, and whole turns and the jump where they do.
    """
    if first.size < 3:
        return np.nan, False
    moved = np.diff(angle[first])
    scores = {}
    for stay in (False, True):
        turn = TURN + (size if stay else 0.0) * np.sign(moved.sum())
        turns = moved / turn
        off = np.abs(turns - np.round(turns))
        near = (off < ONCE) & (np.abs(np.round(turns)) >= 1)
        scores[stay] = (float(near.mean()), -float(np.median(off)))
    stay = scores[True] > scores[False]
    if scores[stay][0] < ENOUGH:
        return np.nan, False
    return float(np.angle(np.exp(1j * angle[first]).mean()) % TURN), bool(stay)


def without_jumps(angle: Array, jumps: Jumps) -> tuple[Array, NDArray[np.bool_]]:
    """The angle (n,) rad without jumps, and which samples are still measurements, (n,).

    The steps at a jump are replaced by those around it; where jumps do not stay the angle comes
    back to what was read.
    """
    there = np.ones(angle.size, bool)
    if not jumps.samples.size:
        return angle, there
    wild = np.unique(np.r_[jumps.samples, jumps.samples - 1])
    there[wild[(wild > 0) & (wild < angle.size - 1)]] = False
    if not jumps.stay:
        index = np.arange(angle.size)
        return np.interp(index, index[there], angle[there]), there
    steps = np.diff(angle)
    usual = median_filter(steps, NEIGHBOURS, mode="nearest")
    steps[jumps.samples - 1] = usual[jumps.samples - 1]
    return angle[0] + np.r_[0.0, np.cumsum(steps)], there
