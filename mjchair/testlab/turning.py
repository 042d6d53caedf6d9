"""Dimensions and turning space (after ISO 7176-5:2008) of a chair.

In: a design. Out: length, width, height, ground clearance; the diameter of a turn on the spot and
about one wheel; the width of a corridor for a half turn on the spot and for a turn with reversing;
the width of two equal corridors at a right angle (mm).

The quantities are those of the standard. How the chair is driven is an assumption: by the shortest
path that two driven wheels allow, at walking pace. The space is the area over which the outline of
the chair, with footrest and push rims, moves in the simulation.
"""

from __future__ import annotations

import math

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from mjchair.model.seating import PERSON
from mjchair.model.spec import compile_spec
from mjchair.model.wheels import base_name
from mjchair.testlab.design import Design, is_anti_tipper, parts
from mjchair.testlab.drive import Pilot, drive_of, pilot_of
from mjchair.testlab.result import Result, Value
from mjchair.testlab.track import Command, Run, Track, View

Array = NDArray[np.float64]

NAME = "turning"
YAW = 0.8  # rad/s
PACE = 0.5  # m/s


def turning(design: Design, *, timestep: float | None = None) -> Result:
    """The dimensions of a chair and the space that it needs for turning.

    Returns:
      `length`, `width`, `height`, `ground_clearance`, `turning_diameter` (on the spot),
      `turning_diameter_one_wheel`, `turning_space`, `pivot_width`, `reversing_width`,
      `corner_width`, all mm.
    """
    outline, sizes = _outline(design)
    values = {name: Value(1000.0 * size, "mm", source="geometry") for name, size in sizes.items()}
    spot = _driven(design, lambda pilot, view: pilot.go(view, 0.0, YAW), 2.0 * math.pi, timestep)
    wheel = _driven(design, _about_the_left_wheel, 2.0 * math.pi, timestep)
    half = _cut(spot, math.pi)
    quarter = _cut(spot, 0.5 * math.pi)
    diameter = 2.0 * _radius(_swept(outline, spot))
    values["turning_diameter"] = Value(1000.0 * diameter, "mm", note="on the spot")
    about_wheel = 2.0 * _radius(_swept(outline, wheel))
    values["turning_diameter_one_wheel"] = Value(
        1000.0 * about_wheel, "mm", note="one wheel stands"
    )
    values["turning_space"] = Value(1000.0 * diameter, "mm", note="the smallest room for a turn")
    across = _swept(outline, half)[:, :, 1]
    values["pivot_width"] = Value(
        1000.0 * float(np.ptp(across)), "mm", note="half turn on the spot"
    )
    reversing, run = _reversing(design, outline, timestep)
    values["reversing_width"] = Value(1000.0 * reversing, "mm", note="half turn in three moves")
    corner = _corner(outline, quarter)
    values["corner_width"] = Value(1000.0 * corner, "mm", note="two corridors at a right angle")
    return Result(
        NAME,
        values,
        setup=["hard level floor, casters trailing at the start; sizes without the person"],
        curves={"outline": _closed(outline), **_circle(_swept(outline, spot))},
        axes=("x, m", "y, m"),
        runs={"three-moves": run},
    )


def _closed(points: Array) -> tuple[list[float], list[float]]:
    ring = np.vstack([points, points[:1]])
    return [float(x) for x in ring[:, 0]], [float(y) for y in ring[:, 1]]


def _circle(swept: Array) -> dict[str, tuple[list[float], list[float]]]:
    center, radius = _center(swept)
    angle = np.linspace(0.0, 2.0 * math.pi, 90)
    x, y = center[0] + radius * np.cos(angle), center[1] + radius * np.sin(angle)
    return {"turn on the spot": ([float(a) for a in x], [float(b) for b in y])}


def _about_the_left_wheel(pilot: Pilot, view: View) -> Command:
    return pilot.go(view, 0.5 * pilot.track * YAW, YAW)


def _outline(design: Design) -> tuple[Array, dict[str, float]]:
    """Convex outline (n, 2) from above, m, chair frame from the axle; and sizes, m."""
    model = compile_spec(design.spec(visual_geoms=True))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    named = parts(model)
    forks = (int(model.jnt_bodyid[joint]) for joint in named.swivels.values())
    turning_bodies = {*named.bodies.values(), *forks}
    clouds, lowest = [], math.inf
    for geom in range(model.ngeom):
        body = int(model.geom_bodyid[geom])
        name = base_name(model.geom(geom).name)
        if body == 0 or name in PERSON:
            continue
        cloud = _cloud(model, data, geom)
        if model.geom_group[geom] != 3:  # the contact shape of a tire is not a visible part
            clouds.append(cloud)
        if body not in turning_bodies and not is_anti_tipper(name):
            lowest = min(lowest, float(cloud[:, 2].min()))
    points = np.vstack(clouds)
    site = data.site("axle").xpos
    flat = points[:, :2] - site[:2]
    hull = flat[ConvexHull(flat).vertices]
    size = np.ptp(points, axis=0)
    return hull, {
        "length": float(size[0]),
        "width": float(size[1]),
        "height": float(size[2]),
        "ground_clearance": lowest,
    }


def _cloud(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> Array:
    """Points (n, 3) on the surface of a geom, world, m; exact at its extremes along its axes."""
    kind, size = model.geom_type[geom], model.geom_size[geom]
    shape = mujoco.mjtGeom
    ring = np.linspace(0.0, 2.0 * math.pi, 49)[:-1]
    circle = np.column_stack([np.cos(ring), np.sin(ring)])
    ball = np.array(
        [
            (math.cos(e) * c, math.cos(e) * s, math.sin(e))
            for e in np.linspace(-0.5 * math.pi, 0.5 * math.pi, 13)
            for c, s in circle[::2]
        ]
    )
    if kind == shape.mjGEOM_MESH:
        mesh = model.geom_dataid[geom]
        first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        local = model.mesh_vert[first : first + count].astype(float)
    elif kind == shape.mjGEOM_BOX:
        corners = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
        local = corners * size
    elif kind == shape.mjGEOM_CAPSULE:
        up = np.array([0.0, 0.0, size[1]])
        local = np.vstack([size[0] * ball + up, size[0] * ball - up])
    elif kind == shape.mjGEOM_CYLINDER:
        flat = np.column_stack([size[0] * circle, np.zeros(len(circle))])
        up = np.array([0.0, 0.0, size[1]])
        local = np.vstack([flat + up, flat - up])
    elif kind == shape.mjGEOM_SPHERE:
        local = size[0] * ball
    else:
        local = ball * size
    return np.asarray(data.geom_xpos[geom] + local @ data.geom_xmat[geom].reshape(3, 3).T)


def _driven(design, drive, angle, timestep) -> Array:  # type: ignore[no-untyped-def]
    """Positions (n, 3) of the axle, x, y (m) and heading (rad), during a turn by `angle` (rad)."""
    track = Track(design, timestep=timestep, driven=True)
    pilot = pilot_of(drive_of(design), track)
    places: list[tuple[float, float, float]] = []
    track.drive(
        lambda view: drive(pilot, view),
        angle / YAW * 2.0 + 4.0,
        until=lambda view: abs(view.heading) > angle,
        watch=lambda view: places.append((view.x, view.y, view.heading)),
    )
    return np.array(places)


def _cut(places: Array, angle: float) -> Array:
    """The part of a turn up to an angle (rad)."""
    return places[np.abs(places[:, 2]) <= angle]


def _swept(outline: Array, places: Array) -> Array:
    """The outline at every position, (n, points, 2)."""
    c, s = np.cos(places[:, 2]), np.sin(places[:, 2])
    turn = np.stack([np.stack([c, -s], -1), np.stack([s, c], -1)], -2)
    return np.asarray(np.einsum("nij,kj->nki", turn, outline) + places[:, None, :2])


def _center(swept: Array) -> tuple[Array, float]:
    """Centre (2,) and radius (m) of the smallest circle around all outlines."""
    points = swept.reshape(-1, 2)
    points = points[ConvexHull(points).vertices]
    center = points.mean(axis=0)
    reach = 0.5
    for _ in range(4000):  # ever shorter steps to the farthest point (Badoiu, Clarkson)
        far = points[np.argmax(np.linalg.norm(points - center, axis=1))]
        center = center + reach * (far - center)
        reach *= 0.998
        if reach < 1e-4:
            break
    return center, float(np.linalg.norm(points - center, axis=1).max())


def _radius(swept: Array) -> float:
    return _center(swept)[1]


def _reversing(design: Design, outline: Array, timestep: float | None) -> tuple[float, Run]:
    """Width (m) of the corridor for a half turn in three moves, and the run.

    The chair turns by 60 deg each time: forward about a point beside it, backward about a point on
    the other side, and forward again. The radius of each turn equals the track of the rear wheels.
    """
    track = Track(design, timestep=timestep, driven=True)
    pilot = pilot_of(drive_of(design), track)
    places: list[tuple[float, float, float]] = []
    radius = pilot.track

    def move(way: float, goal: float) -> None:
        track.drive(
            lambda view: pilot.go(view, way * radius * YAW, YAW),
            15.0,
            until=lambda view: view.heading > goal,
            watch=lambda view: places.append((view.x, view.y, view.heading)),
        )

    for count, way in enumerate((1.0, -1.0, 1.0)):
        move(way, math.radians(60.0) * (count + 1))
    return float(np.ptp(_swept(outline, np.array(places))[:, :, 1])), track.run()


def _corner(outline: Array, quarter: Array) -> float:
    """Width (m) of two equal corridors at a right angle, for a quarter turn on the spot."""
    turn = quarter[-1]
    into = quarter[:1] - np.column_stack([np.linspace(2.0, 0.0, 80), np.zeros((80, 2))])
    out = turn + np.column_stack([np.zeros(80), np.linspace(0.0, 2.0, 80), np.zeros(80)])
    swept = _swept(outline, np.vstack([into, quarter, out])).reshape(-1, 2)
    low, far = swept[:, 1].min(), swept[:, 0].max()
    widths = []
    for inner in np.linspace(-0.8, 0.4, 241):  # x of the inner corner
        left = swept[swept[:, 0] < inner, 1]
        if left.size:
            widths.append(max(left.max() - low, far - inner))
    return float(min(widths))
