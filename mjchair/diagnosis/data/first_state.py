"""How a run begins: place, heading, speed and yaw rate at its first sample.

In: a run's channels, what study.toml gives, and the rear axle of the chair. Out: an `Initial`. It
is a first guess only, since every window frees its state.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis.data.study import Run
from mjchair.measurement.sensors import sensor
from mjchair.model.rolling import RearAxle
from mjchair.simulation.initial import Initial

Array = NDArray[np.float64]
STANDS = (0.03, 0.05)  # m/s and rad/s, below which a chair stands
SIDES = ("left", "right")
KINDS = ("speed", "angle")  # of a wheel's channels
SPAN = 0.3  # s, of the line through the first samples
CHORD = 0.5  # m, of the way at whose start the heading is read off


def _first(run: Run, channel: str) -> tuple[float, float] | None:
    """Value and slope at the first sample, from a line over the first SPAN; None: not there."""
    if channel not in run.trial.channels:
        return None
    time, values = run.trial.samples(channel)
    early = time <= run.trial.time[0] + SPAN
    if early.sum() < 2:
        return None
    if sensor(channel).wraps:
        values = np.unwrap(values)
    slope, value = np.polyfit(time[early] - run.trial.time[0], values[early], 1)
    return float(value), float(slope)


def observed(run: Run) -> NDArray[np.bool_]:
    """Which of the first seven slow states (chair_state.SLOW) a run's channels see, (7,)."""
    have = set(run.trial.channels)
    place = {"position.x", "position.y"} <= have
    wheels = {f"{side}_wheel_{kind}" for side in SIDES for kind in KINDS}
    rolls = bool(have & {*wheels, "velocity.x"})
    both = any({f"left_wheel_{kind}", f"right_wheel_{kind}"} <= have for kind in KINDS)
    return np.array(
        [
            "position.x" in have,
            "position.y" in have,
            "heading" in have or place,
            rolls or place,
            "imu_gyro.z" in have or both or "heading" in have,
            "left_caster_angle" in have,
            "right_caster_angle" in have,
        ]
    )


def initial(run: Run, axle: RearAxle) -> Initial:
    """Position, heading, speed and yaw rate at the first sample.

    What study.toml gives is a first guess as well: every window frees it.

    Args:
      axle: of the chair, which turns wheel speeds into the chair's.
    """
    start = run.initial
    heading = initial_heading(run, axle)
    x, y = _value(run, "position.x", None), _value(run, "position.y", None)
    position = start.position if x is None or y is None else (x, y)
    speed = start.speed if "speed" in run.given else _speed(run, axle)
    yaw = start.yaw_rate if "yaw_rate" in run.given else _yaw_rate(run, axle)
    if "speed" not in run.given and abs(speed) < STANDS[0] and abs(yaw) < STANDS[1]:
        speed = yaw = 0.0
    return Initial(position=position, heading=heading or 0.0, speed=speed, yaw_rate=yaw)


def initial_heading(run: Run, axle: RearAxle) -> float | None:
    """Heading at the first sample, rad: measured, given, or where the chair goes; None: unknown."""
    given = run.initial.heading if "heading" in run.given else _heading(run, axle)
    return _value(run, "heading", given)


def _heading(run: Run, axle: RearAxle) -> float | None:
    """Where the chair goes at first, rad, from its places; None: not measured, or it stays there.

    The chord of an arc leans by half of what was turned along it; a chair that rolls backward
    heads the other way.
    """
    if not {"position.x", "position.y"} <= set(run.trial.channels):
        return None
    (time, x), (when, y) = (run.trial.samples(f"position.{axis}") for axis in "xy")
    x, y = x - x[:5].mean(), np.interp(time, when, y) - y[:5].mean()
    far = np.flatnonzero(np.hypot(x, y) > CHORD)
    if not far.size:
        return None
    k = int(far[0])
    back = np.pi if _rolls(run) < 0.0 else 0.0
    turned = _yaw_rate(run, axle) * (time[k] - time[0])
    return float(np.angle(np.exp(1j * (np.arctan2(y[k], x[k]) - 0.5 * turned + back))))


def _rolls(run: Run) -> float:
    """Mean of what the first wheel with a channel turns, forward positive; 1 where none has."""
    for side in ("left", "right"):
        if f"{side}_wheel_speed" in run.trial.channels:
            return float(np.mean(run.trial.samples(f"{side}_wheel_speed")[1]))
        if f"{side}_wheel_angle" in run.trial.channels:
            angle = run.trial.samples(f"{side}_wheel_angle")[1]
            return float(angle[-1] - angle[0])
    return 1.0


def _value(run: Run, channel: str, given: float | None) -> float | None:
    line = _first(run, channel)
    return given if line is None else line[0]


def _speed(run: Run, axle: RearAxle) -> float:
    wheels = {s: _first(run, f"{s}_wheel_speed") for s in SIDES}
    seen = [w[0] * axle.radius(s) for s, w in wheels.items() if w is not None]
    if seen:
        return float(np.mean(seen))
    forward = _first(run, "velocity.x")
    if forward is not None:
        return forward[0]
    angles = {s: _first(run, f"{s}_wheel_angle") for s in SIDES}
    seen = [w[1] * axle.radius(s) for s, w in angles.items() if w is not None]
    if seen:
        return float(np.mean(seen))
    x, y = _first(run, "position.x"), _first(run, "position.y")
    if x is not None and y is not None:
        known = initial_heading(run, axle)
        heading = float(np.arctan2(y[1], x[1])) if known is None else known
        return float(x[1] * np.cos(heading) + y[1] * np.sin(heading))
    return _speed_from_acceleration(run)


def _speed_from_acceleration(run: Run) -> float:
    """A chair that stands at the end of its run lost the speed that its accelerometer tells."""
    if "imu_accelerometer.x" not in run.trial.channels:
        return 0.0
    time, pull = run.trial.samples("imu_accelerometer.x")
    late = time > time[-1] - 0.5
    still = pull[late].std() < 0.7 * max(pull.std(), 1e-9) or abs(pull[late].mean()) < 0.02
    bias = float(pull[late].mean()) if still else 0.0
    lost = -float(np.trapezoid(pull - bias, time))
    return float(np.clip(lost, 0.0, 5.0)) if still and lost > 0.2 else 1.0


def stops(run: Run) -> float | None:
    """When a run whose speed no channel sees comes to rest, s; None: it is seen, or never rests.

    A coasting chair's accelerometer falls to nothing as it stops.
    """
    if observed(run)[3] or "imu_accelerometer.x" not in run.trial.channels:
        return None
    time, pull = run.trial.samples("imu_accelerometer.x")
    width = max(3, round(0.2 / max(float(np.median(np.diff(time))), 1e-4)))
    smooth = np.convolve(pull, np.ones(width) / width, mode="same")
    size = float(np.median(np.abs(smooth[: max(3, smooth.size // 3)])))
    moving = np.flatnonzero(np.abs(smooth) > 0.5 * size)
    if not moving.size or time[-1] - time[moving[-1]] < 0.7:
        return None
    return float(time[moving[-1]])


def _yaw_rate(run: Run, axle: RearAxle) -> float:
    gyro = _first(run, "imu_gyro.z")
    if gyro is not None:
        return gyro[0]
    for line, kind in enumerate(KINDS):  # the value of a speed, the slope of an angle
        left, right = (_first(run, f"{side}_wheel_{kind}") for side in SIDES)
        if left is not None and right is not None:
            return (right[line] * axle.right - left[line] * axle.left) / axle.track
    heading = _first(run, "heading")
    return heading[1] if heading is not None else 0.0
