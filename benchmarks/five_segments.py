"""Studies of a person who pushes, made by a planar model of five segments; no MuJoCo, no mjchair.

What it does: trunk, head, upper arms, forearms and hands turn by given angles on a chair that rolls
along a line; Newton and Euler for the whole give its acceleration and the loads of its wheels.
Rim torques, strokes that are never twice alike, sensors with noise.
What goes in: a `Person`, what is hidden (`Hidden`) and a seed. What comes out: a study folder; its
truth is what went in. SI units, ISO 8855 axes: x forward, z up.

    python benchmarks/five_segments.py OUT [--diagnose]   # the studies of docs/rider.md
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, PchipInterpolator

Array = NDArray[np.float64]
GRAVITY = 9.81  # m/s^2
RATE = 100.0  # Hz, of the tables
FINE = 0.0025  # s, half of the step of integration
# Share of body mass, place of the centre from the joint above (of the length), radius of gyration
# about the centre (of the length), length over stature. Sizes after Winter (2009), whose trunk is
# that of shoulders to hips; other numbers than those of mjchair's rider (de Leva) on purpose.
SEGMENTS = {
    "trunk": (0.497, 0.50, 0.50, 0.275),
    "head": (0.081, 1.00, 0.495, 0.100),
    "upper_arms": (0.056, 0.436, 0.322, 0.186),
    "forearms": (0.032, 0.430, 0.303, 0.146),
    "hands": (0.012, 0.506, 0.297, 0.050),
}
LOADED = (0.12, 0.55)  # m, where a load is strapped on: forward of the axle, above the ground
HIP = (0.08, 0.50)  # m, of the hip joint: forward of the rear axle, above the ground; assumption


@dataclass(frozen=True)
class Person:
    """Mass (kg), stature (m), and how a stroke goes (angles rad, times s)."""

    mass: float = 75.0
    stature: float = 1.75
    period: float = 1.1
    push: float = 0.42  # share of the period with the hands on the rims
    bend: float = math.radians(6.0)  # of the trunk, to both sides of its mean
    lag: float = 0.08  # of the period, by which the trunk follows the hands
    contact: tuple[float, float] = (math.radians(-30.0), math.radians(40.0))  # from the rim's top
    torque: float = 8.0  # N m, peak on each rim
    uneven: float = 0.06  # relative standard deviation from stroke to stroke


@dataclass(frozen=True)
class Chair:
    """Sizes of a manual chair without its person; those of mjchair's manual chair, rounded."""

    mass: float = 15.0
    rear_radius: float = 0.30
    rear_inertia: float = 0.105  # kg m^2, each
    caster_inertia: float = 0.00126
    caster_radius: float = 0.075
    wheelbase: float = 0.40  # m, to the contact of casters that trail
    rolling_rear: float = 0.010
    rolling_caster: float = 0.015
    rim_radius: float = 0.27
    load: float = 0.0  # kg, strapped on at LOADED


@dataclass(frozen=True)
class Hidden:
    """What the plain model does not know: added to rolling resistance, slope, gains of two rims.

    A rim of gain 0.1 was pushed with 1.1 times the torque that stands in the table.
    """

    rolling: float = 0.0
    slope: float = 0.0
    gain_left: float = 0.0
    gain_right: float = 0.0
    moves: bool = True


@dataclass(frozen=True)
class Start:
    """Speed (m/s) at first, and sign of the heading along x."""

    speed: float
    east: float


@dataclass(frozen=True)
class Body:
    """The segments over time: centres (s, n, 2) m in the chair's axes, angles (s, n) rad."""

    time: Array
    mass: Array
    inertia: Array
    centre: CubicSpline
    angle: CubicSpline


def strokes(person: Person, duration: float, rng: np.random.Generator) -> tuple[Array, Array]:
    """Beginnings (s) of strokes, and the strength of each (1)."""
    begins, at = [], 0.6
    while at < duration - 0.5:
        begins.append(at)
        at += person.period * (1.0 + person.uneven * rng.standard_normal())
    return np.array(begins), 1.0 + person.uneven * rng.standard_normal(len(begins))


def _phase(begins: Array, person: Person, time: Array) -> tuple[Array, Array]:
    """Phase (turns) of the strokes with steady speed and acceleration, and how much one moves."""
    knots = np.r_[begins[0] - person.period, begins, begins[-1] + person.period * np.arange(1, 4)]
    spline = CubicSpline(knots, np.arange(-1.0, knots.size - 1.0))
    ramp = np.clip((time - begins[0] + 0.5) / 0.7, 0.0, 1.0)
    return spline(np.clip(time, knots[0], knots[-1])), ramp**3 * (10 - 15 * ramp + 6 * ramp**2)


def body(person: Person, chair: Chair, duration: float, begins: Array, strength: Array) -> Body:
    """Segments that swing with the strokes; without strokes they keep their place."""
    time = np.arange(-0.2, duration + 0.4, 0.002)
    shares = np.array(list(SEGMENTS.values()))
    mass, length = shares[:, 0] * person.mass, shares[:, 3] * person.stature
    inertia = mass * (shares[:, 2] * length) ** 2
    turns, moves, size = np.zeros(time.size), np.zeros(time.size), np.ones(time.size)
    if begins.size:
        turns, moves = _phase(begins, person, time)
        knots = np.r_[time[0] - 1.0, begins[0] - 0.8, begins, begins[-1] + 0.8, time[-1] + 1.0]
        sizes = np.r_[strength[[0, 0]], strength, strength[[-1, -1]]]
        size = 1.0 + moves * (PchipInterpolator(knots, sizes)(time) - 1.0)
    angle, where = _posture(person, chair, length, turns, moves, size)
    total = np.stack(where, axis=1)
    return Body(
        time=time,
        mass=mass,
        inertia=inertia,
        centre=CubicSpline(time, total),
        angle=CubicSpline(time, angle),
    )


def _posture(
    person: Person, chair: Chair, length: Array, turns: Array, moves: Array, size: Array
) -> tuple[Array, list[Array]]:
    """Absolute angles (s, 5) from the vertical, forward positive, and centres (s, 2) of each."""
    wave = 2.0 * np.pi * turns
    lagged = wave - 2.0 * np.pi * person.lag
    trunk = 0.08 - moves * size * person.bend * (np.cos(lagged) - 0.2 * np.cos(2.0 * lagged))
    head = 0.2 + 0.4 * (trunk - 0.08)
    hip = np.array(HIP)

    def along(angle: Array, by: float) -> Array:
        return by * np.stack([np.sin(angle), np.cos(angle)], axis=1)

    shoulder = hip + along(trunk, length[0])
    low, high = person.contact
    # the hands go along the rim from `low` to `high` and come back above it
    rim = 0.5 * (low + high) - moves * 0.5 * (high - low) * np.cos(wave - 0.5)
    lift = chair.rim_radius + moves * 0.03 * (1.0 + np.sin(wave - 0.5 + np.pi))
    wrist = np.array([0.0, chair.rear_radius]) + np.stack(
        [lift * np.sin(rim), lift * np.cos(rim)], axis=1
    )
    upper, fore = _elbow(shoulder, wrist, length[2], length[3])
    hand = fore
    share = [row[1] for row in SEGMENTS.values()]
    elbow = shoulder + along(upper, -length[2])
    centres = [
        hip + along(trunk, share[0] * length[0]),
        hip + along(trunk, 1.05 * length[0]) + along(head, share[1] * length[1]),
        shoulder + along(upper, -share[2] * length[2]),
        elbow + along(fore, -share[3] * length[3]),
        elbow + along(fore, -length[3]) + along(hand, -share[4] * length[4]),
    ]
    return np.stack([trunk, head, upper, fore, hand], axis=1), centres


def _elbow(shoulder: Array, wrist: Array, one: float, two: float) -> tuple[Array, Array]:
    """Angles of upper arm and forearm (their upward axis from the vertical), elbow behind."""
    down = wrist - shoulder
    reach = np.clip(np.hypot(*down.T), 0.05, 0.999 * (one + two))
    towards = np.arctan2(down[:, 0], -down[:, 1])  # forward of hanging
    at_shoulder = np.arccos((one**2 + reach**2 - two**2) / (2.0 * one * reach))
    upper = towards - at_shoulder
    elbow = shoulder + one * np.stack([np.sin(upper), -np.cos(upper)], axis=1)
    fore = np.arctan2((wrist - elbow)[:, 0], -(wrist - elbow)[:, 1])
    return -upper, -fore


def rims(person: Person, begins: Array, strength: Array, time: Array) -> Array:
    """Torque of one hand on its rim, N m."""
    out = np.zeros(time.size)
    for begin, size in zip(begins, strength, strict=True):
        x = (time - begin) / (person.push * person.period)
        bell = np.where((x > 0.0) & (x < 1.0), np.sin(np.pi * np.clip(x, 0, 1) ** 0.9) ** 1.5, 0.0)
        out += person.torque * size * np.nan_to_num(bell)
    return out


@dataclass(frozen=True)
class Rolled:
    """A run: time (n,) s; speed (m/s) and acceleration (m/s^2) along the chair's x."""

    time: Array
    speed: Array
    gained: Array


def roll(
    person: Person, chair: Chair, hidden: Hidden, segments: Body, push: Array, start: Start
) -> Rolled:
    """The chair's way. `push`: torque of one rim (N m) at the times 0, FINE, 2 FINE ... .

    The chair keeps what of the person does not move: the rest of the mass, at its seat.
    """
    time = FINE * np.arange(push.size)
    seat = person.mass - float(segments.mass.sum())
    # the seat's part lies so that the whole is balanced as mjchair's chair: 0.12 m before the axle
    upright = segments.centre(0.0)
    whole = person.mass + chair.mass
    rest = seat + chair.mass
    front = (0.12 * whole - float(segments.mass @ upright[:, 0])) / rest
    height = (0.648 * whole - float(segments.mass @ upright[:, 1])) / rest
    place, away = segments.centre(time), segments.centre(time, 2)
    twist = segments.angle(time, 2)
    spin = np.array([chair.rear_inertia, chair.caster_inertia])
    radius = np.array([chair.rear_radius, chair.caster_radius])
    turning = float((2.0 * spin / radius**2).sum())
    # what is strapped on comes on top of that
    front = (front * rest + LOADED[0] * chair.load) / (rest + chair.load)
    height = (height * rest + LOADED[1] * chair.load) / (rest + chair.load)
    whole, rest = whole + chair.load, rest + chair.load
    load = whole * GRAVITY + away[:, :, 1] @ segments.mass
    # load of the casters from moments about the contact of the rear wheels: `lean` without the
    # chair's own acceleration, and `high` less for every m/s^2 of it; angles turn z into x
    lean = (place[:, :, 0] * (GRAVITY + away[:, :, 1])) @ segments.mass + rest * GRAVITY * front
    lean -= (place[:, :, 1] * away[:, :, 0]) @ segments.mass + twist @ segments.inertia
    high = place[:, :, 1] @ segments.mass + rest * height + float((2.0 * spin / radius).sum())
    drag = (hidden.rolling + chair.rolling_rear) * load
    more = (chair.rolling_caster - chair.rolling_rear) / chair.wheelbase
    force = 2.0 * push / chair.rear_radius - away[:, :, 0] @ segments.mass
    force -= whole * GRAVITY * hidden.slope * start.east

    def gained(k: int, v: float) -> float:
        way = math.tanh(v / 0.005)
        against = way * (drag[k] + more * lean[k])
        return float((force[k] - against) / (whole + turning - way * more * high[k]))

    # Runge and Kutta over two steps of FINE, so that the middle is on the grid
    speed = np.full((time.size - 1) // 2 + 1, start.speed)
    for i in range(speed.size - 1):
        v, k = speed[i], 2 * i
        one = gained(k, v)
        two = gained(k + 1, v + FINE * one)
        three = gained(k + 1, v + FINE * two)
        four = gained(k + 2, v + 2.0 * FINE * three)
        speed[i + 1] = v + FINE * (one + 2.0 * two + 2.0 * three + four) / 3.0
    every = round(1.0 / (2.0 * FINE * RATE))
    at = np.arange(0, speed.size, every)
    gains = np.array([gained(2 * i, speed[i]) for i in at])
    least = float(np.min(lean[2 * at] - high[2 * at] * gains)) / chair.wheelbase
    if least < 0.0:
        raise ValueError(f"the casters would lift: {least:.0f} N; push less")
    return Rolled(time[2 * at], speed[at], gains)


def centre_of_mass(person: Person, segments: Body, time: Array) -> Array:
    """How far the whole person's centre of mass is forward of its mean, m."""
    place = segments.centre(time)[:, :, 0] @ segments.mass / person.mass
    return np.asarray(place - place.mean())


NOISE = {
    "left_wheel_speed": 0.03,
    "right_wheel_speed": 0.03,
    "imu_accelerometer.x": 0.15,
    "heading": 0.005,
}


@dataclass(frozen=True)
class Case:
    """A study: what is hidden in it, its person, whether the motion was measured, and a load."""

    hidden: Hidden
    person: Person = field(default_factory=Person)
    measured: bool = True
    coasts: int = 4
    pushes: int = 4
    load: float = 0.0  # kg, on the chair in the coasts 3 and 4

    def loaded(self, name: str) -> float:
        """The load (kg) of a trial."""
        return self.load if name in ("coast_3", "coast_4") else 0.0


def tables(case: Case, seed: int = 0) -> tuple[dict[str, dict[str, Array]], Mapping[str, float]]:
    """Columns of every trial by its name, and the heading (rad) of each."""
    rng = np.random.default_rng(seed)
    person, chair = case.person, Chair()
    out: dict[str, dict[str, Array]] = {}
    heads: dict[str, float] = {}
    for k in range(case.coasts + case.pushes):
        coast = k < case.coasts
        name = f"coast_{k + 1}" if coast else f"push_{k + 1 - case.coasts}"
        heads[name] = 0.0 if k % 2 == 0 else math.pi
        duration = 8.0
        begins, strength = (np.zeros(0),) * 2 if coast else strokes(person, duration, rng)
        still = coast or not case.hidden.moves
        segments = body(person, chair, duration, begins[:0] if still else begins, strength)
        fine = FINE * np.arange(round(duration / FINE) + 1)
        torque = rims(person, begins, strength, fine)
        start = Start(1.4 if coast else 0.9, math.cos(heads[name]))
        run = roll(
            person, replace(chair, load=case.loaded(name)), case.hidden, segments, torque, start
        )
        out[name] = _sensed(
            case, run, segments, None if coast else (fine, torque), heads[name], rng
        )
    return out, heads


def _sensed(
    case: Case, run: Rolled, segments: Body, torque: tuple[Array, Array] | None, heading: float,
    rng: np.random.Generator,
) -> dict[str, Array]:  # fmt: skip
    """The columns of a table: what was driven, and what sensors saw."""
    columns: dict[str, Array] = {"time": run.time}
    if torque is not None:
        gains = {"left": case.hidden.gain_left, "right": case.hidden.gain_right}
        for side, gain in gains.items():  # both rims are pushed alike: the chair rolls straight
            columns[f"{side}_wheel"] = np.interp(run.time, *torque) / (1.0 + gain)
    clean = {
        "left_wheel_speed": run.speed / Chair().rear_radius,
        "right_wheel_speed": run.speed / Chair().rear_radius,
        "imu_accelerometer.x": run.gained + GRAVITY * case.hidden.slope * math.cos(heading),
        "heading": np.full(run.time.size, heading),
    }
    for name, values in clean.items():
        columns[name] = values + NOISE[name] * rng.standard_normal(run.time.size)
    if case.measured:
        columns["rider_motion"] = centre_of_mass(case.person, segments, run.time)
        columns["rider_motion"] = columns["rider_motion"] + 5e-4 * rng.standard_normal(
            run.time.size
        )
    return columns


def write(case: Case, folder: Path, seed: int = 0) -> None:
    """The study folder."""
    folder.mkdir(parents=True, exist_ok=True)
    trials, heads = tables(case, seed)
    text = ['model = "manual"', 'torque = "measured"', "[noise]"]
    text += [f'"{name}" = {size}' for name, size in NOISE.items()]
    for name, columns in trials.items():
        rows = np.column_stack(list(columns.values())).tolist()
        lines = [",".join(columns), *(",".join(f"{x:.7g}" for x in row) for row in rows)]
        (folder / f"{name}.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
        held = name == f"push_{case.pushes}"
        text += ["[[trial]]", f'file = "{name}.csv"', f'manoeuvre = "{name[:-2]}"']
        text += [
            f"hold_out = {str(held).lower()}",
            "[trial.initial]",
            f"heading = {heads[name]:.6f}",
        ]
        if case.loaded(name):
            text += ["[trial.load]", f"mass = {case.load}"]
            text += [f"forward = {LOADED[0]}", f"height = {LOADED[1]}"]
    (folder / "study.toml").write_text("\n".join(text) + "\n", encoding="utf-8")


CASES = {
    "measured": Case(Hidden(rolling=0.006)),
    "easier": Case(Hidden(rolling=-0.004), Person(bend=math.radians(4.0), period=0.95)),
    "slope": Case(Hidden(rolling=0.005, slope=0.006)),
    "gain": Case(Hidden(rolling=0.005, gain_left=0.10, gain_right=0.10)),
    "gains": Case(Hidden(rolling=0.005, gain_left=0.05, gain_right=-0.03)),
    "loaded": Case(Hidden(rolling=0.005, gain_left=0.05, gain_right=-0.03), load=40.0),
    "strokes": Case(Hidden(), measured=False),
    "strokes_rolling": Case(Hidden(rolling=0.006), measured=False),
    "still": Case(Hidden(moves=False), measured=False),
}


def main(given: Sequence[str] | None = None) -> None:
    """Write every study, and diagnose them if asked."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("out", type=Path)
    parser.add_argument("--only", nargs="*", default=list(CASES))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--diagnose", action="store_true")
    args = parser.parse_args(given)
    for name in args.only:
        write(CASES[name], args.out / name, args.seed)
        if args.diagnose:
            _report(name, args.out / name)


def _report(name: str, folder: Path) -> None:
    from mjchair.diagnosis.diagnose import diagnose

    found = diagnose(folder)
    said = "; ".join(
        f"{e.name} "
        + ", ".join(f"{p} {v.value:.4g}+-{v.std or 0.0:.2g}" for p, v in e.parameters.items())
        for e in found.effects
    )
    said += "; more is missing" if found.more_missing else ""
    rivals = ", ".join(" or ".join(names) for names in found.alternatives)
    print(f"{name}: {found.verdict}: {said or 'no effect'}; undecided: {rivals or 'nothing'}")
    print(f"    hidden: {CASES[name].hidden}")


if __name__ == "__main__":
    main()
