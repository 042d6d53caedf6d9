"""Read and set the collision function of a height field and an ellipsoid in MuJoCo's table.

In: the address of a C function. Out: that function in `mjCOLLISIONFUNC`, for every model.

The table is global to the process, like the callbacks. The function that was there before is
still called for ellipsoids that are no tires, and `put(original())` puts it back.
"""

from __future__ import annotations

import ctypes
import functools
from pathlib import Path
from typing import Any

import mujoco

from mjchair.engine.layout import LayoutError

KINDS = int(mujoco.mjtGeom.mjNGEOMTYPES)
ENTRY = KINDS * int(mujoco.mjtGeom.mjGEOM_HFIELD) + int(mujoco.mjtGeom.mjGEOM_ELLIPSOID)


@functools.cache
def _table() -> Any:
    """`mjCOLLISIONFUNC`, one row after the other, in the library that the bindings have loaded."""
    for path in sorted(Path(mujoco.__file__).parent.glob("*mujoco*")):
        if path.name.startswith(("libmujoco.", "mujoco.dll")):
            try:
                return (ctypes.c_void_p * KINDS**2).in_dll(
                    ctypes.CDLL(str(path)), "mjCOLLISIONFUNC"
                )
            except ValueError:
                break
    raise LayoutError(f"mujoco {mujoco.__version__} shows no mjCOLLISIONFUNC; use mujoco 3.17")


def current() -> int:
    """Address of the function in place."""
    return int(_table()[ENTRY])


@functools.cache
def original() -> int:
    """Address of the function that was in place when this was first asked."""
    return current()


def put(address: int) -> None:
    """Put the function at the address in place."""
    original()
    _table()[ENTRY] = address
