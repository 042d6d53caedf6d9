"""What drives a chair in a test: motors under a joystick controller, or a person at the push rims.

In: the speed and yaw rate that a test commands, and the motion of the chair. Out: the torques at
the wheels, and the power that is taken for them from the battery or from the person. `Drive` is an
interface: a more detailed model of a motor with its controller can take its place.

A drive is described by its torques alone, without currents as states. Its numbers are assumptions,
each stated below. A chair counts as driven by motors when rotors add inertia (`armature`) to its
rear wheels.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import mujoco

from mjchair.model.spec import compile_spec
from mjchair.testlab.design import REAR, Design, parts
from mjchair.testlab.track import Torques, View


class Drive(Protocol):
    """The interface through which a test uses a drive.

    Attributes:
      motors: whether electric motors drive the wheels. top_speed: largest speed that is commanded,
        m/s.
      acceleration, retardation: of the commanded speed, m/s^2.
    """

    @property
    def motors(self) -> bool: ...  # noqa: D102

    @property
    def top_speed(self) -> float: ...  # noqa: D102

    @property
    def acceleration(self) -> float: ...  # noqa: D102

    @property
    def retardation(self) -> float: ...  # noqa: D102

    def torque(self, wanted: float, spin: float) -> float:
        """Torque (N m) on a wheel that turns at `spin` rad/s; `wanted` (N m) is the command."""

    def power(self, torque: float, spin: float) -> float:
        """Power (W) that one wheel takes from the battery, or from the person."""


@dataclass(frozen=True)
class Motors:
    """Two geared direct-current motors with a controller, described by their torques.

    Attributes:
      stall: N m at the wheel, the controller's current limit (assumption: 100 A through a torque
        constant of 0.05 N m/A, gear 20, efficiency 0.8).
      free: speed of the wheel without load, rad/s (assumption: 1.25 times that of the top speed).
      per_ampere: N m at the wheel for 1 A, from the same numbers. resistance: of motor and leads,
        ohm (assumption). standby: power of half of the controller, one motor's part, W
        (assumption).
      regeneration: share of the braking power that goes back to the battery (assumption: 0.5).
      brake: torque of one power-off brake, N m (assumption: holds 1.5 times the pull of the weight
        on a slope of 10 deg).
    """

    top_speed: float = 1.67  # m/s, 6 km/h; assumption, the usual limit indoors and on pavements
    acceleration: float = 1.2  # m/s^2; assumption
    retardation: float = 1.6  # m/s^2, joystick released; assumption
    reverse: float = 2.4  # m/s^2, joystick reversed; assumption, 1.5 times the above
    stall: float = 80.0
    free: float = 12.3
    per_ampere: float = 0.8
    resistance: float = 0.15
    standby: float = 5.0
    regeneration: float = 0.5
    brake: float = 40.0
    motors: bool = True

    def torque(self, wanted: float, spin: float) -> float:
        """The command, limited by the stall torque and by the line to zero at free speed."""
        ahead = self.stall * min(1.0, max(0.0, (1.0 - spin / self.free) / 0.4))
        back = self.stall * min(1.0, max(0.0, (1.0 + spin / self.free) / 0.4))
        return max(-back, min(ahead, wanted))

    def power(self, torque: float, spin: float) -> float:
        """Mechanical power, heat of the current, and standby power."""
        current = torque / self.per_ampere
        mechanical = torque * spin
        gear = 0.8  # efficiency of the gear, that in `stall`
        taken = mechanical / gear if mechanical > 0.0 else self.regeneration * mechanical
        return taken + current**2 * self.resistance + self.standby


@dataclass(frozen=True)
class Person:
    """A person who pushes evenly, without strokes.

    Attributes:
      strongest: largest torque on one wheel, N m (assumption: it can be held for a moment; the
        peaks of strokes on a push rim are 20 to 40 N m, SmartWheel records in data/smartwheel).
    """

    top_speed: float = 1.5  # m/s; assumption, brisk
    acceleration: float = 0.8  # m/s^2; assumption
    retardation: float = 1.0  # m/s^2; assumption
    strongest: float = 35.0
    motors: bool = False

    def torque(self, wanted: float, spin: float) -> float:
        """The commanded torque, limited by the strength of the arms."""
        return max(-self.strongest, min(self.strongest, wanted))

    def power(self, torque: float, spin: float) -> float:
        """Mechanical power; braking is taken to cost the person no power."""
        return max(0.0, torque * spin)


def has_motors(model: mujoco.MjModel) -> bool:
    """Whether motors drive the rear wheels: their rotors add inertia (armature) to the wheels."""
    joints = [parts(model).joints[wheel] for wheel in REAR]
    return bool((model.dof_armature[model.jnt_dofadr[joints]] > 0.0).all())


def drive_of(design: Design) -> Drive:
    """The drive of a design: motors or a person."""
    return Motors() if has_motors(compile_spec(design.spec())) else Person()


class Pilot:
    """Controls speed and yaw rate with the torques of a drive; commands change at a limited rate.

    Attributes:
      speed, yaw: the present commands, m/s and rad/s. energy: taken so far, J.
      torques: the last ones, N m.
    """

    def __init__(
        self,
        drive: Drive,
        view: View,
        *,
        stiffness: float = 6.0,
        sideways: float = 1.5,
    ) -> None:
        """Begin with the present motion of the chair.

        Args:
          stiffness: 1/s, of the speed loop. sideways: rate of change of the commanded yaw rate,
            rad/s^2.
        """
        model = view.model
        self.drive = drive
        self.radius = float(model.geom_size[view.parts.geoms["left_wheel"], 0])
        hubs = [view.data.geom_xpos[view.parts.geoms[wheel]] for wheel in REAR]
        self.track = math.dist(hubs[0], hubs[1])
        self.mass = float(model.body_subtreemass[0])
        self.stiffness, self.sideways = stiffness, sideways
        self.speed, self.yaw = view.speed, view.yaw_rate
        self.energy = 0.0
        self.torques: Torques = (0.0, 0.0)
        self._sums = [0.0, 0.0]
        self._time = view.time

    def go(self, view: View, speed: float, yaw: float = 0.0, rate: float | None = None) -> Torques:
        """Torques for a wanted speed (m/s) and yaw rate (rad/s).

        Args:
          rate: rate of change of the commanded speed, m/s^2; None: that of the drive.
        """
        step = view.time - self._time
        self._time = view.time
        before = self.speed
        faster = abs(speed) > abs(self.speed) or speed * self.speed < 0.0
        usual = self.drive.acceleration if faster else self.drive.retardation
        most = (usual if rate is None else rate) * step
        self.speed += max(-most, min(most, speed - self.speed))
        change = (self.speed - before) / step if step > 0.0 else 0.0
        turn = self.sideways * step
        self.yaw += max(-turn, min(turn, yaw - self.yaw))
        self._account(view, step)
        half = 0.5 * self.track * self.yaw
        given_torques = []
        for i, (target, spin) in enumerate(
            ((self.speed - half, view.left), (self.speed + half, view.right))
        ):
            error = target - spin * self.radius
            half_mass = 0.5 * self.mass * self.radius
            wanted = half_mass * (self.stiffness * (error + self._sums[i]) + change)
            given = self.drive.torque(wanted, spin)
            if given == wanted:  # no integral wind-up while the torque of the drive is limited
                self._sums[i] += 1.0 * error * step
            given_torques.append(given)
        self.torques = (given_torques[0], given_torques[1])
        return self.torques

    def _account(self, view: View, step: float) -> None:
        for torque, spin in zip(self.torques, (view.left, view.right), strict=True):
            self.energy += self.drive.power(torque, spin) * step
