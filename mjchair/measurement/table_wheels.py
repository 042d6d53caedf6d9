"""Wheels in a table of one's own: angles counted through their wraps, and signs that drive forward.

In: the columns of a table, SI, and its clock. Out: the same columns, put right, without samples
that are no measurement, and a line for everything that was changed or is left open. A hand that
drives a wheel forward speeds it up, so torque and speed of one wheel have one sign where they go
together; which way is forward, two wheels that roll straight tell together. A chair that turns on
the spot looks like a wheel that counts down: only a turn that nobody makes is taken for one.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from mjchair.errors import MjchairError
from mjchair.measurement import encoder
from mjchair.measurement.lost_samples import table_without_lost
from mjchair.model.rolling import RearAxle

Array = NDArray[np.float64]

SMOOTH = 0.1  # s, of the local parabola that turns a table's angle into speed
FASTEST = 50.0  # rad/s: 15 m/s on a wheel of 0.3 m, faster than any wheelchair is raced
NEARLY = 0.7  # of a turn, which a step between two samples must reach to be a wrap
WITHIN = 1.02  # turns, in which an angle that wraps stays
TOLD = 0.3  # correlation of torque and acceleration, beyond which their signs are told
PUSHES = 3.0  # N m, which a torque must range over to tell a sign
ROLLS = 1.0  # rad, of which a wheel must turn on balance to tell which way is forward
SPUN = 40.0  # rad of both wheels in opposite ways: 7 turns of the chair on the spot; assumption
ALIKE = 0.2  # within which two wheels of a straight way turn by the same
YAW = 0.5  # rad of the chair for a rad by which its wheels turn apart: 0.3 m over 0.56 m
SEEN, UNSEEN = 0.5, 0.25  # of the turn that wheels tell, which a gyroscope sees, or does not
RATE = 100.0  # Hz, at which torque and acceleration are compared at most
SIDES = ("left", "right")
FEWEST = 3  # rows, of which two steps tell how a speed changes
USUAL = RearAxle(0.3, 0.3, 0.56)  # m, of a chair that nobody described: wheels of 24 inches


class _Wheel(NamedTuple):
    """How far a wheel turns on balance, rad, and how its torque goes with its acceleration."""

    net: float
    match: float


def put_right(
    time: Array, columns: Mapping[str, Array], name: str, turn: bool = True
) -> tuple[dict[str, Array], list[str]]:
    """The columns with angles that go on and wheels that drive forward, and lines on it.

    What is no measurement, such as a code for missing samples, is left out before.

    Args:
      time: (n,), s. columns: study column -> (n,), SI, NaN where a sample is missing. name: of the
        file. turn: whether signs may be turned; False: what is doubtful is only said.

    Raises:
      MjchairError: fewer than FEWEST rows, or a column without a sample.
    """
    if time.size < FEWEST:
        raise MjchairError(f"{name}: {few_rows(time.size)}")
    for column, values in columns.items():
        if not np.isfinite(values).any():
            raise MjchairError(f"{name}: {column} has no samples; leave the column out")
    clean, lost = table_without_lost(time, columns, name, USUAL)
    out, notes = unwrapped(time, clean, name)
    notes = lost + notes
    for side, travel, moment in _signs(time, out, name, turn, notes):
        for column, sign in (("angle", travel), ("speed", travel), ("", moment)):
            whole = f"{side}_wheel_{column}".rstrip("_")
            if whole in out:
                out[whole] = sign * out[whole]
    return out, notes


def few_rows(count: int) -> str:
    """What is wrong with a table of so few rows, in words."""
    rows = "1 row of numbers" if count == 1 else f"{count} rows of numbers"
    return f"{rows}; a motion takes at least {FEWEST}, and a trial lasts at least 1 s"


def unwrapped(
    time: Array, columns: Mapping[str, Array], name: str
) -> tuple[dict[str, Array], list[str]]:
    """The columns with angles of wheels that go on, and a line for each that wrapped.

    Args:
      time, columns, name: see `put_right`.
    """
    out, notes = dict(columns), []
    for column in (f"{side}_wheel_angle" for side in SIDES):
        if column in out and wraps(time, out[column]):
            out[column] = _counted_on(time, out[column])
            notes.append(f"{name}: {column} wraps once a turn; it is counted on")
    return out, notes


def wraps(time: Array, angle: Array) -> bool:
    """Whether an angle (n,) rad on a clock (n,) s steps back by a turn where a wheel goes on."""
    there = np.isfinite(angle)
    if there.sum() < 2 or np.ptp(angle[there]) > WITHIN * encoder.TURN:
        return False
    steps, spans = np.abs(np.diff(angle[there])), np.diff(time[there])
    return bool(np.any((steps > NEARLY * encoder.TURN) & (steps > FASTEST * spans)))


def _counted_on(time: Array, angle: Array) -> Array:
    """An angle (n,) rad without its wraps; across a gap by the speed on both sides of it."""
    there = np.flatnonzero(np.isfinite(angle))
    steps = np.diff(encoder.unwrapped(angle[there]))
    spans, middles = np.diff(time[there]), 0.5 * (time[there][1:] + time[there][:-1])
    short = spans < 1.5 * np.median(spans)
    due = np.interp(middles, middles[short], steps[short] / spans[short]) * spans
    turns = np.where(short, 0.0, np.round((due - steps) / encoder.TURN))
    out = angle.copy()
    out[there[1:]] = angle[there[0]] + np.cumsum(steps + turns * encoder.TURN)
    return out


def motion(time: Array, columns: Mapping[str, Array], side: str) -> Array | None:
    """The speed (n,) rad/s of the wheel of a side, by its column or its angle; None: neither."""
    if f"{side}_wheel_speed" in columns:
        return _filled(time, columns[f"{side}_wheel_speed"])
    if f"{side}_wheel_angle" in columns:
        return rate(time, _filled(time, columns[f"{side}_wheel_angle"]))
    return None


def rate(time: Array, values: Array) -> Array:
    """How fast (n,) values of even samples change, 1/s, by a local parabola over 0.1 s."""
    step = float(np.median(np.diff(time)))
    window = min(2 * max(1, round(0.5 * SMOOTH / step)) + 1, 2 * ((time.size - 1) // 2) + 1)
    if window < 5:
        return np.asarray(np.gradient(values, time))
    return np.asarray(savgol_filter(values, window, 2, deriv=1, delta=step))


def _filled(time: Array, values: Array) -> Array:
    there = np.isfinite(values)
    return np.interp(time, time[there], values[there])


def _signs(
    time: Array, columns: Mapping[str, Array], name: str, turn: bool, notes: list[str]
) -> list[tuple[str, int, int]]:
    """Each side with the signs of its motion and its torque; lines are added to the notes."""
    found = {side: _wheel(time, columns, side) for side in SIDES}
    wheels = {side: wheel for side, wheel in found.items() if wheel is not None}
    spun = _spun(time, columns, wheels)
    out = []
    for side, wheel in wheels.items():
        other = wheels.get("left" if side == "right" else "right")
        travel, moment, said = _turned(wheel, other, spun)
        if said:
            notes.append(_line(name, side, said, turn, (travel, moment) != (1, 1)))
        out.append((side, travel, moment))
    return out if turn else []


def _line(name: str, side: str, said: str, turn: bool, told: bool) -> str:
    """A line on a wheel whose signs are turned, believed although they look wrong, or in doubt."""
    if not told:
        return f"{name}: {side} wheel {said}"
    if not turn:
        return f"{name}: {side} wheel {said}; its mapping is believed, is a sign = -1 missing?"
    return f"{name}: {side} wheel {said}; turned so that forward is positive"


def _spun(time: Array, columns: Mapping[str, Array], wheels: Mapping[str, _Wheel]) -> bool | None:
    """Whether a gyroscope in the table sees the turn that two wheels tell; None: it is open."""
    yaw = columns.get("imu_gyro.z")
    if yaw is None or len(wheels) < 2:
        return None
    told = YAW * (wheels["right"].net - wheels["left"].net)
    if abs(told) <= ROLLS:
        return None
    share = float(np.trapezoid(_filled(time, yaw), time)) / told
    if share > SEEN:
        return True
    return False if abs(share) < UNSEEN else None


def _turned(wheel: _Wheel, other: _Wheel | None, spun: bool | None) -> tuple[int, int, str]:
    """Signs of a wheel's motion and torque, and what was seen; empty: they are right."""
    against = wheel.match < -TOLD
    if wheel.net >= -ROLLS:
        return (1, -1, "slows down where its torque drives it") if against else (1, 1, "")
    if against:
        return -1, 1, "counts down where its torque drives it"
    if other is None or other.net <= ROLLS:
        return 1, 1, "rolls backwards on balance; if it went forward, turn its signs in a mapping"
    if spun:
        return 1, 1, ""
    less, more = sorted((-wheel.net, other.net))
    if spun is False or (less > SPUN and more - less < ALIKE * more):
        said = "counts down as the other one counts up (a chair that spun: give signs by a mapping)"
        return -1, -1 if wheel.match > TOLD else 1, said
    doubt = "it is left as it is; if it rolled straight, turn its signs in a mapping"
    return 1, 1, f"turns against the other one, as on the spot; {doubt}"


def _wheel(time: Array, columns: Mapping[str, Array], side: str) -> _Wheel | None:
    """What a wheel's columns tell of its signs; None: they do not show its motion."""
    even = np.arange(time[0], time[-1], max(float(np.median(np.diff(time))), 1.0 / RATE))
    names = [name for name in columns if name.startswith(f"{side}_wheel")]
    mine = {name: np.interp(even, time, _filled(time, columns[name])) for name in names}
    speed = motion(even, mine, side) if even.size > 2 else None
    if speed is None:
        return None
    net = float(np.trapezoid(speed, even))
    drive, gained = mine.get(f"{side}_wheel", np.zeros(even.size)), rate(even, speed)
    if np.ptp(drive) < PUSHES or np.std(gained) == 0.0:
        return _Wheel(net, 0.0)
    return _Wheel(net, float(np.corrcoef(drive, gained)[0, 1]))
