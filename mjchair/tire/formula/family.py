"""What a formula family is: one record of its names, its packing and its compiled functions.

In: the functions of one file of this folder. Out: the `Family` that the file ends with, which
mjchair.tire.families registers.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from numba.extending import register_jitable

LARGEST_FRICTION = 3.0  # peak force over load, above any tire on a floor; an assumption


@register_jitable
def no_relaxation(p: Any, fz: float, c_kappa: float, c_alpha: float) -> tuple[float, float]:
    """Of a family that has no relaxation lengths of its own: 0 m along and across."""
    return 0.0, 0.0


@dataclass(frozen=True)
class Family:
    """A formula family.

    The functions take the block `p` of mjchair.tire.block and are plain Python that Numba
    compiles (`register_jitable`). Families may share them.

    Attributes:
      number: in the header of a block. Saved models carry it, so it never changes.
      name: in tire files.
      coefficients: their names, in the order in which they lie in the block if `pack` is None.
      forces: (p, fz, kappa, tan_alpha, gamma, speed, direction) -> (Fx, Fy, Mx, My, Mz), steady
        state, ISO-W: N, 1, 1, rad, m/s, direction of rolling in [-1, 1]; N and N m. `My` is that
        of forward rolling.
      stiffness: (p, fz, gamma, speed) -> (c_kappa, c_alpha, d_x, d_y): slopes at zero slip (N,
        N/rad) and peaks (N), all positive.
      relaxation: (p, fz, c_kappa, c_alpha) -> relaxation lengths along and across, m, from these
        slopes; taken where the tire gives none.
      pack: (coefficients by name, radius in m) -> the numbers after the header, for a family that
        does more than put them in a row. It may raise MjchairError.
      largest_friction: peak force over load above which a tire is refused.
      slopes: the coefficients of the slip stiffness along and across, for error lines.
      odd: the coefficients that make a tire unlike its mirror image; they change their sign in it.
      odd_ranges: (least, largest) of ranges that the mirror image has the other way round.
    """

    number: int
    name: str
    coefficients: tuple[str, ...]
    forces: Callable[..., Any]
    stiffness: Callable[..., Any]
    relaxation: Callable[..., Any] = no_relaxation
    pack: Callable[[Mapping[str, float], float], list[float]] | None = None
    largest_friction: float = LARGEST_FRICTION
    slopes: tuple[str, str] = ("the slope", "the slope")
    odd: tuple[str, ...] = ()
    odd_ranges: tuple[tuple[str, str], ...] = ()

    @property
    def has_relaxation(self) -> bool:
        """Whether the family has relaxation lengths of its own."""
        return self.relaxation is not no_relaxation

    def packed(self, coefficients: Mapping[str, float], radius: float) -> list[float]:
        """The numbers that follow the header of a block; a coefficient left out is 0.

        Args:
          coefficients: by name. radius: of the tire, m.

        Raises:
          MjchairError: the family cannot do without a coefficient that is not there.
        """
        if self.pack is not None:
            return self.pack(coefficients, radius)
        return [coefficients.get(name, 0.0) for name in self.coefficients]

    def mirrored(self, coefficients: Mapping[str, float]) -> dict[str, float]:
        """The coefficients of the mirror image of a tire, left side to the right.

        Its forces at (kappa, alpha, gamma) are those of the tire at (kappa, -alpha, -gamma), Fy,
        Mx and Mz with the other sign.
        """
        image = dict(coefficients)
        image |= {name: -image[name] for name in self.odd if name in image}
        for low, high in self.odd_ranges:
            for name in (low, high):
                image.pop(name, None)
            for name, other in ((low, high), (high, low)):
                if other in coefficients:
                    image[name] = -coefficients[other]
        return image
