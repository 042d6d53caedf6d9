"""The search for the slow states from which windows of a chair fit their own samples best.

In: a chair, and states to begin with. Out: for each window a `Search`: the best state, its misfit,
what the channels show from there, and how they answer to the slow state.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import dataclass, field

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis.data import first_state
from mjchair.diagnosis.data.windows import Window
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
from mjchair.diagnosis.replay.sampling import residual
from mjchair.diagnosis.replay.sensor_errors import SensorErrors
from mjchair.diagnosis.replay.simulator import STATE, Job, Outcome, WindowSimulator
from mjchair.measurement.sensors import sensor

Array = NDArray[np.float64]

ROUNDS = 2  # Gauss-Newton rounds a window
MORE = 4  # further ones, as where casters flip
SHIMMYING = 10  # rounds where casters shimmy: a search begins far from where it ends
LITTLE = 0.1  # of the misfit there, which a step must promise: more rounds bring no other answer
MUCH = 0.1  # of the misfit: a step that promised as much, and failed, came of wrong answers
ENOUGH = 0.5  # of what a step promised: where it brings more, the answers stay as they are
FINER = 0.1  # of the steps of finite differences, where a step of the fit failed
# of misfit, in variances of the sensors' noise, that the step of a round promises
PROMISE = 4.0  # from which answers to the slow state are made anew where it led
CALM = 0.1  # below which it is not taken: the elimination of the state does as much


def prior(simulator: WindowSimulator, window: int, state: State) -> Array:
    """Standard deviation of the slow state of a window that starts at `state`, (11,)."""
    spread = np.r_[_moving_prior(simulator, window), SWINGING[2:]]
    if simulator.windows[window].shimmies:
        spread[ANGLES.start :] = SWINGING
    if stands(simulator, window, state):
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


def stands(simulator: WindowSimulator, window: int, state: State) -> bool:
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


@dataclass
class Search:
    """The state of one window while it is fitted.

    Attributes:
      state: that was tried last. best, size: the best so far, and its misfit. predicted, trace: of
        the best. change: from the best to the one that was tried. promise: by how much that
        lessens the misfit, if linear. calm: whether no step from the best is worth it.
      touchy: whether a step failed, so that answers are made at the fine step, of small changes.
      shimmies: whether a caster does, in the window.
      slow: how the channels answer to the slow state, (rows, channels, 11), times chair.STEPS;
        fresh: whether these answers were made at the best. corrected: or made elsewhere, and
        corrected by what the last step brought.
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
    corrected: bool = False
    slow: Array = field(default_factory=lambda: np.empty(0))
    predicted: Array = field(default_factory=lambda: np.empty(0))
    trace: dict[str, Array] = field(default_factory=dict)

    def judge(self, size: float, predicted: Array, trace: dict[str, Array]) -> bool:
        """Take what the state shows, and its misfit; False where it is worse than the best."""
        if size > 1.001 * self.size:
            return False
        self.best, self.size = self.state, size
        self.predicted, self.trace = predicted, trace
        return True


@dataclass(frozen=True, kw_only=True)
class Searched:
    """A chair, and what it is compared with, while states of its windows are sought.

    Attributes:
      model: of any size; states are those of the base model. coarse: it, at the coarse step.
      errors: of the sensors. white: (windows, channels) standard deviations.
      kept: whether the answers to the slow state are of a chair near by, and are kept.
    """

    simulator: WindowSimulator
    model: mujoco.MjModel
    coarse: mujoco.MjModel
    errors: SensorErrors
    white: Array
    kept: bool


def sought(chair: Searched, search: dict[int, Search], most: float = np.inf) -> dict[int, Search]:
    """The search of windows, once it has ended; the tire callbacks must be in place.

    Args:
      search: by window, as it begins.
      most: misfit of all windows above which it ends after a round.
    """
    going = search
    # answers that are kept from another chair would lead further rounds astray
    for round_ in range(SHIMMYING):
        if round_ and sum(s.size for s in search.values()) > most:
            break
        going = {
            i: s
            for i, s in going.items()
            if _goes_on(s, round_, chair.kept, stands(chair.simulator, i, s.state))
        }
        if not going:
            break
        _fit_round(chair, going)
    moved = {i: s.state for i, s in search.items() if not s.calm}
    for i, shown in tried(chair, moved).items():
        search[i].judge(*shown)
    return search


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


def _traced(chair: Searched, states: Mapping[int, State]) -> dict[int, Outcome]:
    jobs = [Job(chair.model, chair.simulator.windows[i], s) for i, s in states.items()]
    done = chair.simulator.run(jobs, trace=STATE) if jobs else []
    return dict(zip(states, done, strict=True))


def tried(
    chair: Searched, states: Mapping[int, State]
) -> dict[int, tuple[float, Array, dict[str, Array]]]:
    """What windows show from their states: misfit, predictions and trace, as `judge` takes them."""
    simulator, out = chair.simulator, {}
    for i, outcome in _traced(chair, states).items():
        w = simulator.windows[i]
        shown = chair.errors.applied(simulator, w, outcome.predicted)
        out[i] = misfit(simulator, w, shown, chair.white[i]), shown, outcome.trace
    return out


def misfit(simulator: WindowSimulator, window: Window, seen: Array, white: Array) -> float:
    """Misfit of a window, where its free columns fit it best."""
    miss = residual(simulator.measured(window), seen, simulator.channels)
    free = zero_columns(simulator).any(axis=1)
    miss[:, free] -= np.nanmean(miss[:, free], axis=0) if free.any() else 0.0
    return float(np.nansum((miss / white) ** 2))


def _fit_round(chair: Searched, search: Mapping[int, Search]) -> None:
    """One Gauss-Newton step of the slow states."""
    simulator = chair.simulator
    good: list[int] = []
    asked: dict[int, State] = {}
    states = {i: s.state for i, s in search.items()}
    for i, shown in tried(chair, states).items():
        s = search[i]
        before = copy.copy(s)
        if s.judge(*shown):
            good.append(i)
            _weigh_answers(s, before, chair.kept)
            if s.fresh:
                asked[i] = s.best
        elif not (s.touchy and s.fresh) and _leads_astray(s, stands(simulator, i, s.best)):
            s.touchy = s.fresh = True
            s.state, asked[i] = s.best, s.best
            good.append(i)
        else:
            s.change, s.promise = 0.3 * s.change, 0.3 * s.promise  # a step too far
            s.state = simulator.chair.moved(s.best, s.change)
    _answer_anew(chair, search, asked)
    for i in good:
        s = search[i]
        change, s.promise = _step(simulator, i, s, chair.white[i])
        s.calm = s.promise <= CALM and not stands(simulator, i, s.state)
        if s.calm:
            continue
        s.change = change * STEPS
        s.state = simulator.chair.moved(s.state, s.change)


def _weigh_answers(search: Search, before: Search, kept: bool) -> None:
    """After a step that was taken: keep the answers, correct them, or ask for new ones (`fresh`).

    Args:
      before: the search before the step. kept: whether answers are of a chair near by.
    """
    brought = before.size - search.size
    first = before.predicted.size == 0  # no step led here, so nothing is known of the answers
    poor = search.touchy and not first and brought <= ENOUGH * before.promise
    search.fresh = not kept or (poor and search.corrected)
    search.corrected = poor and not search.fresh
    if search.corrected:
        shown = search.predicted - before.predicted
        search.slow = _corrected(search.slow, search.change / STEPS, shown)


def _corrected(slow: Array, change: Array, brought: Array) -> Array:
    """Answers that are right of the last step: Broyden's update (Math. Comp. 19, 577, 1965).

    Args:
      change: that step, in units of chair.STEPS, (11,). brought: what it changed, (rows, channels).
    """
    missed = brought - slow @ change
    return np.asarray(slow + missed[..., None] * change / max(float(change @ change), 1e-30))


def _answer_anew(chair: Searched, search: Mapping[int, Search], asked: Mapping[int, State]) -> None:
    """Make answers to the slow state anew: by small changes at the fine step where it is touchy.

    Args:
      asked: states by window.
    """
    for model, share, touchy in ((chair.coarse, 1.0, False), (chair.model, FINER, True)):
        some = {i: state for i, state in asked.items() if search[i].touchy == touchy}
        shown = {i: search[i].predicted for i in some} if touchy else None
        made = answers(chair.simulator, model, chair.errors, some, share, shown)
        for i, columns in made.items():
            search[i].slow = columns


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


def _step(simulator: WindowSimulator, i: int, search: Search, white: Array) -> tuple[Array, float]:
    """Linear step of a window's slow state, in units of chair.STEPS, (11,), and what it promises.

    A chair that misses the samples by more than their noise is not right, and what it leaves tells
    little of states that no channel sees: they would stand in for what is missing.
    """
    miss = residual(simulator.measured(simulator.windows[i]), search.predicted, simulator.channels)
    there = ~np.isnan(miss)
    louder = max(1.0, search.size / max(int(there.sum()), 1))  # power left, over the noise
    columns = np.concatenate([search.slow, zero_columns(simulator)[None].repeat(len(miss), 0)], 2)
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
