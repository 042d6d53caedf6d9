"""The results of a sweep: a folder of Parquet files, each a chunk, each written whole."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pyarrow
import pyarrow.parquet

from mjchair.errors import MjchairError
from mjchair.storage import whole, write_whole
from mjchair.sweep.study import Study

ABOUT = "study.json"
TABLE = "results"  # the folder of the Parquet files


class Dataset:
    """A sweep's folder: `study.json`, and `results/`, which any Parquet reader takes as one table.

    Attributes:
      folder: of the sweep.
    """

    def __init__(self, folder: str | os.PathLike[str], study: Study, force: bool = False) -> None:
        """Begin a folder, or go on with one that the same study began.

        Args:
          folder: made where it is not there. study: what it will hold.
          force: drop results of another study.

        Raises:
          MjchairError: the folder holds another study, or files that are no sweep's.
        """
        self.folder = Path(folder)
        self.table = self.folder / TABLE
        about = self.folder / ABOUT
        if about.is_file():
            if _digest(about) == study.digest():
                self.table.mkdir(exist_ok=True)
                return
            if not force:
                raise MjchairError(
                    f"{self.folder} holds another study's results; choose another --out, or drop "
                    "them with --force"
                )
            for path in self.table.glob("*.parquet"):
                path.unlink()
        elif self.folder.is_dir() and any(self.folder.iterdir()) and not force:
            raise MjchairError(
                f"{self.folder} is not empty and no sweep's; choose another --out, or use --force"
            )
        try:
            self.table.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise MjchairError(f"cannot make {self.table}: {error.strerror}") from None
        told = {"digest": study.digest(), "cases": len(study), "axes": list(study.axes)}
        write_whole(about, json.dumps(told, indent=1) + "\n")

    def path(self, first: int) -> Path:
        """Where the chunk that begins with case `first` goes."""
        return self.table / f"case-{first:08d}.parquet"

    def has(self, first: int) -> bool:
        """Whether that chunk is there."""
        return self.path(first).is_file()

    def write(self, first: int, rows: Sequence[Mapping[str, Any]]) -> None:
        """Write a chunk, whole or not at all."""
        columns = list(dict.fromkeys(name for row in rows for name in row))
        table = pyarrow.table({name: _column([row.get(name) for row in rows]) for name in columns})
        with whole(self.path(first)) as temporary:
            pyarrow.parquet.write_table(table, temporary)


def _column(values: list[Any]) -> pyarrow.Array:
    """One type a column whatever chunk it is in: whole numbers become float64, `case` apart."""
    if all(isinstance(value, str) or value is None for value in values):
        return pyarrow.array(values, pyarrow.string())
    if any(isinstance(value, str) for value in values):
        return pyarrow.array([None if v is None else str(v) for v in values], pyarrow.string())
    return pyarrow.array([None if v is None else float(v) for v in values], pyarrow.float64())


def _digest(about: Path) -> str:
    try:
        return str(json.loads(about.read_text())["digest"])
    except (OSError, ValueError, KeyError):
        raise MjchairError(f"{about} is not a sweep's; choose another --out") from None


def read(folder: str | os.PathLike[str]) -> pyarrow.Table:
    """The results in a sweep's folder as one table, in the order of the cases.

    Raises:
      MjchairError: no results there.
    """
    table = Path(folder) / TABLE
    if not table.is_dir() or not any(table.glob("*.parquet")):
        raise MjchairError(f"{folder} holds no results of a sweep; give the --out of one")
    return pyarrow.parquet.read_table(table).sort_by("case")
