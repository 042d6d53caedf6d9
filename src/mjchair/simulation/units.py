"""Units that a column of a table may carry, and what they are in SI."""

from __future__ import annotations

import math
import re

from mjchair.errors import MjchairError, nearest

# unit -> (SI unit, factor)
UNITS: dict[str, tuple[str, float]] = {
    "s": ("s", 1.0),
    "ms": ("s", 1e-3),
    "m": ("m", 1.0),
    "mm": ("m", 1e-3),
    "rad": ("rad", 1.0),
    "deg": ("rad", math.pi / 180.0),
    "m/s": ("m/s", 1.0),
    "km/h": ("m/s", 1.0 / 3.6),
    "rad/s": ("rad/s", 1.0),
    "deg/s": ("rad/s", math.pi / 180.0),
    "rpm": ("rad/s", math.pi / 30.0),
    "m/s^2": ("m/s^2", 1.0),
    "g": ("m/s^2", 9.80665),
    "N": ("N", 1.0),
    "N m": ("N m", 1.0),
    "Nm": ("N m", 1.0),
    "N mm": ("N m", 1e-3),
    "1": ("1", 1.0),
}

_WITH_UNIT = re.compile(r"^(?P<name>[^\[\]]+?)\s*(?:\[(?P<unit>[^\[\]]*)\])?$")


def split_header(text: str) -> tuple[str, float]:
    """The name and the factor to SI of a column such as ``left_wheel_speed [deg/s]``.

    A name without brackets is in SI already.

    Raises:
      MjchairError: an empty name, or a unit that is not known.
    """
    match = _WITH_UNIT.match(text.strip())
    if match is None:
        raise MjchairError(f"column {text!r}; a column is a name, or a name [unit]")
    unit = match["unit"]
    if unit is None:
        return match["name"], 1.0
    if unit.strip() not in UNITS:
        raise MjchairError(f"column {text!r}: unknown unit {unit!r}" + nearest(unit, UNITS))
    return match["name"], UNITS[unit.strip()][1]
