"""A tire: its coefficients, the numbers of its behaviour at standstill, its steady-state forces.

In: a family and its coefficients by name. Out: the checked tire, its block of numbers for a model,
and its forces over arrays of load, slip and camber.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from types import MappingProxyType
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjchair.errors import MjchairError, nearest
from mjchair.tire import block, law
from mjchair.tire.compiled import TIRE, fingerprint
from mjchair.tire.families import FAMILIES
from mjchair.tire.formula.family import Family

LEAST_FRICTION = 0.01  # peak force over load; the family says the largest
LOAD_UNITS = {"N": 1.0, "kN": 1000.0}
SIDES = ("left", "right", "symmetric")


class Forces(NamedTuple):
    """Forces (N) and moments (N m) on the wheel in ISO-W axes, all of the broadcast shape.

    The order is the tire law's, and that of a wheel's sensor, which leaves out Mx and My.
    """

    Fx: NDArray[np.float64]
    Fy: NDArray[np.float64]
    Mx: NDArray[np.float64]
    My: NDArray[np.float64]
    Mz: NDArray[np.float64]


def quantity(default: float, unit: str, low: float, high: float, text: str) -> float:
    """A dataclass field that carries its unit, its range and what it is."""
    metadata = {"unit": unit, "low": low, "high": high, "text": text}
    return field(default=default, metadata=metadata)


@dataclass(frozen=True)
class Tire:
    """A tire of one formula family, with the numbers of the standstill law.

    Frozen and validated when made.

    Attributes:
      name: of the tire.
      family: a name in mjchair.tire.families.FAMILIES.
      coefficients: the family's, by name; those left out are 0.
      source: where the numbers come from.
      side: "left" or "right", the side of the vehicle on which the coefficients hold: on the other
        side the tire is its mirror image (`on`). "symmetric": no ply steer, no conicity and no
        other difference between left and right is meant, so on a vehicle (`on`) it has none. "":
        not said; the tire is the same on both sides.
      unused: what its file has and this project does not use, as "SECTION.KEY": text.
      The others: see their metadata (unit, range, text), or `mjchair models`.

    Raises:
      MjchairError: unknown family, side or coefficient, a number out of its range, a peak friction
        outside 0.01-5, which is what a list in the wrong unit gives, or a slip stiffness of 0.
    """

    name: str
    family: str
    coefficients: Mapping[str, float]
    source: str = ""
    side: str = ""
    unused: Mapping[str, str] = field(default_factory=dict)
    relaxation_x: float = quantity(0.04, "m", 0.0, 2.0, "relaxation length along the heading")
    relaxation_y: float = quantity(0.04, "m", 0.0, 2.0, "relaxation length across the heading")
    damping_time: float = quantity(0.005, "s", 0.0, 0.1, "carcass damping over stiffness")
    rolling_resistance: float = quantity(0.0, "1", 0.0, 0.5, "rolling moment over load and radius")
    rolling_relaxation: float = quantity(
        0.005, "m", 1e-5, 0.1, "distance over which the rolling moment builds up"
    )
    rolling_damping_time: float = quantity(0.1, "s", 0.0, 2.0, "damping of the rolling moment")
    turning_moment: float = quantity(0.0, "N m", 0.0, 100.0, "moment against the yaw rate")
    friction_factor: float = quantity(1.0, "1", 0.01, 100.0, "scales the peak force")
    stiffness_factor: float = quantity(1.0, "1", 0.01, 100.0, "scales the slip stiffness")
    longitudinal_factor: float = quantity(
        1.0, "1", 0.01, 100.0, "scales the slip stiffness along the heading alone"
    )
    load_exponent: float = quantity(
        0.0, "1", -1.0, 1.0, "force over load falls with (Fz / nominal load) ** -exponent"
    )
    nominal_load: float = quantity(300.0, "N", 1.0, 1e5, "load of the checks and of the exponent")
    pneumatic_trail: float = quantity(
        0.0, "m", 0.0, 0.5, "at zero slip, where the family has no aligning moment of its own"
    )
    slide_speed: float = quantity(0.05, "m/s", 1e-4, 10.0, "slip speed of sliding at standstill")
    radius: float = quantity(0.3, "m", 0.01, 2.0, "unloaded radius; UNLOADED_RADIUS where given")

    def __post_init__(self) -> None:
        """Freeze the coefficients and check every number."""
        if self.family not in FAMILIES:
            raise MjchairError(
                f"tire {self.name}: unknown family {self.family!r}" + nearest(self.family, FAMILIES)
            )
        if self.side not in ("", *SIDES):
            raise MjchairError(
                f"tire {self.name}: unknown side {self.side!r}" + nearest(self.side, SIDES)
            )
        family = FAMILIES[self.family]
        names = family.coefficients
        for key, value in self.coefficients.items():
            if key not in names:
                raise MjchairError(
                    f"tire {self.name}: unknown {self.family} coefficient {key!r}"
                    + nearest(key, names)
                )
            if not math.isfinite(value):
                raise MjchairError(f"tire {self.name}: {key} is {value}; it must be finite")
        object.__setattr__(
            self,
            "coefficients",
            MappingProxyType({k: float(v) for k, v in self.coefficients.items()}),
        )
        if self.coefficients.get("UNLOADED_RADIUS"):
            object.__setattr__(self, "radius", self.coefficients["UNLOADED_RADIUS"])
        object.__setattr__(self, "unused", MappingProxyType(dict(self.unused)))
        for item in fields(self):
            if not item.metadata:
                continue
            value = getattr(self, item.name)
            low, high = item.metadata["low"], item.metadata["high"]
            if not low <= value <= high:
                raise MjchairError(
                    f"tire {self.name}: {item.name} is {value:g} {item.metadata['unit']}; "
                    f"it must be within {low:g} to {high:g}"
                )
            if value == 0.0 and item.name.startswith("relaxation") and not family.has_relaxation:
                raise MjchairError(
                    f"tire {self.name}: {item.name} is 0, and the family {self.family} has none of "
                    f"its own; give one above 0 m"
                )
        self._check_friction()
        self._check_stiffness()

    def _check_friction(self) -> None:
        peak = self.peak_friction(self.nominal_load)
        low, high = LEAST_FRICTION, FAMILIES[self.family].largest_friction
        for axis, value in zip(("longitudinal", "lateral"), peak, strict=True):
            if not low <= value <= high:
                hint = "; is it meant in kN, or in N?" if "load_unit" in self.coefficients else ""
                raise MjchairError(
                    f"tire {self.name}: {axis} peak friction is {value:.4g} at "
                    f"{self.nominal_load:g} N; it must be within {low:g} to {high:g}{hint}"
                )

    def _check_stiffness(self) -> None:
        """Refuse a tire without slip stiffness, which makes no force."""
        slopes = law.family_stiffness(self.block(), self.nominal_load, 0.0, 1.0)[:2]
        names = FAMILIES[self.family].slopes
        for axis, slope, name in zip(("longitudinal", "lateral"), slopes, names, strict=True):
            if slope == 0.0:
                raise MjchairError(
                    f"tire {self.name}: {axis} slip stiffness is 0 at {self.nominal_load:g} N; it "
                    f"must be above 0, so give {name}"
                )

    def peak_friction(self, fz: float) -> tuple[float, float]:
        """Peak force over load, along and across the heading, at the load `fz` (N)."""
        packed = self.block()
        _, _, d_x, d_y = law.family_stiffness(packed, fz, 0.0, 1.0)
        peak, _ = law.factors(packed, fz)
        return d_x * peak / fz, d_y * peak / fz

    def block(self) -> NDArray[np.float64]:
        """The tire as numbers, in the order of mjchair.tire.block."""
        family = FAMILIES[self.family]
        header = _header(family)
        for item in fields(self):
            if item.metadata:
                header[getattr(block, item.name.upper())] = getattr(self, item.name)
        return np.concatenate([header, family.packed(self.coefficients, self.radius)])

    def forces(
        self,
        fz: ArrayLike,
        kappa: ArrayLike,
        alpha: ArrayLike,
        gamma: ArrayLike = 0.0,
        speed: ArrayLike = 1.0,
    ) -> Forces:
        """Steady-state forces, ISO-W; the arguments broadcast.

        Args:
          fz: load, N; none at 0 or below. kappa: longitudinal slip, 1, positive when driving.
          alpha: slip angle, rad; a positive one gives a negative Fy.
          gamma: camber, rad, about +x. speed: of the wheel along its heading, m/s.
        """
        return block_forces(self.block(), fz, kappa, alpha, gamma, speed)

    def on(self, side: str) -> Tire:
        """The tire as it is on the `side` of a vehicle, "left" or "right".

        It is the mirror image of itself where its coefficients hold for the other side, and as it
        is on a wheel of neither. A symmetric one is without what makes it unlike its mirror image.
        """
        odd = FAMILIES[self.family].odd
        if self.side == "symmetric" and any(self.coefficients.get(k) for k in odd):
            even = {k: v for k, v in self.coefficients.items() if k not in odd}
            return replace(self, coefficients=even)
        if self.side not in ("left", "right") or side not in ("left", "right"):
            return self
        if self.side == side:
            return self
        image = FAMILIES[self.family].mirrored(self.coefficients)
        return replace(self, coefficients=image, side=side)

    def with_(self, **changes: float) -> Tire:
        """A copy with other numbers, checked like a new one."""
        return replace(self, **changes)  # type: ignore[arg-type]


def _header(family: Family) -> NDArray[np.float64]:
    """A header that says what it is, and nothing more."""
    header = np.zeros(block.HEADER)
    header[block.TAG_AT] = block.TAG
    header[block.VERSION_AT] = block.VERSION
    header[block.FAMILY] = family.number
    return header


def block_of(
    family: str, coefficients: Mapping[str, float], radius: float = 0.3
) -> NDArray[np.float64]:
    """A block with nothing but its family and coefficients: unchecked, for fits."""
    kind = FAMILIES[family]
    header = _header(kind)
    header[[block.FRICTION_FACTOR, block.STIFFNESS_FACTOR, block.NOMINAL_LOAD]] = 1.0
    header[block.RADIUS] = radius
    return np.concatenate([header, kind.packed(coefficients, radius)])


def block_forces(
    packed_tire: NDArray[np.float64],
    fz: ArrayLike,
    kappa: ArrayLike,
    alpha: ArrayLike,
    gamma: ArrayLike = 0.0,
    speed: ArrayLike = 1.0,
) -> Forces:
    """`Tire.forces` of the tire in a block."""
    given = np.broadcast_arrays(fz, kappa, np.tan(np.asarray(alpha, float)), gamma, speed)
    shape = given[0].shape
    flat = [np.ascontiguousarray(array, dtype=np.float64).ravel() for array in given]
    out = np.empty((flat[0].size, 5))
    _forces_loop()(packed_tire, *flat, out)
    return Forces(*(out[:, i].reshape(shape) for i in range(5)))


@functools.cache
def _forces_loop() -> Callable[..., None]:
    """The compiled loop over arrays of load, slip, camber and speed."""
    sources = fingerprint(*TIRE, "tire/tire.py")

    @numba.njit(cache=True, error_model="numpy")
    def loop(p, fz, kappa, tan_alpha, gamma, speed, out):  # type: ignore[no-untyped-def]
        _ = sources
        for i in range(fz.size):
            direction = np.sign(speed[i])
            slip = law.Slip(kappa[i], tan_alpha[i], gamma[i])
            rolling = law.Rolling(speed[i], direction, direction, p[block.RADIUS])
            force = law.steady_forces(p, fz[i], slip, rolling, 1.0)
            for k in range(5):
                out[i, k] = force[k]

    return loop


def Pac89(
    a: Sequence[float] | Mapping[str, float],
    b: Sequence[float] | Mapping[str, float] | None = None,
    c: Sequence[float] | Mapping[str, float] | None = None,
    load_unit: str = "kN",
    name: str = "pac89",
    **numbers: float | str,
) -> Tire:
    """A tire of the 1989 Magic Formula from its lists as published (deg, percent).

    Args:
      a: a0..a13, lateral. A shorter list is filled with zeros; a mapping names its entries.
      b: b0..b10, longitudinal. None: the lateral curve serves along as well.
      c: c0..c17, aligning moment. None: from the pneumatic trail.
      load_unit: "kN" or "N", the unit of load of the lists.
      name: of the tire. numbers: other fields of Tire.

    Raises:
      MjchairError: unknown unit, too many coefficients, or as Tire does.
    """
    if load_unit not in LOAD_UNITS:
        raise MjchairError(f"load_unit {load_unit!r}" + nearest(load_unit, LOAD_UNITS))
    coefficients = {
        "load_unit": LOAD_UNITS[load_unit],
        "has_b": float(b is not None),
        "has_c": float(c is not None),
    }
    for letter, given, count in (("a", a, 14), ("b", b, 11), ("c", c, 18)):
        if given is None:
            continue
        if not isinstance(given, Mapping):
            if len(given) > count:
                raise MjchairError(f"{letter} has {len(given)} coefficients; at most {count}")
            given = {f"{letter}{i}": value for i, value in enumerate(given)}
        coefficients.update(given)
    return Tire(name=name, family="pac89", coefficients=coefficients, **numbers)  # type: ignore[arg-type]
