"""Where the energy of a power chair's battery goes.

In: a chair with a drive, and its inputs. Out: an `EnergyBalance`, summed over every time step of a
run. The work of a force during a step is the force times the mean of the velocities before and
after the step; this equals the change of kinetic energy that the force causes. The remaining
difference is the integration error of the step: a motor's current comes from the speed before it.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.drive import block
from mjchair.drive.attach import Driven, drives
from mjchair.engine.install import installed
from mjchair.errors import MjchairError
from mjchair.model.spec import compile_spec
from mjchair.model.wheels import wheels
from mjchair.simulation import names
from mjchair.simulation.initial import Initial, as_initial, start
from mjchair.simulation.inputs import Inputs, as_inputs

Array = NDArray[np.float64]


@dataclass(frozen=True)
class EnergyBalance:
    """Energies of a run, J. Energy that leaves the battery and energy that is lost are positive.

    Attributes:
      battery: chemical energy taken from it. internal: heat in its internal resistance.
      standby: of the controller. winding: heat of the motors. gear: of gears and parking brakes.
      rolling: of the tires, with slip and scrub.
      bearings: of damping in joints and in the casters' suspension.
      contact: lost in the normal forces of the tires and in joint stops.
      potential, kinetic: increase of these energies. torques: work of other actuators on the chair.
      distance: length of the path of the axle's middle, m.
    """

    battery: float
    internal: float
    standby: float
    winding: float
    gear: float
    rolling: float
    bearings: float
    contact: float
    potential: float
    kinetic: float
    torques: float
    distance: float

    @property
    def missing(self) -> float:
        """Energy given by battery and other actuators minus all other terms, J."""
        used = self.internal + self.standby + self.winding + self.gear + self.rolling
        used += self.bearings + self.contact + self.potential + self.kinetic
        return self.battery + self.torques - used


def energy_balance(
    model: mujoco.MjModel | mujoco.MjSpec,
    inputs: Inputs | Mapping[str, float] | str | os.PathLike[str],
    duration: float | None = None,
    *,
    initial: Initial | Mapping[str, Any] | None = None,
) -> EnergyBalance:
    """The energy balance of a run; arguments as those of `mjchair.simulate`.

    Raises:
      MjchairError: the chair does not have exactly one drive, or as `mjchair.simulate` does.
    """
    model = compile_spec(model.copy()) if isinstance(model, mujoco.MjSpec) else model
    chair_drives = drives(model)
    if len(chair_drives) != 1:
        raise MjchairError(
            f"the model has {len(chair_drives)} drives; an energy balance needs one: "
            'build the chair with drive="normal"'
        )
    given = as_inputs(inputs, model, duration)
    assert given is not None
    h = float(model.opt.timestep)
    steps = max(1, round((given.end if duration is None else duration) / h))
    controls = given.control_array(model, h * np.arange(steps))
    with installed():
        data = start(model, as_initial(initial), controls=controls[0])
        return _summed(model, data, controls, chair_drives[0])


def _summed(
    model: mujoco.MjModel, data: mujoco.MjData, controls: Array, drive: Driven
) -> EnergyBalance:
    h = float(model.opt.timestep)
    sums = dict.fromkeys(EnergyBalance.__dataclass_fields__, 0.0)
    motors = _Sensors(model, block.MOTORS, block.MOTOR_SENSOR)
    battery = _Sensors(model, (block.DRIVE,), block.DRIVE_SENSOR)
    standby = model.actuator_user[drive.drive, block.CONTROLLER["standby"]]
    site = names.find("axle", names.names(model, mujoco.mjtObj.mjOBJ_SITE, model.nsite), "site")
    mujoco.mj_forward(model, data)
    potential, kinetic = _energies(model, data)
    place = data.site_xpos[site].copy()
    for row in controls:
        data.ctrl[:] = row
        before = data.qvel.copy()
        mujoco.mj_step(model, data)
        mean = 0.5 * (before + data.qvel)
        power, current = battery.of(data, "battery_power"), battery.of(data, "battery_current")
        sums["battery"] += h * power
        sums["internal"] += h * (power - current * battery.of(data, "battery_voltage"))
        sums["standby"] += h * standby
        sums["winding"] += h * motors.of(data, "heat")
        sums["gear"] += h * motors.of(data, "friction")
        sums["rolling"] -= h * float(_tire_forces(model, data) @ mean)
        sums["bearings"] += h * float(model.dof_damping * data.qvel @ mean)
        sums["contact"] -= h * float(data.qfrc_constraint @ mean)
        sums["torques"] += h * _other_torques(model, data, drive, mean)
        sums["distance"] += float(np.linalg.norm(data.site_xpos[site] - place))
        place = data.site_xpos[site].copy()
    mujoco.mj_forward(model, data)
    ended = _energies(model, data)
    sums["potential"], sums["kinetic"] = ended[0] - potential, ended[1] - kinetic
    return EnergyBalance(**sums)


class _Sensors:
    """Sums of a component over sensors of a kind."""

    def __init__(
        self, model: mujoco.MjModel, which: tuple[str, ...], parts: tuple[tuple[str, str], ...]
    ) -> None:
        known = names.sensors(model)
        self._at = [int(model.sensor_adr[names.find(name, known, "sensor")]) for name in which]
        self._places = {name: k for k, (name, _) in enumerate(parts)}

    def of(self, data: mujoco.MjData, component: str) -> float:
        place = self._places[component]
        return float(sum(data.sensordata[at + place] for at in self._at))


def _energies(model: mujoco.MjModel, data: mujoco.MjData) -> tuple[float, float]:
    """Potential energy, with that of springs, and kinetic energy, J."""
    mujoco.mj_energyPos(model, data)
    mujoco.mj_energyVel(model, data)
    return float(data.energy[0]), float(data.energy[1])


def _tire_forces(model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    """The tires' forces on the joints, (nv,)."""
    out = np.zeros(model.nv)
    for wheel in wheels(model):
        force = data.xfrc_applied[wheel.body]
        mujoco.mj_applyFT(
            model, data, force[:3], force[3:], data.xipos[wheel.body], wheel.body, out
        )
    return out


def _other_torques(model: mujoco.MjModel, data: mujoco.MjData, drive: Driven, mean: Array) -> float:
    """Power (W) of the actuators that are not the drive's motors."""
    own = sum(
        data.actuator_force[i] * mean[model.jnt_dofadr[model.actuator_trnid[i, 0]]]
        for i in drive.motors
    )
    return float(data.qfrc_actuator @ mean - own)
