"""Dynamic stability (after ISO 7176-2:2017): starts, stops, turns and a kerb drop, on slopes.

In: a design. Out: for every manoeuvre and slope (0, 3, 6, 10 deg) a score: 3 no wheel lifts,
2 wheels lift and come back, 1 the chair is stuck on its anti-tippers, 0 it tips over; and the
steepest slope up to which no manoeuvre scores less than 2.

The kinds of manoeuvres and the slopes follow the standard, and so does the event that is judged: a
wheel lifts that should stay on the ground. The scores were not checked against the text of the
standard, which was not available. Assumptions: the joystick is fully deflected and not
corrected; the kerb is 50 mm high; the anti-tippers are those of the model. The standard covers
chairs with motors only; a manual chair is driven here by an even push.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import mujoco

from mjchair.testlab.design import Design
from mjchair.testlab.drive import Driving, Joystick, drive_of, pilot_of
from mjchair.testlab.obstacles import EDGE, RUN_UP, add_kerb, placed
from mjchair.testlab.result import Grid, Result, Value
from mjchair.testlab.track import Command, Run, Track, View

NAME = "dynamic-stability"
SLOPES = (0.0, 3.0, 6.0, 10.0)  # deg
DROP = 0.05  # m
TRANSIENT = 0.02  # s: a wheel that is off the ground for less does not count as lifted
WORDS = {
    3: "no wheel lifts",
    2: "wheels lift and come back",
    1: "stuck on the anti-tippers",
    0: "tips over",
}


RELEASE, REVERSE = "release", "reverse"


@dataclass(frozen=True)
class Manoeuvre:
    """One manoeuvre.

    Attributes:
      name: in words. facing: 1 up the slope, -1 down, 0 across it. begin: initial speed, m/s.
      speed, yaw: commanded, as shares of the drive's top speed and of the turn's rate.
      then: how it is stopped after a second, by release or by reverse; None: it goes on. drop: the
        chair drives off a kerb.
    """

    name: str
    facing: int
    begin: float
    speed: float
    then: str | None = None
    yaw: float = 0.0
    drop: bool = False


MANOEUVRES = (
    Manoeuvre("start forward, facing up", 1, 0.0, 1.0),
    Manoeuvre("stop by release, driving up", 1, 1.0, 1.0, RELEASE),
    Manoeuvre("stop by reverse, driving up", 1, 1.0, 1.0, REVERSE),
    Manoeuvre("start backward, facing down", -1, 0.0, -1.0),
    Manoeuvre("stop, driving backward down, facing up", 1, -0.6, -0.6, RELEASE),
    Manoeuvre("stop by release, driving down", -1, 1.0, 1.0, RELEASE),
    Manoeuvre("stop by reverse, driving down", -1, 1.0, 1.0, REVERSE),
    Manoeuvre("turn at full speed, driving across", 0, 1.0, 1.0, None, 1.0),
    Manoeuvre("turn on the spot", 1, 0.0, 0.0, None, 1.0),
    Manoeuvre("off a kerb of 50 mm, forward", -1, 0.0, 0.6, None, 0.0, True),
)
LATERAL = 2.0  # m/s^2, lateral acceleration of the turn at full speed; assumption


def dynamic_stability(design: Design, *, timestep: float | None = None) -> Result:
    """Scores of driving manoeuvres on slopes.

    Returns:
      `<manoeuvre>_<slope>_deg` scores, and `steepest_safe_slope` (deg).
    """
    drive = drive_of(design)
    values: dict[str, Value] = {}
    rows = []
    runs: dict[str, Run] = {}
    worst = {slope: 3 for slope in SLOPES}
    for manoeuvre in MANOEUVRES:
        row: list[float | str | None] = [manoeuvre.name]
        for slope in SLOPES:
            score, run = score_of(design, drive, manoeuvre, math.radians(slope), timestep)
            key = manoeuvre.name.replace(", ", "_").replace(" ", "_")
            values[f"{key}_{slope:g}_deg"] = Value(score, "", note=WORDS[score])
            row.append(float(score))
            if score < worst[slope]:
                worst[slope] = score
                runs[f"worst-{slope:g}-deg"] = run
        rows.append(tuple(row))
    safe = None
    for slope in SLOPES:
        if worst[slope] < 2:
            break
        safe = slope
    note = "no slope tried makes it stay lifted or tip" if safe == SLOPES[-1] else ""
    if safe is None:
        note = "it stays lifted or tips on the level"
    steepest = Value(safe, "deg", note=note)
    notes = (
        []
        if isinstance(drive, Joystick)
        else [
            "The standard is for chairs with motors; here a person pushes evenly with up to "
            "35 N m a wheel."
        ]
    )
    return Result(
        NAME,
        {"steepest_safe_slope": steepest, **values},
        setup=[
            "hard dry slope",
            *([drive.describe()] if isinstance(drive, Joystick) else []),
            "score 3 no lift, 2 lift and return, 1 stuck, 0 tips over",
        ],
        grids=[Grid("Scores", ("manoeuvre", *(f"slope {s:g}" for s in SLOPES)), tuple(rows))],
        notes=notes,
        curves={"worst score": ([float(s) for s in SLOPES], [float(worst[s]) for s in SLOPES])},
        axes=("slope, deg", "score"),
        runs=runs,
    )


def score_of(
    design: Design,
    drive: Driving,
    manoeuvre: Manoeuvre,
    slope: float,
    timestep: float | None = None,
) -> tuple[int, Run]:
    """The score of one manoeuvre on one slope (rad), and the run."""
    track = _track(design, drive, manoeuvre, slope, timestep)
    pilot = pilot_of(drive, track, sideways=8.0)
    yaw = manoeuvre.yaw * (LATERAL / drive.top_speed if manoeuvre.speed else 2.0)
    lifted = {wheel: 0.0 for wheel in track.view.parts.geoms}
    state = {"lift": False, "last": False, "since": track.view.time}

    def watch(view: View) -> None:
        over = _near_edge(view) if manoeuvre.drop else False
        for wheel, load in view.loads.items():
            lifted[wheel] = lifted[wheel] + 0.01 if load < 1.0 else 0.0
        off = max(lifted.values()) > TRANSIENT
        state["last"] = max(lifted.values()) > 0.3
        if off and not over:
            state["lift"] = True

    def command(view: View) -> Command:
        if manoeuvre.then is not None and view.time > 1.0:
            return pilot.stop(view, reverse=manoeuvre.then == REVERSE)
        return pilot.ask(view, _speed(drive, manoeuvre.speed), yaw if view.time > 0.5 else 0.0)

    fell = track.drive(command, 4.0, until=lambda view: view.upright < 0.5, watch=watch)
    if fell:
        return 0, track.run()
    if state["last"] and track.view.touching(track.view.parts.anti_tippers):
        return 1, track.run()
    if state["last"] and max(abs(track.view.pitch), abs(track.view.roll)) > 0.05:
        return 1, track.run()
    return (2 if state["lift"] else 3), track.run()


def _track(
    design: Design, drive: Driving, manoeuvre: Manoeuvre, slope: float, timestep: float | None
) -> Track:
    uphill = slope * manoeuvre.facing
    across = slope if manoeuvre.facing == 0 else 0.0
    edit: Callable[[mujoco.MjSpec], None] | None = None
    if manoeuvre.drop:
        edit = placed(_kerb_down, EDGE - RUN_UP - 0.6, 0.0)
    return Track(
        design,
        slope=uphill,
        across=across,
        speed=_speed(drive, manoeuvre.begin),
        edit=edit,
        timestep=timestep,
        driven=True,
    )


def _speed(drive: Driving, share: float) -> float:
    """A share of the top speed, forward or backward, m/s."""
    return share * (drive.top_speed if share > 0.0 else drive.reverse_speed)


def _kerb_down(spec: mujoco.MjSpec) -> None:
    add_kerb(spec, DROP, EDGE - 6.0, EDGE)
    body = next(b for b in spec.bodies if b.name.endswith("chair"))
    body.pos = (body.pos[0], body.pos[1], body.pos[2] + DROP)


def _near_edge(view: View) -> bool:
    """Whether a wheel is at the kerb's edge, where loss of contact does not count as lift."""
    return any(
        abs(float(view.data.geom_xpos[g][0]) - EDGE) < 0.25 for g in view.parts.geoms.values()
    )
