"""Whether measured channels can be what they are called: units, clocks, dead channels."""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType

import numpy as np

from mjchair.errors import MjchairError
from mjchair.measurement.trial import Trial

RADIUS = 0.3  # m, of a rear wheel, to compare channels with one another
LIMITS = {  # the most that a wheelchair shows, SI
    "speed": 60.0,
    "gyro": 20.0,
    "accelerometer": 80.0,
    "velocity": 15.0,
    "heading": 100.0,
}
DEGREES = 180.0 / np.pi
GRAVITY = 9.81
GAP = 0.5  # s without any sample, beyond which a clock jumps


def without_dead(trial: Trial) -> tuple[Trial, list[str]]:
    """The trial without channels that are zero throughout while the chair moves.

    Raises:
      MjchairError: no channel is left.
    """
    moving = any(
        np.nanstd(values) > 1e-6 for name, values in trial.channels.items() if "angle" not in name
    )
    dead = [n for n, v in trial.channels.items() if moving and not np.nan_to_num(v).any()]
    dead = [n for n in dead if _expected_to_move(n)]
    if not dead:
        return trial, []
    left = {n: v for n, v in trial.channels.items() if n not in dead}
    if not left:
        raise MjchairError(f"{trial.name}: every channel is zero throughout; nothing was measured")
    said = [f"{trial.name}: {n} is exactly zero throughout; it is left out" for n in dead]
    return replace(trial, channels=MappingProxyType(left)), said


def _expected_to_move(name: str) -> bool:
    return name.endswith(("_speed", "_angle", "accelerometer.x", "accelerometer.z", "gyro.z")) or (
        name.startswith(("position.x", "velocity.x"))
    )


def check(trial: Trial) -> list[str]:
    """Notes on gaps.

    Raises:
      MjchairError: a channel in degrees or in g, a clock that jumps.
    """
    _check_clock(trial)
    _check_limits(trial)
    _check_against_motion(trial)
    return []


def _check_clock(trial: Trial) -> None:
    steps = np.diff(trial.time)
    worst = int(np.argmax(steps))
    if steps[worst] > max(GAP, 20.0 * float(np.median(steps))):
        raise MjchairError(
            f"{trial.name}: the clock jumps from {trial.time[worst]:g} to "
            f"{trial.time[worst + 1]:g} s; cut the trial in two there"
        )


def _size(values: np.ndarray) -> float:
    return float(np.nanpercentile(np.abs(values), 95.0))


def _check_limits(trial: Trial) -> None:
    for name, values in trial.channels.items():
        sensor = name.rsplit(".", 1)[0]
        limit = next((v for end, v in LIMITS.items() if sensor.endswith(end)), np.inf)
        if _size(values) <= limit:
            continue
        what = (
            "degrees" if _size(values) / DEGREES <= limit and "acc" not in name else "other units"
        )
        raise MjchairError(
            f"{trial.name}: {name} looks like {what}: it reaches {_size(values):.3g}, and no chair "
            f"passes {limit:g} in SI; give SI, or the unit in its header, as in {name} [deg/s]"
        )
    for name in ("imu_accelerometer.z",):
        if name not in trial.channels:
            continue
        values = trial.channels[name]
        middle = abs(float(np.nanmedian(values)))
        if 0.8 < middle < 1.2:
            raise MjchairError(
                f"{trial.name}: {name} looks like g: it stays near {middle:.2f}, and a level "
                f"sensor shows {GRAVITY}; give m/s^2, or the unit as in {name} [g]"
            )


def _moved(trial: Trial, name: str) -> float:
    """How far the channel's own story goes: integral of the size of a rate, or range of a state."""
    time, values = trial.samples(name)
    return float(np.trapezoid(np.abs(values), time)) if time.size > 2 else 0.0


def _travel(trial: Trial) -> dict[str, tuple[float, str]]:
    """Channel -> path length (m) that it tells, and the unit it is in."""
    found: dict[str, tuple[float, str]] = {}
    for side in ("left", "right"):
        if f"{side}_wheel_speed" in trial.channels:
            found[f"{side}_wheel_speed"] = (_moved(trial, f"{side}_wheel_speed") * RADIUS, "rad/s")
        if f"{side}_wheel_angle" in trial.channels:
            _, angle = trial.samples(f"{side}_wheel_angle")
            found[f"{side}_wheel_angle"] = (float(np.abs(np.diff(angle)).sum()) * RADIUS, "rad")
    if "velocity.x" in trial.channels:
        found["velocity.x"] = (_moved(trial, "velocity.x"), "m/s")
    return found


def _turned(trial: Trial) -> dict[str, float]:
    """Channel -> angle (rad) through which it says the chair turned."""
    found = {}
    if "imu_gyro.z" in trial.channels:
        found["imu_gyro.z"] = _moved(trial, "imu_gyro.z")
    if "heading" in trial.channels:
        _, heading = trial.samples("heading")
        smooth = np.convolve(np.unwrap(heading), np.ones(9) / 9, mode="valid")
        found["heading"] = float(np.abs(np.diff(smooth[::5])).sum())
    return found


def _check_against_motion(trial: Trial) -> None:
    """Channels that tell one story must tell it in one unit."""
    told = {n: size for n, (size, _) in _travel(trial).items() if size > 0.3}
    for name, size in told.items():
        others = [v for n, v in told.items() if n != name]
        if others and 30.0 < size / np.median(others) < 110.0:
            raise MjchairError(
                f"{trial.name}: {name} looks like degrees: it tells {size / np.median(others):.1f} "
                f"times the way that the other channels do; give SI, or the unit as in {name} [deg]"
            )
    turned = _turned(trial)
    if len(turned) == 2 and min(turned.values()) > 0.2:
        ratio = turned["imu_gyro.z"] / turned["heading"]
        name = "imu_gyro.z" if ratio > 1.0 else "heading"
        if 30.0 < max(ratio, 1.0 / ratio) < 110.0:
            raise MjchairError(
                f"{trial.name}: {name} looks like degrees: it turns {max(ratio, 1 / ratio):.1f} "
                f"times as far as the other; give SI, or the unit as in {name} [deg/s]"
            )
