"""Where the shipped chairs, scenes and tires are.

In: nothing, or the name of something shipped. Out: paths.
"""

from __future__ import annotations

import os
from pathlib import Path

from mjchair.errors import MjchairError, nearest

_PACKAGE = Path(__file__).parents[1]


def folder() -> Path:
    """The folder `models`: inside the installed package, or beside the sources of a checkout."""
    installed = _PACKAGE / "models"
    return installed if installed.is_dir() else _PACKAGE.parent / "models"


def chairs() -> dict[str, Path]:
    """The shipped chairs: name to MJCF file."""
    return {p.parent.name: p for p in sorted(folder().glob("*/*.xml")) if p.stem == p.parent.name}


def scenes() -> dict[str, Path]:
    """The shipped scenes: name to MJCF file."""
    return {path.stem: path for path in sorted(folder().glob("scenes/*.xml"))}


def tires() -> dict[str, Path]:
    """The shipped tires: name to file."""
    return {path.stem: path for path in sorted(folder().glob("tires/*.t*"))}


def find(kind: str, name: str | os.PathLike[str], shipped: dict[str, Path]) -> Path:
    """The file of a shipped name, or the path that was given.

    Args:
      kind: what is looked for, for the message. name: a shipped name or a path.
      shipped: one of chairs(), scenes(), tires().

    Raises:
      MjchairError: neither a shipped name nor a file.
    """
    if str(name) in shipped:
        return shipped[str(name)]
    path = Path(name)
    if path.is_file():
        return path
    if path.suffix:
        raise MjchairError(
            f"no {kind} file {path}; give a path that exists or a shipped {kind}"
            + nearest(path.stem, shipped)
        )
    raise MjchairError(f"unknown {kind} {str(name)!r}" + nearest(str(name), shipped))
