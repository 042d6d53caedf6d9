"""Hidden causes of a lateral force at zero slip angle, and which of them the data support.

In: a rig table, and the BIC (Bayesian information criterion) of a fit with each set of causes.
Out: the force that a cause adds, and a `Verdict`: the causes that the data support, and the sets
of causes between which the data cannot decide.

A tire without any of these causes has no lateral force at zero slip angle. The measured curves of
Silva & Dedini (COBEM 2007) have one, and the paper explains it by camber or by the mounting.
Four causes are considered; each changes the measured force in a different way:

- toe: the wheel is mounted at a wrong angle. The curve shifts along the axis of the slip angle.
- camber: the wheel leans. It adds a force in proportion to the load, equal at all slip angles.
- offset: the load cell does not read zero without load. It adds the same force to every run.
- conicity: the tire is slightly conical. It adds a force in proportion to the load, as camber
  does, but this force changes its sign when the wheel is mounted the other way round.

Every set of at most two causes is fitted, and the fits are compared by BIC. Sets of the same size
whose BIC is less than `STRONG_EVIDENCE` above the least one cannot be told apart.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from mjchair.identification.curves import Parameter
from mjchair.measurement.rig import RigTable

Array = NDArray[np.float64]

# lateral force over load per degree of camber; bicycle tires have 0.0075-0.015 (Dressel 2013)
CAMBER_THRUST = 0.010
STRONG_EVIDENCE = 6.0  # difference in BIC; "strong" after Kass & Raftery (1995)
NAMES = ("toe", "camber", "offset", "conicity")

# two causes -> the measurement that would decide between them, and why
DECIDING_MEASUREMENT = {
    frozenset({"camber", "conicity"}): "measure also with the wheel turned round on its axle: "
    "the force from conicity then changes its sign, the force from camber does not",
    frozenset({"toe", "camber"}): "measure slip angles of both signs near 0 deg and at 15 deg: "
    "the effect of toe vanishes where the tire slides, the force from camber does not",
    frozenset({"toe", "conicity"}): "measure slip angles of both signs near 0 deg and at 15 deg: "
    "the effect of toe vanishes where the tire slides, the force from conicity does not",
    frozenset({"toe", "offset"}): "measure at a small load and at large slip angles: the offset "
    "stays the same, the effect of toe is in proportion to the slope of the curve",
    frozenset({"camber", "offset"}): "measure at a much smaller and at a much larger load: the "
    "offset stays the same, the force from camber is in proportion to the load",
    frozenset({"conicity", "offset"}): "measure at a much smaller and at a much larger load: the "
    "offset stays the same, the force from conicity is in proportion to the load",
}


def parameter(name: str, table: RigTable) -> Parameter:
    """The parameter of a cause; its prior is as wide as the error of a real rig may be.

    Args:
      name: one of NAMES. table: the rig runs, which give the size of the largest force.
    """
    largest = float(np.max(np.abs(table.fy)))
    return {
        "toe": Parameter("toe", "deg", "mounting angle", 0.0, -8.0, 8.0, 0.0, 3.0),
        "camber": Parameter("camber", "deg", "hidden camber", 0.0, -30.0, 30.0, 0.0, 8.0),
        "offset": Parameter(
            "offset", "N", "load-cell offset", 0.0, -largest, largest, 0.0, 0.3 * largest
        ),
        "conicity": Parameter("conicity", "1", "lateral force over load", 0.0, -0.5, 0.5, 0.0, 0.1),
    }[name]


def added_force(values: dict[str, float], table: RigTable) -> Array:
    """Lateral force (n,), N, that camber, offset and conicity add to every run of a table.

    Toe adds no force here: it changes the slip angle, which `fit` takes into account.

    Args:
      values: cause -> value, in the unit of its parameter. table: the rig runs.
    """
    camber = -CAMBER_THRUST * values.get("camber", 0.0) * table.load
    cone = values.get("conicity", 0.0) * table.load * (1.0 - 2.0 * table.turned)
    return camber + cone + values.get("offset", 0.0)


def candidates() -> list[tuple[str, ...]]:
    """All sets of at most two causes: the empty set, single causes, and pairs."""
    return [(), *((name,) for name in NAMES), *combinations(NAMES, 2)]


@dataclass(frozen=True)
class Verdict:
    """Which causes the data support.

    Attributes:
      named: causes that the data support and that are in every alternative.
      alternatives: the set of causes with the least BIC, and all sets that fit as well; where
        there is only one, the data decide for it.
      bic: set of causes -> its BIC less the least BIC.
    """

    named: tuple[str, ...]
    alternatives: tuple[tuple[str, ...], ...]
    bic: dict[tuple[str, ...], float]

    @property
    def best(self) -> tuple[str, ...]:
        """The set of causes with the least BIC."""
        return self.alternatives[0]

    @property
    def undecided(self) -> tuple[str, ...]:
        """Causes that are in some of the alternatives, but not in all."""
        possible = {name for group in self.alternatives for name in group}
        return tuple(name for name in NAMES if name in possible and name not in self.named)

    def sentences(self) -> list[str]:
        """The verdict in words, and which measurement would decide between undecided causes."""
        lines = []
        if not self.named and not self.undecided:
            lines.append("The data support no hidden toe, camber, load-cell offset or conicity.")
        if self.named:
            lines.append(f"The data support: {', '.join(self.named)}.")
        if self.undecided:
            lines.append(f"The data cannot tell apart: {', '.join(self.undecided)}.")
        for pair in combinations(self.undecided, 2):
            advice = DECIDING_MEASUREMENT[frozenset(pair)]
            lines.append(f"To tell {pair[0]} from {pair[1]}: {advice}.")
        if {"camber"} & {*self.named, *self.undecided}:
            lines.append(
                "The camber angle is computed with a camber thrust of "
                f"{CAMBER_THRUST:g} of the load per degree (assumption)."
            )
        if "toe" in self.named:
            lines.append("Ply steer of the tire has the same effect as toe on this rig.")
        return lines


def decide(bic: dict[tuple[str, ...], float]) -> Verdict:
    """The verdict from the BIC of every set of causes.

    First the number of causes is chosen: a larger number is accepted only where the least BIC
    among its sets is lower by `STRONG_EVIDENCE` than the least BIC among the smaller sets. Then all
    sets of this size whose BIC is within `STRONG_EVIDENCE` of the least one are alternatives.

    Args:
      bic: set of causes -> BIC of the fit with them.
    """
    least = min(bic.values())
    excess = {group: value - least for group, value in bic.items()}
    size = 0
    for larger_size in (1, 2):
        smaller = min(value for group, value in excess.items() if len(group) == size)
        larger = [value for group, value in excess.items() if len(group) == larger_size]
        if larger and min(larger) < smaller - STRONG_EVIDENCE:
            size = larger_size
    of_size = sorted((g for g in excess if len(g) == size), key=lambda g: excess[g])
    alternatives = tuple(g for g in of_size if excess[g] < excess[of_size[0]] + STRONG_EVIDENCE)
    named = set(alternatives[0]).intersection(*alternatives[1:])
    return Verdict(tuple(n for n in NAMES if n in named), alternatives, excess)
