"""Whether measured channels have the signs that they are taken for.

In: a trial, and the rear axle of the chair. Out: notes, or one line that names the channels. x is
forward, y left and z up (ISO 8855): wheels count up as the chair rolls forward, a turn to the left
is positive, and positive torque drives forward. `mjchair gather` finds signs out; a table that was
written by hand is believed unless two of its channels contradict each other.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.signal import detrend

from mjchair.diagnosis.data.trial_checks import averaged
from mjchair.diagnosis.data.unit_checks import YAW, Story, at, forward, turning, wheel_pairs
from mjchair.errors import MjchairError
from mjchair.measurement.trial import Trial
from mjchair.model.rolling import RearAxle
from mjchair.simulation.inputs import Inputs
from mjchair.simulation.table import Array

# two stories are opposite where their sum is smaller than this share of the larger one
LEFT_OVER = 0.4
SPUN = 1.0  # rad/s rms by the wheels, which no gyroscope overlooks
UNSEEN = 0.2  # of that turn, which another channel sees at most where a wheel's sign is wrong
SWAPPED = 0.8  # cosine of a turning moment with what turns the chair, beyond which it is believed
FEW = 8  # samples, of which less tells no course
PUSHED = 0.3  # m/s, that a chair gains at PULLED or more only if something drives it, or downhill
PULLED = 0.3  # m/s^2, as a slope of 3 %
GO = 0.7  # correlation of what goes together
VARIES = 0.02  # m/s, rms of a speed that does
LONG, ROLLS = 3.0, 0.3  # s and m/s, of a chair that rolls on
# m/s^2 that a coast loses at least: a rolling resistance of 0.002, a third of the least of whole
# chairs (0.006 to 0.02, effects/rolling_resistance.py; assumption)
COASTS = 0.02
TOLD = 0.3  # of a torque, in rms, that must go with speed and its gain (0.34 of one in strokes)
ALIKE = 0.5  # of their sum: torques whose difference is less are alike (rms)
ASIDE = 0.2  # of their sum: a centre of mass 55 mm aside turns a chair as much as such a difference
FORWARD, BACK = 0.1, 1.0  # m/s and m: a chair that is never faster, and rolls back by more
IDLE = 1.0  # N m, of a rim that nobody holds
WORK = 40.0  # J that torques take from a chair, more than it lost: a sign may be wrong (assumption)
SIDES = ("left", "right")


def check(trial: Trial, axle: RearAxle, mass: float) -> list[str]:
    """Refuse channels that contradict each other by their signs, and note a doubtful torque.

    Args:
      axle: of the chair. mass: of chair and rider, kg.

    Raises:
      MjchairError: naming the channels.
    """
    stories = turning(trial, axle)
    for one, two in combinations(stories, 2):
        _check_pair(trial, (one, two), (stories[one], stories[two]))
    for name, story in stories.items():
        if "wheels" in stories and name != "wheels":
            _check_spin(trial, axle, (name, story), stories["wheels"])
    said = _backward(trial, axle) + _gains(trial, axle)
    if trial.inputs is None:
        return said
    if {f"{side}_wheel" for side in SIDES} <= set(trial.inputs.controls):
        _check_equal(trial, trial.inputs, axle, stories.get("wheels"))
        _check_opposite(trial, trial.inputs, axle, stories.get("wheels"))
        _check_moment(trial, trial.inputs, stories)
    return said + _torque(trial, trial.inputs, axle, mass)


def _check_pair(trial: Trial, names: tuple[str, str], stories: tuple[Story, Story]) -> None:
    if not _are_opposite(stories, YAW):
        return
    if "wheels" in names:
        other = next(name for name in names if name != "wheels")
        raise MjchairError(
            f"{trial.name}: {other} turns left where the wheels turn right: the columns of the two "
            f"wheels are swapped, or {other} has the other sign (a turn to the left is positive)"
        )
    raise MjchairError(
        f"{trial.name}: {names[0]} and {names[1]} turn opposite ways; a turn to the left is "
        "positive, so turn the sign of one of them"
    )


def _are_opposite(stories: tuple[Story, Story], least: float) -> bool:
    """Whether two stories are one another's negative, in size as well.

    A sensor with a gain of 1.5 may tell a turn the other way, and its sign is right.

    Args:
      least: rms below which a story tells nothing.
    """
    grid = stories[0].time
    one, two = (at(story, grid) for story in stories)
    sizes = np.linalg.norm(one), np.linalg.norm(two)
    told = min(sizes) > least * np.sqrt(grid.size)
    return bool(told and np.linalg.norm(one + two) < LEFT_OVER * max(sizes))


def _check_spin(trial: Trial, axle: RearAxle, seen: tuple[str, Story], wheels: Story) -> None:
    name, story = seen
    told, other = (np.sqrt(np.mean(s**2)) for s in (wheels.values, at(story, wheels.time)))
    if told < SPUN or other > UNSEEN * told:
        return
    if _roll_opposite(trial, axle):
        raise MjchairError(
            f"{trial.name}: the wheels tell a turn of {told:.2g} rad/s, and {name} sees "
            f"{other:.2g}: does one of them count down as it rolls forward? Turn its sign"
        )


def _roll_opposite(trial: Trial, axle: RearAxle) -> bool:
    """Whether one wheel rolls back as the other rolls forward, at the same speed."""
    return any(_are_opposite(pair, 0.0) for pair in wheel_pairs(forward(trial, axle)))


def _check_equal(trial: Trial, inputs: Inputs, axle: RearAxle, wheels: Story | None) -> None:
    """Torques that are alike on both sides do not spin a chair on the spot.

    Args:
      wheels: how fast it turns by the difference of its wheels; None: not both were measured.
    """
    if wheels is None or np.sqrt(np.mean(wheels.values**2)) < SPUN:
        return
    left, right = (torque_at(inputs, side, wheels.time) for side in SIDES)
    if _differ_less(left, right, ALIKE) and _roll_opposite(trial, axle):
        raise MjchairError(
            f"{trial.name}: the wheels roll opposite ways, and their torques are alike: does one "
            "wheel count down as it rolls forward? Turn its sign"
        )


def _check_opposite(trial: Trial, inputs: Inputs, axle: RearAxle, wheels: Story | None) -> None:
    """Torques that are opposite turn a chair, and make none that rolls straight faster.

    Args:
      wheels: how fast it turns by the difference of its wheels; None: not both were measured.
    """
    if wheels is None or np.sqrt(np.mean(wheels.values**2)) > UNSEEN * SPUN:
        return
    left, right = (torque_at(inputs, side, wheels.time) for side in SIDES)
    on = np.linalg.norm(left - right) > IDLE * np.sqrt(left.size)
    if not on or not _differ_less(left, -right, ALIKE):
        return
    pushed = cumulative_trapezoid(left - right, wheels.time, initial=0.0)
    if any(
        abs(_go_together(at(one, wheels.time) + at(two, wheels.time), pushed)) > GO
        for one, two in wheel_pairs(forward(trial, axle))
    ):
        raise MjchairError(
            f"{trial.name}: the torques of the two wheels are opposite, and the chair rolls "
            "straight and faster with them; positive torque drives forward: turn the sign of one "
            "of them"
        )


def _go_together(speed: Array, values: Array) -> float:
    """Correlation of a speed (n,), m/s, with values, both without trends; 0 if it hardly varies."""
    one, two = detrend(speed), detrend(values)
    if np.linalg.norm(one) < VARIES * np.sqrt(one.size):
        return 0.0
    return float(one @ two / max(np.linalg.norm(one) * np.linalg.norm(two), 1e-300))


def _differ_less(left: Array, right: Array, share: float) -> bool:
    """Whether the difference of two torques (n,) is less than a share of their sum, in rms."""
    return bool(np.linalg.norm(left - right) < share * np.linalg.norm(left + right))


def _check_moment(trial: Trial, inputs: Inputs, turns: dict[str, Story]) -> None:
    """The right wheel's torque less the left one's turns the chair to the left.

    What it does not spend on a faster turn, it spends on the turn itself.
    """
    shares = {name: _moment_shares(inputs, story) for name, story in turns.items()}
    against = [name for name, share in shares.items() if (share < 0.0).all()]
    if against and not any((share > 0.0).any() for share in shares.values()):
        seen = "the wheels turn it" if against[0] == "wheels" else f"{against[0]} turns"
        raise MjchairError(
            f"{trial.name}: the torques turn the chair right where {seen} left; are "
            "the columns left_wheel and right_wheel swapped, or of the other sign?"
        )


def _moment_shares(inputs: Inputs, story: Story) -> Array:
    """Of the moment of the torques, what goes with a faster turn, and with the turn, (2,).

    Zero where the two do not make up the moment, and where it is so small a part of the torques
    that a centre of mass aside turns the chair as much when both wheels drive alike.
    """
    grid, rate = story.time, story.values
    if grid.size < FEW or np.sqrt(np.mean(rate**2)) < YAW:
        return np.zeros(2)
    left, right = (torque_at(inputs, side, grid) for side in SIDES)
    moment = right - left
    if _differ_less(left, right, ASIDE):
        return np.zeros(2)
    causes = np.column_stack([np.gradient(rate, grid), rate])
    shares = np.linalg.lstsq(causes, moment, rcond=None)[0]
    told = np.linalg.norm(causes @ shares) > SWAPPED * np.linalg.norm(moment)
    return np.asarray(shares if told else np.zeros(2))


def gains_undriven(trial: Trial, axle: RearAxle) -> bool:
    """Whether a channel shows a chair gain speed at PULLED or more, where no torque is given.

    Something else drives it then: somebody who pushes it, a slope, or a wind.
    """
    return trial.inputs is None and any(map(_gains_fast, speeds(trial, axle).values()))


def _gains_fast(story: Story) -> bool:
    """Whether a speed grows by more than PUSHED at PULLED or more."""
    gains = np.gradient(story.values, story.time) > PULLED
    return float(np.sum(np.diff(story.values)[gains[1:]])) > PUSHED


def speeds(trial: Trial, axle: RearAxle) -> dict[str, Story]:
    """Channel -> the speed forward (m/s) that it tells; of those that tell more than a moment."""
    return {n: s for n, s in forward(trial, axle).items() if s.time.size >= FEW}


def _backward(trial: Trial, axle: RearAxle) -> list[str]:
    """A note where a chair only rolls backward: each of its signs may be turned."""
    for name, story in speeds(trial, axle).items():
        back = -float(np.trapezoid(story.values, story.time))
        if story.values.max() <= FORWARD and back > BACK:
            return [
                f"{trial.name}: by {name} the chair rolls backward all along, by {back:.2g} m; if "
                "it went forward, turn the signs of its wheels and of its torques"
            ]
    return []


def _gains(trial: Trial, axle: RearAxle) -> list[str]:
    """A note where a chair gains speed that no torque gives it."""
    if trial.inputs is not None and not _is_still(trial.inputs):
        return []
    for name, story in speeds(trial, axle).items():
        speed = np.abs(story.values)
        gained = float(np.max(speed - np.minimum.accumulate(speed)))
        does = f"gains {gained:.2g} m/s" if gained > PUSHED else _keeps_speed(story)
        if does:
            return [
                f"{trial.name}: by {name} it {does} and no torque is given, so "
                "it is taken to coast, down a slope or before a wind; if somebody pushed it, give "
                "left_wheel and right_wheel, or only what follows the last push"
            ]
    return []


def _keeps_speed(story: Story) -> str:
    """What a chair does that rolls for LONG and loses less than a coast; empty: it does not."""
    lasts = float(story.time[-1] - story.time[0])
    mean = float(abs(story.values.mean()))
    if lasts < LONG or mean < ROLLS:
        return ""
    loses = -float(np.polyfit(story.time, np.abs(story.values), 1)[0])
    return f"keeps its {mean:.2g} m/s for {lasts:.2g} s" if loses < COASTS else ""


def _is_still(inputs: Inputs) -> bool:
    """Whether the torques of both wheels are no more than the offset of a sensor."""
    wheels = [name for name in inputs.controls if name.endswith("_wheel")]
    return all(np.nanmax(np.abs(inputs.samples(name)[1])) < IDLE for name in wheels)


def _torque(trial: Trial, inputs: Inputs, axle: RearAxle, mass: float) -> list[str]:
    """A note where torques take energy from a chair that it did not have.

    Raises:
      MjchairError: it gains speed besides while they brake, which no slope explains.
    """
    taken = lost = 0.0
    seen, pulls = speeds(trial, axle), []
    for side in SIDES:
        stories = (seen.get(f"{side}_wheel_{kind}") for kind in ("speed", "angle"))
        story = next((s for s in stories if s is not None), None)
        if story is None or f"{side}_wheel" not in inputs.controls:
            continue
        torque = torque_at(inputs, side, story.time)
        taken -= float(np.trapezoid(torque * story.values, story.time)) / axle.radius(side)
        ends = story.values[:3].mean(), story.values[-3:].mean()
        lost += 0.25 * mass * float(ends[0] ** 2 - ends[1] ** 2)
        pulls.append((story, torque))
    if taken < WORK + max(lost, 0.0):
        return []
    change = f"had {lost:.0f} J to lose" if lost > 0.0 else f"gained {-lost:.0f} J"
    said = f"{trial.name}: its torques take {taken:.0f} J from the chair, which {change}"
    if all(_brakes_as_it_gains(story, torque) for story, torque in pulls):
        raise MjchairError(
            f"{said}, and it gains speed the more they brake: positive torque drives forward; "
            "turn their signs, or those of the wheels where these count down as the chair rolls "
            "forward"
        )
    return [
        f"{said}: positive torque drives forward; turn their signs, unless the way goes downhill"
    ]


def torque_at(inputs: Inputs, side: str, time: Array) -> Array:
    """The torque of a rear wheel, averaged as channels are, at times (n,), s; N m."""
    return at(Story(*averaged(*inputs.samples(f"{side}_wheel")), ""), time)


def _brakes_as_it_gains(story: Story, torque: Array) -> bool:
    """Whether a torque is the less the more speed its wheel gains; some of it goes with the speed.

    On a slope as well a chair gains less the more it is braked.
    """
    gained = np.gradient(story.values, story.time)
    causes = np.column_stack([gained, story.values, np.ones(gained.size)])
    shares = np.linalg.lstsq(causes, torque, rcond=None)[0]
    told, whole = (np.linalg.norm(t - torque.mean()) for t in (causes @ shares, torque))
    return bool(shares[0] < 0.0 and told > TOLD * whole)
