"""SmartWheel recordings: an instrumented push rim, 24 or 25 columns at 240 Hz.

In: a file as the instrument writes it, comma or semicolon, with or without a header, decimal points
or commas. Out: a `PushRim`, whose angle goes on where the encoder wraps.

Format as in Kinetics Toolkit (Chénier, `read_smartwheel`). Columns, from 1: 1-2 sample counters;
3 encoder ticks (4096 a revolution); 4 wheel angle (deg, wraps); 5 running-average speed (m/s);
6 flag; 7-12 raw and 13-18 filtered channels; 19-21 Fx Fy Fz (N) and 22-24 Mx My Mz (N m) on the hub
in the wheel's fixed frame; 25, where there is one, is not used. A left wheel of this make counts
down as it rolls forward, and a hand that pushes a right wheel forward gives Mz < 0; other
programs have turned these signs before they wrote a file. `oriented` finds them out.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from mjchair.errors import MjchairError
from mjchair.measurement import encoder
from mjchair.measurement.delimited import read_delimited
from mjchair.measurement.notes import Detail, about
from mjchair.measurement.stretches import stretches
from mjchair.measurement.trial import Trial
from mjchair.simulation.inputs import Inputs
from mjchair.simulation.table import frozen
from mjchair.units import per_cent

Array = NDArray[np.float64]

RATE = 240.0  # Hz
TICKS = 4096  # encoder ticks a revolution
COLUMNS = (24, 25)
FORCES = slice(18, 24)  # Fx Fy Fz Mx My Mz
WINDOW = 21  # samples, of the local parabola that turns angles into speed (Kinetics Toolkit's)
DEGREES = 0.1  # deg, within which column 4 is the angle of column 3
ROLLS = 1.0  # rad, of which a wheel must turn on balance to tell which way is forward
PUSHES = 3.0  # N m, above which a hand pushes or brakes
CHANNELS = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")
ENDS = 0.01  # share of the samples at one largest value, from which a sensor is at its end
IN_A_ROW = 5  # such samples; a quantized peak is shorter
AWAY = 0.25  # of a channel's range, by which such a value is away from its median
CLEAR = 0.5  # share of a hand's work that must have one sign to tell the sign of Mz


@dataclass(frozen=True)
class PushRim:
    """A recording of one instrumented wheel.

    Attributes:
      time: (n,), s, from the sample counter; 0 at the first sample.
      angle: (n,), rad, unwrapped, 0 at the first sample; forward positive once `oriented`.
      speed: (n,), rad/s, from the angle by a local parabola over 21 samples.
      absolute: (n,), rad, encoder angle as counted, for what repeats every revolution.
      forces: (n, 6), Fx Fy Fz (N) Mx My Mz (N m) on the hub.
      ground_speed: (n,), m/s, the instrument's own running average.
      there: (n,), False where the encoder jumped, so that angle and speed are interpolated.
      source: the file. notes: what was noticed while reading, one line each.
    """

    time: Array
    angle: Array
    speed: Array
    absolute: Array
    forces: Array
    ground_speed: Array
    there: NDArray[np.bool_]
    source: str
    notes: tuple[str, ...] = ()

    @property
    def torque(self) -> Array:
        """Moment of the hand about the axle, N m, positive drives forward, (n,)."""
        return self.forces[:, 5]


class Orientation(NamedTuple):
    """How a file's signs are to be turned.

    Attributes:
      travel: 1 or -1, what the angle is multiplied by so that forward is positive.
      moment: 1 or -1, the same for Mz. side: "left" or "right" where the signs tell it, else "".
      clear: whether a hand's work told the sign of Mz.
    """

    travel: int
    moment: int
    side: str
    clear: bool


def read_smartwheel(path: str | os.PathLike[str]) -> PushRim:
    """Read a SmartWheel file; its signs are left as they are.

    Raises:
      MjchairError: no such file, another number of columns, a cell that is not a number, a sample
        counter that jumps, or fewer samples than a speed needs.
    """
    path = Path(path)
    if not path.is_file():
        raise MjchairError(f"no file {path}; give a SmartWheel CSV")
    data = _numbers(path)
    absolute, notes = _angle(data)
    jumps = encoder.find_jumps(absolute)
    angle, there = encoder.without_jumps(absolute, jumps)
    if jumps.samples.size:
        notes.append(_about_jumps(jumps))
    return PushRim(
        time=frozen(np.arange(len(data)) / RATE),
        angle=frozen(angle - angle[0]),
        speed=frozen(speed_of(angle)),
        absolute=frozen(absolute if not jumps.stay else angle),
        forces=frozen(data[:, FORCES]),
        ground_speed=frozen(data[:, 4]),
        there=there,
        source=str(path),
        notes=tuple(about(path.name, note) for note in notes),
    )


def speed_of(angle: Array, rate: float = RATE) -> Array:
    """Speed (n,) rad/s of an angle (n,) rad sampled at `rate` Hz, by a local parabola."""
    return np.asarray(savgol_filter(angle, WINDOW, 2, deriv=1, delta=1.0 / rate))


def _about_jumps(jumps: encoder.Jumps) -> str:
    where = f", at {np.degrees(jumps.place):.0f} deg of every turn" if jumps.once_a_turn else ""
    kept = "taken out of the angle" if jumps.stay else "left out"
    return (
        f"the encoder jumps by {np.degrees(jumps.size):.2f} deg in {jumps.samples.size} samples"
        f"{where}; they are {kept}"
    )


def _numbers(path: Path) -> Array:
    """The rows of the file, (n, 24)."""
    file = read_delimited(path)
    data = file.values
    if data.shape[1] not in COLUMNS:
        raise MjchairError(
            f"{path}: row {file.first} has {data.shape[1]} columns; a SmartWheel file has 24 or 25"
        )
    data = data[:, :24]
    bad = np.argwhere(~np.isfinite(data))
    if bad.size:
        row, column = bad[0]
        raise MjchairError(
            f"{path}: row {file.first + row} has no finite number in column {column + 1}"
            + ("; the file is cut short there: take the row out" if row == len(data) - 1 else "")
        )
    if len(data) < WINDOW:
        raise MjchairError(f"{path}: {len(data)} samples; a speed needs at least {WINDOW}")
    _check_counter(data[:, 0], data[:, 1], file.first, path)
    return data


def _check_counter(counter: Array, other: Array, first: int, path: Path) -> None:
    """Refuse lost samples; a counter may start again where the other one goes on."""
    jumps = np.flatnonzero((np.diff(counter) != 1.0) & (np.diff(other) != 1.0))
    if jumps.size:
        row = int(jumps[0])
        raise MjchairError(
            f"{path}: the sample counter goes from {counter[row]:g} to {counter[row + 1]:g} in row "
            f"{first + row + 1}; it must count every sample"
        )


def _angle(data: Array) -> tuple[Array, list[str]]:
    """The encoder's angle as counted, rad, unwrapped; column 4 where it agrees with column 3."""
    ticks = encoder.unwrapped(data[:, 2] * (2.0 * np.pi / TICKS))
    degrees = encoder.unwrapped(np.radians(data[:, 3]))
    apart = np.abs((np.degrees(ticks - degrees) + 180.0) % 360.0 - 180.0)
    notes: list[str] = []
    if np.ptp(data[:, 2]) < TICKS and np.ptp(ticks) > 2.0 * np.pi:
        wraps = f"the encoder wraps at {TICKS - 1}; it is counted on, {ticks_text(ticks)}"
        notes.append(Detail(wraps))
    if np.median(apart) < DEGREES:
        return degrees, notes
    if np.ptp(data[:, 3]) > 0.0:
        notes.append("columns 3 and 4 tell two angles; the ticks of column 3 are used")
    return ticks, notes


def ticks_text(angle: Array) -> str:
    """How far a wheel turned, in words."""
    return f"{abs(angle[-1] - angle[0]) / (2.0 * np.pi):.1f} turns on balance"


def orientation(run: PushRim) -> Orientation:
    """The signs of a recording, found from its own motion and moment.

    Forward is where the wheel goes on balance. A hand does work on a chair: where Mz and speed
    have one sign in the strong parts, Mz drives forward. Where no hand is at work Mz is left as
    it is. `gather` weighs all files of a wheel.
    """
    net = float(run.angle[-1] - run.angle[0])
    travel = -1 if net < -ROLLS else 1
    work = moment_work(run) * travel
    clear = abs(work) > CLEAR
    moment = -1 if clear and work < 0.0 else 1
    sides = {(-1, 1): "left", (1, -1): "right"} if clear and abs(net) > ROLLS else {}
    return Orientation(travel, moment, sides.get((travel, moment), ""), clear)


def moment_work(run: PushRim) -> float:
    """The share of the hand's work that is positive less that which is not, from -1 to 1.

    In the signs of the file; 0 where no moment is above 3 N m.
    """
    moment = run.torque - np.median(run.torque)
    strong = np.abs(moment) > max(PUSHES, 0.25 * float(np.abs(moment).max()))
    power = (moment * run.speed)[strong]
    total = float(np.abs(power).sum())
    return float(power.sum()) / total if total > 0.0 else 0.0


def turned(run: PushRim, signs: Orientation) -> PushRim:
    """The recording with forward positive; `absolute` stays as counted."""
    forces = run.forces * np.array([1.0, 1.0, 1.0, 1.0, 1.0, signs.moment])
    return replace(
        run,
        angle=frozen(signs.travel * run.angle),
        speed=frozen(signs.travel * run.speed),
        forces=frozen(forces),
    )


def without_moment(run: PushRim) -> str:
    """That Mz is one value throughout while the wheel or a force moves, in words; "": it is not."""
    rolled, forces = float(np.ptp(run.angle)), np.ptp(run.forces[:, :3], axis=0)
    most = int(np.argmax(forces))
    if np.ptp(run.torque) > 0.0 or (rolled < ROLLS and forces[most] == 0.0):
        return ""
    return (
        f"Mz is {run.torque[0]:.2f} N m in every sample, while {CHANNELS[most]} changes by "
        f"{forces[most]:.0f} N and the wheel turns by {rolled / (2.0 * np.pi):.1f} turns: its "
        "moment was not recorded; export it again"
    )


def at_its_end(run: PushRim) -> list[str]:
    """A line for each channel that stays at its largest or smallest value, as if it were cut."""
    out = []
    for name, values in zip(CHANNELS, run.forces.T, strict=True):
        away = np.abs(values - np.median(values)) > AWAY * np.ptp(values)
        for end in (float(values.max()), float(values.min())):
            at = (values == end) & away
            longest = max((after - first for first, after in stretches(at)), default=0)
            if at.mean() >= ENDS and longest >= IN_A_ROW:
                unit = "N" if name.startswith("F") else "N m"
                out.append(
                    f"{Path(run.source).name}: {name} is {end:.2f} {unit} in "
                    f"{per_cent(at.mean())} of the samples and never beyond: a sensor at its "
                    "end tells less than was there"
                )
    return out


def oriented(run: PushRim) -> PushRim:
    """The recording with the signs of `orientation`, and a note on what was turned."""
    signs = orientation(run)
    said = []
    if signs.travel < 0:
        said.append("its angle counts down as it rolls forward")
    if signs.moment < 0:
        said.append("its Mz is negative in a forward push")
    if not said:
        return run
    note = f"{Path(run.source).name}: {' and '.join(said)}; turned so that forward is positive"
    return replace(turned(run, signs), notes=(*run.notes, note))


def hand_force(run: PushRim) -> Array:
    """The hand's total force on the rim, (n,), N, of a recording without its baseline."""
    return np.asarray(np.linalg.norm(run.forces[:, :3], axis=1))


def push_inputs(run: PushRim) -> Inputs:
    """The measured moment as torque on both rear wheels.

    Only one wheel is instrumented; the other is assumed to get the same torque, so the chair goes
    straight whatever the person did.
    """
    torque = run.torque
    return Inputs(run.time, {"left_wheel": torque, "right_wheel": torque}, run.source)


def as_trial(run: PushRim, side: str, name: str) -> Trial:
    """The recording as a measured run: angle (rad) and torque (N m) of the wheel of that side."""
    return Trial(
        name=name,
        time=run.time,
        channels=MappingProxyType({f"{side}_wheel_angle": np.where(run.there, run.angle, np.nan)}),
        inputs=Inputs(run.time, {f"{side}_wheel": run.torque}, run.source),
        other=MappingProxyType({}),
    )
