"""Many simulations at once through `mujoco.batch`: models, states and inputs in, records out.

Sweeps and the diagnosis stand on it. A simulation of a batch is what it would be alone, to the
bit, so it does not matter what else is in the batch, nor on how many threads it runs. The
callbacks are the caller's to install.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence

import mujoco
import numpy as np
from mujoco import batch
from numpy.typing import NDArray

Array = NDArray[np.float64]

BYTES = 120_000_000  # of what one batch may record
# models of one batch must agree in these
SIZES = ("nq", "nv", "na", "nu", "nbody", "njnt", "ngeom", "nsite", "neq", "ntendon", "nsensordata")
WIDTHS = {"sensordata": "nsensordata", "qpos": "nq", "qvel": "nv", "act": "na"}
CONTROL = int(mujoco.mjtState.mjSTATE_CTRL)


def groups(
    models: Sequence[mujoco.MjModel],
    steps: Callable[[mujoco.MjModel], int],
    record: Sequence[str] = ("sensordata",),
    apart: Sequence[Hashable] | None = None,
) -> Iterator[list[int]]:
    """Indices of models that can share a batch, no more at a time than may be recorded.

    Args:
      models: one a simulation. steps: how many a model takes. record: of WIDTHS.
      apart: something a simulation; those that differ in it stay apart.
    """
    alike: dict[Hashable, list[int]] = {}
    for i, model in enumerate(models):
        sizes = (*(getattr(model, name) for name in SIZES), model.opt.timestep)
        alike.setdefault((sizes, apart[i] if apart else None), []).append(i)
    for members in alike.values():
        model = models[members[0]]
        width = sum(getattr(model, WIDTHS[name]) for name in record)
        most = max(1, BYTES // (8 * steps(model) * max(width, 1)))
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
      models: n of them. states: of the start: "state" (n, integration state), or fields of
        MjData, (n, ...); what is not given is as in a new MjData.
      inputs: (n, steps, width), set before each step. what: mjtState bits that they are.
      record: of WIDTHS. threads: 0 for all processors.

    Returns:
      record -> (n, steps, width), row k after step k; its sensors belong to the state before.
      Which simulations broke (n,): MuJoCo warned.
    """
    many = batch.Batch(models[0], len(models), threads)
    many.set_models(list(models))
    for name, values in states.items():
        (many.state if name == "state" else many.bind(name))[:] = values
    records = many.rollout(inputs.shape[1], inputs, what, record=record)
    return records, many.warning.reshape(len(models), -1).any(axis=1)
