"""Energy: of chairs with motors after ISO 7176-4:2008, of manual chairs as the work of the push.

In: a design. Out: for chairs with motors the consumption (Wh/km) and the range (km), for laps
without a stop and for laps with manoeuvres; for manual chairs the energy per metre (J/m) at 1 m/s,
straight and in turns, on tile and on carpet.

Laps of a level track in both directions, and a continuous and a manoeuvring test, follow the
standard. The course of the standard was not available. Assumptions: a lap consists of two straights
of 5 m and two half turns of 1 m radius; in a manoeuvring lap the chair stops after every straight
and turns on the spot. There is no warm-up. The battery is that of the chair's drive, and 80 % of
its energy is used. Carpet adds 0.0118 to the rolling resistance coefficient (Hoffman 2003).
"""

from __future__ import annotations

import math

import mujoco
import numpy as np

from mjchair.testlab.design import Design
from mjchair.testlab.drive import STILL, Joystick, Person, Pilot, drive_of, pilot_of
from mjchair.testlab.result import Result, Value
from mjchair.testlab.track import Command, Run, Track, View
from mjchair.tire import block
from mjchair.units import per_cent

NAME = "energy"
CARPET = 0.0118  # 1, Hoffman 2003
PACE = 1.0  # m/s, of manual chairs, and of power chairs in half turns; assumption
TURN = 0.7  # rad/s, of the turns of a manual chair
STRAIGHT, RADIUS = 5.0, 1.0  # m
USED = 0.8  # share of the battery's energy that is used; assumption
WARM, READ = 2.0, 8.0  # s


def energy(design: Design, *, timestep: float | None = None) -> Result:
    """The energy that a chair needs for a distance.

    Returns:
      With motors: `consumption_continuous`, `consumption_manoeuvring` (Wh/km), `range_continuous`,
      `range_manoeuvring` and the smaller of the two, `range` (km). Without: `energy_straight_tile`,
      `energy_straight_carpet`, `energy_turning_tile`, `energy_turning_carpet` (J/m).
    """
    drive = drive_of(design)
    if isinstance(drive, Joystick):
        return _motors(design, drive, timestep)
    return _person(design, drive, timestep)


def carpet(spec: mujoco.MjSpec) -> None:
    """Give every tire the rolling resistance of a carpet."""
    for geom in spec.geoms:
        if len(geom.userdata) and geom.userdata[block.TAG_AT] == block.TAG:
            tire = np.array(geom.userdata)
            tire[block.ROLLING_RESISTANCE] += CARPET
            geom.userdata = tire


def _person(design: Design, drive: Person, timestep: float | None) -> Result:
    values, runs = {}, {}
    for floor, edit in (("tile", None), ("carpet", carpet)):
        for way, yaw in (("straight", 0.0), ("turning", TURN)):
            track = Track(design, speed=PACE, yaw_rate=yaw, edit=edit, timestep=timestep)
            used, run = _steady(track, drive, yaw)
            values[f"energy_{way}_{floor}"] = Value(used, "J/m")
            runs[f"{way}-{floor}"] = run
    lines = {
        f: [values[f"energy_{w}_{f}"].value for w in ("straight", "turning")]
        for f in ("tile", "carpet")
    }
    return Result(
        NAME,
        values,
        setup=[f"{PACE:g} m/s on the level; turns at {TURN:g} rad/s", f"carpet adds {CARPET:g}"],
        notes=[
            "Work of an even push over the path of the axle's middle; "
            "braking a wheel costs nothing."
        ],
        curves={f: ([0.0, TURN], [float(v) for v in pair]) for f, pair in lines.items()},  # type: ignore[arg-type]
        axes=("turn, rad/s", "energy, J/m"),
        runs=runs,
    )


def _steady(track: Track, drive: Person, yaw: float) -> tuple[float, Run]:
    """Energy per metre (J/m) of steady driving, and the run."""
    pilot = pilot_of(drive, track)

    def hold(view: View) -> Command:
        return pilot.go(view, PACE, yaw)

    track.drive(hold, WARM)
    before, way = pilot.energy, [0.0]
    last = [track.view.x, track.view.y]

    def watch(view: View) -> None:
        way[0] += math.dist(last, (view.x, view.y))
        last[:] = [view.x, view.y]

    track.drive(hold, READ, watch=watch)
    return (pilot.energy - before) / way[0], track.run()


def _motors(design: Design, drive: Joystick, timestep: float | None) -> Result:
    values: dict[str, Value] = {}
    curves, runs = {}, {}
    for name, lap in (("continuous", _lap), ("manoeuvring", _manoeuvres)):
        track = Track(design, timestep=timestep, driven=True)
        pilot = pilot_of(drive, track)
        seen: list[tuple[float, float]] = [(track.view.x, track.view.y)]
        for way in (1.0, -1.0):  # one lap in each direction
            lap(track, pilot, drive.top_speed, way, seen)
        path = np.array(seen)
        distance = float(np.hypot(*np.diff(path, axis=0).T).sum())
        used = pilot.energy / 3600.0 / (distance / 1000.0)
        values[f"consumption_{name}"] = Value(used, "Wh/km")
        values[f"range_{name}"] = Value(drive.battery * USED / used, "km")
        curves[name] = (
            [float(x) for x in path[::10, 0]],
            [float(y) for y in path[::10, 1]],
        )
        runs[name] = track.run()
    ranges = [float(values[f"range_{name}"].value) for name in curves]  # type: ignore[arg-type]
    values["range"] = Value(min(ranges), "km", note="the lesser")
    return Result(
        NAME,
        values,
        setup=[
            f"laps of two straights of {STRAIGHT:g} m and two half turns, once each way round",
            f"battery {drive.battery:.0f} Wh, {per_cent(USED)} used",
            drive.describe(),
        ],
        curves=curves,
        axes=("x, m", "y, m"),
        runs=runs,
    )


def _seen(seen: list[tuple[float, float]], view: View) -> None:
    seen.append((view.x, view.y))


def _straight(track: Track, pilot: Pilot, speed: float, seen: list[tuple[float, float]]) -> None:
    begin = (track.view.x, track.view.y)
    track.drive(
        lambda view: pilot.go(view, speed),
        30.0,
        until=lambda view: math.dist((view.x, view.y), begin) > STRAIGHT,
        watch=lambda view: _seen(seen, view),
    )


def _turned(
    track: Track, pilot: Pilot, speed: float, yaw: float, seen: list[tuple[float, float]]
) -> None:
    begin = track.view.heading
    track.drive(
        lambda view: pilot.go(view, speed, yaw),
        30.0,
        until=lambda view: abs(view.heading - begin) > math.pi,
        watch=lambda view: _seen(seen, view),
    )


def _lap(
    track: Track, pilot: Pilot, top: float, way: float, seen: list[tuple[float, float]]
) -> None:
    """Straights at full speed, half turns at walking pace."""
    around = min(top, PACE)
    for _ in range(2):
        _straight(track, pilot, top, seen)
        _turned(track, pilot, around, way * around / RADIUS, seen)


def _manoeuvres(
    track: Track, pilot: Pilot, top: float, way: float, seen: list[tuple[float, float]]
) -> None:
    """Straights with a stop at their end, and a turn on the spot."""
    for _ in range(2):
        _straight(track, pilot, top, seen)
        track.drive(
            pilot.stop,
            4.0,
            until=lambda view: view.speed < STILL,
            watch=lambda view: _seen(seen, view),
        )
        _turned(track, pilot, 0.0, way * 1.0, seen)
