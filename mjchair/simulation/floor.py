"""The floor under a chair: the plane `floor`, or the plane that lies under the wheels on a field.

In: a model whose geom `floor` is a plane or a height field, and data with the wheels' places. Out:
the plane on which the chair stands, and how far its tires are from the ground.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.engine.field import HeightField, ground_at
from mjchair.errors import MjchairError
from mjchair.simulation import names

Array = NDArray[np.float64]
GEOMS = {mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_HFIELD}
ROUND, ACROSS = 96, (-0.6, -0.3, 0.0, 0.3, 0.6)  # points of a tire's surface; rad across


def tire_geoms(model: mujoco.MjModel) -> dict[str, int]:
    """Wheel name -> its tire geom (`<wheel>_tire`)."""
    ending = "_tire"
    named = {name: i for i, name in enumerate(names.geoms(model)) if name.endswith(ending)}
    return {name.removesuffix(ending): i for name, i in named.items()}


def floor_geom(model: mujoco.MjModel) -> int:
    """The geom `floor`.

    Raises:
      MjchairError: there is none that is a plane or a height field.
    """
    for i, name in enumerate(names.geoms(model)):
        if names.same(name, "floor") and mujoco.mjtGeom(model.geom_type[i]) in GEOMS:
            return i
    raise MjchairError(
        "the model has no plane or height field geom named floor; leave the initial place to it"
    )


def on_field(model: mujoco.MjModel) -> bool:
    """Whether the model's geom `floor` is a height field."""
    return any(
        names.same(name, "floor") and is_field(model, i)
        for i, name in enumerate(names.geoms(model))
    )


def is_field(model: mujoco.MjModel, geom: int) -> bool:
    """Whether a geom is a height field."""
    return bool(model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_HFIELD)


def floor_plane(model: mujoco.MjModel, data: mujoco.MjData) -> tuple[Array, Array]:
    """A point (3,) m and the upward normal (3,) of the floor's plane; needs kinematics.

    On a height field: of the plane with the least squared distances from the ground under the
    middles of the wheels.

    Raises:
      MjchairError: there is no such floor, or a wheel is beside the height field.
    """
    floor = floor_geom(model)
    point, axes = data.geom_xpos[floor].copy(), data.geom_xmat[floor].reshape(3, 3)
    if not is_field(model, floor):
        return point, axes[:, 2].copy()
    under = np.array([_under(model, data, floor, i) for i in tire_geoms(model).values()])
    sides = np.column_stack([under[:, :2], np.ones(len(under))])
    slope_x, slope_y, height = np.linalg.lstsq(sides, under[:, 2], rcond=None)[0]
    normal = axes @ np.array([-slope_x, -slope_y, 1.0])
    return point + height * axes[:, 2], normal / np.linalg.norm(normal)


def height_above(model: mujoco.MjModel, data: mujoco.MjData, tire: int) -> float:
    """How far a tire's middle is from the ground under it, along the normal of `floor_plane`, m."""
    floor = floor_geom(model)
    point, normal = floor_plane(model, data)
    if is_field(model, floor):
        axes = data.geom_xmat[floor].reshape(3, 3)
        point = data.geom_xpos[floor] + axes @ _under(model, data, floor, tire)
    return float((data.geom_xpos[tire] - point) @ normal)


def clearance(model: mujoco.MjModel, data: mujoco.MjData, tires: Iterable[int]) -> float:
    """How far the chair can sink along the world's z until a tire touches the floor, m.

    Negative: it has to rise as far.
    """
    floor = floor_geom(model)
    if is_field(model, floor):
        rise = data.geom_xmat[floor].reshape(3, 3)[2, 2]
        return min(_above_field(model, data, floor, i) for i in tires) / float(rise)
    point, normal = floor_plane(model, data)
    gap = min((data.geom_xpos[i] - point) @ normal - _reach(model, data, i, normal) for i in tires)
    return float(gap / normal[2])


def _reach(model: mujoco.MjModel, data: mujoco.MjData, geom: int, normal: Array) -> float:
    """How far an ellipsoid reaches from its centre against the normal, m."""
    axes = data.geom_xmat[geom].reshape(3, 3)
    return float(np.linalg.norm(model.geom_size[geom] * (normal @ axes)))


def _field(model: mujoco.MjModel, floor: int) -> HeightField:
    """The height field of a geom."""
    which = int(model.geom_dataid[floor])
    half_x, half_y, top, _ = map(float, model.hfield_size[which])
    rows, columns = int(model.hfield_nrow[which]), int(model.hfield_ncol[which])
    first = int(model.hfield_adr[which])
    return HeightField(model.hfield_data, first, rows, columns, half_x, half_y, top)


def _in_field(data: mujoco.MjData, floor: int, places: Array) -> Array:
    """Places (..., 3) of the world in the frame of the field."""
    axes = data.geom_xmat[floor].reshape(3, 3)
    return np.asarray((places - data.geom_xpos[floor]) @ axes)


def _under(model: mujoco.MjModel, data: mujoco.MjData, floor: int, tire: int) -> Array:
    """The point (3,) of the field under a tire's middle, in the frame of the field."""
    field = _field(model, floor)
    x, y, _ = map(float, _in_field(data, floor, data.geom_xpos[tire]))
    inside, height, _, _ = ground_at(field, x, y)
    if not inside:
        raise MjchairError(
            f"{names.geoms(model)[tire]} would start at x {x:.3g}, y {y:.3g} m of the height "
            f"field, which goes to {field.half_x:g} and {field.half_y:g} m on either side; start "
            "the chair on it"
        )
    return np.array([x, y, height])


def _above_field(model: mujoco.MjModel, data: mujoco.MjData, floor: int, tire: int) -> float:
    """How far above the field the nearest point of a tire's surface is, along the field's z, m."""
    round_, across = np.meshgrid(np.arange(ROUND) * (2.0 * math.pi / ROUND), ACROSS)
    ball = np.stack(
        [np.cos(round_) * np.cos(across), np.sin(round_) * np.cos(across), np.sin(across)], axis=-1
    ).reshape(-1, 3)
    axes = data.geom_xmat[tire].reshape(3, 3)
    surface = data.geom_xpos[tire] + (model.geom_size[tire] * ball) @ axes.T
    field, above = _field(model, floor), math.inf
    for x, y, z in _in_field(data, floor, surface).tolist():
        inside, height, _, _ = ground_at(field, x, y)
        above = min(above, z - height) if inside else above
    return above
