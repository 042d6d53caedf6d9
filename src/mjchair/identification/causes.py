"""Why a rig's curves miss the origin: the hidden causes, and which of them the data support.

The paper's curves do, and it blames camber or mounting. Four causes move a curve in their own way:

- toe: the mounting angle is off. The curve shifts along the angle, the force with the slope.
- camber: the wheel leans. A force in proportion to the load, the same at every angle.
- offset: a load cell's zero is off. The same force at every load and angle.
- conicity: the tire is a cone. As camber, but it turns round with the wheel.

Every set of at most two causes is fitted, and they are compared by BIC. Where sets of the same size
are within `STRONG` of the best, the data cannot tell them apart.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from mjchair.identification.curves import Parameter
from mjchair.measurement.rig import RigTable

Array = NDArray[np.float64]

CAMBER_THRUST = 0.010  # of the load a degree; bicycle tires 0.0075-0.015 (Dressel 2013)
STRONG = 6.0  # of BIC: strong evidence (Kass & Raftery 1995)
NAMES = ("toe", "camber", "offset", "conicity")

WOULD_TELL = {
    frozenset({"camber", "conicity"}): "measure with the wheel turned round on its axle as well: "
    "conicity turns with it, camber does not",
    frozenset({"toe", "camber"}): "measure angles of both signs at and near 0 deg and at 15 deg: "
    "toe fades where the tire slides, camber does not",
    frozenset({"toe", "conicity"}): "measure angles of both signs at and near 0 deg and at 15 deg: "
    "toe fades where the tire slides, conicity does not",
    frozenset({"toe", "offset"}): "measure at a small load and at large angles: an offset stays, "
    "what toe does goes with load and slope",
    frozenset({"camber", "offset"}): "measure at a much smaller and a much larger load: "
    "an offset stays, what camber does goes with the load",
    frozenset({"conicity", "offset"}): "measure at a much smaller and a much larger load: "
    "an offset stays, what conicity does goes with the load",
}


def parameter(name: str, table: RigTable) -> Parameter:
    """The parameter of a cause, with a prior as wide as a rig can be wrong."""
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
    """Lateral force (n,), N, that camber, offset and conicity add; toe acts on the angle."""
    camber = -CAMBER_THRUST * values.get("camber", 0.0) * table.load
    cone = values.get("conicity", 0.0) * table.load * (1.0 - 2.0 * table.turned)
    return camber + cone + values.get("offset", 0.0)


def candidates() -> list[tuple[str, ...]]:
    """No cause, each, and each two."""
    return [(), *((name,) for name in NAMES), *combinations(NAMES, 2)]


@dataclass(frozen=True)
class Verdict:
    """Which causes the data support.

    Attributes:
      named: supported, and told from all others.
      alternatives: sets of causes that fit as well as the best; one set: it is told.
      bic: of every set that was fitted, over the least.
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
        """Causes between which the data cannot tell."""
        seen = {name for group in self.alternatives for name in group}
        return tuple(name for name in NAMES if name in seen and name not in self.named)

    def sentences(self) -> list[str]:
        """The verdict in words, with what would tell the undecided ones apart."""
        lines = []
        if not self.named and not self.undecided:
            lines.append("The data support no hidden toe, camber, cell offset or conicity.")
        if self.named:
            lines.append(f"The data support: {', '.join(self.named)}.")
        if self.undecided:
            lines.append(f"The data cannot tell apart: {', '.join(self.undecided)}.")
        for pair in combinations(self.undecided, 2):
            lines.append(f"To tell {pair[0]} from {pair[1]}: {WOULD_TELL[frozenset(pair)]}.")
        if {"camber"} & {*self.named, *self.undecided}:
            lines.append(
                f"Degrees of camber assume a thrust of {CAMBER_THRUST:g} of the load a degree."
            )
        if "toe" in self.named:
            lines.append("Ply steer of the tire looks like toe on this rig.")
        return lines


def decide(bic: dict[tuple[str, ...], float]) -> Verdict:
    """The verdict from the BIC of every set of causes.

    A larger set is believed only where its best beats the best of the smaller ones by `STRONG`.
    Among sets of the believed size, all within `STRONG` of the best are alternatives.
    """
    least = min(bic.values())
    over = {group: value - least for group, value in bic.items()}
    size = 0
    for more in (1, 2):
        now = min(value for group, value in over.items() if len(group) == size)
        larger = [value for group, value in over.items() if len(group) == more]
        if larger and min(larger) < now - STRONG:
            size = more
    same = sorted((g for g in over if len(g) == size), key=lambda g: over[g])
    alternatives = tuple(g for g in same if over[g] < over[same[0]] + STRONG)
    named = set(alternatives[0]).intersection(*alternatives[1:])
    return Verdict(tuple(n for n in NAMES if n in named), alternatives, over)
