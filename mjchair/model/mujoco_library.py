"""The library of MuJoCo that its Python bindings have loaded.

In: nothing. Out: the library, whose functions and tables are found by their names.
"""

from __future__ import annotations

import ctypes
import functools
from pathlib import Path

import mujoco


@functools.cache
def shared() -> ctypes.CDLL | None:
    """The library; None where a release keeps it elsewhere."""
    for path in sorted(Path(mujoco.__file__).parent.glob("*mujoco*")):
        if path.name.startswith(("libmujoco.", "mujoco.dll")):
            return ctypes.CDLL(str(path))
    return None
