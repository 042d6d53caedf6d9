"""Many simulations at once through `mujoco.batch`.

In: models, first states and inputs. Out: records of each simulation, and whether it diverged.

Sweeps and the diagnosis use this module. A simulation gives the same result in a batch as alone, to
the bit, so the result depends neither on the other simulations of the batch nor on the number of
threads. The caller installs the callbacks.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence

import mujoco
import numpy as np
from mujoco import batch
from numpy.typing import NDArray

from mjchair.engine import step_timers

Array = NDArray[np.float64]

BYTES = 120_000_000  # largest size of the records of one batch
# models of one batch must agree in these
SIZES = ("nq", "nv", "na", "nu", "nbody", "njnt", "ngeom", "nsite", "neq", "ntendon", "nsensordata")
WIDTHS = {"sensordata": "nsensordata", "qpos": "nq", "qvel": "nv", "act": "na"}
CONTROL = int(mujoco.mjtState.mjSTATE_CTRL)


def groups(
    models: Sequence[mujoco.MjModel],
    steps: Sequence[int],
    record: Sequence[str] = ("sensordata",),
    apart: Sequence[Hashable] | None = None,
) -> Iterator[list[int]]:
    """Indices of models that can share a batch, in groups whose records are at most BYTES.

    Args:
      models: one for each simulation. steps: number of time steps of each. record: names of
      WIDTHS. apart: a value for each simulation; simulations with different values are put into
        different groups, as are those of different steps.
    """
    alike: dict[Hashable, list[int]] = {}
    for i, model in enumerate(models):
        sizes = (*(getattr(model, name) for name in SIZES), model.opt.timestep, steps[i])
        alike.setdefault((sizes, apart[i] if apart else None), []).append(i)
    for members in alike.values():
        model = models[members[0]]
        width = sum(getattr(model, WIDTHS[name]) for name in record)
        most = max(1, BYTES // (8 * steps[members[0]] * max(width, 1)))
        for at in range(0, len(members), most):
            yield members[at : at + most]


def roll(
    models: Sequence[mujoco.MjModel],
    states: Mapping[str, Array],
    inputs: Array,
    *,
    what: int = CONTROL,
    record: Sequence[str] = ("sensordata",),
    threads: int = 0,
) -> tuple[dict[str, Array], NDArray[np.bool_]]:
    """Simulate models of the same sizes side by side.

    Args:
      models: n of them. states: of the start: "state" (n, integration state), or fields of MjData,
        (n, ...); fields that are not given are as in a new MjData.
      inputs: (n, steps, width), set before each step. what: mjtState bits of these inputs.
      record: of WIDTHS. threads: 0 for all processors.

    Returns:
      record -> (n, steps, width), row k after step k; its sensors belong to the state before step
      k. Whether each simulation diverged (n,), that is, MuJoCo warned.
    """
    many = batch.Batch(models[0], len(models), threads)
    many.set_models(list(models))
    for name, values in states.items():
        (many.state if name == "state" else many.bind(name))[:] = values
    with step_timers.stopped():
        records = many.rollout(inputs.shape[1], inputs, what, record=record)
    return records, many.warning.reshape(len(models), -1).any(axis=1)
