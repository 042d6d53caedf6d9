"""Model and inputs to a recording."""

from __future__ import annotations

import copy
import importlib.metadata
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import mujoco
import numpy as np
from mujoco import rollout
from numpy.typing import NDArray
from tqdm import tqdm

from mjchair.engine.install import installed
from mjchair.errors import MjchairError
from mjchair.model.spec import compile_spec
from mjchair.model.wheels import check_timestep
from mjchair.simulation import names
from mjchair.simulation.channels import channels, control_unit
from mjchair.simulation.initial import Initial, as_initial, start
from mjchair.simulation.inputs import Inputs, as_inputs, drivable
from mjchair.simulation.recording import Recording, Status
from mjchair.simulation.stored_model import StoredModel

Array = NDArray[np.float64]

CHUNK = 1000  # steps between two looks at the clock and at the state
TOO_FAST = 1e3  # m/s or rad/s: faster than any chair or caster; MuJoCo itself gives up at 1e10
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

    The tire callbacks are in place during the run only; what was there before comes back. The
    model given is not changed. A run that breaks does not raise: its recording has the status
    UNSTABLE, the time at which it broke, and every sample before it.

    MuJoCo's sensor data after a step describes the state before it; here sample k of every
    channel belongs to `time[k]`, and the last sample comes from one more evaluation.

    Args:
      model: from mjchair.load_spec, or compiled from that. A spec is the better one to give: its
        recording holds XML, which later versions of MuJoCo read as well.
      inputs: what drives the chair: Inputs, constant controls by actuator (N m), or the path of
        a table; None: nothing does.
      duration: s; None: until the inputs end.
      initial: where and how the chair starts, see Initial; None: at rest where the model has it.
      timestep: s; None: the model's.
      sample_rate: of the recording, Hz, a whole part of 1/timestep; None: every step.
      brakes: lock the parking brakes at the initial wheel angles.
      compiled: False runs the plain Python callbacks, about a hundred times slower.
      progress: show a bar where standard error is a terminal.

    Raises:
      MjchairError: bad input, as one line; a timestep beyond the stability limit of a tire.
    """
    spec = None
    if isinstance(model, mujoco.MjSpec):
        spec = model.copy()
        model = compile_spec(spec)
    model = copy.copy(model)
    if timestep is not None:
        _check_positive("timestep", timestep, "s")
        model.opt.timestep = timestep
        check_timestep(model)
    inputs = as_inputs(inputs, model, duration)
    every = _steps_a_sample(model.opt.timestep, sample_rate)
    steps = _steps(model.opt.timestep, inputs, duration)
    times = model.opt.timestep * np.arange(steps + 1)
    controls = np.zeros((steps + 1, model.nu))
    if inputs is not None:
        controls = inputs.control_array(model, times)
    stored = StoredModel.of(model, spec)

    with installed(compiled), _quiet():
        data = start(model, as_initial(initial), brakes)
        states, sensed, reason = _run(model, data, controls, every, progress)
    return _recording(model, stored, states, sensed, controls[::every], reason, every)


def _check_positive(name: str, value: float, unit: str) -> None:
    if not (np.isfinite(value) and value > 0.0):
        raise MjchairError(f"{name} is {value:g} {unit}; it must be positive")


def _steps(timestep: float, inputs: Inputs | None, duration: float | None) -> int:
    if duration is None:
        if inputs is None:
            raise MjchairError("no duration and no inputs; give one of them")
        # not a step beyond the last sample, where the inputs are zero
        return max(1, int(inputs.end / timestep + 1e-6))
    _check_positive("duration", duration, "s")
    return max(1, round(duration / timestep))


def _steps_a_sample(timestep: float, sample_rate: float | None) -> int:
    if sample_rate is None:
        return 1
    _check_positive("sample_rate", sample_rate, "Hz")
    every = max(1, round(1.0 / (sample_rate * timestep)))
    if abs(every * sample_rate * timestep - 1.0) > 1e-6:
        raise MjchairError(
            f"sample_rate is {sample_rate:g} Hz; the nearest at a step of {timestep:g} s is "
            f"{1.0 / (every * timestep):g} Hz"
        )
    return every


@contextmanager
def _quiet() -> Iterator[None]:
    """MuJoCo's warnings go into the recording's status, not into a log file in the folder."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda message: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)


def _run(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    controls: Array,
    every: int,
    progress: bool,
) -> tuple[Array, Array, str]:
    """Roll out in chunks.

    Args:
      controls: (steps + 1, nu). every: steps between two samples that are kept.

    Returns:
      States (n, nstate) and sensor data (n, nsensordata) at the same times, and what broke ("":
      nothing).
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
            good, reason = _good(model, before[1:], sensed[0], first)
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


def _good(model: mujoco.MjModel, states: Array, sensed: Array, first: int) -> tuple[int, str]:
    """How many samples of a chunk are worth keeping, and what broke after them ("": nothing).

    After a bad step MuJoCo resets the data, or repeats them: the clock shows it.

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


def _recording(
    model: mujoco.MjModel,
    stored: StoredModel,
    states: Array,
    sensed: Array,
    controls: Array,
    reason: str,
    every: int,
) -> Recording:
    found = channels(model)
    known = names.actuators(model)
    driven = [known.index(name) for name in drivable(model)]
    units = {c.name: c.unit for c in found} | {known[i]: control_unit(model, i) for i in driven}
    timestep = float(model.opt.timestep)
    return Recording(
        time=np.arange(len(states), dtype=np.float64) * (every * timestep),
        channels={c.name: sensed[:, c.index] for c in found},
        units=units,
        controls={known[i]: controls[: len(states), i] for i in driven},
        qpos=states[:, 1 : 1 + model.nq],
        qvel=states[:, 1 + model.nq : 1 + model.nq + model.nv],
        model=stored,
        timestep=timestep,
        status=Status.UNSTABLE if reason else Status.COMPLETED,
        stopped_at=float(states[-1, 0]) + timestep if reason else None,
        reason=reason,
        versions=_versions(),
    )


def _versions() -> dict[str, str]:
    found = {}
    for package in ("mjchair", "mujoco", "numpy", "numba"):
        try:
            found[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            found[package] = "not installed"
    return found
