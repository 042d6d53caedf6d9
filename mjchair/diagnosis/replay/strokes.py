"""The phase of the strokes of a run, and the motions that go with it.

In: the hand's torque of a run. Out: when strokes begin, the phase that grows by one turn from one
beginning to the next, and sines and cosines of it at any time (the columns that
mjchair.effects.stroke_motion follows).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from mjchair.diagnosis.data.study import Run
from mjchair.diagnosis.replay.measured_motion import Motion
from mjchair.effects import stroke_motion

Array = NDArray[np.float64]
RISES = 0.25  # of the largest torque of both wheels, through which a stroke begins
LARGE = 98.0  # percentile of the torque that counts as the largest
APART = 0.35  # s, at least, between two beginnings
FEWEST = 3  # strokes
PAUSE = 2.0  # times the usual period, beyond which a pause ends a bout of strokes
LEAST_PUSH = 2.0  # N m, of both wheels together: a slow push on the level reaches 10 (assumption)
ABOVE_NOISE = 6.0  # times the torque's white noise: with less, noise itself rises through the level
STEP = 0.005  # s, of the grid on which motions are kept


@dataclass(frozen=True)
class Bout:
    """Strokes without a pause between them: when each begins, and `period` (s), the usual one."""

    begins: Array
    period: float

    @property
    def knots(self) -> Array:
        """The beginnings, with one usual stroke before the first and two after the last."""
        first, last = self.begins[0], self.begins[-1]
        beyond = last + self.period * np.array([1.0, 2.0])
        return np.asarray(np.r_[first - self.period, self.begins, beyond])

    def phase(self, time: Array) -> Array:
        """Phase (rad) at times (s) within the knots, its speed without steps."""
        knots = self.knots
        turns = 2.0 * np.pi * np.arange(-1, knots.size - 1)
        return np.asarray(PchipInterpolator(knots, turns)(np.clip(time, knots[0], knots[-1])))

    def share(self, time: Array) -> Array:
        """1 from half a stroke before the first to the end of the last, 0 half a stroke beyond."""
        begin, end = self.begins[0] - 0.5 * self.period, self.begins[-1] + self.period
        away = np.maximum(np.maximum(begin - time, time - end), 0.0) / (0.5 * self.period)
        x = 1.0 - np.minimum(away, 1.0)
        return np.asarray(x**3 * (10.0 - 15.0 * x + 6.0 * x**2))  # speed and acceleration end at 0


def beginnings(run: Run) -> Array:
    """Times (s) at which the strokes of a run begin; none of a run with fewer than three.

    A torque that stays below LEAST_PUSH or within its own noise is no push.
    """
    inputs = run.trial.inputs
    if inputs is None:
        return np.zeros(0)
    wheels = [name for name in inputs.controls if name.endswith(("left_wheel", "right_wheel"))]
    total = np.sum([inputs.at(name, inputs.time) for name in wheels], axis=0)
    largest = float(np.percentile(total, LARGE)) if wheels else 0.0
    if largest < max(LEAST_PUSH, ABOVE_NOISE * _scatter(total)):
        return np.zeros(0)
    level = RISES * largest
    begins = inputs.time[1:][(total[1:] >= level) & (total[:-1] < level)]
    begins = begins[np.r_[True, np.diff(begins) > APART]] if begins.size else begins
    return begins if begins.size >= FEWEST else np.zeros(0)


def _scatter(values: Array) -> float:
    """White noise of samples, from third differences, which smooth motion does not reach."""
    if np.size(values) < 8:
        return 0.0
    return float(1.4826 * np.median(np.abs(np.diff(values, 3))) / np.sqrt(20.0))


def phase(run: Run) -> tuple[Array, Array]:
    """Phase (rad) of the strokes of a run that is pushed, at times (s); NaN where it is not.

    Straight lines between the beginnings. Fewer than three strokes have none.
    """
    begins = beginnings(run)
    if not begins.size:
        return np.array([-1e9, 1e9]), np.full(2, np.nan)
    turns = 2.0 * np.pi * np.arange(begins.size)
    before, beyond = begins[0] - 1e-6, begins[-1] + 1e-6
    return np.r_[before, begins, beyond], np.r_[np.nan, turns, np.nan]


def bouts(begins: Array) -> list[Bout]:
    """The strokes, parted at pauses."""
    if begins.size < FEWEST:
        return []
    period = float(np.median(np.diff(begins)))
    parts = np.split(begins, np.flatnonzero(np.diff(begins) > PAUSE * period) + 1)
    return [Bout(part, period) for part in parts]


def courses(run: Run) -> dict[str, Motion]:
    """Sines and cosines of the phase of a run's strokes, by the name of their column.

    They are zero where nobody pushes. A run without strokes has none.
    """
    return dict(_courses(beginnings(run).tobytes(), float(run.trial.time[0]), run.duration))


@lru_cache(maxsize=256)
def _courses(begins: bytes, first: float, duration: float) -> tuple[tuple[str, Motion], ...]:
    pushed = bouts(np.frombuffer(begins))
    if not pushed:
        return ()
    time = np.arange(first - 1.0, first + duration + 1.0, STEP)
    total = {name: np.zeros(time.size) for name in stroke_motion.COLUMNS}
    for bout in pushed:
        for name, values in stroke_motion.waves(bout.phase(time)).items():
            total[name] += bout.share(time) * values
    return tuple((name, Motion(time, values)) for name, values in total.items())
