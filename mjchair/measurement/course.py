"""The offset of two clocks from how far two instruments of one chair have turned, all along a run.

In: two courses (the angle of a wheel, or the way of the chair in the same unit), each on its own
clock, and an alignment to begin with. Out: an alignment by weighted least squares.

At the right offset the two courses go on alike, but for a scale near 1 (radii, a bend) and a change
of that scale along the run (a bend that changes); both are fitted along, held by what two wheels of
a chair are known to differ. What is left is taken as readings that are wrong each for itself, and
a walk of the one course away from the other; how much of each is found by restricted maximum
likelihood. A coast that stops has its clock from the way it comes to rest, where neither scale nor
bend matters; one that never stops is as sure as the speeds are equal, which its standard deviation
says.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from scipy.linalg import cholesky_banded, solve_banded

from mjchair.measurement.clocks import Alignment, Signal

Array = NDArray[np.float64]

BLOCK = 0.2  # s, over which courses are averaged: longer than a speed of markers is smoothed
EDGE = 0.1  # s, left out at both ends, so that a better offset has the same samples
RESTS = 0.05  # rad/s, below which nothing turns and an encoder repeats one reading
LEAST = 12  # blocks, fewer of which tell nothing
STEPS = 8  # of the search, at most
DONE = 1e-6  # s, at which it is over
WALKS = np.r_[0.0, np.logspace(-4.0, 3.0, 29)]  # variance of a walk a second, over that of a block
FAR = 5.0  # standard deviations of both, beyond which a better offset is another one


class _Blocks(NamedTuple):
    """What is left at an offset, block by block.

    Attributes:
      left: (b,), rad. slopes: (b, 3), what it loses a second of offset, a unit of scale and of its
        change. time: (b,), s. weight: (b,), variance of a block over that of one that moves.
    """

    left: Array
    slopes: Array
    time: Array
    weight: Array


def by_course(
    reference: Signal, other: Signal, start: Alignment, unlike: float, changes: float
) -> Alignment | None:
    """The alignment at which two courses go on alike; see the module's docstring.

    Args:
      reference, other: (n,), rad or another unit, the same for both. start: within about 0.05 s.
      unlike: standard deviation of the scale about 1. changes: the same of how much the scale
        changes from the middle of a run to its end.

    Returns:
      None where the two have too little in common, or lie elsewhere than `start` says.
    """
    offset, spread = start.offset, np.nan
    inside = _inside(reference, other, offset)
    if inside.sum() < 2 or np.ptp(other.time[inside]) < LEAST * BLOCK:
        return None
    mine = Signal(other.time[inside], other.values[inside])
    for _ in range(STEPS):
        blocks = _blocks(reference, mine, offset)
        if blocks.left.size < LEAST:
            return None
        step, spread = _step(blocks, (unlike, changes))
        if not np.isfinite(step) or abs(offset + step - start.offset) > EDGE:
            return None
        offset += step
        if abs(step) < DONE:
            break
    if abs(offset - start.offset) > FAR * np.hypot(spread, start.offset_std):
        return None
    return replace(start, offset=float(offset), offset_std=float(spread), how="course of the run")


def _inside(reference: Signal, other: Signal, offset: float) -> NDArray[np.bool_]:
    """The samples of the other that lie within the reference, with room at both ends."""
    time = other.time + offset
    room = (time >= reference.time[0] + EDGE) & (time <= reference.time[-1] - EDGE)
    return np.asarray(room & np.isfinite(other.values))


def _blocks(reference: Signal, mine: Signal, offset: float) -> _Blocks:
    """Averages over blocks of BLOCK; what stands still is one block, with one reading's weight."""
    there = np.isfinite(reference.values)
    when, course = reference.time[there], reference.values[there]
    at = mine.time + offset
    turned = np.interp(at, when, course)
    speed = np.interp(at, when, np.gradient(course, when))
    place = np.linspace(-1.0, 1.0, at.size)
    changed = cumulative_trapezoid(place, turned, initial=0.0)
    columns = np.column_stack([mine.values - turned, speed, turned - turned[0], changed, at])
    number = np.floor((at - at[0]) / BLOCK).astype(int)
    count = np.bincount(number)
    sums = np.array([np.bincount(number, column) for column in columns.T])
    full = count > 0
    means = (sums[:, full] / count[full]).T
    still = np.abs(means[:, 1]) < RESTS
    moved = np.abs(np.diff(means[:, 0] + means[:, 2]))
    still[1:] &= moved < RESTS * BLOCK
    group = np.cumsum(np.r_[True, ~(still[1:] & still[:-1])]) - 1
    many = np.bincount(group)
    out = np.array([np.bincount(group, column) / many for column in means.T]).T
    resting = np.bincount(group, still) > 0
    weight = np.where(resting, float(np.median(count[full])), 1.0)
    return _Blocks(out[:, 0], out[:, 1:4], out[:, 4], weight)


def _step(blocks: _Blocks, held: tuple[float, float]) -> tuple[float, float]:
    """How much more the offset is, s, and its standard deviation."""
    left, slopes = np.diff(blocks.left), np.diff(blocks.slopes, axis=0)
    found = [_fit(left, slopes, blocks, walk) for walk in WALKS]
    best = max(found, key=lambda one: one[0])
    _, variance, white_left, white = best
    size = np.sqrt(max(variance, 1e-30))
    rows = np.vstack([white / size, np.diag([0.0, *(1.0 / np.array(held))])[1:]])
    goal = np.r_[white_left / size, 0.0, 0.0]
    scale = np.linalg.norm(rows, axis=0)
    if not np.all(scale > 0.0):
        return np.nan, np.nan
    inverse = np.linalg.pinv((rows / scale).T @ (rows / scale), hermitian=True)
    solved = inverse @ ((rows / scale).T @ goal) / scale
    return float(solved[0]), float(np.sqrt(inverse[0, 0]) / scale[0])


def _fit(
    left: Array, slopes: Array, blocks: _Blocks, walk: float
) -> tuple[float, float, Array, Array]:
    """Restricted log likelihood, variance of a block, and both sides made white.

    Readings that are wrong each for itself make steps of one block against the next that go with
    those of their neighbours; a walk adds to the variance of each.
    """
    weight = blocks.weight
    diagonal = weight[1:] + weight[:-1] + walk * np.diff(blocks.time)
    beside = np.r_[-weight[1:-1], 0.0]
    lower = cholesky_banded(np.vstack([diagonal, beside]), lower=True)
    white = solve_banded((1, 0), lower, np.column_stack([left, slopes]))
    goal, rows = white[:, 0], white[:, 1:]
    scale = np.linalg.norm(rows, axis=0) + 1e-30
    rotated, triangle = np.linalg.qr(rows / scale)
    rest = goal - rotated @ (rotated.T @ goal)
    free = left.size - slopes.shape[1]
    variance = float(rest @ rest) / free
    likelihood = -0.5 * free * np.log(max(variance, 1e-30)) - float(np.sum(np.log(lower[0])))
    likelihood -= float(np.sum(np.log(np.abs(np.diag(triangle)) + 1e-12) + np.log(scale)))
    return likelihood, variance, goal, rows
