"""The chair as given, and every column around it: effects, forces, what is only roughly known."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis import begin, candidates, force, linear, noise, nuisance, sensitivity
from mjchair.diagnosis import gap as gaps
from mjchair.diagnosis.candidates import Start
from mjchair.diagnosis.fitting import Bench, Fit, Fitted, nuisance_columns, refit
from mjchair.diagnosis.gap import Gap
from mjchair.diagnosis.linear import Reduced, System, Whitener
from mjchair.diagnosis.sensitivity import Column, Pulse
from mjchair.diagnosis.shooting import THREADS, Shooter
from mjchair.diagnosis.store import Store
from mjchair.diagnosis.study import Study
from mjchair.diagnosis.tracking import Track, track
from mjchair.effects.effect import Effect

Say = Callable[[str], None]
NEAR = 0.5  # prior standard deviations that columns of nuisances are good for
SEEN = 10.0  # sigmas that one standard deviation of a nuisance changes
FAR = 2.5  # prior standard deviations: a nuisance there is not what moved
AT_REST = 0.01  # m/s^2, bias of an accelerometer that was seen at rest


@dataclass
class Base:
    """A chair without any effect, and every column around it.

    Attributes:
      bench: with what. plain: the best such chair.
      fit, track: where effects are screened from: that chair, or the chair as given.
      nuisances: their columns, by name. columns: of effects and forces. starts: what the effects'
        columns mean. pulses, answers: forces in time and what they change.
      system, reduced: the linear algebra of them all.
    """

    bench: Bench
    track: Track
    nuisances: dict[str, Column]
    columns: dict[str, Column]
    starts: list[Start]
    pulses: list[Pulse]
    answers: list[NDArray[np.float64]]
    plain: Fitted
    fit: Fit
    system: System
    reduced: Reduced


def silent(_: str) -> None:
    """Say nothing."""


def prepare(
    study: Study, say: Say = silent, store: Store | None = None, threads: int = THREADS
) -> tuple[Bench, Track]:
    """Windows, their states, the noise, and what is only roughly known."""
    shooter = Shooter(study, store=store, threads=threads)
    found = noise.estimate(study)
    say("states along the runs")
    first = track(shooter, shooter.base, found)
    found = noise.refined(shooter, first, found)
    given = dict(study.nuisance)
    if any(begin.stops(run) for run in study.runs):  # at rest the accelerometer showed its bias
        given.setdefault("bias:imu_accelerometer.x", AT_REST)
    nuisances = nuisance.nuisances(study.channels, given)
    return Bench(shooter, found, nuisances, Whitener(shooter, found)), first


def screen_columns(
    bench: Bench, found: Track, effects: Sequence[Effect], say: Say = silent
) -> Base:
    """Every column around a chair without effects, and the linear algebra of them all."""
    shooter, given = bench.shooter, Fit(bench.nuisances)
    say("what is only roughly known")
    nuisances = nuisance_columns(bench, found, given)
    plain = refit(bench, given, found, nuisances)
    if _farthest(plain) > NEAR:
        plain = refit(bench, plain.fit, plain.track)
    fit, here = given, found
    # a nuisance far from its prior stands in for something else: then the chair as given is nearer
    if _farthest(plain) < FAR:
        fit, here, nuisances = plain.fit, plain.track, plain.columns
    say("answers to forces")
    pulses = sensitivity.pulses(shooter)
    answers = sensitivity.pulse_columns(shooter, here, pulses, fit.edit)
    columns, starts = candidates.collect(
        bench, here, fit, effects, pulses, answers, lambda key: say(f"effect {key}")
    )
    columns.update(force.driver_columns(bench, here, pulses, answers))
    system = bench.system(here, {**nuisances, **columns}, len(nuisances), fit)
    reduced = linear.reduce(system, bench.windows)
    return Base(
        bench, here, nuisances, columns, starts, pulses, answers, plain, fit, system, reduced
    )


def _farthest(plain: Fitted) -> float:
    """The largest distance of a nuisance from its prior, of those that the data see."""
    back = plain.system.back
    seen = np.sqrt(np.diag(plain.system.G.sum(axis=0)))[: len(back)] > SEEN
    return float(np.abs(back[seen]).max(initial=0.0))


def gap_after(base: Base, fitted: Fitted) -> tuple[Gap, System, Reduced]:
    """Test what a fit leaves, with its own parameters free."""
    bench = base.bench
    count = len(fitted.columns)
    terms = count - len(base.nuisances)
    system = bench.system(
        fitted.track, {**fitted.columns, **base.columns}, count, fitted.fit, free=terms
    )
    reduced = linear.reduce(system, bench.windows)
    keys = [t.effect.key for t in fitted.fit.terms]
    return gaps.test_gap(bench, system, reduced, keys), system, reduced
