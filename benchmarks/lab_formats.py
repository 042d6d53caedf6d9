"""Writers of files as laboratories have them: SmartWheel CSV and C3D; nothing of mjchair.

What goes in: the motion of a wheel and the loads of a hand in forward signs, or places of markers,
SI units. What comes out: a file with the signs, wraps, offsets and units of the instrument.
`raw_files.py` and the tests write with it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

RATE = 240.0  # Hz, of a SmartWheel
TICKS = 4096  # of its encoder, a turn
TURN = 2.0 * np.pi


@dataclass(frozen=True)
class Rim:
    """What an instrumented rim shows besides the hand; N and N m, order Fx Fy Fz Mx My Mz.

    Attributes:
      offset: constant. weight: of the rim, N, in its plane once a turn. noise: standard deviations.
      jump: ticks that the encoder reads too many in one sample at its index mark, once a turn.
      All assumptions, of the size of the recording that ships in data/smartwheel.
    """

    offset: tuple[float, ...] = (1.0, -2.0, 0.5, 0.2, 0.1, 0.25)
    weight: float = 6.0
    noise: tuple[float, ...] = (0.7, 0.7, 0.7, 0.1, 0.1, 0.12)
    jump: int = 0


@dataclass(frozen=True)
class Style:
    """How the file is written: counting on or wrapping, decimal commas or points, columns."""

    wrap: bool = True
    semicolon: bool = False
    columns: int = 24


def write_smartwheel(
    path: Path, side: str, turned: Array, speed: Array, hand: Array, rng: np.random.Generator,
    *, radius: float, rim: Rim | None = None, style: Style | None = None,
) -> None:  # fmt: skip
    """A push rim's file: the left one counts down, the right one has Mz < 0 in a forward push.

    Args:
      turned: (n,) rad, forward, at the file's rate. speed: (n,) rad/s. hand: (n, 6), loads of the
        hand, N and N m, Mz > 0 driving forward. radius: m, that the instrument is set to.
    """
    rim, style = rim or Rim(), style or Style()
    counted = -turned if side == "left" else turned
    ticks = np.floor(counted / TURN * TICKS)
    read = ticks + rim.jump * np.r_[False, np.diff(np.floor(counted / TURN)) != 0.0]
    table = np.zeros((turned.size, style.columns))
    table[:, 0] = table[:, 1] = np.arange(turned.size) + 1
    table[:, 2] = read % TICKS if style.wrap else read
    table[:, 3] = np.round((read % TICKS) / TICKS * 360.0, 2)
    table[:, 4] = np.abs(speed) * radius
    table[:, 18:24] = rng.normal(size=(turned.size, 6)) * rim.noise + np.array(rim.offset)
    mark = np.round(counted / TURN * TICKS) / TICKS * TURN
    table[:, 18] += rim.weight * np.cos(mark)
    table[:, 19] += rim.weight * np.sin(mark)
    table[:, 18:24] += hand * [1.0, 1.0, 1.0, 1.0, 1.0, 1.0 if side == "left" else -1.0]
    if style.semicolon:
        lines = [";".join(f"{x:g}".replace(".", ",") for x in row) for row in table]
    else:
        lines = [",".join(f"{x:g}" for x in row) + "," for row in table]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def write_c3d(
    path: Path, names: Sequence[str], positions: Array, rate: float,
    *, unit: str = "m", factor: float = 1.0,
) -> Path:  # fmt: skip
    """Markers as C3D; `positions`: (n, m, 3) in the laboratory's axes, m, NaN where not seen.

    Args:
      rate: Hz. unit: that the file says. factor: what the numbers are multiplied by.
    """
    import ezc3d

    file = ezc3d.c3d()
    file["parameters"]["POINT"]["RATE"]["value"] = [rate]
    file["parameters"]["POINT"]["LABELS"]["value"] = list(names)
    file["parameters"]["POINT"]["UNITS"]["value"] = [unit]
    points = np.ones((4, len(names), len(positions)))
    points[:3] = factor * positions.transpose(2, 1, 0)
    file["data"]["points"] = points
    file.write(str(path))
    return path
