"""Manoeuvres by how far they tell the hypotheses apart, as few as need be compared in full.

In: manoeuvres in groups, simplest first, and what the chosen effects are held against. Out: which
is best, and of all others T or what it is no more than.

T is at most what a rival differs by that is not fitted again, which one simulation of the rival
tells. What T takes besides, the answers to all that is roughly known, to what is doubted and to
what shakes the chair, is simulated only of manoeuvres that may be first or second by this bound.
"""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis.fit.bench import Bench
from mjchair.diagnosis.next_experiment.comparison import Against, Comparison, Experiment
from mjchair.diagnosis.next_experiment.manoeuvres import Manoeuvre, Setting
from mjchair.diagnosis.next_experiment.rehearsal import Rehearsal, version
from mjchair.diagnosis.next_experiment.separation import Doubts, at_most
from mjchair.errors import MjchairError

Array = NDArray[np.float64]
# chi2, ten sigmas, or three times what is needed: T is linear, and above this a simple manoeuvre is
# worth more than a larger T
PLENTY, MARGIN = 100.0, 3.0
TOGETHER = 2  # manoeuvres that are compared at a time


class Ranking:
    """The manoeuvres that were looked at.

    Attributes:
      parts: those that were compared, some at a time. others: those that were not, with what T is
        at most, against each rival.
    """

    def __init__(
        self, bench: Bench, here: Setting, held: Sequence[Against], doubts: Doubts
    ) -> None:
        """Begin with none."""
        self.bench, self.here, self.held, self.doubts = bench, here, held, doubts
        self.parts: list[Comparison] = []
        self.others: list[tuple[Manoeuvre, dict[Against, float]]] = []

    def add(self, manoeuvres: Sequence[Manoeuvre]) -> None:
        """Look at a group of manoeuvres, in which simpler ones stand first.

        Those that the chair does not come through are left out, and compared only where it comes
        through none at all.
        """
        rehearsal = self._rehearsed(manoeuvres)
        if self.parts and not rehearsal.any_possible:
            return
        self.parts = [part for part in self.parts if part.rehearsal.any_possible]
        made = rehearsal.manoeuvres
        bounds = self._bounds(rehearsal)
        order = sorted(range(len(made)), key=lambda i: -_share(bounds[i]))
        while order and not self._are_behind(_share(bounds[order[0]])):
            some, order = sorted(order[:TOGETHER]), order[TOGETHER:]
            if len(some) < len(made):
                rehearsal = self._rehearsed([made[i] for i in some])
            self.parts.append(Comparison(self.bench, rehearsal, self.held, self.doubts))
        self.others += [(made[i], bounds[i]) for i in order]

    @property
    def kept(self) -> list[Against]:
        """The rivals that could be rehearsed in every manoeuvre."""
        told = [set(part.apart) for part in self.parts]
        told += [set(bounds) for _, bounds in self.others]
        return [k for k in self.held if all(k in some for some in told)]

    @property
    def has_plenty(self) -> bool:
        """Whether a manoeuvre has plenty against every rival: no further one comes before it."""
        possible = all(part.rehearsal.any_possible for part in self.parts)
        return possible and any(share >= 1.0 for share in self._shares())

    @property
    def best(self) -> tuple[Comparison, int]:
        """The best manoeuvre: where it was compared, and its place there."""
        kept = self.kept
        places = [(part, i) for part in self.parts for i in part.places]
        return max(places, key=lambda place: _share(place[0].separations(place[1], kept)))

    @property
    def experiments(self) -> list[Experiment]:
        """All manoeuvres, best first, and then those of which is known what T is at most."""
        kept = self.kept
        compared = [
            (part.rehearsal.manoeuvres[i], part.separations(i, kept), False)
            for part in self.parts
            for i in part.places
        ]
        others = [(m, {k: bounds[k] for k in kept}, True) for m, bounds in self.others]
        made = sorted([*compared, *others], key=lambda entry: (entry[2], -_share(entry[1])))
        return [Experiment(m, tuple(t.values()), bound) for m, t, bound in made]

    @property
    def dropped(self) -> tuple[str, ...]:
        """A line for each rival or doubt that this chair cannot have."""
        lines = [line for part in self.parts for line in part.dropped]
        return tuple(dict.fromkeys([*self.doubts.dropped, *lines]))

    def _rehearsed(self, manoeuvres: Sequence[Manoeuvre]) -> Rehearsal:
        return Rehearsal(self.bench, self.here, manoeuvres, version(self.doubts.chosen))

    def _bounds(self, rehearsal: Rehearsal) -> list[dict[Against, float]]:
        """Of every manoeuvre, what T is at most against each rival that this chair can have."""
        known: dict[Against, Array] = {}
        for against in self.held:
            with contextlib.suppress(MjchairError):  # said where it is compared
                known[against] = at_most(rehearsal, against.rival)
        return [
            {against: float(most[i]) for against, most in known.items()}
            for i in range(len(rehearsal.manoeuvres))
        ]

    def _shares(self) -> list[float]:
        """Of what was compared, beside what is plenty."""
        kept = self.kept
        return [_share(part.separations(i, kept)) for part in self.parts for i in part.places]

    def _are_behind(self, share: float) -> bool:
        """Whether manoeuvres that reach no more than a share come third at best, or later."""
        shares = sorted(self._shares(), reverse=True)
        return self.has_plenty or (len(shares) > 1 and share <= shares[1])


def _share(separations: Mapping[Against, float]) -> float:
    """The smallest T over the rivals beside what is plenty against each, at most 1."""
    shares = [t / max(PLENTY, MARGIN * against.needed) for against, t in separations.items()]
    return min([1.0, *shares]) if shares else 0.0
