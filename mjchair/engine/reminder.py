"""Say once when a chair is stepped without its tires, because nobody called `install`.

In: the function that loads a chair. Out: the same function, which also puts a callback in place
where there is none. The callback does nothing but warn, at the second step of a model with tires;
`install` replaces it. It is a C function, so it stands where a Python callback is refused, as in
`mujoco.batch`; it takes Python's lock for itself. A rider who moves needs no tires to keep the
common centre of mass where it is, so the callback that does this (mjchair.engine.bias_force) is put
in place as well.
"""

from __future__ import annotations

import ctypes
import functools
import threading
import warnings
from collections.abc import Callable
from typing import Any, ParamSpec

import mujoco
import numpy as np

from mjchair.engine import layout
from mjchair.rider import bias_sensor
from mjchair.tire import block

P = ParamSpec("P")

LINE = (
    "a chair of mjchair is stepped without its tires: call mjchair.install() before mj_step, "
    "or its wheels spin without friction"
)


@functools.cache
def _reminder() -> Any:
    """The callback, for `mujoco.set_mjcb_act_dyn`."""
    time_at = layout.offset("mjData", "time")
    once = threading.Lock()

    def remind(model: int, data: int, actuator: int) -> float:
        # at time 0 MuJoCo's compiler may be calling; the threads of a batch may be here together
        started = ctypes.c_double.from_address(data + time_at).value > 0.0
        if started and not once.locked() and _tires(model) and once.acquire(blocking=False):
            warnings.warn(LINE, stacklevel=2)
        return 0.0

    return ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int)(remind)


def _tires(address: int) -> bool:
    """Whether the model at an address has a tire."""
    model = layout.struct("mjModel").from_address(address)
    if not model.nuser_geom:
        return False
    numbers = ctypes.cast(model.geom_user, ctypes.POINTER(ctypes.c_double))
    user = np.ctypeslib.as_array(numbers, (model.ngeom, model.nuser_geom))
    return bool(np.any(user[:, block.TAG_AT] == block.TAG))


def reminding(load: Callable[P, mujoco.MjSpec]) -> Callable[P, mujoco.MjSpec]:
    """The function, which puts the reminder in place where there is no callback."""

    @functools.wraps(load)
    def loaded(*args: P.args, **kwargs: P.kwargs) -> mujoco.MjSpec:
        chair = load(*args, **kwargs)
        if mujoco.get_mjcb_act_dyn() is None:
            mujoco.set_mjcb_act_dyn(_reminder())
        if mujoco.get_mjcb_sensor() is None and bias_sensor.is_in(chair):
            from mjchair.engine import native

            mujoco.set_mjcb_sensor(native.rider_sensor().ctypes)
        return chair

    return loaded
