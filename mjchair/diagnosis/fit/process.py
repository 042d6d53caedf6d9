"""Process noise: coloured forces and moments that no effect makes, and encoders that wobble.

In: the answers of every window's samples to pulses of force, and levels. Out: columns of the
disturbances of a window, white, each with a prior of one standard deviation, to be eliminated
beside the window's own state. A floor's joints and ripples, spokes, straps and breathing all push a
chair; without a level for them every sensor seems to contradict every model.

A force is the sum of a fast part (correlation time FAST: joints, spokes) and a slow one (SLOW: the
floor's long waves, a person's lean), each with a level for every run. Where a person moves on the
chair, a share of that person's force is in no model: it comes and goes with the force
(replay/person_force.py). Wheels and casters that are not quite round push once a turn.
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
from mjchair.diagnosis.replay.chair_state import Wheel
from mjchair.diagnosis.replay.person_force import person_force
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
    PERSON = "person"
    WHEEL_TURN = "once a turn of the rear wheels"
    CASTER_TURN = "once a turn of the casters"


@dataclass(frozen=True)
class Kind:
    """How a part is made: the force, its correlation time (s), and a first level (N, N m; 1).

    What comes once a turn keeps its phase throughout a window.
    """

    force: Force
    time: float
    first: float


KINDS = {
    Part.DRIVE_FAST: Kind(Force.FORWARD, FAST, 1.0),
    Part.DRIVE_SLOW: Kind(Force.FORWARD, SLOW, 0.5),
    Part.SIDE: Kind(Force.LEFTWARD, SLOW, 1.0),
    Part.YAW_FAST: Kind(Force.YAW, FAST, 0.2),
    Part.YAW_SLOW: Kind(Force.YAW, SLOW, 0.1),
    Part.PERSON: Kind(Force.FORWARD, FAST, 0.03),
    Part.WHEEL_TURN: Kind(Force.FORWARD, np.inf, 0.3),
    Part.CASTER_TURN: Kind(Force.FORWARD, np.inf, 0.3),
}
# which of the rolling angles: rear wheels, casters
TURNING = {Part.WHEEL_TURN: (0, 1), Part.CASTER_TURN: (2, 3)}
# rad, between pulses: what turns faster they do not follow; of casters of 75 mm that is above 1.7
# Hz, where the power of every sensor is seen (noise_levels.LEAST_HZ)
FASTEST = 2.2
SHAKEN = (Force.FORWARD, Force.LEFTWARD, Force.YAW)
# as in study.toml and diagnosis.json: parts that one number stands for, and its unit
NAMED = {
    "drive": ((Part.DRIVE_FAST, Part.DRIVE_SLOW), "N"),
    "side": ((Part.SIDE,), "N"),
    "yaw": ((Part.YAW_FAST, Part.YAW_SLOW), "N m"),
    "person": ((Part.PERSON,), "1"),
    "wheel_turn": ((Part.WHEEL_TURN,), "N"),
    "caster_turn": ((Part.CASTER_TURN,), "N"),
}
Levels = Mapping[Part, Array]  # (runs,) N or N m; of PERSON a share of the person's force


@dataclass
class Process:
    """The disturbances of all windows.

    Attributes:
      runs: (windows,) index of each window's run. pulses: with their answers (rows, channels).
      levels: standard deviation of every part in every run.
      person: (pulses,) N, size of a moving person's force at each pulse; 0 where none moves.
      rolled: (pulses, 4) rad, angles of left and right rear wheel and caster at each pulse.
      turns: of every window the angle (rad) of each wheel at its samples, (rows, 2).
      encoders: index of an encoder's channel -> the wheel that it is on, 0 or 1.
      wobbles: index of an encoder's channel -> amplitude of its error once a turn, SI.
    """

    runs: NDArray[np.int64]
    pulses: Sequence[Pulse]
    answers: Sequence[Array]
    levels: Levels
    person: Array
    rolled: Array
    turns: Sequence[Array] = ()
    encoders: Mapping[int, int] = field(default_factory=dict)
    wobbles: Mapping[int, float] = field(default_factory=dict)
    _white: WeakKeyDictionary[Whitener, dict[int, Array]] = field(default_factory=WeakKeyDictionary)
    _scaled: WeakKeyDictionary[Whitener, dict[int, Array]] = field(
        default_factory=WeakKeyDictionary, init=False
    )

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
        """Covariance (n, n) of a part of level 1 at the times of pulses."""
        time = np.array([self.pulses[k].time for k in which])
        alike = np.exp(-np.abs(time[:, None] - time[None, :]) / KINDS[part].time)
        if part == Part.PERSON:
            size = self.person[list(which)]
            alike = alike * np.outer(size, size)
        if part in TURNING:
            alike = np.mean([_in_phase(self.rolled[list(which), k]) for k in TURNING[part]], axis=0)
        return np.asarray(alike)

    def white_columns(self, window: int, whitener: Whitener) -> Array:
        """Columns (amplitudes, k) of the disturbances, each of one standard deviation."""
        known = self._scaled.setdefault(whitener, {})
        if window not in known:
            known[window] = self._of_one_deviation(window, whitener)
        return known[window]

    def _of_one_deviation(self, window: int, whitener: Whitener) -> Array:
        run = int(self.runs[window])
        levels = {part: float(level[run]) for part, level in self.levels.items()}
        out = [self.force_columns(window, whitener, force, levels) for force in SHAKEN]
        out += [
            size * self.wobble_columns(window, channel, whitener)
            for channel, size in self.wobbles.items()
            if size > 0.0
        ]
        return np.hstack(out)

    def force_columns(
        self, window: int, whitener: Whitener, force: Force, levels: Mapping[Part, float]
    ) -> Array:
        """Columns (amplitudes, k) of the parts of one force, each of one standard deviation.

        Args:
          levels: part -> its standard deviation in this window; parts that are not there are zero.
        """
        which = self.members(window, force)
        cover = sum(
            (
                levels[part] ** 2 * self.correlation(which, part)
                for part, kind in KINDS.items()
                if kind.force == force and part in levels
            ),
            np.zeros((len(which), len(which))),
        )
        small = 1e-9 * max(float(np.trace(cover)), 1e-12)
        root = np.linalg.cholesky(cover + small * np.eye(len(which)))
        return self.answers_of(window, which, whitener) @ root


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
        _person(simulator, pulses),
        _rolled(simulator, track, pulses),
        [_turns(simulator, track, i) for i in range(len(simulator.windows))],
        encoders,
        {i: FIRST_WOBBLE for i in encoders},
    )


def _person(simulator: WindowSimulator, pulses: Sequence[Pulse]) -> Array:
    """Size (pulses,) N of a moving person's force at the times of pulses."""
    study = simulator.study
    known = [person_force(study, run) for run in study.runs]
    runs = [simulator.windows[p.window].run for p in pulses]
    return np.array([np.interp(p.time, *known[r]) for p, r in zip(pulses, runs, strict=True)])


def _in_phase(angle: Array) -> Array:
    """Covariance (n, n) of a force once a turn, of unknown phase, at angles (n,) rad."""
    steps = np.abs(np.gradient(angle)) if angle.size > 1 else np.zeros(angle.size)
    followed = steps < FASTEST
    return np.cos(angle[:, None] - angle[None, :]) * np.outer(followed, followed)


def _rolled(simulator: WindowSimulator, track: Track, pulses: Sequence[Pulse]) -> Array:
    """Angles (pulses, 4) rad of rear wheels and casters at the times of pulses."""
    wheels = [*simulator.chair.rear, *simulator.chair.casters]
    out = np.zeros((len(pulses), len(wheels)))
    for k, pulse in enumerate(pulses):
        out[k] = _angles(simulator, track, pulse.window, wheels, np.array([pulse.time]))[0]
    return out


def _turns(simulator: WindowSimulator, track: Track, window: int) -> Array:
    """Angles (rows, 2) of the rear wheels at the samples of a window, rad."""
    w = simulator.windows[window]
    time = simulator.study.runs[w.run].trial.time[w.rows]
    return _angles(simulator, track, window, simulator.chair.rear, time)


def _angles(
    simulator: WindowSimulator, track: Track, window: int, wheels: Sequence[Wheel], time: Array
) -> Array:
    """Angles (n, wheels) rad by which wheels have rolled at times (n,) s of a window."""
    w, qpos = simulator.windows[window], track.trace[window]["qpos"]
    grid = w.start + simulator.step * (1 + np.arange(len(qpos)))
    # one quaternion stands before it: qpos is one longer than qvel
    sides = [qpos[:, wheel.dof + 1] for wheel in wheels]
    return np.column_stack([np.interp(time, grid, angle) for angle in sides])


def level(levels: Levels, name: str) -> float:
    """Standard deviation of what a name of NAMED stands for, the mean over runs."""
    return float(np.sqrt(np.mean(run_levels(levels, name) ** 2)))


def run_levels(levels: Levels, name: str) -> Array:
    """Standard deviation (runs,) of what a name of NAMED stands for."""
    return np.asarray(np.linalg.norm([levels[p] for p in NAMED[name][0]], axis=0))
