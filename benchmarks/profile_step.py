"""Where the time of a step goes: python benchmarks/profile_step.py

Uses MuJoCo's own timers, which take a little time themselves, for the chair on a plane and on a
height field. The share of the tires comes from steps with and without the callbacks.
"""

from __future__ import annotations

import ctypes

import mujoco
import numpy as np
from numba import cfunc, types

import mjchair
from mjchair.model.visual_geoms import without_visual_geoms

STAGES = {
    "kinematics": mujoco.mjtTimer.mjTIMER_POS_KINEMATICS,
    "inertia": mujoco.mjtTimer.mjTIMER_POS_INERTIA,
    "collision": mujoco.mjtTimer.mjTIMER_POS_COLLISION,
    "making constraints": mujoco.mjtTimer.mjTIMER_POS_MAKE,
    "velocity": mujoco.mjtTimer.mjTIMER_VELOCITY,
    "actuation (tires in it)": mujoco.mjtTimer.mjTIMER_ACTUATION,
    "constraint solve": mujoco.mjtTimer.mjTIMER_CONSTRAINT,
}
ROUNDS, ROUND = 40, 500  # steps from the same state, so that no floor ends
STEPS = ROUNDS * ROUND
STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)

_clock = ctypes.CDLL(None).clock
_clock.restype, _clock.argtypes = ctypes.c_long, []


@cfunc(types.float64())
def processor_time():
    """Of this process, in the C library's units of 1 us; other work does not count."""
    return float(_clock())


def models() -> dict[str, mujoco.MjModel]:
    spec = mjchair.load_spec()
    field = mjchair.load_spec(scene="hfield")
    return {
        "plane, with visual geoms": spec.compile(),
        "plane": without_visual_geoms(spec).compile(),
        "height field, 5 cm cells": without_visual_geoms(field).compile(),
    }


def profile(model: mujoco.MjModel) -> tuple[float, dict[str, float]]:
    """Microseconds a step, and of each stage."""
    data = mujoco.MjData(model)
    data.ctrl[:2] = 1.5, 2.0
    mujoco.mj_step(model, data, nstep=200)
    state = np.empty(mujoco.mj_stateSize(model, STATE))
    mujoco.mj_getState(model, data, state, STATE)
    for timer in data.timer:
        timer.duration, timer.number = 0.0, 0
    mujoco.set_mjcb_time(processor_time.ctypes)  # native: a Python timer is too slow
    try:
        for _ in range(ROUNDS):
            mujoco.mj_setState(model, data, state, STATE)
            mujoco.mj_step(model, data, nstep=ROUND)
    finally:
        mujoco.set_mjcb_time(None)
    whole = data.timer[mujoco.mjtTimer.mjTIMER_STEP].duration / STEPS
    return whole, {name: data.timer[kind].duration / STEPS for name, kind in STAGES.items()}


def main() -> None:
    mjchair.install()
    for name, model in models().items():
        whole, stages = profile(model)
        print(f"{name}: {whole:.1f} us a step with the timers on")
        for stage, taken in sorted(stages.items(), key=lambda item: -item[1]):
            print(f"  {stage:28} {taken:7.2f} us  {100 * taken / whole:5.1f} %")
        rest = whole - float(np.sum(list(stages.values())))
        print(f"  {'sensors, integration, rest':28} {rest:7.2f} us  {100 * rest / whole:5.1f} %")


if __name__ == "__main__":
    main()
