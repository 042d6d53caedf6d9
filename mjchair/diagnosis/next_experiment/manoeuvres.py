"""Manoeuvres that anyone with the chair can do: the library that the next experiment comes from.

In: a study, which tells where and how hard it drives. Out: manoeuvres with their start and torque.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis.data import first_state
from mjchair.diagnosis.data.study import Study
from mjchair.model.load import Load
from mjchair.model.wheels import WHEELS
from mjchair.simulation.initial import Initial
from mjchair.simulation.inputs import Inputs

Array = NDArray[np.float64]
Torque = Callable[[Array], tuple[Array, Array]]
SECONDS = 6.0  # of a manoeuvre
LOAD = Load(mass=15.0, height=0.55)  # on the seat, above the rear axle
GRID = 0.01  # s, between samples of a torque
COAST = 1.8  # m/s


@dataclass(frozen=True)
class Manoeuvre:
    """One run that could be made.

    Attributes:
      name: short. words: what to do, for a person who owns the chair.
      speed: at the start, m/s. turned: heading against the study's, rad. yaw_rate: rad/s.
      torque: time (s) -> left and right torque as shares of the study's largest; None: a coast.
      shift: of the start, m, ahead and to the left. load: that is strapped to the seat.
      seconds: how long, s. motor: whether it holds a torque for seconds, as no hand does.
    """

    name: str
    words: str
    speed: float = 0.0
    turned: float = 0.0
    yaw_rate: float = 0.0
    torque: Torque | None = None
    shift: tuple[float, float] = (0.0, 0.0)
    load: Load | None = None
    seconds: float = SECONDS
    motor: bool = False

    @property
    def stands(self) -> bool:
        """Whether the chair stands still."""
        return self.torque is None and not self.speed and not self.yaw_rate

    @property
    def turns(self) -> bool:
        """Whether its two rear wheels do not roll alike."""
        if self.torque is None or self.yaw_rate:
            return bool(self.yaw_rate)
        left, right = self.torque(np.arange(0.0, self.seconds, GRID))
        return not np.array_equal(left, right)


@dataclass(frozen=True)
class Setting:
    """Where a study drives, and how hard.

    Attributes:
      position: (x, y) m and heading (rad) of a start. torque: largest, N m; 0 where none is told.
      run: name of the run that starts there.
      straight: whether only one wheel is measured, and taken for both.
      by_hand: whether hands on rims push it.
    """

    position: tuple[float, float]
    heading: float
    torque: float
    run: str = ""
    straight: bool = False
    by_hand: bool = False

    def initial(self, manoeuvre: Manoeuvre) -> Initial:
        """How the manoeuvre starts here."""
        ahead, left = manoeuvre.shift
        c, s = np.cos(self.heading), np.sin(self.heading)
        x, y = self.position
        place = (float(x + c * ahead - s * left), float(y + s * ahead + c * left))
        heading = self.heading + manoeuvre.turned
        return Initial(place, heading, manoeuvre.speed, manoeuvre.yaw_rate)

    def inputs(self, manoeuvre: Manoeuvre) -> Inputs | None:
        """What drives the manoeuvre, in N m."""
        if manoeuvre.torque is None:
            return None
        time = np.arange(0.0, manoeuvre.seconds + 2.0 * GRID, GRID)
        left, right = manoeuvre.torque(time)
        controls = {"left_wheel": self.torque * left, "right_wheel": self.torque * right}
        return Inputs(time, controls, manoeuvre.name)

    def largest(self, manoeuvre: Manoeuvre) -> float:
        """Largest torque of a wheel in the manoeuvre, N m."""
        inputs = self.inputs(manoeuvre)
        return 0.0 if inputs is None else _peak(inputs)


def setting(study: Study) -> Setting:
    """That of the first coast that is fitted to, or else of the first run."""
    runs = [study.runs[i] for i in study.fitted]
    peaks = [0.0 if r.trial.inputs is None else _peak(r.trial.inputs) for r in runs]
    driven = [peak for peak in peaks if peak > 0.0]
    coast = next((r for r, peak in zip(runs, peaks, strict=True) if peak == 0.0), runs[0])
    first = first_state.initial(coast, study.axle)
    torque = float(np.median(driven or [0.0]))
    place = first.position or (0.0, 0.0)
    heading, straight = first.heading or 0.0, bool(study.copied)
    return Setting(place, heading, torque, coast.trial.name, straight, study.torque_measured)


def _peak(inputs: Inputs) -> float:
    """Largest torque of a rear wheel, N m; 0 where none is told: a joystick gives shares."""
    torques = [v for name, v in inputs.controls.items() if name.endswith(WHEELS[:2])]
    return max((float(np.nanmax(np.abs(v))) for v in torques), default=0.0)


def possible(here: Setting) -> list[Manoeuvre]:
    """The manoeuvres that a lab can make and see.

    Those with torque only where it measures torque, with one wheel for both only straight ones,
    and by hand none that only a motor can make.
    """
    return [
        m
        for m in LIBRARY
        if (m.torque is None or here.torque > 0.0)
        and not (m.turns and here.straight)
        and not (m.motor and here.by_hand)
    ]


def _strokes(time: Array) -> tuple[Array, Array]:
    phase = np.mod(time - 0.2, 1.15)
    bell = np.where((time > 0.2) & (phase < 0.46), np.sin(np.pi * phase / 0.46) ** 2, 0.0)
    return bell, bell


def _slalom(frequency: float) -> Torque:
    def torque(time: Array) -> tuple[Array, Array]:
        swing = 0.45 * np.sin(2.0 * np.pi * frequency * time)
        return 0.15 + swing, 0.15 - swing

    return torque


def _steps(half: float) -> Torque:
    """Forward and off in turn, each for `half` (s), with edges that a table can tell."""

    def torque(time: Array) -> tuple[Array, Array]:
        on = 0.25 + 0.25 * np.tanh(np.sin(np.pi * (time - 0.4) / half) / 0.2)
        return on, on

    return torque


def _flip(time: Array) -> tuple[Array, Array]:
    on = 0.2 + 0.2 * np.tanh((time - 0.5) / 0.1)
    return on, on


def _spin(time: Array) -> tuple[Array, Array]:
    turn = 0.4 * np.tanh(np.sin(2.0 * np.pi * time / SECONDS) / 0.2)
    return -turn, turn


def _circle(time: Array) -> tuple[Array, Array]:
    return np.full_like(time, 0.05), np.full_like(time, 0.25)


_TURN = "in a turn to the {} that begins at 0.6 rad/s, a radius of about 2.2 m"
_WAVES = "Drive a slalom from 1 m/s, to the right first, {:g} s a wave"
_SEAT = (
    f" with {LOAD.mass:g} kg more, strapped down above the rear axle, {LOAD.height:g} m over the "
    "floor"
)
LIBRARY = (  # simplest first
    Manoeuvre("stand", "Let it stand with everything recording, brakes off, hands off"),
    Manoeuvre("coast", "Coast from 1.8 m/s, hands off the wheels", COAST),
    Manoeuvre(
        "coast reversed",
        "Coast the other way over the same floor: start 6 m further ahead, heading turned by 180 "
        "degrees, from 1.8 m/s",
        COAST,
        np.pi,
        shift=(6.0, 0.0),
    ),
    Manoeuvre(
        "coast across",
        "Coast from 1.8 m/s with the heading turned by 90 degrees to the left",
        COAST,
        0.5 * np.pi,
    ),
    Manoeuvre("fast coast", "Coast from 3 m/s", 3.0),
    Manoeuvre(
        "fast coast reversed",
        "Coast the other way over the same floor: start 14 m further ahead, heading turned by 180 "
        "degrees, from 3 m/s",
        3.0,
        np.pi,
        shift=(14.0, 0.0),
    ),
    Manoeuvre("slow coast", "Coast from 0.8 m/s", 0.8),
    Manoeuvre("coast backwards", "Coast backwards from 0.5 m/s", -0.5, seconds=4.0),
    Manoeuvre(
        "coast in a left turn", "Coast from 1.3 m/s " + _TURN.format("left"), 1.3, yaw_rate=0.6
    ),
    Manoeuvre(
        "coast in a right turn", "Coast from 1.3 m/s " + _TURN.format("right"), 1.3, yaw_rate=-0.6
    ),
    Manoeuvre(
        "coast a metre aside",
        "Coast from 1.8 m/s with the start moved by 1 m to the left",
        COAST,
        shift=(0.0, 1.0),
    ),
    Manoeuvre(
        "free spin", "Turn it on the spot to the left at about 1.5 rad/s and let go", yaw_rate=1.5
    ),
    Manoeuvre(
        "pushes",
        "Push it straight from 0.8 m/s with even strokes of 0.46 s, one every 1.15 s",
        0.8,
        torque=_strokes,
    ),
    Manoeuvre("slow slalom", _WAVES.format(4.0), 1.0, torque=_slalom(1.0 / 4.0)),
    Manoeuvre("fast slalom", _WAVES.format(1.7), 1.0, torque=_slalom(1.0 / 1.7)),
    Manoeuvre(
        "short steps",
        "From a standstill go straight by short pushes, 0.5 s on and 0.5 s off",
        torque=_steps(0.5),
    ),
    Manoeuvre(
        "long steps",
        "From a standstill drive straight, torque on and off, 2 s each",
        torque=_steps(2.0),
        motor=True,
    ),
    Manoeuvre(
        "reverse, then forward",
        "Roll backwards at 0.5 m/s, turning at 0.2 rad/s to the left, and drive forward after half "
        "a second, so that the casters flip",
        -0.5,
        yaw_rate=0.2,
        torque=_flip,
        seconds=4.0,
        motor=True,
    ),
    Manoeuvre(
        "driven spin",
        "Drive it on the spot from a standstill, 3 s to the left and 3 s to the right",
        torque=_spin,
        motor=True,
    ),
    Manoeuvre(
        "circle",
        "Drive a circle to the left from 1 m/s and 0.5 rad/s, the right wheel with five times the "
        "torque of the left",
        1.0,
        yaw_rate=0.5,
        torque=_circle,
        motor=True,
    ),
    Manoeuvre("loaded coast", "Coast from 1.8 m/s" + _SEAT, COAST, load=LOAD),
    Manoeuvre(
        "loaded coast in a turn",
        "Coast from 1.3 m/s " + _TURN.format("left") + _SEAT,
        1.3,
        yaw_rate=0.6,
        load=LOAD,
    ),
    Manoeuvre(
        "loaded slalom", _WAVES.format(4.0) + _SEAT, 1.0, torque=_slalom(1.0 / 4.0), load=LOAD
    ),
)
