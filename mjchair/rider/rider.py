"""A rider's build: from stature, sex and lengths to the inertials of the segments.

Goes in: a `Rider`, the body mass (kg) and the lengths of the figure that the chair shows. Comes
out: each moving segment's length, mass, centre of mass and inertia in its own frame.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from mjchair.errors import MjchairError, nearest
from mjchair.rider import anatomy
from mjchair.rider.anatomy import SEGMENTS, STATURE, TABLE, Segment

Array = NDArray[np.float64]

SEGMENT_NAMES = tuple(segment.name for segment in SEGMENTS)
SHOULDER_WIDTH = (
    "shoulder_width"  # between the shoulder joints: the one length that is no segment's
)
RIDERS = ("rigid", "moving")
LOW, HIGH = 0.5, 2.5  # m, statures between which a person is


@dataclass(frozen=True)
class Rider:
    """Who sits in the chair and moves; the mass is the chair parameter `occupant_mass`.

    Attributes:
      stature: m. Lengths of segments go with it: 1 to 1.75 m for the figure of the shipped chairs.
      sex: "male" or "female", whose table of de Leva (1996) is used. The shipped chairs' rigid
        occupant is of the male one.
      lengths: measured lengths, m, of segments (names of `anatomy.SEGMENTS`; the trunk from the
        hips to the middle of the shoulders) and "shoulder_width"; they replace those that follow
        from the stature.

    Raises:
      MjchairError: a stature that no person has, another sex, an unknown segment, or a length
        that is not positive.
    """

    stature: float = STATURE
    sex: str = "male"
    lengths: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check what was given, and freeze the lengths."""
        if not LOW <= self.stature <= HIGH:
            raise MjchairError(
                f"stature is {self.stature:g} m; it must be within {LOW:g} to {HIGH:g}"
            )
        if self.sex not in TABLE:
            raise MjchairError(f"sex {self.sex!r} has no table" + nearest(self.sex, TABLE))
        known = (*SEGMENT_NAMES, SHOULDER_WIDTH)
        for name, value in self.lengths.items():
            if name not in known:
                raise MjchairError(f"no segment {name!r}" + nearest(name, known))
            if not 0.0 < value < self.stature:
                raise MjchairError(
                    f"length of {name} is {value:g} m; it must be between 0 and the stature, "
                    f"{self.stature:g} m"
                )
        object.__setattr__(self, "lengths", MappingProxyType(dict(self.lengths)))

    def scaled(self, figure: Mapping[str, float]) -> dict[str, float]:
        """Lengths (m) from those of a figure of 1.75 m: measured, else with the stature."""
        ratio = self.stature / STATURE
        return {name: self.lengths.get(name, ratio * value) for name, value in figure.items()}


def as_rider(given: str | Rider) -> Rider | None:
    """A Rider from what `load_spec` takes; None: the rigid one.

    Raises:
      MjchairError: neither "rigid" nor "moving".
    """
    if isinstance(given, Rider):
        return given
    if given not in RIDERS:
        raise MjchairError(f"rider {given!r}" + nearest(str(given), RIDERS))
    return Rider() if given == "moving" else None


@dataclass(frozen=True)
class Inertial:
    """Mass (kg), centre of mass (3,) m and inertia about it (3, 3) kg m^2, in one frame."""

    mass: float
    center: Array
    inertia: Array

    def about(self, point: Array) -> Array:
        """Inertia (3, 3) about another point of the frame."""
        arm = self.center - point
        return self.inertia + self.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))

    def placed(self, rotation: Array, origin: Array) -> Inertial:
        """The same inertial in the frame where this one's has that rotation (3, 3) and origin."""
        center = rotation @ self.center + origin
        return Inertial(self.mass, center, rotation @ self.inertia @ rotation.T)


def together(parts: list[Inertial], sign: float = 1.0, first: Inertial | None = None) -> Inertial:
    """The inertial of several in one frame; with `first`, of `first` plus `sign` times the rest."""
    signs = [sign] * len(parts)
    if first is not None:
        parts, signs = [first, *parts], [1.0, *signs]
    mass = sum(s * part.mass for s, part in zip(signs, parts, strict=True))
    moment = sum(s * part.mass * part.center for s, part in zip(signs, parts, strict=True))
    center = np.asarray(moment / mass)
    inertia = sum(s * part.about(center) for s, part in zip(signs, parts, strict=True))
    return Inertial(float(mass), center, np.asarray(inertia))


def segment_inertial(segment: Segment, sex: str, mass: float, length: float) -> Inertial:
    """A moving segment's inertial in its own frame.

    Args:
      mass: of the whole body, kg. length: of the segment, m.
    """
    rows = TABLE[sex]
    if segment.name == "trunk":
        scale = length / anatomy.TRUNK_LENGTH[sex]
        base = rows["lower_trunk"].length
        parts = []
        for name in segment.rows:  # one on the other, from the top of the lower trunk
            row = rows[name]
            top = base + row.length
            center = (top - row.center * row.length) * scale
            parts.append(_rod(row, mass, row.length * scale, center))
            base = top
        return together(parts)
    row = rows[segment.rows[0]]
    # de Leva measures the head from its vertex, which is away from its joint
    away = (1.0 - row.center) * length if segment.up else -row.center * length
    return _rod(row, mass, length, away)


def _rod(row: anatomy.Row, mass: float, length: float, height: float) -> Inertial:
    own = row.mass * mass
    radii = length * np.array([row.sagittal, row.transverse, row.longitudinal])
    return Inertial(own, np.array([0.0, 0.0, height]), np.diag(own * radii**2))
