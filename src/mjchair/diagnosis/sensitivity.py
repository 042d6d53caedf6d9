"""How every prediction answers to a nuisance, an effect, or a force: one rollout a column."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis.chair import Chair
from mjchair.diagnosis.nuisance import Nuisance
from mjchair.diagnosis.observe import Observer, delayed
from mjchair.diagnosis.shooting import Job, Shooter, residual
from mjchair.diagnosis.tracking import Track
from mjchair.effects.effect import Effect, Seed, Values
from mjchair.engine.install import installed

Array = NDArray[np.float64]
Column = list[Array]  # (rows, channels) a window
FORCES = ("Fx", "Fy", "Mz", "left_wheel", "right_wheel")
UNITS = {"Fx": "N", "Fy": "N", "Mz": "N m", "left_wheel": "N m", "right_wheel": "N m"}
PULSES = {"Fx": 5.0, "Fy": 5.0, "Mz": 2.0, "left_wheel": 1.0, "right_wheel": 1.0}  # N or N m
KNOTS = {"Fx": 0.2, "Mz": 0.2, "Fy": 1.0, "left_wheel": 1.0, "right_wheel": 1.0}  # s apart


@dataclass(frozen=True)
class Point:
    """A model to compare with the base: an edit, and what its difference is multiplied by."""

    edit: Callable[[mujoco.MjSpec], None]
    factor: float = 1.0
    fine: bool = False


def differences(
    shooter: Shooter,
    track: Track,
    points: Sequence[Point],
    base_edit: Callable[[mujoco.MjSpec], None] | None = None,
    observer: Observer | None = None,
    progress: Callable[[int], None] | None = None,
) -> list[Column]:
    """Predictions of edited models minus the track's own, times the factors.

    Args:
      base_edit: what the track's model already has on top of the study's chair.
    """
    seen = observer or Observer(shooter.channels)
    columns = []
    with installed():
        if any(not point.fine for point in points):
            if track.coarse is None or seen != track.seen:
                base = shooter.compile(base_edit, coarse=True)
                track.coarse, track.seen = predictions(shooter, track, base, seen), seen
            coarse = track.coarse
        for point in points:

            def edit(spec: mujoco.MjSpec, point: Point = point) -> None:
                if base_edit is not None:
                    base_edit(spec)
                point.edit(spec)

            model = shooter.compile(edit, coarse=not point.fine)
            reference = track.predicted if point.fine else coarse
            edited = predictions(shooter, track, model, seen)
            change = [point.factor * (e - y) for e, y in zip(edited, reference, strict=True)]
            columns.append(_unwrapped(shooter, change))
            if progress is not None:
                progress(len(change))
    return columns


def predictions(
    shooter: Shooter,
    track: Track,
    model: mujoco.MjModel,
    observer: Observer,
    late: float = 0.0,
) -> Column:
    """What a model predicts from the states of a track, with its inputs `late` (s)."""
    jobs = [Job(model, w, s, late=late) for w, s in zip(shooter.windows, track.states, strict=True)]
    return [
        observer.observe(shooter, w, o.predicted)
        for w, o in zip(shooter.windows, shooter.run(jobs), strict=True)
    ]


def _unwrapped(shooter: Shooter, column: Column) -> Column:
    nothing = [np.zeros_like(c) for c in column]
    return [residual(c, n, shooter.channels) for c, n in zip(column, nothing, strict=True)]


def half_step(spec: mujoco.MjSpec) -> None:
    """Simulate with half the step."""
    spec.option.timestep = 0.5 * spec.option.timestep


def other_integrator(spec: mujoco.MjSpec) -> None:
    """Simulate with MuJoCo's semi-implicit Euler integrator."""
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_EULER


def sensor_column(shooter: Shooter, track: Track, kind: str, channel: str, size: float) -> Column:
    """What a bias (SI), a scale (1) or a delay (s) of one channel changes."""
    which = list(shooter.channels).index(channel)
    out = []
    for w, y in zip(shooter.windows, track.predicted, strict=True):
        column = np.zeros_like(y)
        if kind == "sensor_bias":
            column[:, which] = size
        elif kind == "sensor_scale":
            column[:, which] = size * y[:, which]
        else:
            time = shooter.study.runs[w.run].trial.time[w.rows]
            column[:, which] = delayed(time, y[:, which], size) - y[:, which]
        out.append(column)
    return out


def effect_points(effect: Effect, seed: Seed) -> list[Point]:
    """The models of a seed."""

    def edit(values: Values) -> Callable[[mujoco.MjSpec], None]:
        return lambda spec: effect.apply(spec, values)

    factors = seed.factors or (1.0,) * len(seed.points)
    return [Point(edit(v), f) for v, f in zip(seed.points, factors, strict=True)]


def nuisance_points(nuisances: Sequence[Nuisance]) -> list[Point]:
    """One standard deviation of each nuisance, from half of one."""

    def edit(n: Nuisance) -> Callable[[mujoco.MjSpec], None]:
        assert n.edit is not None
        change = n.edit
        return lambda spec: change(spec, 0.5 * n.std)

    return [Point(edit(n), 2.0) for n in nuisances if n.edit is not None]


@dataclass(frozen=True)
class Pulse:
    """A force that rises and falls about a time.

    Attributes:
      force: one of FORCES. window: index. time: of its peak, s. width: half of its base, s.
    """

    force: str
    window: int
    time: float
    width: float


def pulses(shooter: Shooter) -> list[Pulse]:
    """Triangular pulses that add up to one throughout every window, for every force."""
    found = []
    for i, w in enumerate(shooter.windows):
        for force in FORCES:
            count = max(2, round((w.last - w.first) / KNOTS[force]) + 1)
            times = np.linspace(w.first, w.last, count)
            found += [Pulse(force, i, float(t), float(times[1] - times[0])) for t in times]
    return found


def pulse_columns(
    shooter: Shooter,
    track: Track,
    found: Sequence[Pulse],
    base_edit: Callable[[mujoco.MjSpec], None] | None = None,
    progress: Callable[[int], None] | None = None,
) -> list[Array]:
    """What each pulse of one newton or newton metre changes in its own window, (rows, channels).

    Fx and Fy act along the chair's axes at the ground below the axle, Mz about its vertical, the
    wheels' torques about their axles.
    """
    chair = shooter.chair
    out = []
    model = shooter.compile(base_edit, coarse=True)
    with installed():
        reference = predictions(shooter, track, model, Observer(shooter.channels))
        for at in range(0, len(found), 64):
            group = found[at : at + 64]
            jobs = [
                Job(
                    model,
                    shooter.windows[p.window],
                    track.states[p.window],
                    _force(shooter, chair, track, p, float(model.opt.timestep)),
                )
                for p in group
            ]
            for p, o in zip(group, shooter.run(jobs), strict=True):
                change = (o.predicted - reference[p.window]) / PULSES[p.force]
                out.append(change)
            if progress is not None:
                progress(len(group))
    return out


def _force(shooter: Shooter, chair: Chair, track: Track, pulse: Pulse, step: float) -> Array:
    w = shooter.windows[pulse.window]
    steps = int(np.ceil(shooter.steps * shooter.step / step)) + 1
    every = max(1, round(step / shooter.step))
    time = w.start + step * np.arange(steps)
    shape = np.clip(1.0 - np.abs(time - pulse.time) / pulse.width, 0.0, None)
    if pulse.time - pulse.width < w.first:  # the first pulse acts from the start of the lead
        shape[time < pulse.time] = 1.0
    force = np.zeros((steps, shooter.base.nv))
    size = PULSES[pulse.force] * shape
    if pulse.force in ("Fx", "Fy"):
        x, y = headings(chair, track.trace[pulse.window]["qpos"])
        x, y = _fit(x[::every], steps), _fit(y[::every], steps)
        east, north = (x, y) if pulse.force == "Fx" else (-y, x)
        force[:, chair.dof] = size * east
        force[:, chair.dof + 1] = size * north
    elif pulse.force == "Mz":
        force[:, chair.dof + 5] = size
    else:
        force[:, chair.rear[("left_wheel", "right_wheel").index(pulse.force)][0]] = size
    return force


def _fit(values: Array, steps: int) -> Array:
    return (
        values[:steps] if len(values) >= steps else np.pad(values, (0, steps - len(values)), "edge")
    )


def headings(chair: Chair, qpos: Array) -> tuple[Array, Array]:
    """Cosine and sine of the heading along a trace (n, nq)."""
    w, x, y, z = (qpos[:, chair.qpos + 3 + k] for k in range(4))
    east, north = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z)
    size = np.hypot(east, north)
    return east / size, north / size
