"""The next experiment: of all manoeuvres, the one that tells the hypotheses apart best.

In: the fit of the chosen effects and those of its rivals. Out: a `Plan`. Each manoeuvre is
rehearsed with the chosen chair. What a rival's chair predicts differently counts as far as the
rival cannot make up for it: by the windows' initial states, by what is only roughly known, and by
its own parameters, both held by what the present data say of them. The chi2 that is left, T, is by
how much the rival's fit is expected to fall behind when the manoeuvre is added to the data
(T-optimality: Atkinson and Fedorov, Biometrika 62, 1975). Effects that every chair has a little of,
and that the present runs may not show, are assumed as possible besides: otherwise a manoeuvre far
from the present ones would promise what only the model says.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis.fit.bench import Bench
from mjchair.diagnosis.fit.column_ids import ColumnId
from mjchair.diagnosis.fit.nonlinear import Fitted
from mjchair.diagnosis.fit.variant import Variant
from mjchair.diagnosis.next_experiment.manoeuvres import Manoeuvre, possible, setting
from mjchair.diagnosis.next_experiment.rehearsal import Rehearsal, Version, version
from mjchair.diagnosis.next_experiment.separation import (
    Doubts,
    Separated,
    nuisance_answers,
    outside_answers,
    separation,
)
from mjchair.diagnosis.replay.derivatives import Column
from mjchair.diagnosis.replay.pulses import Force
from mjchair.diagnosis.replay.sampling import residual
from mjchair.effects.effect import Effect
from mjchair.effects.library import library
from mjchair.errors import MjchairError

Array = NDArray[np.float64]
SMOOTH = 0.5  # s, over which a person would average a channel
# a force of any course that no effect makes
OUTSIDE = {
    Force.FORWARD: "a force along the way from outside the library",
    Force.YAW: "a turning moment from outside the library",
}
ENOUGH = 9.0  # chi2, three sigmas, that decide
# chi2, ten sigmas, or three times what is needed: T is linear, and above this a simple manoeuvre is
# worth more than a larger T
PLENTY, MARGIN = 100.0, 3.0


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
      experiments: all. evidence: of the best, against each rival; None: a force has none.
      torque: its largest, N m.
      dropped: a line for each rival or doubt that this chair cannot have.
      run: of the study, from whose place and heading the manoeuvres start.
      needed: T against each rival that decides, chi2.
    """

    chosen: tuple[str, ...]
    rivals: tuple[str, ...]
    experiments: tuple[Experiment, ...]
    evidence: tuple[Evidence | None, ...]
    torque: float = 0.0
    dropped: tuple[str, ...] = ()
    run: str = ""
    needed: tuple[float, ...] = ()

    @property
    def best(self) -> Experiment:
        """The manoeuvre whose smallest T is largest, or the simplest of those with plenty."""
        return self.experiments[0]


def plan(
    bench: Bench,
    chosen: Fitted,
    rivals: Sequence[Fitted],
    manoeuvres: Sequence[Manoeuvre] | None = None,
    doubts: Sequence[Effect] | None = None,
    needed: Sequence[float] | None = None,
) -> Plan:
    """Rehearse the manoeuvres and rank them by the smallest T over the rivals.

    Of those that separate by PLENTY, and by MARGIN times what is needed, the one that stands first
    is taken, as the simplest.

    Args:
      bench: of the study. chosen: the chair that is rehearsed.
      rivals: each a fit; none: the chosen effects are held against a force outside the library.
      manoeuvres: to choose from, simplest first; None: all of the library that this lab can make.
      doubts: effects that may be there besides, at their typical size; None: those of the library
        that every chair has a little of.
      needed: T against each rival that rules it out, chi2; None: three sigmas.

    Raises:
      MjchairError: the chosen chair cannot be rehearsed, or no rival can.
    """
    here = setting(bench.simulator.study)
    made = manoeuvres or telling(possible(here), [chosen.variant, *(r.variant for r in rivals)])
    rehearsal = Rehearsal(bench, here, made, version(chosen))
    doubted = Doubts(bench, rehearsal, chosen, _doubted(chosen, rivals, doubts))
    answers = {**nuisance_answers(rehearsal, chosen), **doubted.answers}
    kept: list[_Against] = []
    dropped = list(doubted.dropped)
    for rival, enough in zip(rivals, needed or [ENOUGH] * len(rivals), strict=True):
        ours, theirs = (
            distinct(chosen.variant, rival.variant),
            distinct(rival.variant, chosen.variant),
        )
        try:
            far = separation(rehearsal, bench, rival, answers, doubted.columns)
        except (MjchairError, np.linalg.LinAlgError) as error:
            dropped.append(f"{theirs} was not rehearsed: {error}")
            continue
        kept.append(_Against(ours, theirs, enough, far, rival))
    if not rivals:
        kept = _forces(bench, rehearsal, chosen, answers, doubted)
    if not kept:
        raise MjchairError("no experiment can be planned: " + "; ".join(dropped))
    experiments = [
        Experiment(m, tuple(float(k.far.least[i]) for k in kept))
        for i, m in enumerate(rehearsal.manoeuvres)
    ]
    needs = [k.needed for k in kept]
    order = sorted(range(len(experiments)), key=lambda i: (-_share(experiments[i], needs), i))
    best = order[0]
    rehearsed = version(chosen)
    evidence = [
        None
        if k.rival is None
        else _evidence(rehearsal, bench, best, rehearsed, version(k.rival, k.far.steps[best]))
        for k in kept
    ]
    return Plan(
        chosen=tuple(k.chosen for k in kept),
        rivals=tuple(k.name for k in kept),
        experiments=tuple(experiments[i] for i in order),
        evidence=tuple(evidence),
        torque=here.largest(rehearsal.manoeuvres[best]),
        dropped=tuple(dropped),
        run=here.run,
        needed=tuple(needs),
    )


def telling(manoeuvres: Sequence[Manoeuvre], chairs: Sequence[Variant]) -> list[Manoeuvre]:
    """The manoeuvres, without standing still where no error of a sensor is asked about.

    A chair that stands shows no force but in how it settles, which is an assumption of every model:
    a run that was proposed, and made, drew 81 % for what was there to 21.
    """
    sensors = any(t.effect.sensor is not None for chair in chairs for t in chair.terms)
    return [m for m in manoeuvres if sensors or not m.stands]


@dataclass(frozen=True)
class _Against:
    """A rival in every manoeuvre.

    Attributes:
      chosen, name: of what is chosen and of the rival. needed: T that rules it out, chi2.
      far: how far it stays behind. rival: its fit; None: a force of any course.
    """

    chosen: str
    name: str
    needed: float
    far: Separated
    rival: Fitted | None


def _forces(
    bench: Bench,
    rehearsal: Rehearsal,
    chosen: Fitted,
    answers: dict[ColumnId, Column],
    doubted: Doubts,
) -> list[_Against]:
    """The chosen effects against a force that no effect makes, in their place."""
    nothing = replace(chosen.variant, terms=())
    name = distinct(chosen.variant, nothing)
    out = []
    for force, words in OUTSIDE.items():
        further, columns = outside_answers(rehearsal, chosen, force)
        far = separation(
            rehearsal,
            bench,
            replace(chosen, variant=nothing),
            {**answers, **further},
            {**doubted.columns, **columns},
        )
        out.append(_Against(name, words, ENOUGH, far, None))
    return out


def _share(experiment: Experiment, needed: Sequence[float]) -> float:
    """The smallest T over the rivals beside what is plenty against each, at most 1."""
    pairs = zip(experiment.separations, needed, strict=True)
    return min(min(t / max(PLENTY, MARGIN * least), 1.0) for t, least in pairs)


def _doubted(
    chosen: Fitted, rivals: Sequence[Fitted], doubts: Sequence[Effect] | None
) -> list[Effect]:
    """The effects that may be there besides what the fits suppose."""
    supposed = {t.effect.key for fitted in (chosen, *rivals) for t in fitted.variant.terms}
    known = [e for e in library() if e.everywhere] if doubts is None else doubts
    return [e for e in known if e.key not in supposed]


def distinct(variant: Variant, other: Variant) -> str:
    """Names of the effects of a variant that the other does not have."""
    theirs = {t.effect.key for t in other.terms}
    mine = [t.effect.key for t in variant.terms if t.effect.key not in theirs]
    return " and ".join(mine) or "no further effect"


def _evidence(
    rehearsal: Rehearsal, bench: Bench, which: int, chosen: Version, rival: Version
) -> Evidence:
    channels = rehearsal.simulator.channels
    ours, theirs = (rehearsal.whole(v, which) for v in (chosen, rival))
    time = rehearsal.simulator.study.runs[which].trial.time
    width = max(1, min(round(SMOOTH / float(time[1] - time[0])), time.size))
    mean = np.ones(width) / width
    noise = np.array([bench.noise[c].total for c in channels])
    apart = residual(theirs, ours, channels) * rehearsal.used(which)[:, None]
    apart, ours = (
        np.column_stack([np.convolve(v, mean, mode="valid") for v in values.T])
        for values in (apart, ours)
    )
    apart[:, [c in bench.simulator.study.copied for c in channels]] = 0.0  # nobody can look at it
    row, k = np.unravel_index(np.argmax(np.abs(apart) / noise), apart.shape)
    when = float(time[row : row + width].mean())
    value, by = float(ours[row, k]), float(apart[row, k])
    return Evidence(channels[k], when, value, value + by, abs(by) / float(noise[k]))
