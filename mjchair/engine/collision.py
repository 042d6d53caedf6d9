"""Read and set the collision function of a height field and an ellipsoid in MuJoCo's table.

In: the address of a C function. Out: that function in `mjCOLLISIONFUNC`, for every model.

The table is global to the process, like the callbacks. The function that was there before is
still called for ellipsoids that are no tires, and `put(original())` puts it back.
"""

from __future__ import annotations

import ctypes
import functools
from typing import Any

import mujoco

from mjchair.engine import layout

KINDS = int(mujoco.mjtGeom.mjNGEOMTYPES)
ENTRY = KINDS * int(mujoco.mjtGeom.mjGEOM_HFIELD) + int(mujoco.mjtGeom.mjGEOM_ELLIPSOID)


@functools.cache
def _table() -> Any:
    """`mjCOLLISIONFUNC`, one row after the other."""
    return (ctypes.c_void_p * KINDS**2).from_address(layout.address("mjCOLLISIONFUNC"))


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
