"""Where MuJoCo's functions and tables are, in the library that its bindings have loaded.

In: the name of an exported symbol. Out: its address.
"""

from __future__ import annotations

import ctypes
import functools
from pathlib import Path

import mujoco

from mjchair.engine.layout import LayoutError


@functools.cache
def address(name: str) -> int:
    """Address of an exported function or table, such as "mj_comVel".

    Raises:
      LayoutError: the installed MuJoCo does not export it.
    """
    for path in sorted(Path(mujoco.__file__).parent.glob("*mujoco*")):
        if path.name.startswith(("libmujoco.", "mujoco.dll")):
            try:
                return ctypes.addressof(ctypes.c_char.in_dll(ctypes.CDLL(str(path)), name))
            except ValueError:
                break
    raise LayoutError(f"mujoco {mujoco.__version__} shows no {name}; use mujoco 3.17")
