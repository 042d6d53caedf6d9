"""Edits of wheels and casters, which a designer's parameters and the effects share.

In: an MjSpec whose tires are set, and numbers in SI. Out: the specification, changed in place.
Only these functions change camber, toe, wheel radius, caster trail and the gain of torques; hubs
keep their positions.
A designer's parameter is the new value of a quantity; an effect is a change of the present value.
"""

from __future__ import annotations

import math
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.model import parts
from mjchair.tire import block

Array = NDArray[np.float64]


def _turn(body: Any, angle: float, axis: tuple[float, float, float]) -> None:
    """Turn a body about an axis of its parent, through the body's origin."""
    half = 0.5 * angle
    out = np.zeros(4)
    by = np.r_[math.cos(half), math.sin(half) * np.array(axis)]
    mujoco.mju_mulQuat(out, by, np.asarray(body.quat, float))
    body.quat = out


def _axle(spec: mujoco.MjSpec, wheel: str) -> Array:
    """The axle of a rear wheel, (3,) in the chair's frame, pointing to the left."""
    axle = np.zeros(3)
    quat = np.asarray(parts.named(spec.bodies, wheel, "body").quat, float)
    joint = parts.named(spec.joints, wheel, "joint")
    mujoco.mju_rotVecQuat(axle, np.asarray(joint.axis, float), quat)
    return axle


def camber(spec: mujoco.MjSpec, wheel: str) -> float:
    """Camber of a rear wheel, rad, positive where its top leans inwards."""
    axle = _axle(spec, wheel)
    return parts.SIDE[wheel] * math.atan2(axle[2], math.hypot(axle[0], axle[1]))


def toe(spec: mujoco.MjSpec, wheel: str) -> float:
    """Toe of a rear wheel, rad, positive where its front points inwards."""
    axle = _axle(spec, wheel)
    return parts.SIDE[wheel] * math.atan2(axle[0], axle[1])


def add_camber(spec: mujoco.MjSpec, wheel: str, angle: float) -> None:
    """Lean the top of a rear wheel inwards by `angle` (rad); its hub stays in place."""
    body = parts.named(spec.bodies, wheel, "body")
    _turn(body, parts.SIDE[wheel] * angle, (1.0, 0.0, 0.0))


def reach(spec: mujoco.MjSpec, wheel: str) -> float:
    """Height (m) of a rear wheel's hub above the lowest point of its tire, an ellipsoid."""
    size, lean = parts.tire_geom(spec, wheel).size, camber(spec, wheel)
    return math.hypot(size[0] * math.cos(lean), size[2] * math.sin(lean))


def steer_wheel(spec: mujoco.MjSpec, wheel: str, angle: float) -> None:
    """Turn a rear wheel to the left by `angle` (rad), about the chair's vertical."""
    _turn(parts.named(spec.bodies, wheel, "body"), angle, (0.0, 0.0, 1.0))


def raise_hub(spec: mujoco.MjSpec, wheel: str, height: float) -> None:
    """Move the hub of a wheel up on the frame by `height` (m)."""
    body = parts.named(spec.bodies, wheel, "body")
    body.pos = np.add(body.pos, (0.0, 0.0, height))


def set_radius(spec: mujoco.MjSpec, wheel: str, radius: float) -> float:
    """Give a wheel another radius (m); its hub stays in place. Returns the old radius.

    The crown of the tire keeps its radius; mass, inertia and rolling resistance stay.
    """
    geom = parts.tire_geom(spec, wheel)
    old, half = float(geom.size[0]), float(geom.size[2])
    geom.size = (radius, radius, half * math.sqrt(radius / old))
    tire = np.array(geom.userdata)
    tire[block.RADIUS] = radius
    geom.userdata = tire
    return old


def add_radius(spec: mujoco.MjSpec, wheel: str, change: float) -> None:
    """Make the radius of a wheel larger by `change` (m); its hub stays in place."""
    set_radius(spec, wheel, float(parts.tire_geom(spec, wheel).size[0]) + change)


def scale_torque(spec: mujoco.MjSpec, wheel: str, change: float) -> None:
    """Change the torque of a rear wheel's actuator by the fraction `change` (1)."""
    actuator = parts.named(spec.actuators, wheel, "actuator")
    gain = list(actuator.gainprm)
    gain[0] *= 1.0 + change
    actuator.gainprm = gain


def add_trail(spec: mujoco.MjSpec, caster: str, length: float) -> None:
    """Move the wheel of a caster back from its stem by `length` (m)."""
    body = parts.named(spec.bodies, caster, "body")
    body.pos = np.asarray(body.pos, float) - [length, 0.0, 0.0]
