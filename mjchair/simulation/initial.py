"""How a chair starts: placed on its floor, settled on its tires, rolling without slip.

In: a model, and where and how the chair starts. Out: the data at time 0. The module
mjchair.simulation.settling brings the chair to rest on its tires, and refuses where it cannot.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.drive import block
from mjchair.drive.attach import Driven, drives
from mjchair.engine import drivetrain
from mjchair.errors import MjchairError, nearest
from mjchair.model.wheels import wheels
from mjchair.simulation import names
from mjchair.simulation.floor import (
    clearance,
    floor_plane,
    height_above,
    on_field,
    tire_geoms,
)
from mjchair.simulation.inputs import is_position
from mjchair.simulation.settling import settle

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Initial:
    """Where and how the chair starts.

    Attributes:
      position: (x, y) of site `axle` in the world, m; None: where the model has it.
      heading: rad, from the world's x to the chair's x about the world's z; None: as in the model.
      speed: of site `axle` along the chair's x, m/s.
      yaw_rate: about the floor's normal, rad/s.

    Raises:
      MjchairError: a number that is not finite.
    """

    position: tuple[float, float] | None = None
    heading: float | None = None
    speed: float = 0.0
    yaw_rate: float = 0.0

    def __post_init__(self) -> None:
        """Check that every number is finite."""
        for name in ("position", "heading", "speed", "yaw_rate"):
            value = getattr(self, name)
            if value is not None and not np.isfinite(value).all():
                raise MjchairError(f"initial {name} is {value}; it must be finite")
        if self.position is not None and len(self.position) != 2:
            raise MjchairError(f"initial position is {self.position}; it must be (x, y) in m")


def as_initial(given: Initial | Mapping[str, Any] | None) -> Initial:
    """An Initial from a mapping with its fields, or the default from None.

    Raises:
      MjchairError: an unknown field, or as Initial does.
    """
    if isinstance(given, Initial):
        return given
    fields = dict(given or {})
    for name in fields:
        if name not in Initial.__dataclass_fields__:
            raise MjchairError(
                f"initial {name!r} is unknown" + nearest(name, Initial.__dataclass_fields__)
            )
    return Initial(**fields)


def lock_wheels(model: mujoco.MjModel, qpos: Array) -> None:
    """Lock every parking brake of the model at the wheel angles in `qpos`, in place.

    Raises:
      MjchairError: the model has no joint equality whose name ends in `_brake`.
    """
    brakes = [
        i
        for i in range(model.neq)
        if model.eq_type[i] == mujoco.mjtEq.mjEQ_JOINT
        and (mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_EQUALITY, i) or "").endswith("_brake")
    ]
    if not brakes:
        raise MjchairError("the model has no parking brake; name joint equalities `<side>_brake`")
    for i in brakes:
        joint = model.eq_obj1id[i]
        address = model.jnt_qposadr[joint]
        model.eq_data[i, 0] = qpos[address] - model.qpos0[address]
        model.eq_active0[i] = 1


def start(
    model: mujoco.MjModel,
    initial: Initial,
    brakes: bool = False,
    controls: Array | None = None,
) -> mujoco.MjData:
    """Data at time 0: placed, settled on the tires, moving as `initial` says.

    The tire callbacks must be in place. Casters are turned into their direction of travel, the
    chair settles while every hinge is held, and the wheels get the speed of rolling without slip,
    so the tires start without longitudinal force. With brakes, the chair settles on its locked
    wheels, and the tires start with the forces that hold it. A power chair with a drive settles in
    the same way on the brakes of its drive.

    Args:
      model: to run; its parking brakes are locked here, in place, if `brakes`.
      initial: where and how. brakes: lock them at the wheel angles of the start.
      controls: (nu,) at time 0: joints that are driven to a position start in this position, at
        rest; None: in the position of the model.

    Raises:
      MjchairError: a speed or a position is given for a model without exactly one joint `chair`, or
        without a floor.
      NotStandingError: the chair does not come to rest on its wheels: it tips, slides or moves on.
    """
    data = mujoco.MjData(model)
    driven = position_joints(model)
    if controls is not None:
        for actuator, joint in driven.items():
            data.ctrl[actuator] = controls[actuator]
            data.qpos[model.jnt_qposadr[joint]] = controls[actuator]
    placed = initial.position is not None or initial.heading is not None
    moving = initial.speed != 0.0 or initial.yaw_rate != 0.0
    if placed:
        _place(model, data, initial)
    if moving:
        _turn_casters(model, data, initial)
    if brakes:
        lock_wheels(model, data.qpos)
        data.eq_active[:] = model.eq_active0
    powered = drives(model)
    # when parked, the drive's brakes hold the wheels, and the tires start with the holding force
    parked = bool(powered) and not moving
    settle(model, data, held=not brakes and not parked)
    if initial.position is not None:
        _shift(model, data, np.asarray(initial.position))
    if not brakes and not parked:
        _release(model, data)
    if moving:
        _set_velocities(model, data, initial)
    for drive in powered:
        _ready(model, data, drive, initial if moving else None, controls)
    data.time = 0.0
    return data


def _ready(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    drive: Driven,
    moving: Initial | None,
    controls: Array | None,
) -> None:
    """Set the drive at time 0: parked, or running with the references of a moving chair.

    The changes of its state during settling are undone, except the twist of the brakes that hold
    it.

    Args:
      moving: how the chair moves; None: it stands. controls: (nu,) at time 0.
    """
    for first in drive.motor_states:
        windup = data.act[first + drivetrain.WINDUP]
        data.act[first : first + len(block.MOTOR_STATE)] = 0.0
        data.act[first + drivetrain.WINDUP] = 0.0 if moving else windup
        data.act[first + drivetrain.OPEN] = 1.0 if moving else 0.0
    state = data.act[drive.state : drive.state + len(block.CONTROLLER_STATE)]
    state[:] = 0.0
    if moving is None:
        return
    if controls is not None:
        sticks = model.actuator_ctrladr[list(drive.joystick)]
        state[[drivetrain.X, drivetrain.Y]] = np.clip(controls[sticks], -1.0, 1.0)
    state[[drivetrain.SPEED, drivetrain.TURN]] = moving.speed, moving.yaw_rate
    state[drivetrain.AWAKE] = model.actuator_user[drive.drive, drivetrain.DELAY]


def position_joints(model: mujoco.MjModel) -> dict[int, int]:
    """Actuator -> joint of every joint that an input drives to a position."""
    return {i: int(model.actuator_trnid[i, 0]) for i in range(model.nu) if is_position(model, i)}


def _release(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Remove the longitudinal and rolling deflections of the tires that the held hinges caused."""
    for wheel in wheels(model):
        first = model.actuator_actadr[wheel.actuator]
        data.act[first] = data.act[first + 2] = 0.0


def _chair(model: mujoco.MjModel) -> tuple[int, int, int, int]:
    """Body, qpos address and dof address of the free joint `chair`, and the site `axle`."""
    joint = names.find("chair", names.joints(model), "joint")
    sites = names.names(model, mujoco.mjtObj.mjOBJ_SITE, model.nsite)
    site = names.find("axle", sites, "site")
    body = int(model.jnt_bodyid[joint])
    return body, int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint]), site


def _place(model: mujoco.MjModel, data: mujoco.MjData, initial: Initial) -> None:
    body, address, _, site = _chair(model)
    mujoco.mj_kinematics(model, data)
    forward = data.xmat[body].reshape(3, 3)[:, 0]
    heading = math.atan2(forward[1], forward[0]) if initial.heading is None else initial.heading
    xy = data.site_xpos[site][:2] if initial.position is None else np.asarray(initial.position)
    if on_field(model):  # upright first: the ground under the wheels is there
        _stand(model, data, xy, heading, np.array([0.0, 0.0, 1.0]))
        _stand(model, data, xy, heading, floor_plane(model, data)[1])
    _stand(model, data, xy, heading, floor_plane(model, data)[1])
    data.qpos[address + 2] -= clearance(model, data, tire_geoms(model).values())


def _stand(
    model: mujoco.MjModel, data: mujoco.MjData, xy: Array, heading: float, normal: Array
) -> None:
    """Put site `axle` over xy (2,) m, the chair's z along a normal (3,), its origin at z = 0."""
    _, address, _, site = _chair(model)
    x = np.array([math.cos(heading), math.sin(heading), 0.0])
    x[2] = -(normal @ x) / normal[2]
    x /= np.linalg.norm(x)
    rotation = np.column_stack([x, np.cross(normal, x), normal])
    mujoco.mju_mat2Quat(data.qpos[address + 3 : address + 7], rotation.ravel())
    data.qpos[address : address + 2] = xy - (rotation @ model.site_pos[site])[:2]
    data.qpos[address + 2] = 0.0
    mujoco.mj_kinematics(model, data)


def _shift(model: mujoco.MjModel, data: mujoco.MjData, xy: Array) -> None:
    """Slide the chair along its floor until site `axle` is at xy (2,) m again after settling."""
    _, address, _, site = _chair(model)
    mujoco.mj_kinematics(model, data)
    _, normal = floor_plane(model, data)
    move = xy - data.site_xpos[site][:2]
    data.qpos[address : address + 2] += move
    data.qpos[address + 2] -= move @ normal[:2] / normal[2]


def _body_velocity(
    model: mujoco.MjModel, data: mujoco.MjData, initial: Initial
) -> tuple[Array, Array, Array]:
    """Velocity of site `axle`, angular velocity (world) and the floor's normal, (3,) each."""
    body, _, _, _ = _chair(model)
    _, normal = floor_plane(model, data)
    forward = data.xmat[body].reshape(3, 3)[:, 0]
    forward = forward - (forward @ normal) * normal
    return initial.speed * forward / np.linalg.norm(forward), initial.yaw_rate * normal, normal


def _wheel_motion(
    model: mujoco.MjModel, data: mujoco.MjData, initial: Initial, geom: int
) -> tuple[Array, Array, Array]:
    """Velocity of a wheel's centre, its heading, the floor's normal, (3,) each."""
    site = _chair(model)[3]
    velocity, spin, normal = _body_velocity(model, data, initial)
    hub = velocity + np.cross(spin, data.geom_xpos[geom] - data.site_xpos[site])
    heading = np.cross(data.geom_xmat[geom].reshape(3, 3)[:, 2], normal)
    return hub, heading / np.linalg.norm(heading), normal


def _turn_casters(model: mujoco.MjModel, data: mujoco.MjData, initial: Initial) -> None:
    """Turn swivels until every caster's hub travels along its wheel's heading."""
    known = names.joints(model)
    casters = {w: g for w, g in tire_geoms(model).items() if f"{w}_swivel" in known}
    for _ in range(30):  # the hub moves with its swivel; converges while the trail is short
        mujoco.mj_kinematics(model, data)
        for wheel, geom in casters.items():
            hub, heading, normal = _wheel_motion(model, data, initial, geom)
            if np.linalg.norm(hub) > 1e-9:
                turn = math.atan2(np.cross(heading, hub) @ normal, heading @ hub)
                data.qpos[model.jnt_qposadr[known.index(f"{wheel}_swivel")]] += turn


def _set_velocities(model: mujoco.MjModel, data: mujoco.MjData, initial: Initial) -> None:
    mujoco.mj_kinematics(model, data)
    body, _, dof, site = _chair(model)
    velocity, spin, _ = _body_velocity(model, data, initial)
    to_body = data.xpos[body] - data.site_xpos[site]
    data.qvel[dof : dof + 3] = velocity + np.cross(spin, to_body)
    data.qvel[dof + 3 : dof + 6] = data.xmat[body].reshape(3, 3).T @ spin
    known = names.joints(model)
    for wheel, geom in tire_geoms(model).items():
        hub, heading, _ = _wheel_motion(model, data, initial, geom)
        radius = height_above(model, data, geom)
        joint = names.find(wheel, known, "joint")
        data.qvel[model.jnt_dofadr[joint]] = hub @ heading / radius
