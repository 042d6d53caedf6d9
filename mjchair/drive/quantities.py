"""The parts of a drive and their numbers, each with its unit and its range.

In: numbers by name, in SI. Out: frozen records, checked when they are made. The shipped chairs'
numbers with their sources are in `models/<chair>/drive.toml`.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field, fields
from typing import Any

from mjchair.errors import MjchairError
from mjchair.units import with_unit


def quantity(unit: str, low: float, high: float, text: str) -> Any:
    """A field of a part: its unit, its range and its meaning."""
    return field(metadata={"unit": unit, "low": low, "high": high, "text": text})


class Part:
    """What the parts of a drive have in common: the check of their numbers."""

    def __post_init__(self) -> None:
        """Check every number against its range.

        Raises:
          MjchairError: a number out of its range, or none.
        """
        for item in fields(self):  # type: ignore[arg-type]
            value = getattr(self, item.name)
            for number in value if isinstance(value, tuple) else (value,):
                unit, low, high = (item.metadata[key] for key in ("unit", "low", "high"))
                if isinstance(number, bool) or not (
                    isinstance(number, float | int) and low <= number <= high
                ):
                    told = f"{number:g}" if isinstance(number, float | int) else repr(number)
                    raise MjchairError(
                        f"{self.name()} {item.name} is {with_unit(told, unit)}; it must be within "
                        f"{low:g} to {high:g}"
                    )

    @classmethod
    def name(cls) -> str:
        """What the part is called in a file."""
        return cls.__name__.lower()


@dataclass(frozen=True)
class Motor(Part):
    """One of the two direct-current motors, with its leads.

    Attributes:
      resistance: of winding, brushes and leads at 20 degC, ohm.
      temperature_coefficient: of that resistance, 1/K.
      constant: torque per current, N m/A; voltage per speed of the rotor is the same number.
      rotor_inertia: kg m^2.
      heat_capacity: of the winding, J/K. thermal_resistance: from it to the air, K/W.
      ambient: temperature of the air, degC.
    """

    resistance: float = quantity("ohm", 0.01, 2.0, "winding, brushes and leads at 20 degC")
    temperature_coefficient: float = quantity("1/K", 0.0, 0.01, "of the resistance")
    constant: float = quantity("N m/A", 0.005, 0.5, "torque per current")
    rotor_inertia: float = quantity("kg m^2", 1e-6, 1e-2, "of the rotor")
    heat_capacity: float = quantity("J/K", 10.0, 1e5, "of the winding")
    thermal_resistance: float = quantity("K/W", 0.05, 20.0, "from the winding to the air")
    ambient: float = quantity("degC", -30.0, 60.0, "temperature of the air")


@dataclass(frozen=True)
class Gear(Part):
    """The gear between a motor and its wheel.

    Attributes:
      ratio: turns of the rotor for one of the wheel.
      efficiency: share of the rotor's torque that reaches the wheel, 1.
      friction: without load, at the wheel, N m.
      fade_speed: of the wheel, below which friction fades to nothing, rad/s.
    """

    ratio: float = quantity("1", 1.0, 100.0, "rotor turns for one of the wheel")
    efficiency: float = quantity("1", 0.3, 1.0, "share of the torque that reaches the wheel")
    friction: float = quantity("N m", 0.0, 20.0, "without load, at the wheel")
    fade_speed: float = quantity("rad/s", 0.2, 5.0, "below which friction fades")


@dataclass(frozen=True)
class Brake(Part):
    """A parking brake: closed without current.

    Attributes:
      torque: at the wheel, at which it slips, N m. stiffness: N m/rad. damping: N m s/rad.
      opening, closing: time that it takes, s.
      delay: from the end of the references' ramps to the beginning of closing, s.
      drag: torque at the wheel of a brake that does not open fully, N m.
    """

    torque: float = quantity("N m", 1.0, 500.0, "at the wheel, at which it slips")
    stiffness: float = quantity("N m/rad", 100.0, 50000.0, "windup of gear and brake")
    damping: float = quantity("N m s/rad", 0.0, 200.0, "of that windup")
    opening: float = quantity("s", 0.005, 2.0, "time to open")
    closing: float = quantity("s", 0.005, 2.0, "time to close")
    delay: float = quantity("s", 0.0, 5.0, "from standstill to closing")
    drag: float = quantity("N m", 0.0, 100.0, "of a brake that does not open fully")


@dataclass(frozen=True)
class Battery(Part):
    """The battery, a voltage behind a resistance.

    Attributes:
      voltage: without load when empty, at 1/4, 1/2, 3/4 and when full, V.
      internal_resistance: when full, ohm.
      resistance_growth: of that when empty, as a share of it, 1.
      capacity: A h. charge: at the start, 0 to 1.
    """

    voltage: tuple[float, ...] = quantity("V", 6.0, 60.0, "without load, empty to full")
    internal_resistance: float = quantity("ohm", 0.001, 0.5, "when full")
    resistance_growth: float = quantity("1", 0.0, 10.0, "of it when empty, share of it")
    capacity: float = quantity("A h", 1.0, 300.0, "at the currents of driving")
    charge: float = quantity("1", 0.0, 1.0, "at the start")

    def __post_init__(self) -> None:
        """Check the numbers, and that the voltage rises with the charge."""
        super().__post_init__()
        v = self.voltage
        if len(v) != 5 or any(a >= b for a, b in itertools.pairwise(v)):
            raise MjchairError(
                f"battery voltage is {list(v)} V; it must be five rising numbers, empty to full"
            )


@dataclass(frozen=True)
class Controller(Part):
    """What the controller does for any profile.

    Attributes:
      boost_current: A a motor, for boost_time (s) from cold. continuous_current: A a motor.
      foldback: last share of the boost in which the limit falls to the continuous current, 1.
      foldback_temperature, largest_temperature: of the winding, degC; the limit falls to zero
        between them.
      compensation: of the load, ohm: the voltage rises by this times the current.
      compensation_lag: of the current that it takes for that, s.
      standby: power of controller and joystick, W.
      dial: setting of the speed dial, 0 to 1.
    """

    boost_current: float = quantity("A", 1.0, 300.0, "a motor, for the boost time")
    continuous_current: float = quantity("A", 1.0, 300.0, "a motor")
    boost_time: float = quantity("s", 0.1, 600.0, "of the boost current from cold")
    foldback: float = quantity("1", 0.01, 1.0, "last share of the boost, with a falling limit")
    foldback_temperature: float = quantity("degC", 40.0, 250.0, "where the limit begins to fall")
    largest_temperature: float = quantity("degC", 50.0, 300.0, "where the limit is zero")
    compensation: float = quantity("ohm", 0.0, 1.0, "voltage per current")
    compensation_lag: float = quantity("s", 0.005, 1.0, "of the current that it takes")
    standby: float = quantity("W", 0.0, 200.0, "of controller and joystick")
    dial: float = quantity("1", 0.0, 1.0, "speed dial")

    def __post_init__(self) -> None:
        """Check the numbers, and that limits are in order."""
        super().__post_init__()
        for less, more in (
            ("continuous_current", "boost_current"),
            ("foldback_temperature", "largest_temperature"),
        ):
            if getattr(self, less) >= getattr(self, more):
                raise MjchairError(
                    f"controller {less} is {getattr(self, less):g}; it must be below {more}, "
                    f"{getattr(self, more):g}"
                )


@dataclass(frozen=True)
class Profile(Part):
    """How a controller answers the joystick; pairs are at the lowest and the highest dial.

    Attributes:
      forward_speed, reverse_speed: m/s. turn_speed: rad/s.
      forward_acceleration, forward_deceleration, reverse_acceleration, reverse_deceleration:
        m/s^2. turn_acceleration, turn_deceleration: rad/s^2.
      fast_brake: deceleration while the joystick asks for the opposite direction, m/s^2.
      deadband: of the joystick, 1. curve: exponent of the demand beyond it, 1.
      tremor: time constant of the filter of the joystick, s.
      power: share of the current limits, 1. torque: share of the load compensation, 1.
    """

    forward_speed: tuple[float, float] = quantity("m/s", 0.05, 6.0, "at full deflection")
    reverse_speed: tuple[float, float] = quantity("m/s", 0.05, 6.0, "at full deflection")
    turn_speed: tuple[float, float] = quantity("rad/s", 0.05, 6.0, "at full deflection")
    forward_acceleration: tuple[float, float] = quantity("m/s^2", 0.05, 10.0, "of the reference")
    forward_deceleration: tuple[float, float] = quantity("m/s^2", 0.05, 10.0, "of the reference")
    reverse_acceleration: tuple[float, float] = quantity("m/s^2", 0.05, 10.0, "of the reference")
    reverse_deceleration: tuple[float, float] = quantity("m/s^2", 0.05, 10.0, "of the reference")
    turn_acceleration: tuple[float, float] = quantity("rad/s^2", 0.05, 30.0, "of the reference")
    turn_deceleration: tuple[float, float] = quantity("rad/s^2", 0.05, 30.0, "of the reference")
    fast_brake: float = quantity("m/s^2", 0.05, 15.0, "while the stick is reversed")
    deadband: float = quantity("1", 0.01, 0.6, "of the joystick")
    curve: float = quantity("1", 0.3, 4.0, "exponent of the demand")
    tremor: float = quantity("s", 0.0, 2.0, "time constant of the joystick's filter")
    power: float = quantity("1", 0.05, 1.0, "share of the current limits")
    torque: float = quantity("1", 0.0, 1.0, "share of the load compensation")

    def __post_init__(self) -> None:
        """Check the numbers, and that a pair does not fall."""
        super().__post_init__()
        for item in fields(self):
            value = getattr(self, item.name)
            if isinstance(value, tuple) and (len(value) != 2 or value[0] > value[1]):
                raise MjchairError(
                    f"profile {item.name} is {list(value)}; it must be two numbers, at the lowest "
                    "and at the highest dial, the second not the smaller"
                )

    def at(self, dial: float) -> dict[str, float]:
        """Every number at a setting of the speed dial, 0 to 1."""
        values = {item.name: getattr(self, item.name) for item in fields(self)}
        return {
            name: value[0] + dial * (value[1] - value[0]) if isinstance(value, tuple) else value
            for name, value in values.items()
        }


PARTS: tuple[type[Part], ...] = (Motor, Gear, Brake, Battery, Controller)


@dataclass(frozen=True)
class Drive:
    """The drive of a chair: its parts, and the profile that its controller runs.

    Attributes:
      motor, gear, brake: of each side. battery, controller: of both. profile: chosen one.
      profile_name: its name.
    """

    motor: Motor
    gear: Gear
    brake: Brake
    battery: Battery
    controller: Controller
    profile: Profile
    profile_name: str = "normal"

    def __post_init__(self) -> None:
        """Check what parts must be to one another.

        Raises:
          MjchairError: the load compensation is no less than the motor's resistance, with which
            the controller would drive the motor away by itself.
        """
        compensation = self.controller.compensation * self.profile.torque
        if compensation >= 0.95 * self.motor.resistance:
            raise MjchairError(
                f"controller compensation is {compensation:g} ohm; it must be below 0.95 of the "
                f"motor's resistance, {0.95 * self.motor.resistance:.3g} ohm"
            )

    @property
    def wheel_constant(self) -> float:
        """N m per A at the wheel without losses, and V s per rad of the wheel."""
        return self.motor.constant * self.gear.ratio

    @property
    def armature(self) -> float:
        """Inertia of the rotor at the wheel, kg m^2."""
        return self.motor.rotor_inertia * self.gear.ratio**2

    def free_speed(self, radius: float) -> float:
        """Speed (m/s) without load, on the full battery, of wheels of a radius (m)."""
        return self.battery.voltage[-1] / self.wheel_constant * radius

    def joystick(self, speed: float, turn: float) -> tuple[float, float]:
        """Deflections (x, y) that ask for a speed (m/s) and a yaw rate (rad/s).

        They undo deadband and curve; what is beyond the profile's speeds gives full deflection.
        """
        at = self.profile.at(self.controller.dial)
        most = at["forward_speed"] if speed > 0.0 else at["reverse_speed"]
        return (
            self._deflection(speed / most),
            self._deflection(turn / at["turn_speed"]),
        )

    def _deflection(self, demand: float) -> float:
        """The deflection of the joystick that makes a demand, each -1 to 1."""
        if demand == 0.0:
            return 0.0
        deadband = self.profile.deadband
        size = min(abs(demand), 1.0) ** (1.0 / self.profile.curve)
        return math.copysign(deadband + (1.0 - deadband) * size, demand)

    def check_speeds(self, radius: float) -> None:
        """See that the motors turn as fast as the profile asks.

        Raises:
          MjchairError: they do not, on wheels of that radius (m).
        """
        free = self.free_speed(radius)
        for name in ("forward_speed", "reverse_speed"):
            wanted = getattr(self.profile, name)[1]
            if wanted > free:
                raise MjchairError(
                    f"profile {self.profile_name}: {name} is {wanted:g} m/s; the motors reach "
                    f"{math.floor(100.0 * free) / 100.0:g} m/s without load on the full battery"
                )
