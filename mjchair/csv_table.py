"""Tables of numbers in CSV: columns read by pyarrow, bad cells named by row and column.

In: the bytes of a file with a header and rows, or the rows alone with the names of their columns; a
comma, a semicolon or a tab between cells, and a decimal comma where no comma is between them.
Out: the header and a float64 array for each column, NaN for a missing sample: an empty
cell, or one with NaN or NA.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjchair.errors import MjchairError

Array = NDArray[np.float64]


def read_columns(
    data: bytes,
    source: str,
    *,
    wanted: Collection[str] | None = None,
    header: bool = True,
) -> tuple[list[str], list[Array | None]]:
    """Header and columns of a table.

    Args:
      data: the file. source: its name, for error lines.
      wanted: names of the columns that are read as numbers; None: all of them.
      header: whether the first row has the names; without one they are "1", "2" and so on.

    Returns:
      The names in order, and for each its numbers (n,), None where it is not wanted.

    Raises:
      MjchairError: no UTF-8 text, an empty file, a row with another number of cells, or a cell
        that is not a number. Rows count from 1, the header among them, empty lines not.
    """
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise MjchairError(f"cannot read {source} as CSV: it is not UTF-8 text") from None
    lines = text.lstrip("\r\n ")
    if not lines.strip():
        raise MjchairError(f"{source}: empty; a table needs a header and rows")
    first, _, rest = lines.partition("\n")
    between = _delimiter(first)
    cells = [cell.strip() for cell in next(csv.reader([first.strip("\r")], delimiter=between))]
    names = cells if header else [str(k + 1) for k in range(len(cells))]
    body = rest if header else lines
    rows = Rows(body, source, between, "," if between == ";" else ".", before=int(header))
    return names, numbers(rows, names, wanted)


# cells of a missing sample, in lower case: empty, or as MATLAB, pandas and R write it
MISSING = ("", "nan", "na")
MARKS = "a comma, a semicolon or a tab parts the cells of a row"


@dataclass(frozen=True)
class Rows:
    """The rows of a table, without its header.

    Attributes:
      text: the rows. source: the file, for error lines. delimiter: between the cells. decimal: the
      mark in a number, "." or ",". before: rows of the file before these.
    """

    text: str
    source: str
    delimiter: str
    decimal: str
    before: int


def numbers(
    rows: Rows, names: Sequence[str], wanted: Collection[str] | None = None
) -> list[Array | None]:
    """The columns of rows that have as many cells as there are names; see read_columns.

    Raises:
      MjchairError: a row with another number of cells, or a cell that is not a number.
    """
    columns: list[Array | None] = []
    for name, column in zip(names, _strings(rows, len(names)), strict=True):
        read = wanted is None or name in wanted
        columns.append(_numbers(column, rows, name) if read else None)
    return columns


def _delimiter(line: str) -> str:
    """What stands between the cells of a line: a comma, unless there is none."""
    if "," in line and ";" not in line:
        return ","
    return next((mark for mark in ";\t" if mark in line), ",")


def _strings(rows: Rows, count: int) -> list[Any]:
    """The cells of each column as text, empty ones null."""
    import pyarrow
    import pyarrow.csv

    if not rows.text.strip():
        return [pyarrow.array([], pyarrow.string())] * count
    wrong: list[Any] = []

    def refuse(row: Any) -> str:
        wrong.append(row)
        return "skip"

    names = [str(k) for k in range(count)]
    try:
        table = pyarrow.csv.read_csv(
            io.BytesIO(rows.text.encode()),
            read_options=pyarrow.csv.ReadOptions(use_threads=False, column_names=names),
            parse_options=pyarrow.csv.ParseOptions(
                delimiter=rows.delimiter, invalid_row_handler=refuse, newlines_in_values=False
            ),
            convert_options=pyarrow.csv.ConvertOptions(
                column_types=dict.fromkeys(names, pyarrow.string()),
                strings_can_be_null=True,
                null_values=[""],
            ),
        )
    except pyarrow.ArrowException as error:
        raise MjchairError(
            f"cannot read {rows.source} as CSV: {str(error).splitlines()[0]}"
        ) from None
    if wrong:
        row = wrong[0]
        why = (
            "is the file cut short?"
            if count > 1
            else f"{MARKS}, and nothing stands before the header"
        )
        raise MjchairError(
            f"{rows.source}: row {row.number + rows.before} has {row.actual_columns} cells; "
            f"the {'header' if rows.before else 'first row'} has {count}; {why}"
        )
    return [column.combine_chunks() for column in table.columns]


def _numbers(column: Any, rows: Rows, name: str) -> Array:
    """A column of text as numbers."""
    import pyarrow
    import pyarrow.compute

    def where(row: int) -> str:
        return f"{rows.source}: row {row + 1 + rows.before}, column {name!r}"

    column = pyarrow.compute.utf8_trim_whitespace(column)
    missing = pyarrow.array(MISSING)
    blank = pyarrow.compute.is_in(pyarrow.compute.utf8_lower(column), value_set=missing)
    column = pyarrow.compute.if_else(blank, None, column)
    if rows.decimal == ",":
        column = pyarrow.compute.replace_substring(column, ",", ".")
    try:
        values = column.cast(pyarrow.float64())
    except pyarrow.ArrowInvalid:  # also of what Python reads, such as +5: one by one then
        cells = enumerate(column.to_pylist())
        values = pyarrow.array(
            [_number(cell, where(row)) for row, cell in cells], pyarrow.float64()
        )
    return np.asarray(values.to_numpy(zero_copy_only=False), np.float64)


def _number(cell: str | None, where: str) -> float | None:
    if cell is None:
        return None
    try:
        return float(cell)
    except ValueError:
        hint = ""
        if len(cell.split()) > 1:
            hint = f"; {MARKS}"
        elif cell.count(",") == 1:
            hint = "; a decimal comma is read where semicolons part the cells of a row"
        raise MjchairError(f"{where}: {cell[:30]!r} is not a number{hint}") from None
