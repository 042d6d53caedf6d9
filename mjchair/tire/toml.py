"""This project's tire file: TOML with the fields of a Tire and its coefficients by name.

In: the text of a file. Out: a `Tire`; or a `Tire` in and the text out. An example:

name = "wheelchair"
family = "pac89"
load_unit = "N"          # of the lists, PAC89 only: "N" or "kN"
relaxation_x = 0.04      # m; any number of Tire

[coefficients]
a = [1.3, 0.0, 0.8]      # PAC89: the lists as published; other families by name
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from msgspec import defstruct

from mjchair.errors import MjchairError
from mjchair.tire.tire import LOAD_UNITS, Tire
from mjchair.toml_file import checked

LISTS = {"a": 14, "b": 11, "c": 18}
NUMBERS = tuple(item.name for item in fields(Tire) if item.metadata)
_TireEntry = defstruct(  # all that may stand in the file
    "_TireEntry",
    [
        ("family", str),
        ("name", str, ""),
        ("source", str, ""),
        ("side", str, ""),
        ("load_unit", str | None, None),
        *((name, float | None, None) for name in NUMBERS),
        ("coefficients", dict[str, Any], {}),
        ("unused", dict[str, str], {}),
    ],
    forbid_unknown_fields=True,
)


def parse(text: str, stem: str) -> Tire:
    """The tire in the TOML `text`; `stem` names it where the text does not.

    Raises:
      MjchairError: no TOML, an unknown key, a value of the wrong kind, or as Tire does.
    """
    try:
        document = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise MjchairError(f"not TOML: {str(error).splitlines()[0]}") from None
    entry: Any = checked(document, _TireEntry)
    numbers = {
        name: _finite(name, value)
        for name in NUMBERS
        if (value := getattr(entry, name)) is not None
    }
    return Tire(
        name=entry.name or stem,
        family=entry.family,
        source=entry.source,
        side=entry.side,
        coefficients=_coefficients(entry.coefficients, entry.family, entry.load_unit),
        unused=entry.unused,
        **numbers,
    )


def compose(tire: Tire) -> str:
    """The TOML text of `tire`; what `parse` makes of it is equal to it."""
    lines = [f"name = {_quoted(tire.name)}", f"family = {_quoted(tire.family)}"]
    coefficients = dict(tire.coefficients)
    if tire.family == "pac89":
        unit = coefficients.pop("load_unit", 1.0)
        names = {value: key for key, value in LOAD_UNITS.items()}
        if unit not in names:
            raise MjchairError(f"tire {tire.name}: load unit of {unit:g} N; it must be 1 or 1000")
        lines.append(f"load_unit = {_quoted(names[unit])}")
    if tire.side:
        lines.append(f"side = {_quoted(tire.side)}")
    lines.append(f"source = {_quoted(tire.source)}\n")
    for item in fields(tire):
        if item.metadata:
            given = f"{item.name} = {getattr(tire, item.name)!r}"
            lines.append(f"{given:<32} # {item.metadata['unit']}; {item.metadata['text']}")
    lines.append("\n[coefficients]")
    if tire.family == "pac89":
        lines += _listed(coefficients)
    lines += [f"{key} = {value!r}" for key, value in coefficients.items()]
    if tire.unused:
        lines += ["\n[unused]", *(f"{_quoted(k)} = {_quoted(v)}" for k, v in tire.unused.items())]
    return "\n".join(lines) + "\n"


def _finite(name: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise MjchairError(f"{name} is {value!r}; it must be a finite number")
    return float(value)


def _coefficients(table: Mapping[str, Any], family: str, unit: str | None) -> dict[str, float]:
    """Coefficients by name, the lists a, b, c of PAC89 spread out."""
    if family != "pac89":
        if unit is not None:
            raise MjchairError(f"load_unit is PAC89's; {family} has none")
        return {key: _finite(key, value) for key, value in table.items()}
    if unit not in LOAD_UNITS:
        raise MjchairError(f"load_unit is {unit!r}; it must be one of {', '.join(LOAD_UNITS)}")
    coefficients: dict[str, float] = {"load_unit": LOAD_UNITS[unit], "has_b": 0.0, "has_c": 0.0}
    for key, value in table.items():
        if key not in LISTS:
            coefficients[key] = _finite(key, value)
            continue
        if not isinstance(value, list) or not 0 < len(value) <= LISTS[key]:
            raise MjchairError(f"{key} must be a list of 1 to {LISTS[key]} numbers")
        coefficients |= {f"{key}{i}": _finite(f"{key}{i}", entry) for i, entry in enumerate(value)}
        if key != "a":
            coefficients[f"has_{key}"] = 1.0
    return coefficients


def _listed(coefficients: dict[str, float]) -> list[str]:
    """Lines of the lists a, b, c; what goes into one is taken out of `coefficients`."""
    lines = []
    for letter, count in LISTS.items():
        present = [i for i in range(count) if f"{letter}{i}" in coefficients]
        wanted = letter == "a" or coefficients.get(f"has_{letter}", 0.0) == 1.0
        if not wanted or present != list(range(len(present))) or not present:
            continue
        values = [coefficients.pop(f"{letter}{i}") for i in present]
        lines.append(f"{letter} = [{', '.join(map(repr, values))}]")
    for letter in "bc":  # said by the lists, or their absence
        listed = any(line.startswith(letter) for line in lines)
        if coefficients.get(f"has_{letter}", 0.0) == float(listed):
            coefficients.pop(f"has_{letter}", None)
    return lines


def _quoted(text: str) -> str:
    """A TOML basic string."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    plain = (c if ord(c) >= 32 and ord(c) != 127 else f"\\u{ord(c):04x}" for c in escaped)
    return f'"{"".join(plain)}"'
