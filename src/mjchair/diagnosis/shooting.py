"""Windows simulated, many at once: predictions of every measured channel at every sample."""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from mjchair.diagnosis.chair import Chair, Rest, State
from mjchair.diagnosis.store import Part, Store, digest
from mjchair.diagnosis.study import Run, Study
from mjchair.diagnosis.windows import Window, cut
from mjchair.effects import rider_sway
from mjchair.engine.install import installed
from mjchair.errors import MjchairError
from mjchair.model.looks import without_looks
from mjchair.model.wheels import COMFORTABLE, base_name, check_timestep, cut_damping
from mjchair.simulation import batch, names
from mjchair.simulation.channels import channels

Array = NDArray[np.float64]
ANGLES = ("heading",)  # channels that wrap
FORCE = int(mujoco.mjtState.mjSTATE_QFRC_APPLIED)
SMOOTHING = 0.12  # s, half width of the parabola through a measured motion
THREADS = 2


@dataclass
class Job:
    """One window of one model.

    Attributes:
      model: what is simulated. window: which. state: at the window's start, of the base model.
      force: (steps, nv) generalized force on top, or None. late: s, by which inputs come later.
    """

    model: mujoco.MjModel
    window: Window
    state: State
    force: Array | None = None
    late: float = 0.0


@dataclass
class Outcome:
    """What a job gave: predictions (rows, channels), and states along the way where asked for."""

    predicted: Array
    trace: dict[str, Array] = field(default_factory=dict)


class Shooter:
    """Simulates windows of a study's runs.

    Attributes:
      study, channels, windows: what is simulated. step: of the simulation, s.
    """

    def __init__(
        self,
        study: Study,
        windows: Sequence[Window] | None = None,
        store: Store | None = None,
        threads: int = THREADS,
    ) -> None:
        """Cut the runs; simulations are kept in the store, where there is one."""
        self.store = store
        self.threads = threads
        self.study = study
        self.channels = study.channels
        self.spec = without_looks(study.spec)
        self.base = self.spec.copy().compile()
        self.chair = Chair(self.base)
        self.step = float(self.base.opt.timestep)
        self.windows = list(windows) if windows is not None else cut(study.runs, self.step)
        longest = max(w.last - w.start for w in self.windows)
        self.steps = int(np.ceil(longest / self.step)) + 3
        self.coarse = self._coarse_step()
        self._places: dict[int, list[int]] = {}
        self._rests: dict[bytes, Rest] = {}
        self.motions = [_motion(run) for run in study.runs]
        self.studied = digest(part for run in study.runs for part in _given(run))

    def _coarse_step(self) -> float:
        """Twice the step where the tires allow it: enough for differences of two simulations."""
        model = copy.copy(self.base)
        model.opt.timestep = 2.0 * self.step
        try:
            check_timestep(model)
        except MjchairError:
            return self.step
        return 2.0 * self.step

    def compile(
        self, edit: Callable[[mujoco.MjSpec], None] | None = None, coarse: bool = False
    ) -> mujoco.MjModel:
        """The base model, edited; `coarse` for differences."""
        spec = self.spec.copy()
        if edit is not None:
            edit(spec)
        try:
            model = spec.compile()
            return self.coarsened(model) if coarse else model
        except ValueError as error:
            line = " ".join(str(error).split())
            raise MjchairError(f"an effect does not compile: {line}") from None

    def coarsened(self, model: mujoco.MjModel) -> mujoco.MjModel:
        """A copy at the coarse step, its tires stable also under more than their nominal load."""
        coarse = copy.copy(model)
        coarse.opt.timestep *= self.coarse / self.step
        cut_damping(coarse, above=COMFORTABLE)
        return coarse

    def input_step(self) -> float:
        """Median time between samples of the inputs, s; 0 where nothing is driven."""
        steps = [
            float(np.median(np.diff(r.trial.inputs.time)))
            for r in self.study.runs
            if r.trial.inputs is not None and r.trial.inputs.time.size > 1
        ]
        return max(steps, default=0.0)

    def measured(self, window: Window) -> Array:
        """Samples (rows, channels) of a window, NaN where missing."""
        trial = self.study.runs[window.run].trial
        nothing = np.full(window.rows.size, np.nan)
        return np.column_stack(
            [
                trial.channels[c][window.rows] if c in trial.channels else nothing
                for c in self.channels
            ]
        )

    def controls(
        self, model: mujoco.MjModel, window: Window, steps: int, late: float = 0.0
    ) -> Array:
        """Controls (steps, nu) of a window: measured torques, and the rider's motion."""
        time = window.start + float(model.opt.timestep) * np.arange(steps) - late
        out = np.zeros((steps, model.nu))
        inputs = self.study.runs[window.run].trial.inputs
        known = names.actuators(model)
        if inputs is not None:
            for name in inputs.controls:
                out[:, names.find(name, known, "actuator")] = inputs.at(name, time)
        if rider_sway.MOTION in known and self.motions[window.run] is not None:
            place, _ = self.motions[window.run](time)  # type: ignore[misc,arg-type]
            out[:, known.index(rider_sway.MOTION)] = place
        return out

    def run(self, jobs: Sequence[Job], trace: bool = False) -> list[Outcome]:
        """Simulate the jobs, or load what the store kept of them; traces are not kept."""
        if self.store is None or trace:
            return self._simulate(jobs, trace)
        key = self._key(jobs, self.store)
        found = self.store.load(key)
        if found is None:
            found = [outcome.predicted for outcome in self._simulate(jobs, trace)]
            self.store.save(key, found)
        return [Outcome(predicted) for predicted in found]

    def _key(self, jobs: Sequence[Job], store: Store) -> str:
        """Digest of all that the jobs' predictions follow from."""
        parts: list[Part] = [self.studied, self.steps, self.step, *self.channels]
        models = {id(job.model): job.model for job in jobs}
        places = {name: k for k, name in enumerate(models)}
        for job in jobs:
            w, state = job.window, job.state
            parts += [places[id(job.model)], job.late, w.run, w.start, w.rows]
            parts += [state.qpos, state.qvel, state.act]
            parts.append(job.force if job.force is not None else "free")
        return store.key(models.values(), parts)

    def _simulate(self, jobs: Sequence[Job], trace: bool) -> list[Outcome]:
        """Equal model sizes go together."""
        outcomes: list[Outcome | None] = [None] * len(jobs)
        models, driven = [job.model for job in jobs], [job.force is None for job in jobs]
        record = ("sensordata", *(("qpos", "qvel", "act") if trace else ()))
        for chunk in batch.groups(models, self._steps, record, driven):
            with installed():
                done = self._chunk([jobs[i] for i in chunk], record)
            for i, outcome in zip(chunk, done, strict=True):
                outcomes[i] = outcome
        return [o for o in outcomes if o is not None]

    def _steps(self, model: mujoco.MjModel) -> int:
        return int(np.ceil(self.steps * self.step / model.opt.timestep)) + 1

    def _chunk(self, jobs: list[Job], record: Sequence[str]) -> list[Outcome]:
        models = [_coasting(self.study.runs[j.window.run], j.model) for j in jobs]
        model = models[0]
        steps = self._steps(model)
        kept: dict[tuple[int, int, float], Array] = {}
        rows = []
        for job, m in zip(jobs, models, strict=True):
            key = (id(job.window), m.nu, job.late)
            if key not in kept:
                kept[key] = self.controls(m, job.window, steps, job.late)
            rows.append(kept[key])
        control, what = np.stack(rows), batch.CONTROL
        if jobs[0].force is not None:
            forces = np.stack([_resized(j.force, steps) for j in jobs])
            control, what = np.concatenate([control, forces], axis=2), what | FORCE
        states = self._states(jobs, model)
        out, _ = batch.roll(models, states, control, what=what, record=record, threads=self.threads)
        return [
            Outcome(
                self._sampled(model, job.window, out["sensordata"][i]),
                {k: out[k][i] for k in record[1:]},
            )
            for i, job in enumerate(jobs)
        ]

    def _states(self, jobs: list[Job], model: mujoco.MjModel) -> dict[str, Array]:
        """Of the jobs' starts: time (jobs,), qpos, qvel and act (jobs, ...)."""
        same = (model.nq, model.nv, model.na) == (self.base.nq, self.base.nv, self.base.na)
        states = [
            self.resting(job.state, job.model) if same else self._fitted_to(model, job)
            for job in jobs
        ]
        return {
            "time": np.array([job.window.start for job in jobs]),
            "qpos": np.stack([state.qpos for state in states]),
            "qvel": np.stack([state.qvel for state in states]),
            "act": np.stack([state.act for state in states]),
        }

    def resting(self, state: State, model: mujoco.MjModel, back: bool = False) -> State:
        """A state of the base model as this model rests on its tires; or `back` again.

        A wheel 3 mm smaller would otherwise begin every window with a fall of 3 mm.
        """
        if len(state.qpos) != self.base.nq:
            return state
        rests = [self._rest(m) for m in (self.base, model)]
        if rests[0] is rests[1]:
            return state
        return self.chair.lowered(state, *(rests[::-1] if back else rests))

    def _rest(self, model: mujoco.MjModel) -> Rest:
        key = self.chair.statics(model)
        if key not in self._rests:
            with installed():
                self._rests[key] = self.chair.rest(model)
        return self._rests[key]

    def _fitted_to(self, model: mujoco.MjModel, job: Job) -> State:
        """The base state in a model with more joints or activations."""
        out = State(model.qpos0.copy(), np.zeros(model.nv), np.zeros(model.na))
        base = self.base
        for j, name in enumerate(names.joints(model)):
            free = model.jnt_type[j] == mujoco.mjtJoint.mjJNT_FREE
            nq, nv = (7, 6) if free else (1, 1)
            q, v = model.jnt_qposadr[j], model.jnt_dofadr[j]
            if name in names.joints(base):
                k = names.joints(base).index(name)
                qb, vb = base.jnt_qposadr[k], base.jnt_dofadr[k]
                out.qpos[q : q + nq] = job.state.qpos[qb : qb + nq]
                out.qvel[v : v + nv] = job.state.qvel[vb : vb + nv]
            elif names.same(name, rider_sway.MOTION) and self.motions[job.window.run]:
                place, speed = self.motions[job.window.run](np.array([job.window.start]))  # type: ignore[misc,arg-type]
                out.qpos[q], out.qvel[v] = place[0], speed[0]
        controls = self.controls(model, job.window, 1)[0]
        known = names.actuators(base)
        for a, name in enumerate(names.actuators(model)):
            at, count = model.actuator_actadr[a], model.actuator_actnum[a]
            if at < 0:
                continue
            k = known.index(name) if name in known else -1
            if k >= 0 and base.actuator_actnum[k] == count:
                first = base.actuator_actadr[k]
                out.act[at : at + count] = job.state.act[first : first + count]
            else:
                out.act[at : at + count] = controls[a]
        return out

    def _sampled(self, model: mujoco.MjModel, window: Window, sensed: Array) -> Array:
        """Sensor data (steps, nsensordata) at the samples of the window, (rows, channels).

        Row k of the sensor data belongs to the state before step k.
        """
        time = self.study.runs[window.run].trial.time[window.rows]
        at = np.clip((time - window.start) / model.opt.timestep, 0.0, len(sensed) - 1.001)
        low = at.astype(int)
        share = (at - low)[:, None]
        index = self._columns(model)
        values = sensed[:, index]
        for i, name in enumerate(self.channels):
            if name.endswith(ANGLES):
                values[:, i] = np.unwrap(values[:, i])
        return np.asarray((1.0 - share) * values[low] + share * values[low + 1])

    def _columns(self, model: mujoco.MjModel) -> list[int]:
        if model.nsensordata not in self._places:
            found = {c.name: c.index for c in channels(model)}
            short = {base_name(n): i for n, i in found.items()}
            place = [found.get(c, short.get(c, 0)) for c in self.channels]
            self._places[model.nsensordata] = place
        return self._places[model.nsensordata]


def _given(run: Run) -> Iterator[Part]:
    """What of a run its simulation follows from: times, inputs, the rider's motion."""
    trial = run.trial
    yield trial.time
    if trial.inputs is not None:
        yield trial.inputs.time
    for columns in (trial.inputs.controls if trial.inputs is not None else {}, trial.other):
        for name, values in columns.items():
            yield name
            yield values


def residual(measured: Array, predicted: Array, channels: Sequence[str]) -> Array:
    """Measured minus predicted (rows, channels); angles that wrap stay within half a turn."""
    out = measured - predicted
    for i, name in enumerate(channels):
        if name.endswith(ANGLES):
            out[:, i] = (out[:, i] + np.pi) % (2.0 * np.pi) - np.pi
    return out


def _resized(force: Array | None, steps: int) -> Array:
    assert force is not None
    return (
        force[:steps] if len(force) >= steps else np.pad(force, ((0, steps - len(force)), (0, 0)))
    )


def _coasting(run: Run, model: mujoco.MjModel) -> mujoco.MjModel:
    """In a run without torque nothing is driven, so a drive's own braking is off."""
    if run.trial.inputs is not None:
        return model
    known = names.actuators(model)
    rear = [names.find(w, known, "actuator") for w in ("left_wheel", "right_wheel")]
    if not model.actuator_biasprm[rear].any():
        return model
    off = copy.copy(model)
    off.actuator_biasprm[rear] = 0.0
    return off


def _motion(run: Run) -> Callable[[Array], tuple[Array, Array]] | None:
    """The rider's motion and its speed (m, m/s) at any times, smoothed; None: not measured."""
    values: Mapping[str, Array] = run.trial.other
    if rider_sway.MOTION not in values:
        return None
    there = ~np.isnan(values[rider_sway.MOTION])
    time, place = run.trial.time[there], values[rider_sway.MOTION][there]
    if time.size < 8:
        return None
    rate = 1.0 / float(np.median(np.diff(time)))
    grid = np.arange(time[0], time[-1], 1.0 / rate)
    even = np.interp(grid, time, place)
    width = min(2 * max(2, round(SMOOTHING * rate)) + 1, 2 * ((even.size - 1) // 2) - 1)
    smooth = savgol_filter(even, width, 3) if width > 3 else even
    speed = np.gradient(smooth, grid)

    def at(when: Array) -> tuple[Array, Array]:
        return np.interp(when, grid, smooth), np.interp(when, grid, speed)

    return at
