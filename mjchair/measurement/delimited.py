"""Delimited text as instruments write it: any separator, decimal commas, lines before the data.

In: a text file. Where its numbers begin, what separates them and how the columns are called is
found out here; mjchair.csv_table reads the numbers. Out: the column names, if there are any, and
the numbers as an array; a missing sample is NaN. Between the first and the last
row of numbers there is nothing else.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mjchair.csv_table import Rows, numbers
from mjchair.errors import MjchairError
from mjchair.storage import read_bounded

Array = NDArray[np.float64]

LARGEST = 300_000_000  # bytes
PREAMBLE = 60  # lines that may stand before the numbers
SEPARATORS = (";", "\t", ",")
_QUOTED = re.compile(r'"[^"]*"')


@dataclass(frozen=True)
class Delimited:
    """A delimited text file.

    Attributes:
      header: column names, in order; empty where the file has none. values: (n, columns), NaN where
      a sample is missing. first: line of the file (from 1) with the first row. preamble: the
      lines before the header. source: the file.
    """

    header: tuple[str, ...]
    values: Array
    first: int
    preamble: tuple[str, ...]
    source: str


def read_text(path: Path) -> list[str]:
    """The lines of a text file in UTF-8, UTF-16 with a mark, or Latin-1.

    Raises:
      MjchairError: it cannot be read, is too large, or holds binary data.
    """
    data = read_bounded(path, LARGEST, "a text file", f"{LARGEST // 1_000_000} MB; cut it in parts")
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return data.decode("utf-16", errors="replace").splitlines()
    if b"\x00" in data[:4096]:
        raise MjchairError(f"cannot read {path} as text: it holds binary data; export it as CSV")
    try:
        return data.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError:
        return data.decode("latin-1").splitlines()


def read_delimited(path: Path) -> Delimited:
    """Read a delimited text file; see the module's docstring.

    Raises:
      MjchairError: it cannot be read, has no row of numbers, or a row among them that is shorter,
        longer or not numeric.
    """
    lines = read_text(path)
    start, separator = _first_row(lines, path)
    width = len(_cells(lines[start], separator))
    header = _header(lines[:start], separator, width)
    names = header or tuple(str(k) for k in range(1, width + 1))
    skipped = len(lines[:start]) - (1 if header else 0)
    return Delimited(
        header=header,
        values=_values(lines, start, separator, names, str(path)),
        first=start + 1,
        preamble=tuple(lines[:skipped]),
        source=str(path),
    )


def _values(
    lines: list[str], start: int, separator: str, names: tuple[str, ...], source: str
) -> Array:
    """The numbers from line `start` on, (n, columns)."""
    body = [line.rstrip("\r\n ") for line in lines[start:]]
    if body[0].endswith(separator):  # it closes the last cell
        body = [line.removesuffix(separator) for line in body]
    decimal = _decimal(body, separator)
    rows = Rows("\n".join(body), source, separator, decimal, before=start)
    columns = [column for column in numbers(rows, names) if column is not None]
    return np.column_stack(columns)


def _first_row(lines: list[str], path: Path) -> tuple[int, str]:
    """Index of the first line of numbers, and what separates its cells."""
    for index, line in enumerate(lines[:PREAMBLE]):
        for separator in SEPARATORS:
            cells = _cells(line, separator)
            if len(cells) < 2 or (separator == "," and ";" in line):
                continue
            numbers = [_is_number(cell) for cell in cells if cell]
            if len(numbers) >= 2 and all(numbers):
                return index, separator
            if len(numbers) > 3 and sum(numbers) > 0.5 * len(numbers):
                text = next(c for c in cells if c and not _is_number(c))
                raise MjchairError(
                    f"{path}: row {index + 1} has {text!r} among its numbers; take the text out"
                )
    if not any(line.strip() for line in lines):
        raise MjchairError(f"{path}: it is empty")
    raise MjchairError(
        f"{path}: no row of numbers in its first {min(PREAMBLE, len(lines))} lines; "
        "a table has a number in every column, separated by comma, semicolon or tab"
    )


def _cells(line: str, separator: str) -> list[str]:
    """The cells of a line; a separator at its very end closes the last cell."""
    text = line.rstrip("\r\n ")
    if text.endswith(separator):
        text = text[:-1]
    return [cell.strip().strip('"').strip() for cell in text.split(separator)]


def _is_number(cell: str) -> bool:
    try:
        float(cell.replace(",", "."))
    except ValueError:
        return False
    return True


def _decimal(lines: list[str], separator: str) -> str:
    """Whether numbers have a decimal comma; only where commas do not separate cells."""
    if separator == ",":
        return "."
    return "," if any("," in _QUOTED.sub("", line) for line in lines[:50]) else "."


def _header(before: list[str], separator: str, width: int) -> tuple[str, ...]:
    """The last line before the numbers that has a name in nearly every column."""
    for line in reversed(before):
        cells = _cells(line.lstrip("#/ "), separator)
        if len(cells) == width and sum(bool(c) and not _is_number(c) for c in cells) > width // 2:
            return tuple(cells)
        if line.strip():
            break
    return ()
