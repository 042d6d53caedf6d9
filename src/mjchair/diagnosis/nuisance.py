"""What is only roughly known of any chair: fitted along with every effect, held by priors.

Without fitting them a heavier rider becomes a false name; without priors they swallow effects.
The two differences between this simulation and a finer one stand among them: no null made by the
model itself contains them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import mujoco
import numpy as np

from mjchair.effects import parts
from mjchair.errors import MjchairError, nearest
from mjchair.tire import block

Edit = Callable[[mujoco.MjSpec, float], None]


@dataclass(frozen=True)
class Nuisance:
    """A roughly known number.

    Attributes:
      name: as in study.toml. std: prior standard deviation, in `unit`.
      edit: ``edit(spec, value)``, value 0 being no change; None for a sensor's bias.
    """

    name: str
    std: float
    unit: str
    edit: Edit | None = None
    channel: str = ""


def _mass(spec: mujoco.MjSpec, value: float) -> None:
    body = parts.explicit_inertial(spec, "chair")
    body.mass = float(body.mass) * (1.0 + value)
    body.inertia = np.asarray(body.inertia) * (1.0 + value)


def _inertia(spec: mujoco.MjSpec, value: float) -> None:
    body = parts.explicit_inertial(spec, "chair")
    body.inertia = np.asarray(body.inertia) * (1.0 + value)


def _wheel_inertia(spec: mujoco.MjSpec, value: float) -> None:
    for wheel in parts.REAR:
        body = parts.explicit_inertial(spec, wheel)
        body.inertia = np.asarray(body.inertia) * (1.0 + value)


def _centre(axis: int) -> Edit:
    def edit(spec: mujoco.MjSpec, value: float) -> None:
        body = parts.explicit_inertial(spec, "chair")
        place = np.array(body.ipos, float)
        place[axis] += value
        body.ipos = place

    return edit


def _stiffness(wheels: tuple[str, ...]) -> Edit:
    def edit(spec: mujoco.MjSpec, value: float) -> None:
        parts.scale_tires(spec, block.STIFFNESS_FACTOR, 1.0 + value, wheels)

    return edit


MECHANICAL = (
    Nuisance("mass", 0.05, "1", _mass),
    Nuisance("inertia", 0.10, "1", _inertia),
    Nuisance("wheel_inertia", 0.05, "1", _wheel_inertia),
    Nuisance("centre_x", 0.01, "m", _centre(0)),
    Nuisance("centre_y", 0.002, "m", _centre(1)),
    Nuisance("centre_z", 0.03, "m", _centre(2)),
    Nuisance("rear_stiffness", 0.07, "1", _stiffness(parts.REAR)),
    Nuisance("caster_stiffness", 0.07, "1", _stiffness(parts.CASTERS)),
)
GYRO = 0.003  # rad/s, of the bias of a zeroed gyroscope
ACCELEROMETER = 0.05  # m/s^2, bias and mounting of an accelerometer


def nuisances(channels: tuple[str, ...], given: Mapping[str, float]) -> tuple[Nuisance, ...]:
    """The nuisances of a study, with the standard deviations that it gives.

    Raises:
      MjchairError: a name that is not a nuisance.
    """
    found = list(MECHANICAL)
    for channel in channels:
        if "gyro" in channel:
            found.append(Nuisance(f"bias:{channel}", GYRO, "rad/s", None, channel))
        elif "accelerometer" in channel:
            found.append(Nuisance(f"bias:{channel}", ACCELEROMETER, "m/s^2", None, channel))
    known = {n.name for n in found} | {"bias:imu_gyro", "bias:imu_accelerometer"}
    for name in given:
        if name not in known:
            raise MjchairError(f"unknown nuisance {name!r}" + nearest(name, known))
    return tuple(
        Nuisance(
            n.name,
            given.get(n.name, given.get(n.name.rsplit(".", 1)[0], n.std)),
            n.unit,
            n.edit,
            n.channel,
        )
        for n in found
    )
