"""Radius and position of each wheel of a compiled model, as needed for rolling.

In: a compiled model. Out: radius and position of a wheel, and the rear axle.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco

from mjchair.errors import MjchairError, nearest
from mjchair.model.wheels import SUFFIX, WHEELS, base_name

CHAIR = "chair"


@dataclass(frozen=True)
class RollingWheel:
    """Radius of a wheel (m), and its centre in the chair's frame: ahead and to the left (m)."""

    radius: float
    ahead: float
    left: float


def rolling_wheel(model: mujoco.MjModel, wheel: str) -> RollingWheel:
    """One wheel of a chair, in the initial pose of the model.

    Args:
      wheel: one of WHEELS, with or without a prefix.

    Raises:
      MjchairError: the model has no such wheel, or no chair.
    """
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    geom = _geom(model, wheel)
    body = chair_body(model)
    centre = data.xmat[body].reshape(3, 3).T @ (data.geom_xpos[geom] - data.xpos[body])
    return RollingWheel(float(model.geom_size[geom, 0]), float(centre[0]), float(centre[1]))


def _geom(model: mujoco.MjModel, wheel: str) -> int:
    known = [model.geom(i).name for i in range(model.ngeom)]
    for i, name in enumerate(known):
        if name == wheel + SUFFIX or base_name(name) == wheel + SUFFIX:
            return i
    raise MjchairError(f"the model has no wheel {wheel!r}" + nearest(wheel, WHEELS))


def chair_body(model: mujoco.MjModel) -> int:
    """The body of the chair, that with the joint named 'chair'.

    Raises:
      MjchairError: the model has no such joint.
    """
    for i in range(model.njnt):
        if base_name(model.joint(i).name) == CHAIR:
            return int(model.jnt_bodyid[i])
    raise MjchairError("the model has no joint named 'chair'")


@dataclass(frozen=True)
class RearAxle:
    """The rear wheels of a chair.

    Attributes:
      radius: side -> m. track: between the wheels, m.
    """

    left: float
    right: float
    track: float

    def radius(self, side: str) -> float:
        """Of the "left" or the "right" wheel, m."""
        return self.left if side == "left" else self.right


def rear_axle(model: mujoco.MjModel) -> RearAxle:
    """The rear wheels of a compiled model.

    Raises:
      MjchairError: it has no rear wheels.
    """
    left, right = (rolling_wheel(model, wheel) for wheel in WHEELS[:2])
    return RearAxle(left.radius, right.radius, left.left - right.left)
