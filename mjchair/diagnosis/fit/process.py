"""Process noise: coloured forces and moments that no effect makes, and encoders that wobble.

In: the answers of every window's samples to pulses of force, and levels. Out: columns of the
disturbances of a window, white, each with a prior of one standard deviation, to be eliminated
beside the window's own state. A floor's joints and ripples, spokes, straps and breathing all push a
chair; without a level for them every sensor seems to contradict every model.

A force is the sum of a fast part (correlation time FAST: joints, spokes) and a slow one (SLOW: the
floor's long waves, a person's lean), each with a level for every run.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis.fit.whitening import Whitener
from mjchair.diagnosis.replay.pulses import Force, Pulse
from mjchair.diagnosis.replay.simulator import WindowSimulator
from mjchair.diagnosis.replay.window_states import Track

Array = NDArray[np.float64]
FAST = 0.15  # s, correlation time: a joint of a floor is passed in about that
SLOW = 2.0  # s: a wave of the floor of 2 m, or a lean
FIRST_WOBBLE = 1e-3  # rad or rad/s


class Part(StrEnum):
    """A disturbance with a level of its own."""

    DRIVE_FAST = "drive, fast"
    DRIVE_SLOW = "drive, slow"
    SIDE = "side"
    YAW_FAST = "yaw, fast"
    YAW_SLOW = "yaw, slow"


@dataclass(frozen=True)
class Kind:
    """How a part is made: the force, its correlation time (s), and a first level (N or N m)."""

    force: Force
    time: float
    first: float


KINDS = {
    Part.DRIVE_FAST: Kind(Force.FORWARD, FAST, 1.0),
    Part.DRIVE_SLOW: Kind(Force.FORWARD, SLOW, 0.5),
    Part.SIDE: Kind(Force.LEFTWARD, SLOW, 1.0),
    Part.YAW_FAST: Kind(Force.YAW, FAST, 0.2),
    Part.YAW_SLOW: Kind(Force.YAW, SLOW, 0.1),
}
Levels = Mapping[Part, Array]  # (runs,) N or N m


@dataclass
class Process:
    """The disturbances of all windows.

    Attributes:
      runs: (windows,) index of each window's run. pulses: with their answers (rows, channels).
      levels: standard deviation of every part in every run.
      turns: of every window the angle (rad) of each wheel at its samples, (rows, 2).
      encoders: index of an encoder's channel -> the wheel that it is on, 0 or 1.
      wobbles: index of an encoder's channel -> amplitude of its error once a turn, SI.
    """

    runs: NDArray[np.int64]
    pulses: Sequence[Pulse]
    answers: Sequence[Array]
    levels: Levels
    turns: Sequence[Array] = ()
    encoders: Mapping[int, int] = field(default_factory=dict)
    wobbles: Mapping[int, float] = field(default_factory=dict)
    _white: WeakKeyDictionary[Whitener, dict[int, Array]] = field(default_factory=WeakKeyDictionary)

    @cached_property
    def _places(self) -> dict[int, list[int]]:
        places: dict[int, list[int]] = {}
        for k, pulse in enumerate(self.pulses):
            places.setdefault(pulse.window, []).append(k)
        return places

    def members(self, window: int, force: Force) -> list[int]:
        """Indices of a window's pulses of one force."""
        return [k for k in self._places[window] if self.pulses[k].force == force]

    def answers_of(self, window: int, which: Sequence[int], whitener: Whitener) -> Array:
        """White answers (amplitudes, n) of pulses of a window."""
        mine = self._places[window]
        known = self._white.setdefault(whitener, {})
        if window not in known:
            stacked = np.stack([self.answers[k] for k in mine], axis=2)
            known[window] = whitener(window, np.nan_to_num(stacked))
        place = {k: j for j, k in enumerate(mine)}
        return known[window][:, [place[k] for k in which]]

    def wobble_columns(self, window: int, channel: int, whitener: Whitener) -> Array:
        """White sine and cosine (amplitudes, 2) of an encoder's wheel, of amplitude 1."""
        angle = self.turns[window][:, self.encoders[channel]]
        values = np.zeros((angle.size, len(whitener.waves[window]), 2))
        values[:, channel] = np.column_stack([np.sin(angle), np.cos(angle)])
        return whitener(window, values)

    def correlation(self, which: Sequence[int], part: Part) -> Array:
        """Correlation (n, n) of a part at the times of pulses."""
        time = np.array([self.pulses[k].time for k in which])
        return np.asarray(np.exp(-np.abs(time[:, None] - time[None, :]) / KINDS[part].time))

    def white_columns(self, window: int, whitener: Whitener) -> Array:
        """Columns (amplitudes, k) of the disturbances, each of one standard deviation."""
        out = []
        run = int(self.runs[window])
        for force in (Force.FORWARD, Force.LEFTWARD, Force.YAW):
            which = self.members(window, force)
            cover = sum(
                (
                    float(self.levels[part][run]) ** 2 * self.correlation(which, part)
                    for part, kind in KINDS.items()
                    if kind.force == force
                ),
                np.zeros((len(which), len(which))),
            )
            small = 1e-9 * max(float(np.trace(cover)), 1e-12)
            root = np.linalg.cholesky(cover + small * np.eye(len(which)))
            out.append(self.answers_of(window, which, whitener) @ root)
        out += [
            size * self.wobble_columns(window, channel, whitener)
            for channel, size in self.wobbles.items()
            if size > 0.0
        ]
        return np.hstack(out)


def first(
    simulator: WindowSimulator, track: Track, pulses: Sequence[Pulse], answers: Sequence[Array]
) -> Process:
    """The disturbances at their first levels, from which they are estimated."""
    runs = len(simulator.study.runs)
    encoders = {
        i: wheel
        for i, channel in enumerate(simulator.channels)
        for wheel, side in enumerate(("left", "right"))
        if channel.endswith((f"{side}_wheel_angle", f"{side}_wheel_speed"))
    }
    return Process(
        np.array([w.run for w in simulator.windows]),
        pulses,
        answers,
        {part: np.full(runs, kind.first) for part, kind in KINDS.items()},
        [_turns(simulator, track, i) for i in range(len(simulator.windows))],
        encoders,
        {i: FIRST_WOBBLE for i in encoders},
    )


def _turns(simulator: WindowSimulator, track: Track, window: int) -> Array:
    """Angles (rows, 2) of the rear wheels at the samples of a window, rad."""
    w, qpos = simulator.windows[window], track.trace[window]["qpos"]
    grid = w.start + simulator.step * (1 + np.arange(len(qpos)))
    time = simulator.study.runs[w.run].trial.time[w.rows]
    # one quaternion stands before it: qpos is one longer than qvel
    sides = [qpos[:, wheel.dof + 1] for wheel in simulator.chair.rear]
    return np.column_stack([np.interp(time, grid, angle) for angle in sides])


def force_level(levels: Levels, force: Force) -> float:
    """Standard deviation of a force, the mean over runs of all its parts together, N or N m."""
    parts = [levels[p] for p, kind in KINDS.items() if kind.force == force]
    return float(np.sqrt(np.mean(np.sum(np.square(parts), axis=0))))
