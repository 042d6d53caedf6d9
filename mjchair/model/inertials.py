"""Mass, centre of mass and inertia of bodies and of their parts: read, add and write them.

In: bodies of an MjSpec, or some of their geoms. Out: `Inertial` values, and bodies that have them.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.model import parts

Array = NDArray[np.float64]

_G = mujoco.mjtGeom
SOLIDS = (_G.mjGEOM_SPHERE, _G.mjGEOM_CAPSULE, _G.mjGEOM_ELLIPSOID, _G.mjGEOM_CYLINDER,
          _G.mjGEOM_BOX)  # fmt: skip


@dataclass(frozen=True)
class Inertial:
    """Mass (kg), centre of mass (3,) m and inertia (3, 3) kg m^2 about it, in one frame."""

    mass: float
    centre: Array
    tensor: Array

    def plus(self, other: Inertial, sign: float = 1.0) -> Inertial:
        """The sum of both; with `sign` -1 the difference."""
        total = self.mass + sign * other.mass
        if total == 0.0:
            return NOTHING
        centre = (self.mass * self.centre + sign * other.mass * other.centre) / total
        tensor = _about(self, centre) + sign * _about(other, centre)
        return Inertial(total, centre, tensor)

    def scaled(self, factor: float) -> Inertial:
        """The same shape with another mass."""
        return Inertial(factor * self.mass, self.centre, factor * self.tensor)


NOTHING = Inertial(0.0, np.zeros(3), np.zeros((3, 3)))


def _about(part: Inertial, point: Array) -> Array:
    """Inertia (3, 3) of a part about another point: the parallel axis theorem."""
    offset = part.centre - point
    return part.tensor + part.mass * (offset @ offset * np.eye(3) - np.outer(offset, offset))


def _turned(principal: Array, quat: Array) -> Array:
    rotation = np.zeros(9)
    mujoco.mju_quat2Mat(rotation, np.asarray(quat, float))
    axes = rotation.reshape(3, 3)
    return np.asarray(axes @ np.diag(principal) @ axes.T)


def of_body(body: Any) -> Inertial:
    """The explicit inertial of a body, in the body's frame."""
    return Inertial(float(body.mass), np.array(body.ipos, float), _turned(body.inertia, body.iquat))


def of_compiled(model: mujoco.MjModel, body: int) -> Inertial:
    """The inertial of a body of a compiled model, in the body's frame."""
    tensor = _turned(model.body_inertia[body], model.body_iquat[body])
    return Inertial(float(model.body_mass[body]), model.body_ipos[body].copy(), tensor)


def of_geoms(geoms: Iterable[Any]) -> Inertial:
    """The sum of all solid geoms that have a mass, in the frame of their body."""
    alone = mujoco.MjSpec()
    body = alone.worldbody.add_body(name="parts")
    body.add_freejoint()
    weighed = [g for g in geoms if g.mass > 0.0 and g.type in SOLIDS]
    for geom in weighed:
        body.add_geom(
            type=geom.type,
            pos=geom.pos,
            quat=geom.quat,
            fromto=geom.fromto,
            size=geom.size,
            mass=geom.mass,
        )
    if not weighed:
        return NOTHING
    return of_compiled(alone.compile(), 1)


def explicit(spec: mujoco.MjSpec, name: str) -> Any:
    """The body, with its mass, centre and inertia written into it.

    Raises:
      MjchairError: there is no such body.
    """
    body = parts.named(spec.bodies, name, "body")
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


def principal(tensor: Array) -> tuple[Array, Array]:
    """Axes, as a quaternion (4,), and principal moments (3,) kg m^2 of an inertia (3, 3).

    Removing a mass may leave an inertia that no real body has; then the nearest valid one's.
    """
    values, axes = np.linalg.eigh(tensor)
    values = np.maximum(values, 1e-6)
    values[2] = min(values[2], 0.999 * (values[0] + values[1]))
    if np.linalg.det(axes) < 0.0:
        axes[:, 0] *= -1.0
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, axes.ravel())
    return quat, values


def set_tensor(body: Any, tensor: Array) -> None:
    """Write an inertia (3, 3) kg m^2 about the centre of mass, in the body's axes."""
    body.iquat, body.inertia = principal(tensor)


def write(body: Any, inertial: Inertial) -> None:
    """Write an inertial into a body."""
    body.mass, body.ipos = inertial.mass, inertial.centre
    set_tensor(body, inertial.tensor)


def add_mass(body: Any, mass: float, place: Array) -> None:
    """Add a point mass (kg, may be negative) at `place` (3,) m in the body's frame."""
    write(body, of_body(body).plus(Inertial(mass, np.asarray(place, float), np.zeros((3, 3)))))
