"""Sensors as named scalar channels with units."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco

from mjchair.model.wheels import base_name
from mjchair.simulation import names

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
# scalar user sensors of every chair
_USER_UNITS = {"heading": "rad"}


@dataclass(frozen=True)
class Channel:
    """One scalar of the sensor data: its name, its unit, its place in `sensordata`."""

    name: str
    unit: str
    index: int


def channels(model: mujoco.MjModel) -> list[Channel]:
    """Every named sensor as scalars: vectors as `.x .y .z`, tires as `.Fx` and so on.

    A unit that MuJoCo does not tell (a user sensor of no known name) is "?".
    """
    found = []
    for i, name in enumerate(names.sensors(model)):
        if name:
            first = int(model.sensor_adr[i])
            for k, (suffix, unit) in enumerate(_components(model, i, name)):
                found.append(Channel(name + suffix, unit, first + k))
    return found


def _components(model: mujoco.MjModel, i: int, name: str) -> list[tuple[str, str]]:
    kind, dim = _S(model.sensor_type[i]), int(model.sensor_dim[i])
    if kind == _S.mjSENS_USER:
        if name.endswith("_tire") and dim == len(TIRE):
            return [("." + part, unit) for part, unit in TIRE]
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
    """The unit of an actuator's control: N m for torque on a hinge, N on a slide, else "?"."""
    direct = (
        model.actuator_gaintype[actuator] == mujoco.mjtGain.mjGAIN_FIXED
        and model.actuator_gainprm[actuator, 0] == 1.0
        and model.actuator_biastype[actuator] == mujoco.mjtBias.mjBIAS_NONE
        and model.actuator_trntype[actuator] == mujoco.mjtTrn.mjTRN_JOINT
    )
    if not direct:
        return "?"
    hinge = model.jnt_type[model.actuator_trnid[actuator, 0]] == mujoco.mjtJoint.mjJNT_HINGE
    return "N m" if hinge else "N"
