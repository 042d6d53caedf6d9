"""Manoeuvres simulated before anyone makes them, as a study that has not been measured yet.

In: manoeuvres and a chair. Out: what the channels of this and of other chairs would show.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis.data.study import Run, Study
from mjchair.diagnosis.data.windows import Window
from mjchair.diagnosis.fit import process
from mjchair.diagnosis.fit.bench import Bench
from mjchair.diagnosis.fit.column_ids import RoughlyKnown
from mjchair.diagnosis.fit.nonlinear import Fitted, moved
from mjchair.diagnosis.fit.process import Process
from mjchair.diagnosis.fit.variant import Variant
from mjchair.diagnosis.fit.whitening import Whitener
from mjchair.diagnosis.next_experiment.manoeuvres import Manoeuvre, Setting
from mjchair.diagnosis.replay.chair_state import SLOW, State
from mjchair.diagnosis.replay.derivatives import Column
from mjchair.diagnosis.replay.pulses import Pulse, pulse_answers, pulses
from mjchair.diagnosis.replay.sensor_errors import SensorErrors
from mjchair.diagnosis.replay.simulator import STATE, Job, Outcome, WindowSimulator
from mjchair.diagnosis.replay.window_search import answers
from mjchair.diagnosis.replay.window_states import Track
from mjchair.effects.effect import SensorError
from mjchair.engine.install import installed
from mjchair.measurement.trial import Trial
from mjchair.simulation.initial import start

Array = NDArray[np.float64]
TIPPED = 0.8  # of the chair's up axis along the vertical: less is a chair that falls
FASTEST = 10.0  # m/s, beyond which it is no chair
# a chair that coasts backwards is not stable: what begins with 0.02 rad/s more may end elsewhere,
# and nobody can make such a run twice alike
NUDGE, GROWN = 0.02, 3.0  # rad/s; by how many times it may grow


@dataclass(frozen=True)
class Version:
    """A variant with its sensors.

    Attributes:
      bias, scale: channel -> SI or 1, those that stand in no variant.
    """

    variant: Variant
    bias: dict[str, float] = field(default_factory=dict)
    scale: dict[str, float] = field(default_factory=dict)

    @property
    def mechanics(self) -> tuple[object, ...]:
        """What its simulation depends on."""
        terms = [t for t in self.variant.terms if t.effect.sensor is None]
        values = tuple((t.effect.key, *sorted(t.values.items())) for t in terms)
        return tuple(sorted(self.variant.offsets.items())), values

    def sensor_errors(self, channels: Sequence[str]) -> SensorErrors:
        """Its sensors."""
        seen = self.variant.sensor_errors(channels)
        bias = {c: seen.bias.get(c, 0.0) + self.bias.get(c, 0.0) for c in channels}
        scale = {c: seen.scale.get(c, 0.0) + self.scale.get(c, 0.0) for c in channels}
        return replace(
            seen,
            bias={c: b for c, b in bias.items() if b},
            scale={c: s for c, s in scale.items() if s},
        )


def version(fitted: Fitted, further: Array | None = None) -> Version:
    """The chair of a fit at its best, or a step (p,) from there."""
    step = fitted.step if further is None else fitted.step + further
    system = fitted.system
    bias, scale = (
        {
            n.channel: n.std * float(step[system.places[RoughlyKnown(n.name)]])
            for n in fitted.variant.nuisances
            if not n.edit and n.error == error
        }
        for error in (SensorError.BIAS, SensorError.SCALE)
    )
    return Version(moved(fitted.variant, system, step), bias, scale)


class Rehearsal:
    """Manoeuvres as one chair would make them, cut into windows.

    Attributes:
      manoeuvres: that the chair comes through and would repeat; the first of all if it is none.
      any_possible: whether there is one. first: their states at the start.
      simulator: of their windows. whitener: of the noise that the study has.
      chair: that makes them. track: of it, from its own states.
    """

    def __init__(
        self, bench: Bench, setting: Setting, manoeuvres: Sequence[Manoeuvre], chair: Version
    ) -> None:
        """Simulate the manoeuvres."""
        self.manoeuvres = list(manoeuvres)
        self.chair = chair
        self.bench = bench
        self.known: dict[object, mujoco.MjModel] = {}
        self.threads = bench.simulator.threads
        self._plan(bench, setting)
        self.first = self._starts(chair)
        made = self._open_loop(chair, self.first)
        traces, again = [o.trace for o in made], self._nudged(chair)
        whole = [i for i in range(len(traces)) if self._possible(traces[i], again[i])]
        self.any_possible = bool(whole)
        whole = whole or [0]
        if len(whole) < len(traces):
            self.manoeuvres = [self.manoeuvres[i] for i in whole]
            self.first = [self.first[i] for i in whole]
            made = [made[i] for i in whole]
        # cut as they will be once they are measured: without what a chair does as it comes to rest
        self._plan(bench, setting, [o.predicted for o in made])
        self.whitener = Whitener(self.simulator, bench.noise)
        self.track = self._track(chair, [o.trace for o in made])

    def _plan(self, bench: Bench, setting: Setting, shown: Sequence[Array] = ()) -> None:
        """Cut the manoeuvres into windows; `shown` is what the channels show of each, if known."""
        source = bench.simulator.study
        every = _step(source)
        runs = tuple(
            _planned(source, setting, m, every, shown[i] if shown else None)
            for i, m in enumerate(self.manoeuvres)
        )
        study = replace(source, runs=runs)
        self.simulator = WindowSimulator(study, threads=self.threads)
        windows = [
            Window(i, 0, 0.0, 0.0, m.seconds, np.arange(runs[i].trial.time.size))
            for i, m in enumerate(self.manoeuvres)
        ]
        self.longer = WindowSimulator(study, windows, threads=self.threads)

    def model(self, chair: Version) -> mujoco.MjModel:
        """The chair's model, at the fine step: at the coarse one casters drift after a spin."""
        if chair.mechanics not in self.known:
            self.known[chair.mechanics] = self.simulator.compile(chair.variant.edit)
        return self.known[chair.mechanics]

    def _starts(self, chair: Version) -> list[State]:
        out = []
        with installed():
            for i, run in enumerate(self.simulator.study.runs):
                model = self.simulator.in_run(self.model(chair), i)
                data = start(model, run.initial)
                trace = {"qpos": data.qpos[None], "qvel": data.qvel[None], "act": data.act[None]}
                out.append(self.simulator.carrier.back(model, trace, 0))
        return out

    def _open_loop(self, chair: Version, states: Sequence[State]) -> list[Outcome]:
        """Whole runs, with their traces."""
        windows = self.longer.windows
        jobs = [Job(self.model(chair), w, s) for w, s in zip(windows, states, strict=True)]
        return self.longer.run(jobs, trace=STATE)

    def _nudged(self, chair: Version) -> list[dict[str, Array]]:
        """Traces of whole runs that start a little turning."""
        step = NUDGE * np.eye(len(SLOW))[SLOW.index("yaw_rate")]
        states = [self.simulator.chair.moved(s, step) for s in self.first]
        return [o.trace for o in self._open_loop(chair, states)]

    def _possible(self, trace: dict[str, Array], nudged: dict[str, Array]) -> bool:
        """Whether a chair stays upright, goes no faster than a chair, and would do it again."""
        q, v = self.simulator.chair.qpos, self.simulator.chair.dof
        x, y = trace["qpos"][:, q + 4], trace["qpos"][:, q + 5]
        upright = 1.0 - 2.0 * (x * x + y * y) > TIPPED
        slow = np.hypot(trace["qvel"][:, v], trace["qvel"][:, v + 1]) < FASTEST
        repeats = np.abs(nudged["qvel"][:, v + 5] - trace["qvel"][:, v + 5]) < GROWN * NUDGE
        return bool((upright & slow & repeats).all())

    def used(self, which: int) -> NDArray[np.bool_]:
        """Which samples of a manoeuvre a diagnosis uses, (samples,)."""
        out = np.zeros(self.simulator.study.runs[which].trial.time.size, bool)
        for w in self.simulator.windows:
            if w.run == which:
                out[w.rows] = True
        return out

    def whole(self, chair: Version, which: int) -> Array:
        """What the channels of a chair show of one whole manoeuvre, (samples, channels)."""
        window = self.longer.windows[which]
        job = Job(self.model(chair), window, self.first[which])
        outcome = self.longer.run([job])[0]
        seen = chair.sensor_errors(self.longer.channels)
        return seen.applied(self.longer, window, outcome.predicted)

    def _track(self, chair: Version, traces: Sequence[dict[str, Array]]) -> Track:
        simulator = self.simulator
        states = []
        for w in simulator.windows:
            model = simulator.in_run(self.model(chair), w.run)
            at = round(w.start / model.opt.timestep) - 1
            first = w.index == 0
            states.append(
                self.first[w.run] if first else simulator.carrier.back(model, traces[w.run], at)
            )
        jobs = [
            Job(self.model(chair), w, s) for w, s in zip(simulator.windows, states, strict=True)
        ]
        outcomes = simulator.run(jobs, trace=STATE)
        seen = chair.sensor_errors(simulator.channels)
        predicted = [
            seen.applied(simulator, w, o.predicted)
            for w, o in zip(simulator.windows, outcomes, strict=True)
        ]
        coarse = self._predict([chair], states)[0]
        slow = answers(
            simulator,
            simulator.coarsened(self.model(chair)),
            seen,
            dict(enumerate(states)),
            1.0,
            dict(enumerate(coarse)),
        )
        traces = [o.trace for o in outcomes]
        return Track(states, predicted, list(slow.values()), traces, coarse=coarse, seen=seen)

    @property
    def shown(self) -> Column:
        """What the channels of the chair show of every window, as `predict` tells it of others."""
        assert self.track.coarse is not None
        return self.track.coarse

    def predict(self, chairs: Sequence[Version]) -> list[Column]:
        """What each chair's channels show of every window, from the states of the track.

        At the coarse step, for differences of two chairs: windows are too short for casters to
        drift.
        """
        return self._predict(chairs, self.track.states)

    @cached_property
    def disturbed(self) -> tuple[list[Pulse], list[Array]]:
        """Pulses of the forces that disturb the chair, in every window, and their answers."""
        asked = [p for p in pulses(self.simulator) if p.force in process.SHAKEN]
        return asked, pulse_answers(self.simulator, self.track, asked, self.chair.variant.edit)

    @cached_property
    def process(self) -> Process | None:
        """What shakes the chair, at the mean level of the runs that were fitted to; or nothing."""
        known = self.bench.process
        if known is None:
            return None
        fitted = list(self.bench.simulator.study.fitted)
        runs = len(self.simulator.study.runs)
        levels = {
            part: np.full(runs, np.sqrt(np.mean(np.square(level[fitted]))))
            for part, level in known.levels.items()
        }
        made = process.first(self.simulator, self.track, *self.disturbed)
        return replace(made, levels=levels, wobbles=known.wobbles)

    def _predict(self, chairs: Sequence[Version], states: Sequence[State]) -> list[Column]:
        simulator = self.simulator
        different = {c.mechanics: c for c in chairs}
        models = [simulator.coarsened(self.model(c)) for c in different.values()]
        jobs = [
            Job(model, w, s)
            for model in models
            for w, s in zip(simulator.windows, states, strict=True)
        ]
        outcomes = iter(simulator.run(jobs))
        raw = {key: [next(outcomes).predicted for _ in simulator.windows] for key in different}
        return [
            [
                c.sensor_errors(simulator.channels).applied(simulator, w, y)
                for w, y in zip(simulator.windows, raw[c.mechanics], strict=True)
            ]
            for c in chairs
        ]


def _step(study: Study) -> float:
    """Median time between samples, s."""
    return float(np.median([np.median(np.diff(r.trial.time)) for r in study.runs]))


def _planned(
    study: Study, setting: Setting, manoeuvre: Manoeuvre, every: float, shown: Array | None
) -> Run:
    """A run of a manoeuvre, a sample `every` (s); nothing but zeros in channels not yet `shown`."""
    time = np.arange(0.0, manoeuvre.seconds, every)
    values = np.zeros((time.size, len(study.channels))) if shown is None else shown
    channels = {c: values[:, i].copy() for i, c in enumerate(study.channels)}
    trial = Trial(manoeuvre.name, time, channels, setting.inputs(manoeuvre), {})
    initial = setting.initial(manoeuvre)
    return Run(trial, manoeuvre.name, False, initial, frozenset(), manoeuvre.load)
