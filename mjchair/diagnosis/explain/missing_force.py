"""The force that would close the gap, and what it goes with.

In: pulses of force and what they change. Out: the force over time that would close the gap (a
spline with a smoothness prior), and columns of forces that depend on speed, yaw rate, heading, a
wheel's angle and so on. These ask for no named effect, so they also see what the library does not
have.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from mjchair.diagnosis.explain.column_ids import Driver, ForceColumn, ForceGroup, Quantity
from mjchair.diagnosis.fit.bench import Bench
from mjchair.diagnosis.fit.column_ids import ColumnId
from mjchair.diagnosis.fit.elimination import eliminate_window
from mjchair.diagnosis.fit.process import Process
from mjchair.diagnosis.replay import strokes
from mjchair.diagnosis.replay.chair_state import Chair
from mjchair.diagnosis.replay.derivatives import Column
from mjchair.diagnosis.replay.pulses import Force, Pulse, headings
from mjchair.diagnosis.replay.sampling import residual
from mjchair.diagnosis.replay.window_states import Track

Array = NDArray[np.float64]
Shape = Callable[[Mapping[str, Array]], Sequence[Array]]
SPREAD = {  # standard deviation of the prior, N or N m
    Force.FORWARD: 10.0,
    Force.LEFTWARD: 10.0,
    Force.YAW: 3.0,
}
SMOOTH = 0.35  # s, correlation time of the prior


def drivers(bench: Bench, track: Track) -> list[dict[str, Array]]:
    """What a force may go with, along each window on its simulation grid.

    speed (m/s), yaw_rate (rad/s), heading (rad), x, y (m, world), left and right wheel angle (rad),
    swivel (rad, mean of the casters), left and right torque (N m), phase of the stroke (rad),
    time (s).
    """
    simulator = bench.simulator
    chair = simulator.chair
    out = []
    for w, trace in zip(simulator.windows, track.trace, strict=True):
        qpos, qvel = trace["qpos"], trace["qvel"]
        east, north = headings(chair, qpos)
        v = qvel[:, chair.dof : chair.dof + 2]
        count = len(qpos)
        controls = simulator.controls(simulator.base, w, count)
        left, right = (_angle(qpos, qvel, chair, k) for k in (0, 1))
        time = w.start + simulator.step * (1 + np.arange(count))
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
                "stroke": np.interp(time, *strokes.phase(simulator.study.runs[w.run])),
            }
        )
    return out


def _angle(qpos: Array, qvel: Array, chair: Chair, wheel: int) -> Array:
    dof = chair.rear[wheel].dof
    return np.asarray(qpos[:, dof + 1])  # one quaternion before it: qpos is one longer than qvel


SHAPES: dict[Quantity, Shape] = {
    Quantity.SPEED: lambda d: [
        np.tanh(d["speed"] / 0.05),
        d["speed"],
        d["speed"] * np.abs(d["speed"]),
        # any other form: tents over the speed
        *(
            np.sign(d["speed"]) * np.clip(1 - np.abs(np.abs(d["speed"]) - v) / 0.4, 0, 1)
            for v in (0.4, 0.8, 1.2, 1.6, 2.0)
        ),
    ],
    Quantity.YAW_RATE: lambda d: [
        np.tanh(d["yaw_rate"] / 0.05),
        d["yaw_rate"],
        d["yaw_rate"] * d["speed"],
    ],
    Quantity.HEADING: lambda d: [np.cos(d["heading"]), np.sin(d["heading"])],
    Quantity.LEFT_TURN: lambda d: [np.cos(d["left_angle"]), np.sin(d["left_angle"])],
    Quantity.RIGHT_TURN: lambda d: [np.cos(d["right_angle"]), np.sin(d["right_angle"])],
    Quantity.SWIVEL: lambda d: [d["swivel"], np.tanh(d["swivel"] / 0.1)],
    Quantity.TORQUE: lambda d: [d["left_torque"], d["right_torque"]],
    Quantity.STROKE: lambda d: [
        np.nan_to_num(wave(k * d["stroke"])) for k in (1, 2) for wave in (np.sin, np.cos)
    ],
}


def driver_columns(
    bench: Bench, track: Track, pulses: Sequence[Pulse], answers: Sequence[Array]
) -> dict[ColumnId, Column]:
    """Columns of forces that go with something, or that act in one second of one run."""
    known = drivers(bench, track)
    out: dict[ColumnId, Column] = {}
    for force in (Force.FORWARD, Force.YAW):
        mine = [(p, a) for p, a in zip(pulses, answers, strict=True) if p.force == force]
        for quantity, shape in SHAPES.items():
            group = ForceGroup(force, Driver(quantity))
            for pulse, answer in mine:
                sizes = [float(s[0]) for s in shape(_at(known[pulse.window], pulse))]
                for k, size in enumerate(sizes):
                    add_answer(out, bench, ForceColumn(group, k), pulse, size * answer)
        for pulse, answer in mine:
            run = bench.simulator.windows[pulse.window].run
            trial = bench.simulator.study.runs[run].trial.name
            group = ForceGroup(force, Driver(Quantity.TIME, trial))
            add_answer(out, bench, ForceColumn(group, math.floor(pulse.time)), pulse, answer)
    return out


def add_answer(
    out: dict[ColumnId, Column], bench: Bench, key: ColumnId, pulse: Pulse, answer: Array
) -> None:
    """Add an answer (rows, channels) to a column, in the pulse's window."""
    if key not in out:
        out[key] = _nothing(bench)
    out[key][pulse.window] = out[key][pulse.window] + answer


def _at(known: dict[str, Array], pulse: Pulse) -> dict[str, Array]:
    at = int(np.clip(np.searchsorted(known["time"], pulse.time), 0, len(known["time"]) - 1))
    return {k: v[at : at + 1] for k, v in known.items()}


def _nothing(bench: Bench) -> Column:
    simulator = bench.simulator
    return [np.zeros((w.rows.size, len(simulator.channels))) for w in simulator.windows]


def shaped_column(
    bench: Bench,
    pulses: Sequence[Pulse],
    answers: Sequence[Array],
    sizes: Array,
) -> Column:
    """A column of pulses with the given sizes (one a pulse; N or N m)."""
    out = _nothing(bench)
    for pulse, answer, size in zip(pulses, answers, sizes, strict=True):
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


@dataclass(frozen=True)
class Products:
    """One window's pulses as linear algebra, with the window's slow state eliminated.

    Attributes:
      pulses: their indices. G: (n, n), products of their whitened answers. b: (n,), with the
        whitened residual. chi2: of that.
    """

    pulses: list[int]
    G: Array
    b: Array
    chi2: float = 0.0


def pulse_products(
    bench: Bench,
    track: Track,
    pulses: Sequence[Pulse],
    answers: Sequence[Array],
    process: Process | None = None,
    change: Column | None = None,
) -> list[Products]:
    """The products of every window that has pulses.

    Args:
      process: part of the noise, if given. change: of the predictions, that stands in for the
        residual; None: the residual.
    """
    simulator = bench.simulator
    out = []
    for i, w in enumerate(simulator.windows):
        mine = [k for k, p in enumerate(pulses) if p.window == i]
        if not mine:
            continue
        measured = simulator.measured(w)
        miss = residual(measured, track.predicted[i], simulator.channels)
        if change is not None:
            miss = np.where(np.isnan(miss), np.nan, change[i])
        columns = np.stack([answers[k] for k in mine], axis=2)
        window = eliminate_window(simulator, track, bench.whitener, i, miss, columns, process)
        out.append(Products(mine, window.G, window.b, window.chi2))
    return out


def mean_forces(
    products: Sequence[Products], pulses: Sequence[Pulse], force: Force, level: NDArray[np.int64]
) -> tuple[Array, Array]:
    """The mean force at each level of something, by least squares over all windows together.

    Nothing draws the means towards zero. Forces of the other kinds are free with their prior.

    Args:
      products: of every window. pulses: all of them. force: the kind, such as FORWARD.
      level: (pulses,), the level that each pulse of this kind lies in, from 0; below 0: in none.

    Returns:
      Means and standard errors, (levels,), in N or N m.
    """
    count = int(level.max(initial=-1)) + 1
    G, b = np.zeros((count, count)), np.zeros(count)
    for p in products:
        own = [j for j, k in enumerate(p.pulses) if pulses[k].force == force and level[k] >= 0]
        others = [j for j in range(len(p.pulses)) if j not in set(own)]
        lies = np.zeros((len(own), count))
        lies[np.arange(len(own)), [level[p.pulses[j]] for j in own]] = 1.0
        mine, cross = p.G[np.ix_(own, own)], p.G[np.ix_(own, others)]
        right = p.b[own]
        if others:
            prior = np.linalg.inv(_prior([pulses[p.pulses[j]] for j in others]))
            factor = cho_factor(p.G[np.ix_(others, others)] + prior)
            mine = mine - cross @ cho_solve(factor, cross.T)
            right = right - cross @ cho_solve(factor, p.b[others])
        G += lies.T @ mine @ lies
        b += lies.T @ right
    inverse = np.linalg.pinv(G, hermitian=True)
    return inverse @ b, np.sqrt(np.maximum(np.diag(inverse), 0.0))


def residual_force(
    bench: Bench, track: Track, pulses: Sequence[Pulse], answers: Sequence[Array]
) -> Residual:
    """Fit the pulses of each window, with the smoothness prior, to its whitened residual."""
    value, std = np.zeros(len(pulses)), np.zeros(len(pulses))
    for p in pulse_products(bench, track, pulses, answers):
        inner = cho_factor(p.G + np.linalg.inv(_prior([pulses[k] for k in p.pulses])))
        value[p.pulses] = cho_solve(inner, p.b)
        std[p.pulses] = np.sqrt(np.diag(cho_solve(inner, np.eye(len(p.pulses)))))
    return Residual(list(pulses), value, std)


def equivalent_force(
    bench: Bench,
    track: Track,
    pulses: Sequence[Pulse],
    answers: Sequence[Array],
    change: Column,
) -> tuple[Array, float]:
    """The forces that change the predictions as something else does.

    Returns:
      The size of every pulse (n,), N or N m, and the share of the change, in chi2, that forces
      make: little for a sensor that is off or a wheel of another radius.
    """
    value, made, whole = np.zeros(len(pulses)), 0.0, 0.0
    for p in pulse_products(bench, track, pulses, answers, change=change):
        inner = cho_factor(p.G + np.linalg.inv(_prior([pulses[k] for k in p.pulses])))
        mine = cho_solve(inner, p.b)
        value[p.pulses] = mine
        made += float(2.0 * mine @ p.b - mine @ p.G @ mine)
        whole += p.chi2
    return value, made / max(whole, 1e-12)


def _prior(pulses: Sequence[Pulse]) -> Array:
    size = np.array([SPREAD[p.force] for p in pulses])
    time = np.array([p.time for p in pulses])
    same = np.array([[p.force == q.force for q in pulses] for p in pulses])
    apart = np.abs(time[:, None] - time[None, :])
    return np.asarray(
        np.outer(size, size) * same * np.exp(-apart / SMOOTH) + 1e-6 * np.diag(size**2)
    )
