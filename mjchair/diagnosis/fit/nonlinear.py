"""The nonlinear fit of a variant of the chair: Gauss-Newton within walls and bounds.

In: a variant to begin at. Out: the best one found, with its track, the linear system around it and
its uncertainties. A fit never returns a variant that is worse than the one that it began at.

Why not `mujoco.minimize.least_squares`: on the same residuals it reaches the same chi2 (within 1.5
in the seven of eight fits of benchmarks/minimizers.py that converge), but it simulates 1.5 to 5.6
times as many windows. This fit keeps the columns of the roughly known numbers from where it began;
the library's differentiates all columns again in each iteration. From a toe that is 0.08 rad off,
neither converges.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from itertools import combinations
from operator import attrgetter

import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis.data.roughly_known import Nuisance
from mjchair.diagnosis.fit import bounded
from mjchair.diagnosis.fit.bench import Bench
from mjchair.diagnosis.fit.column_ids import ColumnId, ParameterId, RoughlyKnown
from mjchair.diagnosis.fit.parameter_columns import (
    columns_of,
    nuisance_columns,
    shared_columns,
    term_columns,
)
from mjchair.diagnosis.fit.system import System
from mjchair.diagnosis.fit.variant import Term, Variant
from mjchair.diagnosis.replay.derivatives import Column
from mjchair.diagnosis.replay.window_states import Track, track
from mjchair.effects.effect import clip
from mjchair.errors import MjchairError

Array = NDArray[np.float64]
ROUNDS = 12  # at most, of Gauss-Newton
ASTRAY = 2.0  # times the chi2 without effects, above which they are too large
FEW = 3  # of these, after which a fit that has gone astray is not followed
SHORTEST = 1.0 / 32.0  # of a step: where that fails as well, none is believed
SHORTER = (0.1, 0.5)  # of a step that fails: the least and the most that is tried next
LONGER = 2.0  # times the share of a step that brought something, for the next
NEARER = (0.3, 0.1, 0.03)  # of the way from a part of the effects to a start that fits worse
FAILS = 3  # steps in a row that bring nothing, after which a fit ends
ON_BOUND = 1e-3  # of the width between bounds: a line search may end this near one
DONE = 1.0  # chi2 that a further round must promise
ROUGH = 10.0  # chi2 promised, below which a fit ends where a round brings less than half of DONE


@dataclass(kw_only=True)
class Fitted:
    """A variant that was fitted, with its track and the linear system around it.

    Attributes:
      variant, track: where the system is linear. columns: of nuisances and terms.
      system: nuisances first, then a column a free parameter.
      step: (p,) of the coefficients that stand in no variant, such as sensor biases; zero
        elsewhere.
      chi2: of the windows fitted to, with that step put in. total: their sum, with priors.
      promised: total after one more linear step. std: parameter -> standard deviation, SI.
      sigmas: effect key -> how far its parameters together are from neutral, in standard errors.
      at_bound: parameters that ended on a bound.
      at_least: parameter -> least size, where far larger ones fit as well.
      correlation: of two parameters of one effect.
      confined: of the windows fitted to, `System.confined` together: what a chair costs, in chi2,
        that fits only for few of the ways in which its windows may begin.
      anew: the fit with everything made anew around this one, where that was made and is no better;
        None: it was not made.
    """

    variant: Variant
    track: Track
    columns: dict[ColumnId, Column]
    system: System
    step: Array
    chi2: Array
    total: float
    promised: float
    std: dict[ParameterId, float]
    sigmas: dict[str, float]
    at_bound: tuple[ParameterId, ...]
    at_least: dict[ParameterId, float] = field(default_factory=dict)
    correlation: dict[frozenset[ParameterId], float] = field(default_factory=dict)
    confined: float = 0.0
    anew: Fitted | None = None

    def std_of_difference(self, one: ParameterId, other: ParameterId) -> float:
        """Standard deviation of one parameter less another of the same effect, SI; 0: not fitted.

        Data often tell the difference of two sides far better than each of them.
        """
        together = self.correlation.get(frozenset((one, other)))
        if together is None:
            return 0.0
        a, b = self.std[one], self.std[other]
        return float(np.sqrt(max(a * a + b * b - 2.0 * together * a * b, 0.0)))

    @property
    def moved(self) -> list[tuple[Nuisance, float]]:
        """What is only roughly known, and by how many standard deviations the fit moved it.

        First what the variant has; then what stands in no chair: how tires give way, and sensors.
        """
        places = self.system.places
        added = [
            (n, sum(float(self.step[places[c]]) for c in columns_of(n) if c in places))
            for n in self.variant.nuisances
            if n.linear or n.channel
        ]
        return [*self.variant.known_roughly, *added]


@dataclass(frozen=True)
class Placed:
    """A variant with its track, and the chi2 of the windows fitted to, with priors."""

    variant: Variant
    track: Track
    total: float


def refit(
    bench: Bench,
    start: Variant,
    before: Track | None,
    nuisances: dict[ColumnId, Column] | None = None,
    rounds: int = ROUNDS,
    part: Fitted | None = None,
    reach: float = np.inf,
    nothing: float = np.inf,
) -> Fitted:
    """Nonlinear fit of nuisances and effects within bounds: Gauss-Newton with a line search.

    Args:
      start: where to begin. before: a track of a chair that is not far.
      nuisances: columns to use throughout, with the answers to the slow state of `before`; None:
        both are made anew at `start`. The residual, which decides where the fit ends, is always
        new.
      part: a fit of some of the effects; None: none is known. With more effects nothing fits worse,
        so a start that does is moved towards it, and a fit that still does after a few rounds has
        gone astray.
      nothing: chi2 of the best chair without effects. It stands for a part, where there is none and
        a start is ASTRAY times as bad.
      reach: chi2 that must be promised after a round; a fit that promises more ends there.

    Raises:
      MjchairError: `start` is no chair that can be: it does not compile, or its simulation fails.
    """
    simulator = bench.simulator
    anew = nuisances is None
    if nuisances is None:
        model, errors = simulator.compile(start.edit), start.sensor_errors(simulator.channels)
        before = track(simulator, model, bench.noise, errors, before, anew=True)
        nuisances = nuisance_columns(bench, before, start)
    nuisances = _beside(start, nuisances)
    here = placed(bench, start, before, nuisances)
    most = ASTRAY * nothing if part is None else part.total
    if here.total > most:
        here = _nearer(bench, here, part, most, before, nuisances)
    best = _around(bench, here, nuisances)
    variant = _after_linear_step(bench, best)
    share, fails = 1.0, 0  # of the linear step, that is tried
    for k in range(rounds):
        # columns that were made anew are followed once, however little they promise
        done = best.total - best.promised < DONE and not (anew and k == 0)
        behind = k > 0 and best.promised > reach and best.total <= most
        if done or behind or (k >= FEW and best.total > most):
            break
        try:
            here = placed(bench, variant, best.track, nuisances)
            if here.total < best.total:
                brought = best.total - here.total
                best, fails = _around(bench, here, nuisances, best.std), 0
                if brought < 0.5 * DONE and best.total - best.promised < ROUGH:
                    break
                share = min(LONGER * share, 1.0)
                variant = _between(best.variant, _after_linear_step(bench, best), share)
                continue
            shorter = _shorter(best, here.total, share)
        except (MjchairError, np.linalg.LinAlgError):  # of a step to what no chair can be
            shorter = SHORTER[1]
        fails += 1
        if share <= SHORTEST or fails == FAILS:
            break
        shorter = max(shorter, SHORTEST / share)
        share, variant = share * shorter, _between(best.variant, variant, shorter)
    return best


def _beside(variant: Variant, nuisances: Mapping[ColumnId, Column]) -> dict[ColumnId, Column]:
    """The columns of nuisances, of no size where an effect covers what they stand for.

    A column that is made once makes up for an effect that changes the same and is not where that
    column was made: torques 25 ms late came as 16.7 beside 6.5 of the timing of inputs.
    """
    covered = {RoughlyKnown(name) for term in variant.terms for name in term.effect.covers}
    return {
        n: [np.zeros_like(part) for part in column] if n in covered else column
        for n, column in nuisances.items()
    }


def _least(variant: Variant, part: Fitted | None) -> Variant:
    """A variant with the effects of a part of it, as they were fitted, and the others neutral."""
    known = {} if part is None else {id(term.effect): term for term in part.variant.terms}
    terms = tuple(
        replace(t, values=known[id(t.effect)].values) if id(t.effect) in known else _neutral(t)
        for t in variant.terms
    )
    offsets = variant.offsets if part is None else part.variant.offsets
    return replace(variant, offsets=offsets, terms=terms)


def _nearer(
    bench: Bench,
    here: Placed,
    part: Fitted | None,
    most: float,
    before: Track | None,
    nuisances: dict[ColumnId, Column],
) -> Placed:
    """A place between a start and less of its effects that fits as well as these, or the best.

    The size that linear algebra promises of an effect may be absurd: a tire without friction.

    Args:
      part: less of the effects, which fits better; None: none of them, and whether that fits better
        around this start is not known, so one place is tried. most: chi2 that is good enough.
    """
    least, far = _least(here.variant, part), here.variant
    for share in NEARER if part is not None else NEARER[:1]:
        try:
            there = placed(bench, _between(least, far, share), before, nuisances)
        except (MjchairError, np.linalg.LinAlgError):  # of what no chair can be
            continue
        here = min(here, there, key=attrgetter("total"))
        if here.total <= most:
            break
    return here


def _neutral(term: Term) -> Term:
    """The effect of no size, in the place and at the time where it is."""
    return replace(
        term,
        values=term.values
        | {p.name: p.neutral for p in term.effect.parameters if p.sized and p.name in term.free},
    )


def placed(
    bench: Bench,
    variant: Variant,
    before: Track | None,
    nuisances: Mapping[ColumnId, Column],
) -> Placed:
    """A variant as it is, with its chi2.

    Raises:
      MjchairError: it does not compile, or its simulation fails.
    """
    simulator = bench.simulator
    errors = variant.sensor_errors(simulator.channels)
    here = track(simulator, simulator.compile(variant.edit), bench.noise, errors, before)
    outside = {n: nuisances[n] for n in _outside(bench, nuisances)}
    _check_finite([here.predicted, *outside.values()], variant)
    system = bench.system(here, outside, len(outside), variant, only=bench.windows)
    total = bounded.solve_nuisances(system, bench.windows, range(len(outside)))[1]
    inside = set(map(RoughlyKnown, variant.offsets)) & (nuisances.keys() - outside.keys())
    return Placed(variant, here, total + sum(variant.offsets[n.name] ** 2 for n in inside))


def _around(
    bench: Bench,
    here: Placed,
    nuisances: dict[ColumnId, Column],
    known: Mapping[ParameterId, float] | None = None,
) -> Fitted:
    """The linear system around a variant.

    Args:
      known: standard errors of the parameters in the fit before; None: there is none.

    Raises:
      MjchairError: a variant beside it does not compile, or its simulation fails.
    """
    variant = here.variant
    columns = dict(nuisances)
    count = len(columns)
    columns.update(term_columns(bench, here.track, variant, known))
    columns.update(shared_columns(variant, columns))
    _check_finite(columns.values(), variant)
    system = bench.system(here.track, columns, count, variant)
    outside = system.index(_outside(bench, nuisances))
    step, _ = bounded.solve_nuisances(system, bench.windows, outside)
    system.set_cells(step[:count])  # of this very variant: nothing else of it is moved
    covariance = bounded.covariance(system, bench.windows)
    std = _standard_errors(variant, system, covariance)
    correlation = {}
    for term in variant.terms:
        for (one, p), (other, q) in combinations(term.parameters, 2):
            together = covariance[system.places[one], system.places[other]] * p.change * q.change
            sizes = max(std[one] * std[other], 1e-300)
            correlation[frozenset((one, other))] = float(together / sizes)
    terms = range(count, len(system.columns))
    return Fitted(
        variant=variant,
        track=here.track,
        columns=columns,
        system=system,
        step=step,
        chi2=np.array([bounded.chi2(system, i, step) for i in bench.windows]),
        total=here.total,
        promised=bounded.solve(system, bench.windows, terms)[1],
        std=std,
        sigmas={t.effect.key: _sigmas(t, system, covariance) for t in variant.terms},
        at_bound=tuple(key for term in variant.terms for key in on_bound(term)),
        correlation=correlation,
        confined=float(system.confined[bench.windows].sum()),
    )


def from_other_side(bench: Bench, fitted: Fitted) -> dict[ParameterId, float]:
    """Standard errors with columns that are taken to smaller values instead of to larger ones.

    Where a caster is about to lift, or a wheel to slide, a column to one side is of a motion that
    the other side does not have.

    Raises:
      MjchairError: a variant beside the fit does not compile, or its simulation fails.
    """
    variant, columns = fitted.variant, dict(fitted.columns)
    columns.update(term_columns(bench, fitted.track, variant, fitted.std, side=-1.0))
    columns.update(shared_columns(variant, columns))
    _check_finite(columns.values(), variant)
    count = fitted.system.nuisance
    system = bench.system(fitted.track, columns, count, variant, only=bench.windows)
    return _standard_errors(variant, system, bounded.covariance(system, bench.windows))


def _standard_errors(
    variant: Variant, system: System, covariance: Array
) -> dict[ParameterId, float]:
    """Standard errors of the free parameters, SI."""
    return {
        key: math.sqrt(max(covariance[system.places[key], system.places[key]], 0.0)) * p.change
        for term in variant.terms
        for key, p in term.parameters
    }


def _check_finite(columns: Iterable[Column], variant: Variant) -> None:
    """Refuse a variant whose simulation fails."""
    if not all(np.isfinite(window).all() for column in columns for window in column):
        keys = " and ".join(t.effect.key for t in variant.terms) or "no effect"
        raise MjchairError(f"the chair with {keys} does not simulate: a prediction is not finite")


def _outside(bench: Bench, nuisances: Iterable[ColumnId]) -> list[ColumnId]:
    """The nuisances that stand in no variant, such as sensor biases."""
    inside = {RoughlyKnown(n.name) for n in bench.nuisances if n.edit is not None and not n.linear}
    return [column for column in nuisances if column not in inside]


def on_bound(term: Term) -> list[ParameterId]:
    """The sizes of an effect that lie on a bound which is not where the effect is not there."""
    return [key for key in at_end(term) if term.effect.parameter(key.parameter).sized]


def held_by_bounds(fitted: Fitted) -> list[ParameterId]:
    """The sizes that ended on a bound, but for those than which far larger ones fit as well."""
    return [key for key in fitted.at_bound if key not in fitted.at_least]


def open_upwards(fitted: Fitted) -> set[str]:
    """Keys of the effects of which far larger sizes fit as well."""
    return {parameter.effect for parameter in fitted.at_least}


def at_end(term: Term) -> list[ParameterId]:
    """The parameters of an effect that lie on a bound, but for where the effect is not there."""
    out = []
    for key, p in term.parameters:
        value, near = term.values[p.name], ON_BOUND * (p.high - p.low)
        ends = [bound for bound in (p.low, p.high) if bound != p.neutral]
        if any(abs(value - bound) <= near for bound in ends):
            out.append(key)
    return out


def _shorter(best: Fitted, total: float, share: float) -> float:
    """How much of a step to try next that led to `total`, which is no better than the best.

    Where the parabola has its least value that begins as the linear fit promises and goes through
    what was found.

    Args:
      share: of the linear step, that was tried.
    """
    slope = share * (best.total - best.promised)
    return float(np.clip(slope / max(total - best.total + 2.0 * slope, 1e-9), *SHORTER))


def _between(one: Variant, other: Variant, share: float) -> Variant:
    """This much of the way from one variant to another of the same terms."""
    rest = 1.0 - share
    offsets = {n: rest * one.offsets.get(n, 0.0) + share * v for n, v in other.offsets.items()}
    terms = tuple(
        replace(a, values={n: rest * v + share * b.values[n] for n, v in a.values.items()})
        for a, b in zip(one.terms, other.terms, strict=True)
    )
    return replace(one, offsets=offsets, terms=terms)


def _sigmas(term: Term, system: System, covariance: Array) -> float:
    """Significance of an effect's sizes together, with what only shapes it as it is.

    Without an effect its time, its place or its drag area means nothing, so it is no part of the
    question whether the effect is there, however little it may be known.
    """
    at = system.index([key for key, _ in term.parameters])
    away = np.array(
        [(term.values[p.name] - p.neutral) / p.change * p.sized for _, p in term.parameters]
    )
    if not away.any():
        return 0.0
    return float(np.sqrt(away @ np.linalg.solve(covariance[np.ix_(at, at)], away)))


def _after_linear_step(bench: Bench, fitted: Fitted) -> Variant:
    """The variant after the linear step, within walls and bounds."""
    terms = range(fitted.system.nuisance, len(fitted.system.columns))
    step, _ = bounded.solve(fitted.system, bench.windows, terms)
    return moved(fitted.variant, fitted.system, step)


def moved(variant: Variant, system: System, step: Array) -> Variant:
    """The variant after a step (p,) of the system's coefficients, within walls and bounds."""
    offsets = dict(variant.offsets)
    for n in variant.nuisances:
        if n.edit is not None and not n.linear:
            by = step[system.places[RoughlyKnown(n.name)]]
            there = offsets.get(n.name, 0.0) + by
            offsets[n.name] = float(np.clip(there, -bounded.WALL, bounded.WALL))
    terms = []
    for term in variant.terms:
        values = dict(term.values)
        for key, p in term.parameters:
            by = float(step[system.places[key]]) * p.change
            values[p.name] = clip(p, values[p.name] + float(np.clip(by, -p.cautious, p.cautious)))
        terms.append(replace(term, values=values))
    return replace(variant, offsets=offsets, terms=tuple(terms))
