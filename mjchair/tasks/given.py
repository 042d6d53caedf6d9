"""What a user gives a task: its options, its pictures' options, and its actions, checked.

In: what was given, and what may be. Out: the same, or one line on what is wrong.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np
from dm_env import specs
from numpy.typing import NDArray

from mjchair.errors import MjchairError, nearest
from mjchair.report.gl import LARGEST

Array = NDArray[np.float64]


def check_names(what: str, given: Iterable[str], function: Callable[..., Any], *own: str) -> None:
    """Refuse names that are no parameters of a function.

    Args:
      what: the names are called this. own: parameters that are not the user's.

    Raises:
      MjchairError: an unknown name.
    """
    parameters = inspect.signature(function).parameters.values()
    known = {p.name for p in parameters if p.kind not in (p.VAR_KEYWORD, p.VAR_POSITIONAL)}
    for name in given:
        if name not in known - set(own):
            raise MjchairError(f"unknown {what} {name!r}" + nearest(name, known - set(own)))


def check_seed(seed: Any) -> None:
    """Refuse a seed that NumPy does not take; None and a RandomState are fine.

    Raises:
      MjchairError: it is none.
    """
    if seed is None or isinstance(seed, np.random.RandomState):
        return
    whole = isinstance(seed, int | np.integer) and not isinstance(seed, bool)
    if not whole or not 0 <= seed < 2**32:
        raise MjchairError(
            f"random is {seed!r}; it must be a whole number from 0 to 2**32 - 1, a RandomState or "
            "None"
        )


def check_picture(options: Mapping[str, Any], cameras: Iterable[str]) -> None:
    """Refuse a size that cannot be drawn, and a camera that is not there.

    Args:
      options: of dm_control's render. cameras: names of the model's.

    Raises:
      MjchairError: naming the option.
    """
    for side in ("height", "width"):
        value = options.get(side, 1)
        whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
        if not whole or not 1 <= value <= LARGEST:
            raise MjchairError(
                f"pixels: {side} is {value!r}; it must be a whole number, 1 to {LARGEST} pixels"
            )
    camera = options.get("camera_id")
    if isinstance(camera, str) and camera not in (known := list(cameras)):
        raise MjchairError(f"pixels: unknown camera {camera!r}" + nearest(camera, known))


def checked_action(action: Any, spec: specs.BoundedArray) -> Array:
    """An action as an array of the shape of its spec; its bounds are not looked at.

    Args:
      spec: of the action, whose name has the names of the components with tabs between them.

    Raises:
      MjchairError: another number of components, or one that is not a finite number.
    """
    names = spec.name.split("\t")
    rule = f"give {len(names)} finite numbers: {', '.join(names)}"
    try:
        values = np.asarray(action, dtype=np.float64)
    except (TypeError, ValueError):
        raise MjchairError(f"action is {action!r}; {rule}") from None
    if values.shape != spec.shape:
        raise MjchairError(f"action has shape {values.shape}; {rule}")
    for name, value in zip(names, values, strict=True):
        if not np.isfinite(value):
            raise MjchairError(f"action: {name} is {value}; {rule}")
    return values
