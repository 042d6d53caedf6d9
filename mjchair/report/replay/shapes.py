"""What the bodies of a model look like, as few triangles and simple shapes in body frames.

In: an MjModel. Out: for every body its visible geoms: boxes, balls and the like by their sizes,
meshes and height fields as triangles, those of one body and one colour together. What MuJoCo's
viewer hides by default (geom groups above 2) is hidden here.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.report.slope_scenery import Box, build_ramp, floor_plane, grade_of

Array = NDArray[np.float64]

VISIBLE = 2  # the last geom group that MuJoCo's viewer shows by default
STEPS = 65535  # of a vertex's coordinate from one end of its mesh to the other
GROUND = (0.77, 0.79, 0.81, 1.0)  # of a height field
_G = mujoco.mjtGeom
SOLIDS = {
    _G.mjGEOM_SPHERE: "ellipsoid",
    _G.mjGEOM_ELLIPSOID: "ellipsoid",
    _G.mjGEOM_CAPSULE: "capsule",
    _G.mjGEOM_CYLINDER: "cylinder",
    _G.mjGEOM_BOX: "box",
}


@dataclass(frozen=True)
class Solid:
    """A simple shape.

    Attributes:
      body: id. kind: a value of SOLIDS, or "plane". size: (3,), half sizes as MuJoCo has them, m.
      place: (3,), m, and quaternion: (4,), w first, in the body's frame. colour: (4,), RGBA, 0-1.
    """

    body: int
    kind: str
    size: tuple[float, ...]
    place: tuple[float, ...]
    quaternion: tuple[float, ...]
    colour: tuple[float, ...]


@dataclass(frozen=True)
class Surface:
    """Triangles of one body in one colour.

    Attributes:
      body: id. colour: (4,), RGBA, 0-1.
      vertices: (n, 3), m, body frame. normals: (n, 3), of unit length.
      triangles: (m, 3), of vertices.
    """

    body: int
    colour: tuple[float, ...]
    vertices: Array
    normals: Array
    triangles: NDArray[np.int64]

    def arrays(self, name: str) -> dict[str, NDArray[Any]]:
        """The surface as small integers: vertices in STEPS from low to high, normals in 127ths."""
        low, high = self.vertices.min(axis=0), self.vertices.max(axis=0)
        span = np.maximum(high - low, 1e-9)
        return {
            f"{name}.range": np.array([low, high], np.float32),
            f"{name}.vertices": np.round((self.vertices - low) / span * STEPS).astype(np.uint16),
            f"{name}.normals": np.round(127.0 * self.normals).astype(np.int8),
            f"{name}.triangles": self.triangles.astype(
                np.uint16 if len(self.vertices) <= STEPS else np.uint32
            ),
        }


@dataclass(frozen=True)
class Shapes:
    """All that is seen of a model, and the names of its bodies by id."""

    bodies: list[str]
    solids: list[Solid]
    surfaces: list[Surface]


def shapes(model: mujoco.MjModel, path: Array) -> Shapes:
    """What is seen of a model.

    Args:
      model: a copy of the caller's own: a tilted floor is given ends in place, as in films.
      path: (n, 3), m, of the chair, world; a tilted floor reaches a little beyond it.
    """
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    solids: list[Solid] = []
    ramp: list[Box] = []
    floor = floor_plane(model)
    if floor is not None and grade_of(model, data):
        # the endless plane gets ends and level ground about it
        ramp = build_ramp(model, data, path)
        mujoco.mj_kinematics(model, data)
    pieces: dict[tuple[int, tuple[float, ...]], list[Surface]] = {}
    for geom in range(model.ngeom):
        colour = _colour(model, geom)
        if model.geom_group[geom] > VISIBLE or colour[3] <= 0.0:
            continue
        kind = _G(model.geom_type[geom])
        if kind in (_G.mjGEOM_MESH, _G.mjGEOM_HFIELD):
            surface = _surface(model, geom, colour)
            pieces.setdefault((surface.body, colour), []).append(surface)
        elif kind == _G.mjGEOM_PLANE or kind in SOLIDS:
            solids.append(_solid(model, geom, kind, colour))
    solids += [_scenery(box) for box in ramp]
    names = [model.body(i).name or f"body {i}" for i in range(model.nbody)]
    return Shapes(names, solids, [_joined(group) for group in pieces.values()])


def _colour(model: mujoco.MjModel, geom: int) -> tuple[float, ...]:
    """As MuJoCo draws it: the geom's own colour if it was set, else its material's.

    Height fields are white under a texture, which is not carried over; they get the floor's grey.
    """
    if model.geom_type[geom] == _G.mjGEOM_HFIELD:
        return GROUND
    own, material = model.geom_rgba[geom], int(model.geom_matid[geom])
    default = np.array([0.5, 0.5, 0.5, 1.0], np.float32)
    rgba = model.mat_rgba[material] if material >= 0 and (own == default).all() else own
    return tuple(round(float(c), 4) for c in rgba)


def _solid(
    model: mujoco.MjModel, geom: int, kind: mujoco.mjtGeom, colour: tuple[float, ...]
) -> Solid:
    size = model.geom_size[geom].astype(float)
    if kind == _G.mjGEOM_SPHERE:
        size = np.full(3, size[0])
    return Solid(
        body=int(model.geom_bodyid[geom]),
        kind="plane" if kind == _G.mjGEOM_PLANE else SOLIDS[kind],
        size=tuple(size.tolist()),
        place=tuple(model.geom_pos[geom].tolist()),
        quaternion=tuple(model.geom_quat[geom].tolist()),
        colour=colour,
    )


def _scenery(box: Box) -> Solid:
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(box.axes).ravel())
    return Solid(
        body=0,
        kind="box",
        size=tuple(box.half.tolist()),
        place=tuple(box.middle.tolist()),
        quaternion=tuple(quaternion.tolist()),
        colour=(*box.colour, 1.0),
    )


def _surface(model: mujoco.MjModel, geom: int, colour: tuple[float, ...]) -> Surface:
    """A mesh or a height field, in its body's frame."""
    data_id = int(model.geom_dataid[geom])
    if model.geom_type[geom] == _G.mjGEOM_MESH:
        vertices, normals, triangles = _mesh(model, data_id)
    else:
        vertices, normals, triangles = _height_field(model, data_id)
    axes = np.empty(9)
    mujoco.mju_quat2Mat(axes, model.geom_quat[geom])
    turn = axes.reshape(3, 3).T
    return Surface(
        int(model.geom_bodyid[geom]),
        colour,
        vertices @ turn + model.geom_pos[geom],
        normals @ turn,
        triangles,
    )


def _mesh(model: mujoco.MjModel, mesh: int) -> tuple[Array, Array, NDArray[np.int64]]:
    """Vertices, normals and triangles; a vertex with two normals becomes two."""
    first, count = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
    corners = np.column_stack(
        [
            model.mesh_face[first : first + count].ravel(),
            model.mesh_facenormal[first : first + count].ravel(),
        ]
    )
    pairs, place = np.unique(corners, axis=0, return_inverse=True)
    vertices = model.mesh_vert[model.mesh_vertadr[mesh] + pairs[:, 0]].astype(float)
    normals = model.mesh_normal[model.mesh_normaladr[mesh] + pairs[:, 1]].astype(float)
    return vertices, normals, place.reshape(-1, 3)


def _height_field(model: mujoco.MjModel, field: int) -> tuple[Array, Array, NDArray[np.int64]]:
    """The upper surface: rows along y, columns along x, each cell split as MuJoCo splits it."""
    rows, columns = int(model.hfield_nrow[field]), int(model.hfield_ncol[field])
    x_half, y_half, top, _ = model.hfield_size[field]
    first = int(model.hfield_adr[field])
    heights = top * model.hfield_data[first : first + rows * columns].reshape(rows, columns)
    x, y = np.linspace(-x_half, x_half, columns), np.linspace(-y_half, y_half, rows)
    slope_y, slope_x = np.gradient(heights, y, x)
    vertices = np.column_stack([*(g.ravel() for g in np.meshgrid(x, y)), heights.ravel()])
    normals = np.column_stack([-slope_x.ravel(), -slope_y.ravel(), np.ones(heights.size)])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    right, above, across = corner + 1, corner + columns, corner + columns + 1
    lower, upper = (corner, right, above), (right, across, above)
    triangles = np.concatenate([np.column_stack(lower), np.column_stack(upper)])
    return vertices, normals, triangles


def _joined(group: list[Surface]) -> Surface:
    """Surfaces of one body and colour as one."""
    starts = np.cumsum([0, *(len(s.vertices) for s in group[:-1])])
    return Surface(
        group[0].body,
        group[0].colour,
        np.concatenate([s.vertices for s in group]),
        np.concatenate([s.normals for s in group]),
        np.concatenate([s.triangles + start for s, start in zip(group, starts, strict=True)]),
    )
