"""What is fitted: each family's parameters, with start, bounds and prior, and its coefficients.

The Magic Formula families share one set of parameters at the largest load Fm of the data: the shape
C, the peak friction mu and its change with load, the slope over load s and the load q = Fm / a4
that bends it, the curvature E and its change. `coefficients` turns them into published ones.

Priors are stated here, once. They matter only where the data say less: `fit` reports where.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mjchair.errors import MjchairError, nearest
from mjchair.measurement.rig import RigTable
from mjchair.tire.paper import curvature_from_curve, shape_from_curve

Array = NDArray[np.float64]
DEGREE = 180.0 / math.pi
FAMILIES = ("pac89", "quadratic", "linear", "mf61")


@dataclass(frozen=True)
class Parameter:
    """One number to fit.

    Attributes:
      name, unit, text: what it is. start: where to begin. low, high: bounds.
      prior: mean, or None where the data alone decide. spread: standard deviation of the prior.
    """

    name: str
    unit: str
    text: str
    start: float
    low: float
    high: float
    prior: float | None = None
    spread: float = math.inf

    @property
    def scale(self) -> float:
        """A size to divide by."""
        return self.spread if self.prior is not None else max(abs(self.start), 1e-6)


@dataclass(frozen=True)
class Curve:
    """A family with its parameters for one table.

    Attributes:
      family: of mjchair.tire. parameters: in order.
      coefficients: parameters (n,) -> the family's coefficients by name.
    """

    family: str
    parameters: tuple[Parameter, ...]
    coefficients: Callable[[Array], Mapping[str, float]]


def curve(family: str, table: RigTable) -> Curve:
    """The curve of a family for a table, with starting values from it.

    Raises:
      MjchairError: an unknown family, or forces that are all zero.
    """
    if family not in FAMILIES:
        raise MjchairError(f"family {family!r} cannot be fitted" + nearest(family, FAMILIES))
    if not np.any(table.fy):
        raise MjchairError(f"{table.source}: every lateral force is 0; there is nothing to fit")
    if family in ("linear", "quadratic"):
        return _straight(family, table)
    return _magic(family, table)


def driven(table: RigTable) -> Array:
    """Rows (n,) whose longitudinal force says something: driven or braked, and measured."""
    return (table.kappa != 0.0) & np.isfinite(table.fx)


def starting_values(table: RigTable) -> dict[str, float]:
    """Friction, slope over load (1/rad), C by (16) and E by (17), from the largest load's curve."""
    top = table.load.max()
    rows = (table.load > 0.95 * top) & (table.kappa == 0.0)
    rows = rows if rows.any() else table.load > 0.0
    order = np.argsort(np.abs(table.angle[rows]))
    angle, force = np.abs(table.angle[rows])[order], np.abs(table.fy[rows])[order]
    peak = max(float(force.max()), 1e-3)
    small = angle > 0.5
    slope = float(np.max(force[small] / angle[small])) if small.any() else peak / 5.0
    slope = max(slope, peak / 30.0)
    asymptote = min(float(force[angle >= 0.9 * angle.max()].mean()), 0.98 * peak)
    c = min(max(shape_from_curve(asymptote, peak), 1.1), 1.8)
    b = 1.3 * slope / (c * peak)
    at = max(float(angle[np.argmax(force)]), 1.0)
    e = min(max(curvature_from_curve(b, c, at), -3.0), 0.8)
    return {"mu": peak / top, "s": 1.3 * slope * DEGREE / top, "c": c, "e": e, "load": top}


def _magic(family: str, table: RigTable) -> Curve:
    found = starting_values(table)
    top, mu, s = found["load"], found["mu"], found["s"]
    parameters = [
        Parameter("C", "1", "shape, (9)", found["c"], 1.02, 1.98, 1.4, 0.3),
        Parameter("mu", "1", f"peak friction at {top:g} N", mu, 0.2 * mu, 4.0 * mu),
        Parameter("dmu", "1", "its change with load / Fm", 0.0, -mu, mu, 0.0, 0.3 * mu),
        Parameter("s", "1/rad", f"slope over load at {top:g} N", s, 0.2 * s, 6.0 * s),
        Parameter("q", "1", "Fm / a4, what bends the slope", 0.5, 0.02, 3.0, 0.5, 0.5),
        Parameter("E", "1", f"curvature at {top:g} N", found["e"], -6.0, 0.99, 0.0, 1.0),
        Parameter("dE", "1", "its change with load / Fm", 0.0, -4.0, 4.0, 0.0, 0.5),
    ]
    along = bool(driven(table).any())
    if along:
        parameters += [
            Parameter("Cx", "1", "shape along", 1.5, 1.02, 1.98, 1.5, 0.3),
            Parameter("mux", "1", "peak friction along", mu, 0.2 * mu, 4.0 * mu),
            Parameter("sx", "1", "slope over load along", s, 0.1 * s, 10.0 * s),
            Parameter("Ex", "1", "curvature along", 0.0, -6.0, 0.99, 0.0, 1.0),
        ]
    encode = _pac89 if family == "pac89" else _mf61
    return Curve(family, tuple(parameters), lambda theta: encode(theta, top, along))


def _pac89(theta: Array, top: float, along: bool) -> dict[str, float]:
    """Coefficients of PAC89 in N, deg and percent."""
    c, mu, dmu, s, q, e, de = theta[:7]
    bend = math.sin(2.0 * math.atan(q))
    found = {
        "load_unit": 1.0,
        "has_b": float(along),
        "has_c": 0.0,
        "a0": c,
        "a1": dmu / top,
        "a2": mu - dmu,
        "a3": s * top / DEGREE / bend,
        "a4": top / q,
        "a6": de / top,
        "a7": e - de,
    }
    if along:
        cx, mux, sx, ex = theta[7:11]
        found |= {"b0": cx, "b2": mux, "b4": sx / 100.0, "b8": ex}
    return found


def _mf61(theta: Array, top: float, along: bool) -> dict[str, float]:
    """Coefficients of Magic Formula 6.1 at the nominal load Fm; isotropic where not driven."""
    c, mu, dmu, s, q, e, de = theta[:7]
    cx, mux, sx, ex = theta[7:11] if along else (c, mu, s, e)
    return {
        "FNOMIN": top,
        "PCY1": c,
        "PDY1": mu,
        "PDY2": dmu,
        "PEY1": e,
        "PEY2": de,
        "PKY1": -s / math.sin(2.0 * math.atan(q)),
        "PKY2": 1.0 / q,
        "PCX1": cx,
        "PDX1": mux,
        "PEX1": ex,
        "PKX1": sx,
    }


def _straight(family: str, table: RigTable) -> Curve:
    """Equations (1) and (2), up to friction."""
    found = starting_values(table)
    top, mu, s = found["load"], found["mu"], found["s"]
    friction = Parameter("friction", "1", "force over load, at most", mu, 0.2 * mu, 6.0 * mu)
    if family == "linear":
        c = Parameter(
            "C_alpha", "N/rad", "slope, (1)", 0.5 * s * top, 0.01 * s * top, 6.0 * s * top
        )
        return Curve(
            family,
            (c, friction),
            lambda theta: {"cornering_stiffness": theta[0], "friction": theta[1]},
        )
    slope = Parameter("a", "1/rad", "slope over load, (2)", s, 0.1 * s, 8.0 * s)
    bend = Parameter("bFm/a", "1", "what bends it, (2)", 0.2, -0.5, 0.95, 0.25, 0.3)
    return Curve(
        family,
        (slope, bend, friction),
        lambda theta: {"a": theta[0], "b": theta[0] * theta[1] / top, "friction": theta[2]},
    )
