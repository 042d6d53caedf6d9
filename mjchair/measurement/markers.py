"""Markers of motion capture, from C3D and TRC.

In: a file. Out: `Markers`: positions in m on one clock, NaN where a marker was not seen. Units are
those that the file says; where a person would be a kilometre tall, the line says so.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mjchair.errors import MjchairError, note
from mjchair.measurement.delimited import read_text

Array = NDArray[np.float64]

UNITS = {"m": 1.0, "meter": 1.0, "meters": 1.0, "cm": 1e-2, "mm": 1e-3, "millimeters": 1e-3}
SPREAD = (0.15, 6.0)  # m, between the markers of a person in a chair at one time
SMOOTH = 0.08  # s, half width of the parabolas through a chair's way that give its speed


@dataclass(frozen=True)
class Markers:
    """Markers over time.

    Attributes:
      time: (n,), s, from 0. names: m of them. positions: (n, m, 3), m, in the laboratory's axes.
      source: the file.
    """

    time: Array
    names: tuple[str, ...]
    positions: Array
    source: str

    @property
    def rate(self) -> float:
        """Samples a second, Hz."""
        return float(1.0 / np.median(np.diff(self.time)))


def read_markers(path: str | os.PathLike[str]) -> Markers:
    """Read a C3D or TRC file.

    Raises:
      MjchairError: no such file, another suffix, no points, no marker ever seen, other units than
        the file says.
    """
    path = Path(path)
    if not path.is_file():
        raise MjchairError(f"no file {path}; give a C3D or TRC file")
    readers = {".c3d": _read_c3d, ".trc": _read_trc}
    if path.suffix.lower() not in readers:
        raise MjchairError(f"{path}: markers are in a file that ends in .c3d or .trc")
    markers = readers[path.suffix.lower()](path)
    seen: NDArray[np.bool_] = np.asarray(np.isfinite(markers.positions).all(axis=2))
    if not markers.names or not seen.any():
        raise MjchairError(f"{path}: no points; no marker was seen in any of its frames")
    if markers.time.size < 2:
        raise MjchairError(f"{path}: {markers.time.size} frame; motion needs at least 2")
    _check_size(markers, seen)
    return markers


def _check_size(markers: Markers, seen: NDArray[np.bool_]) -> None:
    frame = int(np.argmax(seen.sum(axis=1)))
    if seen[frame].sum() < 2:
        return
    size = float(np.max(np.ptp(markers.positions[frame, seen[frame]], axis=0)))
    if not SPREAD[0] < size < SPREAD[1]:
        unit = "mm called m" if size > SPREAD[1] else "m called mm"
        raise MjchairError(
            f"{markers.source}: its markers lie {size:.3g} m apart, and a person in a chair is "
            f"1 to 2 m; are they in {unit}? put the unit of POINT right in the file"
        )


def _factor(unit: str, path: Path) -> float:
    if unit.strip().lower() not in UNITS:
        raise MjchairError(f"{path}: unit {unit!r} of its points; known: {', '.join(UNITS)}")
    return UNITS[unit.strip().lower()]


def _read_c3d(path: Path) -> Markers:
    import ezc3d

    try:
        file = ezc3d.c3d(str(path))
    except (OSError, RuntimeError, ValueError, IndexError) as error:
        raise MjchairError(f"cannot read {path} as C3D: {str(error).splitlines()[0]}") from None
    points = file["data"]["points"]
    given = file["parameters"]["POINT"]
    labels = _labels(given)[: points.shape[1]]
    if points.shape[1] == 0 or points.shape[2] == 0:
        raise MjchairError(f"{path}: a C3D without points; it holds no marker")
    units = given.get("UNITS", {}).get("value", [])
    factor = _factor(units[0], path) if units else 1e-3
    positions = factor * np.moveaxis(points[:3], 2, 0).transpose(0, 2, 1)
    positions[(positions == 0.0).all(axis=2)] = np.nan
    rate = float(given["RATE"]["value"][0])
    return Markers(np.arange(len(positions)) / rate, tuple(labels), positions, str(path))


def _labels(given: object) -> list[str]:
    """The labels of all points; files with more than 255 have LABELS2 and so on."""
    names: list[str] = []
    for key in ("LABELS", "LABELS2", "LABELS3"):
        if key in given:  # type: ignore[operator]
            names += list(given[key]["value"])  # type: ignore[index]
    return names


def _read_trc(path: Path) -> Markers:
    lines = [line.rstrip("\r\n") for line in read_text(path)]
    if len(lines) < 7 or not lines[0].startswith("PathFileType"):
        raise MjchairError(f"{path}: not a TRC file; its first line begins with PathFileType")
    keys = lines[1].split("\t")
    told = dict(zip(keys, lines[2].split("\t"), strict=False))
    names = [name for name in lines[3].split("\t")[2:] if name.strip()]
    rows = [_trc_row(line, len(names), f"{path}: row {i}") for i, line in _numbered(lines)]
    if not rows:
        raise MjchairError(f"{path}: a TRC without frames")
    rows = _whole(rows, lines, told.get("NumFrames", ""), path)
    data = np.array(rows)
    factor = _factor(told.get("Units", "mm"), path)
    positions = factor * data[:, 1:].reshape(len(data), len(names), 3)
    return Markers(data[:, 0] - data[0, 0], tuple(names), positions, str(path))


def _whole(rows: list[list[float]], lines: list[str], frames: str, path: Path) -> list[list[float]]:
    """The frames of a TRC; of a file that is cut off without its last one, and with a note."""
    if not frames.strip().isdigit() or len(rows) >= int(frames) or len(rows) < 2:
        return rows
    last = max(line.count("\t") for _, line in _numbered(lines))
    broken = _numbered(lines)[-1][1].count("\t") < last
    note(
        f"{path}: its header tells {int(frames)} frames, and {len(rows)} are there: it is cut off"
        + ("; the last one is not whole and is left out" if broken else "")
    )
    return rows[:-1] if broken else rows


def _numbered(lines: Sequence[str]) -> list[tuple[int, str]]:
    return [(i, line) for i, line in enumerate(lines[5:], start=6) if line.strip()]


def _trc_row(line: str, markers: int, where: str) -> list[float]:
    cells = line.split("\t")[1:]
    cells = (cells + [""] * (1 + 3 * markers))[: 1 + 3 * markers]
    try:
        return [float(cell) if cell.strip() else np.nan for cell in cells]
    except ValueError as error:
        raise MjchairError(f"{where}: {error}; is there text among the numbers?") from None
