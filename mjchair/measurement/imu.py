"""Where an inertial sensor sits on a wheelchair, and what it says of the chair.

In: gyroscope and accelerometer in the sensor's own axes. Out: the turning speed of the wheel that
it sits on, or its signals in the chair's axes: z up from gravity, x forward from the axis along
which the chair speeds up as its wheels do. A sensor on the body of the person is none of these.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mjchair.errors import MjchairError
from mjchair.measurement.notes import Detail

Array = NDArray[np.float64]

GRAVITY = 9.80665
SPINS = 2.0  # rad/s, rms about one axis, above which a sensor sits on a wheel
AXLE = 0.9  # share of the turning that must be about that axis
STILL = 0.05  # rad/s, below which a sensor may stand still
STILL_SPAN = 0.5  # s, over which it must
LEVEL = (0.8, 1.2)  # of gravity: what a sensor that stands shows


class Mounting(NamedTuple):
    """How a sensor on the frame sits: rows are the chair's axes in the sensor's, (3, 3).

    Attributes:
      axes: x forward, y left, z up. told: whether forward was told by the wheels, not assumed.
    """

    axes: Array
    told: bool


def still(time: Array, gyroscope: Array) -> NDArray[np.bool_]:
    """Which samples (n,) of a sensor on a wheel belong to half a second or more at rest."""
    rate = 1.0 / float(np.median(np.diff(time)))
    span = max(3, round(STILL_SPAN * rate))
    quiet = (np.abs(gyroscope) < 3.0 * STILL).all(axis=1)
    run = np.convolve(quiet, np.ones(span), "valid") == span
    out = np.zeros(time.size, bool)
    for first in np.flatnonzero(run):
        out[first : first + span] = True
    return out


def without_offset(
    time: Array, gyroscope: Array, rest: NDArray[np.bool_], name: str
) -> tuple[Array, list[str]]:
    """The gyroscope (n, 3) without what it shows at rest, and a note on it.

    Args:
      time: (n,), s. gyroscope: (n, 3), rad/s. rest: (n,), where the sensor stands. name: of the
        sensor, for the note.
    """
    if rest.sum() < 3:
        return gyroscope, [f"{name}: it never stands, so the gyroscope's offset stays on"]
    offset = np.median(gyroscope[rest], axis=0)
    text = ", ".join(f"{value:+.4f}" for value in offset)
    lasts = rest.sum() * float(np.median(np.diff(time)))
    said = f"gyroscope offset {text} rad/s taken off, from {lasts:.1f} s at rest"
    return gyroscope - offset, [Detail(f"{name}: {said}")]


def in_si(accelerometer: Array, source: str) -> tuple[Array, str]:
    """The accelerometer in m/s^2, and a note where it was in g.

    Raises:
      MjchairError: gravity is not in it.
    """
    size = float(np.median(np.linalg.norm(accelerometer, axis=1)))
    if LEVEL[0] < size < LEVEL[1]:
        said = f"{source}: its accelerometer shows 1 at rest; it is in g"
        return accelerometer * GRAVITY, Detail(said)
    if not LEVEL[0] * GRAVITY < size < LEVEL[1] * GRAVITY:
        raise MjchairError(
            f"{source}: its accelerometer shows {size:.2f} m/s^2 at rest, and gravity is 9.81; "
            "give the unit in the mapping, and signals with gravity in them"
        )
    return accelerometer, ""


def axle(gyroscope: Array) -> Array | None:
    """The axis (3,) about which a sensor on a wheel turns; None for one that is on no wheel."""
    size = np.sqrt(np.mean(gyroscope**2, axis=0))
    _, strength, axes = np.linalg.svd(gyroscope, full_matrices=False)
    share = strength[0] ** 2 / max(float(np.sum(strength**2)), 1e-30)
    if np.linalg.norm(size) < SPINS or share < AXLE:
        return None
    axis = axes[0]
    return np.asarray(axis * np.sign(np.sum(gyroscope @ axis)))


def upright(accelerometer: Array, rest: NDArray[np.bool_] | None = None) -> Array:
    """Three axes (3, 3) of the sensor: z up by gravity, x and y anywhere level.

    Args:
      accelerometer: (n, 3), m/s^2. rest: (n,), where it stands, which tells gravity best; None, or
        nowhere: the median of all samples, which leans by what the chair gains or loses speed.
    """
    stands = rest is not None and rest.sum() >= 3
    up = np.median(accelerometer[rest] if stands else accelerometer, axis=0)
    up = up / np.linalg.norm(up)
    first = np.eye(3)[int(np.argmin(np.abs(up)))]
    x = first - up * (up @ first)
    x = x / np.linalg.norm(x)
    return np.stack([x, np.cross(up, x), up])


def mounting(
    time: Array,
    accelerometer: Array,
    gyroscope: Array,
    wheels: tuple[Array, Array] | None,
    rest: NDArray[np.bool_] | None = None,
) -> Mounting:
    """How a sensor on the frame sits.

    A chair on wheels is accelerated forward as its wheels speed up, and to the left by its speed
    times its yaw rate. Forward is where both fit best, by one angle.

    Args:
      time: (n,), s. accelerometer: (n, 3), m/s^2. gyroscope: (n, 3), rad/s. wheels: times (s) on
        the same clock and the wheels' speed there, any unit; None: forward is the level axis that
        varies most.
      rest: (n,), where the chair stands; None: not known.
    """
    axes = upright(accelerometer, rest)
    level = (accelerometer @ axes.T)[:, :2]
    level = level - level.mean(axis=0)
    if wheels is not None:
        gains, aside = _accelerations(time, gyroscope @ axes[2], wheels)
        forward = level.T @ gains + (level[:, ::-1] * [1.0, -1.0]).T @ aside
    else:
        forward = np.linalg.svd(level, full_matrices=False)[2][0]
    forward = forward / np.linalg.norm(forward)
    x = forward @ axes[:2]
    return Mounting(np.stack([x, np.cross(axes[2], x), axes[2]]), wheels is not None)


def _accelerations(
    time: Array, yaw_rate: Array, wheels: tuple[Array, Array]
) -> tuple[Array, Array]:
    """Acceleration (n,) forward and to the left without their means, in the wheels' unit a second.

    They are 0 where the wheels are not recorded.
    """
    clock, speed = wheels
    recorded = (time >= clock[0]) & (time <= clock[-1])
    gains = np.interp(time, clock, np.gradient(speed, clock)) * recorded
    aside = np.interp(time, clock, speed) * yaw_rate * recorded
    return gains - gains.mean(), aside - aside.mean()
