"""This project's tire file: TOML with the fields of a Tire and its coefficients by name.

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

from mjchair.errors import MjchairError, nearest
from mjchair.tire.tire import LOAD_UNITS, Tire

LISTS = {"a": 14, "b": 11, "c": 18}
TEXTS = ("name", "family", "source", "load_unit")


def parse(text: str, stem: str) -> Tire:
    """The tire in the TOML `text`; `stem` names it where the text does not.

    Raises:
      MjchairError: no TOML, an unknown key, a value of the wrong kind, or as Tire does.
    """
    try:
        document = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise MjchairError(f"not TOML: {str(error).splitlines()[0]}") from None
    known = [*TEXTS, *_numbers(), "coefficients", "unused"]
    for key in document:
        if key not in known:
            raise MjchairError(f"unknown key {key!r}" + nearest(key, known))
    if "family" not in document:
        raise MjchairError("no 'family'; give one, as family = \"pac89\"")
    texts = {key: _text(key, document[key]) for key in TEXTS if key in document}
    coefficients = _coefficients(_table(document, "coefficients"), texts)
    texts.pop("load_unit", None)
    numbers = {key: _number(key, document[key]) for key in _numbers() if key in document}
    unused = {key: _text(key, value) for key, value in _table(document, "unused").items()}
    return Tire(
        **({"name": stem} | texts),  # type: ignore[arg-type]
        coefficients=coefficients,
        unused=unused,
        **numbers,  # type: ignore[arg-type]
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


def _numbers() -> list[str]:
    return [item.name for item in fields(Tire) if item.metadata]


def _table(document: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    table = document.get(key, {})
    if not isinstance(table, dict):
        raise MjchairError(f"{key} is {type(table).__name__}; it must be a table, [{key}]")
    return table


def _text(key: str, value: object) -> str:
    if not isinstance(value, str):
        raise MjchairError(f"{key} is {value!r}; it must be text in quotes")
    return value


def _number(key: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise MjchairError(f"{key} is {value!r}; it must be a finite number")
    return float(value)


def _coefficients(table: Mapping[str, Any], texts: Mapping[str, str]) -> dict[str, float]:
    """Coefficients by name, the lists a, b, c of PAC89 spread out."""
    if texts["family"] != "pac89":
        if "load_unit" in texts:
            raise MjchairError(f"load_unit is PAC89's; {texts['family']} has none")
        return {key: _number(key, value) for key, value in table.items()}
    unit = texts.get("load_unit")
    if unit not in LOAD_UNITS:
        raise MjchairError(f"load_unit is {unit!r}; it must be one of {', '.join(LOAD_UNITS)}")
    found: dict[str, float] = {"load_unit": LOAD_UNITS[unit], "has_b": 0.0, "has_c": 0.0}
    for key, value in table.items():
        if key not in LISTS:
            found[key] = _number(key, value)
            continue
        if not isinstance(value, list) or not 0 < len(value) <= LISTS[key]:
            raise MjchairError(f"{key} must be a list of 1 to {LISTS[key]} numbers")
        found |= {f"{key}{i}": _number(f"{key}{i}", entry) for i, entry in enumerate(value)}
        if key != "a":
            found[f"has_{key}"] = 1.0
    return found


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
