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
from mjchair.diagnosis.next_experiment.comparison import Against, Evidence, Experiment
from mjchair.diagnosis.next_experiment.manoeuvres import Manoeuvre, possible, setting
from mjchair.diagnosis.next_experiment.ranking import Ranking
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


@dataclass(frozen=True)
class Plan:
    """Experiments, best first.

    Attributes:
      chosen: name of the hypothesis that was rehearsed. rivals: names of the others.
      experiments: that were compared, and then those of which is known only what T is at most:
        enough to see that others come first. evidence: of the best, against each rival; None: a
        force has none. torque: its largest, N m.
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
    where none before them separates so much; and T is sought only of those that may be first or
    second by what it is at most.

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
    ranking = Ranking(bench, here, held, doubted)
    for some in _simple_first(made):
        ranking.add(some)
        if ranking.has_plenty:
            break
    dropped = ranking.dropped
    kept = ranking.kept
    if not kept:
        raise MjchairError("no experiment can be planned: " + "; ".join(dropped))
    part, best = ranking.best
    return Plan(
        chosen=tuple(k.chosen for k in kept),
        rivals=tuple(k.name for k in kept),
        experiments=tuple(ranking.experiments),
        evidence=tuple(part.evidence(best, k) for k in kept),
        torque=here.largest(part.rehearsal.manoeuvres[best]),
        dropped=dropped,
        run=here.run,
        needed=tuple(k.needed for k in kept),
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
