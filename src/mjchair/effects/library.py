"""The library of effects."""

from __future__ import annotations

from collections.abc import Iterable

from mjchair.effects import (
    air_drag,
    back_emf,
    bearing_friction,
    camber,
    caster_friction,
    caster_trail,
    cornering_stiffness,
    drive_lag,
    floor_slope,
    load_sensitivity,
    mass_offset,
    payload,
    relaxation_length,
    rider_sway,
    rolling_resistance,
    surface_patch,
    tire_friction,
    toe,
    torque_gain,
    turning_scrub,
    wheel_radius,
    wind,
)
from mjchair.effects.effect import Effect
from mjchair.effects.sensors import sensor_effects
from mjchair.errors import MjchairError, nearest

MECHANICAL = (
    rolling_resistance.EFFECT,
    bearing_friction.EFFECT,
    air_drag.EFFECT,
    wind.EFFECT,
    floor_slope.EFFECT,
    toe.EFFECT,
    camber.EFFECT,
    mass_offset.EFFECT,
    payload.EFFECT,
    wheel_radius.EFFECT,
    cornering_stiffness.EFFECT,
    load_sensitivity.EFFECT,
    tire_friction.EFFECT,
    relaxation_length.EFFECT,
    turning_scrub.EFFECT,
    caster_friction.EFFECT,
    caster_trail.EFFECT,
    torque_gain.EFFECT,
    drive_lag.EFFECT,
    back_emf.EFFECT,
    surface_patch.EFFECT,
)
SENSORS = ("sensor_bias", "sensor_scale", "sensor_delay")
DRIVEN = ("torque_gain", "drive_lag", "back_emf")  # nothing to see without torque


def names() -> tuple[str, ...]:
    """Names of all effects."""
    return (*(e.name for e in MECHANICAL), rider_sway.HARMONIC.name, *SENSORS)


def library(
    channels: Iterable[str] = (), motion: bool = False, driven: bool = True
) -> tuple[Effect, ...]:
    """The effects that data with these channels could show.

    Args:
      channels: scalar sensor channels that were measured.
      motion: the rider's motion was measured. driven: some run has torque inputs.
    """
    found = [e for e in MECHANICAL if driven or e.name not in DRIVEN]
    found.append(rider_sway.MEASURED if motion else rider_sway.HARMONIC)
    for channel in channels:
        found.extend(sensor_effects(channel))
    return tuple(found)


def find(name: str, channel: str | None = None) -> Effect:
    """The effect of that name; a sensor's with its channel.

    Raises:
      MjchairError: unknown, or a sensor effect without a channel.
    """
    if name in SENSORS:
        if not channel:
            raise MjchairError(f"{name} needs a channel, such as {name}:imu_gyro.z")
        for effect in sensor_effects(channel):
            if effect.name == name:
                return effect
        raise MjchairError(f"{channel} has no {name}; MuJoCo delays no sensor of a tire")
    for effect in (*MECHANICAL, rider_sway.HARMONIC):
        if effect.name == name:
            return effect
    raise MjchairError(f"unknown effect {name!r}" + nearest(name, names()))
