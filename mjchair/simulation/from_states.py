"""A recording of states that other code has simulated: a user's loop, a task, or a test.

In: a model and its full physics states, each with its controls. Out: a Recording with every sensor
of the chair, computed again from each state.
"""

from __future__ import annotations

from contextlib import nullcontext

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.engine.install import installed
from mjchair.model.spec import compile_spec
from mjchair.simulation import names
from mjchair.simulation.channels import channels, control_unit
from mjchair.simulation.inputs import drivable
from mjchair.simulation.recording import GRAVITY, Recording, Status
from mjchair.simulation.stored_model import StoredModel

Array = NDArray[np.float64]

FULL = int(mujoco.mjtState.mjSTATE_FULLPHYSICS)


def recording_of(
    model: mujoco.MjModel,
    time: Array,
    states: Array,
    controls: Array,
    *,
    spec: mujoco.MjSpec | None = None,
    tires: bool = True,
    gravity: Array | None = None,
) -> Recording:
    """A recording of these states.

    Args:
      model: the simulated one. time: (n,), s. states: (n, size of mjSTATE_FULLPHYSICS).
      controls: (n, nu), those of the model's actuators.
      spec: of the same chair with its display geoms; it is stored instead of the model.
      tires: whether the tire law was in place.
      gravity: (n, 3), m/s^2, where its direction changed; it is recorded as the channels GRAVITY.
    """
    data, before = mujoco.MjData(model), model.opt.gravity.copy()
    sensed = np.empty((len(time), model.nsensordata))
    with installed() if tires else nullcontext():
        for k, state in enumerate(states):
            mujoco.mj_setState(model, data, state, FULL)
            data.ctrl[:] = controls[k]
            if gravity is not None:
                model.opt.gravity[:] = gravity[k]
            mujoco.mj_forward(model, data)
            sensed[k] = data.sensordata
    model.opt.gravity[:] = before
    turned = {} if gravity is None else dict(zip(GRAVITY, gravity.T, strict=True))
    present, known = channels(model), names.actuators(model)
    driven = [known.index(name) for name in drivable(model)]
    units = {c.name: c.unit for c in present} | {known[i]: control_unit(model, i) for i in driven}
    units |= dict.fromkeys(turned, "m/s^2")
    seen = model if spec is None else compile_spec(spec)
    return Recording(
        time=time,
        channels={c.name: sensed[:, c.index] for c in present} | turned,
        units=units,
        controls={known[i]: controls[:, i] for i in driven},
        qpos=states[:, 1 : 1 + model.nq],
        qvel=states[:, 1 + model.nq : 1 + model.nq + model.nv],
        model=StoredModel.of(seen, spec),
        timestep=float(model.opt.timestep),
        status=Status.COMPLETED,
    )
