"""The result of a test of the laboratory: numbers with unit and source, tables, runs, and notes.

In: the measured values of a test. Out: plain data for `results.json` and the sheet; every number
has a unit and a source. Nothing is simulated in this module.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mjchair.testlab.track import Run

SIMULATED = "simulated"


@dataclass(frozen=True)
class Value:
    """One measured number.

    Attributes:
      value: in `unit`; None where the chair has no such value, see `note`.
      unit: SI or the unit that the standard prints, such as deg; "" for a word.
      low, high: ends of the interval of `mjchair test --uncertainty`; None: there is no interval.
      source: how the number was obtained. note: a remark for the reader.
    """

    value: float | str | bool | None
    unit: str = ""
    low: float | None = None
    high: float | None = None
    source: str = SIMULATED
    note: str = ""

    def plain(self) -> dict[str, Any]:
        """For JSON; a number that is not finite is None."""
        value = self.value
        if isinstance(value, float) and not math.isfinite(value):
            value = None
        plain: dict[str, Any] = {"value": value, "unit": self.unit, "low": self.low}
        plain |= {"high": self.high, "source": self.source}
        return plain | ({"note": self.note} if self.note else {})

    @staticmethod
    def of(plain: Mapping[str, Any]) -> Value:
        """A value from the result of `plain`."""
        return Value(**plain)


@dataclass(frozen=True)
class Grid:
    """A table of a test, with one row for each case.

    Attributes:
      title: of the table. columns: names with units. rows: one for each case, as long as
        `columns`.
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[float | str | None, ...], ...]

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        return {"title": self.title, "columns": list(self.columns), "rows": [*map(list, self.rows)]}

    @staticmethod
    def of(plain: Mapping[str, Any]) -> Grid:
        """A table from the result of `plain`."""
        return Grid(plain["title"], tuple(plain["columns"]), tuple(map(tuple, plain["rows"])))


@dataclass(frozen=True)
class Result:
    """The result of one test.

    Attributes:
      test: its name. values: by key. setup: how the chair was set up, one sentence each.
      grids: further tables. notes: remarks for the reader. missing: why the test cannot be run on
        this chair; "" where it can.
      curves: of the small picture: name -> (x, y), with `axes` as (x label, y label).
      runs: name -> the run, from which `Run.recording()` makes a recording; not in JSON.
    """

    test: str
    values: Mapping[str, Value] = field(default_factory=dict)
    setup: Sequence[str] = ()
    grids: Sequence[Grid] = ()
    notes: Sequence[str] = ()
    missing: str = ""
    curves: Mapping[str, tuple[Sequence[float], Sequence[float]]] = field(default_factory=dict)
    axes: tuple[str, str] = ("", "")
    runs: Mapping[str, Run] = field(default_factory=dict)

    def __getitem__(self, key: str) -> Any:
        """The number of a key, without its unit."""
        return self.values[key].value

    def plain(self) -> dict[str, Any]:
        """For JSON: everything but the runs."""
        return {
            "values": {key: value.plain() for key, value in self.values.items()},
            "setup": list(self.setup),
            "grids": [grid.plain() for grid in self.grids],
            "notes": list(self.notes),
            "missing": self.missing,
            "curves": {
                k: [list(map(float, x)), list(map(float, y))] for k, (x, y) in self.curves.items()
            },
            "axes": list(self.axes),
        }

    @staticmethod
    def of(test: str, plain: Mapping[str, Any]) -> Result:
        """A result from the result of `plain`."""
        return Result(
            test,
            {key: Value.of(value) for key, value in plain["values"].items()},
            plain["setup"],
            [Grid.of(grid) for grid in plain["grids"]],
            plain["notes"],
            plain["missing"],
            {name: (x, y) for name, (x, y) in plain["curves"].items()},
            (plain["axes"][0], plain["axes"][1]),
        )

    def with_values(self, values: Mapping[str, Value]) -> Result:
        """The same with other values."""
        return replace(self, values=values)
