"""Obstacle climbing (after ISO 7176-10:2008): the highest kerb that a chair climbs and descends.

In: a design. Out: heights (mm) of a kerb with a sharp edge, climbed and descended, forward and
backward, from rest with the wheels at the kerb and with a run-up of 0.5 m.

The directions and the run-up follow the standard, and so does the result, the highest obstacle that
the chair passes. Heights are tried in steps of 5 mm. Assumptions: a power chair is driven
with its joystick, a manual one by an even push, at up to 1 m/s; nobody leans or lifts the casters,
so a manual chair climbs without a wheelie.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import mujoco

from mjchair.simulation.settling import NotStandingError
from mjchair.testlab.closed_form import UP
from mjchair.testlab.design import Design, lowest
from mjchair.testlab.drive import Joystick, drive_of, pilot_of
from mjchair.testlab.result import Result, Value
from mjchair.testlab.track import Run, Track, View

NAME = "obstacles"
HEIGHTS = tuple(range(5, 205, 5))  # mm
PACE = 1.0  # m/s, that is asked for; assumption
RUN_UP = 0.5  # m
EDGE = 2.0  # m, x of the kerb's edge
TIME = 6.0  # s, for one attempt
CASES = [
    (f"{way}_{direction}{start}", way, direction, start == "_run_up")
    for way in ("climbed", "descended")
    for direction in ("forward", "backward")
    for start in ("", "_run_up")
]


def obstacles(design: Design, *, timestep: float | None = None) -> Result:
    """The highest kerbs that a chair passes.

    Returns:
      `climbed_forward`, `climbed_forward_run_up`, the same `backward`, and `descended`, mm; 0
      where the chair does not pass the lowest kerb. The run is the highest climb with a run-up.
    """
    values: dict[str, Value] = {}
    runs: dict[str, Run] = {}
    for key, way, direction, run_up in CASES:
        best, run = _highest(design, way, direction, run_up, timestep)
        top = HEIGHTS[-1]
        note = "or more" if best == top else "by 5 mm"
        values[key] = Value(float(best), "mm", note=note)
        if key == "climbed_forward_run_up" and run is not None:
            runs["climb"] = run
    drive = drive_of(design)
    return Result(
        NAME,
        values,
        setup=[
            "kerb with a sharp edge across the way",
            f"run-up {RUN_UP:g} m, or from rest with the first wheels 10 mm before the edge",
            drive.describe()
            if isinstance(drive, Joystick)
            else "a person pushes with up to 35 N m a wheel, no wheelie",
        ],
        notes=[
            "Passed: all wheels are beyond the edge, upright, within 6 s. A chair whose frame "
            "meets the kerb before its wheels do has not passed."
        ],
        curves={way: _heights(values, way) for way in ("climbed", "descended")},
        axes=("forward, forward with run-up, backward, backward with run-up", "kerb, mm"),
        runs=runs,
    )


def _heights(values: Mapping[str, Value], way: str) -> tuple[list[float], list[float]]:
    heights = [float(value.value or 0.0) for key, value in values.items() if key.startswith(way)]
    return [float(i) for i in range(len(heights))], heights


def _highest(
    design: Design, way: str, direction: str, run_up: bool, timestep: float | None
) -> tuple[int, Run | None]:
    """The highest kerb that is passed; a chair that passes one is taken to pass all lower ones."""
    low, high, best = -1, len(HEIGHTS), None
    step = 1
    while high - low > 1:
        # first upward with growing steps, then by bisection
        middle = (low + high) // 2
        if high == len(HEIGHTS):
            middle = min(low + step, high - 1)
            step *= 2
        passed, run = attempt(design, HEIGHTS[middle] / 1000.0, way, direction, run_up, timestep)
        if passed:
            low, best = middle, run
        else:
            high = middle
    return (HEIGHTS[low] if low >= 0 else 0), best


def add_kerb(spec: mujoco.MjSpec, height: float, begin: float, end: float) -> None:
    """A level box on the floor from x = begin to end, m."""
    spec.worldbody.add_geom(
        name="kerb",
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=(0.5 * (end - begin), 3.0, 0.5 * height),
        pos=(0.5 * (begin + end), 0.0, 0.5 * height),
        condim=3,
        friction=(0.7, 0.005, 0.0001),
        rgba=(0.52, 0.50, 0.47, 1.0),
    )
    spec.option.ccd_tolerance = 1e-10
    spec.option.ccd_iterations = 50


def attempt(
    design: Design,
    height: float,
    way: str,
    direction: str,
    run_up: bool,
    timestep: float | None = None,
) -> tuple[bool, Run | None]:
    """Drive once against a kerb (m); whether the chair passes it."""
    forward = direction == "forward"
    probe = Track(design).view
    model, data = probe.model, probe.data
    tires = probe.parts.geoms.values()
    ahead = [float(data.geom_xpos[g][0] + model.geom_size[g, 0]) - probe.x for g in tires]
    behind = [float(data.geom_xpos[g][0] - model.geom_size[g, 0]) - probe.x for g in tires]
    front = max(ahead) if forward else -min(behind)  # reach in the direction of travel
    distance = RUN_UP if run_up else 0.01
    start = EDGE - front - distance
    heading = 0.0 if forward else math.pi
    climbs = way == "climbed"

    def edit(spec: mujoco.MjSpec) -> None:
        if climbs:
            add_kerb(spec, height, EDGE, EDGE + 6.0)
        else:
            add_kerb(spec, height, EDGE - 6.0, EDGE)
            body = next(b for b in spec.bodies if b.name.endswith("chair"))
            body.pos = (body.pos[0], body.pos[1], body.pos[2] + height)

    try:
        track = Track(design, edit=placed(edit, start, heading), timestep=timestep, driven=True)
    except NotStandingError:  # it stands without the kerb: its frame is over the edge
        return False, None
    drive = drive_of(design)
    pilot = pilot_of(drive, track)
    speed = min(drive.top_speed, PACE) if forward else -min(drive.reverse_speed, PACE)

    def beyond(view: View) -> bool:
        places = (float(view.data.geom_xpos[g][0]) for g in view.parts.geoms.values())
        return all(place > EDGE + 0.05 for place in places)

    ended = track.drive(
        lambda view: pilot.go(view, speed),
        TIME,
        until=lambda view: beyond(view) or view.upright < 0.5,
    )
    view = track.view
    if not ended or view.upright < 0.5:
        return False, None
    track.drive(pilot.stop, 1.0)
    stands = view.upright > 0.94 and all(
        lowest(view.model, view.data, g, UP)[2] > (height if climbs else 0.0) - 0.01
        for g in view.parts.geoms.values()
    )
    return stands, track.run() if stands else None


def placed(
    edit: Callable[[mujoco.MjSpec], None], x: float, heading: float
) -> Callable[[mujoco.MjSpec], None]:
    """An edit that also puts the chair's axle at x (m), turned by a heading (rad)."""

    def whole(spec: mujoco.MjSpec) -> None:
        edit(spec)
        body = next(b for b in spec.bodies if b.name.endswith("chair"))
        site = next(s for s in spec.sites if s.name.endswith("axle"))
        c, s = math.cos(heading), math.sin(heading)
        at = site.pos
        body.pos = (x - (c * at[0] - s * at[1]), -(s * at[0] + c * at[1]), body.pos[2])
        body.quat = (math.cos(0.5 * heading), 0.0, 0.0, math.sin(0.5 * heading))

    return whole
