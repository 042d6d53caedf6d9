"""Tables of time series: CSV or Parquet, `time` first, an empty cell where a sample is missing.

In: a file. Out: a `Table` of named columns in SI on one clock, with every sample checked.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from pathlib import Path
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from mjchair.csv_table import read_columns
from mjchair.errors import MjchairError, closest, nearest, note
from mjchair.simulation.frozen import FrozenRecord
from mjchair.units import UNITS, factor, split_header, units_of

Array = NDArray[np.float64]

# a time column without a unit that has more samples and longer steps seems to be in milliseconds
MANY, LONG_STEP = 20, 1.0  # samples, s
SAME = 1e-5  # s, within which samples of two tables are of one time
SHARED = 0.1  # of samples with the time of the one before, from which times were rounded


@dataclass(frozen=True, eq=False, repr=False)
class Table(FrozenRecord):
    """Named time series on one clock, in SI units.

    Attributes:
      time: (n,), s, strictly increasing.
      columns: name -> (n,), NaN where a sample is missing.
      source: the file, for error messages.
      units: name -> unit in which the file had a column, where its header says so.

    Raises:
      MjchairError: no samples, time not finite or not strictly increasing, a column of another
        length, infinite, or without a single sample.
    """

    time: Array
    columns: Mapping[str, Array]
    source: str = "table"
    units: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Freeze the arrays and check them."""
        time = frozen(self.time)
        if time.ndim != 1 or time.size == 0:
            raise MjchairError(f"{self.source}: no samples; a table needs a header and rows")
        check_time(time, self.source)
        columns = {name: frozen(values) for name, values in self.columns.items()}
        for name, values in columns.items():
            if values.shape != time.shape:
                raise MjchairError(
                    f"{self.source}: {name} has shape {values.shape}; time has {time.shape}"
                )
            if np.isinf(values).any():
                row = int(np.flatnonzero(np.isinf(values))[0])
                raise MjchairError(
                    f"{self.source}: {name} is infinite at {time[row]:g} s; "
                    "leave the cell of a missing sample empty"
                )
            if np.isnan(values).all():
                raise MjchairError(f"{self.source}: {name} has no samples; leave the column out")
        object.__setattr__(self, "time", time)
        object.__setattr__(self, "columns", MappingProxyType(columns))

    def __repr__(self) -> str:
        """One line."""
        return f"<Table {self.source}: {self.time.size} samples of {', '.join(self.columns)}>"

    def samples(self, name: str) -> tuple[Array, Array]:
        """The times (s) and values of the samples of a column, without the missing ones.

        Raises:
          MjchairError: there is no such column.
        """
        if name not in self.columns:
            raise MjchairError(f"{self.source}: no column {name!r}" + nearest(name, self.columns))
        there = ~np.isnan(self.columns[name])
        return self.time[there], self.columns[name][there]


def frozen(values: object) -> Array:
    """A copy as float64 that cannot be written to."""
    array = np.array(values, dtype=np.float64)
    array.flags.writeable = False
    return array


def check_time(time: Array, source: str) -> None:
    """Raise MjchairError, naming the row, unless `time` (s) is finite and strictly increasing."""
    bad = np.flatnonzero(~np.isfinite(time))
    if bad.size:
        raise MjchairError(
            f"{source}: time is {time[bad[0]]} in sample {bad[0] + 1}; every sample needs a time"
        )
    back = np.flatnonzero(np.diff(time) <= 0.0)
    if back.size:
        row = back[0] + 1
        raise MjchairError(
            f"{source}: time goes from {time[row - 1]:.12g} to {time[row]:.12g} s in sample "
            f"{row + 1}; it must increase strictly" + _rounded(time)
        )


def _rounded(time: Array) -> str:
    """Advice where samples share their times, as rounded ones do; empty: nothing tells that."""
    steps = np.diff(time)
    if np.any(steps < 0.0) or time[-1] == time[0] or np.mean(steps == 0.0) < SHARED:
        return ""
    rate = steps.size / (time[-1] - time[0])
    return (
        f". {np.sum(steps == 0.0)} samples share the time of the one before, as rounded times do; "
        f"write more digits, or, if the samples came evenly, k / {rate:.4g} s for sample k"
    )


def read_table(path: str | os.PathLike[str]) -> Table:
    """Read a table: first column `time`; columns may carry a unit as in ``imu_gyro.z [deg/s]``.

    Args:
      path: ``.csv``, or ``.parquet`` with the same column names.

    Raises:
      MjchairError: no such file, another suffix, a first column that is not `time`, a name twice,
        a cell that is not a number, or as Table does.
    """
    path = Path(path)
    if path.is_dir():
        raise MjchairError(f"{path} is a folder; give a .csv or .parquet file in it")
    if not path.is_file():
        raise MjchairError(f"no file {path}" + _nearest_file(path))
    if path.suffix.lower() == ".parquet":
        header, data = _read_parquet(path)
    elif path.suffix.lower() == ".csv":
        header, data = _read_csv(path)
    else:
        raise MjchairError(f"{path}: a table ends in .csv or .parquet, not {path.suffix!r}")
    return _table(header, data, str(path))


def merged(tables: Sequence[Table]) -> Table:
    """One table of several that share one clock: every sample at its own time, NaN elsewhere.

    Raises:
      MjchairError: no time that two of them share, a column that is in two, two samples of a table
        within SAME.
    """
    if len(tables) == 1:
        return tables[0]
    for earlier, later in combinations(sorted(tables, key=lambda table: table.time[0]), 2):
        _check_together(earlier, later)
    stacked = np.sort(np.concatenate([table.time for table in tables]))
    time = stacked[np.r_[True, np.diff(stacked) > SAME]]
    columns: dict[str, Array] = {}
    for table in tables:
        rows = np.searchsorted(time, table.time, side="right") - 1
        if np.unique(rows).size < rows.size:
            raise MjchairError(
                f"{table.source}: two samples are less than {SAME:g} s apart; take one of them out"
            )
        for name, values in table.columns.items():
            columns[name] = np.full(time.size, np.nan)
            columns[name][rows] = values
    units = {name: unit for table in tables for name, unit in table.units.items()}
    return Table(time, columns, ", ".join(table.source for table in tables), units)


def check_units(table: Table, known: Mapping[str, str]) -> None:
    """Refuse columns in a unit of something else, such as a wheel's turning in km/h.

    Args:
      known: column -> its SI unit; of a column that is not among these, nothing is known.

    Raises:
      MjchairError: naming the column and the units that it may have.
    """
    for name, unit in table.units.items():
        si = known.get(name, "?")
        options = units_of(si)
        if not options or unit in options:
            continue
        along = {"m": "rad", "m/s": "rad/s"}.get(UNITS[unit][0]) == si
        raise MjchairError(
            f"{table.source}: {name} is in {unit}; it must be in {' or '.join(options)}"
            + ("; divide what its rim rolls by the wheel's radius" if along else "")
        )


def _check_together(earlier: Table, later: Table) -> None:
    """Raise MjchairError unless two tables overlap in time and no column is in both."""
    if later.time[0] >= earlier.time[-1]:
        spans = " and ".join(
            f"{t.source} lasts from {t.time[0]:g} to {t.time[-1]:g} s" for t in (earlier, later)
        )
        raise MjchairError(
            f"{spans}; tables of one trial share one clock (`mjchair gather` aligns them)"
        )
    for name in later.columns:
        if name in earlier.columns:
            raise MjchairError(
                f"column {name!r} is in {earlier.source} and in {later.source}; "
                "leave it out of one of them"
            )


def _check_seconds(time: Array, source: str) -> None:
    """Raise MjchairError where a time without a unit is most likely in milliseconds."""
    if time.size < MANY or not np.isfinite(time).all():
        return
    usual = float(np.median(np.diff(time)))
    if usual >= LONG_STEP:
        raise MjchairError(
            f"{source}: time goes from {time[0]:g} to {time[-1]:g} in steps of {usual:g}, which "
            "looks like milliseconds; name the column 'time [ms]', or 'time [s]' if it is in s"
        )


def leave_out(unknown: Iterable[str], known: Iterable[str], source: str) -> None:
    """Refuse misspelt columns, and print a note about columns that are left out.

    Args:
      unknown: columns whose name nothing in the model has. known: the names that are possible.

    Raises:
      MjchairError: a column whose name is nearly a known one.
    """
    left, names = list(unknown), list(known)
    for name in left:
        if closest(name, names) is not None:
            raise MjchairError(f"{source}: unknown channel {name!r}" + nearest(name, names))
    if left:
        listing = ", ".join(repr(name) for name in left)
        note(f"{source}: left out what nothing in the model is called: {listing}")


def _nearest_file(path: Path) -> str:
    if not path.parent.is_dir():
        return f"; there is no folder {path.parent} either"
    return nearest(path.name, (p.name for p in path.parent.iterdir() if p.is_file()))


def _table(header: list[str], data: Array, source: str) -> Table:
    """A table of the header and the (n, columns) array, in SI."""
    if header[:1] == [""] and "time" in header[1:2]:
        note(f"{source}: the first column has no name and is left out; pandas writes its index so")
        header, data = header[1:], data[:, 1:]
    if "" in header:
        raise MjchairError(
            f"{source}: column {header.index('') + 1} has no name; name it, or, where pandas wrote "
            "its index, write the table with index=False"
        )
    try:
        columns = [split_header(text) for text in header]
    except MjchairError as error:
        raise MjchairError(f"{source}: {error}") from None
    names = [name for name, _ in columns]
    units = {name: unit for name, unit in columns if unit}
    if not names or names[0] != "time":
        raise MjchairError(f"{source}: the first column is {(names or [''])[0]!r}; it must be time")
    if "[" not in header[0]:
        _check_seconds(data[:, 0], source)
    twice = {name for name in names if names.count(name) > 1}
    if twice:
        raise MjchairError(f"{source}: column {min(twice)!r} is there twice; names are unique")
    scaled = {name: data[:, i] * factor(unit) for i, (name, unit) in enumerate(columns)}
    table = Table(scaled.pop("time"), scaled, source, units)
    check_units(table, {"time": "s"})
    return table


def _read_csv(path: Path) -> tuple[list[str], Array]:
    try:
        data = path.read_bytes()
    except OSError as error:
        raise MjchairError(f"cannot read {path} as CSV: {error.strerror}") from None
    header, columns = read_columns(data, str(path))
    return header, np.column_stack([c for c in columns if c is not None])


def _read_parquet(path: Path) -> tuple[list[str], Array]:
    import pyarrow
    import pyarrow.parquet

    try:
        table = pyarrow.parquet.read_table(path)
        data = [column.cast(pyarrow.float64()).to_numpy() for column in table.columns]
    except (OSError, pyarrow.ArrowException) as error:
        line = str(error).splitlines()[0]
        raise MjchairError(f"cannot read {path} as Parquet: {line}") from None
    return table.column_names, np.column_stack(data) if data else np.empty((0, 0))
