"""The force that would close the gap, and what it goes with.

Pulses of force in every window answer two questions by linear algebra alone: what force over time
would close the gap (a spline with a smoothness prior), and whether a force that depends on speed,
on yaw rate, on place, on a wheel's angle would. The second asks for no named effect, so it also
sees what the library does not have.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from mjchair.diagnosis.chair import Chair
from mjchair.diagnosis.fitting import Bench
from mjchair.diagnosis.linear import RIDGE, slow_columns
from mjchair.diagnosis.sensitivity import Column, Pulse, headings
from mjchair.diagnosis.shooting import residual
from mjchair.diagnosis.study import Run
from mjchair.diagnosis.tracking import Track

Array = NDArray[np.float64]
SPREAD = {"Fx": 10.0, "Fy": 10.0, "Mz": 3.0, "left_wheel": 2.0, "right_wheel": 2.0}  # prior, std
SMOOTH = 0.35  # s, correlation time of the prior


def drivers(bench: Bench, track: Track) -> list[dict[str, Array]]:
    """What a force may go with, along each window on its simulation grid.

    speed (m/s), yaw_rate (rad/s), heading (rad), x, y (m, world), left and right wheel angle (rad),
    swivel (rad, mean of the casters), left and right torque (N m), phase of the stroke (rad),
    time (s).
    """
    shooter = bench.shooter
    chair = shooter.chair
    out = []
    for w, trace in zip(shooter.windows, track.trace, strict=True):
        qpos, qvel = trace["qpos"], trace["qvel"]
        east, north = headings(chair, qpos)
        v = qvel[:, chair.dof : chair.dof + 2]
        count = len(qpos)
        controls = shooter.controls(shooter.base, w, count)
        left, right = (_angle(qpos, qvel, chair, k) for k in (0, 1))
        time = w.start + shooter.step * (1 + np.arange(count))
        out.append(
            {
                "time": time,
                "speed": v[:, 0] * east + v[:, 1] * north,
                "yaw_rate": qvel[:, chair.dof + 5],
                "heading": np.unwrap(np.arctan2(north, east)),
                "x": qpos[:, chair.qpos],
                "y": qpos[:, chair.qpos + 1],
                "left_angle": left,
                "right_angle": right,
                "swivel": 0.5 * (qpos[:, chair.swivel_q[0]] + qpos[:, chair.swivel_q[1]]),
                "left_torque": controls[:, 0],
                "right_torque": controls[:, 1],
                "stroke": np.interp(time, *stroke_phase(shooter.study.runs[w.run])),
            }
        )
    return out


def stroke_phase(run: Run) -> tuple[Array, Array]:
    """Phase (rad) of the strokes of a run that is pushed, at times (s); NaN where it is not.

    A stroke begins where the torque of both wheels rises through a quarter of its largest; the
    phase grows by one turn from one beginning to the next. Fewer than three strokes have none.
    """
    nothing = np.array([-1e9, 1e9]), np.full(2, np.nan)
    inputs = run.trial.inputs
    if inputs is None:
        return nothing
    total = np.sum([inputs.at(name, inputs.time) for name in inputs.controls], axis=0)
    level = 0.25 * float(np.percentile(total, 98.0))
    if level <= 0.0:
        return nothing
    begins = inputs.time[1:][(total[1:] >= level) & (total[:-1] < level)]
    begins = begins[np.r_[True, np.diff(begins) > 0.35]] if begins.size else begins
    if begins.size < 3:
        return nothing
    turns = 2.0 * np.pi * np.arange(begins.size)
    before, beyond = begins[0] - 1e-6, begins[-1] + 1e-6
    return np.r_[before, begins, beyond], np.r_[np.nan, turns, np.nan]


def _angle(qpos: Array, qvel: Array, chair: Chair, wheel: int) -> Array:
    dof = chair.rear[wheel][0]
    return np.asarray(qpos[:, dof + 1])  # one quaternion before it: qpos is one longer than qvel


SHAPES = {
    "speed": lambda d: [
        np.tanh(d["speed"] / 0.05),
        d["speed"],
        d["speed"] * np.abs(d["speed"]),
        # any other form: tents over the speed
        *(
            np.sign(d["speed"]) * np.clip(1 - np.abs(np.abs(d["speed"]) - v) / 0.4, 0, 1)
            for v in (0.4, 0.8, 1.2, 1.6, 2.0)
        ),
    ],
    "yaw_rate": lambda d: [
        np.tanh(d["yaw_rate"] / 0.05),
        d["yaw_rate"],
        d["yaw_rate"] * d["speed"],
    ],
    "heading": lambda d: [np.cos(d["heading"]), np.sin(d["heading"])],
    "left wheel's turn": lambda d: [np.cos(d["left_angle"]), np.sin(d["left_angle"])],
    "right wheel's turn": lambda d: [np.cos(d["right_angle"]), np.sin(d["right_angle"])],
    "swivel": lambda d: [d["swivel"], np.tanh(d["swivel"] / 0.1)],
    "torque": lambda d: [d["left_torque"], d["right_torque"]],
    "stroke": lambda d: [
        np.nan_to_num(wave(k * d["stroke"])) for k in (1, 2) for wave in (np.sin, np.cos)
    ],
}


def driver_columns(
    bench: Bench, track: Track, found: Sequence[Pulse], answers: Sequence[Array]
) -> dict[str, Column]:
    """Columns of forces that go with something, named ``force|driver|k``."""
    shooter = bench.shooter
    known = drivers(bench, track)
    out: dict[str, Column] = {}
    for force in ("Fx", "Mz"):
        for name, shape in SHAPES.items():
            out.update(_combined(shooter, known, found, answers, force, name, shape))
        out.update(_bumps(shooter, known, found, answers, force))
    return out


def _at(known: dict[str, Array], pulse: Pulse) -> dict[str, Array]:
    at = int(np.clip(np.searchsorted(known["time"], pulse.time), 0, len(known["time"]) - 1))
    return {k: v[at : at + 1] for k, v in known.items()}


def _combined(shooter, known, found, answers, force, name, shape):  # type: ignore[no-untyped-def]
    out: dict[str, Column] = {}
    for pulse, answer in zip(found, answers, strict=True):
        if pulse.force != force:
            continue
        sizes = [float(s[0]) for s in shape(_at(known[pulse.window], pulse))]
        for k, size in enumerate(sizes):
            key = f"{force}|{name}|{k}"
            column = out.setdefault(key, _nothing(shooter))
            column[pulse.window] = column[pulse.window] + size * answer
    return out


def _bumps(shooter, known, found, answers, force):  # type: ignore[no-untyped-def]
    """A force in each second of each run: something that happened once."""
    out: dict[str, Column] = {}
    for pulse, answer in zip(found, answers, strict=True):
        if pulse.force != force:
            continue
        w = shooter.windows[pulse.window]
        key = f"{force}|time in {shooter.study.runs[w.run].trial.name}|{int(pulse.time)}"
        column = out.setdefault(key, _nothing(shooter))
        column[pulse.window] = column[pulse.window] + answer
    return out


def _nothing(shooter) -> Column:  # type: ignore[no-untyped-def]
    return [np.zeros((w.rows.size, len(shooter.channels))) for w in shooter.windows]


def shaped_column(
    bench: Bench,
    found: Sequence[Pulse],
    answers: Sequence[Array],
    sizes: Array,
) -> Column:
    """A column of pulses with the given sizes (one a pulse; N or N m)."""
    out = _nothing(bench.shooter)
    for pulse, answer, size in zip(found, answers, sizes, strict=True):
        if size:
            out[pulse.window] = out[pulse.window] + size * answer
    return out


@dataclass
class Residual:
    """The force that would close the gap.

    Attributes:
      pulses: when and which. value: (n,), N or N m. std: (n,).
    """

    pulses: list[Pulse]
    value: Array
    std: Array


def residual_force(
    bench: Bench, track: Track, found: Sequence[Pulse], answers: Sequence[Array]
) -> Residual:
    """Fit the pulses of each window, with the smoothness prior, to its whitened residual."""
    shooter, white = bench.shooter, bench.whitener
    value, std = np.zeros(len(found)), np.zeros(len(found))
    for i, w in enumerate(shooter.windows):
        mine = [k for k, p in enumerate(found) if p.window == i]
        if not mine:
            continue
        miss = residual(shooter.measured(w), track.predicted[i], shooter.channels)
        r = white(i, np.nan_to_num(miss)[:, :, None])[:, 0]
        J = white(i, np.stack([answers[k] for k in mine], axis=2))
        slow, precision = slow_columns(shooter, track, i)
        Z = white(i, slow)
        factor = cho_factor(Z.T @ Z + np.diag(precision + RIDGE))
        G = J.T @ J - J.T @ Z @ cho_solve(factor, Z.T @ J)
        b = J.T @ r - J.T @ Z @ cho_solve(factor, Z.T @ r)
        inner = cho_factor(G + np.linalg.inv(_prior([found[k] for k in mine])))
        value[mine] = cho_solve(inner, b)
        std[mine] = np.sqrt(np.diag(cho_solve(inner, np.eye(len(mine)))))
    return Residual(list(found), value, std)


def _prior(pulses: Sequence[Pulse]) -> Array:
    size = np.array([SPREAD[p.force] for p in pulses])
    time = np.array([p.time for p in pulses])
    same = np.array([[p.force == q.force for q in pulses] for p in pulses])
    apart = np.abs(time[:, None] - time[None, :])
    return np.asarray(
        np.outer(size, size) * same * np.exp(-apart / SMOOTH) + 1e-6 * np.diag(size**2)
    )
