"""Some manoeuvres, rehearsed, and how far each rival of the chosen effects stays behind in them.

In: a rehearsal of the chosen chair, and the fits of its rivals. Out: T of each manoeuvre against
each rival, and the channel in which they differ most.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mjchair.diagnosis.fit.bench import Bench
from mjchair.diagnosis.fit.nonlinear import Fitted
from mjchair.diagnosis.next_experiment.manoeuvres import Manoeuvre
from mjchair.diagnosis.next_experiment.rehearsal import Rehearsal, Version, version
from mjchair.diagnosis.next_experiment.separation import (
    Doubts,
    Separated,
    nuisance_answers,
    outside_answers,
    separation,
)
from mjchair.diagnosis.replay.pulses import Force
from mjchair.diagnosis.replay.sampling import residual
from mjchair.errors import MjchairError

SMOOTH = 0.5  # s, over which a person would average a channel


@dataclass(frozen=True)
class Experiment:
    """A manoeuvre and what it tells apart.

    Attributes:
      manoeuvre: which. separations: T against each rival, chi2.
      at_most: whether T is no more than these, and was not sought further.
    """

    manoeuvre: Manoeuvre
    separations: tuple[float, ...]
    at_most: bool = False

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


@dataclass(frozen=True, eq=False)
class Against:
    """What the chosen effects are held against.

    Attributes:
      chosen, name: of what is chosen and of the rival. needed: T that rules it out, chi2.
      rival: its fit. force: in its place, of any course, which no effect makes; None: the rival is
        no force.
    """

    chosen: str
    name: str
    needed: float
    rival: Fitted
    force: Force | None = None


class Comparison:
    """Some of the manoeuvres, rehearsed, and how far each rival stays behind in them.

    Attributes:
      rehearsal: of the chosen chair. apart: the rivals that could be rehearsed.
      dropped: a line for each rival that this chair cannot have.
    """

    def __init__(
        self, bench: Bench, rehearsal: Rehearsal, held: Sequence[Against], doubts: Doubts
    ) -> None:
        """Compare each rival, where effects that were doubted may be there besides."""
        self.bench, self.rehearsal, self.chosen = bench, rehearsal, doubts.chosen
        self.apart: dict[Against, Separated] = {}
        self.dropped: list[str] = []
        self._compare(held, doubts)

    @property
    def places(self) -> range:
        """Of its manoeuvres."""
        return range(len(self.rehearsal.manoeuvres))

    def _compare(self, held: Sequence[Against], doubts: Doubts) -> None:
        doubted = doubts.answers(self.rehearsal)
        known = {key: doubts.columns[key] for key in doubted}
        answers = {**nuisance_answers(self.rehearsal, self.chosen), **doubted}
        for against in held:
            answering, columns = answers, known
            if against.force is not None:
                more, nothing = outside_answers(self.rehearsal, self.chosen, against.force)
                answering, columns = {**answers, **more}, {**columns, **nothing}
            try:
                self.apart[against] = separation(
                    self.rehearsal, self.bench, against.rival, answering, columns
                )
            except (MjchairError, np.linalg.LinAlgError) as error:
                self.dropped.append(f"{against.name} was not rehearsed: {error}")

    def separations(self, which: int, held: Sequence[Against]) -> dict[Against, float]:
        """T of a manoeuvre against each rival, chi2."""
        return {against: float(self.apart[against].least[which]) for against in held}

    def evidence(self, which: int, held: Against) -> Evidence | None:
        """Where a rival differs most in a manoeuvre; None: a force of any course."""
        if held.force is not None:
            return None
        steps = self.apart[held].steps[which]
        rehearsed, rival = version(self.chosen), version(held.rival, steps)
        return _evidence(self.rehearsal, self.bench, which, rehearsed, rival)


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
