"""Tables of rig measurements: one row a steady run, CSV, read and validated.

In: a CSV file. Out: a `RigTable`.

Columns: ``slip_angle_deg``, ``load_n`` and either ``fy_n`` or the two lateral cells ``cell_1_n``
and ``cell_2_n``, whose mean is taken, as in Silva & Dedini (2007). Optional: ``camber_deg``,
``kappa``, ``fx_n``, ``speed_mps``, ``turned`` (1: the wheel is turned round on its axle) and
``fy_sigma_n``, the standard deviation of a row's force. Others are left alone. A heading may carry
another unit in place of the one in its name: ``slip_angle [rad]``, ``load [kN]``.

Signs are ISO-W: a positive slip angle gives a negative force. `paper_sign` reads tables with the
paper's sign, the other one.
"""

from __future__ import annotations

import csv
import io
import math
import os
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mjchair.csv_table import read_columns
from mjchair.errors import MjchairError, closest
from mjchair.storage import read_bounded, write_whole
from mjchair.units import UNITS, factor, split_header, units_of

Array = NDArray[np.float64]

LARGEST = 10_000_000  # bytes
REQUIRED = ("slip_angle_deg", "load_n")
LATERAL = ("fy_n", "cell_1_n", "cell_2_n")
OPTIONAL = ("camber_deg", "kappa", "fx_n", "speed_mps", "turned", "fy_sigma_n")
KNOWN = (*REQUIRED, *LATERAL, *OPTIONAL)
# heading without its unit -> column, and the unit that the column is in
WITHOUT_UNIT = {
    "slip_angle": ("slip_angle_deg", "deg"),
    "load": ("load_n", "N"),
    "fy": ("fy_n", "N"),
    "cell_1": ("cell_1_n", "N"),
    "cell_2": ("cell_2_n", "N"),
    "camber": ("camber_deg", "deg"),
    "fx": ("fx_n", "N"),
    "speed": ("speed_mps", "m/s"),
    "fy_sigma": ("fy_sigma_n", "N"),
    "kappa": ("kappa", "1"),
}
LEAST_LARGEST_LOAD = 1.0  # N, of a table; below it the loads are most likely in kN
RANGES = {
    "slip_angle_deg": (-60.0, 60.0),
    "load_n": (0.1, 1e5),
    "camber_deg": (-45.0, 45.0),
    "kappa": (-1.0, 10.0),
    "turned": (0.0, 1.0),
}


@dataclass(frozen=True)
class RigTable:
    """Steady runs of a rig, ISO-W; every array (n,).

    Attributes:
      angle: slip angle, deg. load: N. camber: deg. kappa: longitudinal slip, 1.
      speed: m/s, NaN where not given. turned: 1 where the wheel is turned round, else 0.
      fx, fy: N, fx NaN where not measured. sigma: of fy, N, NaN where not given.
      source: the file, for error lines. paper_sign: the forces were turned when they were read.
    """

    angle: Array
    load: Array
    camber: Array
    kappa: Array
    speed: Array
    turned: Array
    fx: Array
    fy: Array
    sigma: Array
    source: str = "table"
    paper_sign: bool = False

    def __len__(self) -> int:
        """Number of runs."""
        return int(self.fy.size)


def read_rig(path: str | os.PathLike[str], paper_sign: bool = False) -> RigTable:
    """The rig table in a CSV file.

    Args:
      path: the file. paper_sign: forces are positive for positive slip angles.

    Raises:
      MjchairError: a file that cannot be read, a column missing, a cell that is no number or out
        of its range, or too few rows.
    """
    return from_columns(_columns(Path(path)), str(path), paper_sign)


def from_columns(
    columns: Mapping[str, Array], source: str = "table", paper_sign: bool = False
) -> RigTable:
    """A rig table from named columns; see `read_rig`."""
    for name in REQUIRED:
        if name not in columns:
            raise MjchairError(_missing(name, columns, source))
    n = len(columns["load_n"])
    if n == 0:
        raise MjchairError(f"{source}: no runs; the table needs a header and rows")
    fy = _lateral(columns, source)
    _check(columns, fy, source)
    sign = -1.0 if paper_sign else 1.0
    none, zero = np.full(n, math.nan), np.zeros(n)
    kappa = np.nan_to_num(columns.get("kappa", zero), nan=0.0)  # left empty: it rolls freely
    return RigTable(
        angle=columns["slip_angle_deg"],
        load=columns["load_n"],
        camber=np.nan_to_num(columns.get("camber_deg", zero), nan=0.0),
        kappa=kappa,
        speed=columns.get("speed_mps", none),
        turned=np.nan_to_num(columns.get("turned", zero), nan=0.0),
        fx=columns.get("fx_n", none),
        fy=sign * fy,
        sigma=columns.get("fy_sigma_n", none),
        source=source,
        paper_sign=paper_sign,
    )


def write_rows(
    path: str | os.PathLike[str], header: Sequence[str], rows: Sequence[Sequence[object]]
) -> None:
    """Write a CSV of rows, whole; numbers with all their digits, None as an empty cell."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(header)
    for row in rows:
        writer.writerow(["" if cell is None else _cell(cell) for cell in row])
    write_whole(path, stream.getvalue())


def _cell(cell: object) -> str:
    return repr(float(cell)) if isinstance(cell, float) else str(cell)


def _columns(path: Path) -> dict[str, Array]:
    """Every known column as numbers, an empty cell as NaN."""
    reason = f"{LARGEST // 1_000_000} MB; a rig table has a row a run"
    data = read_bounded(path, LARGEST, "a rig table", reason)
    header, _ = read_columns(data, str(path), wanted=())
    meant = [_column(heading, str(path)) for heading in header]
    wanted = {heading for heading, (name, _) in zip(header, meant, strict=True) if name}
    _, columns = read_columns(data, str(path), wanted=wanted)
    names = [name for name, _ in meant if name]
    if len(set(header)) < len(header) or len(set(names)) < len(names):
        raise MjchairError(f"{path}: a column is there twice; keep one")
    for name in REQUIRED:
        if name not in names:
            raise MjchairError(_missing(name, header, str(path)))
    known = {
        name: size * column
        for (name, size), column in zip(meant, columns, strict=True)
        if column is not None
    }
    if not any(name in known for name in LATERAL) and (alike := _alike("fy_n", header)):
        raise MjchairError(f"{path}: no lateral force; is it {alike!r}? name it fy_n or 'fy [N]'")
    for name, values in known.items():
        rows = np.flatnonzero(np.isinf(values))
        if rows.size:
            raise MjchairError(
                f"{path}: {name} in row {rows[0] + 2} is {values[rows[0]]:g}; it must be finite"
            )
    return known


def _column(heading: str, source: str) -> tuple[str, float]:
    """The known column that a heading means, "" for none, and the factor to its unit.

    Raises:
      MjchairError: a known column in a unit that it cannot have.
    """
    if heading in KNOWN:
        return heading, 1.0
    base = heading.partition("[")[0].strip()
    if "[" not in heading or (base not in WITHOUT_UNIT and base not in KNOWN):
        return "", 1.0
    try:
        _, unit = split_header(heading)
    except MjchairError as error:
        raise MjchairError(f"{source}: {error}") from None
    own = dict(WITHOUT_UNIT.values())
    name, wanted = WITHOUT_UNIT.get(base, (base, own.get(base, "")))
    possible = units_of(UNITS[wanted][0]) if base in WITHOUT_UNIT else [wanted]
    if unit not in possible:
        raise MjchairError(
            f"{source}: column {heading!r}; it must be in {' or '.join(filter(None, possible))}"
        )
    return name, factor(unit) / factor(wanted) if unit != wanted else 1.0


def _missing(name: str, header: Collection[str], source: str) -> str:
    """The error line about a column that is not there."""
    alike = _alike(name, header)
    hint = f"; is it {alike!r}?" if alike else ""
    return (
        f"{source}: no column {name!r}{hint} (wanted: {', '.join(KNOWN)}; or with a unit, such as "
        "'slip_angle [rad]' or 'load [kN]')"
    )


def _alike(name: str, header: Collection[str]) -> str | None:
    """The heading that was probably meant to be the column `name`."""
    bases = [base for base, (column, _) in WITHOUT_UNIT.items() if column == name]
    strange = {heading.lower(): heading for heading in header if heading not in KNOWN}
    for low in (name, *bases):
        if low in strange:
            return strange[low]
    for low, heading in strange.items():
        if any(low.startswith(f"{base}_") for base in bases):  # another unit behind the name
            return heading
    found = closest(name, strange)
    return strange[found] if found else None


def _lateral(columns: Mapping[str, Array], source: str) -> Array:
    if "fy_n" in columns:
        return columns["fy_n"]
    if "cell_1_n" in columns and "cell_2_n" in columns:
        return 0.5 * (columns["cell_1_n"] + columns["cell_2_n"])
    raise MjchairError(f"{source}: no lateral force; give fy_n, or cell_1_n and cell_2_n")


def _check(columns: Mapping[str, Array], fy: Array, source: str) -> None:
    for name, values in (*columns.items(), ("fy_n", fy)):
        wanted = name in (*REQUIRED, "fy_n", "cell_1_n", "cell_2_n")
        low, high = RANGES.get(name, (-math.inf, math.inf))
        if name == "fy_sigma_n":
            low = 1e-9
        for row, value in enumerate(values, 2):
            if math.isnan(value) and wanted:
                raise MjchairError(f"{source}: {name} in row {row} is empty; leave the row out")
            if value < low or value > high:
                raise MjchairError(
                    f"{source}: {name} in row {row} is {value:g}; "
                    f"it must be within {low:g} to {high:g}"
                )
    largest = float(np.max(columns["load_n"]))
    if largest < LEAST_LARGEST_LOAD:
        raise MjchairError(
            f"{source}: load_n goes to {largest:g} N only, and a tire's load is above "
            f"{LEAST_LARGEST_LOAD:g} N; in kN? then name the column 'load [kN]', and forces in kN "
            "'fy [kN]'"
        )
