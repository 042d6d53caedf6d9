"""Downhill bump: a chair rolls down a slope and over a bump that lies across its path.

In: a design. Out: what happens on slopes of 0 to 15 deg with bumps of 0 to 40 mm: the chair passes
the bump, stops, or tips forward or backward, or the occupant lifts off the seat.

The test and its ranges follow a study of the downhill stability of manual wheelchairs (J NeuroEng
Rehabil 2018, 10.1186/s12984-018-0450-3). Assumptions: the chair coasts from 1.5 m/s, 0.5 m before
the bump; the bump is a bar, 40 mm long in the direction of travel; the occupant does not move on
the seat, and counts as lifting off it where the seat would have to pull the occupant down.
"""

from __future__ import annotations

import math
from collections import Counter

import mujoco
import numpy as np

from mjchair.testlab.design import GRAVITY, Design
from mjchair.testlab.obstacles import add_kerb
from mjchair.testlab.result import Grid, Result, Value
from mjchair.testlab.track import Run, Track, View, coast

NAME = "downhill-bump"
SLOPES = (0.0, 3.75, 7.5, 11.25, 15.0)  # deg
BUMPS = (0.0, 10.0, 20.0, 30.0, 40.0)  # mm
SPEED = 1.5  # m/s
DEPTH = 0.04  # m
BEFORE = 0.5  # m from the front wheels to the bump
TIME = 4.0  # s


def downhill_bump(design: Design, *, timestep: float | None = None) -> Result:
    """The outcome for every slope and bump.

    Returns:
      `slope_<slope>_bump_<bump>`: "passes", "stops", "tips forward", "tips backward" or
      "load leaves the seat"; and the highest bump (mm) that the chair passes on level ground and on
      7.5 deg.
    """
    values: dict[str, Value] = {}
    rows, runs = [], {}
    for slope in SLOPES:
        row: list[float | str | None] = [f"{slope:g} deg"]
        highest = 0.0
        passing = True
        for bump in BUMPS:
            outcome, run = attempt(design, math.radians(slope), bump / 1000.0, timestep=timestep)
            key = f"slope_{slope:g}_bump_{bump:g}".replace(".", "_")
            values[key] = Value(outcome)
            row.append(outcome)
            passing = passing and outcome in ("passes", "load leaves the seat")
            highest = bump if passing else highest
            if outcome.startswith("tips") or (slope, bump) == (SLOPES[0], BUMPS[1]):
                runs["tips" if outcome.startswith("tips") else "level"] = run
        rows.append(tuple(row))
        values[f"highest_passed_slope_{slope:g}".replace(".", "_")] = Value(highest, "mm")
    outcomes = Counter(str(v.value) for k, v in values.items() if k.startswith("slope"))
    passed = [
        float(values[f"highest_passed_slope_{s:g}".replace(".", "_")].value or 0) for s in SLOPES
    ]
    return Result(
        NAME,
        values,
        setup=[f"coasting from {SPEED:g} m/s, {BEFORE:g} m before a bar of {1000 * DEPTH:g} mm"],
        grids=[Grid("Outcome", ("slope", *(f"{b:g} mm" for b in BUMPS)), tuple(rows))],
        notes=[
            ", ".join(
                f"{count} of {len(SLOPES) * len(BUMPS)}: {what}" for what, count in outcomes.items()
            )
            + "."
        ],
        curves={"highest bump passed": (list(SLOPES), passed)},
        axes=("slope, deg", "bump, mm"),
        runs=runs,
    )


def attempt(
    design: Design, slope: float, bump: float, speed: float = SPEED, timestep: float | None = None
) -> tuple[str, Run]:
    """Roll down a slope (rad) over a bump (m) from a speed (m/s); the outcome, and the run."""
    edge = _front(design) + BEFORE

    def edit(spec: mujoco.MjSpec) -> None:
        if bump > 0.0:
            add_kerb(spec, bump, edge, edge + DEPTH)

    track = Track(design, slope=-slope, speed=speed, edit=edit, timestep=timestep)
    begin = track.view.x
    light = {"seat": False, "slow": 0.0}

    def watch(view: View) -> None:
        if _seat_pulls(view):
            light["seat"] = True
        light["slow"] = light["slow"] + 0.01 if view.speed < 0.05 else 0.0

    track.drive(
        coast,
        TIME,
        until=lambda view: (
            view.upright < 0.5 or light["slow"] > 0.3 or view.x - begin > edge + DEPTH + 1.0
        ),
        watch=watch,
    )
    view = track.view
    if view.upright < 0.5:
        return ("tips forward" if view.pitch < 0.0 else "tips backward"), track.run()
    rear = [
        float(view.data.geom_xpos[view.parts.geoms[w]][0]) for w in ("left_wheel", "right_wheel")
    ]
    if bump > 0.0 and min(rear) < edge:
        return "stops", track.run()
    return ("load leaves the seat" if light["seat"] else "passes"), track.run()


def _front(design: Design) -> float:
    """How far the front wheels reach forward of the chair's origin, m."""
    model = design.spec().compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    geoms = Track(design).view.parts.geoms.values()
    return max(float(data.geom_xpos[g][0] + model.geom_size[g, 0]) for g in geoms)


def _seat_pulls(view: View) -> bool:
    """Whether the seat would have to pull the load down: its acceleration along the chair's up
    axis falls below that of free fall.

    The occupant is taken to be at the centre of mass of body `chair`, most of whose mass it is.
    """
    model, data, chair = view.model, view.data, view.parts.chair
    motion = np.zeros(6)
    mujoco.mj_objectAcceleration(model, data, mujoco.mjtObj.mjOBJ_BODY, chair, motion, 0)
    up = data.xmat[chair].reshape(3, 3)[:, 2]
    # MuJoCo's accelerations contain the reaction to gravity: at rest they are +g upward
    return float(motion[3:] @ up) < -0.02 * GRAVITY
