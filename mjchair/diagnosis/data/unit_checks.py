"""Whether measured channels can be in the units that they are taken for.

In: a trial, and the rear axle of the chair. Out: nothing, or one line that names the channel and
the unit that it looks like. Three ways to know: no chair is that fast; two channels tell one story
in two units, or of two lengths of the way; a level accelerometer shows gravity, on one axis.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import combinations
from typing import NamedTuple, NoReturn

import numpy as np
from scipy.integrate import cumulative_trapezoid

from mjchair.diagnosis.data.trial_checks import BIAS, averaged
from mjchair.errors import MjchairError
from mjchair.measurement.sensors import limit_of, rolls, sensor
from mjchair.measurement.torque import check_torques
from mjchair.measurement.trial import Trial
from mjchair.model.rolling import RearAxle
from mjchair.simulation.table import Array

DEGREES, GRAVITY = 180.0 / np.pi, 9.81
TURN = 2.0 * np.pi + 0.2  # rad, within which a heading begins
NEAR = 1.3  # factor within which two stories differ by a unit
KMH, CLOSE = 3.6, 1.15  # km/h in a m/s; factor by which a wheel's radius may be wrong
ALIKE = 0.95  # cosine of two stories that are one
FORWARD, YAW, PULL = 0.05, 0.03, 0.05  # m/s, rad/s and m/s: motion below which nothing is compared
SURELY = (0.98, 0.02)  # cosine from which so small a motion is compared, m/s: strokes make 0.04
OTHER_START = 1.0  # m/s, and the speed itself, by which a first speed is not the one that is seen
WAY = 0.5  # m by the wheels, below which it is not compared with the places
FURTHER = 3.0  # times what its wheels roll that no chair gets away
AWAY = 2.0  # m, from where it was, that a chair gets by more than turning about a wheel that stands
# a rate in rad/s, deg/s, turns a second or a minute, over the same in another of these
RATES = (6.0, 2.0 * np.pi, 60.0 / (2.0 * np.pi), DEGREES)
LENGTHS = {"mm": 1e3, "cm": 1e2, "in": 39.37}  # units of a length that people use, a metre


class Story(NamedTuple):
    """What a channel says of one motion: times (s), values (SI if its unit is), unit to advise."""

    time: Array
    values: Array
    unit: str


def check(trial: Trial, axle: RearAxle) -> None:
    """Refuse channels in other units than SI, where that can be known.

    Args:
      axle: of the chair, which ties its channels to one another.

    Raises:
      MjchairError: naming the channel and what it looks like.
    """
    _check_limits(trial, axle)
    _check_rates(trial, axle)
    check_torques(trial.inputs.controls if trial.inputs is not None else {}, trial.name)
    _check_gravity(trial)
    _compare(trial, axle, forward(trial, axle), FORWARD)
    _compare(trial, axle, turning(trial, axle), YAW)
    _compare_with_acceleration(trial, axle)
    _compare_with_way(trial, axle)
    _compare_speeds(trial, axle)
    _compare_speeds_with_places(trial, axle)
    _check_places(trial)


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


def check_first_speed(trial: Trial, axle: RearAxle, speed: float) -> None:
    """Refuse a first speed (m/s) that is not the one at which the chair is seen to roll.

    Raises:
      MjchairError: naming the channel.
    """
    for name, story in forward(trial, axle).items():
        if story.time.size and abs(speed - story.values[0]) > OTHER_START + abs(story.values[0]):
            raise MjchairError(
                f"{trial.name}: its initial speed is {speed:g} m/s, and by {name} it starts at "
                f"{story.values[0]:.2g} m/s; leave one of them out, or give it in m/s"
            )


def _refuse(trial: Trial, name: str, what: str, why: str, *units: str) -> NoReturn:
    headers = " or ".join(f"{name} [{unit}]" for unit in units)
    header = f", as in {headers}" if units else "; if it is another channel, name it so"
    raise MjchairError(
        f"{trial.name}: {name} looks like {what}: {why}; give {sensor(name).unit}, or the unit in "
        f"its header{header}"
    )


def _size(values: Array) -> float:
    return float(np.nanpercentile(np.abs(values), 95.0))


def _check_limits(trial: Trial, axle: RearAxle) -> None:
    for name, values in trial.channels.items():
        kind = sensor(name)
        if kind.most is None:
            continue
        limit, size = limit_of(name, kind.most, axle), _size(values)
        if size > limit:
            why = f"it reaches {size:.3g}, and no chair passes {limit:.3g} {kind.unit}"
            units = [kind.degrees] if kind.degrees else []
            if not units or size > DEGREES * limit:
                _refuse(trial, name, "other units", why, *units)
            if rolls(name) and kind.unit == "rad/s":
                _refuse(trial, name, "deg/s or rpm", why, *units, "rpm")
            _refuse(trial, name, "degrees", why, *units)


def _fastest(trial: Trial, name: str) -> float:
    """How fast an angle or a place changes, but for single samples; 0 where that is not told."""
    story = _rate(trial, name)
    return _size(story.values) if story.values.size else 0.0


def _check_rates(trial: Trial, axle: RearAxle) -> None:
    for name in trial.channels:
        kind = sensor(name)
        if kind.fastest is None or kind.unit == "m":
            continue
        limit, fastest = limit_of(name, kind.fastest, axle), _fastest(trial, name)
        if fastest > limit:
            why = f"it changes by {fastest:.3g} a second, and no chair passes {limit:.3g} rad/s"
            _refuse(trial, name, "degrees", why, "deg")
        first = abs(float(trial.samples(name)[1][0]))
        if kind.wraps and first > TURN:
            _refuse(trial, name, "degrees", f"it begins at {first:.4g}, and a turn is 6.28", "deg")


def _check_gravity(trial: Trial) -> None:
    for name in ("imu_accelerometer.x", "imu_accelerometer.y"):
        middle = float(np.nanmedian(trial.channels.get(name, np.zeros(1))))
        if abs(middle) > 0.5 * GRAVITY:
            raise MjchairError(
                f"{trial.name}: {name} stays near {middle:.2f}, as the "
                "axis does that points up; x is forward, y left and z up: name the axes so"
            )
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
    if sensor(name).wraps:
        values = np.unwrap(values)
    time, values = averaged(time, values)
    if time.size < 3:
        return Story(time[:0], values[:0], unit)
    return Story(time, factor * np.gradient(values, time), unit)


def forward(trial: Trial, axle: RearAxle) -> dict[str, Story]:
    """Channel -> how fast the chair rolls by it, m/s."""
    stories = {}
    for side in ("left", "right"):
        if f"{side}_wheel_speed" in trial.channels:
            stories[f"{side}_wheel_speed"] = _mean(
                trial, f"{side}_wheel_speed", axle.radius(side), "deg/s"
            )
        if f"{side}_wheel_angle" in trial.channels:
            stories[f"{side}_wheel_angle"] = _rate(trial, f"{side}_wheel_angle", axle.radius(side))
    if "velocity.x" in trial.channels:
        stories["velocity.x"] = _mean(trial, "velocity.x")
    return stories


def turning(trial: Trial, axle: RearAxle) -> dict[str, Story]:
    """Channel -> how fast the chair turns by it, rad/s; "wheels" by the difference of the two."""
    stories = {}
    if "imu_gyro.z" in trial.channels:
        stories["imu_gyro.z"] = _mean(trial, "imu_gyro.z", unit="deg/s")
    if "heading" in trial.channels:
        stories["heading"] = _rate(trial, "heading")
    for left, right in wheel_pairs(forward(trial, axle)):
        turn = (at(right, left.time) - left.values) / axle.track
        stories["wheels"] = Story(left.time, turn, "")
        break
    return stories


def wheel_pairs(rolled: Mapping[str, Story]) -> Iterator[tuple[Story, Story]]:
    """The left and the right wheel of what `forward` tells: by speeds, then by angles."""
    for kind in ("speed", "angle"):
        names = [f"{side}_wheel_{kind}" for side in ("left", "right")]
        if all(name in rolled for name in names):
            yield rolled[names[0]], rolled[names[1]]


def at(story: Story, time: Array) -> Array:
    """A story (n,) at the times given (s); zero where there is none."""
    return np.interp(time, story.time, story.values) if story.time.size else np.zeros(time.size)


def _compare(trial: Trial, axle: RearAxle, stories: dict[str, Story], least: float) -> None:
    """Channels that tell one story must tell it in one unit."""
    for pair in combinations(stories, 2):
        grid = stories[pair[0]].time
        one, two = (at(stories[name], grid) for name in pair)
        sizes = np.linalg.norm(one), np.linalg.norm(two)
        if min(sizes) <= least * np.sqrt(grid.size) or one @ two < ALIKE * sizes[0] * sizes[1]:
            continue
        large = int(sizes[1] > sizes[0])
        ratio = float(sizes[large] / sizes[1 - large])
        name, other = pair[large], pair[1 - large]
        if DEGREES / NEAR < ratio < DEGREES * NEAR and stories[name].unit:
            why = f"it tells {ratio:.1f} times what {_article(other)} does"
            _refuse(trial, name, "degrees", why, stories[name].unit)
        if name.startswith("velocity") and KMH / CLOSE < ratio < KMH * CLOSE:
            _refuse(trial, name, "km/h", f"it tells {ratio:.2f} times what {other} does", "km/h")
        # "wheels" is the last of the stories, so the larger is the first of the pair
        in_metres = other == "wheels" and 1.0 / NEAR < ratio * axle.left < NEAR
        if in_metres and not _may_be_biased(two, one, ratio) and _speeds(trial):
            _refuse_rolled(trial, axle, f"the wheels tell {1.0 / ratio:.2f} times what {name} does")


def _may_be_biased(wheels: Array, other: Array, ratio: float) -> bool:
    """Whether a bias may be why a gyroscope, or a heading made of it, tells more than the wheels.

    One of 0.12 rad/s tells three times what the wheels do in a slow turn. Where the turn varies,
    what varies must be as many times as large as well to be another unit.
    """
    more = abs(float(other.mean() - wheels.mean()))
    if more > BIAS:
        return False
    one, two = wheels - wheels.mean(), other - other.mean()
    sizes = np.linalg.norm(one), np.linalg.norm(two)
    if min(sizes) <= YAW * np.sqrt(one.size):
        return True
    alike = one @ two > ALIKE * sizes[0] * sizes[1]
    return not (alike and 1.0 / NEAR < sizes[1] / sizes[0] / ratio < NEAR)


def _compare_with_way(trial: Trial, axle: RearAxle) -> None:
    """The chair goes as far by its places as by its wheels, and no multiple of it."""
    wheels = [story for name, story in forward(trial, axle).items() if rolls(name)]
    places = [_mean(trial, f"position.{axis}") for axis in "xy" if _placed(trial)]
    if not wheels or not places or min(len(s.time) for s in (*wheels, *places)) < 3:
        return
    grid = wheels[0].time
    speed = np.abs(np.mean([at(story, grid) for story in wheels], axis=0))
    rolled = float(np.trapezoid(speed, grid))
    x, y = (at(story, grid) for story in places)
    gone = float(np.hypot(np.diff(x), np.diff(y)).sum())
    if rolled < WAY:
        return
    why = f"it goes {gone:.4g} m where the wheels roll {rolled:.3g} m"
    for unit, metre in LENGTHS.items():
        if metre / NEAR < gone / rolled < metre * NEAR:
            _refuse(trial, "position.x", unit, why, unit)
    if 1.0 / NEAR < gone / rolled * axle.left < NEAR and _speeds(trial):
        _refuse_rolled(
            trial, axle, f"the wheels roll {rolled:.3g} m by it where position goes {gone:.3g} m"
        )
    angles = [c for c in ("left_wheel_angle", "right_wheel_angle") if c in trial.channels]
    if TURN / NEAR < gone / rolled < TURN * NEAR and angles:
        _refuse(trial, angles[0], "turns", why, "rev")


def _compare_speeds(trial: Trial, axle: RearAxle) -> None:
    """A wheel's speed tells what its angle does: turns a minute taken for deg/s are a sixth."""
    rolled = forward(trial, axle)
    for name, one in _by_speeds(trial, rolled).items():
        angle = name.replace("_speed", "_angle")
        if angle not in rolled or not rolled[angle].time.size:
            continue
        two = at(rolled[angle], one.time)
        sizes = float(np.linalg.norm(one.values)), float(np.linalg.norm(two))
        moves = max(sizes) > FORWARD * np.sqrt(two.size) and min(sizes) > 0.0
        alike = float(one.values @ two) > ALIKE * sizes[0] * sizes[1]
        if moves and alike and _is_of_units(sizes[0] / sizes[1]):
            why = f"it tells {sizes[0] / sizes[1]:.2g} times what {angle} does"
            _refuse(trial, name, "another unit", why, "rpm", "deg/s")


def _compare_speeds_with_places(trial: Trial, axle: RearAxle) -> None:
    """A chair gets no further than its wheels roll, by the speeds, while these are measured.

    Wheels may roll further, as on rollers, and a chair may turn about a wheel that stands.
    """
    rolled = [s for s in _by_speeds(trial, forward(trial, axle)).values() if s.time.size]
    if not rolled or not _placed(trial):
        return
    way = max(float(np.trapezoid(np.abs(story.values), story.time)) for story in rolled)
    first = max(story.time[0] for story in rolled)
    gone = _distance(trial, first, min(story.time[-1] for story in rolled))
    if gone > max(FURTHER * way, AWAY):
        why = f"the wheels roll {way:.2g} m by it, and the chair gets {gone:.2g} m away"
        _refuse(trial, _speeds(trial)[0], "another unit", why, "rpm", "deg/s")


def _is_of_units(ratio: float) -> bool:
    """Whether a channel tells as many times another that is the same as two units of a rate do."""
    return any(1.0 / CLOSE < max(ratio, 1.0 / ratio) / by < CLOSE for by in RATES)


def _distance(trial: Trial, first: float, last: float) -> float:
    """How far the chair gets from where it is at a time, until another (s), m."""
    x, y = (_mean(trial, f"position.{axis}") for axis in "xy")
    during = (x.time >= first) & (x.time <= last)
    if not during.any():
        return 0.0
    along, across = x.values[during], at(y, x.time)[during]
    return float(np.hypot(along - along[0], across - across[0]).max())


def _check_places(trial: Trial) -> None:
    """No chair changes its place so fast as one in mm or cm seems to."""
    for name in trial.channels:
        kind = sensor(name)
        if kind.unit != "m" or kind.fastest is None:
            continue
        fastest = _fastest(trial, name)
        if fastest > kind.fastest:
            why = f"it moves by {fastest:.3g} a second, and no chair passes {kind.fastest:g} m/s"
            _refuse(trial, name, "mm or cm", why, "mm")


def _refuse_rolled(trial: Trial, axle: RearAxle, why: str) -> NoReturn:
    raise MjchairError(
        f"{trial.name}: {_speeds(trial)[0]} looks like m/s: {why}; divide it by the wheel's "
        f"radius, {axle.left:g} m"
    )


def _placed(trial: Trial) -> bool:
    return {"position.x", "position.y"} <= set(trial.channels)


def _speeds(trial: Trial) -> list[str]:
    return [c for c in ("left_wheel_speed", "right_wheel_speed") if c in trial.channels]


def _by_speeds(trial: Trial, rolled: Mapping[str, Story]) -> dict[str, Story]:
    """What the speeds of the wheels tell, of what `forward` does."""
    return {name: rolled[name] for name in _speeds(trial)}


def _article(name: str) -> str:
    return "the difference of the wheels" if name == "wheels" else name


def _compare_with_acceleration(trial: Trial, axle: RearAxle) -> None:
    """The wheels' speed must change as the accelerometer says, but for what a slope does to it."""
    name = "imu_accelerometer.x"
    speeds = _speeds(trial)
    if name not in trial.channels or not speeds:
        return
    pull, rolled = _mean(trial, name), _rolled(trial, axle)
    if min(pull.time.size, rolled.time.size) < 8:
        return
    gained = cumulative_trapezoid(pull.values, pull.time, initial=0.0)
    speed = at(rolled, pull.time)
    ramp = np.column_stack([np.ones(pull.time.size), pull.time])  # a slope's part, and a bias'
    speed, gained = (v - ramp @ np.linalg.lstsq(ramp, v, rcond=None)[0] for v in (speed, gained))
    sizes = np.linalg.norm(speed), np.linalg.norm(gained)
    if min(sizes) == 0.0:
        return
    alike, ratio = float(speed @ gained / (sizes[0] * sizes[1])), float(sizes[0] / sizes[1])
    moves = sizes[1] > PULL * np.sqrt(speed.size)
    if moves and 1.0 / NEAR < ratio / axle.left < NEAR and alike > ALIKE:
        _refuse_rolled(trial, axle, f"it changes {ratio:.2f} times as {name} says")
    least = SURELY[1] if abs(alike) > SURELY[0] else PULL
    if sizes[0] < least * np.sqrt(speed.size) or abs(alike) < ALIKE:
        return
    if alike < 0.0:
        raise MjchairError(
            f"{trial.name}: {name} falls where {speeds[0]} rises: x is forward, so turn its sign"
        )
    why = f"its speed changes {ratio:.1f} times as the accelerometer says"
    if DEGREES / NEAR < ratio < DEGREES * NEAR:
        _refuse(trial, speeds[0], "degrees", why, "deg/s")
    if GRAVITY / NEAR < ratio < GRAVITY * NEAR:
        _refuse(trial, name, "g", f"the wheels gain {ratio:.1f} times the speed that it tells", "g")


def _rolled(trial: Trial, axle: RearAxle) -> Story:
    """Speed of the axle's middle (m/s) by the wheels; by one alone, less the chair's turn."""
    wheels = _by_speeds(trial, forward(trial, axle))
    (name, one), *others = wheels.items()
    speeds = [one.values, *(at(other, one.time) for _, other in others)]
    if len(wheels) == 1 and "imu_gyro.z" in trial.channels:
        turn = at(_mean(trial, "imu_gyro.z"), one.time)
        speeds[0] = one.values + (0.5 if name.startswith("left") else -0.5) * axle.track * turn
    return Story(one.time, np.asarray(np.mean(speeds, axis=0)), one.unit)
