"""A tire on a height field as one contact, without a kick where the slope changes.

The part of the tire that lies below the ground is cut into upright columns; each is a spring, as
long as the ground there is above the tire's underside (the depth w of the column). A plane stands
for the ground:

- its slope is the ground's mean slope over the columns, weighted by w: all the springs together
  push at right angles to it;
- it is as high as makes the springs on it hold the same energy, the sum of w^2 / 2.

The contact is the ellipsoid's with that plane, as MuJoCo has it on a plane. Its depth is given
times the ratio of the springs' force on the ground to their force on the plane: that is how fast
the depth grows with the way along the normal, so that with it the contact's force has a potential
and rolling over a bump makes no energy.

On a floor that is plane, level or sloped, this is the plane's contact up to rounding, whatever
the columns are. Where the slope changes, the tire goes over in the length of its own dent, and
not from one step to the next. At a step in the field the edge pushes as soon as the tire's nose
reaches over it.

Between its points the field is bilinear (MuJoCo's own is two triangles a cell); beyond its rim
there is no ground.
"""

from __future__ import annotations

import math

import numpy as np
from numba.extending import register_jitable

ALONG, ACROSS = 96, 4  # columns on either side of the middle one
COLUMNS = (2 * ALONG + 1) * (2 * ACROSS + 1)
WIDEST = 1.3  # rad, up to which the columns go round the tire on either side
NEAR, FAR = 0.15, 0.95  # of the half width: how far they reach across if evenly spaced; in truth
EXACT = 1e-12  # of the depth, to which the plane's height is found
SPARE = 3.0  # times the tire's rise under the ground's top: how much of it gets columns
MOST_LOOKS = 3  # for the highest ground under the tire
MOST_TURNS = 20  # of the search for it; it takes two or three, none on a plane


@register_jitable(forceinline=True)
def place_along(i):
    """Where the i-th row of columns stands, of the radius, and its width: even in the angle."""
    angle = WIDEST * i / ALONG
    return math.sin(angle), WIDEST / ALONG * math.cos(angle)


@register_jitable(forceinline=True)
def row_at(part):
    """The last row that stands no farther than that part of the radius."""
    return min(int(math.asin(min(max(part, 0.0), 1.0)) / WIDEST * ALONG), ALONG)


@register_jitable(forceinline=True)
def place_across(j):
    """Where the j-th column of a row stands, of the half width, and its width: dense inside."""
    t, bend = j / ACROSS, FAR - NEAR
    return NEAR * t + bend * t * t * t, (NEAR + 3.0 * bend * t * t) / ACROSS


@register_jitable(forceinline=True)
def ground_at(heights, first, nrow, ncol, size, field, x, y):
    """Height (m) and slope of the field at x, y in its own frame.

    Args:
      heights: of all fields, in units of size[field, 2]; this one's begin at `first`.
      size: (fields, 4): half lengths along x and y, height of the top, m.

    Returns:
      inside the field or not, height (m), slope along x and y.
    """
    dx = 2.0 * size[field, 0] / (ncol - 1)
    dy = 2.0 * size[field, 1] / (nrow - 1)
    column, row = (x + size[field, 0]) / dx, (y + size[field, 1]) / dy
    if column < 0.0 or row < 0.0 or column > ncol - 1 or row > nrow - 1:
        return False, 0.0, 0.0, 0.0
    c, r = min(int(column), ncol - 2), min(int(row), nrow - 2)
    s, t = column - c, row - r
    at, top = first + r * ncol + c, size[field, 2]
    h00, h10 = top * heights[at], top * heights[at + 1]
    h01, h11 = top * heights[at + ncol], top * heights[at + ncol + 1]
    low, high = h00 + s * (h10 - h00), h01 + s * (h11 - h01)
    slope_x = ((1.0 - t) * (h10 - h00) + t * (h11 - h01)) / dx
    return True, low + t * (high - low), slope_x, (high - low) / dy


@register_jitable
def in_frame(pos, mat, ground, tire):
    """Middle (3, m) and axes (3, 3; one a column) of the tire in the ground's frame."""
    middle, axes = np.zeros(3), np.zeros((3, 3))
    for i in range(3):
        for j in range(3):
            middle[i] += mat[ground, 3 * j + i] * (pos[tire, j] - pos[ground, j])
            for k in range(3):
                axes[i, k] += mat[ground, 3 * j + i] * mat[tire, 3 * j + k]
    return middle, axes


@register_jitable
def quadric(axes, size, tire, power):
    """Sum over the axes of axis axis' times its half length to the power: (3, 3)."""
    out = np.zeros((3, 3))
    for k in range(3):
        factor = size[tire, k] ** power
        for i in range(3):
            for j in range(3):
                out[i, j] += factor * axes[i, k] * axes[j, k]
    return out


@register_jitable(forceinline=True)
def cap_reach(shape, cosine, x, y):
    """How far (m) the tire's lowest cap reaches from its middle in the direction (x, y, 0).

    Args:
      shape: `quadric` of power 2. cosine: of the angle from the lowest point to the cap's rim,
        where the tire is stretched to a ball; 0 or more.
    """
    far = math.sqrt(x * x * shape[0, 0] + 2.0 * x * y * shape[0, 1] + y * y * shape[1, 1])
    towards = -(x * shape[0, 2] + y * shape[1, 2]) / (far * math.sqrt(shape[2, 2]))
    if towards >= cosine:
        return far
    return far * (
        towards * cosine
        + math.sqrt(max(1.0 - towards * towards, 0.0)) * math.sqrt(max(1.0 - cosine * cosine, 0.0))
    )


@register_jitable
def cap_cosine(shape, rise):
    """See `cap_reach`: for the cap of the tire that is up to `rise` (m) above its lowest point."""
    return max(1.0 - rise / math.sqrt(shape[2, 2]), 0.0)


@register_jitable
def highest(heights, first, nrow, ncol, size, field, low_x, high_x, low_y, high_y):
    """Height (m) of the field's highest point in the cells that a rectangle touches."""
    dx = 2.0 * size[field, 0] / (ncol - 1)
    dy = 2.0 * size[field, 1] / (nrow - 1)
    column = max(int((low_x + size[field, 0]) / dx), 0)
    row = max(int((low_y + size[field, 1]) / dy), 0)
    last_column = min(int((high_x + size[field, 0]) / dx) + 1, ncol - 1)
    last_row = min(int((high_y + size[field, 1]) / dy) + 1, nrow - 1)
    top = 0.0
    for r in range(row, last_row + 1):
        for c in range(column, last_column + 1):
            top = max(top, heights[first + r * ncol + c])
    return size[field, 2] * top


@register_jitable
def top_underneath(middle, shape, heights, first, nrow, ncol, size, field, margin):
    """Height (m), lifted by the margin, that the ground under the part of the tire below it has.

    Nothing higher than that can touch the tire: first the field's top, then that of the cells
    under what lies below it, and so on.
    """
    top = size[field, 2] + margin
    lowest = middle[2] - math.sqrt(shape[2, 2])
    for _ in range(MOST_LOOKS):
        if lowest >= top:
            break
        cosine = cap_cosine(shape, top - lowest)
        near = highest(
            heights,
            first,
            nrow,
            ncol,
            size,
            field,
            middle[0] - cap_reach(shape, cosine, -1.0, 0.0),
            middle[0] + cap_reach(shape, cosine, 1.0, 0.0),
            middle[1] - cap_reach(shape, cosine, 0.0, -1.0),
            middle[1] + cap_reach(shape, cosine, 0.0, 1.0),
        )
        top = min(top, near + margin)
    return top


@register_jitable
def stand_columns(middle, axes, shape, size, tire, top, columns):
    """Stand the columns under the tire, along and across its rolling direction.

    Args:
      middle, axes: of the tire in the field's frame. shape: `quadric` of power 2.
      top: m; as much of the tire gets columns as is up to `SPARE` times that above its lowest
        point, for the plane that stands for the ground may rise higher than the ground.
      columns: (4, COLUMNS) to fill: place from the middle along x and y (m), height of the
        tire's underside (m), weight (1).

    Returns:
      How many columns there are: none where the whole tire is above `top`.
    """
    reach = math.sqrt(shape[2, 2])
    rise = top - (middle[2] - reach)
    if rise <= 0.0:
        return 0
    keep = middle[2] - reach + SPARE * rise
    inverse = quadric(axes, size, tire, -2)
    lowest_x, lowest_y = -shape[0, 2] / reach, -shape[1, 2] / reach
    ex, ey = axes[1, 2], -axes[0, 2]
    long = math.sqrt(ex * ex + ey * ey)
    if long < 1e-9:  # it lies on its side and rolls nowhere
        ex, ey, long = 1.0, 0.0, 1.0
    ex, ey = ex / long, ey / long
    cosine, lowest_e = cap_cosine(shape, SPARE * rise), lowest_x * ex + lowest_y * ey
    ahead = row_at((cap_reach(shape, cosine, ex, ey) - lowest_e) / size[tire, 0])
    behind = row_at((cap_reach(shape, cosine, -ex, -ey) + lowest_e) / size[tire, 0])
    count = 0
    for i in range(-behind, ahead + 1):
        along, width = place_along(i)
        along *= size[tire, 0]
        for j in range(-ACROSS, ACROSS + 1):
            across, breadth = place_across(j)
            across *= size[tire, 2]
            x = lowest_x + along * ex - across * ey
            y = lowest_y + along * ey + across * ex
            # the lower z of (x, y, z) inverse (x, y, z)' = 1
            b = inverse[0, 2] * x + inverse[1, 2] * y
            c = inverse[0, 0] * x * x + 2.0 * inverse[0, 1] * x * y + inverse[1, 1] * y * y - 1.0
            root = b * b - inverse[2, 2] * c
            if root <= 0.0:
                continue
            under = middle[2] - (b + math.sqrt(root)) / inverse[2, 2]
            if under >= keep:
                continue
            columns[0, count], columns[1, count] = x, y
            columns[2, count], columns[3, count] = under, width * breadth
            count += 1
    return count


@register_jitable
def press(columns, count, middle, heights, first, nrow, ncol, size, field, margin):
    """What the ground, lifted by the margin, presses into the columns.

    Returns:
      force: sum of the weighted depths (m); energy: half that of their squares (m^2); the
      ground's mean slope along x and y, and its mean height (m) where that slope passes the
      tire's middle, all weighted by the depth. Zeros where it presses nothing.
    """
    force, energy, slope_x, slope_y, high = 0.0, 0.0, 0.0, 0.0, 0.0
    far_x, far_y, top = 0.0, 0.0, size[field, 2] + margin
    for i in range(count):
        x, y, under = columns[0, i], columns[1, i], columns[2, i]
        if under >= top:
            continue
        inside, height, steep_x, steep_y = ground_at(
            heights, first, nrow, ncol, size, field, middle[0] + x, middle[1] + y
        )
        depth = height + margin - under
        if not inside or depth <= 0.0:
            continue
        push = columns[3, i] * depth
        force += push
        energy += 0.5 * push * depth
        slope_x += push * steep_x
        slope_y += push * steep_y
        high += push * (height + margin)
        far_x += push * x
        far_y += push * y
    if force == 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    slope_x, slope_y = slope_x / force, slope_y / force
    return force, energy, slope_x, slope_y, (high - slope_x * far_x - slope_y * far_y) / force


@register_jitable
def height_of_plane(columns, count, slope_x, slope_y, start, pressed):
    """The plane whose pressing has the energy `pressed`: its height (m) under the tire's middle.

    Newton's method on the cube root of the energy, which is nearly linear in the height.

    Returns:
      Height, and the force there, as `press` has it (m).
    """
    height, force = start, 0.0
    for _ in range(MOST_TURNS):
        energy, force = 0.0, 0.0
        for i in range(count):
            ground = height + slope_x * columns[0, i] + slope_y * columns[1, i]
            depth = ground - columns[2, i]
            if depth > 0.0:
                energy += 0.5 * columns[3, i] * depth * depth
                force += columns[3, i] * depth
        if force == 0.0:
            break
        step = 3.0 * (math.pow(pressed * energy * energy, 1.0 / 3.0) - energy) / force
        height += step
        if abs(step) <= EXACT * energy / force:
            break
    return height, force


@register_jitable
def meet(middle, shape, slope_x, slope_y, height):
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
def touch(pos, mat, sizes, ground, tire, heights, first, nrow, ncol, size, field, margin, out):
    """The contact of an ellipsoid tire with a height field.

    Args:
      pos, mat, sizes: (ngeom, 3), (ngeom, 9), (ngeom, 3): places and axes in the world, half
        axes (R, R, b). ground, tire: the two geoms.
      heights, first, nrow, ncol, size, field: see `ground_at`.
      margin: m, the distance within which there is a contact already.
      out: (7,) to fill, in the world: distance (m, negative: into one another), place midway
        between the two (3, m), normal from the ground to the tire (3).

    Returns:
      Whether there is a contact.
    """
    middle, axes = in_frame(pos, mat, ground, tire)
    shape = quadric(axes, sizes, tire, 2)
    top = top_underneath(middle, shape, heights, first, nrow, ncol, size, field, margin)
    columns = np.empty((4, COLUMNS))
    count = stand_columns(middle, axes, shape, sizes, tire, top, columns)
    force, energy, slope_x, slope_y, start = press(
        columns, count, middle, heights, first, nrow, ncol, size, field, margin
    )
    if force == 0.0:
        return False
    height, plane_force = height_of_plane(columns, count, slope_x, slope_y, start, energy)
    far, normal, place = meet(middle, shape, slope_x, slope_y, height - margin)
    if far >= margin or plane_force == 0.0:
        return False
    far = margin + (far - margin) * force / plane_force
    out[0] = far
    for i in range(3):
        out[1 + i], out[4 + i] = pos[ground, i], 0.0
        for j in range(3):
            out[1 + i] += mat[ground, 3 * i + j] * (place[j] - 0.5 * far * normal[j])
            out[4 + i] += mat[ground, 3 * i + j] * normal[j]
    return True
