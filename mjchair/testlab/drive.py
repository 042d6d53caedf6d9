"""What drives a chair in a test: its own drive with a joystick, or a person at the push rims.

In: the speed and yaw rate that a test asks for, and the motion of the chair. Out: the inputs of the
chair, which are the joystick's deflections or the torques on the wheels, and the energy that is
taken from the battery or from the person.

A power chair is driven through its joystick (mjchair.drive): controller, motors, parking brakes and
battery are those of its `drive.toml`. The numbers of the person are assumptions.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import mujoco
import numpy as np

from mjchair.drive import block
from mjchair.drive.attach import drives
from mjchair.drive.quantities import Drive
from mjchair.engine import drivetrain
from mjchair.errors import MjchairError
from mjchair.model.spec import compile_spec
from mjchair.testlab.design import REAR, Design, parts
from mjchair.testlab.track import Command, Track, View

STILL = 0.02  # m/s, below which a chair counts as stopped


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

    @property
    def reverse_speed(self) -> float:
        """Largest speed backward, m/s: that forward."""
        return self.top_speed


@dataclass(frozen=True)
class Joystick:
    """The drive of a power chair, driven with its joystick.

    Attributes:
      drive: controller, motors, brakes and battery.
    """

    drive: Drive

    @property
    def top_speed(self) -> float:
        """Speed of the profile at full deflection forward, m/s."""
        return self._at("forward_speed")

    @property
    def reverse_speed(self) -> float:
        """Speed of the profile at full deflection backward, m/s."""
        return self._at("reverse_speed")

    @property
    def battery(self) -> float:
        """Energy of the full battery without load, Wh."""
        cells = self.drive.battery
        return cells.capacity * float(np.trapezoid(cells.voltage, dx=0.25))

    def _at(self, name: str) -> float:
        return float(self.drive.profile.at(self.drive.controller.dial)[name])

    def describe(self) -> str:
        """Profile and numbers that decide the tests, in a line."""
        profile = self.drive.profile.at(self.drive.controller.dial)
        return (
            f"driven with its joystick, profile {self.drive.profile_name}: "
            f"{profile['forward_speed']:g} m/s, deceleration {profile['forward_deceleration']:g} "
            f"m/s^2, fast brake {profile['fast_brake']:g} m/s^2; numbers of its drive.toml"
        )


Driving = Person | Joystick


def has_motors(model: mujoco.MjModel) -> bool:
    """Whether motors drive the rear wheels: their rotors add inertia (armature) to the wheels."""
    joints = [parts(model).joints[wheel] for wheel in REAR]
    return bool((model.dof_armature[model.jnt_dofadr[joints]] > 0.0).all())


def drive_of(design: Design) -> Driving:
    """What drives a design.

    Raises:
      MjchairError: rotors add inertia to its wheels, but it has no drive.
    """
    drive = design.own_drive()
    if drive is not None:
        return Joystick(drive)
    if has_motors(compile_spec(design.spec())):
        raise MjchairError(
            f"motors turn the wheels of {design.model}, but it has no drive: put a drive.toml "
            "beside its file, or give --drive FILE (docs/power_drive.md)"
        )
    return Person()


def switch_off(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Switch the power of a chair's drive off: no current from then on, and the brakes close.

    Args:
      model, data: changed in place; the joystick must be let go as well.
    """
    asked = (drivetrain.X, drivetrain.Y, drivetrain.SPEED, drivetrain.TURN, drivetrain.AWAKE)
    for driven in drives(model):
        data.act[driven.state + np.array(asked)] = 0.0
        for motor in driven.motors:
            model.actuator_user[motor, block.MOTOR["continuous_current"]] = 1e-6
            model.actuator_user[motor, block.MOTOR["boost_current"]] = 2e-6


class Pilot:
    """Controls speed and yaw rate of a chair by its inputs.

    Attributes:
      track: width between the driven wheels, m. energy: taken so far, J.
    """

    track: float
    energy: float = 0.0

    def go(self, view: View, speed: float, yaw: float = 0.0) -> Command:
        """Inputs for a wanted speed (m/s) and yaw rate (rad/s), which are held by correction."""
        raise NotImplementedError

    def ask(self, view: View, speed: float, yaw: float = 0.0) -> Command:
        """Inputs that ask for a speed (m/s) and a yaw rate (rad/s) whatever comes of it."""
        raise NotImplementedError

    def stop(self, view: View, reverse: bool = False) -> Command:
        """Inputs that stop the chair: let go, or ask for the opposite direction."""
        raise NotImplementedError


def pilot_of(driving: Driving, track: Track, *, sideways: float = 1.5) -> Pilot:
    """A pilot for a chair on a track, which begins with its present motion.

    Args:
      sideways: rate of change of the yaw rate that a person asks for, rad/s^2.
    """
    if isinstance(driving, Joystick):
        return Stick(driving, track.view)
    return Pusher(driving, track.view, sideways=sideways)


class Stick(Pilot):
    """Drives with the joystick, and corrects the way that the chair takes by what it sees.

    The correction is a share of the missing speed and yaw rate and its sum over time, as a person
    at the joystick makes it; full deflection is not exceeded.
    """

    SHARE, SUM = 0.3, 1.5  # 1, 1/s; assumptions: a second until an error is gone

    def __init__(self, driving: Joystick, view: View) -> None:
        """Begin with the present motion of the chair."""
        hubs = [view.data.geom_xpos[view.parts.geoms[wheel]] for wheel in REAR]
        self.track = math.dist(hubs[0], hubs[1])
        self.energy = 0.0
        self._drive = driving.drive
        names = [name for name, _ in block.DRIVE_SENSOR]
        sensor = next(
            i for i in range(view.model.nsensor) if view.model.sensor(i).name.endswith(block.DRIVE)
        )
        self._power = int(view.model.sensor_adr[sensor]) + names.index("battery_power")
        self._sums = np.zeros(2)
        self._time = view.time

    def go(self, view: View, speed: float, yaw: float = 0.0) -> Command:
        """Deflections forward and to the left, -1 to 1."""
        step = self._passed(view)
        asked = np.array([speed, yaw])
        error = asked - (view.speed, view.yaw_rate)
        self._sums = np.clip(self._sums + self.SUM * error * step, -0.5, 0.5)
        wanted = asked + self.SHARE * error + self._sums
        return self._drive.joystick(
            float(wanted[0]) if speed else 0.0, float(wanted[1]) if speed or yaw else 0.0
        )

    def ask(self, view: View, speed: float, yaw: float = 0.0) -> Command:
        """Deflections of a stick that is held as it is, without correction."""
        self._passed(view)
        return self._drive.joystick(speed, yaw)

    def stop(self, view: View, reverse: bool = False) -> Command:
        """The stick let go, or fully against the motion until the chair stands."""
        self._passed(view)
        if reverse and abs(view.speed) > STILL:
            return -math.copysign(1.0, view.speed), 0.0
        return 0.0, 0.0

    def _passed(self, view: View) -> float:
        """Time since the last call, s; the energy of this time is counted."""
        step = float(view.time - self._time)
        self._time = view.time
        self.energy += float(view.data.sensordata[self._power]) * step
        return step


class Pusher(Pilot):
    """Controls speed and yaw rate with torques of a person; what is asked for changes gradually.

    Attributes:
      speed, yaw: asked for at present, m/s and rad/s. torques: the last ones, N m.
    """

    STIFFNESS = 6.0  # 1/s, of the speed loop

    def __init__(self, person: Person, view: View, *, sideways: float) -> None:
        """Begin with the present motion of the chair."""
        model = view.model
        self.person = person
        self.radius = float(model.geom_size[view.parts.geoms["left_wheel"], 0])
        hubs = [view.data.geom_xpos[view.parts.geoms[wheel]] for wheel in REAR]
        self.track = math.dist(hubs[0], hubs[1])
        self.mass = float(model.body_subtreemass[0])
        self.sideways = sideways
        self.speed, self.yaw = view.speed, view.yaw_rate
        self.energy = 0.0
        self.torques: Command = (0.0, 0.0)
        self._sums = [0.0, 0.0]
        self._time = view.time

    def ask(self, view: View, speed: float, yaw: float = 0.0) -> Command:
        """As `go`: a person holds a speed in any case."""
        return self.go(view, speed, yaw)

    def stop(self, view: View, reverse: bool = False) -> Command:
        """Command that stop the chair; a person stops alike in both ways."""
        return self.go(view, 0.0)

    def go(self, view: View, speed: float, yaw: float = 0.0) -> Command:
        """Command on the left and the right wheel, N m."""
        step = view.time - self._time
        self._time = view.time
        before = self.speed
        faster = abs(speed) > abs(self.speed) or speed * self.speed < 0.0
        most = (self.person.acceleration if faster else self.person.retardation) * step
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
            wanted = half_mass * (self.STIFFNESS * (error + self._sums[i]) + change)
            given = max(-self.person.strongest, min(self.person.strongest, wanted))
            if given == wanted:  # no integral wind-up while the torque is limited
                self._sums[i] += 1.0 * error * step
            given_torques.append(given)
        self.torques = (given_torques[0], given_torques[1])
        return self.torques

    def _account(self, view: View, step: float) -> None:
        """Count the work of the push; braking is taken to cost the person no energy."""
        for torque, spin in zip(self.torques, (view.left, view.right), strict=True):
            self.energy += max(0.0, torque * spin) * step
