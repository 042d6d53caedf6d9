"""The state along the runs: each window's slow state fitted to its own samples, one after another.

In: a model, and the noise of the channels. Out: a `Track`: states, predictions, and how these
answer to the slow state. The fast part of the state is handed from window to window by the
simulation itself.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis.data import first_state
from mjchair.diagnosis.data.shimmy import CASTERS
from mjchair.diagnosis.data.windows import Window
from mjchair.diagnosis.replay import measured_swing
from mjchair.diagnosis.replay.chair_state import ANGLES, State
from mjchair.diagnosis.replay.noise import Noise
from mjchair.diagnosis.replay.sensor_errors import SensorErrors
from mjchair.diagnosis.replay.simulator import WindowSimulator
from mjchair.diagnosis.replay.window_search import Search, Searched, misfit, sought, tried
from mjchair.engine.install import installed
from mjchair.simulation import names
from mjchair.simulation.initial import position_joints, start

Array = NDArray[np.float64]

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
    chair = Searched(
        simulator=simulator,
        model=model,
        coarse=simulator.coarsened(model),
        errors=errors or SensorErrors(simulator.channels),
        white=_white(simulator, noise),
        kept=before is not None and not anew,
    )
    out = _begun(simulator) if before is None else _copied(before)
    # one after another along the runs where each begins in what the one before leaves
    by_index: dict[int, list[int]] = {}
    for i, w in enumerate(simulator.windows):
        if only is None or i in only:
            by_index.setdefault(w.index if before is None else 0, []).append(i)
    with installed():
        for index in sorted(by_index):
            begun = {i: out.states[i] for i in by_index[index]}
            if not chair.kept:
                begun |= _as_measured(chair, begun)
            most = _most(chair, before, begun) if before and chair.kept else np.inf
            found = sought(chair, _first(chair, out, begun), most)
            _keep(out, found)
            if before is None:
                for i in found:
                    _hand_over(chair, out, i)
            elif anew:
                _or_handed_over(chair, out, found)
    return out


def _white(simulator: WindowSimulator, noise: Mapping[str, Noise]) -> Array:
    """Standard deviations of the samples' noise, (windows, channels)."""
    return np.array(
        [[noise[c].where(w.shimmies).total for c in simulator.channels] for w in simulator.windows]
    )


def _copied(track: Track) -> Track:
    """A track whose states, predictions, answers and traces can be exchanged."""
    states = [s.copy() for s in track.states]
    lists = list(track.predicted), list(track.slow), list(track.trace)
    return Track(states, *lists, touchy=track.touchy)


def _first(chair: Searched, track: Track, begun: Mapping[int, State]) -> dict[int, Search]:
    """The search of windows as it begins, from states by window."""
    windows = chair.simulator.windows
    return {
        i: Search(s, s, touchy=i in track.touchy, shimmies=windows[i].shimmies, slow=track.slow[i])
        for i, s in begun.items()
    }


def _keep(track: Track, found: Mapping[int, Search]) -> None:
    """Put what was found into a track."""
    for i, s in found.items():
        track.states[i], track.predicted[i], track.trace[i] = s.best, s.predicted, s.trace
        track.slow[i] = s.slow
    track.touchy |= {i for i, s in found.items() if s.touchy}


def _as_measured(chair: Searched, states: Mapping[int, State]) -> dict[int, State]:
    """States from which casters that shimmy swing as measured, where this fits their angles better.

    The state of a chair whose casters do not shimmy, or in another rhythm, leads a fit astray.

    Args:
      states: by window, of which those in which none shimmies are left as they are.
    """
    simulator = chair.simulator
    states = {i: s for i, s in states.items() if simulator.windows[i].shimmies}
    angles = np.array([c in CASTERS for c in simulator.channels])
    seen = replace(chair, white=np.where(angles, chair.white, np.inf))
    swung = measured_swing.states(simulator, chair.model, states)
    before, after = (tried(seen, s) for s in (states, swung))
    return {i: swung[i] if after[i][0] < before[i][0] else states[i] for i in states}


def _or_handed_over(chair: Searched, track: Track, found: Mapping[int, Search]) -> None:
    """Take the states that the windows before leave, where a search from there fits better.

    To which side a caster stands that no channel sees, only the chair tells. One that was sought
    for another chair stays on its side, where no step leads over to the other: in the practice
    study of caster friction, casters had turned over early without it, and its fit ended at
    0.146 N m of 0.2, with an inertia 30 % too large.

    Args:
      found: as the search ended from the states of the other chair.
    """
    windows = chair.simulator.windows
    for index in sorted({windows[i].index for i in found} - {0}):
        handed = {}
        for i in (i for i in found if windows[i].index == index):
            before = _neighbour(windows, i, -1)
            if before in found and _may_turn_over(chair.simulator, found, i, before):
                handed[i] = _left_at(chair, track, before, i)
        again = sought(chair, _first(chair, track, handed)) if handed else {}
        _keep(track, {i: s for i, s in again.items() if s.size < found[i].size})


def _may_turn_over(
    simulator: WindowSimulator, found: Mapping[int, Search], window: int, before: int
) -> bool:
    """Whether a caster that no channel sees may stand to another side as a window begins.

    Args:
      before: the window before it.
    """
    w = simulator.windows[window]
    seen = first_state.observed(simulator.study.runs[w.run])[ANGLES].all()
    return not w.shimmies and not seen and (found[before].touchy or found[window].touchy)


def _most(chair: Searched, before: Track, members: Collection[int]) -> float:
    """Misfit of windows above which the states of a chair near by are not sought any further.

    Args:
      before: their track.
    """
    simulator = chair.simulator
    windows = simulator.windows
    known = sum(misfit(simulator, windows[i], before.predicted[i], chair.white[i]) for i in members)
    samples = sum(windows[i].rows.size for i in members) * len(simulator.channels)
    return HOPELESS * max(known, float(samples))


def _begun(simulator: WindowSimulator) -> Track:
    """A track of which nothing is known but the state at the first sample of each run."""
    firsts = first_states(simulator, simulator.base)
    count, nothing = len(simulator.windows), np.empty(0)
    states = [firsts[w.run].copy() for w in simulator.windows]
    return Track(states, [nothing] * count, [nothing] * count, [{}] * count)


def _neighbour(windows: Sequence[Window], i: int, by: int) -> int:
    """The window of the same run that many further on; -1: there is none."""
    w = windows[i]
    return next(
        (k for k, v in enumerate(windows) if v.run == w.run and v.index == w.index + by), -1
    )


def _hand_over(chair: Searched, track: Track, i: int) -> None:
    """Put the state that a window leaves where the next one's simulation starts."""
    following = _neighbour(chair.simulator.windows, i, 1)
    if following >= 0:
        track.states[following] = _left_at(chair, track, i, following)


def _left_at(chair: Searched, track: Track, i: int, following: int) -> State:
    """The state that a window leaves where the simulation of the following one starts."""
    simulator, trace = chair.simulator, track.trace[i]
    w, step = simulator.windows[i], chair.model.opt.timestep
    at = round((simulator.windows[following].start - w.start) / step) - 1
    at = min(max(at, 0), len(trace["qpos"]) - 1)
    return simulator.carrier.back(simulator.in_run(chair.model, w.run), trace, at)
