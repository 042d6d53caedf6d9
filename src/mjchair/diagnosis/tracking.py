"""The state along the runs: each window's slow state fitted to its own samples, one after another.

The fast part of the state is handed from window to window by the simulation itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis import begin
from mjchair.diagnosis.chair import BROAD, LINKED, SLOW, STANDING, STEPS, Chair, State
from mjchair.diagnosis.noise import Noise
from mjchair.diagnosis.observe import Observer
from mjchair.diagnosis.shooting import Job, Shooter, residual
from mjchair.engine.install import installed
from mjchair.simulation import names
from mjchair.simulation.initial import start

Array = NDArray[np.float64]
ROUNDS = 2  # Gauss-Newton rounds a window; one where a track is near


@dataclass
class Track:
    """The windows' states.

    Attributes:
      states: at the start of each window, as of the base model. predicted: (rows, channels) each.
      slow: d predicted / d slow state, (rows, channels, 7) each, times chair.STEPS.
      trace: qpos, qvel and act along each window, after each step. coarse: predictions at the
        coarse step, once they were needed; seen: by what sensors.
    """

    states: list[State]
    predicted: list[Array]
    slow: list[Array]
    trace: list[dict[str, Array]]
    coarse: list[Array] | None = None
    seen: Observer | None = None


def first_states(shooter: Shooter, model: mujoco.MjModel) -> dict[int, State]:
    """Each run's state at its first sample: settled, and rolling as its channels say."""
    out = {}
    with installed():
        for i, run in enumerate(shooter.study.runs):
            data = start(model, begin.initial(run))
            known = names.joints(model)
            for side in ("left", "right"):
                seen = begin._first(run, f"{side}_caster_angle")
                if seen is not None:
                    j = names.find(f"{side}_caster_swivel", known, "joint")
                    data.qpos[model.jnt_qposadr[j]] = seen[0]
            out[i] = State(data.qpos.copy(), data.qvel.copy(), data.act.copy())
    return out


def prior(shooter: Shooter, window: int, state: State) -> Array:
    """Standard deviation of the slow state of a window that starts at `state`, (7,)."""
    spread = _moving_prior(shooter, window)
    if shooter.chair.stands(state):
        spread[3:5] = STANDING
    # nothing tells where an unseen position is; what its column answers is rounding, and a large
    # residual would be laid on it
    spread[:2][~begin.observed(shooter.study.runs[shooter.windows[window].run])[:2]] = 1e-6
    return spread


def _moving_prior(shooter: Shooter, window: int) -> Array:
    w = shooter.windows[window]
    seen = begin.observed(shooter.study.runs[w.run])
    if w.index == 0:
        loose = np.where(seen, BROAD, np.array([1.0, 1.0, 0.05, 1.0, 0.3, 0.3, 0.3]))
        given = shooter.study.runs[w.run].given
        if "speed" in given and not seen[3]:
            loose[3] = 0.1
        return loose
    return np.where(seen, BROAD, LINKED).copy()


def track(
    shooter: Shooter,
    model: mujoco.MjModel,
    noise: dict[str, Noise],
    observer: Observer | None = None,
    before: Track | None = None,
) -> Track:
    """Fit the slow state of every window.

    Args:
      model: of any size; states are those of the base model. before: a track to start from, of a
        model that is not far.
    """
    chair = shooter.chair
    coarse = shooter.coarsened(model)
    white = np.array([noise[c].total for c in shooter.channels])
    observer = observer or Observer(shooter.channels)
    count = len(shooter.windows)
    by_index: dict[int, list[int]] = {}
    for i, w in enumerate(shooter.windows):
        by_index.setdefault(w.index, []).append(i)
    states: list[State | None] = [None] * count
    firsts = first_states(shooter, shooter.base) if before is None else {}
    predicted: list[Array] = [np.empty(0)] * count
    slow: list[Array] = [np.empty(0)] * count
    traces: list[dict[str, Array]] = [{}] * count
    with installed():
        for index in sorted(by_index):
            members = by_index[index]
            for i in members:
                w = shooter.windows[i]
                if before is not None:
                    states[i] = before.states[i].copy()
                elif states[i] is None:
                    states[i] = firsts[w.run].copy()
            for _ in range(ROUNDS if before is None else 1):
                _fit_round(
                    shooter,
                    chair,
                    (model, coarse),
                    observer,
                    members,
                    states,
                    white,
                    predicted,
                    slow,
                )
            jobs = [Job(model, shooter.windows[i], _some(states[i])) for i in members]
            for i, outcome in zip(members, shooter.run(jobs, trace=True), strict=True):
                predicted[i] = observer.observe(shooter, shooter.windows[i], outcome.predicted)
                traces[i] = outcome.trace
                _hand_over(shooter, model, i, outcome.trace, states)
    return Track([_some(s) for s in states], predicted, slow, traces)


def _some(state: State | None) -> State:
    assert state is not None
    return state


def _fit_round(
    shooter: Shooter,
    chair: Chair,
    models: tuple[mujoco.MjModel, mujoco.MjModel],
    observer: Observer,
    members: list[int],
    states: list[State | None],
    white: Array,
    predicted: list[Array],
    slow: list[Array],
) -> None:
    jobs = []
    for i in members:
        state, w = _some(states[i]), shooter.windows[i]
        jobs += [Job(models[0], w, state), Job(models[1], w, state)]
        jobs += [
            Job(models[1], w, chair.moved(state, STEPS[k] * np.eye(len(SLOW))[k]))
            for k in range(len(SLOW))
        ]
    outcomes = shooter.run(jobs)
    each = 2 + len(SLOW)
    for n, i in enumerate(members):
        w = shooter.windows[i]
        seen = [
            observer.observe(shooter, w, o.predicted) for o in outcomes[n * each : n * each + each]
        ]
        predicted[i] = seen[0]
        slow[i] = np.stack([s - seen[1] for s in seen[2:]], axis=2)
        miss = residual(shooter.measured(w), seen[0], shooter.channels)
        there = ~np.isnan(miss)
        columns = np.concatenate([slow[i], _free_columns(shooter)[None].repeat(len(miss), 0)], 2)
        a = (columns / white[None, :, None])[there]
        b = (miss / white)[there]
        spread = np.r_[
            prior(shooter, i, _some(states[i])) / STEPS, np.full(columns.shape[2] - len(SLOW), 1e4)
        ]
        normal = a.T @ a + np.diag(1.0 / spread**2)
        change = np.linalg.solve(normal, a.T @ b)[: len(SLOW)]
        change *= min(1.0, 20.0 / max(np.abs(change).max(), 1e-9))  # shortened, never turned
        states[i] = chair.moved(_some(states[i]), change * STEPS)


def _free_columns(shooter: Shooter) -> Array:
    """Channels whose zero is free in each window: wheel angles, (channels, n)."""
    which = [i for i, c in enumerate(shooter.channels) if c.endswith("wheel_angle")]
    return np.eye(len(shooter.channels))[:, which]


def _hand_over(
    shooter: Shooter,
    model: mujoco.MjModel,
    i: int,
    trace: dict[str, Array],
    states: list[State | None],
) -> None:
    """The state where the next window's simulation starts."""
    w = shooter.windows[i]
    following = [
        k for k, v in enumerate(shooter.windows) if v.run == w.run and v.index == w.index + 1
    ]
    if not following:
        return
    at = round((shooter.windows[following[0]].start - w.start) / model.opt.timestep) - 1
    at = min(max(at, 0), len(trace["qpos"]) - 1)
    states[following[0]] = base_state(shooter, model, trace, at)


def base_state(shooter: Shooter, model: mujoco.MjModel, trace: dict[str, Array], at: int) -> State:
    """The base model's state at row `at` of a trace of a model that may have more to it."""
    base = shooter.base
    full = State(trace["qpos"][at].copy(), trace["qvel"][at].copy(), trace["act"][at].copy())
    if (model.nq, model.nv, model.na) == (base.nq, base.nv, base.na):
        return full
    out = State(base.qpos0.copy(), np.zeros(base.nv), np.zeros(base.na))
    for j, name in enumerate(names.joints(base)):
        k = names.joints(model).index(name)
        free = base.jnt_type[j] == mujoco.mjtJoint.mjJNT_FREE
        nq, nv = (7, 6) if free else (1, 1)
        q, v = base.jnt_qposadr[j], base.jnt_dofadr[j]
        qm, vm = model.jnt_qposadr[k], model.jnt_dofadr[k]
        out.qpos[q : q + nq] = full.qpos[qm : qm + nq]
        out.qvel[v : v + nv] = full.qvel[vm : vm + nv]
    for a, name in enumerate(names.actuators(base)):
        k = names.actuators(model).index(name)
        at_base, count = base.actuator_actadr[a], base.actuator_actnum[a]
        at_model = model.actuator_actadr[k]
        if at_base >= 0:
            out.act[at_base : at_base + count] = full.act[at_model : at_model + count]
    return out
