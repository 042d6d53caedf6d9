"""The results of a sweep in a folder: a Parquet file for each chunk, and the study's fingerprint.

In: the rows of a chunk. Out: a Parquet file, written completely or not at all, so that an
interrupted sweep can be continued; and the whole table, read in the order of the cases.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pyarrow
import pyarrow.parquet

from mjchair.errors import MjchairError
from mjchair.storage import atomic_file, write_whole
from mjchair.sweep.study import Study

DESCRIPTION = "study.json"  # which study the folder belongs to
TABLE = "results"  # the folder of the Parquet files


class Dataset:
    """The folder of a sweep: `study.json`, and `results/`, which Parquet readers take as one table.

    Attributes:
      folder: the folder of the sweep. table: the folder of the Parquet files in it.
    """

    def __init__(self, folder: str | os.PathLike[str], study: Study, force: bool = False) -> None:
        """Continue a folder of the same study, or begin a new one with the first results.

        Args:
          folder: made where it does not exist. study: the study whose results it holds.
          force: delete the results of another study, when there are new ones.

        Raises:
          MjchairError: the folder holds results of another study, or files of another kind.
        """
        self.folder = Path(folder)
        self.table = self.folder / TABLE
        description = self.folder / DESCRIPTION
        fingerprint = study.fingerprint()
        self._begun = False
        self._about = {"fingerprint": fingerprint, "cases": len(study), "axes": list(study.axes)}
        if description.is_file():
            stored = _fingerprint(description)
            self._begun = stored == fingerprint
            if not (self._begun or force) and any(self.table.glob("*.parquet")):
                changed = [part for part in fingerprint if stored.get(part) != fingerprint[part]]
                raise MjchairError(
                    f"{self.folder} holds the results of another study (changed: "
                    f"{', '.join(changed)}); choose another --out, or delete them with --force"
                )
        elif self.folder.is_dir() and any(self.folder.iterdir()) and not force:
            raise MjchairError(
                f"{self.folder} is not empty and does not belong to a sweep; choose another --out, "
                "or use --force"
            )

    def _begin(self) -> None:
        """Make the folder of the study, empty but for its description, where it is not begun."""
        try:
            self.table.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise MjchairError(f"cannot make the folder {self.table}: {error.strerror}") from None
        if self._begun:
            return
        for path in self.table.glob("*.parquet"):
            path.unlink()
        write_whole(self.folder / DESCRIPTION, json.dumps(self._about, indent=1) + "\n")
        self._begun = True

    def path(self, first: int) -> Path:
        """The file of the chunk that begins with case number `first`."""
        return self.table / f"case-{first:08d}.parquet"

    def has(self, first: int) -> bool:
        """Whether the chunk that begins with case number `first` is written."""
        return self._begun and self.path(first).is_file()

    def write(self, first: int, rows: Sequence[Mapping[str, Any]]) -> None:
        """Write the rows of a chunk, completely or not at all.

        Args:
          first: number of the chunk's first case. rows: column -> value, a mapping for each case.
        """
        self._begin()
        columns = list(dict.fromkeys(name for row in rows for name in row))
        table = pyarrow.table({name: _column([row.get(name) for row in rows]) for name in columns})
        with atomic_file(self.path(first)) as temporary:
            pyarrow.parquet.write_table(table, temporary)


def _column(values: list[Any]) -> pyarrow.Array:
    """A column as text or float64, so that a column has the same type in every chunk."""
    if all(isinstance(value, str) or value is None for value in values):
        return pyarrow.array(values, pyarrow.string())
    if any(isinstance(value, str) for value in values):
        return pyarrow.array([None if v is None else str(v) for v in values], pyarrow.string())
    return pyarrow.array([None if v is None else float(v) for v in values], pyarrow.float64())


def _fingerprint(description: Path) -> dict[str, str]:
    """The fingerprint in a folder's description; empty where an older mjchair wrote none."""
    try:
        about = json.loads(description.read_text())
        return dict(about.get("fingerprint", {}))
    except (OSError, ValueError, AttributeError):
        raise MjchairError(
            f"{description} was not written by a sweep; choose another --out"
        ) from None


def read(folder: str | os.PathLike[str]) -> pyarrow.Table:
    """The results in the folder of a sweep as one table, in the order of the cases.

    Raises:
      MjchairError: the folder holds no results.
    """
    table = Path(folder) / TABLE
    if not table.is_dir() or not any(table.glob("*.parquet")):
        raise MjchairError(
            f"{folder} holds no results of a sweep; give the folder that a sweep had as --out"
        )
    return pyarrow.parquet.read_table(table).sort_by("case")
