"""The noise that a study itself shows: levels of what shakes the chair, and powers of its sensors.

In: windows as white columns with first guesses of every level. Out: the levels at which the data
are most probable (restricted maximum likelihood: what is asked about is fitted along and priced).
Nothing here knows an effect: forces that depend smoothly on speed, yaw rate, heading and so on are
eliminated first, so a level is what nothing smooth explains.

A level is moved by the ratio of what the residual shows of it to what it should show (Zhou, Hu,
Qiao and Cho 2019, "MM algorithms for variance components models", of which this is the step).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from mjchair.diagnosis.data.study import Study
from mjchair.diagnosis.fit.column_ids import ColumnId
from mjchair.diagnosis.fit.elimination import state_columns
from mjchair.diagnosis.fit.process import KINDS, NAMED, SHAKEN, Part, Process
from mjchair.diagnosis.fit.whitening import Whitener
from mjchair.diagnosis.replay.derivatives import Column
from mjchair.diagnosis.replay.noise import EDGES, Noise
from mjchair.diagnosis.replay.pulses import Force
from mjchair.diagnosis.replay.sampling import residual
from mjchair.diagnosis.replay.simulator import WindowSimulator
from mjchair.diagnosis.replay.window_states import Track
from mjchair.measurement.sensors import sensor

Array = NDArray[np.float64]
STEPS = 15
LEAST_HZ = 1.5  # below it a chair's effects show, so a sensor's power there is that of just above
FAR = 4.0  # ratio of a run's level (as power) to the median run's: beyond is an event, no level
TELLS = 0.25  # of what the run tells that tells most: what tells less of a level is no usual run
FLAT = 4.0  # power of a sensor in its slowest band over that in the next, at most
ONE = 1.0  # number that tells a level, at least
UNTOLD = 0.03  # of the largest level: what is not told is no louder
OWN = 6.0  # numbers that tell a run's level as well as all other runs together do


@dataclass(frozen=True, kw_only=True)
class Levels:
    """What is estimated.

    Attributes:
      parts: part -> (runs,) standard deviations, N or N m (1 of PERSON).
      wobbles: channel -> amplitude, SI.
      bands: (channels, bands) power over that of the first guess; (2 channels, bands) where windows
        in which a caster shimmies have their own, which are the second half.
    """

    parts: Mapping[Part, Array]
    wobbles: Mapping[int, float]
    bands: Array


@dataclass(frozen=True)
class WindowColumns:
    """One window, white by the first guess of the noise.

    Attributes:
      run: index. r: (n,). J: (n, p). Z: (n, k), with standard deviations of their prior put in.
      pulses: force -> white answers (n, m), and correlations of every part (m, m).
      wobbles: channel -> (n, 2). band: (n,) index of each row's band. channel: (n,) place of its
        powers in `Levels.bands`.
      tells: (n,) whether a row tells its band's power.
      stands: whether the chair does, which tells nothing of what shakes one that rolls.
    """

    run: int
    r: Array
    J: Array
    Z: Array
    pulses: Mapping[Force, Array]
    correlations: Mapping[Part, Array]
    wobbles: Mapping[int, Array]
    band: NDArray[np.int64]
    channel: NDArray[np.int64]
    tells: NDArray[np.bool_]
    stands: bool = False


def windows_of(
    simulator: WindowSimulator,
    track: Track,
    whitener: Whitener,
    process: Process,
    columns: Mapping[ColumnId, Column],
    which: Sequence[int] | NDArray[np.int64],
    apart: bool = False,
) -> list[WindowColumns]:
    """The windows `which` with columns (ids -> (rows, channels) a window), each of unit prior.

    Args:
      apart: whether sensors have powers of their own in windows in which a caster shimmies.
    """
    out = []
    own = len(simulator.channels) if apart else 0
    for i in (int(w) for w in which):
        miss = residual(
            simulator.measured(simulator.windows[i]), track.predicted[i], simulator.channels
        )
        stacked = np.stack([c[i] for c in columns.values()], axis=2)
        free, precision = state_columns(simulator, track, i)
        both = np.concatenate([miss[:, :, None], stacked, free], axis=2)
        white = whitener(i, np.nan_to_num(both, copy=False, posinf=0.0, neginf=0.0))
        p = stacked.shape[2]
        members = {f: process.members(i, f) for f in SHAKEN}
        frequency = whitener.frequency[i]
        out.append(
            WindowColumns(
                run=int(process.runs[i]),
                r=white[:, 0],
                J=white[:, 1 : 1 + p],
                Z=white[:, 1 + p :] / np.sqrt(precision),
                pulses={f: process.answers_of(i, m, whitener) for f, m in members.items()},
                correlations={
                    part: process.correlation(members[kind.force], part)
                    for part, kind in KINDS.items()
                },
                wobbles={c: process.wobble_columns(i, c, whitener) for c in process.encoders},
                band=np.minimum(np.searchsorted(EDGES, frequency, side="right"), len(EDGES) - 1),
                channel=whitener.channel[i] + (own if simulator.windows[i].shimmies else 0),
                tells=frequency > LEAST_HZ,
                stands=simulator.windows[i].stands,
            )
        )
    return out


BANDS = "bands"


@dataclass
class Seen:
    """What the residual shows of every level (`shown`), and what it should show (`due`).

    Keys are parts, channels with a wobble, and BANDS.
    """

    shown: dict[object, Array] = field(default_factory=dict)
    due: dict[object, Array] = field(default_factory=dict)

    def add(self, key: object, at: int, size: int, shown: float, due: float) -> None:
        """Add one window's part at a place of an array of this size."""
        for table, value in ((self.shown, shown), (self.due, due)):
            table.setdefault(key, np.zeros(size))[at] += value

    def add_rows(self, w: WindowColumns, shown: Array, due: Array, size: int) -> None:
        """Add the rows (n,) of one window to the bands of their channels."""
        at = (w.channel * len(EDGES) + w.band)[w.tells]
        for table, values in ((self.shown, shown), (self.due, due)):
            known = table.setdefault(BANDS, np.zeros(size))
            known += np.bincount(at, values[w.tells], minlength=size)


def estimate(
    windows: Sequence[WindowColumns],
    first: Levels,
    least: Array,
    fixed: frozenset[Part] = frozenset(),
    steps: int = STEPS,
    most: Mapping[Part, Array] | None = None,
) -> Levels:
    """The most probable levels.

    Args:
      windows: that may be fitted to. first: where to begin.
      least: (channels, bands), the least power of a sensor, over that of the first guess.
      fixed: parts whose level is known.
      most: part -> its largest levels (runs,), N or N m (1 of PERSON); None: any. What shakes a
        chair harder is something missing. A part that even then no number tells is nearly nothing.
    """
    levels, most = first, most or {}
    for _ in range(steps):
        seen = _looked_at(windows, levels)
        untold = {part for part, level in most.items() if not _is_told(level, seen.due[part])}
        upper = {part: level * (UNTOLD if part in untold else 1.0) for part, level in most.items()}
        levels = _within(_moved(levels, seen, least, fixed | untold), upper, fixed)
    return levels


def _is_told(most: Array, due: Array) -> bool:
    """Whether a level is told by at least one number in all runs, where it is as large as it can.

    Of a force once a turn of the casters a short run may tell nothing. Such a level wandered from
    nearly nothing to 1.9 N, for 0.5 of deviance, and the chair seemed to be shaken.

    Args:
      most: (runs,) the largest levels. due: (runs,) what the residual should show of a level.
    """
    return float((most[: due.size] ** 2 * due).sum()) >= ONE


def _within(levels: Levels, most: Mapping[Part, Array], fixed: frozenset[Part]) -> Levels:
    """The levels, none larger than what noise can be."""
    parts = {
        part: level if part in fixed else np.minimum(level, most.get(part, np.inf))
        for part, level in levels.parts.items()
    }
    bands = levels.bands.copy()
    bands[:, 0] = np.minimum(bands[:, 0], FLAT * bands[:, 1])
    return replace(levels, parts=parts, bands=bands)


def deviance(windows: Sequence[WindowColumns], levels: Levels) -> float:
    """-2 times the logarithm of the probability of the data, but for a constant.

    All that is asked about is integrated over its prior, so that explanations with other columns
    and with the levels that each of them leaves are compared: whether it is noise or effects.
    """
    count = windows[0].J.shape[1]
    A, a, total = np.eye(count), np.zeros(count), 0.0
    for w in windows:
        _, columns, factor, J, r, H = _white(w, levels)
        A += J.T @ H
        a += H.T @ r
        shown = columns.T @ r
        power = np.log(levels.bands[w.channel, w.band]).sum()
        total += float(r @ r - shown @ cho_solve(factor, shown) + power)
        total += 2.0 * float(np.log(np.diag(factor[0])).sum())
    return total + float(np.linalg.slogdet(A)[1] - a @ np.linalg.solve(A, a))


def _looked_at(windows: Sequence[WindowColumns], levels: Levels) -> Seen:
    """One look at the residual with all levels as they are."""
    count = windows[0].J.shape[1]
    A, a = np.eye(count), np.zeros(count)
    kept = []
    for w in windows:
        white = _white(w, levels)
        *_, J, r, H = white
        A += J.T @ H
        a += H.T @ r
        kept.append((w, *white))
    inverse = np.linalg.inv(A)
    best = inverse @ a
    seen = Seen()
    runs = 1 + max(w.run for w in windows)
    for w, size, columns, factor, J, r, H in kept:
        left = r - J @ best
        left = left - columns @ cho_solve(factor, columns.T @ left)
        lean = H @ inverse
        half = cho_solve(factor, columns.T)
        diagonal = 1.0 - np.einsum("ij,ji->i", columns, half) - np.einsum("ij,ij->i", lean, H)
        seen.add_rows(w, left**2, diagonal, levels.bands.size)
        shaken = 0.0 if w.stands else 1.0
        for force, answers in w.pulses.items():
            P = answers * size[:, None]
            q, M = P.T @ left, _precision(P, columns, half, H, lean)
            for part, kind in KINDS.items():
                if kind.force == force:
                    K = w.correlations[part]
                    told = shaken * (q @ K @ q), shaken * float((K * M).sum())
                    seen.add(part, w.run, runs, *told)
        for channel, pair in w.wobbles.items():
            P = pair * size[:, None]
            q, M = P.T @ left, _precision(P, columns, half, H, lean)
            seen.add(channel, 0, 1, float(q @ q), float(np.trace(M)))
    return seen


def _white(w: WindowColumns, levels: Levels) -> tuple[Array, Array, Any, Array, Array, Array]:
    """A window over the sensors' noise: what it was multiplied by, columns of what it is free in.

    Then the factor that takes these away, the columns asked about, the residual, and the columns
    asked about once these are taken away.
    """
    size = 1.0 / np.sqrt(levels.bands[w.channel, w.band])
    columns = _noise_columns(w, levels) * size[:, None]
    factor = cho_factor(np.eye(columns.shape[1]) + columns.T @ columns)
    J, r = w.J * size[:, None], w.r * size
    return size, columns, factor, J, r, J - columns @ cho_solve(factor, columns.T @ J)


def _precision(P: Array, columns: Array, half: Array, H: Array, lean: Array) -> Array:
    """P' Q P of columns P: Q is what the data tell once all that is asked about is fitted."""
    PH = P.T @ H
    return np.asarray(P.T @ P - (P.T @ columns) @ (half @ P) - (P.T @ lean) @ PH.T)


def _noise_columns(w: WindowColumns, levels: Levels) -> Array:
    """Columns (n, k) of one standard deviation of all that a window is free in."""
    out = [w.Z]
    for force, answers in w.pulses.items():
        parts = [p for p, kind in KINDS.items() if kind.force == force]
        cover = sum(
            (float(levels.parts[p][w.run]) ** 2 * w.correlations[p] for p in parts),
            np.zeros((answers.shape[1],) * 2),
        )
        small = 1e-9 * max(float(np.trace(cover)), 1e-12)
        out.append(answers @ np.linalg.cholesky(cover + small * np.eye(len(cover))))
    out += [size * w.wobbles[c] for c, size in levels.wobbles.items() if size > 0.0]
    return np.hstack(out)


def _moved(levels: Levels, seen: Seen, least: Array, fixed: frozenset[Part]) -> Levels:
    """The levels one step on."""
    parts = {
        part: level if part in fixed else _of_runs(level, seen.shown[part], seen.due[part])
        for part, level in levels.parts.items()
    }
    wobbles = {
        c: size * _ratio(seen.shown[c], seen.due[c])[0] ** 0.5 for c, size in levels.wobbles.items()
    }
    shape = levels.bands.shape
    ratio = _ratio(seen.shown[BANDS], seen.due[BANDS]).reshape(shape)
    told = seen.due[BANDS].reshape(shape) > 1.0
    bands = np.where(told, levels.bands * ratio, levels.bands)
    return Levels(parts=parts, wobbles=wobbles, bands=np.maximum(bands, least))


def _of_runs(level: Array, shown: Array, due: Array) -> Array:
    """A part's level in every run (runs,): its own as far as the run tells it, else the common."""
    there = np.flatnonzero(due > 1e-12)
    if not there.size:
        return level
    power = level[there] ** 2
    ratio = _ratio(shown[there], due[there])
    told = power * due[there]  # about as many numbers tell it
    ceiling = FAR * _usual((ratio * power)[told >= TELLS * told.max()])
    own = np.minimum(ratio * power, max(ceiling, 1e-12))
    common = float((own * told).sum() / max(told.sum(), 1e-12)) if told.sum() > 0.0 else own.mean()
    share = told / (told + OWN)
    out = np.full(level.size, np.sqrt(max(common, 1e-12)))
    out[there] = np.sqrt(np.maximum(own, 1e-12)) ** share * np.sqrt(max(common, 1e-12)) ** (
        1.0 - share
    )
    return out


def _usual(powers: Array) -> float:
    """The median of the runs' powers (n,); of an even number the lower one of the middle two.

    Of two runs one may hold an event, and their mean is as loud as that.
    """
    return float(np.sort(powers)[(powers.size - 1) // 2])


def _ratio(shown: Array, due: Array) -> Array:
    return np.clip(shown / np.maximum(due, 1e-12), 1e-3, 1e3)


def with_levels(
    noise: Mapping[str, Noise], channels: Sequence[str], steps: Array, levels: Levels
) -> dict[str, Noise]:
    """The noise of every channel with the powers that were estimated.

    Args:
      steps: (channels,), s between samples.
    """
    ratios = levels.bands.reshape(-1, len(channels), len(EDGES))
    out = {}
    for k, (channel, step) in enumerate(zip(channels, steps, strict=True)):
        known = noise[channel]
        out[channel] = _with_bands(known, float(step), ratios[0, k])
        if len(ratios) > 1:
            shimmying = replace(known.where(True), shimmying=None)
            own = _with_bands(shimmying, float(step), ratios[1, k])
            out[channel] = replace(out[channel], shimmying=own)
    return out


def _with_bands(known: Noise, step: float, ratio: Array) -> Noise:
    """A noise whose power in each band is multiplied by a ratio (bands,)."""
    edges = np.r_[0.0, EDGES]
    power = known.power(0.5 * (edges[:-1] + edges[1:]), step) * ratio
    # the share of each band in the variance of the samples
    width = np.diff(edges) * 2.0 * step
    more = float((np.maximum(power - known.white**2, 0.0) * np.minimum(width, 1.0)).sum())
    return replace(known, slow=max(float(np.sqrt(more)), 0.0), bands=tuple(map(float, power)))


def least_powers(noise: Mapping[str, Noise], channels: Sequence[str], given: bool = False) -> Array:
    """The least power of each sensor, over that of the first guess, (channels, bands).

    What study.toml gives is not made smaller; no sensor is better than its kind can be.

    Args:
      given: whether, of a sensor that study.toml gives, an earlier look that saw more than what is
        given may have been wrong.
    """
    middle = 0.5 * (np.r_[0.0, EDGES[:-1]] + np.array(EDGES))
    out = []
    for c in channels:
        known = noise[c]
        if known.source != "study.toml":
            out.append(np.full(middle.size, min(1.0, (sensor(c).floor / known.total) ** 2)))
        elif known.bands and given:
            out.append(known.white**2 / known.power(middle, 1.0))
        else:
            out.append(np.ones(middle.size))
    return np.array(out)


def known_parts(study: Study) -> dict[Part, float]:
    """Levels of parts that study.toml gives, N, N m or 1: half of a force's power is slow."""
    return {
        part: given / len(parts) ** 0.5
        for name, (parts, _) in NAMED.items()
        for part in parts
        if (given := study.process.get(name)) is not None
    }
