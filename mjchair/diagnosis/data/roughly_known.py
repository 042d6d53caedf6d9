"""What is only roughly known of any chair: fitted along with every effect, held by priors.

In: the channels of a study, and the standard deviations that it gives. Out: nuisances, each an edit
of the chair, or the bias or scale of a sensor. Without fitting them a heavier rider becomes a false
name; without priors they swallow effects.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from mjchair.effects.effect import SensorError
from mjchair.errors import MjchairError, nearest
from mjchair.measurement.sensors import sensor
from mjchair.model import edits, inertials, parts
from mjchair.tire import block

Edit = Callable[[mujoco.MjSpec, float], None]


@dataclass(frozen=True)
class Nuisance:
    """A roughly known number.

    Attributes:
      name: as in study.toml. std: prior standard deviation, in `unit`.
      edit: ``edit(spec, value)``, value 0 being no change; None for a sensor's bias or scale.
      channel, error: of a sensor, and what it does.
      linear: whether its answer is added to predictions, and no chair is made with it. No time step
        simulates the tires that do not give way at all, which a chair nearly may have.
      sides: whether more and less of it have columns of their own.
    """

    name: str
    std: float
    unit: str
    edit: Edit | None = None
    channel: str = ""
    error: SensorError = SensorError.BIAS
    linear: bool = False
    sides: bool = False


def _mass(spec: mujoco.MjSpec, value: float) -> None:
    body = inertials.explicit(spec, "chair")
    body.mass = float(body.mass) * (1.0 + value)
    body.inertia = np.asarray(body.inertia) * (1.0 + value)


def _inertia(spec: mujoco.MjSpec, value: float) -> None:
    body = inertials.explicit(spec, "chair")
    body.inertia = np.asarray(body.inertia) * (1.0 + value)


def _wheel_inertia(spec: mujoco.MjSpec, value: float) -> None:
    for wheel in parts.REAR:
        body = inertials.explicit(spec, wheel)
        body.inertia = np.asarray(body.inertia) * (1.0 + value)


def _centre(axis: int) -> Edit:
    def edit(spec: mujoco.MjSpec, value: float) -> None:
        body = inertials.explicit(spec, "chair")
        place = np.array(body.ipos, float)
        place[axis] += value
        body.ipos = place

    return edit


def _rolling_radius(spec: mujoco.MjSpec, value: float) -> None:
    """Of both rear wheels together: pressure and load change it, and nobody measures it loaded."""
    for wheel in parts.REAR:
        edits.add_radius(spec, wheel, value)


def _stiffness(wheels: tuple[str, ...]) -> Edit:
    def edit(spec: mujoco.MjSpec, value: float) -> None:
        parts.scale_tires(spec, block.STIFFNESS_FACTOR, 1.0 + value, wheels)

    return edit


def _rocking(spec: mujoco.MjSpec, value: float) -> None:
    """Vertical compliance of all tires, on which the chair rocks under every push."""
    for wheel in (*parts.REAR, *parts.casters(spec)):
        geom = parts.tire_geom(spec, wheel)
        solref = np.array(geom.solref)
        # direct: minus stiffness, minus damping; else a time constant and a damping ratio
        solref[0] *= 1.0 / (1.0 + value) if solref[0] < 0.0 else (1.0 + value) ** 0.5
        geom.solref = solref


def _slip(spec: mujoco.MjSpec, value: float) -> None:
    """Slip of the rear wheels, and the give of their carcass, under a force along the heading."""

    def stiffer(factor: float) -> float:
        return (factor or 1.0) / (1.0 + value)  # 0, of an older model, means 1

    parts.edit_tires(spec, block.LONGITUDINAL_FACTOR, stiffer, parts.REAR)


def _torque(spec: mujoco.MjSpec, value: float) -> None:
    """Gain of the torques of both rear wheels: what calibrates one sensor calibrates the other."""
    for wheel in parts.REAR:
        edits.scale_torque(spec, wheel, value)


# Relative. How much tires give way downwards and along their heading is an assumption in every
# model that ships, and nobody measures it on a chair. At the wall of three they do not at all.
COMPLIANCE = 1.0 / 3.0
MECHANICAL = (
    Nuisance("mass", 0.05, "1", _mass),
    Nuisance("inertia", 0.10, "1", _inertia),
    Nuisance("wheel_inertia", 0.05, "1", _wheel_inertia),
    Nuisance("centre_x", 0.01, "m", _centre(0)),
    Nuisance("centre_y", 0.002, "m", _centre(1)),
    Nuisance("centre_z", 0.03, "m", _centre(2)),
    Nuisance("rear_stiffness", 0.07, "1", _stiffness(parts.REAR)),
    Nuisance("caster_stiffness", 0.07, "1", _stiffness(parts.CASTERS)),
    Nuisance("rocking", COMPLIANCE, "1", _rocking, linear=True, sides=True),
    Nuisance("slip", COMPLIANCE, "1", _slip, linear=True),
    Nuisance("rolling_radius", 0.0015, "m", _rolling_radius),
)
# of torques that were measured: gains of uncalibrated sensors are within 10 %, assumed. Mass, gain
# and the mass that moves on the chair grow alike without a trace: 10 % of gain are 10 % of each
TORQUE = Nuisance("torque", 0.05, "1", _torque)
MISTAKEN = 0.02  # of numbers that were measured are wrong all the same (assumption)


def nuisances(
    channels: tuple[str, ...], given: Mapping[str, float], driven_as_measured: bool = False
) -> tuple[Nuisance, ...]:
    """The nuisances of a study, with the standard deviations that it gives.

    Args:
      driven_as_measured: whether torques of the rear wheels come from sensors.

    Raises:
      MjchairError: a name that is not a nuisance, or a share of more than the whole.
    """
    every = _usual(channels, given, driven_as_measured)
    vectors, kinds = ("imu_gyro", "imu_accelerometer"), ("bias", "scale", "drift")
    known = {n.name for n in every} | {f"{kind}:{v}" for kind in kinds for v in vectors}
    for name in given:
        if name not in known:
            raise MjchairError(f"unknown nuisance {name!r}" + nearest(name, known))
    for n in every:
        if n.unit == "1" and _given(n, given) > max(1.0, n.std):
            raise MjchairError(
                f"[nuisance] {n.name} is {_given(n, given):g}; it is a standard deviation as a "
                f"share, at most 1; {n.std:g} is usual"
            )
    return tuple(replace(n, std=_given(n, given)) for n in every)


def drift(channel: str, given: Mapping[str, float]) -> float:
    """Standard deviation of what a channel's bias changes by from run to run, SI; 0: it stays.

    Args:
      given: by a study, for a sensor as a whole.
    """
    return given.get(f"drift:{channel.rsplit('.', 1)[0]}", sensor(channel).drift)


def mistaken(
    channels: tuple[str, ...], given: Mapping[str, float], driven_as_measured: bool = False
) -> dict[str, float]:
    """How much rarer a nuisance lies far away where a person measured it: name -> share, to 1.

    It is as many times rarer as it was measured better than is usual, and never rarer than MISTAKEN
    since people misread and mistype. What was not measured is not in it.
    """
    shares = {
        n.name: max(_given(n, given) / n.std, MISTAKEN)
        for n in _usual(channels, given, driven_as_measured)
    }
    return {name: share for name, share in shares.items() if share < 1.0}


def _given(nuisance: Nuisance, given: Mapping[str, float]) -> float:
    """Its standard deviation in a study: by its name, its sensor's, or as is usual."""
    of_sensor = nuisance.name.rsplit(".", 1)[0]
    return given.get(nuisance.name, given.get(of_sensor, nuisance.std))


def _usual(
    channels: tuple[str, ...], given: Mapping[str, float], driven_as_measured: bool
) -> list[Nuisance]:
    """The nuisances with the deviations that are usual; a doubtful gain has the one given."""
    every = [*MECHANICAL, TORQUE] if driven_as_measured else list(MECHANICAL)
    for channel in channels:
        kind = sensor(channel)
        if kind.bias is not None:
            every.append(Nuisance(f"bias:{channel}", kind.bias, kind.unit, None, channel))
        name = f"scale:{channel}"
        gain = given.get(name) if kind.gain is None else kind.gain
        if gain is not None:
            every.append(Nuisance(name, gain, "1", None, channel, SensorError.SCALE))
    return every
