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
from itertools import groupby

from mjchair.diagnosis.fit.bench import Bench
from mjchair.diagnosis.fit.nonlinear import Fitted
from mjchair.diagnosis.fit.variant import Variant
from mjchair.diagnosis.next_experiment.comparison import (
    Against,
    Comparison,
    Evidence,
    Experiment,
)
from mjchair.diagnosis.next_experiment.manoeuvres import Manoeuvre, possible, setting
from mjchair.diagnosis.next_experiment.rehearsal import Rehearsal, version
from mjchair.diagnosis.next_experiment.separation import Doubts
from mjchair.diagnosis.replay.pulses import Force
from mjchair.effects.effect import Effect
from mjchair.effects.library import library
from mjchair.errors import MjchairError

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
class Plan:
    """Experiments, best first.

    Attributes:
      chosen: name of the hypothesis that was rehearsed. rivals: names of the others.
      experiments: that were rehearsed. evidence: of the best, against each rival; None: a force
        has none. torque: its largest, N m.
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
    is taken, as the simplest. Those with torque, and then those with a load, are rehearsed only
    where none before them separates so much.

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
    held = _held(chosen, rivals, needed) if rivals else _forces(chosen)
    doubted = Doubts(bench, chosen, _doubted(chosen, rivals, doubts))
    parts: list[Comparison] = []
    for some in _simple_first(made):
        rehearsal = Rehearsal(bench, here, some, version(chosen))
        parts.append(Comparison(bench, rehearsal, held, doubted))
        if _has_plenty(parts):
            break
    parts = [part for part in parts if part.rehearsal.any_possible] or parts[:1]
    lines = [*doubted.dropped, *(line for part in parts for line in part.dropped)]
    dropped = tuple(dict.fromkeys(lines))
    kept = _in_all(parts)
    if not kept:
        raise MjchairError("no experiment can be planned: " + "; ".join(dropped))
    needs = [k.needed for k in kept]
    ranked = sorted(
        ((part, i, part.experiment(i, kept)) for part in parts for i in part.places),
        key=lambda entry: -_share(entry[2], needs),
    )
    part, best, _ = ranked[0]
    return Plan(
        chosen=tuple(k.chosen for k in kept),
        rivals=tuple(k.name for k in kept),
        experiments=tuple(experiment for *_, experiment in ranked),
        evidence=tuple(part.evidence(best, k) for k in kept),
        torque=here.largest(part.rehearsal.manoeuvres[best]),
        dropped=dropped,
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


def _held(
    chosen: Fitted, rivals: Sequence[Fitted], needed: Sequence[float] | None
) -> list[Against]:
    """The chosen effects against each rival."""
    return [
        Against(
            distinct(chosen.variant, rival.variant),
            distinct(rival.variant, chosen.variant),
            enough,
            rival,
        )
        for rival, enough in zip(rivals, needed or [ENOUGH] * len(rivals), strict=True)
    ]


def _forces(chosen: Fitted) -> list[Against]:
    """The chosen effects against a force that no effect makes, in their place."""
    nothing = replace(chosen, variant=replace(chosen.variant, terms=()))
    name = distinct(chosen.variant, nothing.variant)
    return [Against(name, words, ENOUGH, nothing, force) for force, words in OUTSIDE.items()]


def _simple_first(manoeuvres: Sequence[Manoeuvre]) -> list[list[Manoeuvre]]:
    """The manoeuvres in the order of trying: without torque and load, with torque, with a load."""

    def rank(m: Manoeuvre) -> int:
        return 2 if m.load is not None else int(m.torque is not None)

    return [list(some) for _, some in groupby(sorted(manoeuvres, key=rank), key=rank)]


def _in_all(parts: Sequence[Comparison]) -> list[Against]:
    """The rivals that could be rehearsed in every part."""
    return [k for k in parts[0].apart if all(k in part.apart for part in parts)]


def _has_plenty(parts: Sequence[Comparison]) -> bool:
    """Whether a manoeuvre has plenty against every rival: no further one comes before it."""
    held = _in_all(parts)
    needs = [k.needed for k in held]
    return bool(held) and any(
        part.rehearsal.any_possible and _share(part.experiment(i, held), needs) >= 1.0
        for part in parts
        for i in part.places
    )


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
    """Keys of the effects of a variant that the other does not have, joined by "+"."""
    theirs = {t.effect.key for t in other.terms}
    mine = [t.effect.key for t in variant.terms if t.effect.key not in theirs]
    return "+".join(mine) or "no further effect"
