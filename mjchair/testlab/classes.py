"""Classes of EN 12184:2014 that a chair reaches, quantity by quantity.

In: results of tests, and `limits.toml`. Out: one row for each quantity, with the measured value and
the most demanding class whose limit this value meets.
"""

from __future__ import annotations

import functools
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mjchair.testlab.result import Result

LIMITS = Path(__file__).parent / "limits.toml"


@dataclass(frozen=True)
class Reached:
    """One quantity: the measured value, the limits of the classes, and the class that is reached.

    Attributes:
      quantity: in words. value: in `unit`; None: not measured. limits: class -> limit.
      reached: the most demanding class, "none", or "not measured".
    """

    quantity: str
    value: float | None
    unit: str
    better: str
    limits: Mapping[str, float]
    reached: str


@functools.cache
def table() -> dict[str, Any]:
    """`limits.toml`."""
    return tomllib.loads(LIMITS.read_text(encoding="utf-8"))


def reached(results: Mapping[str, Result]) -> list[Reached]:
    """Every quantity of the standard for which there is a result."""
    rows = []
    for row in table()["class"]:
        result = results.get(row["test"])
        if result is None or result.missing:
            continue
        numbers = [result.values[key].value for key in row["keys"] if key in result.values]
        known = [
            float(n) for n in numbers if isinstance(n, int | float) and not isinstance(n, bool)
        ]
        value = (min if row["combine"] == "min" else max)(known) if known else None
        limits = {name: row[name] for name in ("A", "B", "C") if name in row}
        rows.append(
            Reached(
                row["quantity"],
                value,
                row["unit"],
                row["better"],
                limits,
                _class(value, row["better"], limits),
            )
        )
    return rows


def _class(value: float | None, better: str, limits: Mapping[str, float]) -> str:
    if value is None:
        return "not measured"
    if better == "more":
        kept = [name for name, limit in limits.items() if value >= limit]
        return max(kept, default="none")
    # less is better: class A is the narrowest
    kept = [name for name, limit in limits.items() if value <= limit]
    if not kept:
        return "C" if "C" not in limits else "none"
    return min(kept)
