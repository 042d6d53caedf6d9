"""States of windows whose casters swing as they are measured.

In: a model, and states as windows in which a caster shimmies begin. Out: these states with the
measured casters at their measured angle and rate, and with tires that give way to the side so far
that the swivels accelerate as measured: the angle alone leaves the swing's phase open.
"""

from __future__ import annotations

from collections.abc import Mapping

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis.data.shimmy import CASTERS, Turned, stretches, turned
from mjchair.diagnosis.replay.chair_state import DEFLECTIONS, SLOW, State
from mjchair.diagnosis.replay.simulator import STATE, Job, WindowSimulator

Array = NDArray[np.float64]

ASIDE = 0.003  # m, by which a caster's tire gives way to show what it does to its swivel
FURTHEST = 0.02  # m, that it may give way

Measured = Mapping[int, list[Turned | None]]  # by window: the left and right caster; None: not seen


def states(
    simulator: WindowSimulator, model: mujoco.MjModel, begun: Mapping[int, State]
) -> dict[int, State]:
    """The states with casters that swing as measured; the tire callbacks must be in place.

    Args:
      model: of any size; states are those of the base model. begun: states by window.
    """
    measured = {i: _measured(simulator, i) for i in begun}
    swung = {i: _swung(simulator, state, measured[i]) for i, state in begun.items()}
    return _deflected(simulator, model, swung, measured)


def _measured(simulator: WindowSimulator, window: int) -> list[Turned | None]:
    """How the casters turn where a window starts."""
    w = simulator.windows[window]
    trial = simulator.study.runs[w.run].trial
    swing = min(s.swing for s in stretches(trial))
    return [turned(trial, c, w.start, swing) if c in trial.channels else None for c in CASTERS]


def _swung(simulator: WindowSimulator, state: State, measured: list[Turned | None]) -> State:
    """A state with the casters that are measured turned as they are."""
    for side, m in enumerate(measured):
        if m is not None:
            state = simulator.chair.swung(state, side, m.angle, m.rate)
    return state


def _deflected(
    simulator: WindowSimulator,
    model: mujoco.MjModel,
    swung: Mapping[int, State],
    measured: Measured,
) -> dict[int, State]:
    """States whose caster tires give way as far as the measured accelerations ask for.

    Args:
      swung: each caster is turned as it is measured, its tire straight.
    """
    aside = np.zeros(len(SLOW))
    aside[DEFLECTIONS] = ASIDE
    moved = {i: simulator.chair.moved(state, aside) for i, state in swung.items()}
    here, there = (_accelerations(simulator, model, some) for some in (swung, moved))
    out = {}
    for i, state in swung.items():
        change = np.zeros(len(SLOW))
        for side, m in enumerate(measured[i]):
            slope = (there[i][side] - here[i][side]) / ASIDE
            if m is not None and slope != 0.0:
                change[DEFLECTIONS][side] = (m.acceleration - here[i][side]) / slope
        out[i] = simulator.chair.moved(state, np.clip(change, -FURTHEST, FURTHEST))
    return out


def _accelerations(
    simulator: WindowSimulator, model: mujoco.MjModel, some: Mapping[int, State]
) -> dict[int, Array]:
    """Of the left and right swivel in the first step of windows, rad/s^2, (2,) each."""
    jobs = [Job(model, simulator.windows[i], state) for i, state in some.items()]
    outcomes = simulator.run(jobs, trace=STATE) if jobs else []
    dofs, out = simulator.chair.swivel_dof, {}
    for (i, state), outcome in zip(some.items(), outcomes, strict=True):
        inside = simulator.in_run(model, simulator.windows[i].run)
        after = simulator.carrier.back(inside, outcome.trace, 0)
        out[i] = (after.qvel[dofs] - state.qvel[dofs]) / model.opt.timestep
    return out
