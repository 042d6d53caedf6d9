"""Put the tire callbacks in place, and take them out again.

MuJoCo's callbacks are global to the process. `mjcb_act_dyn`, `mjcb_sensor` and `mjcb_act_bias`
are used; `mjcb_control` and the others stay the user's. Models without tires are untouched: their
user actuators and user sensors find nothing of ours to do.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import mujoco

from mjchair.engine import plain


def _current() -> tuple[Any, Any, Any]:
    return mujoco.get_mjcb_act_dyn(), mujoco.get_mjcb_sensor(), mujoco.get_mjcb_act_bias()


def _put(callbacks: tuple[Any, Any, Any]) -> None:
    mujoco.set_mjcb_act_dyn(callbacks[0])
    mujoco.set_mjcb_sensor(callbacks[1])
    mujoco.set_mjcb_act_bias(callbacks[2])


def install(compiled: bool = True) -> None:
    """Put the tire callbacks in place; again is harmless.

    Args:
      compiled: the native callbacks, which every MuJoCo tool runs, on any number of threads.
        False: the same law as ordinary Python, about a hundred times slower, for one thread.

    Raises:
      LayoutError: the installed MuJoCo's memory is not as it describes it.
    """
    if compiled:
        from mjchair.engine import native

        act_dyn, sensor, act_bias = native.callbacks()
        _put((act_dyn.ctypes, sensor.ctypes, act_bias.ctypes))
    else:
        _put((plain.act_dyn, plain.sensor, plain.act_bias))


def uninstall() -> None:
    """Take the callbacks out: wheels roll without friction then."""
    _put((None, None, None))


@contextmanager
def installed(compiled: bool = True) -> Iterator[None]:
    """Callbacks in place inside the block; what was there before comes back, whatever happens."""
    before = _current()
    install(compiled)
    try:
        yield
    finally:
        _put(before)
