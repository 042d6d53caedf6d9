"""Instruments of one trial on one clock, in one table.

In: instruments on their own clocks. Out: a `GatheredTrial` whose table has every sample that was
measured at its own time, so that slower instruments leave empty cells.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from scipy.signal import savgol_filter

from mjchair.errors import MjchairError
from mjchair.measurement import clocks, imu
from mjchair.measurement.clocks import Alignment, Signal
from mjchair.measurement.course import by_course
from mjchair.measurement.gather.instruments import RADIUS, Instrument, shifted
from mjchair.measurement.markers import SMOOTH
from mjchair.measurement.notes import Detail
from mjchair.simulation.table import SAME, Table, merged

Array = NDArray[np.float64]

LEAST = 1.0  # s, of a trial
GAP = 0.2  # s, in which the chair is not seen, beyond which its speed there is not known
ENOUGH = 4.0  # s, of the chair seen without a gap, that tell a clock alone
RESTS = 0.05  # rad/s of a wheel, below which the chair stands
TURNS = 0.03  # rad/s rms, of a turning by which sides are checked
HELD, IDLE = 0.2, 0.5  # s, N m: a torque that is not held so long, or smaller, pushes no chair
RADII = 0.02  # of a wheel's radius, by which it may be off that which it was set to; assumption
FREE = 0.1  # the same where nothing tells it
EARLY = (0.3, 1.0)  # s: a heading at the beginning is a mean over so long, and seen within so long


@dataclass(frozen=True)
class GatheredTrial:
    """One trial of a study.

    Attributes:
      name: of its table. time: (n,), s, the reference's clock. columns: study column -> (n,).
      manoeuvre: a word. alignments: file -> how its clock was put on the reference.
      instruments: on the reference's clock, for the picture. notes: one line each. begin: the
        reference's time at time zero of the table, s. heading: rad, at the first row, in the axes
        of all trials; None: nothing tells it. torque_estimated: whether the torque among the
        columns was made from the motion.
    """

    name: str
    time: Array
    columns: Mapping[str, Array]
    manoeuvre: str
    alignments: Mapping[str, Alignment] = field(default_factory=dict)
    instruments: tuple[Instrument, ...] = ()
    notes: tuple[str, ...] = ()
    begin: float = 0.0
    heading: float | None = None
    torque_estimated: bool = False

    @property
    def driven(self) -> bool:
        """Whether a wheel's torque is among the columns."""
        return bool({"left_wheel", "right_wheel"} & set(self.columns))


def join(
    name: str, instruments: Sequence[Instrument], agreed: Mapping[str, Alignment] | None = None
) -> GatheredTrial:
    """The trial of instruments that measured it.

    Args:
      agreed: file -> its alignment, where it is known; the others are found.

    Raises:
      MjchairError: clocks that cannot be aligned, or nothing that a study can use.
    """
    chosen = _reference(instruments)
    reference = _with_speed(chosen)
    ours, alignments, notes = [reference], {}, list(reference.notes)
    for other in sorted(instruments, key=lambda one: one.speed is None):
        if other is chosen:
            continue
        found = (agreed or {}).get(other.name) or _align(ours, other)
        alignments[other.name] = found
        said = Detail(f"{name}: clock of {other.name} on that of {reference.name}: {found.text()}")
        ours.append(shifted(other, found.to_reference(other.time), (said,)))
        notes += [*other.notes, said]
    ours, told = _frames(ours)
    notes += [*told, *_check_sides(name, ours)]
    begin, end = _span(ours)
    time, columns = _table(ours, begin, end)
    if not columns:
        raise MjchairError(f"trial {name!r}: its files hold no channel of a chair")
    if time[-1] - time[0] < LEAST:
        raise MjchairError(f"trial {name!r} lasts {time[-1] - time[0]:.2g} s; at least {LEAST:g} s")
    word = "push" if _is_pushed(time, columns) else "coast"
    return GatheredTrial(name, time, columns, word, alignments, tuple(ours), tuple(notes), begin)


def _is_pushed(time: Array, columns: Mapping[str, Array]) -> bool:
    """Whether a wheel has a torque that is more than the noise of its sensor, for HELD at least."""
    span = max(1, round(HELD / float(np.median(np.diff(time)))))
    torques = [columns[name] for name in ("left_wheel", "right_wheel") if name in columns]
    held = [np.convolve(np.nan_to_num(t), np.ones(span) / span, "valid") for t in torques]
    return any(np.abs(one).max(initial=0.0) > IDLE for one in held)


def _reference(instruments: Sequence[Instrument]) -> Instrument:
    """The instrument whose clock counts: with torque first, then with a wheel's motion."""

    def rank(one: Instrument) -> tuple[bool, bool, bool, float]:
        moving = one.speed is not None
        return bool(one.torque), moving and one.ground is None, moving, float(one.time[-1])

    return max(instruments, key=rank)


def _with_speed(one: Instrument) -> Instrument:
    """Markers, where nothing on a wheel tells it, also as a channel of the chair's speed."""
    if one.ground is None:
        return one
    return replace(one, channels={**one.channels, "velocity.x": one.ground})


def _align(ours: Sequence[Instrument], other: Instrument) -> Alignment:
    """How another clock goes with that of the instruments that are aligned."""
    reference = ours[0]
    if other.source.offset is not None:
        return Alignment(float(other.source.offset), 0.0, how="given")
    if reference.trigger is not None and other.trigger is not None:
        first, second = (float(np.median(np.diff(one.time))) for one in (reference, other))
        spread = float(np.hypot(first, second) / np.sqrt(12.0))
        return Alignment(reference.trigger - other.trigger, spread, how="trigger")
    try:
        found = _by_motion(ours, other)
    except MjchairError as error:
        which = "" if other.name in str(error) else f"{other.name}: "
        raise MjchairError(f"{which}{error}{_assumed(reference, other)}") from None
    if found.drift != 0.0:
        return found
    return _by_course(reference, other, found) or found


def _assumed(*pair: Instrument) -> str:
    """What a line on clocks must say of rates that are assumed."""
    read = [f"{one.name} is read at {one.assumed:g} Hz" for one in pair if one.assumed is not None]
    if not read:
        return ""
    return f"; {' and '.join(read)}, which is assumed; give its rate with --mapping"


def _by_motion(ours: Sequence[Instrument], other: Instrument) -> Alignment:
    """The alignment by the motion that two instruments share."""
    reference = ours[0]
    names = (reference.name, other.name)
    if reference.speed is None:
        raise MjchairError(
            f"the clocks of {names[0]} and {names[1]} cannot be aligned: neither shows how a wheel "
            f"turns; give the offset of {names[1]} with --offset FILE=SECONDS"
        )
    if other.speed is not None:
        one, two = _of_wheels(ours, other)
        found = clocks.best_alignment(one, two)
        if found.clear:
            return found
        two = _in_unit_of(reference, other, _course(other))
        return clocks.align_slowing(_course(reference), two) or clocks.align(one, two, names)
    ahead = other.channels.get("imu_accelerometer.x")
    if ahead is not None:
        there = np.isfinite(ahead)
        return clocks.align(_gained(ours), Signal(other.time[there], ahead[there, None]), names)
    if other.accelerometer is None:
        raise MjchairError(
            f"the clocks of {names[0]} and {names[1]} cannot be aligned: {names[1]} shows no "
            "motion along the way; give its offset with --offset FILE=SECONDS"
        )
    level = (other.accelerometer @ imu.upright(other.accelerometer).T)[:, :2]
    return clocks.align(_gained(ours), Signal(other.time, level), names)


def _by_course(reference: Instrument, other: Instrument, start: Alignment) -> Alignment | None:
    """The same by how far both went all along the run, where that is surer; None where it is not.

    A speed of markers is smoothed; it is compared with the reference as it is, and smoothed alike.
    """
    if reference.speed is None or other.speed is None:
        return None
    one, two = _turned(reference), _turned(other)
    two = _in_unit_of(reference, other, two)
    unlike = clocks.UNLIKE
    if (reference.ground is None) != (other.ground is None):
        wheel = reference if reference.ground is None else other
        unlike = RADII if wheel.radius is not None else FREE
    courses = [one]
    if other.ground is not None and reference.ground is None:
        courses.append(_smoothed(one))
    found = [by_course(course, two, start, unlike, clocks.UNLIKE) for course in courses]
    surer = [a for a in found if a is not None and a.offset_std < start.offset_std]
    return min(surer, key=lambda a: a.offset_std, default=None)


def _turned(one: Instrument) -> Signal:
    """How far a wheel has turned, rad; of markers, the chair's way over the usual radius."""
    angle = one.channels.get(f"{one.side}_wheel_angle")
    if angle is not None and one.ground is None:
        there = np.isfinite(angle)
        return Signal(one.time[there], angle[there])
    time, speed = _course(one)
    return Signal(time, cumulative_trapezoid(speed, time, initial=0.0))


def _smoothed(course: Signal) -> Signal:
    """A course of even samples whose speed is smoothed as that of markers is."""
    step = float(np.median(np.diff(course.time)))
    time = np.arange(course.time[0], course.time[-1], step)
    width = 2 * max(2, round(SMOOTH / step)) + 1
    if width > time.size:
        return course
    even = np.interp(time, course.time, course.values)
    speed = savgol_filter(even, width, 2, deriv=1, delta=step)
    return Signal(time, cumulative_trapezoid(speed, dx=step, initial=0.0))


def heading_at(instruments: Sequence[Instrument], begin: float) -> float | None:
    """Where the chair faces in the laboratory, rad, as a trial begins (s); None: nothing tells."""
    for one in instruments:
        if one.facing is None:
            continue
        seen = np.isfinite(one.facing) & (one.time >= begin) & (one.time <= begin + EARLY[1])
        if seen.any():
            first = one.time[seen][0]
            early = one.facing[seen & (one.time <= first + EARLY[0])]
            return float(np.angle(np.exp(1j * early).mean()))
    return None


def _of_wheels(ours: Sequence[Instrument], other: Instrument) -> tuple[Signal, Signal]:
    """What two wheels' instruments have in common: one wheel's speed, or the pushes of both hands.

    Wheels on two sides turn differently in a bend, and both hands push at once.
    """
    twin = next((one for one in ours if one.side == other.side and one.speed is not None), None)
    one = twin or ours[0]
    if twin is None and one.torque and other.torque:
        first, second = (next(iter(w.torque.values())) for w in (one, other))
        return Signal(one.time, first), Signal(other.time, second)
    return _course(one), _course(other)


def _course(one: Instrument) -> Signal:
    """The speed of a wheel; of markers, where the chair is seen longest without a gap."""
    assert one.speed is not None
    if one.ground is None:
        return Signal(one.time, one.speed)
    seen = np.flatnonzero(one.seen)
    parts = np.split(seen, np.flatnonzero(np.diff(one.time[seen]) > GAP) + 1)
    longest = max(parts, key=len)
    if np.ptp(one.time[longest]) < ENOUGH:
        longest = np.arange(one.time.size)
    return Signal(one.time[longest], one.speed[longest])


def _in_unit_of(reference: Instrument, other: Instrument, speed: Signal) -> Signal:
    """The speed of another instrument; of markers, as that of the reference's wheel."""
    if other.ground is None or reference.radius is None:
        return speed
    return Signal(speed.time, speed.values * RADIUS / reference.radius)


def _gained(ours: Sequence[Instrument]) -> Signal:
    """How the wheels speed up, rad/s^2."""
    time, speed = _rolls(ours)
    return Signal(time, np.gradient(speed, time))


def _rolls(ours: Sequence[Instrument]) -> Signal:
    """How fast the wheels turn, rad/s; the mean of the sides that are there."""
    time = ours[0].time
    moving = [one for one in ours if one.speed is not None]
    moving = [one for one in moving if one.ground is None] or moving
    sides = {one.side: one for one in reversed(moving)}
    speeds = [np.interp(time, w.time, w.speed) for w in sides.values() if w.speed is not None]
    return Signal(time, np.mean(speeds, axis=0))


def _frames(ours: list[Instrument]) -> tuple[list[Instrument], list[str]]:
    """Sensors on the frame, turned to the chair's axes; a second one is left out."""
    out: list[Instrument] = []
    notes: list[str] = []
    for one in ours:
        if one.gyroscope is None:
            out.append(one)
        elif one.accelerometer is None:
            notes.append(f"{one.name}: without an accelerometer its axes are not known; left out")
        elif any(other.gyroscope is not None for other in out):
            notes.append(f"{one.name}: a second sensor on the frame; it is left out")
        else:
            turned, said = _frame(one, ours)
            out.append(turned)
            notes += said
    return out, notes


def _frame(one: Instrument, ours: Sequence[Instrument]) -> tuple[Instrument, list[str]]:
    """A sensor on the frame in the chair's axes, without its gyroscope's offset."""
    assert one.gyroscope is not None and one.accelerometer is not None
    moving = [w for w in ours if w.speed is not None]
    rest = _at_rest(one.time, moving)
    gyroscope, notes = imu.without_offset(one.time, one.gyroscope, rest, one.name)
    wheels = _rolls(ours) if moving else None
    sits = imu.mounting(one.time, one.accelerometer, gyroscope, wheels, rest)
    how = "as the wheels speed up" if sits.told else "the level axis that varies most, assumed"
    rows = [
        f"{a} ({', '.join(f'{v:+.2f}' for v in r)})" for a, r in zip("xyz", sits.axes, strict=True)
    ]
    place = f"{one.name}: on the frame; forward is {how}; the chair's axes in its own: "
    notes.append(Detail(place + "; ".join(rows)))
    channels = dict(one.channels)
    for i, axis in enumerate("xyz"):
        channels[f"imu_gyro.{axis}"] = gyroscope @ sits.axes[i]
        channels[f"imu_accelerometer.{axis}"] = one.accelerometer @ sits.axes[i]
    return replace(one, channels=channels), notes


def _at_rest(time: Array, wheels: Sequence[Instrument]) -> NDArray[np.bool_]:
    """Where (n,) every wheel that is recorded at a time (s) rests, and at least one is recorded."""
    rest, seen = np.ones(time.size, bool), np.zeros(time.size, bool)
    for wheel in wheels:
        assert wheel.speed is not None
        speed = np.interp(time, wheel.time, wheel.speed, left=np.nan, right=np.nan)
        seen |= np.isfinite(speed)
        rest &= ~(np.abs(speed) >= RESTS)
    return rest & seen


def _check_sides(name: str, ours: Sequence[Instrument]) -> list[str]:
    """Whether the gyroscope sees the turns that the two wheels make."""
    wheels = {w.side: w for w in ours if w.speed is not None and w.side}
    frame = next((one for one in ours if "imu_gyro.z" in one.channels), None)
    if len(wheels) < 2 or frame is None:
        return []
    speeds = {
        side: np.interp(frame.time, w.time, w.speed)
        for side, w in wheels.items()
        if w.speed is not None
    }
    left, right = speeds["left"], speeds["right"]
    yaw, turn = frame.channels["imu_gyro.z"], right - left
    if np.std(yaw) < TURNS:
        return []
    match = float(np.corrcoef(yaw, turn)[0, 1])
    if match < -0.5:
        raise MjchairError(
            f"trial {name!r}: the gyroscope turns left where {wheels['left'].name} (left wheel) "
            f"and {wheels['right'].name} (right wheel) turn right (correlation {match:.2f}); "
            "the sides of the wheels are swapped: name them, or say it in gather.toml"
        )
    if match < 0.5:
        return [f"{name}: the gyroscope does not tell the sides of the wheels ({match:.2f})"]
    said = f"{name}: the gyroscope confirms the sides of the wheels (correlation {match:.2f})"
    return [Detail(said)]


def _span(ours: Sequence[Instrument]) -> tuple[float, float]:
    """Begin and end of the recording of the reference, and of every torque, s."""
    whole = [ours[0], *(one for one in ours if one.torque)]
    return max(float(one.time[0]) for one in whole), min(float(one.time[-1]) for one in whole)


def _table(ours: Sequence[Instrument], begin: float, end: float) -> tuple[Array, dict[str, Array]]:
    """All samples within a span of the reference's clock, each in the row of its own time."""
    tables: list[Table] = []
    for one in ours:
        inside = (one.time >= begin - SAME) & (one.time <= end + SAME)
        columns = {
            name: values[inside]
            for name, values in {**one.torque, **one.channels}.items()
            if np.isfinite(values[inside]).any() and not any(name in t.columns for t in tables)
        }
        if columns:
            tables.append(Table(one.time[inside] - begin, columns, one.name))
    if not tables:
        return np.zeros(1), {}
    table = merged(tables)
    order = sorted(table.columns, key=lambda n: (n not in ("left_wheel", "right_wheel"), n))
    return table.time, {name: table.columns[name] for name in order}
