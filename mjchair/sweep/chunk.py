"""Simulation of a chunk: some cases of a study that are simulated together.

In: a study and some of its cases. Out: a row for each case, with values, status and measures.

`run_chunk` is called both on the user's machine and on Dask workers. A simulation in a batch gives
the same result as alone, to the bit; so the results depend neither on which cases share a chunk nor
on the number of threads. Compiled models and settled states are kept in memory, because many cases
differ only in their inputs or their seed.
"""

from __future__ import annotations

import functools
import json
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.effects import library
from mjchair.engine.install import install
from mjchair.errors import MjchairError
from mjchair.model.spec import compile_spec, load_spec
from mjchair.model.visual_geoms import without_visual_geoms
from mjchair.model.wheels import check, cut_damping
from mjchair.simulation import batch, names
from mjchair.simulation.channels import channels
from mjchair.simulation.initial import start
from mjchair.simulation.inputs import drivable
from mjchair.simulation.settling import NotStandingError
from mjchair.simulation.standing import fall_of_run
from mjchair.sweep import fingerprint
from mjchair.sweep import study as study_module
from mjchair.sweep.measures import Sensed, standard
from mjchair.sweep.study import Case, Study

Array = NDArray[np.float64]
Measure = Callable[[Sensed], Mapping[str, float]]

STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)
COMPLETED, UNSTABLE, NOT_STANDING = "completed", "unstable", "not standing at the start"


class ChairKey(NamedTuple):
    """The content that determines the compiled model of a case.

    Attributes:
      values: the case's values that concern the chair and its floor, as JSON.
      digest: of the model that load_spec makes of them; it changes when one of its files changes.
    """

    values: str
    digest: str


def chair_keys(cases: Sequence[Case]) -> list[ChairKey]:
    """The keys of the compiled models of some cases, in their order."""
    options = [_load_options(case) for case in cases]
    digests = {
        text: fingerprint.of_model(load_spec(**json.loads(text))) for text in dict.fromkeys(options)
    }
    return [
        ChairKey(_chair_values(case), digests[text])
        for case, text in zip(cases, options, strict=True)
    ]


def _chair_values(case: Case) -> str:
    """The values of a case that concern the chair and its floor, as JSON."""
    chosen = (*study_module.LOADED, *study_module.DESIGNED)
    values = {name: value for name, value in case.items() if name in chosen or "." in name}
    return json.dumps(values, sort_keys=True, default=float)


def _load_options(case: Case) -> str:
    """The options of load_spec in a case, as JSON."""
    return json.dumps({k: case[k] for k in study_module.LOADED if k in case}, sort_keys=True)


@functools.lru_cache(maxsize=16)
def _loaded_spec(options: str, digest: str) -> mujoco.MjSpec:
    """Specification from load_spec for options (JSON); `digest` is of the compiled model."""
    # a designer's changes need the separate parts; the simulated model has no display geoms at all
    return load_spec(**json.loads(options), merge_visual_geoms=False)


@functools.lru_cache(maxsize=1024)
def compiled_model(key: ChairKey) -> mujoco.MjModel:
    """The model of a chair on its floor, with the designer's parameters and effects of the case."""
    model = compile_spec(without_visual_geoms(_edited_spec(key)))
    cut_damping(model)
    check(model)
    return model


def check_chairs(study: Study) -> None:
    """Build a chair with each value of each axis, the other axes at their first values.

    Raises:
      MjchairError: a value that the chair does not take.
    """
    first = study.cases()[0]
    cases = [{**first, name: value} for name, values in study.axes.items() for value in values]
    for key in dict.fromkeys(chair_keys(cases or [first])):
        _edited_spec(key)


def _edited_spec(key: ChairKey) -> mujoco.MjSpec:
    """The specification of `compiled_model`, before it is compiled."""
    case = json.loads(key.values)
    spec = _loaded_spec(_load_options(case), key.digest).copy()
    parameters = study_module.parameters(case)
    if parameters is not None:
        parameters.apply(spec)
    for name, values in study_module.effects(case).items():
        library.find(name).apply(spec, values)
    return spec


class StartState(NamedTuple):
    """The state (MuJoCo's integration state) at the start, and whether the chair stands in it."""

    state: Array
    stands: bool


def start_state(key: ChairKey, case: Case) -> StartState:
    """The state in which a case starts, with the chair settled on its floor."""
    return _start_state(
        key, json.dumps({k: case[k] for k in study_module.STARTED if k in case}, sort_keys=True)
    )


@functools.lru_cache(maxsize=4096)
def _start_state(key: ChairKey, initial: str) -> StartState:
    """As `start_state`. initial: speed and yaw rate of the case, as JSON."""
    model = compiled_model(key)
    stands = True
    try:
        data = start(model, study_module.initial(json.loads(initial)))
    except NotStandingError:
        data, stands = mujoco.MjData(model), False
    state = np.empty(mujoco.mj_stateSize(model, STATE))
    mujoco.mj_getState(model, data, state, STATE)
    return StartState(state, stands)


def clear_caches() -> None:
    """Delete all compiled models and settled states from memory, for benchmarks."""
    for cached in (_loaded_spec, compiled_model, _start_state):
        cached.cache_clear()


def run_chunk(
    study: Study, cases: Sequence[Case], first: int = 0, threads: int = 0
) -> list[dict[str, Any]]:
    """Simulate cases of a study.

    The native callbacks are installed and not removed: several chunks may run at the same time on
    the threads of a Dask worker, and all of them need the callbacks.

    Args:
      study: gives duration, inputs and measures. cases: the cases to simulate.
      first: number of the first of these cases in the study. threads: 0 for all processors.

    Returns:
      A row for each case: `case` (its number), the case's values, `status`, and its measures. The
      measures are NaN where the simulation became unstable, or where the chair does not stand in
      its initial state. The status also says whether the chair tipped over or left the ground.

    Raises:
      MjchairError: a case that cannot be built.
    """
    rows: list[dict[str, Any]] = []
    install()
    keys = chair_keys(cases)
    models = [compiled_model(key) for key in keys]
    steps = [_steps(study, model) for model in models]
    for group in batch.groups(models, steps, ("sensordata", "qpos")):
        chosen = [cases[i] for i in group]
        starts = [start_state(keys[i], cases[i]) for i in group]
        results = _simulate(study, chosen, [models[i] for i in group], starts, threads)
        for i, case, result in zip(group, chosen, results, strict=True):
            rows.append({"case": first + i, **case, **result})
    return sorted(rows, key=lambda row: int(row["case"]))


def _steps(study: Study, model: mujoco.MjModel) -> int:
    """Number of time steps of a simulation, at least 2."""
    return max(2, round(study.duration / float(model.opt.timestep)))


def _simulate(
    study: Study,
    cases: Sequence[Case],
    models: Sequence[mujoco.MjModel],
    starts: Sequence[StartState],
    threads: int,
) -> list[dict[str, Any]]:
    """Status and measures of cases whose models can share a batch, in their order."""
    model = models[0]
    time = model.opt.timestep * np.arange(_steps(study, model))
    control = np.stack(
        [study.drive(case).control_array(m, time) for case, m in zip(cases, models, strict=True)]
    )
    states = np.stack([begin.state for begin in starts])
    records, unstable = batch.roll(
        models, {"state": states}, control, record=("sensordata", "qpos"), threads=threads
    )
    sensed = records["sensordata"]
    sensor_columns = {channel.name: channel.index for channel in channels(model)}
    control_columns = {name: names.actuators(model).index(name) for name in drivable(model)}
    measure = study.measures or standard
    rows = []
    for i, case in enumerate(cases):
        run = Sensed(
            time,
            {name: sensed[i][:, column] for name, column in sensor_columns.items()},
            {name: control[i][:, column] for name, column in control_columns.items()},
            case,
            models[i],
        )
        status = COMPLETED
        if not starts[i].stands:
            status = NOT_STANDING
        elif unstable[i] or not np.isfinite(sensed[i, -1]).all():
            status = UNSTABLE
        elif fallen := fall_of_run(models[i], time, records["qpos"][i], sensed[i]):
            status = fallen.kind.value
        rows.append(_row(measure, run, status))
    return rows


def _row(measure: Measure, run: Sensed, status: str) -> dict[str, Any]:
    """Status and measures of one simulation."""
    try:
        numbers = {name: float(value) for name, value in measure(run).items()}
    except KeyError as error:
        raise MjchairError(
            f"a measure reads the channel {error}, which this model does not have"
        ) from None
    if status in (UNSTABLE, NOT_STANDING):
        numbers = dict.fromkeys(numbers, np.nan)
    return {"status": status, **numbers}
