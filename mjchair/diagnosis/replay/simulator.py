"""Windows simulated, many at once: predictions of every measured channel at every sample.

In: jobs, each a model with a window and its state. Out: predictions (rows, channels), and states
along the way where asked for.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis.data.standstill import rolls_at
from mjchair.diagnosis.data.study import Run, Study
from mjchair.diagnosis.data.windows import Window, cut
from mjchair.diagnosis.replay import strokes
from mjchair.diagnosis.replay.cache import Part, Store, digest
from mjchair.diagnosis.replay.chair_state import Chair, State
from mjchair.diagnosis.replay.measured_motion import motions
from mjchair.diagnosis.replay.sampling import beside, course, places, sampled
from mjchair.diagnosis.replay.state_transfer import StateCarrier
from mjchair.engine.install import installed
from mjchair.errors import MjchairError
from mjchair.measurement.sensors import sensor
from mjchair.model import moving_share
from mjchair.model.load import loaded
from mjchair.model.visual_geoms import without_visual_geoms
from mjchair.model.wheels import COMFORTABLE, check_timestep, cut_damping
from mjchair.rider import driven_joint
from mjchair.simulation import batch, names
from mjchair.simulation.undriven import undriven

Array = NDArray[np.float64]
NO_BODY = ("mjMINVAL", "A + B >= C")  # MuJoCo's words for it
FORCE = int(mujoco.mjtState.mjSTATE_QFRC_APPLIED)
# a chair alone has few geoms and is one island: without these its steps are equal to the bit, and
# take 6 % less time (median of 25 in turn, one thread)
NEEDLESS = int(mujoco.mjtDisableBit.mjDSBL_MIDPHASE | mujoco.mjtDisableBit.mjDSBL_ISLAND)
STATE = ("qpos", "qvel", "act")
COURSE = (*STATE, "sensordata")  # all that another simulation needs to go on from any step


@dataclass(frozen=True)
class Sofar:
    """How a simulation went up to a step, from which another of the same model goes on.

    Attributes:
      step: which. state: before it, of that very model. sensed: (step, nsensordata) so far.
    """

    step: int
    state: State
    sensed: Array


@dataclass
class Job:
    """One window of one model.

    Attributes:
      model: what is simulated, without the load of its run. window: which.
      state: at the window's start, of the base model.
      force: (steps, nv) generalized force on top, or None. late: s, by which inputs come later.
      sofar: how it went until the force began; None: it is simulated from the window's start.
    """

    model: mujoco.MjModel
    window: Window
    state: State
    force: Array | None = None
    late: float = 0.0
    sofar: Sofar | None = None

    @property
    def begin(self) -> int:
        """The first step that is simulated."""
        return 0 if self.sofar is None else self.sofar.step


@dataclass
class Outcome:
    """What a job gave: predictions (rows, channels), and states along the way where asked for."""

    predicted: Array
    trace: dict[str, Array] = field(default_factory=dict)


class WindowSimulator:
    """Simulates windows of a study's runs.

    Attributes:
      study, channels, windows: what is simulated. step: of the simulation, s.
      stepped: steps that were asked for so far, simulated or loaded.
      rolls: of every window, whether a channel shows that the chair rolls as it begins.
      turned: of every run, the measured angles that wrap, by channel, with their turns counted.
    """

    def __init__(
        self,
        study: Study,
        windows: Sequence[Window] | None = None,
        store: Store | None = None,
        threads: int = 0,
    ) -> None:
        """Cut the runs; simulations are kept in the store, where there is one."""
        self.store = store
        self.threads = threads
        self.stepped = 0
        self.study = study
        self.channels = study.channels
        self.spec = without_visual_geoms(study.spec)
        self.spec.option.disableflags |= NEEDLESS
        moving_share.remember(self.spec, study.spec)
        self.base = self.spec.copy().compile()
        self.chair = Chair(self.base)
        self.step = float(self.base.opt.timestep)
        if windows is None:
            windows = cut(study.runs, self.step, measured=study.driven_as_measured)
        self.windows = list(windows)
        self.rolls = self._rolling()
        self.coarse = self._coarse_step()
        self._places: dict[int, list[int]] = {}
        self.motions = [motions(run) | strokes.courses(run) for run in study.runs]
        self.turned = [self._turned(run) for run in study.runs]
        self.carrier = StateCarrier(self.base, self.chair)
        self.studied = digest(part for run in study.runs for part in _given(run))

    def _rolling(self) -> list[bool]:
        out = [False] * len(self.windows)
        for i, run in enumerate(self.study.runs):
            mine = [k for k, w in enumerate(self.windows) if w.run == i]
            shown = rolls_at(run.trial, np.array([self.windows[k].start for k in mine]))
            for k, rolls in zip(mine, shown, strict=True):
                out[k] = bool(rolls)
        return out

    def _turned(self, run: Run) -> dict[int, Array]:
        """The angles of a run that wrap, by place among the channels, with their turns counted."""
        known = run.trial.channels
        return {
            i: course(known[c])
            for i, c in enumerate(self.channels)
            if c in known and sensor(c).wraps
        }

    def _coarse_step(self) -> float:
        """Twice the step where the tires allow it: enough for differences of two simulations."""
        model = copy.copy(self.base)
        model.opt.timestep = 2.0 * self.step
        try:
            check_timestep(model)
        except MjchairError:
            return self.step
        return 2.0 * self.step

    def compile(self, edit: Callable[[mujoco.MjSpec], None] | None = None) -> mujoco.MjModel:
        """The base model, edited.

        Raises:
          MjchairError: the edit makes what no model can be.
        """
        spec = self.spec.copy()
        try:
            if edit is not None:
                edit(spec)
            return spec.compile()
        except MjchairError:
            raise
        except (ValueError, mujoco.FatalError) as error:
            line = " ".join(str(error).split())
            if any(words in line for words in NO_BODY):
                line = "no body can have the mass or the inertia that an effect asks for"
                raise MjchairError(line) from None
            raise MjchairError(f"an effect does not compile: {line}") from None

    def coarsened(self, model: mujoco.MjModel) -> mujoco.MjModel:
        """A copy at the coarse step, its tires stable also under more than their nominal load."""
        coarse = copy.copy(model)
        coarse.opt.timestep *= self.coarse / self.step
        cut_damping(coarse, above=COMFORTABLE)
        return coarse

    def without_motion(self, column: str | None) -> frozenset[int]:
        """Windows of the runs without a motion of this name, such as coasts.

        Args:
          column: name of the motion; None: no motion is asked for, and there is no such window.
        """
        if column is None:
            return frozenset()
        still = {k for k, known in enumerate(self.motions) if column not in known}
        return frozenset(i for i, w in enumerate(self.windows) if w.run in still)

    def input_step(self) -> float:
        """Median time between samples of the inputs, s; 0 where nothing is driven."""
        driven = [r.trial.inputs for r in self.study.runs if r.trial.inputs is not None]
        times = [inputs.samples(name)[0] for inputs in driven for name in inputs.controls]
        return max((float(np.median(np.diff(t))) for t in times if t.size > 1), default=0.0)

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
        time = np.asarray(window.start + float(model.opt.timestep) * np.arange(steps) - late)
        out = np.zeros((steps, model.nu))
        inputs = self.study.runs[window.run].trial.inputs
        known = names.actuators(model)
        if inputs is not None:
            out = inputs.control_array(model, time)
        for column, motion in self.motions[window.run].items():
            if column in known:
                a = known.index(column)
                out[:, a] = motion.place_at(
                    time + driven_joint.delay(model, int(model.actuator_trnid[a, 0]))
                )
        return out

    def _followed(self, model: mujoco.MjModel, joint: str, job: Job) -> tuple[float, float] | None:
        """Place and speed that the motions ask of a joint; None: none of them drives it."""
        mine = model.actuator_trntype == mujoco.mjtTrn.mjTRN_JOINT
        mine &= model.actuator_trnid[:, 0] == names.joints(model).index(joint)
        known, stiffness = names.actuators(model), -model.actuator_biasprm[mine, 1].sum()
        motions = self.motions[job.window.run]
        if stiffness <= 0.0 or not any(known[a] in motions for a in np.flatnonzero(mine)):
            return None
        place = speed = 0.0
        for a in np.flatnonzero(mine):
            if known[a] in motions:
                share = float(model.actuator_gainprm[a, 0] / stiffness)
                there = motions[known[a]].start(job.window.start - job.late)
                place, speed = place + share * there[0], speed + share * there[1]
        return place, speed

    def run(self, jobs: Sequence[Job], trace: Sequence[str] = ()) -> list[Outcome]:
        """Simulate the jobs, or load what the store kept of them; traces are not kept.

        Args:
          trace: what is asked for along the way, after each step, of COURSE.
        """
        self.stepped += sum(self.steps(job.model, job.window) - job.begin for job in jobs)
        if self.store is None or trace:
            return self._simulate(jobs, trace)
        key = self._key(jobs, self.store)
        predicted = self.store.load(key)
        if predicted is None:
            predicted = [outcome.predicted for outcome in self._simulate(jobs, trace)]
            self.store.save(key, predicted)
        return [Outcome(values) for values in predicted]

    def _key(self, jobs: Sequence[Job], store: Store) -> str:
        """Digest of all that the jobs' predictions follow from."""
        parts: list[Part] = [self.studied, self.step, *self.channels]
        models = {id(job.model): job.model for job in jobs}
        places = {name: k for k, name in enumerate(models)}
        for job in jobs:
            w, state = job.window, job.state
            parts += [places[id(job.model)], job.late, w.run, w.start, w.last, w.rows]
            parts += [state.qpos, state.qvel, state.act]
            parts.append(job.force if job.force is not None else "free")
            if job.sofar is not None:
                begun = job.sofar
                parts += [begun.step, begun.state.qpos, begun.state.qvel, begun.state.act]
                parts.append(begun.sensed)
        return store.key(models.values(), parts)

    def _simulate(self, jobs: Sequence[Job], trace: Sequence[str]) -> list[Outcome]:
        """Equal model sizes go together."""
        jobs = self._as_in_their_runs(jobs)
        outcomes: list[Outcome | None] = [None] * len(jobs)
        models = [job.model for job in jobs]
        apart = [(job.force is None, job.begin) for job in jobs]
        steps = [self.steps(job.model, job.window) for job in jobs]
        record = tuple(dict.fromkeys(("sensordata", *trace)))
        for chunk in batch.groups(models, steps, record, apart):
            with installed():
                done = self._chunk([jobs[i] for i in chunk], record, trace)
            for i, outcome in zip(chunk, done, strict=True):
                outcomes[i] = outcome
        return [o for o in outcomes if o is not None]

    def in_run(self, model: mujoco.MjModel, run: int) -> mujoco.MjModel:
        """The model as it was in a run: with the run's load, its drive off where nothing drove it.

        Where neither is other than in the model, it is the model itself.
        """
        made = self.study.runs[run]
        carries = model if made.load is None else loaded(model, made.load)
        return undriven(carries) if made.trial.inputs is None else carries

    def _as_in_their_runs(self, jobs: Sequence[Job]) -> list[Job]:
        known: dict[tuple[int, int], mujoco.MjModel] = {}
        for job in jobs:
            key = (id(job.model), job.window.run)
            if key not in known:
                known[key] = self.in_run(job.model, job.window.run)
        return [replace(job, model=known[id(job.model), job.window.run]) for job in jobs]

    def steps(self, model: mujoco.MjModel, window: Window) -> int:
        """Steps of a model from a window's start to past its end."""
        steps = int(np.ceil((window.last - window.start) / self.step)) + 3
        return int(np.ceil(steps * self.step / model.opt.timestep)) + 1

    def _chunk(self, jobs: list[Job], record: Sequence[str], trace: Sequence[str]) -> list[Outcome]:
        """Jobs of one model size and as many steps, that begin at the same step."""
        models = [job.model for job in jobs]
        model, begin = models[0], jobs[0].begin
        steps = self.steps(model, jobs[0].window)
        kept: dict[tuple[int, int, float, bytes], Array] = {}
        rows = []
        for job, m in zip(jobs, models, strict=True):
            key = (id(job.window), m.nu, job.late, m.actuator_user.tobytes())
            if key not in kept:
                kept[key] = self.controls(m, job.window, steps, job.late)
            rows.append(kept[key])
        control, what = np.stack(rows), batch.CONTROL
        if jobs[0].force is not None:
            forces = np.stack([_resized(j.force, steps) for j in jobs])
            control, what = np.concatenate([control, forces], axis=2), what | FORCE
        states, control = self._states(jobs, model), control[:, begin:]
        out, _ = batch.roll(models, states, control, what=what, record=record, threads=self.threads)
        done = []
        for i, job in enumerate(jobs):
            sensed = out["sensordata"][i]
            if job.sofar is not None:
                sensed = np.concatenate([job.sofar.sensed, sensed])
            predicted = self._sampled(model, job.window, sensed)
            done.append(Outcome(predicted, {k: out[k][i] for k in trace}))
        return done

    def _states(self, jobs: list[Job], model: mujoco.MjModel) -> dict[str, Array]:
        """Of the jobs' starts: time (jobs,), qpos, qvel and act (jobs, ...)."""
        states = [self._state_in(job) for job in jobs]
        return {
            "time": np.array([job.window.start + job.begin * model.opt.timestep for job in jobs]),
            "qpos": np.stack([state.qpos for state in states]),
            "qvel": np.stack([state.qvel for state in states]),
            "act": np.stack([state.act for state in states]),
        }

    def _state_in(self, job: Job) -> State:
        """The state where a job starts, in its own model."""
        if job.sofar is not None:
            return job.sofar.state
        state, new = self.carrier.into(job.model, job.state)
        for name, (q, v) in new.joints.items():
            followed = self._followed(job.model, name, job)
            if followed is not None:
                state.qpos[q], state.qvel[v] = followed
        if new.activations:
            controls = self.controls(job.model, job.window, 1)[0]
            for actuator, at in new.activations.items():
                state.act[at] = controls[actuator]
        return state

    def _sampled(self, model: mujoco.MjModel, window: Window, sensed: Array) -> Array:
        """Sensor data (steps, nsensordata) at the samples of the window, (rows, channels)."""
        if model.nsensordata not in self._places:
            self._places[model.nsensordata] = places(model, self.channels)
        values = sensed[:, self._places[model.nsensordata]]
        time = self.study.runs[window.run].trial.time[window.rows] - window.start
        out = sampled(values, model.opt.timestep, time, self.channels)
        for i, angle in self.turned[window.run].items():
            out[:, i] = beside(out[:, i], angle[window.rows])
        return out


def _given(run: Run) -> Iterator[Part]:
    """What of a run its predictions follow from: load, times, inputs, motion, counted turns."""
    trial = run.trial
    yield repr(run.load)
    yield trial.time
    if trial.inputs is not None:
        yield trial.inputs.time
        yield "hold" if trial.inputs.hold else "straight"
    for columns in (trial.inputs.controls if trial.inputs is not None else {}, trial.other):
        for name, values in columns.items():
            yield name
            yield values
    for name, values in trial.channels.items():
        if sensor(name).wraps:
            yield name
            yield values


def _resized(force: Array | None, steps: int) -> Array:
    assert force is not None
    return (
        force[:steps] if len(force) >= steps else np.pad(force, ((0, steps - len(force)), (0, 0)))
    )
