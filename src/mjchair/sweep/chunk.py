"""Some cases of a study, simulated together.

The same function runs here and on a Dask worker. Each simulation of a batch is what it would be
alone, to the bit, so it does not matter which cases share a chunk, nor on how many threads.
"""

from __future__ import annotations

import functools
import json
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.effects import library
from mjchair.engine.install import install
from mjchair.errors import MjchairError
from mjchair.model.looks import without_looks
from mjchair.model.spec import compile_spec, load_spec
from mjchair.model.wheels import check, cut_damping
from mjchair.simulation import batch, names
from mjchair.simulation.channels import channels
from mjchair.simulation.initial import start
from mjchair.simulation.inputs import drivable
from mjchair.sweep import study as study_module
from mjchair.sweep.measures import Sensed, standard
from mjchair.sweep.study import Case, Study

Array = NDArray[np.float64]
Measure = Callable[[Sensed], Mapping[str, float]]

STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)
COMPLETED, UNSTABLE = "completed", "unstable"


@functools.lru_cache(maxsize=16)
def _base(options: str) -> mujoco.MjSpec:
    """The specification of load_spec options (as JSON) without a designer's changes."""
    return load_spec(**json.loads(options))


@functools.lru_cache(maxsize=1024)
def _chair(key: str) -> mujoco.MjModel:
    """The model of what decides a chair and its floor, as JSON."""
    case = json.loads(key)
    spec = _base(json.dumps({k: case[k] for k in study_module.LOADED if k in case})).copy()
    parameters = study_module.parameters(case)
    if parameters is not None:
        parameters.apply(spec)
    for name, values in study_module.effects(case).items():
        library.find(name).apply(spec, values)
    model = compile_spec(without_looks(spec))
    cut_damping(model)
    check(model)
    return model


@functools.lru_cache(maxsize=4096)
def _start(key: str, began: str) -> Array:
    """The state in which a chair starts, settled on its floor."""
    model = _chair(key)
    data = start(model, study_module.initial(json.loads(began)))
    state = np.empty(mujoco.mj_stateSize(model, STATE))
    mujoco.mj_getState(model, data, state, STATE)
    return state


def key(case: Case) -> str:
    """What decides a case's chair and floor, as JSON."""
    apart = (*study_module.STARTED, *study_module.DRIVEN, study_module.SEED)
    chosen = (*study_module.LOADED, *study_module.DESIGNED)
    told = {k: v for k, v in case.items() if k not in apart and (k in chosen or "." in k)}
    return json.dumps(told, sort_keys=True, default=float)


def run_chunk(
    study: Study, cases: Sequence[Case], first: int = 0, threads: int = 0
) -> list[dict[str, Any]]:
    """Simulate cases of a study.

    The native callbacks are put in place, and stay: several chunks may run at once on the threads
    of a Dask worker, and none may take them from under another.

    Args:
      study: for duration, drive and measures. cases: what to run.
      first: number of the first case in the study. threads: 0 for all processors.

    Returns:
      A row a case: `case` (its number), the case's values, `status`, and its measures (NaN
      where the simulation broke).

    Raises:
      MjchairError: a case that cannot be built.
    """
    rows: list[dict[str, Any]] = []
    install()
    models = [_chair(key(case)) for case in cases]
    for group in batch.groups(models, lambda model: _steps(study, model)):
        chosen = [cases[i] for i in group]
        outcome = _batch(study, chosen, [models[i] for i in group], threads)
        for i, case, found in zip(group, chosen, outcome, strict=True):
            rows.append({"case": first + i, **case, **found})
    return sorted(rows, key=lambda row: int(row["case"]))


def _steps(study: Study, model: mujoco.MjModel) -> int:
    return max(2, round(study.duration / model.opt.timestep))


def _batch(
    study: Study, cases: Sequence[Case], models: Sequence[mujoco.MjModel], threads: int
) -> list[dict[str, Any]]:
    """Status and measures of cases that can share a batch."""
    model = models[0]
    time = model.opt.timestep * np.arange(_steps(study, model))
    states = [
        _start(key(case), json.dumps({k: case[k] for k in study_module.STARTED if k in case}))
        for case in cases
    ]
    control = np.stack(
        [study.drive(case).control_array(m, time) for case, m in zip(cases, models, strict=True)]
    )
    records, broken = batch.roll(models, {"state": np.stack(states)}, control, threads=threads)
    sensed = records["sensordata"]
    places = {c.name: c.index for c in channels(model)}
    driven = {name: names.actuators(model).index(name) for name in drivable(model)}
    measure = study.measures or standard
    rows = []
    for i, case in enumerate(cases):
        seen = Sensed(
            time,
            {name: sensed[i][:, at] for name, at in places.items()},
            {name: control[i][:, at] for name, at in driven.items()},
            case,
        )
        rows.append(_row(measure, seen, bool(broken[i]) or not np.isfinite(sensed[i, -1]).all()))
    return rows


def _row(measure: Measure, seen: Sensed, broken: bool) -> dict[str, Any]:
    """Status and measures of one simulation."""
    try:
        numbers = {name: float(value) for name, value in measure(seen).items()}
    except KeyError as error:
        raise MjchairError(f"a measure asks for channel {error}, which the model lacks") from None
    if broken:
        numbers = dict.fromkeys(numbers, np.nan)
    return {"status": UNSTABLE if broken else COMPLETED, **numbers}
