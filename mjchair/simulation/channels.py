"""Sensors as named scalar channels with units.

In: a compiled model. Out: a `Channel` for each component of each sensor, in the order of
`sensordata`; the place there of a component of a tire sensor.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco

from mjchair.drive import block
from mjchair.model.wheels import SUFFIX, base_name
from mjchair.simulation import names
from mjchair.simulation.inputs import is_position

# components and units of the tire sensor, in the order of its dimensions
TIRE = (
    ("Fx", "N"),
    ("Fy", "N"),
    ("Fz", "N"),
    ("Mz", "N m"),
    ("kappa", "1"),
    ("tan_alpha", "1"),
    ("gamma", "rad"),
)

_S = mujoco.mjtSensor
_UNITS = {
    _S.mjSENS_TOUCH: "N",
    _S.mjSENS_ACCELEROMETER: "m/s^2",
    _S.mjSENS_VELOCIMETER: "m/s",
    _S.mjSENS_GYRO: "rad/s",
    _S.mjSENS_FORCE: "N",
    _S.mjSENS_TORQUE: "N m",
    _S.mjSENS_RANGEFINDER: "m",
    _S.mjSENS_ACTUATORFRC: "N m",
    _S.mjSENS_BALLANGVEL: "rad/s",
    _S.mjSENS_FRAMEPOS: "m",
    _S.mjSENS_FRAMELINVEL: "m/s",
    _S.mjSENS_FRAMEANGVEL: "rad/s",
    _S.mjSENS_FRAMELINACC: "m/s^2",
    _S.mjSENS_FRAMEANGACC: "rad/s^2",
    _S.mjSENS_SUBTREECOM: "m",
    _S.mjSENS_SUBTREELINVEL: "m/s",
    _S.mjSENS_CLOCK: "s",
}
_JOINT_UNITS = {
    _S.mjSENS_JOINTPOS: ("m", "rad"),
    _S.mjSENS_JOINTVEL: ("m/s", "rad/s"),
    _S.mjSENS_JOINTACTFRC: ("N", "N m"),
    _S.mjSENS_JOINTLIMITFRC: ("N", "N m"),
}
_DRIVE = {block.DRIVE: block.DRIVE_SENSOR} | dict.fromkeys(block.MOTORS, block.MOTOR_SENSOR)
# scalar user sensors of every chair
_USER_UNITS = {"heading": "rad", "rider_bias_force": "N"}


@dataclass(frozen=True)
class Channel:
    """One scalar of the sensor data: its name, its unit, and its index in `sensordata`."""

    name: str
    unit: str
    index: int


def channels(model: mujoco.MjModel) -> list[Channel]:
    """Every named sensor as scalars: vectors as `.x .y .z`, tires as `.Fx` and so on.

    A unit that is not known, as of a user sensor with another name, is "?".
    """
    listed = []
    for i, name in enumerate(names.sensors(model)):
        if name:
            first = int(model.sensor_adr[i])
            for k, (suffix, unit) in enumerate(_components(model, i, name)):
                listed.append(Channel(name + suffix, unit, first + k))
    return listed


def channel_units(model: mujoco.MjModel) -> dict[str, str]:
    """SI unit of every channel, by its name with and without prefix; "?" where it is not known."""
    units = {c.name: c.unit for c in channels(model)}
    return units | {base_name(name): unit for name, unit in units.items()}


def tire_place(model: mujoco.MjModel, wheel: str, component: str) -> int:
    """Index in `sensordata` of a component of a wheel's tire sensor.

    Args:
      wheel: name of the wheel, as it is in the model or without a prefix. component: of `TIRE`,
        such as "Fz".

    Raises:
      MjchairError: the wheel has no tire sensor, or the name fits several wheels.
    """
    sensor = names.find(wheel + SUFFIX, names.sensors(model), "sensor")
    return int(model.sensor_adr[sensor]) + [name for name, _ in TIRE].index(component)


def _components(model: mujoco.MjModel, i: int, name: str) -> list[tuple[str, str]]:
    kind, dim = _S(model.sensor_type[i]), int(model.sensor_dim[i])
    if kind == _S.mjSENS_USER:
        if name.endswith(SUFFIX) and dim == len(TIRE):
            return [("." + part, unit) for part, unit in TIRE]
        of_drive = _DRIVE.get(base_name(name), ())
        if dim == len(of_drive):
            return [("." + part, unit) for part, unit in of_drive]
        return _vector(dim, _USER_UNITS.get(base_name(name), "?"))
    if kind in _JOINT_UNITS:
        hinge = model.jnt_type[model.sensor_objid[i]] == mujoco.mjtJoint.mjJNT_HINGE
        return _vector(dim, _JOINT_UNITS[kind][int(hinge)])
    if kind in (_S.mjSENS_FRAMEQUAT, _S.mjSENS_BALLQUAT):
        return [(f".{axis}", "1") for axis in "wxyz"]
    return _vector(dim, _UNITS.get(kind, "?"))


def _vector(dim: int, unit: str) -> list[tuple[str, str]]:
    if dim == 1:
        return [("", unit)]
    return [(f".{'xyz'[k] if dim == 3 else k}", unit) for k in range(dim)]


def control_unit(model: mujoco.MjModel, actuator: int) -> str:
    """The unit of an actuator's control: N m for torque on a hinge, rad for its angle, N for a
    force on a slide, m for its place, 1 for the joystick, else "?".
    """
    if base_name(names.actuators(model)[actuator]) in block.JOYSTICK:
        return "1"
    direct = (
        model.actuator_gaintype[actuator] == mujoco.mjtGain.mjGAIN_FIXED
        and model.actuator_gainprm[actuator, 0] == 1.0
        and model.actuator_biastype[actuator] == mujoco.mjtBias.mjBIAS_NONE
        and model.actuator_trntype[actuator] == mujoco.mjtTrn.mjTRN_JOINT
    )
    position = is_position(model, actuator)
    if not direct and not position:
        return "?"
    hinge = model.jnt_type[model.actuator_trnid[actuator, 0]] == mujoco.mjtJoint.mjJNT_HINGE
    if position:
        return "rad" if hinge else "m"
    return "N m" if hinge else "N"
