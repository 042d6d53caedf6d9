"""How far a rival stays behind in a manoeuvre, however it is fitted again: T, in chi2.

In: manoeuvres rehearsed with the chosen chair, and the fit of a rival. Each manoeuvre is one more
window of the linear system around the rival; the difference that the rival makes is its residual.

Out: T, the least chi2 by which the two explanations differ.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis.explain.probability import SPREAD
from mjchair.diagnosis.fit import bounded
from mjchair.diagnosis.fit.bench import Bench
from mjchair.diagnosis.fit.column_ids import ColumnId, RoughlyKnown
from mjchair.diagnosis.fit.elimination import eliminate_window
from mjchair.diagnosis.fit.nonlinear import Fitted
from mjchair.diagnosis.fit.process import SLOW
from mjchair.diagnosis.fit.system import System
from mjchair.diagnosis.fit.variant import Term, Variant, nudged
from mjchair.diagnosis.next_experiment.rehearsal import Rehearsal, version
from mjchair.diagnosis.replay.derivatives import Column, Point, differences
from mjchair.diagnosis.replay.pulses import Force
from mjchair.diagnosis.replay.sampling import residual
from mjchair.effects.effect import Effect, SensorError
from mjchair.effects.effect import step as typical_step
from mjchair.errors import MjchairError

Array = NDArray[np.float64]
PHASE = math.pi / math.sqrt(3.0)  # rad, standard deviation of a phase that starts anew each run


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
    answers: dict[ColumnId, Column],
    doubts: dict[ColumnId, Column],
) -> Separated:
    """How far a rival stays behind in every manoeuvre, however it is fitted again.

    Args:
      answers: of the manoeuvres to nuisances and doubts. doubts: their columns in present data.
    """
    theirs, columns = _rival_columns(rehearsal, rival)
    system = _joint(bench, rival, doubts)
    _add(system, rehearsal, theirs, {**answers, **columns})
    terms = range(system.nuisance, len(system.columns))
    before = bounded.solve(system, [0], terms)
    least, steps = [], []
    for i in range(len(rehearsal.manoeuvres)):
        step, total = bounded.solve(system, [0, 1 + i], terms)
        least.append(max(total - before[1], 0.0))
        steps.append((step - before[0])[len(doubts) :])
    return Separated(np.array(least), np.array(steps))


def at_most(rehearsal: Rehearsal, rival: Fitted) -> Array:
    """What T (m,), chi2, is no more than: how far a rival differs that is not fitted again.

    Only the windows begin where they like, and nothing shakes the chair.
    """
    simulator = rehearsal.simulator
    (theirs,) = rehearsal.predict([version(rival)])
    out = np.zeros(len(rehearsal.manoeuvres))
    for i, w in enumerate(simulator.windows):
        miss = residual(rehearsal.shown[i], theirs[i], simulator.channels)
        nothing = np.zeros((*miss.shape, 0))
        window = eliminate_window(simulator, rehearsal.track, rehearsal.whitener, i, miss, nothing)
        out[w.run] += window.chi2
    return out


def _rival_columns(rehearsal: Rehearsal, rival: Fitted) -> tuple[Column, dict[ColumnId, Column]]:
    """What a rival's chair shows of every window, and how that answers to its parameters."""
    middle = version(rival)
    nudges = {
        key: nudged(middle.variant, term, parameter)
        for term in middle.variant.terms
        for key, parameter in term.parameters
    }
    aside = [replace(middle, variant=beside) for beside, _ in nudges.values()]
    theirs, *changed = rehearsal.predict([middle, *aside])
    channels = rehearsal.simulator.channels
    return theirs, {
        key: _change(column, theirs, channels, factor)
        for (key, (_, factor)), column in zip(nudges.items(), changed, strict=True)
    }


def _joint(bench: Bench, rival: Fitted, doubts: dict[ColumnId, Column]) -> System:
    """The present data as one window of a system around the rival's best chair, doubts first.

    Its slope is what the priors ask for, as at a best fit, and a doubt is about nothing in
    particular. The slope that a fit leaves where it ends is worth 0.6 of chi2, but with a doubt
    beside it whose own is left out it promised 120 to a manoeuvre that told nothing.
    """
    n = len(doubts)
    count = n + rival.system.nuisance
    columns = {**doubts, **rival.columns}
    system = bench.system(rival.track, columns, count, rival.variant)
    G = system.G[bench.windows].sum(axis=0)
    _forget(G, system, rival.variant)
    back = system.back + np.r_[np.zeros(n), rival.step[: rival.system.nuisance]]
    b = np.r_[back, np.zeros(len(system.columns) - count)]
    run = np.zeros(1, int)
    return replace(
        system, G=G[None], b=b[None], c=np.zeros(1), run=run, back=back, free=0, slow=[], cells=[]
    )


def _add(
    system: System, rehearsal: Rehearsal, theirs: Column, columns: dict[ColumnId, Column]
) -> None:
    """Every manoeuvre as one window more: the difference that the rival makes is its residual."""
    simulator = rehearsal.simulator
    m, p = len(rehearsal.manoeuvres), len(system.columns)
    G, b, c = np.zeros((m, p, p)), np.zeros((m, p)), np.zeros(m)
    for i, w in enumerate(simulator.windows):
        miss = residual(rehearsal.shown[i], theirs[i], simulator.channels)
        nothing = np.zeros_like(miss)
        known = [columns[n][i] if n in columns else nothing for n in system.columns]
        window = eliminate_window(
            simulator,
            rehearsal.track,
            rehearsal.whitener,
            i,
            miss,
            np.stack(known, axis=2),
            rehearsal.process,
        )
        G[w.run] += window.G
        b[w.run] += window.b
        c[w.run] += window.chi2
    system.G, system.b = np.concatenate([system.G, G]), np.concatenate([system.b, b])
    system.c, system.run = np.concatenate([system.c, c]), np.arange(m + 1)


def _forget(G: Array, system: System, variant: Variant) -> None:
    """Take from G (p, p) what is new in a run of another day, such as a phase."""
    for term in variant.terms:
        for key, parameter in term.parameters:
            if not parameter.each_run:
                continue
            k = system.places[key]
            size = max(float(G[k, k]), 1e-12)
            lean = G[:, k] / size
            G -= np.outer(lean, lean) * size
            G[k, k] = (parameter.change / PHASE) ** 2


def nuisance_answers(rehearsal: Rehearsal, chosen: Fitted) -> dict[ColumnId, Column]:
    """How the manoeuvres answer to one standard deviation of what is only roughly known.

    Taken around the chosen chair; near it they are the same for every rival. The differences to a
    finer simulation have none: what the present data say of them is only summed out.
    """
    middle, base = version(chosen), rehearsal.shown
    channels = rehearsal.simulator.channels
    moving = [n for n in chosen.variant.nuisances if n.edit is not None]
    aside = []
    for n in moving:
        offset = middle.variant.offsets.get(n.name, 0.0) + 0.5
        beside = replace(middle.variant, offsets={**middle.variant.offsets, n.name: offset})
        aside.append(replace(middle, variant=beside))
    out: dict[ColumnId, Column] = {
        RoughlyKnown(n.name): _change(column, base, channels, 2.0)
        for n, column in zip(moving, rehearsal.predict(aside), strict=True)
    }
    for n in chosen.variant.nuisances:
        if n.edit is None:
            which = np.array([float(c == n.channel) for c in channels])
            scaled = n.error == SensorError.SCALE
            out[RoughlyKnown(n.name)] = [
                n.std * which * (y if scaled else np.ones_like(y)) for y in base
            ]
    return out


class Doubts:
    """Columns of doubted effects in the present data, which are the same for all manoeuvres.

    Attributes:
      columns: of the present data. dropped: a line for each effect that this chair cannot have.
    """

    def __init__(self, bench: Bench, chosen: Fitted, effects: Sequence[Effect]) -> None:
        """Simulate each of them."""
        self.chosen = chosen
        self.effects: dict[ColumnId, Effect] = {}
        self.columns: dict[ColumnId, Column] = {}
        self.dropped: list[str] = []
        for effect in effects:
            key = RoughlyKnown(effect.key)
            try:
                self.columns[key] = doubt_column(bench, chosen, effect)
                self.effects[key] = effect
            except MjchairError as error:
                self._drop(effect, error)

    def answers(self, rehearsal: Rehearsal) -> dict[ColumnId, Column]:
        """Their columns in the manoeuvres, of those that the chair can have there."""
        out: dict[ColumnId, Column] = {}
        for key, effect in self.effects.items():
            try:
                out[key] = doubt_answer(rehearsal, self.chosen, effect)
            except MjchairError as error:
                self._drop(effect, error)
        return out

    def _drop(self, effect: Effect, error: MjchairError) -> None:
        self.dropped.append(f"{effect.key} was not doubted along: {error}")


def doubt_answer(rehearsal: Rehearsal, chosen: Fitted, effect: Effect) -> Column:
    """How the manoeuvres answer to a typical size of a doubted effect."""
    middle = version(chosen)
    terms = (*middle.variant.terms, _typical(effect))
    beside = replace(middle, variant=replace(middle.variant, terms=terms))
    (column,) = rehearsal.predict([beside])
    return _change(column, rehearsal.shown, rehearsal.simulator.channels, 1.0)


def doubt_column(bench: Bench, chosen: Fitted, effect: Effect) -> Column:
    """How the present data answer to it."""
    points = [Point(partial(effect.apply, values=_typical(effect).values))]
    simulator = bench.simulator
    errors = chosen.variant.sensor_errors(simulator.channels)
    (column,) = differences(simulator, chosen.track, points, chosen.variant.edit, errors)
    return column


def outside_answers(
    rehearsal: Rehearsal, chosen: Fitted, force: Force
) -> tuple[dict[ColumnId, Column], dict[ColumnId, Column]]:
    """Columns of a slow force of any course, in the manoeuvres and in the present data.

    The present data hold nothing of what it does in another run: their columns are zero, and in the
    manoeuvres it has the size that a force outside the library has beforehand.
    """
    pulses, shown = rehearsal.disturbed
    answers: dict[ColumnId, Column] = {}
    for i, w in enumerate(rehearsal.simulator.windows):
        which = [k for k, p in enumerate(pulses) if p.window == i and p.force == force]
        time = np.array([pulses[k].time for k in which])
        alike = np.exp(-np.abs(time[:, None] - time[None, :]) / SLOW)
        root = SPREAD[force] * np.linalg.cholesky(alike)
        courses = np.stack([shown[k] for k in which], axis=2) @ root
        for nth in range(len(which)):
            name = RoughlyKnown(f"outside:{w.index}:{nth}")
            if name not in answers:
                answers[name] = [np.zeros_like(y) for y in rehearsal.shown]
            answers[name][i] = courses[:, :, nth]
    nothing = [np.zeros_like(y) for y in chosen.track.predicted]
    return answers, dict.fromkeys(answers, nothing)


def _typical(effect: Effect) -> Term:
    sizes = {p.name: p.neutral + typical_step(p) for p in effect.fitted}
    return Term(effect, {**effect.neutral(), **sizes}, ())


def _change(column: Column, base: Column, channels: Sequence[str], factor: float) -> Column:
    pairs = zip(column, base, strict=True)
    return [factor * residual(y, there, channels) for y, there in pairs]
