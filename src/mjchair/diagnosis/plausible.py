"""Whether measured channels can be in the units that they are taken for.

Three ways to know: no chair is that fast; two channels tell one story in two units; a level
accelerometer shows gravity.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from typing import NamedTuple, NoReturn

import numpy as np

from mjchair.diagnosis.ingest import averaged
from mjchair.errors import MjchairError
from mjchair.measurement.trial import Trial
from mjchair.simulation.table import Array

RADIUS, TRACK = 0.3, 0.56  # m, of the rear wheels, to compare channels with one another
DEGREES, GRAVITY = 180.0 / np.pi, 9.81
LIMITS = {  # the most that a wheelchair shows, SI: 10 m/s, and a spin twice that of sports
    "wheel_speed": (35.0, "deg/s"),
    "gyro": (12.0, "deg/s"),
    "accelerometer": (80.0, ""),
    "velocity": (15.0, ""),
    "caster_angle": (13.0, "deg"),
}
RATES = {"wheel_angle": 35.0, "heading": 12.0}  # rad/s, the fastest that an angle changes
TORQUE = 500.0  # N m, the most that a hand or a motor gives
TURN = 2.0 * np.pi + 0.2  # rad, within which a heading begins
NEAR = 1.3  # factor within which two stories differ by a unit
ALIKE = 0.95  # cosine of two stories that are one
FORWARD, YAW, PULL = 0.05, 0.03, 0.05  # m/s, rad/s and m/s: motion below which nothing is compared


class Story(NamedTuple):
    """What a channel says of one motion: times (s), values (SI if its unit is), unit to advise."""

    time: Array
    values: Array
    unit: str


def check(trial: Trial) -> None:
    """Refuse channels in other units than SI, where that can be known.

    Raises:
      MjchairError: naming the channel and what it looks like.
    """
    _check_limits(trial)
    _check_rates(trial)
    _check_torque(trial)
    _check_gravity(trial)
    _compare(trial, _forward(trial), FORWARD)
    _compare(trial, _turning(trial), YAW)
    _compare_with_acceleration(trial)


def check_initial(given: Mapping[str, object], name: str) -> None:
    """Refuse a first heading in degrees.

    Raises:
      MjchairError: a heading of more than a turn.
    """
    heading = given.get("heading", 0.0)
    if isinstance(heading, int | float) and abs(heading) > TURN:
        raise MjchairError(
            f"{name}: the initial heading looks like degrees: it is {heading:g}, and a turn is "
            f"6.28 rad; give {heading / DEGREES:.4g}"
        )


def _refuse(trial: Trial, name: str, what: str, why: str, unit: str) -> NoReturn:
    header = f"; give SI, or the unit in its header, as in {name} [{unit}]" if unit else ""
    raise MjchairError(f"{trial.name}: {name} looks like {what}: {why}{header or '; give SI'}")


def _size(values: Array) -> float:
    return float(np.nanpercentile(np.abs(values), 95.0))


def _sensor(name: str) -> str:
    return name.rsplit(".", 1)[0]


def _check_limits(trial: Trial) -> None:
    for name, values in trial.channels.items():
        for end, (limit, unit) in LIMITS.items():
            size = _size(values)
            if _sensor(name).endswith(end) and size > limit:
                what = "degrees" if unit and size <= DEGREES * limit else "other units"
                why = f"it reaches {size:.3g}, and no chair passes {limit:g} in SI"
                _refuse(trial, name, what, why, unit)


def _check_rates(trial: Trial) -> None:
    for name in trial.channels:
        limit = next((v for end, v in RATES.items() if name.endswith(end)), None)
        if limit is None:
            continue
        story = _rate(trial, name)
        fastest = _size(story.values) if story.values.size else 0.0
        if fastest > limit:
            why = f"it turns by {fastest:.3g} a second, and no chair passes {limit:g} rad/s"
            _refuse(trial, name, "degrees", why, "deg")
        first = abs(float(trial.samples(name)[1][0]))
        if name.endswith("heading") and first > TURN:
            _refuse(trial, name, "degrees", f"it begins at {first:.4g}, and a turn is 6.28", "deg")


def _check_torque(trial: Trial) -> None:
    for name, values in (trial.inputs.controls if trial.inputs is not None else {}).items():
        if _size(values) > TORQUE:
            why = (
                f"it reaches {_size(values):.4g}, and neither hand nor motor passes {TORQUE:g} N m"
            )
            _refuse(trial, name, "N mm", why, "N mm")


def _check_gravity(trial: Trial) -> None:
    name = "imu_accelerometer.z"
    if name not in trial.channels:
        return
    middle = float(np.nanmedian(trial.channels[name]))
    why = f"it stays near {middle:.2f}, and a level sensor shows {GRAVITY}"
    if 0.8 < abs(middle) < 1.2:
        _refuse(trial, name, "g", why, "g")
    if abs(middle) < 3.0:
        raise MjchairError(
            f"{trial.name}: {name} looks as if gravity was taken off: {why}; add it back, or leave "
            "the column out"
        )


def _mean(trial: Trial, name: str, factor: float = 1.0, unit: str = "") -> Story:
    time, values = averaged(*trial.samples(name))
    return Story(time, factor * values, unit)


def _rate(trial: Trial, name: str, factor: float = 1.0, unit: str = "deg") -> Story:
    """How fast an angle or a place changes."""
    time, values = trial.samples(name)
    if name == "heading":
        values = np.unwrap(values)
    time, values = averaged(time, values)
    if time.size < 3:
        return Story(time[:0], values[:0], unit)
    return Story(time, factor * np.gradient(values, time), unit)


def _forward(trial: Trial) -> dict[str, Story]:
    """Channel -> how fast the chair rolls by it, m/s."""
    found = {}
    for side in ("left", "right"):
        if f"{side}_wheel_speed" in trial.channels:
            found[f"{side}_wheel_speed"] = _mean(trial, f"{side}_wheel_speed", RADIUS, "deg/s")
        if f"{side}_wheel_angle" in trial.channels:
            found[f"{side}_wheel_angle"] = _rate(trial, f"{side}_wheel_angle", RADIUS)
    if "velocity.x" in trial.channels:
        found["velocity.x"] = _mean(trial, "velocity.x")
    return found


def _turning(trial: Trial) -> dict[str, Story]:
    """Channel -> how fast the chair turns by it, rad/s."""
    found = {}
    if "imu_gyro.z" in trial.channels:
        found["imu_gyro.z"] = _mean(trial, "imu_gyro.z", unit="deg/s")
    if "heading" in trial.channels:
        found["heading"] = _rate(trial, "heading")
    wheels = [f"{side}_wheel_speed" for side in ("left", "right")]
    if all(w in trial.channels for w in wheels):
        left, right = (_mean(trial, w, RADIUS / TRACK) for w in wheels)
        found["wheels"] = Story(left.time, _at(right, left.time) - left.values, "")
    return found


def _at(story: Story, time: Array) -> Array:
    return np.interp(time, story.time, story.values) if story.time.size else np.zeros(time.size)


def _compare(trial: Trial, stories: dict[str, Story], least: float) -> None:
    """Channels that tell one story must tell it in one unit."""
    for pair in combinations(stories, 2):
        grid = stories[pair[0]].time
        one, two = (_at(stories[name], grid) for name in pair)
        sizes = np.linalg.norm(one), np.linalg.norm(two)
        if min(sizes) <= least * np.sqrt(grid.size) or one @ two < ALIKE * sizes[0] * sizes[1]:
            continue
        large = int(sizes[1] > sizes[0])
        ratio = sizes[large] / sizes[1 - large]
        name, other = pair[large], pair[1 - large]
        if DEGREES / NEAR < ratio < DEGREES * NEAR and stories[name].unit:
            why = f"it tells {ratio:.1f} times what {_article(other)} does"
            _refuse(trial, name, "degrees", why, stories[name].unit)


def _article(name: str) -> str:
    return "the difference of the wheels" if name == "wheels" else name


def _compare_with_acceleration(trial: Trial) -> None:
    """A wheel's speed must change as the accelerometer says, but for what a slope does to it."""
    name = "imu_accelerometer.x"
    speeds = [c for c in ("left_wheel_speed", "right_wheel_speed") if c in trial.channels]
    if name not in trial.channels or not speeds:
        return
    pull = _mean(trial, name)
    seen = _mean(trial, speeds[0], RADIUS)
    if pull.time.size < 8 or seen.time.size < 8:
        return
    gained = np.r_[0.0, np.cumsum(0.5 * (pull.values[1:] + pull.values[:-1]) * np.diff(pull.time))]
    speed = _at(seen, pull.time)
    ramp = np.column_stack([np.ones(pull.time.size), pull.time])  # a slope's part, and a bias'
    speed, gained = (v - ramp @ np.linalg.lstsq(ramp, v, rcond=None)[0] for v in (speed, gained))
    sizes = np.linalg.norm(speed), np.linalg.norm(gained)
    if sizes[0] < PULL * np.sqrt(speed.size) or speed @ gained < ALIKE * sizes[0] * sizes[1]:
        return
    ratio = float(sizes[0] / sizes[1])
    why = f"its speed changes {ratio:.1f} times as the accelerometer says"
    if DEGREES / NEAR < ratio < DEGREES * NEAR:
        _refuse(trial, speeds[0], "degrees", why, "deg/s")
    if GRAVITY / NEAR < ratio < GRAVITY * NEAR:
        _refuse(trial, name, "g", f"the wheels gain {ratio:.1f} times the speed that it tells", "g")
