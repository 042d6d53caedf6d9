"""Exports of instruments, by a mapping of their column names: IMUs, and any other table.

In: a delimited file with a header, and TOML files that say what its columns are. Out: an `Export`,
in SI. Mappings of NGIMU, x-IMU, x-IMU3 and Xsens come along in the folder `formats`; a mapping
of your own has the same keys:

    kind = "imu"                      # or "table"
    has = ["Time (s)", "Gyr X"]       # columns that tell this format from others
    preamble = "Make"                 # optional: a word in the lines before the header
    time = { column = "Time (s)", unit = "s" }    # or { rate = 100.0 }, or { column, unit, wraps }
    gyroscope = { columns = ["Gyr X", "Gyr Y", "Gyr Z"], unit = "deg/s" }
    accelerometer = { columns = ["Acc X", "Acc Y", "Acc Z"], unit = "g" }
    trigger = "Sync"                  # optional: a column that rises when the others start
    [columns]                         # of a table: study column = where it is found
    left_wheel_speed = { column = "omega L", unit = "deg/s", sign = -1 }
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from msgspec import Meta, Struct
from numpy.typing import NDArray

from mjchair.errors import MjchairError, nearest
from mjchair.measurement.delimited import Delimited
from mjchair.measurement.notes import Detail
from mjchair.toml_file import read_toml
from mjchair.units import UNITS, known, nearest_unit

Array = NDArray[np.float64]

FORMATS = Path(__file__).with_name("formats")
CLOCKS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "100us": 1e-4}  # s a count; "samples": see its rate
# such as "// Update Rate: 60.0Hz" or "OutputRate:,60Hz" in the lines before a header
RATE = re.compile(
    r"(?:update|sample|sampling|output|data)[ _]?(?:rate|frequency)\W*(\d+(?:\.\d+)?)\s*Hz",
    re.IGNORECASE,
)
Positive = Annotated[float, Meta(gt=0)]


class _Clock(Struct, forbid_unknown_fields=True):
    """time: a column with its unit, or a rate."""

    column: str | None = None
    unit: Literal["s", "ms", "us", "100us", "samples"] = "s"
    rate: Positive | None = None
    wraps: Positive | None = None


class _Vector(Struct, forbid_unknown_fields=True):
    """gyroscope, accelerometer: three columns with one unit."""

    columns: tuple[str, str, str]
    unit: str


class _Column(Struct, forbid_unknown_fields=True):
    """One of [columns]."""

    column: str
    unit: str = "1"
    sign: float = 1.0


class ColumnMapping(Struct, forbid_unknown_fields=True):
    """What the TOML file of a mapping says; see the module's docstring."""

    kind: Literal["imu", "table"]
    has: Annotated[list[str], Meta(min_length=1)]
    time: _Clock
    preamble: str = ""
    gyroscope: _Vector | None = None
    accelerometer: _Vector | None = None
    trigger: str | None = None
    columns: dict[str, _Column] = {}


@dataclass(frozen=True)
class Format:
    """What the columns of an export are; see the module's docstring.

    Attributes:
      name: of the format. mapping: what its file says. own: whether it is a file of one's own,
        whose rate is believed.
    """

    name: str
    mapping: ColumnMapping
    own: bool = True

    def fits(self, file: Delimited) -> bool:
        """Whether a file is of this format."""
        names = {_plain(column) for column in file.header}
        word = self.mapping.preamble
        return all(_plain(c) in names for c in self.mapping.has) and any(
            word.lower() in line.lower() for line in (*file.preamble, "" if word else " ")
        )

    def told(self, file: Delimited) -> bool:
        """Whether the column of its clock holds times, where it has one."""
        column = self.mapping.time.column
        return column is None or bool(np.isfinite(_column(file, column)).any())

    def alike(self, other: Format) -> bool:
        """Whether another format has the same sensors in the same units."""
        mine, theirs = self.mapping, other.mapping
        return (mine.gyroscope, mine.accelerometer) == (theirs.gyroscope, theirs.accelerometer)


@dataclass(frozen=True)
class Export:
    """One instrument's export, SI, on its own clock.

    Attributes:
      time: (n,), s, strictly increasing, 0 at the first sample. gyroscope, accelerometer: (n, 3),
        rad/s and m/s^2 in the instrument's axes; None: it has none. columns: study column -> (n,).
      trigger: time at which the trigger rises, s; None: it has none.
      format: its name. source: the file. notes: what was noticed, one line each.
      assumed: rate, Hz, that its clock has by assumption alone; None: the file or a mapping of
        one's own tells it.
    """

    time: Array
    gyroscope: Array | None
    accelerometer: Array | None
    columns: dict[str, Array]
    trigger: float | None
    format: str
    source: str
    notes: tuple[str, ...] = field(default=())
    assumed: float | None = None


def read_formats(own: Sequence[Path] = ()) -> list[Format]:
    """The mappings in files of one's own, then those that come along.

    Raises:
      MjchairError: a file that cannot be read or lacks a key.
    """
    shipped = [_format(path, own=False) for path in sorted(FORMATS.glob("*.toml"))]
    return [*(_format(path, own=True) for path in own), *shipped]


def _format(path: Path, own: bool) -> Format:
    mapping = read_toml(path, ColumnMapping)
    clock = mapping.time
    if clock.rate is None and (clock.column is None or clock.unit == "samples"):
        raise MjchairError(f"{path}: time needs a column with a unit of time, or a rate in Hz")
    return Format(path.stem, mapping, own)


def matching(file: Delimited, formats: Sequence[Format]) -> Format | None:
    """The first format that a file is of; where its clock is blank, one alike that has another."""
    fitting = [one for one in formats if file.header and one.fits(file)]
    told = [one for one in fitting if one.told(file) and one.alike(fitting[0])]
    return next(iter((*told, *fitting)), None)


def read_export(file: Delimited, form: Format) -> Export:
    """What a file of a format holds.

    Raises:
      MjchairError: a column or a unit that is not there, a clock that is blank or stands still, or
        a sensor without samples.
    """
    rate, assumed, notes = _rate(file, form)
    time = _time(file, form, rate)
    good = np.isfinite(time)
    if not good.any():
        column = form.mapping.time.column
        raise MjchairError(f"{file.source}: no cell of its time column {column!r} is filled")
    steps = np.r_[True, np.diff(time[good]) > 0.0]
    kept = np.flatnonzero(good)[steps]
    if kept.size < 2:
        raise MjchairError(f"{file.source}: its clock stands still; is the time column right?")
    if kept.size < time.size:
        lost = time.size - kept.size
        notes.append(f"{Path(file.source).name}: {lost} rows repeat a time or have none; left out")
    kept, said = _seen(file, form, kept)
    notes += said
    time = time[kept] - time[kept[0]]
    columns = {name: _one(file, entry, form)[kept] for name, entry in form.mapping.columns.items()}
    return Export(
        time=time,
        gyroscope=_vector(file, form, form.mapping.gyroscope, kept),
        accelerometer=_vector(file, form, form.mapping.accelerometer, kept),
        columns=columns,
        trigger=_trigger(file, form, time, kept),
        format=form.name,
        source=file.source,
        notes=tuple(notes),
        assumed=assumed,
    )


def _seen(
    file: Delimited, form: Format, rows: NDArray[np.int64]
) -> tuple[NDArray[np.int64], list[str]]:
    """Of some rows, those in which the sensors have every sample, and a note on the others.

    Where a packet of a wireless sensor was lost, its row is empty.

    Raises:
      MjchairError: fewer than two such rows.
    """
    vectors = [v for v in (form.mapping.gyroscope, form.mapping.accelerometer) if v is not None]
    names = [name for vector in vectors for name in vector.columns]
    there = np.ones(rows.size, bool)
    for name in names:
        there &= np.isfinite(_column(file, name)[rows])
    if there.sum() < 2:
        raise MjchairError(
            f"{file.source}: no two rows have a number in each of {', '.join(map(repr, names))}"
        )
    if there.all():
        return rows, []
    lost = rows.size - int(there.sum())
    said = f"{Path(file.source).name}: {lost} of {rows.size} rows lack a sample; left out"
    return rows[there], [said]


def _rate(file: Delimited, form: Format) -> tuple[float, float | None, list[str]]:
    """Samples a second of a file that counts them, Hz, the same if it is assumed, and a note.

    A mapping of one's own is believed, then the lines before the header, then the mapping that
    comes along; NaN where the file has a clock.
    """
    rate, name = form.mapping.time.rate, Path(file.source).name
    if rate is None:
        return math.nan, None, []
    if form.own:
        return rate, None, []
    found = next((m for line in file.preamble if (m := RATE.search(line))), None)
    if found is not None and float(found[1]) > 0.0:
        return float(found[1]), None, [Detail(f"{name}: {found[1]} Hz, as its first lines say")]
    said = (
        f"{name}: it has no clock and tells no rate; {rate:g} Hz is assumed, give yours with "
        f"--mapping, in a copy of {form.name}.toml"
    )
    return rate, rate, [said]


def _plain(name: str) -> str:
    return " ".join(name.lower().split())


def _column(file: Delimited, name: str) -> Array:
    names = [_plain(column) for column in file.header]
    if _plain(name) not in names:
        raise MjchairError(f"{file.source}: no column {name!r}" + nearest(name, file.header))
    return file.values[:, names.index(_plain(name))]


def _time(file: Delimited, form: Format, rate: float) -> Array:
    clock = form.mapping.time
    if clock.column is None:
        return np.arange(len(file.values)) / rate
    time = _column(file, clock.column)
    if clock.wraps is not None:
        time = np.unwrap(time, period=clock.wraps)
    return np.asarray(time * (1.0 / rate if clock.unit == "samples" else CLOCKS[clock.unit]))


def _factor(unit: str, form: Format) -> float:
    if known(unit) not in UNITS:
        raise MjchairError(f"mapping {form.name}: unknown unit {unit!r}" + nearest_unit(unit))
    return UNITS[known(unit)][1]


def _one(file: Delimited, entry: _Column, form: Format) -> Array:
    return _factor(entry.unit, form) * entry.sign * _column(file, entry.column)


def _vector(
    file: Delimited, form: Format, vector: _Vector | None, kept: NDArray[np.int64]
) -> Array | None:
    if vector is None:
        return None
    values = np.column_stack([_column(file, name) for name in vector.columns])[kept]
    return np.asarray(_factor(vector.unit, form) * values)


def _trigger(file: Delimited, form: Format, time: Array, kept: NDArray[np.int64]) -> float | None:
    if form.mapping.trigger is None:
        return None
    values = _column(file, form.mapping.trigger)[kept]
    low, high = np.nanmin(values), np.nanmax(values)
    rises = np.flatnonzero(np.diff((values > 0.5 * (low + high)).astype(int)) > 0)
    return float(time[rises[0] + 1]) if high > low and rises.size else None
