"""Tire files: read and written by their suffix, never more than a megabyte of them.

In: a path. Out: a `Tire`; or a `Tire` in and its file out.
"""

from __future__ import annotations

import os
from pathlib import Path

from mjchair.errors import MjchairError, nearest
from mjchair.storage import read_bounded, write_whole
from mjchair.tire import tir, toml
from mjchair.tire.tire import Tire

LARGEST = 1_000_000  # bytes; the largest standard tire files have some 30 kB
FORMATS = {".toml": toml, ".tir": tir}


def read(path: str | os.PathLike[str]) -> Tire:
    """The tire in a file.

    Args:
      path: this project's TOML (.toml), or a standard tire property file (.tir) of the Magic
        Formula 5.2, 6.1, 6.2 or 1989 (PAC89) in SI units.

    Returns:
      The tire. What the file has and this project does not use is in its `unused`.

    Raises:
      MjchairError: one line, with the file and what is wrong in it.
    """
    file = Path(path)
    text = _text(file)
    try:
        return _format(file).parse(text, file.stem)  # type: ignore[no-any-return]
    except MjchairError as error:
        raise MjchairError(f"{file}: {error}") from None


def write(tire: Tire, path: str | os.PathLike[str]) -> None:
    """Write `tire` to `path`, TOML or .tir by the suffix; `read` gives back an equal tire.

    Raises:
      MjchairError: unknown suffix, a family that .tir files do not have, or a folder that cannot
        be written.
    """
    file = Path(path)
    write_whole(file, _format(file).compose(tire))


def _format(file: Path):  # type: ignore[no-untyped-def]
    """The module that parses and composes files of this suffix."""
    suffix = file.suffix.lower()
    if suffix not in FORMATS:
        raise MjchairError(f"{file}: suffix {suffix!r}, no tire file's" + nearest(suffix, FORMATS))
    return FORMATS[suffix]


def _text(file: Path) -> str:
    """The file's text: bounded, and text at all."""
    _format(file)
    reason = f"{LARGEST // 1000} kB, which no tire file has"
    data = read_bounded(file, LARGEST, "a tire file", reason)
    if not data.strip():
        raise MjchairError(f"{file}: the file is empty")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")  # comments of old files; numbers are ASCII in both
    if any(ord(c) < 32 and c not in "\t\r\n\f\x1a" for c in text):
        raise MjchairError(f"{file}: not a text file (it has control characters)")
    return text.replace("\r\n", "\n").replace("\r", "\n")
