"""A chair with its nuisances and effects at given values, and the nonlinear fit of those values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis import linear, sensitivity
from mjchair.diagnosis.linear import System, Whitener
from mjchair.diagnosis.noise import Noise
from mjchair.diagnosis.nuisance import Nuisance
from mjchair.diagnosis.observe import Observer
from mjchair.diagnosis.sensitivity import Column, Point
from mjchair.diagnosis.shooting import Shooter
from mjchair.diagnosis.tracking import Track, track
from mjchair.effects.effect import Effect, Values, clip
from mjchair.errors import MjchairError

Array = NDArray[np.float64]
ROUNDS = 6  # at most, of Gauss-Newton
DONE = 1.0  # chi2 that a further round must promise
WHERE = ("phase", "frequency", "x", "y", "radius")  # of an effect with a wave or a place
SENSOR = {"sensor_bias": "bias", "sensor_scale": "scale", "sensor_delay": "delay"}


@dataclass(frozen=True)
class Term:
    """An effect with its values; `free` are the parameters that a fit moves."""

    effect: Effect
    values: Values
    free: tuple[str, ...]


@dataclass(frozen=True)
class Fit:
    """A chair: nuisances in prior standard deviations, and effects.

    Attributes:
      nuisances: all of the study. offsets: name -> standard deviations, mechanical ones only.
      terms: the effects that are in it.
    """

    nuisances: tuple[Nuisance, ...]
    offsets: dict[str, float] = field(default_factory=dict)
    terms: tuple[Term, ...] = ()

    def edit(self, spec: mujoco.MjSpec) -> None:
        """Make the chair of the study's chair."""
        for n in self.nuisances:
            if n.edit is not None and self.offsets.get(n.name):
                n.edit(spec, self.offsets[n.name] * n.std)
        for term in self.terms:
            if term.effect.name not in SENSOR:
                term.effect.apply(spec, term.values)

    def observer(self, channels: Sequence[str]) -> Observer:
        """Its sensors."""
        found: dict[str, dict[str, float]] = {"bias": {}, "scale": {}, "delay": {}}
        for term in self.terms:
            if term.effect.name in SENSOR and term.effect.channel:
                kind = SENSOR[term.effect.name]
                found[kind][term.effect.channel] = term.values[kind]
        return Observer(channels, **found)


@dataclass
class Bench:
    """What every stage works with.

    Attributes:
      shooter: simulates. noise: of the channels. nuisances: of the study. whitener: of the noise.
    """

    shooter: Shooter
    noise: dict[str, Noise]
    nuisances: tuple[Nuisance, ...]
    whitener: Whitener

    @property
    def windows(self) -> NDArray[np.int64]:
        """Indices of the windows that may be fitted to."""
        fitted = set(self.shooter.study.fitted)
        return np.array([i for i, w in enumerate(self.shooter.windows) if w.run in fitted])

    def system(
        self, found: Track, columns: dict[str, Column], nuisance: int, fit: Fit, free: int = 0
    ) -> System:
        """The linear system around a track of the chair of `fit`; see `linear.build`."""
        return linear.build(
            self.shooter,
            found,
            columns,
            nuisance,
            self.whitener,
            self.windows,
            fit.offsets,
            free,
        )


def nuisance_columns(bench: Bench, found: Track, fit: Fit) -> dict[str, Column]:
    """Columns of all nuisances and of the two differences to a finer simulation."""
    mechanical = [n for n in bench.nuisances if n.edit is not None]
    points = [
        *sensitivity.nuisance_points(mechanical),
        Point(sensitivity.half_step, 1.5, fine=True),
        Point(sensitivity.other_integrator, 1.5, fine=True),
    ]
    observer = fit.observer(bench.shooter.channels)
    columns = sensitivity.differences(bench.shooter, found, points, fit.edit, observer)
    names = [*(n.name for n in mechanical), "half_step", "integrator"]
    out = dict(zip(names, columns, strict=True))
    late = bench.shooter.input_step() / np.sqrt(12.0)
    if late > 0.0 and found.coarse is not None:
        # a torque that changes between two samples changes anywhere between them
        model = bench.shooter.compile(fit.edit, coarse=True)
        shifted = sensitivity.predictions(bench.shooter, found, model, observer, late)
        out["input_timing"] = [a - b for a, b in zip(shifted, found.coarse, strict=True)]
    for n in bench.nuisances:
        if n.edit is None:
            out[n.name] = sensitivity.sensor_column(
                bench.shooter, found, "sensor_bias", n.channel, n.std
            )
    return out


def term_columns(bench: Bench, found: Track, fit: Fit) -> dict[str, Column]:
    """One column a free parameter of the fit's effects, in units of its typical change."""
    out: dict[str, Column] = {}
    points, names = [], []
    observer = fit.observer(bench.shooter.channels)
    for term in fit.terms:
        for name in term.free:
            key = f"{term.effect.key}.{name}"
            size = change(term.effect, name)
            if term.effect.name in SENSOR:
                out[key] = sensitivity.sensor_column(
                    bench.shooter, found, term.effect.name, str(term.effect.channel), size
                )
                continue
            beside, factor = nudged(fit, term, name)
            names.append(key)
            points.append(Point(beside.edit, factor))
    if points:
        # a point here is a whole chair, so nothing comes before its edit
        base = sensitivity.predictions(
            bench.shooter, found, bench.shooter.compile(fit.edit, coarse=True), observer
        )
        for key, point in zip(names, points, strict=True):
            model = bench.shooter.compile(point.edit, coarse=True)
            edited = sensitivity.predictions(bench.shooter, found, model, observer)
            out[key] = [point.factor * (e - y) for e, y in zip(edited, base, strict=True)]
    return {k: out[k] for t in fit.terms for k in (f"{t.effect.key}.{n}" for n in t.free)}


def change(effect: Effect, name: str) -> float:
    """The typical change of a parameter, away from neutral."""
    p = effect.parameter(name)
    typical = p.typical - p.neutral
    if abs(typical) > 0.0:
        return abs(typical)
    return {"Hz": 0.05, "rad": 0.3}.get(p.unit, 0.1)


def nudged(fit: Fit, term: Term, name: str) -> tuple[Fit, float]:
    """A fit with one parameter a little aside, and its typical change over that little."""
    size = change(term.effect, name)
    share = 0.25 * size
    p = term.effect.parameter(name)
    if not p.low <= term.values[name] + share <= p.high:
        share = -share
    values = {**term.values, name: term.values[name] + share}
    terms = tuple(Term(t.effect, values, t.free) if t is term else t for t in fit.terms)
    return Fit(fit.nuisances, fit.offsets, terms), size / share


@dataclass
class Fitted:
    """A fit with its track and the linear system around it.

    Attributes:
      fit, track: where the system is linear. columns: of nuisances and terms.
      system: nuisances first, then a column a free parameter.
      step: (p,) of the coefficients that stand in no fit, such as sensor biases; zero elsewhere.
      chi2: of the windows fitted to, with that step put in. total: their sum, with priors.
      promised: total after one more linear step. std: term key -> standard deviation, SI.
      sigmas: effect key -> how far its parameters together are from neutral, in standard errors.
      at_bound: parameters that ended on a bound.
    """

    fit: Fit
    track: Track
    columns: dict[str, Column]
    system: System
    step: Array
    chi2: Array
    total: float
    promised: float
    std: dict[str, float]
    sigmas: dict[str, float]
    at_bound: tuple[str, ...]


def refit(
    bench: Bench,
    start: Fit,
    before: Track | None,
    nuisances: dict[str, Column] | None = None,
    rounds: int = ROUNDS,
) -> Fitted:
    """Nonlinear fit of nuisances and effects within bounds: Gauss-Newton, steps halved that fail.

    Args:
      start: where to begin. before: a track of a chair that is not far.
      nuisances: columns to use throughout, with the answers to the slow state of `before`; None:
        both are made anew at `start`. The residual, which decides where the fit ends, is always
        new.
    """
    if nuisances is None:
        model, seen = bench.shooter.compile(start.edit), start.observer(bench.shooter.channels)
        before = track(bench.shooter, model, bench.noise, seen, before, anew=True)
        nuisances = nuisance_columns(bench, before, start)
    best = _around(bench, start, before, nuisances)
    fit = _moved(bench, best)
    for _ in range(rounds):
        if best.total - best.promised < DONE:
            break
        try:
            here = _around(bench, fit, best.track, nuisances)
        except MjchairError:  # of a step to what no chair can be
            fit = _between(best.fit, fit)
            continue
        if here.total < best.total:
            best, fit = here, _moved(bench, here)
        else:  # a step too far
            fit = _between(best.fit, fit)
    return best


def _around(
    bench: Bench,
    fit: Fit,
    before: Track | None,
    nuisances: dict[str, Column],
) -> Fitted:
    """A chair as it is, and the linear system around it."""
    shooter = bench.shooter
    seen = fit.observer(shooter.channels)
    model = shooter.compile(fit.edit)
    found = track(shooter, model, bench.noise, seen, before)
    columns = dict(nuisances)
    count = len(columns)
    columns.update(term_columns(bench, found, fit))
    system = bench.system(found, columns, count, fit)
    moving = {n.name for n in bench.nuisances if n.edit is not None}
    staying = [i for i, n in enumerate(system.names[:count]) if n not in moving]
    step, total = linear.stay(system, bench.windows, staying)
    covariance = linear.covariance(system, bench.windows)
    std, bound = {}, []
    for k, key in enumerate(system.names[count:], count):
        term, name = _term(fit, key)
        std[key] = float(np.sqrt(max(covariance[k, k], 0.0))) * change(term.effect, name)
        p = term.effect.parameter(name)
        if term.values[name] in (p.low, p.high) and not p.low == p.neutral == term.values[name]:
            bound.append(key)
    return Fitted(
        fit,
        found,
        columns,
        system,
        step,
        np.array([linear.chi2(system, i, step) for i in bench.windows]),
        total,
        linear.fit(system, bench.windows, range(count, len(system.names)))[1],
        std,
        {t.effect.key: _sigmas(t, system.names, covariance) for t in fit.terms},
        tuple(bound),
    )


def _between(one: Fit, other: Fit) -> Fit:
    """Half way from one fit to another of the same terms."""
    offsets = {n: 0.5 * (one.offsets.get(n, 0.0) + v) for n, v in other.offsets.items()}
    terms = tuple(
        Term(a.effect, {n: 0.5 * (v + b.values[n]) for n, v in a.values.items()}, a.free)
        for a, b in zip(one.terms, other.terms, strict=True)
    )
    return Fit(one.nuisances, offsets, terms)


def _sigmas(term: Term, names: Sequence[str], covariance: Array) -> float:
    """Significance of an effect's size: of its parameters together, times and places aside."""
    sized = [n for n in term.free if not (term.effect.tags and n in WHERE)]
    if not sized:
        return 0.0
    at = [names.index(f"{term.effect.key}.{n}") for n in sized]
    away = np.array(
        [
            (term.values[n] - term.effect.parameter(n).neutral) / change(term.effect, n)
            for n in sized
        ]
    )
    return float(np.sqrt(away @ np.linalg.solve(covariance[np.ix_(at, at)], away)))


def _term(fit: Fit, key: str) -> tuple[Term, str]:
    effect, _, name = key.rpartition(".")
    return next(t for t in fit.terms if t.effect.key == effect), name


def _moved(bench: Bench, found: Fitted) -> Fit:
    """The fit after the linear step, within walls and bounds."""
    terms = range(found.system.nuisance, len(found.system.names))
    step, _ = linear.fit(found.system, bench.windows, terms)
    return moved(found.fit, found.system, step)


def moved(fit: Fit, system: System, step: Array) -> Fit:
    """The fit after a step (p,) of the system's coefficients, within walls and bounds."""
    offsets = dict(fit.offsets)
    mechanical = {n.name for n in fit.nuisances if n.edit is not None}
    for name, by in zip(system.names[: system.nuisance], step, strict=False):
        if name in mechanical:
            offsets[name] = float(np.clip(offsets.get(name, 0.0) + by, -linear.WALL, linear.WALL))
    terms = []
    for term in fit.terms:
        values = dict(term.values)
        for name in term.free:
            by = step[system.names.index(f"{term.effect.key}.{name}")]
            p = term.effect.parameter(name)
            size = change(term.effect, name)
            limit = 0.3 * size if name in ("frequency",) else 1e9
            values[name] = clip(p, values[name] + float(np.clip(by * size, -limit, limit)))
        terms.append(Term(term.effect, values, term.free))
    return Fit(fit.nuisances, offsets, tuple(terms))
