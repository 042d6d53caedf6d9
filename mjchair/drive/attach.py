"""A drive put on a chair: an edit of its MjSpec, and the drives that a model has.

In: the specification of a chair whose rear wheels are joints `left_wheel` and `right_wheel`, and a
`Drive`. Out: the specification with the actuators and sensors of mjchair.drive.block, the rotors'
inertia on the wheels. The torque actuators `left_wheel` and `right_wheel` stay as they are, and act
besides the motors.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.drive import block
from mjchair.drive.quantities import Drive
from mjchair.errors import MjchairError

Array = NDArray[np.float64]
Find = Callable[[Any, str, str], Any]
STABLE = 1.0  # of h (k^2 / R + friction's slope) / J; beyond 2 the explicit step oscillates


@dataclass(frozen=True)
class Driven:
    """A drive in a compiled model: actuator ids, and the addresses of their states.

    Attributes:
      joystick: the two inputs. drive: the controller. motors: left and right.
    """

    joystick: tuple[int, int]
    drive: int
    motors: tuple[int, int]
    state: int
    motor_states: tuple[int, int]


def has_drive(spec: mujoco.MjSpec) -> bool:
    """Whether a specification has a drive already."""
    return any(_tagged(actuator, block.CONTROLLER_TAG) for actuator in spec.actuators)


def _tagged(actuator: Any, tag: float) -> bool:
    user = actuator.userdata
    return len(user) > block.VERSION_AT and user[block.TAG_AT] == tag


def drives(model: mujoco.MjModel) -> list[Driven]:
    """The drives of a compiled model.

    Raises:
      MjchairError: the block of another version, or the actuators of a drive are not together.
    """
    user = model.actuator_user
    found = []
    for i in range(model.nactuator):
        if user.shape[1] < block.NUMBERS or user[i, block.TAG_AT] != block.CONTROLLER_TAG:
            continue
        if user[i, block.VERSION_AT] != block.VERSION:
            raise MjchairError(
                f"the drive has a block of version {user[i, block.VERSION_AT]:g}; this mjchair "
                f"reads version {block.VERSION:g}: make the model anew"
            )
        motors = (i - block.LEFT_BEFORE, i - block.RIGHT_BEFORE)
        if i < block.X_BEFORE or (user[list(motors), block.TAG_AT] != block.MOTOR_TAG).any():
            raise MjchairError(
                "the actuators of a drive must stand next to one another: "
                + ", ".join(block.ACTUATORS)
            )
        at = model.actuator_actadr
        found.append(
            Driven(
                (i - block.X_BEFORE, i - block.Y_BEFORE),
                i,
                motors,
                int(at[i]),
                (int(at[motors[0]]), int(at[motors[1]])),
            )
        )
    return found


def attach(spec: mujoco.MjSpec, drive: Drive, named: Find) -> None:
    """Put a drive on a chair, or its numbers into the drive that the chair has.

    Args:
      spec: edited in place. drive: to put on.
      named: finds a part by name: (things, name, what) -> the thing.

    Raises:
      MjchairError: the chair has no wheels of those names; the profile asks for more speed than
        the motors have.
    """
    wheels = [named(spec.bodies, wheel, "body") for wheel in ("left_wheel", "right_wheel")]
    joints = [named(spec.joints, wheel, "joint") for wheel in ("left_wheel", "right_wheel")]
    tires = [
        named(spec.geoms, f"{wheel}_tire", "tire geom") for wheel in ("left_wheel", "right_wheel")
    ]
    radius = 0.5 * float(tires[0].size[0] + tires[1].size[0])
    track = abs(float(wheels[0].pos[1] - wheels[1].pos[1]))
    drive.check_speeds(radius)
    if not has_drive(spec):
        _add(spec, joints, named)
    controller = named(spec.actuators, block.DRIVE, "actuator")
    if 0 <= spec.nuser_actuator < block.NUMBERS:
        spec.nuser_actuator = block.NUMBERS
    controller.userdata = _packed(block.CONTROLLER, controller_numbers(drive, radius, track))
    for name, joint in zip(block.MOTORS, joints, strict=True):
        motor = named(spec.actuators, name, "actuator")
        motor.userdata = _packed(block.MOTOR, motor_numbers(drive))
        joint.armature = drive.armature


def _add(spec: mujoco.MjSpec, joints: list[Any], named: Find) -> None:
    """The actuators and sensors of a drive, without numbers yet."""
    left, right = (joint.name for joint in joints)
    prefix = left[: len(left) - len("left_wheel")]
    common = {"trntype": mujoco.mjtTrn.mjTRN_JOINT, "biastype": mujoco.mjtBias.mjBIAS_NONE}
    none, one = np.zeros(10), np.r_[1.0, np.zeros(9)]
    user = mujoco.mjtDyn.mjDYN_USER
    for name in block.JOYSTICK:
        spec.add_actuator(
            name=prefix + name,
            target=left,
            gainprm=none,
            ctrllimited=True,
            ctrlrange=(-1.0, 1.0),
            **common,
        )
    for name, joint in zip(block.MOTORS, (left, right), strict=True):
        spec.add_actuator(
            name=prefix + name,
            target=joint,
            gainprm=one,
            dyntype=user,
            actdim=len(block.MOTOR_STATE),
            actearly=True,
            **common,
        )
    spec.add_actuator(
        name=prefix + block.DRIVE,
        target=left,
        gainprm=none,
        dyntype=user,
        actdim=len(block.CONTROLLER_STATE),
        **common,
    )
    for name in (block.DRIVE, *block.MOTORS):
        spec.add_sensor(
            name=prefix + name,
            type=mujoco.mjtSensor.mjSENS_USER,
            objtype=mujoco.mjtObj.mjOBJ_ACTUATOR,
            objname=prefix + name,
            dim=len(block.DRIVE_SENSOR if name == block.DRIVE else block.MOTOR_SENSOR),
            needstage=mujoco.mjtStage.mjSTAGE_ACC,
            datatype=mujoco.mjtDataType.mjDATATYPE_REAL,
        )


def _packed(places: dict[str, int], numbers: dict[str, float]) -> list[float]:
    out = [0.0] * block.NUMBERS
    for name, index in places.items():
        out[index] = float(numbers[name])
    return out


def controller_numbers(drive: Drive, radius: float, track: float) -> dict[str, float]:
    """The block of a controller: name -> number, for wheels of a radius and a track (m)."""
    battery, profile = drive.battery, drive.profile.at(drive.controller.dial)
    voltages = {f"voltage_{k}": v for k, v in enumerate(battery.voltage)}
    numbers = {
        "tag": block.CONTROLLER_TAG,
        "version": block.VERSION,
        "radius": radius,
        "track": track,
        "brake_delay": drive.brake.delay,
        "capacity": 3600.0 * battery.capacity,  # A s
        "charge": battery.charge,
        "internal_resistance": battery.internal_resistance,
        "resistance_growth": battery.resistance_growth,
        "standby": drive.controller.standby,
        **voltages,
    }
    return {**profile, **numbers}


def motor_numbers(drive: Drive) -> dict[str, float]:
    """The block of a motor with its gear and brake: name -> number."""
    motor, gear, brake, controller = drive.motor, drive.gear, drive.brake, drive.controller
    return {
        "tag": block.MOTOR_TAG,
        "version": block.VERSION,
        "resistance": motor.resistance,
        "temperature_coefficient": motor.temperature_coefficient,
        "constant": motor.constant,
        "gear": gear.ratio,
        "efficiency": gear.efficiency,
        "friction": gear.friction,
        "fade_speed": gear.fade_speed,
        "boost_current": controller.boost_current * drive.profile.power,
        "continuous_current": controller.continuous_current * drive.profile.power,
        "boost_time": controller.boost_time,
        "foldback": controller.foldback,
        "compensation": controller.compensation * drive.profile.torque,
        "compensation_lag": controller.compensation_lag,
        "calibration": drive.wheel_constant,
        "heat_capacity": motor.heat_capacity,
        "thermal_resistance": motor.thermal_resistance,
        "ambient": motor.ambient,
        "foldback_temperature": controller.foldback_temperature,
        "largest_temperature": controller.largest_temperature,
        "brake_torque": brake.torque,
        "brake_stiffness": brake.stiffness,
        "brake_damping": brake.damping,
        "brake_opening": brake.opening,
        "brake_closing": brake.closing,
        "brake_drag": brake.drag,
    }


def check_timestep(model: mujoco.MjModel) -> None:
    """Hold the time step against what the explicit motor torque and the brake's spring allow.

    Raises:
      MjchairError: it is too long; the message gives the longest that is not.
    """
    for driven in drives(model):
        for i in driven.motors:
            motor = model.actuator_user[i]
            n = block.MOTOR
            dof = int(model.jnt_dofadr[model.actuator_trnid[i, 0]])
            inertia = float(model.dof_armature[dof] + _spin_inertia(model, dof))
            constant = motor[n["constant"]] * motor[n["gear"]]
            most = motor[n["boost_current"]] * constant * (1.0 - motor[n["efficiency"]])
            slope = constant**2 / motor[n["resistance"]]
            slope += (most + motor[n["friction"]]) / motor[n["fade_speed"]]
            stiffness, damping = motor[n["brake_stiffness"]], motor[n["brake_damping"]]
            longest = min(
                STABLE * inertia / slope,
                (np.sqrt(damping**2 + 4.0 * stiffness * inertia) - damping) / stiffness,
            )
            if model.opt.timestep > longest:
                raise MjchairError(
                    f"timestep {model.opt.timestep:g} s is beyond the stability limit of the "
                    f"drive; use at most {0.9 * longest:.2g} s, or a motor of more resistance"
                )


def _spin_inertia(model: mujoco.MjModel, dof: int) -> float:
    """Inertia (kg m^2) of a wheel about its axle."""
    body = int(model.dof_bodyid[dof])
    axis = np.zeros(3)
    joint = int(model.dof_jntid[dof])
    inverse = np.zeros(4)
    mujoco.mju_negQuat(inverse, model.body_iquat[body])
    mujoco.mju_rotVecQuat(axis, model.jnt_axis[joint], inverse)
    return float(axis**2 @ model.body_inertia[body])
