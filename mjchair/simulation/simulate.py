"""Simulate a model with inputs, and record every sensor.

In: a model, inputs, an initial state and a duration. Out: a `Recording`, also of a
run that diverged.
"""

from __future__ import annotations

import copy
import importlib.metadata
import os
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np
from mujoco import rollout
from numpy.typing import NDArray
from tqdm import tqdm

from mjchair.engine.install import installed
from mjchair.errors import MjchairError, note
from mjchair.model.engine_warnings import without_engine_warnings
from mjchair.model.spec import compile_spec
from mjchair.model.wheels import check_timestep
from mjchair.simulation import names
from mjchair.simulation.channels import channels, control_unit
from mjchair.simulation.initial import Initial, as_initial, start
from mjchair.simulation.inputs import Inputs, as_inputs, drivable
from mjchair.simulation.recording import Recording, Status
from mjchair.simulation.standing import fall_of_run, leaning_on
from mjchair.simulation.stored_model import StoredModel
from mjchair.units import with_unit

Array = NDArray[np.float64]

CHUNK = 1000  # steps between two checks of the state
TOO_FAST = 1e3  # m/s or rad/s: faster than any chair or caster; MuJoCo itself stops at 1e10
FULL = int(mujoco.mjtState.mjSTATE_FULLPHYSICS)


def simulate(
    model: mujoco.MjModel | mujoco.MjSpec,
    inputs: Inputs | Mapping[str, float] | str | os.PathLike[str] | None = None,
    duration: float | None = None,
    *,
    initial: Initial | Mapping[str, Any] | None = None,
    timestep: float | None = None,
    sample_rate: float | None = None,
    brakes: bool = False,
    compiled: bool = True,
    progress: bool = False,
) -> Recording:
    """Run a model and record every sensor.

    The tire callbacks are in place during the run only; afterwards the earlier callbacks are
    restored. The model that is given is not changed. A run that diverges does not raise an error:
    its recording has the status UNSTABLE, the time at which it diverged, and every sample before
    that time. A run in which the chair tips over or leaves the ground has all its samples; its
    status says what happened.

    MuJoCo's sensor data after a step describes the state before it; here sample k of every channel
    belongs to `time[k]`, and the last sample comes from one more evaluation.

    Args:
      model: from mjchair.load_spec, or compiled from that. A spec is better: its recording holds
        XML, which later versions of MuJoCo can read too.
      inputs: drive the chair: Inputs, constant controls by actuator (N m), or the path of a table;
        None: no inputs, or those of a control callback of MuJoCo that you have set (its controls
        are not recorded).
      duration: s; None: until the inputs end.
      initial: where and how the chair starts, see Initial; None: at rest, at the model's position.
      timestep: s; None: the model's.
      sample_rate: of the recording, Hz; 1/timestep must be a multiple of it; None: every step.
      brakes: lock the parking brakes at the initial wheel angles.
      compiled: False runs the plain Python callbacks, about a hundred times slower.
      progress: show a bar where standard error is a terminal.

    Raises:
      MjchairError: bad input, as one line; a timestep beyond the stability limit of a tire.
      NotStandingError: the chair does not come to rest on its wheels where it starts.
    """
    if inputs is not None and mujoco.get_mjcb_control() is not None:
        raise MjchairError(
            "a control callback of MuJoCo is set and would write over the inputs; take it out with "
            "mujoco.set_mjcb_control(None), or keep it and step the chair with mj_step yourself"
        )
    spec = None
    if isinstance(model, mujoco.MjSpec):
        spec = model.copy()
        model = compile_spec(spec)
    else:
        model = copy.copy(model)
    if timestep is not None:
        check_positive("timestep", timestep, "s")
        model.opt.timestep = timestep
        check_timestep(model)
    inputs = as_inputs(inputs, model, duration)
    every = steps_a_sample(model.opt.timestep, sample_rate)
    steps = _steps(model.opt.timestep, inputs, duration)
    times = model.opt.timestep * np.arange(steps + 1)
    controls = np.zeros((steps + 1, model.nu))
    if inputs is not None:
        controls = inputs.control_array(model, times)
    stored = StoredModel.of(model, spec)

    with installed(compiled), without_engine_warnings():
        data = start(model, as_initial(initial), brakes, controls[0])
        leaning = leaning_on(model, data)
        if leaning:
            note(leaning)
        states, sensed, reason = _run(model, data, controls, every, progress)
    made = assembled(model, stored, states, sensed, controls[::every], reason, every)
    return replace(made, hold=inputs is not None and inputs.hold)


def check_positive(name: str, value: float, unit: str) -> None:
    """Raise MjchairError unless a value is positive and finite."""
    if not (np.isfinite(value) and value > 0.0):
        raise MjchairError(f"{name} is {with_unit(value, unit)}; it must be positive")


def _steps(timestep: float, inputs: Inputs | None, duration: float | None) -> int:
    if duration is None:
        if inputs is None:
            raise MjchairError("no duration and no inputs; give one of them")
        # no step beyond the last sample, since the inputs are zero there
        return max(1, int(inputs.end / timestep + 1e-6))
    check_positive("duration", duration, "s")
    return max(1, round(duration / timestep))


def steps_a_sample(timestep: float, sample_rate: float | None) -> int:
    """Time steps between two samples at a sample rate (Hz); None: every step is one.

    Raises:
      MjchairError: 1/timestep is not a multiple of the rate.
    """
    if sample_rate is None:
        return 1
    check_positive("sample_rate", sample_rate, "Hz")
    every = max(1, round(1.0 / (sample_rate * timestep)))
    if abs(every * sample_rate * timestep - 1.0) > 1e-6:
        raise MjchairError(
            f"sample_rate is {sample_rate:g} Hz; the nearest at a step of {timestep:g} s is "
            f"{1.0 / (every * timestep):g} Hz"
        )
    return every


def _run(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    controls: Array,
    every: int,
    progress: bool,
) -> tuple[Array, Array, str]:
    """Simulate in chunks.

    Args:
      controls: (steps + 1, nu). every: steps between two samples that are kept.

    Returns:
      States (n, nstate) and sensor data (n, nsensordata) at the same times, and why the run
      diverged ("": it did not).
    """
    steps = len(controls) - 1
    state = np.empty(mujoco.mj_stateSize(model, FULL))
    mujoco.mj_getState(model, data, state, FULL)
    kept_states, kept_sensed = [], []
    with tqdm(total=steps, unit="step", disable=None if progress else True) as bar:
        for first in range(0, steps, CHUNK):
            chunk = controls[first : min(first + CHUNK, steps)]
            warm = data.qacc_warmstart.copy()
            out, sensed = rollout.rollout(model, data, state, chunk, initial_warmstart=warm)
            before = np.vstack([state, out[0]])  # (chunk + 1): sensed[k] belongs to before[k]
            good, reason = sound(model, before[1:], sensed[0], first)
            at = slice(-first % every, good, every)
            kept_states.append(before[:-1][at])
            kept_sensed.append(sensed[0][at])
            bar.update(len(chunk))
            if reason:
                return np.vstack(kept_states), np.vstack(kept_sensed), reason
            state = before[-1]
    if steps % every == 0:
        data.ctrl[:] = controls[-1]
        mujoco.mj_forward(model, data)
        kept_states.append(state[None])
        kept_sensed.append(data.sensordata[None].copy())
    return np.vstack(kept_states), np.vstack(kept_sensed), ""


def sound(model: mujoco.MjModel, states: Array, sensed: Array, first: int) -> tuple[int, str]:
    """Number of valid samples of a chunk, and why the run diverged after them ("": it did not).

    After a bad step MuJoCo resets the data or repeats the step, which is visible in the time.

    Args:
      states: (n, nstate) after each step. sensed: (n, nsensordata). first: step of the first.
    """
    clock = (first + 1 + np.arange(len(states))) * model.opt.timestep
    qvel = states[:, 1 + model.nq : 1 + model.nq + model.nv]
    sense_finite = np.logical_and.reduce(np.isfinite(sensed), axis=1)
    finite = np.logical_and.reduce(np.isfinite(states), axis=1) & sense_finite
    in_time = np.abs(states[:, 0] - clock) < 0.5 * model.opt.timestep
    slow = (np.abs(np.nan_to_num(qvel, nan=np.inf)) < TOO_FAST).all(axis=1)
    bad = np.flatnonzero(np.logical_not(finite & in_time & slow))
    if not bad.size:
        return len(states), ""
    k = int(bad[0])
    kept = k + 1 if sense_finite[k] else max(k, 1)
    if not finite[k] or not in_time[k]:
        return kept, "the accelerations are not finite"
    dof = int(np.argmax(np.abs(qvel[k])))
    joint = names.joints(model)[model.dof_jntid[dof]]
    return kept, f"joint {joint} moves at {qvel[k, dof]:.3g} m/s or rad/s"


def assembled(
    model: mujoco.MjModel,
    stored: StoredModel,
    states: Array,
    sensed: Array,
    controls: Array,
    reason: str,
    every: int,
) -> Recording:
    """The recording of a run, with its status.

    Args:
      model: the simulated one. stored: the form in which the recording keeps it.
      states: (n, nstate). sensed: (n, nsensordata). controls: (n or more, nu).
      reason: why the run diverged; "": it did not. every: time steps between two samples.
    """
    listed = channels(model)
    known = names.actuators(model)
    driven = [known.index(name) for name in drivable(model)]
    units = {c.name: c.unit for c in listed} | {known[i]: control_unit(model, i) for i in driven}
    timestep = float(model.opt.timestep)
    time = np.arange(len(states), dtype=np.float64) * (every * timestep)
    qpos = states[:, 1 : 1 + model.nq]
    status, stopped_at = Status.COMPLETED, None
    fallen = fall_of_run(model, time, qpos, sensed)
    if reason:
        status, stopped_at = Status.UNSTABLE, float(states[-1, 0]) + timestep
    elif fallen is not None:
        status, stopped_at, reason = Status(fallen.kind.value), fallen.time, fallen.reason
    return Recording(
        time=time,
        channels={c.name: sensed[:, c.index] for c in listed},
        units=units,
        controls={known[i]: controls[: len(states), i] for i in driven},
        qpos=qpos,
        qvel=states[:, 1 + model.nq : 1 + model.nq + model.nv],
        model=stored,
        timestep=timestep,
        status=status,
        stopped_at=stopped_at,
        reason=reason,
        versions=_versions(),
    )


def _versions() -> dict[str, str]:
    versions = {}
    for package in ("mjchair", "mujoco", "numpy", "numba"):
        try:
            versions[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            versions[package] = "not installed"
    return versions
