"""What an instrumented push rim shows with no hand on it: its offset and, once a turn, its weight.

In: a `PushRim` with a recording of the same rim untouched, or with free rolling parts of its own.
Out: the recording with both taken off its forces. The terms are those of Chénier et al. (2017, Med
Eng Phys 40, 75-86): a constant, and a cosine and sine of the encoder's angle, for every channel.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_erosion, binary_opening

from mjchair.errors import MjchairError
from mjchair.measurement.smartwheel import RATE, PushRim
from mjchair.simulation.table import frozen

Array = NDArray[np.float64]

STILL = 0.02  # m/s of column 5, below which the wheel stands
TURN = 2.0 * np.pi
PLACES = 12  # parts of a turn, most of which free rolling must have passed to show the weight
PASSED = 9
NOISE = np.array([1.0, 1.0, 1.0, 0.15, 0.15, 0.15])  # N and N m, least spread of a free rim
START = 0.4  # share of the samples, nearest to the median of Mz, that a search starts from
ROUNDS = 30
HOLDS = 3  # samples, less than which no hand holds a rim: one reading of noise is no hand
SURE = 0.04  # s, by which contact is taken to last longer at both ends than it shows
HANDS_OFF = 0.5  # s of free rolling, the least that an offset is read from


class Baseline(NamedTuple):
    """What the channels show with no hand on the rim.

    Attributes:
      offset: (6,), N and N m. cosine, sine: (6,), once-per-revolution terms, N and N m.
      how: where they come from, in words. left: (6,), rms of what they leave, N and N m.
    """

    offset: Array
    cosine: Array
    sine: Array
    how: str
    left: Array

    def at(self, absolute: Array) -> Array:
        """The baseline at encoder angles (n,) rad, (n, 6)."""
        wave = np.outer(np.cos(absolute), self.cosine) + np.outer(np.sin(absolute), self.sine)
        return np.asarray(self.offset + wave)


def fit_baseline(run: PushRim) -> Baseline:
    """Offset and once-per-revolution term of a recording with no hand on the rim.

    Least squares over every sample; a recording of less than a turn gives the offset alone.
    """
    return _fit(run, np.ones(run.time.size, bool), f"baseline {Path(run.source).name}")


def _fit(run: PushRim, free: NDArray[np.bool_], how: str) -> Baseline:
    angle, forces = run.absolute[free], run.forces[free]
    terms = np.ones((angle.size, 1))
    if _passed(angle) >= PASSED:
        terms = np.column_stack([terms, np.cos(angle), np.sin(angle)])
    found = np.zeros((3, 6))
    found[: terms.shape[1]] = np.linalg.lstsq(terms, forces, rcond=None)[0]
    left = np.sqrt(np.mean((forces - terms @ found[: terms.shape[1]]) ** 2, axis=0))
    return Baseline(found[0], found[1], found[2], how, left)


def _passed(angle: Array) -> int:
    """How many parts of a turn the wheel has passed."""
    return int(np.unique(np.floor((angle % TURN) / TURN * PLACES)).size)


def still_baseline(run: PushRim) -> Baseline:
    """Offset from where the wheel stands at the start; no once-per-revolution term.

    The hand is there before the wheel rolls: samples in which it shows are left out.

    Raises:
      MjchairError: the wheel does not stand for a tenth of a second at the start.
    """
    count = _stands(run)
    if count < 0.1 * RATE:
        raise MjchairError(
            f"{run.source}: the wheel moves after {count / RATE:g} s; give a baseline recording"
        )
    stands = np.arange(run.time.size) < count
    free = stands & hands_off(run)
    if free.sum() < 0.1 * RATE:
        free = stands
    return _fit(run, free, f"the first {free.sum() / RATE:.2g} s, in which the wheel stands")


def _stands(run: PushRim) -> int:
    """Samples at the start in which the wheel stands."""
    moving = np.flatnonzero(np.abs(run.ground_speed) >= STILL)
    return int(moving[0]) if moving.size else run.time.size


def hands_off(run: PushRim) -> NDArray[np.bool_]:
    """Which samples (n,) have no hand on the rim.

    A search from the samples whose moment is nearest to its median: offset and weight are fitted
    to them, what stays within three standard deviations of that in every channel is taken next,
    until nothing changes. A hand is on the rim for less than half of the time.
    """
    far = np.abs(run.torque - np.median(run.torque))
    free = far <= np.quantile(far, START)
    for _ in range(ROUNDS):
        base = _fit(run, free, "")
        off = np.abs(run.forces - base.at(run.absolute))
        limit = 3.0 * np.maximum(1.4826 * np.median(off[free], axis=0), NOISE)
        touched = binary_opening((off >= limit).any(axis=1), np.ones(HOLDS))
        new = np.asarray(~touched)
        new = binary_erosion(new, np.ones(2 * round(SURE * RATE) + 1), border_value=1)
        if new.sum() < HANDS_OFF * RATE or (new == free).all():
            break
        free = new
    return np.asarray(free)


def free_baseline(run: PushRim) -> Baseline:
    """Offset and weight from the parts of a recording in which the wheel rolls with no hand on it.

    Raises:
      MjchairError: there is less than half a second of them.
    """
    free = hands_off(run)
    if free.sum() < HANDS_OFF * RATE:
        raise MjchairError(
            f"{run.source}: {free.sum() / RATE:.2g} s without a hand on the rim; give a baseline "
            f"recording, or one with {HANDS_OFF:g} s of free rolling"
        )
    return _free(run, free)


def _free(run: PushRim, free: NDArray[np.bool_]) -> Baseline:
    return _fit(run, free, f"{free.sum() / RATE:.1f} s without a hand on the rim")


def without_baseline(run: PushRim, baseline: PushRim | None = None) -> PushRim:
    """The recording with the baseline taken off its forces.

    The encoder's zero stays where it is between two recordings made in a row, so a baseline is
    taken at the same wheel angle.

    Args:
      run: the recording, in the signs of its file. baseline: one with no hand on the rim; None:
        the parts of `run` without a hand give offset and weight where they pass most of a turn;
        otherwise the wheel at rest at its start gives the offset, or what parts there are.

    Raises:
      MjchairError: as free_baseline does.
    """
    return take_off(run, choose(run, baseline))


def choose(run: PushRim, baseline: PushRim | None = None) -> Baseline:
    """The baseline of a recording; see `without_baseline`."""
    if baseline is not None:
        return fit_baseline(baseline)
    free = hands_off(run)
    if free.sum() >= HANDS_OFF * RATE and _passed(run.absolute[free]) >= PASSED:
        return _free(run, free)
    return still_baseline(run) if _stands(run) >= 0.1 * RATE else free_baseline(run)


def take_off(run: PushRim, base: Baseline) -> PushRim:
    """The recording with a baseline taken off its forces."""
    return replace(run, forces=frozen(run.forces - base.at(run.absolute)))
