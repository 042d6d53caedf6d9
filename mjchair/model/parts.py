"""Parts of a chair's specification: found by name behind any prefix, and their `user` fields.

In: an MjSpec and a name. Out: the part, or a specification whose part holds other numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.errors import MjchairError, nearest
from mjchair.model.wheels import REAR_CASTERS, SUFFIX, WHEELS, base_name

REAR, CASTERS = WHEELS[:2], WHEELS[2:]
SIDE = {"left_wheel": 1.0, "right_wheel": -1.0}  # of the chair, along its y


def named(things: Iterable[Any], name: str, what: str) -> Any:
    """The one of `things` with that name, exactly or behind a prefix.

    Args:
      things: bodies, geoms or others of a specification. name: wanted.
      what: the kind of thing, for the error line.

    Raises:
      MjchairError: there is none.
    """
    listing = list(things)
    for thing in listing:
        if thing.name == name or base_name(thing.name) == name:
            return thing
    raise MjchairError(
        f"the model has no {what} {name!r}" + nearest(name, (t.name for t in listing if t.name))
    )


def casters(spec: mujoco.MjSpec) -> tuple[str, ...]:
    """Names of the casters that a chair has: two, and two more behind a mid-wheel drive."""
    there = {base_name(body.name) for body in spec.bodies}
    return (*CASTERS, *(name for name in REAR_CASTERS if name in there))


def tire_geom(spec: mujoco.MjSpec, wheel: str) -> Any:
    """The tire's geom of a wheel.

    Raises:
      MjchairError: there is none.
    """
    return named(spec.geoms, wheel + SUFFIX, "tire geom")


def edit_tires(
    spec: mujoco.MjSpec,
    index: int,
    change: Callable[[float], float],
    wheels: tuple[str, ...] = WHEELS,
) -> None:
    """Replace one number of the tire blocks of the wheels by what `change` makes of it."""
    for wheel in wheels:
        geom = tire_geom(spec, wheel)
        data = np.array(geom.userdata, dtype=float)
        data[index] = change(data[index])
        geom.userdata = data


def add_to_tires(
    spec: mujoco.MjSpec, index: int, change: float, wheels: tuple[str, ...] = WHEELS
) -> None:
    """Add `change` to one number of the tire blocks of the wheels; never below zero."""
    edit_tires(spec, index, lambda value: max(value + change, 0.0), wheels)


def scale_tires(
    spec: mujoco.MjSpec, index: int, factor: float, wheels: tuple[str, ...] = WHEELS
) -> None:
    """Multiply one number of the tire blocks of the wheels."""
    edit_tires(spec, index, lambda value: value * factor, wheels)


def unused_name(things: Iterable[Any], name: str) -> str:
    """`name`, or `name` with the first number that makes it new."""
    taken = {thing.name for thing in things}
    names = (f"{name}_{k}" if k else name for k in range(len(taken) + 1))
    return next(n for n in names if n not in taken)


def write_sensor(spec: mujoco.MjSpec, sensor: Any, data: NDArray[np.float64]) -> None:
    """Write a sensor's `user` field, and make room for it in the specification."""
    if 0 <= spec.nuser_sensor < data.size:  # negative: as many as needed
        spec.nuser_sensor = data.size
    sensor.userdata = data


def write_actuator(spec: mujoco.MjSpec, actuator: Any, data: list[float]) -> None:
    """Write an actuator's `user` field, and make room for it in the specification."""
    if 0 <= spec.nuser_actuator < len(data):  # negative: as many as needed
        spec.nuser_actuator = len(data)
    actuator.userdata = data


def write_geom(spec: mujoco.MjSpec, geom: Any, data: NDArray[np.float64]) -> None:
    """Write a geom's `user` field, and make room for it in the specification."""
    if 0 <= spec.nuser_geom < data.size:  # negative: as many as needed
        spec.nuser_geom = data.size
    geom.userdata = data
