"""Derivatives of every prediction by a nuisance or an effect: one rollout a column.

In: the states of the windows, and edits of the chair. Out: columns, the change of every predicted
sample.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis.replay.sampling import residual
from mjchair.diagnosis.replay.sensor_errors import SensorErrors, delayed
from mjchair.diagnosis.replay.simulator import Job, WindowSimulator
from mjchair.diagnosis.replay.window_states import Track
from mjchair.effects.effect import Effect, Seed, SensorError, Values
from mjchair.engine.install import installed

Array = NDArray[np.float64]
Column = list[Array]  # (rows, channels) a window


@dataclass(frozen=True)
class Point:
    """A model to compare with the base: an edit, and what its difference is multiplied by.

    Attributes:
      fine: whether it is compared at the fine step. whole: whether the edit makes the model of the
        study's chair by itself; False: on top of what the base has.
      unchanged: windows in which it changes nothing, which are not simulated.
    """

    edit: Callable[[mujoco.MjSpec], None]
    factor: float = 1.0
    fine: bool = False
    whole: bool = False
    unchanged: Collection[int] = ()


def differences(
    simulator: WindowSimulator,
    track: Track,
    points: Sequence[Point],
    base_edit: Callable[[mujoco.MjSpec], None] | None = None,
    errors: SensorErrors | None = None,
) -> list[Column]:
    """Predictions of edited models minus the track's own, times the factors.

    Args:
      base_edit: what the track's model already has on top of the study's chair.
    """
    seen = errors or SensorErrors(simulator.channels)
    columns = []
    with installed():
        if any(not point.fine for point in points):
            if track.coarse is None or seen != track.seen:
                base = simulator.compile(base_edit)
                track.coarse = predictions(simulator, track, base, seen, coarse=True)
                track.seen = seen
            coarse = track.coarse
        for point in points:

            def edit(spec: mujoco.MjSpec, point: Point = point) -> None:
                if base_edit is not None and not point.whole:
                    base_edit(spec)
                point.edit(spec)

            reference = track.predicted if point.fine else coarse
            model = simulator.compile(edit)
            known = {i: reference[i] for i in point.unchanged}
            edited = predictions(simulator, track, model, seen, coarse=not point.fine, known=known)
            change = [point.factor * (e - y) for e, y in zip(edited, reference, strict=True)]
            columns.append(_unwrapped(simulator, change))
    return columns


def predictions(
    simulator: WindowSimulator,
    track: Track,
    model: mujoco.MjModel,
    errors: SensorErrors,
    late: float = 0.0,
    coarse: bool = False,
    known: Mapping[int, Array] | None = None,
) -> Column:
    """What a model predicts from the states of a track, with its inputs `late` (s).

    Args:
      coarse: whether at the coarse step, for differences; not so in windows that are touchy.
      known: predictions of windows that are not simulated; None: of none.
    """
    rough = simulator.coarsened(model) if coarse else model
    out = dict(known or {})
    jobs = {
        i: Job(model if i in track.touchy else rough, w, s, late=late)
        for i, (w, s) in enumerate(zip(simulator.windows, track.states, strict=True))
        if i not in out
    }
    for i, outcome in zip(jobs, simulator.run(list(jobs.values())), strict=True):
        out[i] = errors.applied(simulator, simulator.windows[i], outcome.predicted)
    return [out[i] for i in range(len(simulator.windows))]


def _unwrapped(simulator: WindowSimulator, column: Column) -> Column:
    nothing = [np.zeros_like(c) for c in column]
    return [residual(c, n, simulator.channels) for c, n in zip(column, nothing, strict=True)]


def half_step(spec: mujoco.MjSpec) -> None:
    """Simulate with half the step."""
    spec.option.timestep = 0.5 * spec.option.timestep


def other_integrator(spec: mujoco.MjSpec) -> None:
    """Simulate with MuJoCo's semi-implicit Euler integrator."""
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_EULER


def sensor_column(
    simulator: WindowSimulator,
    predicted: Column,
    kind: SensorError,
    channel: str,
    size: float,
) -> Column:
    """What a bias (SI), a scale (1) or a delay (s) of one channel changes.

    Args:
      predicted: what the channels show before this error.
    """
    which = list(simulator.channels).index(channel)
    out = []
    for w, y in zip(simulator.windows, predicted, strict=True):
        column = np.zeros_like(y)
        if kind == SensorError.BIAS:
            column[:, which] = size
        elif kind == SensorError.SCALE:
            column[:, which] = size * y[:, which]
        else:
            time = simulator.study.runs[w.run].trial.time[w.rows]
            column[:, which] = delayed(time, y[:, which], size) - y[:, which]
        out.append(column)
    return out


def effect_points(simulator: WindowSimulator, effect: Effect, seed: Seed) -> list[Point]:
    """The models of a seed."""
    unchanged = simulator.without_motion(effect.measured)

    def edit(values: Values) -> Callable[[mujoco.MjSpec], None]:
        return lambda spec: effect.apply(spec, values)

    factors = seed.factors or (1.0,) * len(seed.points)
    return [
        Point(edit(v), f, unchanged=unchanged) for v, f in zip(seed.points, factors, strict=True)
    ]
