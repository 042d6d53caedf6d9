"""Parts of a chair's specification, found by their names behind any prefix."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.errors import MjchairError, nearest
from mjchair.model.wheels import SUFFIX, WHEELS, base_name

REAR, CASTERS = WHEELS[:2], WHEELS[2:]
SIDE = {"left_wheel": 1.0, "right_wheel": -1.0}


def named(things: Iterable[Any], name: str, what: str) -> Any:
    """The one of `things` with that name, exactly or behind a prefix.

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


def add_to_tires(
    spec: mujoco.MjSpec, index: int, change: float, wheels: tuple[str, ...] = WHEELS
) -> None:
    """Add `change` to one header number of the tires of the wheels; never below zero."""
    _edit_tires(spec, index, lambda value: max(value + change, 0.0), wheels)


def scale_tires(
    spec: mujoco.MjSpec, index: int, factor: float, wheels: tuple[str, ...] = WHEELS
) -> None:
    """Multiply one header number of the tires of the wheels."""
    _edit_tires(spec, index, lambda value: value * factor, wheels)


def _edit_tires(spec: mujoco.MjSpec, index: int, change: Any, wheels: tuple[str, ...]) -> None:
    for wheel in wheels:
        geom = named(spec.geoms, wheel + SUFFIX, "tire geom")
        data = np.array(geom.userdata, dtype=float)
        data[index] = change(data[index])
        geom.userdata = data


def unused_name(things: Iterable[Any], name: str) -> str:
    """`name`, or `name` with the first number that makes it new."""
    taken = {thing.name for thing in things}
    names = (f"{name}_{k}" if k else name for k in range(len(taken) + 1))
    return next(n for n in names if n not in taken)


def explicit_inertial(spec: mujoco.MjSpec, name: str) -> Any:
    """The body, with its mass, centre and inertia written into it."""
    body = named(spec.bodies, name, "body")
    if not body.explicitinertial:
        model = spec.compile()
        i = model.body(body.name).id
        body.mass, body.ipos, body.iquat = (
            model.body_mass[i],
            model.body_ipos[i],
            model.body_iquat[i],
        )
        body.inertia = model.body_inertia[i]
        body.explicitinertial = True
    return body


def inertia_tensor(body: Any) -> NDArray[np.float64]:
    """Inertia (3, 3) kg m^2 about the centre of mass, in the body's axes."""
    rotation = np.zeros(9)
    mujoco.mju_quat2Mat(rotation, np.asarray(body.iquat, float))
    axes = rotation.reshape(3, 3)
    return np.asarray(axes @ np.diag(body.inertia) @ axes.T)


def set_inertia(body: Any, tensor: NDArray[np.float64]) -> None:
    """Write an inertia (3, 3) kg m^2 about the centre of mass, in the body's axes.

    A mass that is taken away may leave what no body has; then the nearest that one has is written.
    """
    values, axes = np.linalg.eigh(tensor)
    values = np.maximum(values, 1e-6)
    values[2] = min(values[2], 0.999 * (values[0] + values[1]))
    if np.linalg.det(axes) < 0.0:
        axes[:, 0] *= -1.0
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, axes.ravel())
    body.iquat, body.inertia = quat, values


def add_mass(body: Any, mass: float, place: NDArray[np.float64]) -> None:
    """Add a point mass (kg, may be negative) at `place` (3,) m in the body's frame."""
    old, centre = float(body.mass), np.asarray(body.ipos, float)
    total = old + mass
    new = (old * centre + mass * place) / total
    tensor = inertia_tensor(body)
    for m, at in ((old, centre - new), (mass, place - new)):
        tensor = tensor + m * (at @ at * np.eye(3) - np.outer(at, at))
    body.mass, body.ipos = total, new
    set_inertia(body, tensor)


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
