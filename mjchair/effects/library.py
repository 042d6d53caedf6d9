"""The library of effects.

In: a name. Out: the effect of that name; or all of them.
"""

from __future__ import annotations

import warnings
from collections.abc import Collection, Iterable

import mujoco

from mjchair.drive.attach import has_drive
from mjchair.effects import (
    air_drag,
    back_emf,
    bearing_friction,
    camber,
    caster_friction,
    caster_trail,
    cornering_stiffness,
    dragging_brake,
    drive_lag,
    floor_slope,
    load_sensitivity,
    low_battery,
    mass_offset,
    payload,
    relaxation_length,
    rider_motion,
    rolling_resistance,
    stroke_motion,
    surface_patch,
    tire_friction,
    toe,
    torque_delay,
    torque_gain,
    turning_scrub,
    weak_motor,
    wheel_radius,
    wind,
)
from mjchair.effects.effect import Effect
from mjchair.effects.sensors import sensor_effects
from mjchair.errors import MjchairError, nearest

MECHANICAL = (
    rolling_resistance.EFFECT,
    rolling_resistance.ONE_SIDED,
    bearing_friction.EFFECT,
    bearing_friction.ONE_SIDED,
    air_drag.EFFECT,
    wind.EFFECT,
    floor_slope.EFFECT,
    toe.EFFECT,
    toe.ONE_SIDED,
    camber.EFFECT,
    mass_offset.EFFECT,
    payload.EFFECT,
    wheel_radius.EFFECT,
    wheel_radius.TWISTING,
    cornering_stiffness.EFFECT,
    load_sensitivity.EFFECT,
    tire_friction.EFFECT,
    relaxation_length.EFFECT,
    turning_scrub.EFFECT,
    caster_friction.EFFECT,
    caster_friction.ONE_SIDED,
    caster_trail.EFFECT,
    torque_gain.EFFECT,
    torque_delay.EFFECT,
    drive_lag.EFFECT,
    back_emf.EFFECT,
    weak_motor.EFFECT,
    low_battery.EFFECT,
    dragging_brake.EFFECT,
    surface_patch.EFFECT,
    rider_motion.HARMONIC,
    stroke_motion.WAVE,
    stroke_motion.EFFECT,
    rider_motion.MEASURED,
)
SENSORS = ("sensor_bias", "sensor_scale", "sensor_delay")
RENAMED = {"rider_sway": "rider_motion"}  # old name, as in files -> present name


def names() -> tuple[str, ...]:
    """Names of all effects."""
    return (*dict.fromkeys(e.name for e in MECHANICAL), *SENSORS)


def library(
    channels: Iterable[str] = (),
    columns: Collection[str] = (),
    driven: bool = True,
    chair: mujoco.MjSpec | None = None,
) -> tuple[Effect, ...]:
    """The effects that data with these channels could show.

    Args:
      channels: scalar sensor channels that were measured.
      columns: of the tables, besides channels and inputs. driven: some run has torque inputs.
      chair: that bounds what an effect may be; None: a shipped one.
    """
    powered = chair is not None and has_drive(chair)
    shown = [e for e in MECHANICAL if e.shows(columns, driven) and e.drive in (None, powered)]
    if chair is not None:
        shown = [e.on(chair) for e in shown]
    followed = {e.name: e for e in shown if e.measured and not e.beside}
    shown = [e for e in shown if followed.get(e.name, e) is e]
    for channel in channels:
        shown.extend(sensor_effects(channel))
    return tuple(shown)


def find(name: str, channel: str | None = None) -> Effect:
    """The effect of that name; a sensor's with its channel. An old name is warned of.

    Raises:
      MjchairError: unknown, a sensor effect without a channel, or another one with it.
    """
    if name in RENAMED:
        new = RENAMED[name]
        warnings.warn(f"the effect {name} is called {new} now", FutureWarning, stacklevel=2)
        name = new
    if name in SENSORS:
        if not channel:
            raise MjchairError(f"{name} needs a channel, such as {name}:imu_gyro.z")
        for effect in sensor_effects(channel):
            if effect.name == name:
                return effect
        raise MjchairError(f"{channel} has no {name}; MuJoCo delays no sensor of a tire")
    for effect in MECHANICAL:
        if effect.name == name:
            if channel:
                raise MjchairError(
                    f"{name} is of no sensor, so {channel!r} behind its name says nothing; its "
                    f"numbers are {', '.join(p.name for p in effect.parameters)}"
                )
            return effect
    raise MjchairError(f"unknown effect {name!r}" + nearest(name, names()))
