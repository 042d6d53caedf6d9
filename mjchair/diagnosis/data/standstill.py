"""Where a measured chair stands, comes to rest, or is pushed to and fro before it rolls on.

In: a run. Out: stretches of its samples in which the chair stands, and the times, around each stop
and before a start that is not clean, that no fit uses. Whatever tells the speed is used: wheel
speeds, wheel angles, a velocity, or places over time. A tire that stops pushes the chair back a
little and the chair rocks; how much and how long is an assumption in every model and differs from
chair to chair.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from mjchair.measurement.stretches import stretches
from mjchair.measurement.trial import Trial

Array = NDArray[np.float64]

WHEEL = 0.05  # rad/s, average below which a wheel stands
CHAIR = 0.02  # m/s, the same of a chair
SPAN = 0.1  # s, over which they are averaged
SPAN_OF_PLACES = 0.3  # s: a place is known to a millimetre or so, an angle far better
STANDS = 0.8  # s, the shortest stand: a chair that turns back stands for less
STANDS_AT_END = 0.2  # s, the same as a run ends: whether the chair turns back is not seen
ROCKING = 3.0  # times those averages: a chair that rocks to rest is slower
ROLLS = 1.0  # s, at least, before a stop or after a start: less holds no window
PUSHES = 5.0  # N m on a wheel: hands that rest on the rims give less (assumption)
WHILE = 0.75  # quantile of the torque while the chair moves: the stroke that rolls it on is shorter
BEFORE = 0.1  # s before the chair stands, as long as the average
ROCKS = 2.0  # s after that: the chairs that ship rock for about as long, by assumed tire damping


def still_stretches(trial: Trial, shortest: float = STANDS) -> list[tuple[int, int]]:
    """First sample, and the one after the last, of every stretch in which the chair stands.

    Args:
      shortest: such stretch, s. A run of which no channel tells its speed has none.
    """
    return _longer(trial.time, stretches(_slower(_speeds(trial))), shortest)


def rests(trial: Trial) -> list[tuple[float, float]]:
    """From when to when (s) a run is left out: where the chair comes to rest, or dithers at first.

    A run that begins at rest does not come to rest there, but a person who moves on a chair at rest
    may push it to and fro until it rolls on.
    """
    time, speeds = trial.time, _speeds(trial)
    slow, rocking = _slower(speeds), stretches(_slower(speeds, ROCKING))
    still = stretches(slow)
    stands = _longer(time, still, STANDS)
    if still and still[-1][1] == time.size:
        stands += [s for s in _longer(time, still[-1:], STANDS_AT_END) if s not in stands]
    out: dict[int, int] = {}
    for first, after in stands:
        # it first stood where it began to rock
        begins = max(a for a, b in rocking if a <= first < b)
        out[begins + int(np.argmax(slow[begins:]))] = after
    stops = [
        (float(time[a]) - BEFORE, min(float(time[a]) + ROCKS, float(time[b - 1])))
        for a, b in out.items()
        if time[a] - time[0] > ROLLS
    ]
    onward = _rolls_on(time, still)
    if onward > time[0] and _is_pushed(trial, ~slow & (time < onward)):
        onward = float(time[0])  # strokes on the spot, between which the chair stands
    later = [(a, b) for a, b in stops if a > onward]
    return later if onward == time[0] else [(float(time[0]), onward), *later]


def rolls_at(trial: Trial, times: Array) -> NDArray[np.bool_]:
    """Whether a channel shows at each of the times (n,), s, that the chair rolls."""
    speeds = _speeds(trial)
    at = np.clip(np.searchsorted(trial.time, times), 0, trial.time.size - 1)
    return np.asarray(~_slower(speeds)[at] if speeds else np.zeros(at.size, bool))


def _rolls_on(time: Array, still: Sequence[tuple[int, int]]) -> float:
    """When (s) a chair that dithers at first rolls on for good; the first time where none does.

    A chair that stands at first, and leaves its place once, does not dither.

    Args:
      still: stretches in which it is slow, however short.
    """
    if still and still[0][0] == 0:
        follows = [*(time[a] for a, _ in still[1:]), time[-1]]
        for k, ((_, after), then) in enumerate(zip(still, follows, strict=True)):
            if after < time.size and then - time[after] > ROLLS:
                return float(time[after] if k > 0 else time[0])
    return float(time[0])


def _is_pushed(trial: Trial, moves: NDArray[np.bool_]) -> bool:
    """Whether a wheel is driven for much of the time in which the chair moves.

    A chair may stop once more as the first stroke begins: the SmartWheel's did, for 0.07 s.
    """
    if trial.inputs is None or not moves.any():
        return False
    time, at = trial.inputs.time, trial.time[moves]
    torques = [np.interp(at, time, np.nan_to_num(t)) for t in trial.inputs.controls.values()]
    return any(float(np.quantile(np.abs(t), WHILE)) > PUSHES for t in torques)


def _longer(
    time: Array, stretches: Sequence[tuple[int, int]], shortest: float
) -> list[tuple[int, int]]:
    """The stretches that last longer than `shortest`, s."""
    return [(a, b) for a, b in stretches if time[b - 1] - time[a] > shortest]


def _slower(speeds: Sequence[tuple[Array, float]], factor: float = 1.0) -> NDArray[np.bool_]:
    """Which samples are slower than `factor` times what stands; none if no channel tells."""
    every = [speed <= factor * least for speed, least in speeds]
    return np.asarray(np.logical_and.reduce(every)) if every else np.zeros(0, bool)


def _speeds(trial: Trial) -> list[tuple[Array, float]]:
    """Averaged sizes of speeds (n,), each with that below which it stands, rad/s or m/s."""
    known, out = set(trial.channels), []
    for side in ("left", "right"):
        if f"{side}_wheel_speed" in known:
            out.append((np.abs(_averaged(trial, f"{side}_wheel_speed")), WHEEL))
        elif f"{side}_wheel_angle" in known:
            out.append((np.abs(_slope(trial, f"{side}_wheel_angle", SPAN)), WHEEL))
    if "velocity.x" in known:
        out.append((np.abs(_averaged(trial, "velocity.x")), CHAIR))
    elif not out and {"position.x", "position.y"} <= known:
        forward, left = (_slope(trial, f"position.{axis}", SPAN_OF_PLACES) for axis in "xy")
        out.append((np.hypot(forward, left), CHAIR))
    return out


def _filled(trial: Trial, channel: str) -> Array:
    """The samples of a channel at all times of its run, (n,)."""
    return np.interp(trial.time, *trial.samples(channel))


def _slope(trial: Trial, channel: str, span: float) -> Array:
    """Mean slope of a channel over `span` (s) around each sample, (n,)."""
    time, values = trial.time, _filled(trial, channel)
    begin, end = (np.clip(time + by, time[0], time[-1]) for by in (-0.5 * span, 0.5 * span))
    risen = np.interp(end, time, values) - np.interp(begin, time, values)
    return np.asarray(risen / np.maximum(end - begin, 1e-9))


def _averaged(trial: Trial, channel: str) -> Array:
    """A channel averaged over SPAN around each sample, (n,)."""
    width = max(3, int(SPAN / max(float(np.median(np.diff(trial.time))), 1e-4)))
    return np.asarray(uniform_filter1d(_filled(trial, channel), width, mode="nearest"))
