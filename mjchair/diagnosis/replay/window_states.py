"""The state along the runs: each window's slow state fitted to its own samples, one after another.

In: a model, and the noise of the channels. Out: a `Track`: states, predictions, and how these
answer to the slow state. The fast part of the state is handed from window to window by the
simulation itself.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis.data import first_state
from mjchair.diagnosis.data.shimmy import CASTERS
from mjchair.diagnosis.data.windows import Window
from mjchair.diagnosis.replay import measured_swing
from mjchair.diagnosis.replay.chair_state import (
    ANGLES,
    BROAD,
    LINKED,
    SLOW,
    STANDING,
    STEPS,
    SWINGING,
    State,
)
from mjchair.diagnosis.replay.noise import Noise
from mjchair.diagnosis.replay.sampling import residual
from mjchair.diagnosis.replay.sensor_errors import SensorErrors
from mjchair.diagnosis.replay.simulator import STATE, Job, Outcome, WindowSimulator
from mjchair.engine.install import installed
from mjchair.measurement.sensors import sensor
from mjchair.simulation import names
from mjchair.simulation.initial import position_joints, start

Array = NDArray[np.float64]
ROUNDS = 2  # Gauss-Newton rounds a window
MORE = 4  # further ones, as where casters flip
SHIMMYING = 10  # rounds where casters shimmy: a search begins far from where it ends
LITTLE = 0.1  # of the misfit there, which a step must promise: more rounds bring no other answer
MUCH = 0.1  # of the misfit: a step that promised as much, and failed, came of wrong answers
ENOUGH = 0.5  # of what a step promised: where it brings more, the answers are not made anew
FINER = 0.1  # of the steps of finite differences, where a step of the fit failed
# of misfit, in variances of the sensors' noise, that the step of a round promises
PROMISE = 4.0  # from which answers to the slow state are made anew where it led
CALM = 0.1  # below which it is not taken: the elimination of the state does as much
# times the misfit of the chair before: above it no state helps, as where casters turn over and over
HOPELESS = 100.0


@dataclass
class Track:
    """The windows' states.

    Attributes:
      states: at the start of each window, as of the base model. predicted: (rows, channels) each.
      slow: d predicted / d slow state, (rows, channels, 11) each, times chair.STEPS.
      trace: qpos, qvel and act along each window, after each step. coarse: predictions at the
        coarse step, once they were needed; seen: by what sensors.
      touchy: windows whose motion answers to so small changes that derivatives need the fine step,
        as that of a wheel that shimmies or slides.
    """

    states: list[State]
    predicted: list[Array]
    slow: list[Array]
    trace: list[dict[str, Array]]
    coarse: list[Array] | None = None
    seen: SensorErrors | None = None
    touchy: frozenset[int] = frozenset()


def first_states(simulator: WindowSimulator, model: mujoco.MjModel) -> dict[int, State]:
    """Each run's state at its first sample: settled, and rolling as its channels say."""
    out = {}
    with installed():
        for i, run in enumerate(simulator.study.runs):
            begin = float(run.trial.time[0]) + float(model.opt.timestep) * np.arange(2)
            inputs = run.trial.inputs
            controls = None if inputs is None else inputs.control_array(model, begin)
            data = start(
                model,
                first_state.initial(run, simulator.study.axle),
                controls=None if controls is None else controls[0],
            )
            if controls is not None:
                for actuator, joint in position_joints(model).items():
                    rate = float(np.diff(controls[:, actuator])[0]) / model.opt.timestep
                    data.qvel[model.jnt_dofadr[joint]] = rate
            known = names.joints(model)
            for side in ("left", "right"):
                seen = first_state._first(run, f"{side}_caster_angle")
                if seen is not None:
                    j = names.find(f"{side}_caster_swivel", known, "joint")
                    data.qpos[model.jnt_qposadr[j]] = seen[0]
            out[i] = State(data.qpos.copy(), data.qvel.copy(), data.act.copy())
    return out


def prior(simulator: WindowSimulator, window: int, state: State) -> Array:
    """Standard deviation of the slow state of a window that starts at `state`, (11,)."""
    spread = np.r_[_moving_prior(simulator, window), SWINGING[2:]]
    if simulator.windows[window].shimmies:
        spread[ANGLES.start :] = SWINGING
    if _stands(simulator, window, state):
        spread[3:5] = STANDING
    # nothing tells where an unseen position is; what its column answers is rounding, and a large
    # residual would be laid on it
    spread[~_tells(simulator, window)] = 1e-6
    return np.asarray(spread)


def _tells(simulator: WindowSimulator, window: int) -> NDArray[np.bool_]:
    """Which of the slow state a window may tell, (11,).

    All but positions that no channel sees, and how casters swing that are not seen to shimmy.
    """
    w = simulator.windows[window]
    seen = first_state.observed(simulator.study.runs[w.run])
    shown = seen | (np.arange(seen.size) >= 2)
    return np.asarray(np.r_[shown, np.tile(seen[ANGLES] & w.shimmies, 2)])


def _stands(simulator: WindowSimulator, window: int, state: State) -> bool:
    """Whether the chair stands as a window begins, and no channel shows that it rolls."""
    return simulator.chair.stands(state) and not simulator.rolls[window]


def _moving_prior(simulator: WindowSimulator, window: int) -> Array:
    w = simulator.windows[window]
    seen = first_state.observed(simulator.study.runs[w.run])
    if w.index == 0:
        loose = np.where(seen, BROAD, np.array([1.0, 1.0, 0.05, 1.0, 0.3, 0.3, 0.3]))
        loose[ANGLES] = np.where(seen[ANGLES], BROAD[ANGLES], 0.3)  # nothing has turned them yet
        given = simulator.study.runs[w.run].given
        if "speed" in given and not seen[3]:
            loose[3] = 0.1
        return loose
    return np.where(seen, BROAD, LINKED).copy()


def track(
    simulator: WindowSimulator,
    model: mujoco.MjModel,
    noise: dict[str, Noise],
    errors: SensorErrors | None = None,
    before: Track | None = None,
    anew: bool = False,
    only: Collection[int] | None = None,
) -> Track:
    """Fit the slow state of every window.

    Args:
      model: of any size; states are those of the base model. before: a track to start from, of a
        model that is not far; its answers to the slow state are kept, unless made `anew`.
      only: windows to fit; the others stay as they were `before`. None: all.
    """
    coarse = simulator.coarsened(model)
    white = np.array(
        [[noise[c].where(w.shimmies).total for c in simulator.channels] for w in simulator.windows]
    )
    errors = errors or SensorErrors(simulator.channels)
    count = len(simulator.windows)
    # one after another along the runs where each begins in what the one before leaves
    by_index: dict[int, list[int]] = {}
    for i, w in enumerate(simulator.windows):
        if only is None or i in only:
            by_index.setdefault(w.index if before is None else 0, []).append(i)
    states = _begun(simulator) if before is None else [s.copy() for s in before.states]
    predicted = [np.empty(0)] * count if before is None else list(before.predicted)
    kept = before is not None and not anew
    slow = [np.empty(0)] * count if before is None else list(before.slow)
    traces = [{}] * count if before is None else list(before.trace)
    touchy = set() if before is None else set(before.touchy)
    with installed():
        for index in sorted(by_index):
            members = by_index[index]
            begun = {i: states[i] for i in members}
            if not kept:
                shimmying = {i: s for i, s in begun.items() if simulator.windows[i].shimmies}
                begun |= _as_measured(simulator, model, errors, shimmying, white)
            search = {
                i: Search(s, s, touchy=i in touchy, shimmies=simulator.windows[i].shimmies)
                for i, s in begun.items()
            }
            going = search
            most = _most(simulator, before, members, white) if before and kept else np.inf
            # answers that are kept from another chair would lead further rounds astray
            for round_ in range(SHIMMYING):
                if round_ and sum(s.size for s in search.values()) > most:
                    break
                going = {
                    i: s
                    for i, s in going.items()
                    if _goes_on(s, round_, kept, _stands(simulator, i, s.state))
                }
                if not going:
                    break
                _fit_round(simulator, (model, coarse), errors, going, white, slow, kept)
            moved = {i: s.state for i, s in search.items() if not s.calm}
            for i, tried in _tried(simulator, model, errors, moved, white).items():
                search[i].judge(*tried)
            for i, s in search.items():
                states[i], predicted[i], traces[i] = s.best, s.predicted, s.trace
                if s.touchy:
                    touchy.add(i)
                if before is None:
                    _hand_over(simulator, model, i, s.trace, states)
    return Track(states, predicted, slow, traces, touchy=frozenset(touchy))


def _as_measured(
    simulator: WindowSimulator,
    model: mujoco.MjModel,
    errors: SensorErrors,
    states: Mapping[int, State],
    white: Array,
) -> dict[int, State]:
    """States from which casters that shimmy swing as measured, where this fits their angles better.

    The state of a chair whose casters do not shimmy, or in another rhythm, leads a fit astray.

    Args:
      states: by window. white: (windows, channels) standard deviations.
    """
    angles = np.array([c in CASTERS for c in simulator.channels])
    white = np.where(angles, white, np.inf)
    swung = measured_swing.states(simulator, model, states)
    before, after = (_tried(simulator, model, errors, s, white) for s in (states, swung))
    return {i: swung[i] if after[i][0] < before[i][0] else states[i] for i in states}


def _most(
    simulator: WindowSimulator, before: Track, members: Collection[int], white: Array
) -> float:
    """Misfit of windows above which the states of a chair near by are not sought any further.

    Args:
      white: (windows, channels) standard deviations.
    """
    windows = simulator.windows
    known = sum(_size(simulator, windows[i], before.predicted[i], white[i]) for i in members)
    samples = sum(windows[i].rows.size for i in members) * len(simulator.channels)
    return HOPELESS * max(known, float(samples))


def _begun(simulator: WindowSimulator) -> list[State]:
    """For every window the state at the first sample of its run."""
    firsts = first_states(simulator, simulator.base)
    return [firsts[w.run].copy() for w in simulator.windows]


@dataclass
class Search:
    """The state of one window while it is fitted.

    Attributes:
      state: that was tried last. best, size: the best so far, and its misfit. predicted, trace: of
        the best. change: from the best to the one that was tried. promise: by how much that
        lessens the misfit, if linear. calm: whether no step from the best is worth it.
      touchy: whether a step failed, so that answers are made at the fine step, of small changes.
      shimmies: whether a caster does, in the window.
      fresh: whether the answers were made at the best.
    """

    state: State
    best: State
    size: float = np.inf
    change: Array = field(default_factory=lambda: np.zeros(len(SLOW)))
    promise: float = np.inf
    calm: bool = False
    touchy: bool = False
    shimmies: bool = False
    fresh: bool = False
    predicted: Array = field(default_factory=lambda: np.empty(0))
    trace: dict[str, Array] = field(default_factory=dict)

    def judge(self, size: float, predicted: Array, trace: dict[str, Array]) -> bool:
        """Take what the state shows, and its misfit; False where it is worse than the best."""
        if size > 1.001 * self.size:
            return False
        self.best, self.size = self.state, size
        self.predicted, self.trace = predicted, trace
        return True


def _goes_on(search: Search, round_: int, kept: bool, stands: bool) -> bool:
    """Whether a window takes part in a round; a chair at rest answers in steps, not in slopes."""
    if search.calm:
        return False
    if stands or (kept and not search.touchy):
        return round_ < ROUNDS
    if search.shimmies:
        least = max(PROMISE, LITTLE * search.size) if round_ else PROMISE
        return round_ < SHIMMYING and search.promise > least
    return round_ < ROUNDS + MORE and search.promise > PROMISE


def _leads_astray(search: Search, stands: bool) -> bool:
    """Whether a step that failed had promised much; a chair at rest answers in steps."""
    return search.promise > MUCH * search.size and not stands


def _traced(
    simulator: WindowSimulator, model: mujoco.MjModel, states: Mapping[int, State]
) -> dict[int, Outcome]:
    jobs = [Job(model, simulator.windows[i], state) for i, state in states.items()]
    done = simulator.run(jobs, trace=STATE) if jobs else []
    return dict(zip(states, done, strict=True))


def _tried(
    simulator: WindowSimulator,
    model: mujoco.MjModel,
    errors: SensorErrors,
    states: Mapping[int, State],
    white: Array,
) -> dict[int, tuple[float, Array, dict[str, Array]]]:
    """What windows show from their states: misfit, predictions and trace, as `judge` takes them."""
    out = {}
    for i, outcome in _traced(simulator, model, states).items():
        w = simulator.windows[i]
        shown = errors.applied(simulator, w, outcome.predicted)
        out[i] = _size(simulator, w, shown, white[i]), shown, outcome.trace
    return out


def _size(simulator: WindowSimulator, window: Window, seen: Array, white: Array) -> float:
    """Misfit of a window, where its free columns fit it best."""
    miss = residual(simulator.measured(window), seen, simulator.channels)
    free = zero_columns(simulator).any(axis=1)
    miss[:, free] -= np.nanmean(miss[:, free], axis=0) if free.any() else 0.0
    return float(np.nansum((miss / white) ** 2))


def _fit_round(
    simulator: WindowSimulator,
    models: tuple[mujoco.MjModel, mujoco.MjModel],
    errors: SensorErrors,
    search: dict[int, Search],
    white: Array,
    slow: list[Array],
    kept: bool,
) -> None:
    """One Gauss-Newton step of the slow states; `kept`: their columns are known."""
    fine, coarse = models
    good: list[int] = []
    asked: dict[int, State] = {}
    states = {i: s.state for i, s in search.items()}
    for i, tried in _tried(simulator, fine, errors, states, white).items():
        s = search[i]
        before, promised = s.size, s.promise
        if s.judge(*tried):
            good.append(i)
            s.fresh = not kept or (s.touchy and not before - s.size > ENOUGH * promised)
            if s.fresh:
                asked[i] = s.best
        elif not (s.touchy and s.fresh) and _leads_astray(s, _stands(simulator, i, s.best)):
            s.touchy = s.fresh = True
            s.state, asked[i] = s.best, s.best
            good.append(i)
        else:
            s.change, s.promise = 0.3 * s.change, 0.3 * s.promise  # a step too far
            s.state = simulator.chair.moved(s.best, s.change)
    for model, share, touchy in ((coarse, 1.0, False), (fine, FINER, True)):
        some = {i: state for i, state in asked.items() if search[i].touchy == touchy}
        shown = {i: search[i].predicted for i in some} if touchy else None
        for i, columns in answers(simulator, model, errors, some, share, shown).items():
            slow[i] = columns
    for i in good:
        s = search[i]
        change, s.promise = _step(simulator, i, s, slow[i], white[i])
        s.calm = s.promise <= CALM and not _stands(simulator, i, s.state)
        if s.calm:
            continue
        s.change = change * STEPS
        s.state = simulator.chair.moved(s.state, s.change)


def answers(
    simulator: WindowSimulator,
    model: mujoco.MjModel,
    errors: SensorErrors,
    states: Mapping[int, State],
    share: float,
    shown: Mapping[int, Array] | None = None,
) -> dict[int, Array]:
    """How windows answer to their slow states: (rows, channels, 11) each, times chair.STEPS.

    What a window cannot tell is not simulated, and answers with zero.

    Args:
      share: of STEPS, by which the states are moved. shown: what the channels show of this model
        from the states themselves, (rows, channels) each; None: it is simulated.
    """
    told = {i: np.flatnonzero(_tells(simulator, i)) for i in states}
    jobs = []
    for i, state in states.items():
        moved = [simulator.chair.moved(state, step) for step in share * np.diag(STEPS)[told[i]]]
        begun = moved if shown is not None else [state, *moved]
        jobs += [Job(model, simulator.windows[i], s) for s in begun]
    outcomes = iter(simulator.run(jobs))

    def seen(i: int) -> Array:
        return errors.applied(simulator, simulator.windows[i], next(outcomes).predicted)

    out = {}
    for i in states:
        base = seen(i) if shown is None else shown[i]
        out[i] = np.zeros((*base.shape, len(SLOW)))
        for k in told[i]:
            out[i][..., k] = (seen(i) - base) / share
    return out


def _step(
    simulator: WindowSimulator, i: int, search: Search, slow: Array, white: Array
) -> tuple[Array, float]:
    """Linear step of a window's slow state, in units of chair.STEPS, (11,), and what it promises.

    A chair that misses the samples by more than their noise is not right, and what it leaves tells
    little of states that no channel sees: they would stand in for what is missing.
    """
    miss = residual(simulator.measured(simulator.windows[i]), search.predicted, simulator.channels)
    there = ~np.isnan(miss)
    louder = max(1.0, search.size / max(int(there.sum()), 1))  # power left, over the noise
    columns = np.concatenate([slow, zero_columns(simulator)[None].repeat(len(miss), 0)], 2)
    a = (columns / white[None, :, None])[there]
    b = (miss / white)[there]
    spread = np.r_[
        prior(simulator, i, search.state) / STEPS, np.full(columns.shape[2] - len(SLOW), 1e4)
    ]
    normal = a.T @ a + np.diag(louder / spread**2)
    aim, zeros = a.T @ b, slice(len(SLOW), None)
    whole = np.linalg.solve(normal, aim)
    # the zeros of wheels' angles are free wherever the state is
    without = aim[zeros] @ np.linalg.solve(normal[zeros, zeros], aim[zeros])
    change, promise = whole[: len(SLOW)], float(whole @ aim - without)
    # shortened, never turned
    return np.asarray(change * min(1.0, 20.0 / max(np.abs(change).max(), 1e-9))), promise


def zero_columns(simulator: WindowSimulator) -> Array:
    """Channels whose zero is free in each window, such as wheel angles, (channels, n)."""
    which = [i for i, c in enumerate(simulator.channels) if sensor(c).free_zero]
    return np.eye(len(simulator.channels))[:, which]


def _hand_over(
    simulator: WindowSimulator,
    model: mujoco.MjModel,
    i: int,
    trace: dict[str, Array],
    states: list[State],
) -> None:
    """The state where the next window's simulation starts."""
    w = simulator.windows[i]
    following = [
        k for k, v in enumerate(simulator.windows) if v.run == w.run and v.index == w.index + 1
    ]
    if not following:
        return
    at = round((simulator.windows[following[0]].start - w.start) / model.opt.timestep) - 1
    at = min(max(at, 0), len(trace["qpos"]) - 1)
    states[following[0]] = simulator.carrier.back(simulator.in_run(model, w.run), trace, at)
