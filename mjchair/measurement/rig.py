"""Tables of rig measurements: one row a steady run, CSV, read and validated.

In: a CSV file. Out: a `RigTable`.

Columns: ``slip_angle_deg``, ``load_n`` and either ``fy_n`` or the two lateral cells ``cell_1_n``
and ``cell_2_n``, whose mean is taken, as in Silva & Dedini (2007). Optional: ``camber_deg``,
``kappa``, ``fx_n``, ``speed_mps``, ``turned`` (1: the wheel is turned round on its axle) and
``fy_sigma_n``, the standard deviation of a row's force. Others are left alone.

Signs are ISO-W: a positive slip angle gives a negative force. `paper_sign` reads tables with the
paper's sign, the other one.
"""

from __future__ import annotations

import csv
import io
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mjchair.csv_table import read_columns
from mjchair.errors import MjchairError, nearest
from mjchair.storage import read_bounded, write_whole

Array = NDArray[np.float64]

LARGEST = 10_000_000  # bytes
REQUIRED = ("slip_angle_deg", "load_n")
LATERAL = ("fy_n", "cell_1_n", "cell_2_n")
OPTIONAL = ("camber_deg", "kappa", "fx_n", "speed_mps", "turned", "fy_sigma_n")
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
      source: the file, for error lines.
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
    known = (*REQUIRED, *LATERAL, *OPTIONAL)
    for name in REQUIRED:
        if name not in columns:
            hint = nearest(name, columns)
            raise MjchairError(f"{source}: no column {name!r}{hint}; wanted are {', '.join(known)}")
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
    header, columns = read_columns(data, str(path), wanted={*REQUIRED, *LATERAL, *OPTIONAL})
    if len(set(header)) < len(header):
        raise MjchairError(f"{path}: a column is there twice; keep one")
    known = {n: c for n, c in zip(header, columns, strict=True) if c is not None}
    for name, values in known.items():
        rows = np.flatnonzero(np.isinf(values))
        if rows.size:
            raise MjchairError(
                f"{path}: {name} in row {rows[0] + 2} is {values[rows[0]]:g}; it must be finite"
            )
    return known


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
