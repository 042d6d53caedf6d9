"""Errors of a sensor: bias, scale or delay of one channel.

In: the name of a channel. Out: the effects of this channel.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np

from mjchair.effects.effect import Effect, Parameter, SensorError
from mjchair.engine import wheel
from mjchair.errors import MjchairError
from mjchair.measurement.sensors import sensor
from mjchair.model import parts
from mjchair.simulation.channels import TIRE

COUNTED = 0.2  # how often a scale is wrong that counts or is calibrated, over others (assumption)
EARLY = (
    0.3  # s that a sensor may come early: its device was started by hand, as torque_delay has it
)
LARGEST = 20.0  # times the usual bias: 2 rad/s of a wheel, 4 m/s^2 (assumption)
COMPONENTS = {".x": 0, ".y": 1, ".z": 2} | {f".{part}": k for k, (part, _) in enumerate(TIRE)}


def split(channel: str) -> tuple[str, int]:
    """The sensor of a scalar channel, and the index of the component."""
    name, dot, end = channel.rpartition(".")
    return (name, COMPONENTS[dot + end]) if dot and dot + end in COMPONENTS else (channel, 0)


def _block(spec: mujoco.MjSpec, channel: str) -> tuple[Any, Any, int]:
    name, component = split(channel)
    sensor = parts.named(spec.sensors, name, "sensor")
    data = np.array(sensor.userdata, dtype=float)
    if not data.size or data[0] != wheel.SENSOR_TAG:
        data = np.array([wheel.SENSOR_TAG, float(wheel.PLAIN)])
    at = wheel.SENSOR_BIAS + 2 * component
    if data.size < at + 2:
        data = np.r_[data, np.zeros(at + 2 - data.size)]
    return sensor, data, at


def _bias(channel: str) -> Callable[..., None]:
    def edit(spec: mujoco.MjSpec, bias: float) -> None:
        sensor, data, at = _block(spec, channel)
        data[at] += bias
        parts.write_sensor(spec, sensor, data)

    return edit


def _scale(channel: str) -> Callable[..., None]:
    def edit(spec: mujoco.MjSpec, scale: float) -> None:
        sensor, data, at = _block(spec, channel)
        data[at + 1] = (1.0 + data[at + 1]) * (1.0 + scale) - 1.0
        parts.write_sensor(spec, sensor, data)

    return edit


def _delay(channel: str) -> Callable[..., None]:
    """The edit of a delay. A sensor that comes early stays on time: none shows what is to come."""

    def edit(spec: mujoco.MjSpec, delay: float) -> None:
        if delay <= 0.0:
            return
        name, _ = split(channel)
        sensor = parts.named(spec.sensors, name, "sensor")
        if sensor.type == mujoco.mjtSensor.mjSENS_USER:
            _lag(spec, channel, delay)
            return
        sensor.delay += delay
        sensor.nsample = int(np.ceil(sensor.delay / spec.option.timestep)) + 2

    return edit


def _lag(spec: mujoco.MjSpec, channel: str, delay: float) -> None:
    """Delay a heading in mjchair's own sensor, since MuJoCo delays no user sensor."""
    sensor, data, _ = _block(spec, channel)
    if data[wheel.SENSOR_KIND] != wheel.HEADING:
        raise MjchairError(f"{channel} cannot be delayed; MuJoCo delays no user sensor")
    data = np.r_[data, np.zeros(max(0, wheel.SENSOR_LAG + 1 - data.size))]
    data[wheel.SENSOR_LAG] += delay
    parts.write_sensor(spec, sensor, data)


def _at_rest(channel: str) -> str:
    """How to measure the bias of what shows zero at rest; a place or an angle does not."""
    rates = ("rad/s", "m/s", "m/s^2")
    return f"record {channel} with the chair at rest" if sensor(channel).unit in rates else ""


def _calibrated(channel: str) -> str:
    """How to measure the scale of a channel."""
    unit = sensor(channel).unit
    if unit == "m/s^2":
        return f"lay the sensor of {channel} on each of its sides, where it must show 9.81 m/s^2"
    known = {"rad": "turn", "rad/s": "turn", "m": "way", "m/s": "way"}
    return f"compare {channel} with a known {known[unit]}" if unit in known else ""


def sensor_effects(channel: str) -> tuple[Effect, ...]:
    """sensor_bias, sensor_scale and sensor_delay of one scalar channel.

    A tire's sensor has no delay: MuJoCo delays no user sensor, so the chair could not show it.
    """
    kind = sensor(channel)
    typical, unit = kind.fault, kind.unit
    signature = "one channel only, and no force is consistent with it"
    source = "sizes of uncalibrated sensors; assumed"
    half_turn = np.pi if unit == "rad" else 0.0  # an angle's zero may be anywhere
    most = max(LARGEST * typical, half_turn)
    bias = Parameter("bias", unit, typical, -most, most)
    scale = Parameter("scale", "1", 0.05, -0.9, 9.0)
    delay = Parameter("delay", "s", 0.02, -EARLY, 0.5)
    lags = signature + "; its error grows with the rate of change"
    effects = [
        Effect(
            "sensor_bias",
            (bias,),
            signature,
            source,
            _bias(channel),
            channel,
            SensorError.BIAS,
            by_hand=_at_rest(channel),
        ),
        Effect(
            "sensor_scale",
            (scale,),
            signature,
            source,
            _scale(channel),
            channel,
            SensorError.SCALE,
            common=1.0 if kind.gain else COUNTED,
            by_hand=_calibrated(channel),
        ),
    ]
    if not split(channel)[0].endswith("_tire"):
        edit = _delay(channel)
        effects.append(
            Effect("sensor_delay", (delay,), lags, source, edit, channel, SensorError.DELAY)
        )
    return tuple(effects)
