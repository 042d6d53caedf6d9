"""What a chair shows that lacks nothing, computed otherwise: the null of the gap test.

In: a fit, and the gap that it leaves. Out: the gap once all tests are less by what an ensemble
shows: the same chair at half the step, with the other implicit integrator, and with what is only
roughly known drawn from what the data leave open, where it answers to that other than linearly. A
caster that turns over answers to all of these; a gap that is no larger is none.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator, Sequence
from dataclasses import replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis import rules
from mjchair.diagnosis.explain import gap as gaps
from mjchair.diagnosis.explain.gap import Gap, Subject
from mjchair.diagnosis.explain.screening import Base, gain, tested
from mjchair.diagnosis.fit import bounded
from mjchair.diagnosis.fit.column_ids import ColumnId, Otherwise, RoughlyKnown
from mjchair.diagnosis.fit.nonlinear import Fitted
from mjchair.diagnosis.replay.derivatives import Column
from mjchair.diagnosis.replay.sampling import residual
from mjchair.diagnosis.replay.simulator import Job
from mjchair.errors import MjchairError

Array = NDArray[np.float64]
DRAWS = 2  # chairs whose roughly known numbers are drawn
INTEGRATORS = {
    int(mujoco.mjtIntegrator.mjINT_IMPLICITFAST): mujoco.mjtIntegrator.mjINT_IMPLICIT,
    int(mujoco.mjtIntegrator.mjINT_IMPLICIT): mujoco.mjtIntegrator.mjINT_IMPLICITFAST,
}


def confirmed(base: Base, fitted: Fitted, gap: Gap, seed: int = 0) -> Gap:
    """The gap that a fit leaves above what the ensemble shows; the gap itself where it is clear.

    Args:
      gap: that `screening.gap_after` says of the fit. seed: of what is drawn.
    """
    if not gap.exists or not rules.may_be_of_the_null(gap.tests[0].sigmas):
        return gap
    answers = [
        answer
        for answer in _answers(base, fitted, np.random.default_rng(seed))
        if all(np.isfinite(window).all() for window in answer)  # else it does not simulate
    ]
    return gaps.above(gap, _shown(base, fitted, answers), gain(base, fitted))


def _shown(base: Base, fitted: Fitted, answers: Sequence[Column]) -> dict[Subject, float]:
    """The most that data which are off the fit by an answer show in every test.

    Args:
      answers: (rows, channels) a window.
    """
    if not answers:
        return {}
    channels = base.bench.simulator.channels
    columns: dict[ColumnId, Column] = {
        Otherwise(k): [residual(a, np.zeros_like(a), channels) for a in answer]
        for k, answer in enumerate(answers)
    }
    every, windows = tested(base, fitted, columns)
    skip = [t.effect.key for t in fitted.variant.terms]
    most: dict[Subject, float] = {}
    for k in range(len(columns)):
        system = every.of_data(k, len(columns))
        step = bounded.solve(system, base.bench.windows, [])[0][: system.nuisance]
        system.set_cells(step)
        for subject, chi2 in gaps.statistics(base.bench, system, windows, skip).items():
            most[subject] = max(chi2, most.get(subject, 0.0))
    return most


def _answers(base: Base, fitted: Fitted, rng: np.random.Generator) -> Iterator[list[Array]]:
    """By how much each member is off the chair of a fit, (rows, channels) a window."""
    simulator = base.bench.simulator
    model = simulator.compile(fitted.variant.edit)
    here = fitted.track.predicted
    for other in _computed_otherwise(model):
        yield _difference(_predicted(base, fitted, other), here)
    for _ in range(DRAWS):
        moves = _drawn(base, fitted, rng)
        offsets = {n: by + moves[n] for n, by in _offsets(fitted).items()}
        try:
            other = simulator.compile(replace(fitted.variant, offsets=offsets).edit)
        except MjchairError:
            continue  # no chair can be so
        columns = {n: fitted.columns[RoughlyKnown(n)] for n in moves}
        linear = [
            seen + sum((by * columns[n][i] for n, by in moves.items()), np.zeros_like(seen))
            for i, seen in enumerate(here)
        ]
        yield _difference(_predicted(base, fitted, other), linear)


def _computed_otherwise(model: mujoco.MjModel) -> Iterator[mujoco.MjModel]:
    """The model at half its step, and with the other implicit integrator."""
    half = copy.copy(model)
    half.opt.timestep *= 0.5
    yield half
    known = INTEGRATORS.get(int(model.opt.integrator))
    if known is not None:
        other = copy.copy(model)
        other.opt.integrator = known
        yield other


def _offsets(fitted: Fitted) -> dict[str, float]:
    """Where the roughly known numbers stand that are in the chair, in standard deviations."""
    variant = fitted.variant
    inside = [n.name for n in variant.nuisances if n.edit is not None and not n.linear]
    return {n: variant.offsets.get(n, 0.0) for n in inside if RoughlyKnown(n) in fitted.columns}


def _drawn(base: Base, fitted: Fitted, rng: np.random.Generator) -> dict[str, float]:
    """Moves of the roughly known numbers, in standard deviations, that the data leave open."""
    system = fitted.system
    cover = bounded.covariance(system, base.bench.windows)
    by = rng.multivariate_normal(np.zeros(len(cover)), cover)
    return {n: float(by[system.places[RoughlyKnown(n)]]) for n in _offsets(fitted)}


def _predicted(base: Base, fitted: Fitted, model: mujoco.MjModel) -> Column:
    """What a model shows in every window, from the states of the fit, (rows, channels) each."""
    simulator = base.bench.simulator
    errors = fitted.variant.sensor_errors(simulator.channels)
    jobs = [
        Job(model, w, state)
        for w, state in zip(simulator.windows, fitted.track.states, strict=True)
    ]
    return [
        errors.applied(simulator, job.window, outcome.predicted)
        for job, outcome in zip(jobs, simulator.run(jobs), strict=True)
    ]


def _difference(one: Column, other: Column) -> list[Array]:
    return [a - b for a, b in zip(one, other, strict=True)]
