"""Magic Formula 5.2 and 6.1/6.2: the constants of a run, computed once from the coefficients.

In: the file's coefficients by name and the tire's radius. Out: the numbers of a block.

Scaling factors, pressure and nominal load are constant in a run, so they are multiplied into the
coefficients here, and not in each step. `CONSTANTS` has the names in the order of the block.
"""

from __future__ import annotations

import math
from collections import namedtuple
from collections.abc import Mapping
from typing import Any

from mjchair.errors import MjchairError
from mjchair.tire.block import HEADER
from mjchair.tire.formula.mf_names import DEFAULTS

_GROUPS = {
    "scale and ranges": "F0 R0 FZ_MAX KAPPA_MIN KAPPA_MAX TAN_MIN TAN_MAX GAMMA_MIN GAMMA_MAX",
    "Fx": "CX MUX1 MUX2 MUX3 EX1 EX2 EX3 EX4 KX1 KX2 KX3 HX1 HX2 VX1 VX2",
    "Fx, combined": "BXA BXA_K BXA_G CXA EXA1 EXA2 HXA",
    "Fy": (
        "CY MUY1 MUY2 MUY3 EY1 EY2 EY3 EY4 EY5 KY1 KY2 KY3 KY4 KY5 KYG1 KYG2 HY1 HY2 HY3 "
        "VY1 VY2 VY3 VY4"
    ),
    "Fy, combined": ("BYK BYK_A BYK_0 BYK_G CYK EYK1 EYK2 HYK1 HYK2 RVY1 RVY2 RVY3 RVY4 RVY5 RVY6"),
    "Mz": (
        "BT1 BT2 BT3 BT4 BT5 BT6 CT DT1 DT2 DT3 DT4 ET1 ET2 ET3 ET4 ET5 HT1 HT2 HT3 HT4 "
        "DR6 DR7 DR8 DR9 DR10 DR11 BR9 BR10 S1 S2 S3 S4"
    ),
    "Mx": "X1 X2 X3 X4 X5 X6 X7 X8 X9 X10 X11 X12 X13 X14",
    "My": "LFZ Y1 Y2 Y3 Y4 Y5 Y6 Y7",
    "relaxation": "SX1 SX2 SX3 SY1 SY2 SY3",  # 6.1: stiffness over load; 5.2: lengths
}
CONSTANTS = tuple(name for names in _GROUPS.values() for name in names.split())
# where each of them lies in the block: compiled code reads the attributes as constants
AT: Any = namedtuple("AT", CONSTANTS)(*range(HEADER, HEADER + len(CONSTANTS)))


def run_constants(given: Mapping[str, float], radius: float, version_52: bool) -> list[float]:
    """The constants, in the order of `CONSTANTS`.

    Args:
      given: coefficients by their .tir names. radius: m, where UNLOADED_RADIUS is not among them.
      version_52: the file is of Magic Formula 5.2.

    Raises:
      MjchairError: a number without which there is no force is missing or 0, or a number that no
        tire has: see `_check`.
    """
    c = DEFAULTS | dict(given)
    _check(c)
    get = _Numbers(c)
    r0 = c.get("UNLOADED_RADIUS", 0.0) or radius
    f0 = c["FNOMIN"] * c["LFZO"]
    if r0 <= 0.0 or f0 <= 0.0:
        raise MjchairError(f"UNLOADED_RADIUS {r0:g} m and load {f0:g} N; both must be above 0")
    dpi = pressure_change(c)
    constants = (
        {"F0": f0, "R0": r0}
        | _ranges(get)
        | _longitudinal(get, dpi)
        | _lateral(get, dpi, f0, version_52)
        | _aligning(get, dpi, f0, r0)
        | _overturning(get, dpi, f0, r0)
        | _rolling(get, dpi, r0, version_52)
        | (_relaxation_52(get, f0, r0) if version_52 else _relaxation_61(get, dpi))
    )
    if version_52:
        _scale_camber(constants, get)
    return [constants[name] for name in CONSTANTS]


NEEDED = ("FNOMIN", "PCX1", "PDX1", "PKX1", "PCY1", "PDY1", "PKY1", "PKY2", "PKY4")
ABOVE_ZERO = ("FNOMIN", "LFZO", "LCX", "LMUX", "LKX", "LCY", "LMUY", "LKY")
NOT_BELOW_ZERO = ("LTR", "LMY", "LXAL", "LYKA", "LSGKP", "LSGAL")
RANGES = ("PRES", "FZ", "KPU", "ALP", "CAM")  # each with MIN and MAX


def _check(c: Mapping[str, float]) -> None:
    """Refuse what no tire has.

    Scaling factors of shifts and of camber may be negative: some mirror a tire with them.

    Raises:
      MjchairError: a number missing without which there is no force; a scaling factor, a range or
        a stiffness that no tire has.
    """
    for name in NEEDED:
        if c.get(name, 0.0) == 0.0:
            raise MjchairError(f"{name} is missing or 0, so the formula has no scale; give it")
    for name in ABOVE_ZERO:
        if c[name] <= 0.0:
            raise MjchairError(f"{name} is {c[name]:g}; it must be above 0")
    for name in NOT_BELOW_ZERO:
        if c[name] < 0.0:
            raise MjchairError(f"{name} is {c[name]:g}; it must not be below 0")
    for name in RANGES:
        low, high = c.get(f"{name}MIN"), c.get(f"{name}MAX")
        if low is not None and high is not None and low > high:
            raise MjchairError(f"{name}MIN is {low:g}, above {name}MAX, {high:g}; exchange them")
    if c["PKX1"] < 0.0:
        raise MjchairError(f"PKX1 is {c['PKX1']:g}; a slip stiffness is above 0")
    if c["PKY1"] * math.sin(c["PKY4"] * math.atan(1.0 / c["PKY2"])) >= 0.0:
        with_ = "".join(f", {n} {c[n]:g}" for n in ("PKY2", "PKY4") if c[n] < 0.0)
        raise MjchairError(
            f"PKY1 is {c['PKY1']:g}{with_}: the lateral force would grow with the slip angle; in "
            "the ISO axes of .tir files PKY1 is below 0"
        )


def pressure_change(c: Mapping[str, float]) -> float:
    """(INFLPRES - NOMPRES) / NOMPRES, held within the file's range; 0 where it has no pressures."""
    pressure, nominal = c.get("INFLPRES", 0.0), c.get("NOMPRES", 0.0)
    if pressure <= 0.0 or nominal <= 0.0:
        return 0.0
    low, high = c.get("PRESMIN", 0.0), c.get("PRESMAX", 0.0)
    if high > low:
        pressure = min(max(pressure, low), high)
    return (pressure - nominal) / nominal


class _Numbers:
    """Coefficients by name, 0 where left out."""

    def __init__(self, numbers: Mapping[str, float]) -> None:
        self.numbers = numbers

    def __getattr__(self, name: str) -> float:
        return self.numbers.get(name, 0.0)


def _ranges(c: _Numbers) -> dict[str, float]:
    """Ranges to clamp to; without limit where the file gives none."""
    low_tan = math.tan(c.ALPMIN) if -1.57 < c.ALPMIN < 0.0 else -1e6
    high_tan = math.tan(c.ALPMAX) if 0.0 < c.ALPMAX < 1.57 else 1e6
    return {
        "FZ_MAX": c.FZMAX if c.FZMAX > 0.0 else 1e9,
        "KAPPA_MIN": c.KPUMIN if c.KPUMIN < 0.0 else -1e6,
        "KAPPA_MAX": c.KPUMAX if c.KPUMAX > 0.0 else 1e6,
        "TAN_MIN": low_tan,
        "TAN_MAX": high_tan,
        "GAMMA_MIN": c.CAMMIN if c.CAMMIN < 0.0 else -1.57,
        "GAMMA_MAX": c.CAMMAX if c.CAMMAX > 0.0 else 1.57,
    }


def _longitudinal(c: _Numbers, dpi: float) -> dict[str, float]:
    mu = (1.0 + c.PPX3 * dpi + c.PPX4 * dpi**2) * c.LMUX
    k = (1.0 + c.PPX1 * dpi + c.PPX2 * dpi**2) * c.LKX
    v = c.LVX * c.LMUX
    return {
        "CX": c.PCX1 * c.LCX,
        "MUX1": c.PDX1 * mu,
        "MUX2": c.PDX2 * mu,
        "MUX3": c.PDX3,
        "EX1": c.PEX1 * c.LEX,
        "EX2": c.PEX2 * c.LEX,
        "EX3": c.PEX3 * c.LEX,
        "EX4": c.PEX4,
        "KX1": c.PKX1 * k,
        "KX2": c.PKX2 * k,
        "KX3": c.PKX3,
        "HX1": c.PHX1 * c.LHX,
        "HX2": c.PHX2 * c.LHX,
        "VX1": c.PVX1 * v,
        "VX2": c.PVX2 * v,
        "BXA": c.RBX1 * c.LXAL,
        "BXA_K": c.RBX2,
        "BXA_G": c.RBX3 * c.LXAL,
        "CXA": c.RCX1,
        "EXA1": c.REX1,
        "EXA2": c.REX2,
        "HXA": c.RHX1,
    }


def _lateral(c: _Numbers, dpi: float, f0: float, version_52: bool) -> dict[str, float]:
    mu = (1.0 + c.PPY3 * dpi + c.PPY4 * dpi**2) * c.LMUY
    best = 1.0 + c.PPY2 * dpi
    camber = (1.0 + c.PPY5 * dpi) * c.LKYC
    v, vg = c.LVY * c.LMUY, c.LKYC * c.LMUY
    return {
        "CY": c.PCY1 * c.LCY,
        "MUY1": c.PDY1 * mu,
        "MUY2": c.PDY2 * mu,
        "MUY3": c.PDY3,
        "EY1": c.PEY1 * c.LEY,
        "EY2": c.PEY2 * c.LEY,
        "EY3": c.PEY3,
        "EY4": c.PEY4,
        "EY5": c.PEY5,
        "KY1": c.PKY1 * f0 * (1.0 + c.PPY1 * dpi) * c.LKY,
        "KY2": c.PKY2 * best,
        "KY3": c.PKY3,
        "KY4": c.PKY4,
        "KY5": c.PKY5 * best,
        "KYG1": c.PKY6 * camber,
        "KYG2": c.PKY7 * camber,
        "HY1": c.PHY1 * c.LHY,
        "HY2": c.PHY2 * c.LHY,
        "HY3": c.PHY3 * c.LKYC if version_52 else 0.0,
        "VY1": c.PVY1 * v,
        "VY2": c.PVY2 * v,
        "VY3": c.PVY3 * vg,
        "VY4": c.PVY4 * vg,
        "BYK": c.RBY1 * c.LYKA,
        "BYK_A": c.RBY2,
        "BYK_0": c.RBY3,
        "BYK_G": c.RBY4 * c.LYKA,
        "CYK": c.RCY1,
        "EYK1": c.REY1,
        "EYK2": c.REY2,
        "HYK1": c.RHY1,
        "HYK2": c.RHY2,
        "RVY1": c.RVY1 * c.LVYKA,
        "RVY2": c.RVY2 * c.LVYKA,
        "RVY3": c.RVY3 * c.LVYKA,
        "RVY4": c.RVY4,
        "RVY5": c.RVY5,
        "RVY6": c.RVY6,
    }


def _aligning(c: _Numbers, dpi: float, f0: float, r0: float) -> dict[str, float]:
    slope = c.LKY / c.LMUY if c.LMUY else 0.0
    trail = (1.0 - c.PPZ1 * dpi) * r0 / f0 * c.LTR * c.LFZO
    residual = c.LRES * c.LMUY * r0
    camber = c.LKZC * c.LMUY * r0
    arm = r0 * c.LS
    return {
        "BT1": c.QBZ1 * slope,
        "BT2": c.QBZ2 * slope,
        "BT3": c.QBZ3 * slope,
        "BT4": c.QBZ4,
        "BT5": c.QBZ5,
        "BT6": c.QBZ6,
        "CT": c.QCZ1,
        "DT1": c.QDZ1 * trail,
        "DT2": c.QDZ2 * trail,
        "DT3": c.QDZ3,
        "DT4": c.QDZ4,
        "ET1": c.QEZ1,
        "ET2": c.QEZ2,
        "ET3": c.QEZ3,
        "ET4": c.QEZ4,
        "ET5": c.QEZ5,
        "HT1": c.QHZ1,
        "HT2": c.QHZ2,
        "HT3": c.QHZ3,
        "HT4": c.QHZ4,
        "DR6": c.QDZ6 * residual,
        "DR7": c.QDZ7 * residual,
        "DR8": c.QDZ8 * camber * (1.0 + c.PPZ2 * dpi),
        "DR9": c.QDZ9 * camber * (1.0 + c.PPZ2 * dpi),
        "DR10": c.QDZ10 * camber,
        "DR11": c.QDZ11 * camber,
        "BR9": c.QBZ9 * slope,
        "BR10": c.QBZ10,
        "S1": c.SSZ1 * arm,
        "S2": c.SSZ2 * arm / c.FNOMIN,
        "S3": c.SSZ3 * arm,
        "S4": c.SSZ4 * arm,
    }


def _overturning(c: _Numbers, dpi: float, f0: float, r0: float) -> dict[str, float]:
    r = r0 * c.LMX
    return {
        "X1": c.QSX1 * c.LVMX * r,
        "X2": c.QSX2 * (1.0 + c.PPMX1 * dpi) * r,
        "X3": c.QSX3 / c.FNOMIN * r,
        "X4": c.QSX4 * r,
        "X5": c.QSX5,
        "X6": c.QSX6 / c.FNOMIN,
        "X7": c.QSX7,
        "X8": c.QSX8,
        "X9": c.QSX9 / c.FNOMIN,
        "X10": c.QSX10 * r,
        "X11": c.QSX11 / c.FNOMIN,
        "X12": c.QSX12 * r,
        "X13": c.QSX13 * r,
        "X14": c.QSX14 * r,
    }


def _rolling(c: _Numbers, dpi: float, r0: float, version_52: bool) -> dict[str, float]:
    pressure = 1.0 if version_52 or c.QSY8 == 0.0 else max(1.0 + dpi, 0.0) ** c.QSY8
    r = r0 * c.FNOMIN * c.LMY * pressure
    v0 = c.LONGVL or DEFAULTS["LONGVL"]
    return {
        "LFZ": 1.0 / c.FNOMIN,
        "Y1": c.QSY1 * r,
        "Y2": c.QSY2 * r / c.FNOMIN,
        "Y3": c.QSY3 * r / v0,
        "Y4": c.QSY4 * r / v0**4,
        "Y5": 0.0 if version_52 else c.QSY5 * r,
        "Y6": 0.0 if version_52 else c.QSY6 * r / c.FNOMIN,
        "Y7": 1.0 if version_52 else c.QSY7,
    }


def _relaxation_61(c: _Numbers, dpi: float) -> dict[str, float]:
    """Carcass stiffness (N/m) as a quadratic in the load."""
    x = c.LONGITUDINAL_STIFFNESS * (1.0 + c.PCFX3 * dpi)
    y = c.LATERAL_STIFFNESS * (1.0 + c.PCFY3 * dpi)
    return {
        "SX1": x,
        "SX2": c.PCFX1 * x,
        "SX3": c.PCFX2 * x,
        "SY1": y,
        "SY2": c.PCFY1 * y,
        "SY3": c.PCFY2 * y,
    }


def _relaxation_52(c: _Numbers, f0: float, r0: float) -> dict[str, float]:
    x = c.LSGKP * r0 / c.FNOMIN
    return {
        "SX1": c.PTX1 * x,
        "SX2": c.PTX2 * x,
        "SX3": c.PTX3,
        "SY1": c.PTY1 * r0 * c.LFZO * c.LSGAL,
        "SY2": c.PTY2 * f0,
        "SY3": 0.0,
    }


def _scale_camber(constants: dict[str, float], c: _Numbers) -> None:
    """5.2 scales the camber itself: LGAX in Fx, LGAY in Fy, LGAZ in Mz."""
    constants["MUX3"] *= c.LGAX**2
    constants["MUY3"] *= c.LGAY**2
    constants["KY3"] *= abs(c.LGAY)
    for name in ("EY4", "HY3", "VY3", "VY4"):
        constants[name] *= c.LGAY
    constants["BT5"] *= abs(c.LGAZ)
    constants["DT4"] *= c.LGAZ**2
    for name in ("BT4", "DT3", "ET5", "HT3", "HT4", "DR8", "DR9"):
        constants[name] *= c.LGAZ
