"""The parameters that are fitted for each tire family: starting value, bounds and prior.

In: the name of a family and a rig table. Out: a `Curve`: the parameters to fit, and the function
that turns their values into the published coefficients of the family.

The families of the Magic Formula share one set of parameters, all at the largest load Fm of the
table: the shape factor C, the peak friction mu and its change with load, the cornering stiffness
over load s, the ratio q = Fm / a4 (how far the cornering stiffness has stopped growing with the
load), the curvature factor E and its change with load. Numbers in parentheses are equations of
Silva & Dedini (COBEM 2007).

All priors are stated in this file. A prior matters only where the data determine a parameter
poorly; `fit` reports these parameters.
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
      name, unit, text: what it is. start: value at which the search starts. low, high: bounds.
      prior: mean of the prior, or None where the parameter has none.
      spread: standard deviation of the prior.
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
        """A typical size of the parameter, by which the search divides it."""
        return self.spread if self.prior is not None else max(abs(self.start), 1e-6)


@dataclass(frozen=True)
class Curve:
    """A tire family with its parameters for one rig table.

    Attributes:
      family: its name in mjchair.tire. parameters: in the order of the parameter vector.
      coefficients: turns a parameter vector (n,) into the family's coefficients by name.
    """

    family: str
    parameters: tuple[Parameter, ...]
    coefficients: Callable[[Array], Mapping[str, float]]


def curve(family: str, table: RigTable) -> Curve:
    """The parameters of a family for a table, with starting values from the table.

    Raises:
      MjchairError: an unknown family, or lateral forces that are all zero.
    """
    if family not in FAMILIES:
        raise MjchairError(f"family {family!r} cannot be fitted" + nearest(family, FAMILIES))
    if not np.any(table.fy):
        raise MjchairError(f"{table.source}: every lateral force is 0; there is nothing to fit")
    if family in ("linear", "quadratic"):
        return _linear_or_quadratic(family, table)
    return _magic_formula(family, table)


def driven(table: RigTable) -> NDArray[np.bool_]:
    """Whether a row (n,) has a longitudinal slip and a measured longitudinal force."""
    return np.asarray((table.kappa != 0.0) & np.isfinite(table.fx))


def starting_values(table: RigTable) -> dict[str, float]:
    """Rough values from the curve at the largest load, where the search starts.

    Returns:
      `load`: the largest load, N. `mu`: peak friction. `s`: cornering stiffness over load, 1/rad.
      `c`: shape factor by (16). `e`: curvature factor by (17).
    """
    largest_load = table.load.max()
    rows = (table.load > 0.95 * largest_load) & (table.kappa == 0.0)
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
    peak_angle = max(float(angle[np.argmax(force)]), 1.0)
    e = min(max(curvature_from_curve(b, c, peak_angle), -3.0), 0.8)
    return {
        "load": largest_load,
        "mu": peak / largest_load,
        "s": 1.3 * slope * DEGREE / largest_load,
        "c": c,
        "e": e,
    }


def _magic_formula(family: str, table: RigTable) -> Curve:
    """The parameters of pac89 or mf61; those of the longitudinal force where it was measured."""
    start = starting_values(table)
    load, mu, s = start["load"], start["mu"], start["s"]
    parameters = [
        Parameter("C", "1", "shape factor, (9)", start["c"], 1.02, 1.98, 1.4, 0.3),
        Parameter("mu", "1", f"peak friction at Fm = {load:g} N", mu, 0.2 * mu, 4.0 * mu),
        Parameter("dmu", "1", "change of mu with load / Fm", 0.0, -mu, mu, 0.0, 0.3 * mu),
        Parameter("s", "1/rad", "cornering stiffness over load at Fm", s, 0.2 * s, 6.0 * s),
        Parameter("q", "1", "Fm / a4, bends stiffness over load", 0.5, 0.02, 3.0, 0.5, 0.5),
        Parameter("E", "1", "curvature factor at Fm", start["e"], -6.0, 0.99, 0.0, 1.0),
        Parameter("dE", "1", "change of E with load / Fm", 0.0, -4.0, 4.0, 0.0, 0.5),
    ]
    longitudinal = bool(driven(table).any())
    if longitudinal:
        parameters += [
            Parameter("Cx", "1", "longitudinal shape factor", 1.5, 1.02, 1.98, 1.5, 0.3),
            Parameter("mux", "1", "longitudinal peak friction", mu, 0.2 * mu, 4.0 * mu),
            Parameter("sx", "1", "slip stiffness over load", s, 0.1 * s, 10.0 * s),
            Parameter("Ex", "1", "longitudinal curvature factor", 0.0, -6.0, 0.99, 0.0, 1.0),
        ]
    published = _pac89 if family == "pac89" else _mf61
    return Curve(family, tuple(parameters), lambda theta: published(theta, load, longitudinal))


def _pac89(theta: Array, load: float, longitudinal: bool) -> dict[str, float]:
    """Coefficients of PAC89 in N, deg and percent.

    Args:
      theta: parameter vector. load: Fm, N. longitudinal: whether `theta` has Cx, mux, sx and Ex.
    """
    c, mu, dmu, s, q, e, de = theta[:7]
    bend = math.sin(2.0 * math.atan(q))
    coefficients = {
        "load_unit": 1.0,
        "has_b": float(longitudinal),
        "has_c": 0.0,
        "a0": c,
        "a1": dmu / load,
        "a2": mu - dmu,
        "a3": s * load / DEGREE / bend,
        "a4": load / q,
        "a6": de / load,
        "a7": e - de,
    }
    if longitudinal:
        cx, mux, sx, ex = theta[7:11]
        coefficients |= {"b0": cx, "b2": mux, "b4": sx / 100.0, "b8": ex}
    return coefficients


def _mf61(theta: Array, load: float, longitudinal: bool) -> dict[str, float]:
    """Coefficients of Magic Formula 6.1 at the nominal load Fm.

    Where no longitudinal force was measured, its curve is taken equal to the lateral one.
    Arguments as of `_pac89`.
    """
    c, mu, dmu, s, q, e, de = theta[:7]
    cx, mux, sx, ex = theta[7:11] if longitudinal else (c, mu, s, e)
    return {
        "FNOMIN": load,
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


def _linear_or_quadratic(family: str, table: RigTable) -> Curve:
    """The parameters of equations (1) and (2), whose force is limited by friction."""
    start = starting_values(table)
    load, mu, s = start["load"], start["mu"], start["s"]
    friction = Parameter("friction", "1", "largest force over load", mu, 0.2 * mu, 6.0 * mu)
    if family == "linear":
        stiffness = s * load
        c = Parameter(
            "C_alpha",
            "N/rad",
            "cornering stiffness, (1)",
            0.5 * stiffness,
            0.01 * stiffness,
            6.0 * stiffness,
        )
        return Curve(
            family,
            (c, friction),
            lambda theta: {"cornering_stiffness": theta[0], "friction": theta[1]},
        )
    slope = Parameter("a", "1/rad", "stiffness over load, (2)", s, 0.1 * s, 8.0 * s)
    bend = Parameter("bFm/a", "1", "its decrease from 0 to Fm, (2)", 0.2, -0.5, 0.95, 0.25, 0.3)
    return Curve(
        family,
        (slope, bend, friction),
        lambda theta: {"a": theta[0], "b": theta[0] * theta[1] / load, "friction": theta[2]},
    )
