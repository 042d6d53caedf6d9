"""Whether what is missing matters: the missing force against the chair's own rolling resistance.

In: the chair as it was with its columns, and the best explanation. Out: the largest missing force,
and the limit below which none matters.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis import rules
from mjchair.diagnosis.data.own_resistance import own_resistance
from mjchair.diagnosis.data.study import Study
from mjchair.diagnosis.explain import missing_force
from mjchair.diagnosis.explain.choice import Choice
from mjchair.diagnosis.explain.gap import Gap, forces_left, groups
from mjchair.diagnosis.explain.in_each_run import ActingIn, columns_of
from mjchair.diagnosis.explain.one_run import InOneRun
from mjchair.diagnosis.explain.screening import Base
from mjchair.diagnosis.replay.derivatives import Column
from mjchair.diagnosis.replay.pulses import Force
from mjchair.diagnosis.result import Material
from mjchair.model.rolling import rear_axle

Array = NDArray[np.float64]
BRIEF = 80.0  # percent of a window in which a force is smaller: what lasts less is a jerk
BY_FORCE = 0.5  # share of a change that forces make: with less it is of a sensor, or of geometry


def material(base: Base, gap: Gap, choice: Choice | None, alone: InOneRun | None) -> Material:
    """The largest missing force of a study, and its limit.

    The force is the one that does what the answer does: the chosen effects, or where there is none
    the force that the tests see best: effects that explain little of a push that somebody gave are
    no measure of it. Of an effect that makes a wheel slide or shimmy no column
    tells how large that is, and errors of sensors alone are no force, though a moment may look like
    the gain of a gyroscope: these count as larger than any limit.

    Args:
      choice: of effects, where it is an answer.
      alone: what acts in one run alone, where that explains the gap; None: nothing does.
    """
    study = base.bench.simulator.study
    if alone is not None:
        return Material(_of_one_run(base, alone.acting), limit(study))
    if choice is not None and (_is_of_whole_size(choice) or _is_of_sensors(choice)):
        return Material(float("inf"), limit(study))
    return Material(largest(base, _explaining(base, gap, choice)), limit(study))


def _is_of_whole_size(choice: Choice) -> bool:
    """Whether a chosen effect has sizes at which a chair does what no small change foretells."""
    return any(p.whole for term in choice.fitted.variant.terms for _, p in term.parameters)


def _is_of_sensors(choice: Choice) -> bool:
    """Whether errors of sensors are all that was chosen."""
    return all(term.effect.sensor is not None for term in choice.fitted.variant.terms)


def limit(study: Study) -> float:
    """The force below which none matters, N."""
    own = study.material
    return rules.MATERIAL * own_resistance(study.spec) if own is None else own


def _explaining(base: Base, gap: Gap, choice: Choice | None) -> list[int]:
    """Places, among the columns that are no nuisances, of the best explanation."""
    if choice is not None:
        return base.reduced.index(choice.hypothesis.columns)
    forces = forces_left(gap)
    return groups(base.reduced.columns)[forces[0][0]] if forces else []


def largest(base: Base, which: Sequence[int]) -> float:
    """The largest force forward, or at the wheels for a moment, that columns stand for, N."""
    if not which:
        return 0.0
    columns = [base.columns[base.reduced.columns[k]] for k in which]
    return _force(base, _together(base.reduced.solve(list(which)), columns))


def _of_one_run(base: Base, acting: ActingIn) -> float:
    """The largest force of the best effect in one run, N."""
    columns = columns_of(acting, base.system.run, base.columns)
    which = acting.reduced.index(acting.options[0].columns)
    return _force(base, _together(acting.reduced.solve(which), list(columns.values())))


def _together(sizes: Array, columns: Sequence[Column]) -> list[Array]:
    """What columns of these sizes change together, (rows, channels) of each window."""
    return [
        np.asarray(sum(float(s) * c for s, c in zip(sizes, window, strict=True)))
        for window in zip(*columns, strict=True)
    ]


def _force(base: Base, change: list[Array]) -> float:
    """The largest force that makes a change (rows, channels) of each window, N.

    What no force makes, such as the error of a sensor, counts as larger than any limit. It is
    sought window by window: a foot that drags for one second of 45 is no force of 95 % of them.
    """
    around = base.around
    value, share = missing_force.equivalent_force(
        base.bench, around.track, around.pulses, around.answers, change
    )
    if share < BY_FORCE:
        return float("inf")
    half = 0.5 * rear_axle(base.bench.simulator.base).track
    scale = {Force.FORWARD: 1.0, Force.YAW: 1.0 / half}
    acting: dict[tuple[Force, int], list[float]] = {}
    for pulse, size in zip(around.pulses, np.abs(value), strict=True):
        if pulse.force in scale:
            acting.setdefault((pulse.force, pulse.window), []).append(float(size))
    return max(
        float(np.percentile(mine, BRIEF)) * scale[force] for (force, _), mine in acting.items()
    )
