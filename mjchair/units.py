"""Units: what a column of a table or a value on the command line may carry, and its size in SI.

In: text such as ``imu_gyro.z [deg/s]`` or ``3deg``. Out: a name and a factor, or a number in SI.
"""

from __future__ import annotations

import math
import re

from mjchair.errors import MjchairError

# unit -> (SI unit, factor)
UNITS: dict[str, tuple[str, float]] = {
    "s": ("s", 1.0),
    "ms": ("s", 1e-3),
    "m": ("m", 1.0),
    "mm": ("m", 1e-3),
    "cm": ("m", 1e-2),
    "in": ("m", 0.0254),
    "rad": ("rad", 1.0),
    "deg": ("rad", math.pi / 180.0),
    "rev": ("rad", 2.0 * math.pi),
    "m/s": ("m/s", 1.0),
    "km/h": ("m/s", 1.0 / 3.6),
    "rad/s": ("rad/s", 1.0),
    "deg/s": ("rad/s", math.pi / 180.0),
    "rpm": ("rad/s", math.pi / 30.0),
    "m/s^2": ("m/s^2", 1.0),
    "g": ("m/s^2", 9.80665),
    "kg": ("kg", 1.0),
    "lb": ("kg", 0.45359237),
    "N": ("N", 1.0),
    "kN": ("N", 1000.0),
    "N m": ("N m", 1.0),
    "Nm": ("N m", 1.0),
    "N cm": ("N m", 1e-2),
    "Ncm": ("N m", 1e-2),
    "N mm": ("N m", 1e-3),
    "Nmm": ("N m", 1e-3),
    "1": ("1", 1.0),
    "%": ("1", 1e-2),
}

# what people write for a unit of UNITS
WRITTEN = {
    "°": "deg",
    "°/s": "deg/s",
    "deg/sec": "deg/s",
    "N·m": "N m",
    "N⋅m": "N m",
    "N.m": "N m",
}

# names of units in full, longest first -> their symbols in UNITS
NAMES = {
    "degrees": "deg",
    "degree": "deg",
    "radians": "rad",
    "seconds": "s",
    "second": "s",
    "sec": "s",
    "metres": "m",
    "meters": "m",
    "kph": "km/h",
    "kmh": "km/h",
    "newton": "n",
    "percent": "%",
}

_WITH_UNIT = re.compile(r"^(?P<name>[^\[\]]+?)\s*(?:\[(?P<unit>[^\[\]]*)\])?$")
_QUANTITY = re.compile(r"^(?P<number>[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(?P<unit>.*)$")


def nearest_unit(unit: str) -> str:
    """The end of an error line about an unknown unit; it asks only for another way to write it.

    Units that look alike may measure something else: N cm is no cm, and lbf no lb.
    """
    plain = _plain(unit)
    same = next((known for known in UNITS if _plain(known) == plain), None)
    listing = f"known: {', '.join(UNITS)}"
    return f"; did you mean {same!r}? ({listing})" if same else f"; {listing}"


def _plain(unit: str) -> str:
    """A unit without what people write in different ways: case, spaces, dots, names in full."""
    text = unit.lower().replace("\u00b2", "2").replace("\u00b0", "deg")
    for name, short in NAMES.items():
        text = text.replace(name, short)
    return re.sub(r"[\s.*^_()\u00b7]", "", text)


def split_header(text: str) -> tuple[str, str]:
    """The name and the unit of a column such as ``left_wheel_speed [deg/s]``.

    A name without brackets is in SI already, and its unit is empty.

    Raises:
      MjchairError: an empty name, or a unit that is not known.
    """
    match = _WITH_UNIT.match(text.strip())
    if match is None:
        raise MjchairError(f"column {text!r}; a column is a name, or a name [unit]")
    unit = match["unit"]
    if unit is None:
        return match["name"], ""
    if known(unit) not in UNITS:
        raise MjchairError(f"column {text!r}: unknown unit {unit!r}" + nearest_unit(unit))
    return match["name"], known(unit)


def known(unit: str) -> str:
    """A unit as UNITS calls it, where people write it in another way; else as it is."""
    return WRITTEN.get(unit.strip(), unit.strip())


def with_unit(value: float | str, unit: str) -> str:
    """A number, or its text, and its unit: "3 N", and "3" where the unit is 1."""
    told = value if isinstance(value, str) else f"{value:g}"
    return told if unit in ("", "1") else f"{told} {unit}"


def per_cent(share: float) -> str:
    """A share as it is written everywhere: "94 %" of 0.94."""
    return f"{100.0 * share:.0f} %"


def probable(share: float) -> str:
    """A probability as it is written everywhere: of what data tell none is whole."""
    return "more than 99 %" if share >= 0.995 else per_cent(share)


def factor(unit: str) -> float:
    """What a number in a unit of UNITS is multiplied by to be in SI; 1 for no unit."""
    return UNITS[unit][1] if unit else 1.0


def grade(text: str) -> float:
    """A grade, rise over run, from 0.08, 8% or 1:12.

    Raises:
      MjchairError: it is none of these.
    """
    rise, colon, run = text.partition(":")
    try:
        if colon:
            return float(rise) / float(run)
        return quantity(text, "1", "grade")
    except (ValueError, ZeroDivisionError):
        raise MjchairError(
            f"grade is {text!r}; it must be a rise over run, such as 0.08, 8% or 1:12"
        ) from None


def units_of(si: str) -> list[str]:
    """The units that measure the same thing as an SI unit, that one first."""
    return [unit for unit, (base, _) in UNITS.items() if base == si]


def quantity(text: str, si: str, what: str) -> float:
    """A number in SI from text such as ``3deg``, ``24 in`` or ``0.3``.

    Args:
      text: a number, with a unit behind it or, in SI, without. si: the SI unit of the result.
      what: the name of the value, for error lines.

    Raises:
      MjchairError: no number, or a unit of another kind.
    """
    match = _QUANTITY.match(text.strip())
    if match is None:
        units = ", ".join(units_of(si)) or si
        raise MjchairError(f"{what} is {text!r}; it must be a number, with or without a unit "
                           f"({units})")  # fmt: skip
    unit = known(match["unit"])
    if not unit:
        return float(match["number"])
    if unit not in units_of(si):
        raise MjchairError(f"{what} is {text!r}: its unit must be one of {', '.join(units_of(si))}")
    return float(match["number"]) * UNITS[unit][1]


def with_error(value: float, std: float | None) -> str:
    """A value with its standard deviation, to the digits that this allows; None: it has none."""
    if std is None:
        return f"{value:.4g}"
    if not (0.0 < std < 1e4 and std > 1e-6):
        return f"{value:.4g} ± {std:.2g}"
    digits = max(0, 1 - math.floor(math.log10(std)))
    return f"{value:.{digits}f} ± {std:.{digits}f}"
