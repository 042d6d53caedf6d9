"""What is known of a chair's sensors: unit, wrap, noise floor, and what no chair passes.

In: the name of a scalar channel, such as `imu_gyro.z`. Out: the entry of its sensor. Everything
that has to know a sensor asks here.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

from mjchair.model.rolling import RearAxle


@dataclass(frozen=True, kw_only=True)
class Sensor:
    """One kind of sensor; all numbers in `unit` unless said otherwise.

    Attributes:
      unit: SI; "?" where it is not known.
      floor: the least noise that is believed: no instrument, and no simulation at 2 ms, is better.
      fault: bias of a sensor that was not calibrated, as a rule (assumption).
      bias: standard deviation of the bias that every such sensor has; None: it has none.
      drift: standard deviation of what the bias changes by from run to run; 0: it stays.
      gain: standard deviation of its scale about 1 (assumption); None: it counts or is calibrated.
      most: the largest value that a wheelchair shows. fastest: its largest rate, in unit/s.
        For a wheel both are of what the chair rolls: m and m/s.
      wraps: whether it is an angle that jumps by a turn. free_zero: whether its zero is anywhere.
      degrees: the same unit with degrees in place of radians, which people forget; "" for none.
    """

    unit: str
    floor: float
    fault: float
    bias: float | None = None
    drift: float = 0.0
    gain: float | None = None
    most: float | None = None
    fastest: float | None = None
    wraps: bool = False
    free_zero: bool = False
    degrees: str = ""


# A wheelchair rolls up to 10 m/s, and spins at most twice as fast as in sports, 12 rad/s.
# by the end of the sensor's name, the first that fits
SENSORS = {
    "wheel_angle": Sensor(
        unit="rad", floor=1e-3, fault=0.05, fastest=10.5, free_zero=True, degrees="deg"
    ),
    "caster_angle": Sensor(unit="rad", floor=1e-3, fault=0.05, most=13.0, degrees="deg"),
    "angle": Sensor(unit="rad", floor=1e-3, fault=0.05, degrees="deg"),
    "wheel_speed": Sensor(
        unit="rad/s", floor=3e-3, fault=0.1, gain=0.01, most=10.5, degrees="deg/s"
    ),
    "speed": Sensor(unit="rad/s", floor=3e-3, fault=0.1, degrees="deg/s"),
    "gyro": Sensor(
        unit="rad/s",
        floor=1e-3,
        fault=0.02,
        bias=0.003,  # of a zeroed gyroscope
        drift=0.001,  # some degrees of warming (assumption)
        gain=0.01,
        most=12.0,
        degrees="deg/s",
    ),
    "accelerometer": Sensor(
        unit="m/s^2",
        floor=1e-2,
        fault=0.2,
        bias=0.05,  # with the mounting
        drift=0.02,  # some degrees of warming, or 0.1 deg of a floor's tilt (assumption)
        gain=0.01,
        most=80.0,
    ),
    "position": Sensor(unit="m", floor=5e-4, fault=0.05, fastest=15.0),
    "velocity": Sensor(unit="m/s", floor=5e-4, fault=0.05, most=15.0),
    "heading": Sensor(unit="rad", floor=3e-4, fault=0.05, fastest=12.0, wraps=True, degrees="deg"),
    "tire": Sensor(unit="N", floor=0.3, fault=5.0),
}
UNKNOWN = Sensor(unit="?", floor=1e-3, fault=0.1)


@functools.cache  # a diagnosis asks some hundred thousand times
def sensor(channel: str) -> Sensor:
    """The entry of a scalar channel, whatever prefix and component its name has."""
    name = channel.rsplit(".", 1)[0]
    return next((s for end, s in SENSORS.items() if name.endswith(end)), UNKNOWN)


def rolls(channel: str) -> bool:
    """Whether the channel is of a rear wheel's rolling, so that its limits are the chair's."""
    return channel.rsplit(".", 1)[0].endswith(("wheel_angle", "wheel_speed"))


def limit_of(channel: str, limit: float, axle: RearAxle) -> float:
    """A limit of a channel; a wheel's, which is of the way that it rolls, in radians."""
    return limit / axle.radius(channel.split("_")[0]) if rolls(channel) else limit
