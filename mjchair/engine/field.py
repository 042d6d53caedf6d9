"""The contact of a tire with a height field: one contact, without a jump where the slope changes.

In: places and sizes of the tire's geom and the field's, and the heights. Out: distance, place and
normal of the contact.

The part of the tire that lies below the ground is cut into upright columns; each is a spring, as
long as the ground there is above the tire's underside (the depth w of the column). A plane stands
for the ground:

- its slope is the ground's mean slope over the columns, weighted by w: all the springs together
  push at right angles to it;
- it is as high as makes the springs on it hold the same energy, the sum of w^2 / 2.

The contact is the ellipsoid's with that plane, as MuJoCo has it on a plane. Its depth is given
times the ratio of the springs' force on the ground to their force on the plane. With this depth
the contact's force has a potential, so that rolling over a bump adds no energy.

On a flat floor, level or sloped, the result is the contact with a plane up to rounding, whatever
the columns are. Where the slope changes, the normal turns while the tire rolls the length of its
own dent, and not within one time step. At a step in the field the edge pushes as soon as the front
of the tire is above it.

Between its points the field is bilinear (MuJoCo's own is two triangles a cell); beyond its rim
there is no ground.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba.extending import register_jitable
from numpy.typing import NDArray

Array = NDArray[np.float64]

ALONG, ACROSS = 96, 4  # columns on either side of the middle one
COLUMNS = (2 * ALONG + 1) * (2 * ACROSS + 1)
LARGEST_ANGLE = 1.3  # rad, up to which the columns go round the tire on either side
# of the half width: where the outermost column stands is FAR; inside they stand as densely as if
# they were evenly spaced up to NEAR
NEAR, FAR = 0.15, 0.95
HEIGHT_TOLERANCE = 1e-12  # of the depth, to which the plane's height is computed
RISE_FACTOR = 3.0  # times the tire's rise under the ground's top: how much of it gets columns
MAX_TOP_ITERATIONS = 3  # of the search for the highest ground under the tire
MAX_HEIGHT_ITERATIONS = 20  # for the plane's height; two or three are enough, on a plane none


class HeightField(NamedTuple):
    """A height field in its own frame.

    Attributes:
      heights: of all fields of the model, in units of `top`; this one's begin at `first`.
      nrow, ncol: points along y and x. half_x, half_y: half lengths, m. top: greatest height, m.
    """

    heights: NDArray[np.float32]
    first: int
    nrow: int
    ncol: int
    half_x: float
    half_y: float
    top: float


class Geoms(NamedTuple):
    """Where the geoms of a model are, and their sizes.

    Attributes:
      pos: (ngeom, 3), m, world. mat: (ngeom, 9), axes in the world. size: (ngeom, 3), m.
    """

    pos: Array
    mat: Array
    size: Array


class Ellipsoid(NamedTuple):
    """A tire in the frame of the ground.

    Attributes:
      middle: (3,), m. axes: (3, 3), one a column. half: half lengths of the axes (R, R, b), m.
    """

    middle: Array
    axes: Array
    half: tuple[float, float, float]


class Dent(NamedTuple):
    """What the ground presses into the columns, weighted by their depth; zeros: nothing.

    Attributes:
      force: sum of the depths, m. energy: half the sum of their squares, m^2.
      slope_x, slope_y: of the ground, mean. height: mean, where that slope passes the tire's
        middle, m.
    """

    force: float
    energy: float
    slope_x: float
    slope_y: float
    height: float


@register_jitable(forceinline=True)
def place_along(i: int) -> tuple[float, float]:
    """Where the i-th row of columns stands, of the radius, and its width: even in the angle."""
    angle = LARGEST_ANGLE * i / ALONG
    return math.sin(angle), LARGEST_ANGLE / ALONG * math.cos(angle)


@register_jitable(forceinline=True)
def row_at(part: float) -> int:
    """The last row that stands no farther than that part of the radius."""
    return min(int(math.asin(min(max(part, 0.0), 1.0)) / LARGEST_ANGLE * ALONG), ALONG)


@register_jitable(forceinline=True)
def place_across(j: int) -> tuple[float, float]:
    """Where the j-th column of a row stands, of the half width, and its width: dense inside."""
    t, bend = j / ACROSS, FAR - NEAR
    return NEAR * t + bend * t * t * t, (NEAR + 3.0 * bend * t * t) / ACROSS


@register_jitable(forceinline=True)
def ground_at(field: HeightField, x: float, y: float) -> tuple[bool, float, float, float]:
    """Height (m) and slope of the field at x, y in its own frame.

    Returns:
      inside the field or not, height (m), slope along x and y.
    """
    nrow, ncol, heights, top = field.nrow, field.ncol, field.heights, field.top
    dx = 2.0 * field.half_x / (ncol - 1)
    dy = 2.0 * field.half_y / (nrow - 1)
    column, row = (x + field.half_x) / dx, (y + field.half_y) / dy
    if column < 0.0 or row < 0.0 or column > ncol - 1 or row > nrow - 1:
        return False, 0.0, 0.0, 0.0
    c, r = min(int(column), ncol - 2), min(int(row), nrow - 2)
    s, t = column - c, row - r
    at = field.first + r * ncol + c
    h00, h10 = top * heights[at], top * heights[at + 1]
    h01, h11 = top * heights[at + ncol], top * heights[at + ncol + 1]
    low, high = h00 + s * (h10 - h00), h01 + s * (h11 - h01)
    slope_x = ((1.0 - t) * (h10 - h00) + t * (h11 - h01)) / dx
    return True, low + t * (high - low), slope_x, (high - low) / dy


@register_jitable
def tire_in_field_frame(geoms: Geoms, ground: int, tire: int) -> Ellipsoid:
    """The tire in the ground's frame."""
    pos, mat, size = geoms
    middle, axes = np.zeros(3), np.zeros((3, 3))
    for i in range(3):
        for j in range(3):
            middle[i] += mat[ground, 3 * j + i] * (pos[tire, j] - pos[ground, j])
            for k in range(3):
                axes[i, k] += mat[ground, 3 * j + i] * mat[tire, 3 * j + k]
    return Ellipsoid(middle, axes, (size[tire, 0], size[tire, 1], size[tire, 2]))


@register_jitable
def quadric(tire: Ellipsoid, power: int) -> Array:
    """Sum over the axes of axis axis' times its half length to the power: (3, 3)."""
    out = np.zeros((3, 3))
    for k in range(3):
        factor = tire.half[k] ** power
        for i in range(3):
            for j in range(3):
                out[i, j] += factor * tire.axes[i, k] * tire.axes[j, k]
    return out


@register_jitable(forceinline=True)
def cap_reach(shape: Array, cosine: float, x: float, y: float) -> float:
    """How far (m) the tire's lowest cap reaches from its middle in the direction (x, y, 0).

    Args:
      shape: `quadric` of power 2. cosine: of the angle from the lowest point to the cap's rim,
        where the tire is stretched to a ball; 0 or more.
    """
    distance = math.sqrt(x * x * shape[0, 0] + 2.0 * x * y * shape[0, 1] + y * y * shape[1, 1])
    towards = -(x * shape[0, 2] + y * shape[1, 2]) / (distance * math.sqrt(shape[2, 2]))
    if towards >= cosine:
        return distance
    return distance * (
        towards * cosine
        + math.sqrt(max(1.0 - towards * towards, 0.0)) * math.sqrt(max(1.0 - cosine * cosine, 0.0))
    )


@register_jitable
def cap_cosine(shape: Array, rise: float) -> float:
    """See `cap_reach`: for the cap of the tire that is up to `rise` (m) above its lowest point."""
    return max(1.0 - rise / math.sqrt(shape[2, 2]), 0.0)


@register_jitable
def highest_ground(
    field: HeightField, low_x: float, high_x: float, low_y: float, high_y: float
) -> float:
    """Height (m) of the field's highest point in the cells that a rectangle touches."""
    nrow, ncol = field.nrow, field.ncol
    dx = 2.0 * field.half_x / (ncol - 1)
    dy = 2.0 * field.half_y / (nrow - 1)
    column = max(int((low_x + field.half_x) / dx), 0)
    row = max(int((low_y + field.half_y) / dy), 0)
    last_column = min(int((high_x + field.half_x) / dx) + 1, ncol - 1)
    last_row = min(int((high_y + field.half_y) / dy) + 1, nrow - 1)
    top = 0.0
    for r in range(row, last_row + 1):
        for c in range(column, last_column + 1):
            top = max(top, field.heights[field.first + r * ncol + c])
    return field.top * top


@register_jitable
def top_underneath(middle: Array, shape: Array, field: HeightField, margin: float) -> float:
    """Height (m), lifted by the margin, that the ground under the part of the tire below it has.

    Nothing higher than that can touch the tire: first the field's top, then that of the cells
    under what lies below it, and so on.
    """
    top = field.top + margin
    lowest = middle[2] - math.sqrt(shape[2, 2])
    for _ in range(MAX_TOP_ITERATIONS):
        if lowest >= top:
            break
        cosine = cap_cosine(shape, top - lowest)
        near = highest_ground(
            field,
            middle[0] - cap_reach(shape, cosine, -1.0, 0.0),
            middle[0] + cap_reach(shape, cosine, 1.0, 0.0),
            middle[1] - cap_reach(shape, cosine, 0.0, -1.0),
            middle[1] + cap_reach(shape, cosine, 0.0, 1.0),
        )
        top = min(top, near + margin)
    return top


@register_jitable
def stand_columns(tire: Ellipsoid, shape: Array, top: float, columns: Array) -> int:
    """Stand the columns under the tire, along and across its rolling direction.

    Args:
      tire: in the field's frame. shape: `quadric` of power 2.
      top: m; as much of the tire gets columns as is up to `RISE_FACTOR` times that above its lowest
        point, for the plane that stands for the ground may rise higher than the ground.
      columns: (4, COLUMNS) to fill: place from the middle along x and y (m), height of the
        tire's underside (m), weight (1).

    Returns:
      How many columns there are: none where the whole tire is above `top`.
    """
    middle, axes = tire.middle, tire.axes
    reach = math.sqrt(shape[2, 2])
    rise = top - (middle[2] - reach)
    if rise <= 0.0:
        return 0
    limit = middle[2] - reach + RISE_FACTOR * rise
    inverse = quadric(tire, -2)
    lowest_x, lowest_y = -shape[0, 2] / reach, -shape[1, 2] / reach
    ex, ey = axes[1, 2], -axes[0, 2]
    length = math.sqrt(ex * ex + ey * ey)
    if length < 1e-9:  # it lies on its side and rolls nowhere
        ex, ey, length = 1.0, 0.0, 1.0
    ex, ey = ex / length, ey / length
    cosine, lowest_e = cap_cosine(shape, RISE_FACTOR * rise), lowest_x * ex + lowest_y * ey
    ahead = row_at((cap_reach(shape, cosine, ex, ey) - lowest_e) / tire.half[0])
    behind = row_at((cap_reach(shape, cosine, -ex, -ey) + lowest_e) / tire.half[0])
    count = 0
    for i in range(-behind, ahead + 1):
        along, width = place_along(i)
        along *= tire.half[0]
        for j in range(-ACROSS, ACROSS + 1):
            across, breadth = place_across(j)
            across *= tire.half[2]
            x = lowest_x + along * ex - across * ey
            y = lowest_y + along * ey + across * ex
            # the lower z of (x, y, z) inverse (x, y, z)' = 1
            b = inverse[0, 2] * x + inverse[1, 2] * y
            c = inverse[0, 0] * x * x + 2.0 * inverse[0, 1] * x * y + inverse[1, 1] * y * y - 1.0
            root = b * b - inverse[2, 2] * c
            if root <= 0.0:
                continue
            under = middle[2] - (b + math.sqrt(root)) / inverse[2, 2]
            if under >= limit:
                continue
            columns[0, count], columns[1, count] = x, y
            columns[2, count], columns[3, count] = under, width * breadth
            count += 1
    return count


@register_jitable
def dent_of_ground(
    columns: Array, count: int, middle: Array, field: HeightField, margin: float
) -> Dent:
    """The dent that the ground, lifted by the margin, makes in the columns."""
    force, energy, slope_x, slope_y, heights = 0.0, 0.0, 0.0, 0.0, 0.0
    place_x, place_y, top = 0.0, 0.0, field.top + margin
    for i in range(count):
        x, y, under = columns[0, i], columns[1, i], columns[2, i]
        if under >= top:
            continue
        inside, height, steep_x, steep_y = ground_at(field, middle[0] + x, middle[1] + y)
        depth = height + margin - under
        if not inside or depth <= 0.0:
            continue
        push = columns[3, i] * depth
        force += push
        energy += 0.5 * push * depth
        slope_x += push * steep_x
        slope_y += push * steep_y
        heights += push * (height + margin)
        place_x += push * x
        place_y += push * y
    if force == 0.0:
        return Dent(0.0, 0.0, 0.0, 0.0, 0.0)
    slope_x, slope_y = slope_x / force, slope_y / force
    height = (heights - slope_x * place_x - slope_y * place_y) / force
    return Dent(force, energy, slope_x, slope_y, height)


@register_jitable
def height_of_plane(columns: Array, count: int, dent: Dent) -> tuple[float, float]:
    """The plane whose dent has the same energy: its height (m) under the tire's middle.

    Newton's method on the cube root of the energy, which is nearly linear in the height.

    Returns:
      Height, and the force there, as `dent_of_ground` has it (m).
    """
    height, force = dent.height, 0.0
    for _ in range(MAX_HEIGHT_ITERATIONS):
        energy, force = 0.0, 0.0
        for i in range(count):
            ground = height + dent.slope_x * columns[0, i] + dent.slope_y * columns[1, i]
            depth = ground - columns[2, i]
            if depth > 0.0:
                energy += 0.5 * columns[3, i] * depth * depth
                force += columns[3, i] * depth
        if force == 0.0:
            break
        step = 3.0 * (math.pow(dent.energy * energy * energy, 1.0 / 3.0) - energy) / force
        height += step
        if abs(step) <= HEIGHT_TOLERANCE * energy / force:
            break
    return height, force


@register_jitable
def contact_with_plane(
    middle: Array, shape: Array, slope_x: float, slope_y: float, height: float
) -> tuple[float, Array, Array]:
    """The contact of the tire with a plane through (middle x, middle y, height), in its frame.

    Returns:
      Distance (m, negative: into one another), normal (3), place on the tire (3, m).
    """
    normal, place = np.empty(3), np.zeros(3)
    up = 1.0 / math.sqrt(1.0 + slope_x * slope_x + slope_y * slope_y)
    normal[0], normal[1], normal[2] = -slope_x * up, -slope_y * up, up
    support = 0.0
    for i in range(3):
        for j in range(3):
            place[i] += shape[i, j] * normal[j]
        support += normal[i] * place[i]
    support = math.sqrt(support)
    for i in range(3):
        place[i] = middle[i] - place[i] / support
    return (middle[2] - height) * up - support, normal, place


@register_jitable
def tire_contact(
    geoms: Geoms, ground: int, wheel: int, field: HeightField, margin: float, out: Array
) -> bool:
    """The contact of an ellipsoid tire with a height field.

    Args:
      geoms: of the model. ground, wheel: which of them are the field and the tire.
      field: the height field.
      margin: m, the distance within which there is a contact already.
      out: (7,) to fill, in the world: distance (m, negative: into one another), place midway
        between the two (3, m), normal from the ground to the tire (3).

    Returns:
      Whether there is a contact.
    """
    tire = tire_in_field_frame(geoms, ground, wheel)
    shape = quadric(tire, 2)
    top = top_underneath(tire.middle, shape, field, margin)
    columns = np.empty((4, COLUMNS))
    count = stand_columns(tire, shape, top, columns)
    dent = dent_of_ground(columns, count, tire.middle, field, margin)
    if dent.force == 0.0:
        return False
    height, plane_force = height_of_plane(columns, count, dent)
    distance, normal, place = contact_with_plane(
        tire.middle, shape, dent.slope_x, dent.slope_y, height - margin
    )
    if distance >= margin or plane_force == 0.0:
        return False
    distance = margin + (distance - margin) * dent.force / plane_force
    pos, mat = geoms.pos, geoms.mat
    out[0] = distance
    for i in range(3):
        out[1 + i], out[4 + i] = pos[ground, i], 0.0
        for j in range(3):
            out[1 + i] += mat[ground, 3 * i + j] * (place[j] - 0.5 * distance * normal[j])
            out[4 + i] += mat[ground, 3 * i + j] * normal[j]
    return True
