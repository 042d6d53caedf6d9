"""One instrument's file as channels of a chair, in forward signs, on the instrument's own clock.

In: a `Source`. Out: an `Instrument`. The signs of instrumented wheels are weighed over all files of
a wheel, because one file may roll backwards or hold no push.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mjchair.errors import MjchairError
from mjchair.measurement import baseline as baselines
from mjchair.measurement import imu, smartwheel, table_wheels
from mjchair.measurement.exports import read_export
from mjchair.measurement.gather.sources import Source
from mjchair.measurement.notes import Detail, about
from mjchair.measurement.sensors import rolls, sensor
from mjchair.measurement.smartwheel import Orientation, PushRim
from mjchair.measurement.torque import check_torques
from mjchair.rider.anatomy import JOINT_NAMES
from mjchair.simulation.inputs import OTHER_COLUMNS
from mjchair.simulation.table import Table, check_units, read_table
from mjchair.units import per_cent

Array = NDArray[np.float64]

OTHER = {"left": "right", "right": "left"}
ROLLING = 0.3  # rad/s, above which a wheel is taken to roll
COAST = 0.98  # share of a rolling recording without a hand, above which it is a coast
CHAIR_SPEED = "chair_speed"  # m/s, a column of a rider's motion
CHAIR_HEADING = "chair_heading"  # rad, in the laboratory, the same
RIDER_COLUMNS = {*JOINT_NAMES, "rider_motion", CHAIR_SPEED, CHAIR_HEADING}
RADIUS = 0.3  # m, of a rear wheel where nothing tells it: about 24 inches across, under load
# words that tell a side to everybody
FULL = {"left", "right", "leftwheel", "rightwheel", "gauche", "droite", "links", "rechts"}
SEEN = 0.7  # share of the time below which it is said how little of the chair is seen
# a file of markers and the static trial beside it -> the table of the rider's motion, and notes
ReadsMarkers = Callable[[Path, Path | None], tuple[Table, Sequence[str]]]


@dataclass(frozen=True)
class Instrument:
    """What one instrument measured.

    Attributes:
      name: of its file, for lines and legends. source: the file. time: (n,), s, its own clock.
      channels: study channel -> (n,), NaN where a sample is missing. torque: wheel -> (n,), N m.
      speed: (n,) rad/s of a wheel, forward, that shows the motion; None. side: of that wheel.
      gyroscope, accelerometer: (n, 3) of a sensor on the frame, in its own axes; None.
      trigger: time at which its trigger rises, s; None. free: (n,), without a hand; None.
      radius: of the wheel, m, from the file; None. ground: (n,) m/s, of the chair over the floor,
        by markers; None. facing: (n,) rad, of its forward axis in the laboratory, the same.
        doubted: whether its signs are those of a wheel of the other side. assumed: rate, Hz, that
        its clock has by assumption; None: it is known.
      bare: file of the untouched rim whose offset was taken off; "": none.
      notes: one line each.
    """

    name: str
    source: Source
    time: Array
    channels: Mapping[str, Array] = field(default_factory=dict)
    torque: Mapping[str, Array] = field(default_factory=dict)
    speed: Array | None = None
    side: str = ""
    gyroscope: Array | None = None
    accelerometer: Array | None = None
    trigger: float | None = None
    free: NDArray[np.bool_] | None = None
    radius: float | None = None
    ground: Array | None = None
    facing: Array | None = None
    doubted: bool = False
    assumed: float | None = None
    bare: str = ""
    notes: tuple[str, ...] = ()

    @property
    def sides(self) -> tuple[str, ...]:
        """The sides of the wheels that it measured, of "left" and "right"."""
        names = (*self.channels, *self.torque)
        return tuple(s for s in OTHER if any(name.startswith(f"{s}_wheel") for name in names))

    @property
    def seen(self) -> NDArray[np.bool_]:
        """Where the motion is seen, (n,); between markers that were lost `speed` is a line."""
        if self.ground is None:
            return np.ones(self.time.size, bool)
        return np.isfinite(self.ground)

    def courses(self) -> dict[str, Array]:
        """Side -> the speed (n,) rad/s of each wheel that shows the motion; "": of markers."""
        if self.speed is None:
            return {}
        found = {s: table_wheels.motion(self.time, self.channels, s) for s in self.sides}
        told = {side: speed for side, speed in found.items() if speed is not None}
        return told if len(told) > 1 else {self.side: self.speed}


def read_instruments(
    sources: Sequence[Source], of_markers: ReadsMarkers | None = None
) -> list[Instrument]:
    """Every file that is no baseline, as an instrument.

    Args:
      of_markers: makes the table of a rider's motion of a file of markers; None: such files are
        left out.

    Raises:
      MjchairError: as the readers do, two files of one wheel in one trial, or one recording in
        two files.
    """
    wheels = _wheels([s for s in sources if s.kind == "smartwheel"])
    others = [_imu(s) for s in sources if s.kind == "imu" and s.place != "body"]
    tables = [_table(s) for s in sources if s.kind == "table"]
    markers = [s for s in sources if s.kind == "markers" and not s.still]
    riders = [_rider(s, *of_markers(s.path, _still(s, sources))) for s in markers if of_markers]
    return [*wheels, *others, *tables, *riders]


def _still(source: Source, sources: Sequence[Source]) -> Path | None:
    """The static trial of markers whose name is nearest to a run's; None without one."""
    rests = [s for s in sources if s.kind == "markers" and s.still]
    words = set(source.trial.split("_"))
    best = max(rests, key=lambda s: len(words & set(s.trial.split("_"))), default=None)
    return None if best is None else best.path


def _rider(source: Source, table: Table, notes: Sequence[str] = ()) -> Instrument:
    """The motion of a rider: joints (rad), centre of mass (m), and the chair's speed (m/s)."""
    time, columns = np.asarray(table.time), dict(table.columns)
    ground = columns.pop(CHAIR_SPEED, None)
    facing = columns.pop(CHAIR_HEADING, None)
    name = source.path.name
    said = [about(name, note) for note in notes]
    told = sum(column in JOINT_NAMES for column in columns)
    of = f"motion of the rider, {told} of {len(JOINT_NAMES)} joints told"
    said.append(Detail(f"{name}: {of}"))
    speed = None
    if ground is not None:
        there = np.isfinite(ground)
        if there.mean() < SEEN:
            said.append(f"{name}: the chair is seen in {per_cent(there.mean())} of the time")
        # a wheel of the usual radius; clocks are put together by its course alone
        speed = np.interp(time, time[there], ground[there]) / RADIUS
    return Instrument(
        name, source, time, columns, speed=speed, ground=ground, facing=facing, notes=tuple(said)
    )


def _wheels(sources: list[Source]) -> list[Instrument]:
    runs = [(s, smartwheel.read_smartwheel(s.path)) for s in sources if not s.baseline]
    rests = [(s, smartwheel.read_smartwheel(s.path)) for s in sources if s.baseline]
    _check_twins([run for _, run in (*runs, *rests)])
    signs = [smartwheel.orientation(run) for _, run in runs]
    named = _sides([s for s, _ in runs], signs)
    found = []
    for side in ("left", "right"):
        mine = [i for i, (given, _) in enumerate(named) if given == side]
        joint = _joint(side, [signs[i] for i in mine], [runs[i][1] for i in mine])
        for i in mine:
            source, run = runs[i]
            rest = _rest(source, side, rests, single=len({s for s, _ in named}) == 1)
            one = _wheel(source, run, (side, joint, named[i][1]), rest)
            found.append(replace(one, doubted=signs[i].side == OTHER[side]))
    return found


def _check_twins(runs: Sequence[PushRim]) -> None:
    """Refuse two files with the samples of one recording.

    Raises:
      MjchairError: naming both.
    """
    for k, run in enumerate(runs):
        for other in runs[:k]:
            if np.array_equal(run.forces, other.forces) and np.array_equal(run.angle, other.angle):
                raise MjchairError(
                    f"{Path(run.source).name} holds the samples of {Path(other.source).name} "
                    "again; keep one"
                )


def idle_baselines(sources: Sequence[Source], instruments: Sequence[Instrument]) -> list[str]:
    """A line for each recording of an untouched rim whose offset no run has used."""
    used = {one.bare for one in instruments}
    out = []
    for source in sources:
        if source.kind != "smartwheel" or not source.baseline or str(source.path) in used:
            continue
        why = "the name of another baseline is nearer to those of the runs"
        if not source.side:
            why = "both wheels are instrumented, and its name tells no side"
        elif source.side not in {one.side for one in instruments if one.source.kind == source.kind}:
            why = f"it is of the {source.side} rim, and no recording of that rim in use is there"
        out.append(f"{source.path.name} is not used: {why}")
    return out


def _sides(sources: list[Source], signs: list[Orientation]) -> list[tuple[str, str]]:
    """The side of every wheel's file, and a note where it is not its name that tells."""
    out: list[tuple[str, str]] = []
    for i, source in enumerate(sources):
        beside = [k for k, s in enumerate(sources) if s.trial == source.trial and k != i]
        told = [sources[k].side for k in beside if sources[k].side]
        if source.side:
            side, why = source.side, ""
            if source.side_word and source.side_word not in FULL:
                why = f"{source.side_word!r} in its name tells the side"
            if signs[i].side == OTHER[side]:
                why = f"its name says {side}; its signs are those of a {OTHER[side]} wheel"
        elif told:
            side, why = OTHER[told[0]], f"taken as the {OTHER[told[0]]} wheel: the other is named"
        elif signs[i].side:
            side, why = signs[i].side, f"its signs are those of a {signs[i].side} wheel"
        else:
            side = "left" if not beside or i < min(beside) else "right"
            why = f"neither name nor signs tell its side; taken as {side}, say it in gather.toml"
        twins = [k for k in beside if k < i and out[k][0] == side]
        if twins:
            raise MjchairError(
                f"{source.path.name} and {sources[twins[0]].path.name} are both of the {side} "
                f"wheel in trial {source.trial!r}; name left and right, or say it in gather.toml"
            )
        out.append((side, why))
    return out


def _joint(side: str, signs: Sequence[Orientation], runs: Sequence[PushRim]) -> Orientation:
    """The signs of one wheel from all its files: pushes tell, and what rolls furthest.

    A run that goes backwards has the signs of the other side, and so has one whose sides are
    swapped; neither tells, unless they are most of the runs.
    """
    if not signs:
        return Orientation(1, 1, "", False)
    clear = [i for i, s in enumerate(signs) if s.clear]
    agree = [i for i in clear if signs[i].side == side]
    if agree and len(agree) >= sum(signs[i].side == OTHER[side] for i in clear):
        clear = agree
    which = clear or range(len(signs))
    net = sum(float(runs[i].angle[-1] - runs[i].angle[0]) for i in which)
    travel = -1 if net < 0.0 else 1
    work = sum(smartwheel.moment_work(runs[i]) * travel for i in clear)
    return Orientation(travel, -1 if work < 0.0 else 1, "", bool(clear))


def _rest(
    source: Source, side: str, rests: list[tuple[Source, PushRim]], single: bool
) -> PushRim | None:
    """The recording of the untouched rim of that side whose name is nearest."""
    mine = [(s, run) for s, run in rests if s.side == side or (not s.side and single)]
    if not mine:
        return None
    words = set(source.trial.split("_"))
    return max(mine, key=lambda one: len(words & set(one[0].trial.split("_"))))[1]


def _wheel(
    source: Source, run: PushRim, told: tuple[str, Orientation, str], rest: PushRim | None
) -> Instrument:
    """An instrumented wheel: angle, and the hand's torque where there was a hand."""
    side, signs, why = told
    base = baselines.choose(run, rest)
    bare = baselines.take_off(run, base)
    free = baselines.hands_off(bare)
    clean = smartwheel.turned(bare, signs)
    name = source.path.name
    wheel = f"{name}: {side} wheel; {_signs_text(signs)}"
    notes = [*run.notes, f"{wheel}; {why}" if why else Detail(wheel), *smartwheel.at_its_end(run)]
    size = float(np.hypot(base.cosine[:2], base.sine[:2]).max())
    taken = (
        f"{name}: offset {base.offset[5]:+.2f} N m and rim's weight {size:.1f} N once a turn taken "
        f"off by {base.how}; {base.left[5]:.2f} N m is left"
    )
    notes.append(Detail(taken))
    if clean.angle[-1] - clean.angle[0] < -smartwheel.ROLLS:
        notes.append(f"{name}: rolls backwards on balance")
    # From the first roll to the last: at the start from rest a hand pushes while the wheel is slow.
    rolling = np.flatnonzero(np.abs(clean.speed) > ROLLING)
    channels = {f"{side}_wheel_angle": np.where(clean.there, clean.angle, np.nan)}
    torque = {f"{side}_wheel": clean.torque}
    unmeasured = smartwheel.without_moment(run)
    if unmeasured:
        torque = {}
        notes.append(f"{name}: {unmeasured}; its motion alone is used")
    elif rolling.size and free[rolling[0] : rolling[-1] + 1].mean() > COAST:
        torque = {}
        notes.append(Detail(f"{name}: no hand on the rim; a coast, its torque is left out"))
    if torque:
        channels[f"{side}_wheel_force"] = smartwheel.hand_force(clean)
    return Instrument(
        name=name,
        source=source,
        time=np.asarray(clean.time),
        channels=channels,
        torque=torque,
        speed=clean.speed,
        side=side,
        free=None if unmeasured else free,
        radius=_radius(clean),
        bare="" if rest is None else rest.source,
        notes=tuple(notes),
    )


def _signs_text(signs: Orientation) -> str:
    way = "counts down" if signs.travel < 0 else "counts up"
    drive = "Mz < 0 drives forward" if signs.moment < 0 else "Mz > 0 drives forward"
    return f"{way} as it rolls forward, {drive}" + ("" if signs.clear else " (no push tells it)")


def _radius(run: PushRim) -> float | None:
    """The radius that the instrument was set to, from its own speed column; m."""
    fast = np.abs(run.speed) > 1.0
    if fast.sum() < 100:
        return None
    radius = float(np.abs(run.ground_speed[fast]) @ np.abs(run.speed[fast]))
    radius /= float(run.speed[fast] @ run.speed[fast])
    return radius if 0.15 < radius < 0.5 else None


def _imu(source: Source) -> Instrument:
    """An inertial sensor on a wheel or on the frame; its own axes are kept for the frame."""
    assert source.file is not None and source.format is not None
    export = read_export(source.file, source.format)
    name = _short(source.path)
    gyroscope, notes = export.gyroscope, list(export.notes)
    if gyroscope is None:
        raise MjchairError(f"{source.path}: the mapping {export.format} has no gyroscope")
    axis = imu.axle(gyroscope)
    if source.place in ("left_wheel", "right_wheel") or (not source.place and axis is not None):
        side = source.place.removesuffix("_wheel") or source.side
        if not side:
            raise MjchairError(
                f"{source.path}: it sits on a wheel, and nothing says which; name it left or "
                f'right, or say place = "left_wheel" in gather.toml'
            )
        axis = axis if axis is not None else imu.axle(gyroscope * 1e3)
        assert axis is not None
        gyroscope, said_of_it = imu.without_offset(
            export.time, gyroscope, imu.still(export.time, gyroscope), name
        )
        notes += said_of_it
        speed = gyroscope @ axis
        tilt = ", ".join(f"{a:+.2f}" for a in axis)
        sits = f"{name}: on the {side} wheel; its axle is ({tilt}) of the sensor's axes"
        notes.append(Detail(sits))
        return Instrument(
            name, source, export.time, {f"{side}_wheel_speed": speed}, {}, speed, side,
            trigger=export.trigger, notes=tuple(notes), assumed=export.assumed,
        )  # fmt: skip
    accelerometer = export.accelerometer
    if accelerometer is not None:
        accelerometer, said = imu.in_si(accelerometer, name)
        notes += [said] if said else []
    return Instrument(
        name, source, export.time, gyroscope=gyroscope, accelerometer=accelerometer,
        trigger=export.trigger, notes=tuple(notes), assumed=export.assumed,
    )  # fmt: skip


def _short(path: Path) -> str:
    generic = path.stem.lower() in ("sensors", "inertial", "calinertialandmag")
    return f"{path.parent.name}/{path.name}" if generic else path.name


def _units(columns: Iterable[str]) -> dict[str, str]:
    """SI units of a table's columns of wheels, IMU and chair, by their names."""
    sensed = {c: sensor(c).unit for c in columns if rolls(c) or c.startswith("imu_")}
    return {**sensed, "left_wheel": "N m", "right_wheel": "N m", **OTHER_COLUMNS}


def _table(source: Source) -> Instrument:
    """A table whose columns are a study's, by name or by a mapping."""
    export = None
    if source.format is not None and source.file is not None:
        export = read_export(source.file, source.format)
        time, columns, trigger = export.time, dict(export.columns), export.trigger
    else:
        table = read_table(source.path)
        check_units(table, _units(table.columns))
        if RIDER_COLUMNS & set(table.columns) and not _of_wheel(table):
            return _rider(source, table)
        time, columns, trigger = np.asarray(table.time), dict(table.columns), None
    wheels: tuple[str, ...] = ("left_wheel", "right_wheel")
    columns, notes = table_wheels.put_right(time, columns, source.path.name, export is None)
    notes = [*export.notes, *notes] if export is not None else notes
    torque = {name: columns.pop(name) for name in wheels if name in columns}
    check_torques(torque, source.path.name)
    courses = {one: table_wheels.motion(time, columns, one) for one in ("left", "right")}
    side = next((one for one, speed in courses.items() if speed is not None), "")
    return Instrument(
        source.path.name, source, time, columns, torque, courses.get(side), side,
        trigger=trigger, notes=tuple(notes),
    )  # fmt: skip


def _of_wheel(table: Table) -> bool:
    """Whether a table has anything that an instrument on the chair measures."""
    return any(name not in RIDER_COLUMNS for name in table.columns)


def shifted(instrument: Instrument, time: Array, notes: Sequence[str] = ()) -> Instrument:
    """The instrument on another clock, with notes on it."""
    return replace(instrument, time=time, notes=(*instrument.notes, *notes))
