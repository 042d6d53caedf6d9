"""The state along the runs: each window's slow state fitted to its own samples, one after another.

The fast part of the state is handed from window to window by the simulation itself.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis import begin
from mjchair.diagnosis.chair import BROAD, LINKED, SLOW, STANDING, STEPS, Chair, State
from mjchair.diagnosis.noise import Noise
from mjchair.diagnosis.observe import Observer
from mjchair.diagnosis.shooting import Job, Outcome, Shooter, residual
from mjchair.diagnosis.windows import Window
from mjchair.engine.install import installed
from mjchair.simulation import names
from mjchair.simulation.initial import start

Array = NDArray[np.float64]
ROUNDS = 2  # Gauss-Newton rounds a window


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
        loose[5:] = np.where(seen[5:], BROAD[5:], 0.3)  # nothing has turned the casters yet
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
    anew: bool = False,
) -> Track:
    """Fit the slow state of every window.

    Args:
      model: of any size; states are those of the base model. before: a track to start from, of a
        model that is not far; its answers to the slow state are kept, unless made `anew`.
    """
    chair = shooter.chair
    coarse = shooter.coarsened(model)
    white = np.array([noise[c].total for c in shooter.channels])
    observer = observer or Observer(shooter.channels)
    count = len(shooter.windows)
    by_index: dict[int, list[int]] = {}
    for i, w in enumerate(shooter.windows):
        by_index.setdefault(w.index, []).append(i)
    states = _begun(shooter) if before is None else [s.copy() for s in before.states]
    predicted: list[Array] = [np.empty(0)] * count
    kept = before is not None and not anew
    slow: list[Array] = list(before.slow) if before and kept else [np.empty(0)] * count
    traces: list[dict[str, Array]] = [{}] * count
    with installed():
        for index in sorted(by_index):
            members = by_index[index]
            search = {i: Search(states[i], states[i]) for i in members}
            for _ in range(ROUNDS):
                _fit_round(
                    shooter, chair, (model, coarse), observer, search, white, predicted, slow, kept
                )
            outcomes = _traced(shooter, model, [(i, search[i].state) for i in members])
            for i, outcome in outcomes.items():
                w = shooter.windows[i]
                predicted[i] = observer.observe(shooter, w, outcome.predicted)
                search[i].judge(_size(shooter, w, predicted[i], white))
            worse = [i for i in members if search[i].state is not search[i].best]
            again = _traced(shooter, model, [(i, search[i].best) for i in worse])
            for i in members:
                outcome = again.get(i, outcomes[i])
                predicted[i] = observer.observe(shooter, shooter.windows[i], outcome.predicted)
                states[i], traces[i] = search[i].best, outcome.trace
                if before is None:
                    _hand_over(shooter, model, i, outcome.trace, states)
    return Track(states, predicted, slow, traces)


def _begun(shooter: Shooter) -> list[State]:
    """For every window the state at the first sample of its run."""
    firsts = first_states(shooter, shooter.base)
    return [firsts[w.run].copy() for w in shooter.windows]


@dataclass
class Search:
    """The state of one window while it is fitted.

    Attributes:
      state: that was tried last. best, size: the best so far, and its misfit. change: from the
        best to the one that was tried.
    """

    state: State
    best: State
    size: float = np.inf
    change: Array = field(default_factory=lambda: np.zeros(len(SLOW)))

    def judge(self, size: float) -> bool:
        """Take the misfit of the state; False where it is worse than the best."""
        if size > 1.001 * self.size:
            return False
        self.best, self.size = self.state, size
        return True


def _traced(
    shooter: Shooter, model: mujoco.MjModel, which: list[tuple[int, State]]
) -> dict[int, Outcome]:
    jobs = [Job(model, shooter.windows[i], state) for i, state in which]
    done = shooter.run(jobs, trace=True) if jobs else []
    return {i: outcome for (i, _), outcome in zip(which, done, strict=True)}


def _size(shooter: Shooter, window: Window, seen: Array, white: Array) -> float:
    """Misfit of a window, where its free columns fit it best."""
    miss = residual(shooter.measured(window), seen, shooter.channels)
    free = _free_columns(shooter).any(axis=1)
    miss[:, free] -= np.nanmean(miss[:, free], axis=0) if free.any() else 0.0
    return float(np.nansum((miss / white) ** 2))


def _fit_round(
    shooter: Shooter,
    chair: Chair,
    models: tuple[mujoco.MjModel, mujoco.MjModel],
    observer: Observer,
    search: dict[int, Search],
    white: Array,
    predicted: list[Array],
    slow: list[Array],
    kept: bool,
) -> None:
    """One Gauss-Newton step of the slow states; `kept`: their columns are known."""
    jobs = []
    for i, s in search.items():
        w = shooter.windows[i]
        jobs.append(Job(models[0], w, s.state))
        if kept:
            continue
        jobs.append(Job(models[1], w, s.state))
        jobs += [
            Job(models[1], w, chair.moved(s.state, STEPS[k] * np.eye(len(SLOW))[k]))
            for k in range(len(SLOW))
        ]
    outcomes = shooter.run(jobs)
    each = 1 if kept else 2 + len(SLOW)
    for n, (i, s) in enumerate(search.items()):
        w = shooter.windows[i]
        seen = [
            observer.observe(shooter, w, o.predicted) for o in outcomes[n * each : n * each + each]
        ]
        if not s.judge(_size(shooter, w, seen[0], white)):
            s.change = 0.3 * s.change  # a step too far
            s.state = chair.moved(s.best, s.change)
            continue
        predicted[i] = seen[0]
        if not kept:
            slow[i] = np.stack([y - seen[1] for y in seen[2:]], axis=2)
        s.change = _step(shooter, i, s.state, seen[0], slow[i], white) * STEPS
        s.state = chair.moved(s.state, s.change)


def _step(shooter: Shooter, i: int, state: State, seen: Array, slow: Array, white: Array) -> Array:
    """Linear step of a window's slow state, in units of chair.STEPS, (7,)."""
    miss = residual(shooter.measured(shooter.windows[i]), seen, shooter.channels)
    there = ~np.isnan(miss)
    columns = np.concatenate([slow, _free_columns(shooter)[None].repeat(len(miss), 0)], 2)
    a = (columns / white[None, :, None])[there]
    b = (miss / white)[there]
    spread = np.r_[prior(shooter, i, state) / STEPS, np.full(columns.shape[2] - len(SLOW), 1e4)]
    normal = a.T @ a + np.diag(1.0 / spread**2)
    change = np.linalg.solve(normal, a.T @ b)[: len(SLOW)]
    # shortened, never turned
    return np.asarray(change * min(1.0, 20.0 / max(np.abs(change).max(), 1e-9)))


def _free_columns(shooter: Shooter) -> Array:
    """Channels whose zero is free in each window: wheel angles, (channels, n)."""
    which = [i for i, c in enumerate(shooter.channels) if c.endswith("wheel_angle")]
    return np.eye(len(shooter.channels))[:, which]


def _hand_over(
    shooter: Shooter,
    model: mujoco.MjModel,
    i: int,
    trace: dict[str, Array],
    states: list[State],
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
        return shooter.resting(full, model, back=True)
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
