"""Merge the display geoms of a chair into one mesh for each body and material, and separate them.

In: an MjSpec of a chair. Out: the same specification, changed in place. A geom takes time in every
step, also one that is only for display. Merging reduces these geoms of the shipped chairs to a
quarter, with the same appearance. The physics does not change: masses and inertias are written into
the bodies.

Names, masses and shapes of the parts stay in a custom text, which a saved chair keeps, so that the
seat, the occupant and the wheels can be edited later: `separate` gives the parts back.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.model.visual_geoms import is_visual, named_elsewhere

Array = NDArray[np.float64]
Mesh = tuple[Array, NDArray[np.int64]]  # vertices (n, 3) m, and triangles (m, 3) of them

RECORD = "merged_parts"  # custom text: geom|part|part;... with a part's numbers behind commas
GRID = 1e-5  # m, to which the vertices are rounded; they are only for display
ERROR = 5e-4  # m, by which a round part may lie inside its true surface
FEWEST, MOST = 12, 24  # corners round a part; MuJoCo draws its round geoms with 28
RESERVED = set("|;,<>&\"'")  # of the record, and of XML

_G = mujoco.mjtGeom
SHAPES = (_G.mjGEOM_SPHERE, _G.mjGEOM_CAPSULE, _G.mjGEOM_ELLIPSOID, _G.mjGEOM_CYLINDER,
          _G.mjGEOM_BOX, _G.mjGEOM_MESH)  # fmt: skip
APART = ("_pushrim",)  # stays separate: it is looked up by name in compiled models, for the hands


@dataclass(frozen=True)
class Part:
    """A geom that was merged, in its body's frame.

    Attributes:
      name: of the geom. type: of MuJoCo. mass: kg, its share of the body's.
      pos, quat, size: as a geom has them.
      span: of a mesh: first vertex, vertices, first triangle, triangles in the merged mesh.
    """

    name: str
    type: int
    mass: float
    pos: tuple[float, ...]
    quat: tuple[float, ...]
    size: tuple[float, ...]
    span: tuple[int, ...] = ()

    def text(self) -> str:
        """The part in the record."""
        numbers = (self.mass, *self.pos, *self.quat, *self.size, *self.span)
        return ",".join((self.name, str(self.type), *(f"{x:.17g}" for x in numbers)))

    @staticmethod
    def of(text: str) -> Part:
        """The part from the record."""
        name, kind, mass, *rest = text.split(",")
        x = [float(r) for r in rest]
        span = tuple(int(n) for n in x[10:])
        return Part(name, int(kind), float(mass), tuple(x[:3]), tuple(x[3:7]), tuple(x[7:10]), span)


def merge(spec: mujoco.MjSpec, model: mujoco.MjModel) -> None:
    """Replace the display geoms of each body by one mesh for each material.

    Geoms to which a sensor or another element refers stay as they are, and so do the push rims,
    meshes from files and textured parts.

    Args:
      spec: edited in place. model: compiled from it.
    """
    groups: dict[tuple[Any, ...], list[int]] = {}
    geoms, kept = list(spec.geoms), named_elsewhere(spec)
    for body in spec.bodies[1:]:
        for geom in body.geoms:
            if is_visual(geom) and geom.name not in kept and _can_merge(spec, geom):
                look = (body.name, geom.material, tuple(geom.rgba), geom.group)
                groups.setdefault(look, []).append(geom.id)
    names = {geom.name for geom in geoms} | {mesh.name for mesh in spec.meshes}
    lines, old, drawn = [], set(), {}
    for (body_name, material, rgba, group), members in groups.items():
        name = _unused(f"{body_name}_{material or 'plain'}", names)
        mesh, parts = _together(model, geoms, members)
        key = (mesh[0].tobytes(), mesh[1].tobytes())
        if key not in drawn:  # both wheels are drawn with the same mesh
            drawn[key] = name
            _add_mesh(spec, name, mesh)
        old |= {geoms[i].meshname for i in members if geoms[i].type == _G.mjGEOM_MESH}
        for i in members:
            spec.delete(geoms[i])
        spec.body(body_name).add_geom(
            name=name, type=_G.mjGEOM_MESH, meshname=drawn[key], material=material, rgba=rgba,
            group=group, contype=0, conaffinity=0, mass=0.0,
        )  # fmt: skip
        lines.append("|".join((name, *(part.text() for part in parts))))
    _drop_meshes(spec, old)
    if lines:
        record = next((t for t in spec.texts if t.name == RECORD), None)
        if record is not None:
            lines.insert(0, record.data)
            spec.delete(record)
        spec.add_text(name=RECORD, data=";".join(lines))


def is_merged(spec: mujoco.MjSpec) -> bool:
    """Whether parts of the specification are merged."""
    return any(text.name.endswith(RECORD) for text in spec.texts)


def separate(spec: mujoco.MjSpec) -> None:
    """Restore the merged parts, in place; not those of a merged geom that has been deleted."""
    for text in [t for t in spec.texts if t.name.endswith(RECORD)]:
        prefix = text.name.removesuffix(RECORD)
        meshes = set()
        for line in text.data.split(";"):
            name, *parts = line.split("|")
            merged = spec.geom(prefix + name)
            if merged is None:
                continue
            meshes.add(merged.meshname)
            for part in map(Part.of, parts):
                _add_part(spec, merged, prefix, part)
            spec.delete(merged)
        spec.delete(text)
        _drop_meshes(spec, meshes)


@contextmanager
def apart(spec: mujoco.MjSpec) -> Iterator[None]:
    """Separate the parts inside the block, for edits that need them; merge them afterwards."""
    if not is_merged(spec):
        yield
        return
    separate(spec)
    yield
    merge(spec, spec.compile())


def _can_merge(spec: mujoco.MjSpec, geom: Any) -> bool:
    """Whether a mesh can look like the geom, and the record can hold it."""
    if geom.type not in SHAPES or not geom.name or RESERVED & set(geom.name):
        return False
    if geom.name.endswith(APART) or geom.fluid_ellipsoid:
        return False
    material = spec.material(geom.material) if geom.material else None
    if material is not None and "".join(material.textures):
        return False
    return geom.type != _G.mjGEOM_MESH or not spec.mesh(geom.meshname).file


def _unused(name: str, taken: set[str]) -> str:
    chosen = next(
        n for k in range(len(taken) + 1) if (n := f"{name}_{k}" if k else name) not in taken
    )
    taken.add(chosen)
    return chosen


def _together(
    model: mujoco.MjModel, geoms: list[Any], members: list[int]
) -> tuple[Mesh, list[Part]]:
    """The mesh of several geoms in their body's frame, and their records."""
    vertices, faces, parts, first, behind = [], [], [], 0, 0
    for i in members:
        points, triangles = _drawn(model, i)
        axes = np.zeros(9)
        mujoco.mju_quat2Mat(axes, model.geom_quat[i])
        vertices.append(points @ axes.reshape(3, 3).T + model.geom_pos[i])
        faces.append(triangles + first)
        pos, quat, size = model.geom_pos[i], model.geom_quat[i], model.geom_size[i]
        span: tuple[int, ...] = ()
        if geoms[i].type == _G.mjGEOM_MESH:  # its points are now in the body's frame
            pos, quat, size = np.zeros(3), np.array((1.0, 0.0, 0.0, 0.0)), np.zeros(3)
            span = (first, len(points), behind, len(triangles))
        mass = float(geoms[i].mass) if geoms[i].mass > 0.0 else 0.0
        at, turned, reach = (tuple(float(x) for x in row) for row in (pos, quat, size))
        parts.append(Part(geoms[i].name, int(geoms[i].type), mass, at, turned, reach, span))
        first, behind = first + len(points), behind + len(triangles)
    return (np.rint(np.vstack(vertices) / GRID), np.vstack(faces)), parts


def _add_mesh(spec: mujoco.MjSpec, name: str, mesh: Mesh) -> None:
    """A mesh of points on the grid: whole numbers, which are short in a file."""
    spec.add_mesh(
        name=name, uservert=mesh[0].ravel(), userface=mesh[1].ravel(), scale=(GRID,) * 3,
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
    )  # fmt: skip


def _drop_meshes(spec: mujoco.MjSpec, names: set[str]) -> None:
    """Delete the meshes that no geom shows any more."""
    shown = {geom.meshname for geom in spec.geoms}
    for mesh in list(spec.meshes):
        if mesh.name in names - shown:
            spec.delete(mesh)


def _add_part(spec: mujoco.MjSpec, merged: Any, prefix: str, part: Part) -> None:
    """Add a part as a geom again; a mesh gets its share of the merged mesh."""
    geom = merged.parent.add_geom(
        name=prefix + part.name, type=_G(part.type), pos=part.pos, quat=part.quat, size=part.size,
        mass=part.mass, material=merged.material, rgba=merged.rgba, group=merged.group,
        contype=0, conaffinity=0,
    )  # fmt: skip
    if not part.span:
        return
    whole = spec.mesh(merged.meshname)
    geom.meshname = f"{whole.name}_{part.span[0]}"
    if spec.mesh(geom.meshname) is None:
        first, count, behind, triangles = part.span
        points = np.reshape(whole.uservert, (-1, 3))[first : first + count]
        faces = np.reshape(whole.userface, (-1, 3))[behind : behind + triangles] - first
        _add_mesh(spec, geom.meshname, (points, faces))


def _drawn(model: mujoco.MjModel, geom: int) -> Mesh:
    """The surface of a geom as triangles, in its own frame."""
    kind, size = model.geom_type[geom], model.geom_size[geom]
    if kind == _G.mjGEOM_MESH:
        mesh = model.geom_dataid[geom]
        v, f = model.mesh_vertadr[mesh], model.mesh_faceadr[mesh]
        points = model.mesh_vert[v : v + model.mesh_vertnum[mesh]].astype(np.float64)
        return points, model.mesh_face[f : f + model.mesh_facenum[mesh]].astype(np.int64)
    if kind == _G.mjGEOM_BOX:
        return _box(size)
    if kind == _G.mjGEOM_CYLINDER:
        return _cylinder(size[0], size[1])
    if kind == _G.mjGEOM_CAPSULE:
        return _ball(size[[0, 0, 0]], size[1])
    return _ball(size if kind == _G.mjGEOM_ELLIPSOID else size[[0, 0, 0]], 0.0)


def _corners(radius: float) -> int:
    """Corners round a circle, an even number."""
    wanted = np.pi / np.arccos(max(1.0 - ERROR / radius, 0.0))
    return 2 * int(np.clip(np.ceil(0.5 * wanted), FEWEST // 2, MOST // 2))


def _circle(count: int) -> Array:
    angles = 2.0 * np.pi * np.arange(count) / count
    return np.column_stack((np.cos(angles), np.sin(angles)))


def _bands(rows: int, count: int) -> NDArray[np.int64]:
    """Triangles between rows of `count` points, the rows one above the other along z."""
    k = np.arange(count)
    square = np.column_stack((k, (k + 1) % count, (k + 1) % count + count, k + count))
    two = np.vstack((square[:, [0, 1, 2]], square[:, [0, 2, 3]]))
    return np.vstack([two + row * count for row in range(rows - 1)])


def _fan(centre: int, ring: int, count: int, up: bool) -> NDArray[np.int64]:
    """Triangles from a point to a ring of `count` points; up: seen from above."""
    k = np.arange(count)
    out = np.column_stack((np.full(count, centre), ring + k, ring + (k + 1) % count))
    return out if up else out[:, [0, 2, 1]]


def _ball(radii: Array, half: float) -> Mesh:
    """An ellipsoid with half-axes `radii`, or a capsule: cut at its waist, 2 `half` apart."""
    count = _corners(float(np.max(radii)))
    rows = count // 4 if half else count // 2
    rise = np.linspace(0.0, 0.5 * np.pi, rows + 1)[:-1] if half else None
    if rise is None:
        rise = np.linspace(-0.5 * np.pi, 0.5 * np.pi, rows + 1)[1:-1]
        shift = np.zeros(len(rise))
    else:
        shift = np.r_[np.full(len(rise), -half), np.full(len(rise), half)]
        rise = np.r_[-rise[::-1], rise]
    across = np.cos(rise)[:, None, None] * _circle(count)[None] * radii[:2]
    up = np.broadcast_to((np.sin(rise) * radii[2] + shift)[:, None, None], (len(rise), count, 1))
    points = np.concatenate((across, up), axis=2).reshape(-1, 3)
    top = radii[2] + half
    last, n = len(points) - count, len(points)
    points = np.vstack((points, (0.0, 0.0, -top), (0.0, 0.0, top)))
    faces = (_bands(len(rise), count), _fan(n, 0, count, False), _fan(n + 1, last, count, True))
    return points, np.vstack(faces)


def _cylinder(radius: float, half: float) -> Mesh:
    """A cylinder along z; the ends have points of their own, for a sharp edge."""
    count = _corners(radius)
    low = np.column_stack((radius * _circle(count), np.full(count, -half)))
    high = low * (1.0, 1.0, -1.0)
    points = np.vstack((low, high, low, high, (0.0, 0.0, -half), (0.0, 0.0, half)))
    ends = _fan(4 * count, 2 * count, count, False), _fan(4 * count + 1, 3 * count, count, True)
    return points, np.vstack((_bands(2, count), *ends))


def _box(half: Array) -> Mesh:
    """A box; every side has points of its own, for sharp edges."""
    points: list[Array] = []
    faces: list[NDArray[np.int64]] = []
    square = np.array(((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)))
    for axis in range(3):
        for sign in (-1.0, 1.0):
            side = np.empty((4, 3))
            side[:, axis] = sign
            side[:, [(axis + 1) % 3, (axis + 2) % 3]] = square if sign > 0.0 else square[::-1]
            first = 4 * len(faces)
            points.append(side * half)
            faces.append(np.array(((0, 1, 2), (0, 2, 3))) + first)
    return np.vstack(points), np.vstack(faces)
