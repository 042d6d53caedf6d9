"""Rolling resistance of a chair, measured by the methods of published studies.

In: a design. Out: coast-down deceleration, straight and in a turn; the force of a rope that holds
the chair on a treadmill; the drag of each wheel on a drum; and the drag that is predicted by the
sum of the components (tires, bearings, toe, camber, load share), to be compared with the drag of
the whole chair.

ISO 7176 has no test of rolling resistance. The component sum follows the drum studies of Pittsburgh
(PMC8049518 and the component study of 2023): N = 144, bias -1.1 N, limits +-1.3 N.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.model.wheels import base_name, wheels
from mjchair.testlab.design import GRAVITY, Design
from mjchair.testlab.drum import drum_drag
from mjchair.testlab.result import Grid, Result, Value
from mjchair.testlab.track import Run, Track, View
from mjchair.tire import block
from mjchair.tire.tire import block_forces

Array = NDArray[np.float64]

NAME = "rolling"
START = 1.5  # m/s
TURN = 0.5  # rad/s, of the coast-down in a turn
SLOW = 0.4  # m/s, at the end of a coast-down
HOLD = 20.0  # N m s/rad, gain of the controller that holds a turn
TREADMILL = 1.0  # m/s
SETTLING, HELD = 3.0, 4.0  # s, until the force of the rope is steady; s, over which it is averaged


def rolling(design: Design, *, timestep: float | None = None) -> Result:
    """Rolling resistance of a chair.

    Returns:
      `coast_down_deceleration` (m/s^2), `coast_down_coefficient` (1), the same with `_turning`,
      `treadmill_drag` (N), `treadmill_coefficient` (1), `drum_<wheel>` (N), `component_sum` and
      `component_sum_difference` (N).
    """
    values: dict[str, Value] = {}
    curves, runs = {}, {}
    for name, yaw in (("", 0.0), ("_turning", TURN)):
        down = coast_down(design, yaw, timestep)
        values[f"coast_down_deceleration{name}"] = Value(down.deceleration, "m/s^2")
        values[f"coast_down_coefficient{name}"] = Value(
            down.drag / down.weight, "1", note="drag over weight; wheel inertia counts as mass"
        )
        curves[f"turning, {TURN:g} rad/s at first" if yaw else "straight"] = down.curve
        runs[f"coast-down{name.replace('_', '-')}"] = down.run
    rope = treadmill(design, timestep=timestep)
    values["treadmill_drag"] = Value(rope.drag, "N", note=f"rope at {TREADMILL:g} m/s")
    values["treadmill_coefficient"] = Value(rope.drag / rope.weight, "1")
    for wheel, load in rope.loads.items():
        drag = drum_drag(design, wheel, load)
        values[f"drum_{wheel}"] = Value(drag, "N", note=f"at its load of {load:.0f} N, upright")
    sums, rows = component_sum(design, rope.loads)
    values["component_sum"] = Value(
        sums, "N", source="tires at their loads, bearings, toe and camber", note="predicts the rope"
    )
    values["component_sum_difference"] = Value(sums - rope.drag, "N")
    return Result(
        NAME,
        values,
        setup=["level hard floor, the tires' own rolling resistance, casters trailing"],
        grids=[
            Grid(
                "Components",
                ("wheel", "load, N", "tire, N", "bearing, N", "toe and camber, N", "sum, N"),
                rows,
            )
        ],
        notes=[
            "On the treadmill a rope at the height of the axle pulls the chair over a floor at "
            "rest, which is mechanically the same. Air drag is left out."
        ],
        curves=curves,
        axes=("time, s", "speed, m/s"),
        runs=runs,
    )


@dataclass(frozen=True)
class CoastDown:
    """A chair that rolls to a stop.

    Attributes:
      deceleration: mean, m/s^2. drag: mean, N; both without the work of the torques that hold the
        turn. weight: N.
      curve: time (s) and speed (m/s). run: the simulated run.
    """

    deceleration: float
    drag: float
    weight: float
    curve: tuple[list[float], list[float]]
    run: Run


def coast_down(design: Design, yaw: float = 0.0, timestep: float | None = None) -> CoastDown:
    """Roll from START to SLOW m/s, straight or round a circle.

    Opposite torques on the two wheels hold the circle, since a free chair would straighten its
    path; the work of these torques is subtracted from the drag.

    Args:
      yaw: yaw rate at the start, rad/s; the radius of the circle stays the same.
    """
    track = Track(design, speed=START, yaw_rate=yaw, timestep=timestep)
    seen: list[tuple[float, float, float]] = []
    work = {"done": 0.0, "torque": 0.0}

    def hold(view: View) -> tuple[float, float]:
        if yaw == 0.0:
            return 0.0, 0.0
        error = yaw / START * view.speed - view.yaw_rate
        work["torque"] += 2.0 * error * 0.01 * HOLD
        torque = HOLD * error + work["torque"]
        work["done"] += torque * (view.right - view.left) * 0.01
        return -torque, torque

    track.drive(
        hold,
        25.0,
        until=lambda view: view.speed < SLOW,
        watch=lambda view: seen.append((view.time, view.speed, work["done"])),
    )
    time, speed, done = np.array(seen).T
    kept = time > 0.5
    slowed = float(-np.polyfit(time[kept], speed[kept], 1)[0]) if kept.sum() > 2 else math.nan
    way = float(np.sum(speed[kept]) * 0.01)
    helped = float(done[kept][-1] - done[kept][0]) / way if kept.sum() > 2 else 0.0
    drag = slowed * _inertia(track) + helped
    return CoastDown(
        drag / _inertia(track),
        drag,
        float(track.model.body_subtreemass[0]) * GRAVITY,
        ([float(t) for t in time[::10]], [float(v) for v in speed[::10]]),
        track.run(),
    )


def _inertia(track: Track) -> float:
    """Mass plus the inertia of the wheels over their radius squared, kg."""
    model = track.model
    total = float(model.body_subtreemass[0])
    for wheel in wheels(model):
        dof = model.jnt_dofadr[wheel.joint]
        spin = float(np.sort(model.body_inertia[wheel.body])[-1]) + float(model.dof_armature[dof])
        total += spin / float(model.geom_size[wheel.geom, 0]) ** 2
    return total


@dataclass(frozen=True)
class Treadmill:
    """The measurement with a rope that holds the chair on a treadmill.

    Attributes:
      drag: mean force of the rope, N. loads: mean load on each wheel, N. weight: of the chair, N.
    """

    drag: float
    loads: Mapping[str, float]
    weight: float


def treadmill(
    design: Design,
    *,
    timestep: float | None = None,
    edit: Callable[[mujoco.MjSpec], None] | None = None,
) -> Treadmill:
    """Pull the chair by a rope over the floor at TREADMILL m/s.

    Args:
      edit: a change of the specification, such as a carpet.
    """
    track = Track(design, speed=TREADMILL, edit=edit, timestep=timestep)
    model, data, chair = track.model, track.data, track.view.parts.chair
    mass = float(model.body_subtreemass[0])
    forces: list[float] = []
    loads: list[dict[str, float]] = []
    state = {"sum": 0.0}

    def rope(view: View) -> tuple[float, float]:
        error = TREADMILL - view.speed
        state["sum"] += error * 0.01
        force = mass * (4.0 * error + 3.0 * state["sum"])
        ahead = np.array([math.cos(view.heading), math.sin(view.heading), 0.0])
        arm = view.axle - data.xipos[chair]
        data.xfrc_applied[chair, :3] = force * ahead
        data.xfrc_applied[chair, 3:] = np.cross(arm, force * ahead)
        if view.time > SETTLING:
            forces.append(force)
            loads.append(view.loads)
        return 0.0, 0.0

    track.drive(rope, SETTLING + HELD)
    shares = {w: float(np.mean([load[w] for load in loads])) for w in loads[0]}
    return Treadmill(float(np.mean(forces)), shares, mass * GRAVITY)


def component_sum(
    design: Design, loads: Mapping[str, float]
) -> tuple[float, tuple[tuple[float | str | None, ...], ...]]:
    """The drag of the components on their own: their sum (N), and a row for each wheel."""
    model = design.spec().compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    rows, total = [], 0.0
    for wheel in wheels(model):
        load = loads[base_name(wheel.name)]
        radius = float(model.geom_size[wheel.geom, 0])
        axis = data.geom_xmat[wheel.geom].reshape(3, 3)[:, 2]
        slip = math.atan2(-axis[0], axis[1])  # angle between the headings of wheel and chair
        camber = math.asin(max(-1.0, min(1.0, float(axis[2]))))
        rolled = float(wheel.block[block.ROLLING_RESISTANCE]) * load
        bearing = float(model.dof_damping[model.jnt_dofadr[wheel.joint]]) * TREADMILL / radius**2
        forces = block_forces(np.array(wheel.block), load, 0.0, -slip, camber, TREADMILL)
        scrub = abs(float(forces.Fy) * math.sin(slip))
        whole = rolled + bearing + scrub
        rows.append((wheel.name.replace("_", " "), load, rolled, bearing, scrub, whole))
        total += rolled + bearing + scrub
    return total, tuple(rows)
