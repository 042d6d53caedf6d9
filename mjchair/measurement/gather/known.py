"""What a person knows of chair, rider and floor, which no instrument on the chair can tell.

In: numbers and words from flags. Out: a checked `Known`, and the names of what is still missing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mjchair.errors import MjchairError, nearest
from mjchair.units import with_unit

FLOORS = ("overground", "treadmill", "rollers")
RANGES = {  # name -> unit, least, most
    "rider_mass": ("kg", 5.0, 250.0),
    "chair_mass": ("kg", 4.0, 250.0),
    "mass": ("kg", 9.0, 500.0),
    "wheel_radius": ("m", 0.10, 0.36),
    "grade": ("1", -0.3, 0.3),
}
MODEL_CHAIR = 15.0  # kg, of the model's chair, where nobody says what a chair weighs
ASKED = {
    "rider_mass": "mass of the person with clothes, kg (--rider-mass)",
    "chair_mass": "mass of the chair with wheels and all that is fixed to it, kg (--chair-mass)",
    "wheel_radius": "radius of the rear wheels under load, m (--wheel-radius)",
    "floor": f"what the chair rolled on: {', '.join(FLOORS)} (--floor)",
}


@dataclass(frozen=True)
class Known:
    """What a person knows; None: not said.

    Attributes:
      rider_mass, chair_mass: kg. mass: of both together, kg. wheel_radius: m. floor: one of FLOORS.
      grade: rise over run along the way, 1.

    Raises:
      MjchairError: a value out of its range, a rider heavier than the total, an unknown floor.
    """

    rider_mass: float | None = None
    chair_mass: float | None = None
    mass: float | None = None
    wheel_radius: float | None = None
    floor: str | None = None
    grade: float | None = None

    def __post_init__(self) -> None:
        """Check everything, and take the third mass from two."""
        for name, (unit, low, high) in RANGES.items():
            value = getattr(self, name)
            if value is not None and not (np.isfinite(value) and low <= value <= high):
                flag = f"--{name.replace('_', '-')}"
                hint = "; is it in mm?" if name == "wheel_radius" and value > 100.0 else ""
                raise MjchairError(
                    f"{flag} is {with_unit(value, unit)}; it must be {low:g} to {high:g}{hint}"
                )
        if self.floor is not None and self.floor not in FLOORS:
            raise MjchairError(f"unknown floor {self.floor!r}" + nearest(self.floor, FLOORS))
        self._masses()

    def _masses(self) -> None:
        if self.mass is None:
            return
        if self.rider_mass is None and self.chair_mass is None:
            self._check_rest("rider_mass", MODEL_CHAIR, "of the model's chair")
        for name, other in (("rider_mass", "chair_mass"), ("chair_mass", "rider_mass")):
            part = getattr(self, name)
            if part is None:
                continue
            who = "the rider weighs" if name == "rider_mass" else "the chair weighs"
            if part >= self.mass:
                raise MjchairError(f"{who} {part:g} kg and both together {self.mass:g} kg")
            rest = getattr(self, other)
            if rest is None:
                self._check_rest(other, part, f"that {who}")
                object.__setattr__(self, other, self.mass - part)
            elif abs(rest + part - self.mass) > 0.5:
                raise MjchairError(
                    f"rider {self.rider_mass:g} kg and chair {self.chair_mass:g} kg are not "
                    f"{self.mass:g} kg together; give two of the three"
                )

    def _check_rest(self, name: str, part: float, of: str) -> None:
        """Refuse a total that leaves too little or too much for a rider or a chair, kg."""
        _, low, high = RANGES[name]
        rest = (self.mass or 0.0) - part
        if not low <= rest <= high:
            who = name.removesuffix("_mass")
            raise MjchairError(
                f"--mass is {self.mass:g} kg; less the {part:g} kg {of} it leaves "
                f"{rest:g} kg for the {who}, which must be {low:g} to {high:g}; "
                "give --rider-mass and --chair-mass"
            )

    def missing(self, radius: float | None) -> tuple[str, ...]:
        """What is still not known, in words with its flag.

        Args:
          radius: of the wheels, m, if a file tells it.
        """
        names = [name for name in ASKED if getattr(self, name) is None]
        if self.mass is not None:
            names = [name for name in names if name not in ("rider_mass", "chair_mass")]
        if radius is not None:
            names = [name for name in names if name != "wheel_radius"]
        return tuple(ASKED[name] for name in names)
