"""The next experiment: of all manoeuvres, the one that tells the hypotheses apart best.

Each manoeuvre is rehearsed with the chosen chair. What a rival's chair predicts differently counts
as far as the rival cannot make up for it: by the windows' initial states, by what is only roughly
known, and by its own parameters, both held by what the present data say of them. The chi2 that is
left, T, is by how much the rival's fit is expected to fall behind when the manoeuvre is added to
the data (T-optimality: Atkinson and Fedorov, Biometrika 62, 1975). What every chair has a little
of and the present runs may not show is doubted along, or a manoeuvre far from them would promise
what only the model says.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis import linear
from mjchair.diagnosis.fitting import Bench, Fit, Fitted, Term, change, nudged
from mjchair.diagnosis.linear import System
from mjchair.diagnosis.manoeuvres import Manoeuvre, possible, setting
from mjchair.diagnosis.rehearsal import Rehearsal, Version, version
from mjchair.diagnosis.sensitivity import Column, Point, differences
from mjchair.diagnosis.shooting import residual
from mjchair.effects import caster_friction, turning_scrub
from mjchair.effects.effect import Effect
from mjchair.effects.effect import step as typical_step

Array = NDArray[np.float64]
# effects that every chair has a little of, and that only turning shows
DOUBTS = (turning_scrub.EFFECT, caster_friction.EFFECT)
SMOOTH = 0.5  # s, over which a person would average a channel
# chi2, ten sigmas: T is linear, and above this a simple manoeuvre is worth more than a larger T
PLENTY = 100.0
PHASE = math.pi / math.sqrt(3.0)  # rad, standard deviation of a phase that starts anew each run


@dataclass(frozen=True)
class Experiment:
    """A manoeuvre and what it tells apart.

    Attributes:
      manoeuvre: which. separations: T against each rival, chi2.
    """

    manoeuvre: Manoeuvre
    separations: tuple[float, ...]

    @property
    def least(self) -> float:
        """T against the rival that it tells apart worst."""
        return min(self.separations)


@dataclass(frozen=True)
class Evidence:
    """Where a rival that did its best still differs most, over a whole manoeuvre.

    Attributes:
      channel: which. time: s from the start. chosen, rival: what it shows then, SI.
      noises: their difference over the channel's noise.
    """

    channel: str
    time: float
    chosen: float
    rival: float
    noises: float


@dataclass(frozen=True)
class Plan:
    """Experiments, best first.

    Attributes:
      chosen: name of the hypothesis that was rehearsed. rivals: names of the others.
      experiments: all. evidence: of the best, against each rival. torque: its largest, N m.
    """

    chosen: tuple[str, ...]
    rivals: tuple[str, ...]
    experiments: tuple[Experiment, ...]
    evidence: tuple[Evidence, ...]
    torque: float = 0.0

    @property
    def best(self) -> Experiment:
        """The manoeuvre whose smallest T is largest, or the simplest of those with plenty."""
        return self.experiments[0]


def plan(
    bench: Bench,
    chosen: Fitted,
    rivals: Sequence[Fitted],
    manoeuvres: Sequence[Manoeuvre] | None = None,
    doubts: Sequence[Effect] = DOUBTS,
) -> Plan:
    """Rehearse the manoeuvres and rank them by the smallest T over the rivals.

    Of those that separate by PLENTY, the one that stands first is taken, as the simplest.

    Args:
      bench: of the study. chosen: the chair that is rehearsed. rivals: at least one, each a fit.
      manoeuvres: to choose from, simplest first; None: all of the library that this lab can make.
      doubts: effects that may be there besides, at their typical size.
    """
    here = setting(bench.shooter.study)
    rehearsal = Rehearsal(bench, here, manoeuvres or possible(here), version(chosen))
    supposed = {t.effect.key for fitted in (chosen, *rivals) for t in fitted.fit.terms}
    doubted = [e for e in doubts if e.key not in supposed]
    answers = {**nuisance_answers(rehearsal, chosen), **doubt_answers(rehearsal, chosen, doubted)}
    seen = doubt_columns(bench, chosen, doubted)
    separated = [separation(rehearsal, bench, rival, answers, seen) for rival in rivals]
    found = [
        Experiment(m, tuple(float(s.least[i]) for s in separated))
        for i, m in enumerate(rehearsal.manoeuvres)
    ]
    order = sorted(range(len(found)), key=lambda i: (-min(found[i].least, PLENTY), i))
    best = order[0]
    evidence = [
        _evidence(rehearsal, bench, best, version(chosen), version(rival, s.steps[best]))
        for rival, s in zip(rivals, separated, strict=True)
    ]
    return Plan(
        tuple(distinct(chosen.fit, rival.fit) for rival in rivals),
        tuple(distinct(rival.fit, chosen.fit) for rival in rivals),
        tuple(found[i] for i in order),
        tuple(evidence),
        here.largest(rehearsal.manoeuvres[best]),
    )


def distinct(fit: Fit, other: Fit) -> str:
    """Names of the effects of a fit that the other does not have."""
    theirs = {t.effect.key for t in other.terms}
    mine = [t.effect.key for t in fit.terms if t.effect.key not in theirs]
    return " and ".join(mine) or "no further effect"


def nuisance_answers(rehearsal: Rehearsal, chosen: Fitted) -> dict[str, Column]:
    """How the manoeuvres answer to one standard deviation of what is only roughly known.

    Taken around the chosen chair; near it they are the same for every rival. The differences to a
    finer simulation have none: what the present data say of them is only summed out.
    """
    middle, base = version(chosen), rehearsal.track.predicted
    channels = rehearsal.shooter.channels
    moving = [n for n in chosen.fit.nuisances if n.edit is not None]
    aside = []
    for n in moving:
        offset = middle.fit.offsets.get(n.name, 0.0) + 0.5
        fit = replace(middle.fit, offsets={**middle.fit.offsets, n.name: offset})
        aside.append(replace(middle, fit=fit))
    out = {
        n.name: _change(column, base, channels, 2.0)
        for n, column in zip(moving, rehearsal.predict(aside), strict=True)
    }
    for n in chosen.fit.nuisances:
        if n.edit is None:
            which = np.array([float(c == n.channel) for c in channels])
            out[n.name] = [n.std * np.broadcast_to(which, y.shape) for y in base]
    return out


def doubt_answers(
    rehearsal: Rehearsal, chosen: Fitted, doubts: Sequence[Effect]
) -> dict[str, Column]:
    """How the manoeuvres answer to a typical size of each doubted effect."""
    middle, base = version(chosen), rehearsal.track.predicted
    beside = [
        replace(middle, fit=replace(middle.fit, terms=(*middle.fit.terms, _typical(e))))
        for e in doubts
    ]
    channels = rehearsal.shooter.channels
    columns = rehearsal.predict(beside)
    return {e.key: _change(y, base, channels, 1.0) for e, y in zip(doubts, columns, strict=True)}


def doubt_columns(bench: Bench, chosen: Fitted, doubts: Sequence[Effect]) -> dict[str, Column]:
    """How the present data answer to them."""
    points = [Point(partial(e.apply, values=_typical(e).values)) for e in doubts]
    observer = chosen.fit.observer(bench.shooter.channels)
    made = differences(bench.shooter, chosen.track, points, chosen.fit.edit, observer)
    return {e.key: column for e, column in zip(doubts, made, strict=True)}


def _typical(effect: Effect) -> Term:
    sizes = {p.name: p.neutral + typical_step(p) for p in effect.fitted}
    return Term(effect, {**effect.neutral(), **sizes}, ())


def _change(column: Column, base: Column, channels: Sequence[str], factor: float) -> Column:
    pairs = zip(column, base, strict=True)
    return [factor * residual(y, there, channels) for y, there in pairs]


@dataclass(frozen=True)
class Separated:
    """One rival in every manoeuvre.

    Attributes:
      least: (m,) T, chi2. steps: (m, p) of the rival's coefficients, by which it gets there.
    """

    least: Array
    steps: Array


def separation(
    rehearsal: Rehearsal,
    bench: Bench,
    rival: Fitted,
    answers: dict[str, Column],
    doubts: dict[str, Column],
) -> Separated:
    """How far a rival stays behind in every manoeuvre, however it is fitted again.

    Args:
      answers: of the manoeuvres to nuisances and doubts. doubts: their columns in present data.
    """
    theirs, columns = _rival_columns(rehearsal, rival)
    system = _joint(bench, rival, doubts)
    _add(system, rehearsal, theirs, {**answers, **columns})
    terms = range(system.nuisance, len(system.names))
    before = linear.fit(system, [0], terms)
    least, steps = [], []
    for i in range(len(rehearsal.manoeuvres)):
        step, total = linear.fit(system, [0, 1 + i], terms)
        least.append(max(total - before[1], 0.0))
        steps.append((step - before[0])[len(doubts) :])
    return Separated(np.array(least), np.array(steps))


def _rival_columns(rehearsal: Rehearsal, rival: Fitted) -> tuple[Column, dict[str, Column]]:
    """What a rival's chair shows of every window, and how that answers to its parameters."""
    middle = version(rival)
    nudges = {
        f"{t.effect.key}.{n}": nudged(middle.fit, t, n) for t in middle.fit.terms for n in t.free
    }
    aside = [replace(middle, fit=fit) for fit, _ in nudges.values()]
    theirs, *changed = rehearsal.predict([middle, *aside])
    channels = rehearsal.shooter.channels
    return theirs, {
        key: _change(column, theirs, channels, factor)
        for (key, (_, factor)), column in zip(nudges.items(), changed, strict=True)
    }


def _joint(bench: Bench, rival: Fitted, doubts: dict[str, Column]) -> System:
    """The present data as one window of a system around the rival's best chair, doubts first."""
    n = len(doubts)
    count = n + rival.system.nuisance
    columns = {**doubts, **rival.columns}
    system = bench.system(rival.track, columns, count, rival.fit)
    G = system.G[bench.windows].sum(axis=0)
    at = np.r_[np.zeros(n), rival.step]
    b = system.b[bench.windows].sum(axis=0) - G @ at
    b[:n] = 0.0  # a doubt is about nothing in particular
    _forget(G, b, system.names, rival.fit)
    back = system.back + at[:count]
    run = np.zeros(1, int)
    return replace(
        system, G=G[None], b=b[None], c=np.zeros(1), run=run, back=back, free=0, cells=[]
    )


def _add(system: System, rehearsal: Rehearsal, theirs: Column, columns: dict[str, Column]) -> None:
    """Every manoeuvre as one window more: the difference that the rival makes is its residual."""
    shooter, names = rehearsal.shooter, system.names
    m, p = len(rehearsal.manoeuvres), len(names)
    G, b, c = np.zeros((m, p, p)), np.zeros((m, p)), np.zeros(m)
    for i, w in enumerate(shooter.windows):
        miss = residual(rehearsal.track.predicted[i], theirs[i], shooter.channels)
        nothing = np.zeros_like(miss)
        J = np.stack([columns[n][i] if n in columns else nothing for n in names], axis=2)
        slow, precision = linear.slow_columns(shooter, rehearsal.track, i)
        seen = np.concatenate([miss[:, :, None], J, slow], axis=2)
        # what a chair that falls over shows separates nothing
        white = rehearsal.whitener(i, np.nan_to_num(seen, posinf=0.0, neginf=0.0))
        r, J, Z = white[:, 0], white[:, 1 : 1 + p], white[:, 1 + p :]
        Gi, bi, ci, _ = linear.eliminated(r, J, Z, precision)
        G[w.run] += Gi
        b[w.run] += bi
        c[w.run] += ci
    system.G, system.b = np.concatenate([system.G, G]), np.concatenate([system.b, b])
    system.c, system.run = np.concatenate([system.c, c]), np.arange(m + 1)


def _forget(G: Array, b: Array, names: Sequence[str], fit: Fit) -> None:
    """Take from G (p, p) and b (p,) what is new in a run of another day: a sway's phase."""
    for term in fit.terms:
        key = f"{term.effect.key}.phase"
        if not term.effect.tags.get("wave") or key not in names:
            continue
        k = names.index(key)
        size = max(float(G[k, k]), 1e-12)
        lean = G[:, k] / size
        b -= lean * b[k]
        G -= np.outer(lean, lean) * size
        G[k, k] = (change(term.effect, "phase") / PHASE) ** 2


def _evidence(
    rehearsal: Rehearsal, bench: Bench, which: int, chosen: Version, rival: Version
) -> Evidence:
    channels = rehearsal.shooter.channels
    ours, theirs = (rehearsal.whole(v, which) for v in (chosen, rival))
    time = rehearsal.shooter.study.runs[which].trial.time
    width = max(1, min(round(SMOOTH / float(time[1] - time[0])), time.size))
    mean = np.ones(width) / width
    noise = np.array([bench.noise[c].total for c in channels])
    apart = residual(theirs, ours, channels)
    apart, ours = (
        np.column_stack([np.convolve(v, mean, mode="valid") for v in values.T])
        for values in (apart, ours)
    )
    row, k = np.unravel_index(np.argmax(np.abs(apart) / noise), apart.shape)
    when = float(time[row : row + width].mean())
    value, by = float(ours[row, k]), float(apart[row, k])
    return Evidence(channels[k], when, value, value + by, abs(by) / float(noise[k]))
