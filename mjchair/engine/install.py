"""Put the tire callbacks in place, and take them out again.

In: nothing but which kind, compiled or plain. Out: MuJoCo's callbacks, set or restored.

MuJoCo's callbacks are global to the process. `mjcb_act_dyn`, `mjcb_sensor` and `mjcb_act_bias`
are used, and in `mjCOLLISIONFUNC` the entry of height field and ellipsoid; `mjcb_control` and the
others stay the user's. Models without tires are untouched: the callbacks look for the tags of
mjchair's tires, elements and sensors, and do nothing where there are none.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import mujoco

from mjchair.engine import collision, plain


def _current() -> tuple[Any, Any, Any, int]:
    return (
        mujoco.get_mjcb_act_dyn(),
        mujoco.get_mjcb_sensor(),
        mujoco.get_mjcb_act_bias(),
        collision.current(),
    )


def _put(act_dyn: Any, sensor: Any, act_bias: Any, contact: int) -> None:
    mujoco.set_mjcb_act_dyn(act_dyn)
    mujoco.set_mjcb_sensor(sensor)
    mujoco.set_mjcb_act_bias(act_bias)
    collision.put(contact)


def install(compiled: bool = True) -> None:
    """Put the tire callbacks in place; again is harmless.

    Args:
      compiled: the native callbacks, which every MuJoCo tool runs, on any number of threads.
        False: the same law as ordinary Python, about a hundred times slower, for one thread.

    Raises:
      LayoutError: the installed MuJoCo's memory is not as it describes it.
    """
    if not compiled:
        contact = ctypes.cast(plain.field_contact(), ctypes.c_void_p).value or 0
        _put(plain.act_dyn, plain.sensor, plain.act_bias, contact)
        return
    from mjchair.engine import native

    act_dyn, sensor, act_bias = native.callbacks()
    _put(act_dyn.ctypes, sensor.ctypes, act_bias.ctypes, native.field_contact().address)


def uninstall() -> None:
    """Take the callbacks out: wheels roll without friction then."""
    _put(None, None, None, collision.original())


@contextmanager
def uninstalled() -> Iterator[None]:
    """No callbacks inside the block, nor the reminder; what was there before comes back."""
    before = _current()
    uninstall()
    try:
        yield
    finally:
        _put(*before)


@contextmanager
def installed(compiled: bool = True) -> Iterator[None]:
    """Callbacks in place inside the block; what was there before comes back, whatever happens."""
    before = _current()
    install(compiled)
    try:
        yield
    finally:
        _put(*before)
