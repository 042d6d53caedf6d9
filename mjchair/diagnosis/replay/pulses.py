"""Pulses of force, triangular in time, and the derivatives of every prediction by them.

In: windows with their states. Out: for every pulse of one newton (or newton metre) what it changes
in the samples of its window. Sums of pulses make a force of any course.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis.data.windows import Window
from mjchair.diagnosis.replay.chair_state import Chair, State
from mjchair.diagnosis.replay.simulator import COURSE, STATE, Job, Outcome, Sofar, WindowSimulator
from mjchair.diagnosis.replay.window_states import Track
from mjchair.engine.install import installed

Array = NDArray[np.float64]
AT_ONCE = 64  # pulses that are simulated together


class Force(StrEnum):
    """A generalized force on the chair.

    FORWARD and LEFTWARD act along the chair's axes at the ground below the axle, YAW about its
    vertical. Torques about the axles of the wheels do the same to a chair that rolls, so they would
    only share its force.
    """

    FORWARD = "Fx"
    LEFTWARD = "Fy"
    YAW = "Mz"


@dataclass(frozen=True)
class Kind:
    """How pulses of a force are made: unit, size (in the unit), and time between peaks (s)."""

    unit: str
    size: float
    apart: float


KINDS = {
    Force.FORWARD: Kind("N", 5.0, 0.2),
    Force.LEFTWARD: Kind("N", 5.0, 1.0),
    Force.YAW: Kind("N m", 2.0, 0.2),
}


@dataclass(frozen=True)
class Pulse:
    """A force that rises and falls about a time.

    Attributes:
      force: which. window: index. time: of its peak, s. width: half of its base, s.
    """

    force: Force
    window: int
    time: float
    width: float


def pulses(simulator: WindowSimulator) -> list[Pulse]:
    """Triangular pulses that add up to one throughout every window, for every force."""
    out = []
    for i, w in enumerate(simulator.windows):
        for force, kind in KINDS.items():
            count = max(2, round((w.last - w.first) / kind.apart) + 1)
            times = np.linspace(w.first, w.last, count)
            out += [Pulse(force, i, float(t), float(times[1] - times[0])) for t in times]
    return out


def pulse_answers(
    simulator: WindowSimulator,
    track: Track,
    asked: Sequence[Pulse],
    base_edit: Callable[[mujoco.MjSpec], None] | None = None,
) -> list[Array]:
    """What each pulse of one newton or newton metre changes in its own window, (rows, channels).

    Nothing changes before a pulse begins, so each is simulated from there.
    """
    out: list[Array] = [np.empty(0)] * len(asked)
    model = simulator.coarsened(simulator.compile(base_edit))
    chair = Chair(model)  # an effect may add joints before the wheels'
    with installed():
        free = _without_force(simulator, track, asked, model)
        begins = [_begin(simulator, p, model) for p in asked]
        order = sorted(range(len(asked)), key=begins.__getitem__)
        for at in range(0, len(asked), AT_ONCE):
            group = order[at : at + AT_ONCE]
            jobs = [
                Job(
                    model,
                    simulator.windows[asked[k].window],
                    track.states[asked[k].window],
                    _force(simulator, track, asked[k], model, chair),
                    sofar=_until(begins[k], free[asked[k].window]),
                )
                for k in group
            ]
            for k, outcome in zip(group, simulator.run(jobs), strict=True):
                change = outcome.predicted - free[asked[k].window].predicted
                out[k] = change / KINDS[asked[k].force].size
    return out


def _without_force(
    simulator: WindowSimulator, track: Track, asked: Sequence[Pulse], model: mujoco.MjModel
) -> dict[int, Outcome]:
    """The windows of the pulses as they go without any."""
    which = sorted({p.window for p in asked})
    jobs = [Job(model, simulator.windows[i], track.states[i]) for i in which]
    return dict(zip(which, simulator.run(jobs, trace=COURSE), strict=True))


def _begin(simulator: WindowSimulator, pulse: Pulse, model: mujoco.MjModel) -> int:
    """The first step on which a pulse acts; 0 for the first of a window."""
    w = simulator.windows[pulse.window]
    if _is_first(pulse, w):
        return 0
    return int((pulse.time - pulse.width - w.start) / model.opt.timestep)


def _is_first(pulse: Pulse, window: Window) -> bool:
    """Whether a pulse is the first of its window, which acts from the start of the lead."""
    return pulse.time - pulse.width < window.first


def _until(step: int, free: Outcome) -> Sofar | None:
    """How a simulation went up to a step; None: it has not begun."""
    if step < 1:
        return None
    state = State(*(free.trace[name][step - 1] for name in STATE))
    return Sofar(step, state, free.trace["sensordata"][:step])


def _force(
    simulator: WindowSimulator, track: Track, pulse: Pulse, model: mujoco.MjModel, chair: Chair
) -> Array:
    """Generalized force (steps, nv) of a pulse on the grid of the model's steps."""
    w, step = simulator.windows[pulse.window], float(model.opt.timestep)
    steps = simulator.steps(model, w)
    every = max(1, round(step / simulator.step))
    time = w.start + step * np.arange(steps)
    shape = np.clip(1.0 - np.abs(time - pulse.time) / pulse.width, 0.0, None)
    if _is_first(pulse, w):
        shape[time < pulse.time] = 1.0
    force = np.zeros((steps, model.nv))
    size = KINDS[pulse.force].size * shape
    if pulse.force == Force.YAW:
        force[:, chair.dof + 5] = size
    else:
        x, y = headings(chair, track.trace[pulse.window]["qpos"])
        x, y = _held(x[::every], steps), _held(y[::every], steps)
        east, north = (x, y) if pulse.force == Force.FORWARD else (-y, x)
        force[:, chair.dof] = size * east
        force[:, chair.dof + 1] = size * north
    return force


def _held(values: Array, steps: int) -> Array:
    """The first `steps` values; the last one is held where there are fewer."""
    missing = steps - len(values)
    return values[:steps] if missing <= 0 else np.pad(values, (0, missing), "edge")


def headings(chair: Chair, qpos: Array) -> tuple[Array, Array]:
    """Cosine and sine of the heading along a trace (n, nq)."""
    w, x, y, z = (qpos[:, chair.qpos + 3 + k] for k in range(4))
    east, north = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z)
    size = np.hypot(east, north)
    return east / size, north / size
