"""The contacts of one wheel as one contact: its place, its normal, and its load.

In: the views of a model and its data, and a tire geom. Out: the patch that stands for all of its
contacts, and a share of stiffness for each of them, in `efc_D`.

MuJoCo makes one contact with a plane, a box or a mesh, and engine/field.py makes one with a height
field. A floor may consist of several geoms, as tiles do, or a kerb on a plane. Each contact is a
spring, so two contacts with one flat floor would be twice as stiff as one, and a contact with the
edge of a neighbouring tile pushes in a slanted direction. Therefore each contact gets a share of
its stiffness, way_i / depth_i, where the ways are the solution of

    way_i >= 0,   sum over j of overlap_ij way_j >= depth_i,   one of the two with equality.

overlap_ij says how much of the dent of contact i is already made by the dent of contact j: 1 at
the same place, falling with the square of the distance as the ellipsoid rises, to 0 where the
dents end. Tiles in one plane count once, as the deepest contact alone; a floor and a kerb that are
a dent's length apart are two springs. Between the two cases the shares change continuously: a
contact that begins or ends has a share of 0. For a given overlap the force has the potential
stiffness * (way . depth - way . overlap way / 2),  so that rolling over an edge neither adds nor
removes energy.

The shares are written as factors of `efc_D`, the mass of the constraint. `efc_R` stays as MuJoCo
made it, so doing this twice gives the same result as once. Solvers of the primal problem (Newton,
CG) read `efc_D`; PGS does not, and `mj_inverse` computes its own.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from numba.extending import register_jitable

from mjchair.engine.views import Array, DataView, ModelView

ENOUGH = 1e-6  # of the depth: a contact that others leave less deep than this gets no share
WIDTH = 1.5  # times the deepest depth: dents of that depth overlap; on a flat floor 1 would do
MOST_TURNS = 20  # iterations of the search for the contacts that share; it takes one or two


class Patch(NamedTuple):
    """Where and how the ground touches a geom.

    Attributes:
      contacts: how many. nx, ny, nz: normal, towards the geom. px, py, pz: place, m, world.
      ground: the geom on the other side of the deepest contact; -1: there is no contact.
    """

    contacts: int
    nx: float
    ny: float
    nz: float
    px: float
    py: float
    pz: float
    ground: int


@register_jitable(forceinline=True)
def dot(rows: Array, row: int, column: int, ax: float, ay: float, az: float) -> float:
    """Scalar product of three numbers of a row, from `column` on, with a vector.

    Rows are read by index. Taking the row as an array of its own would cost more than the product.
    """
    return rows[row, column] * ax + rows[row, column + 1] * ay + rows[row, column + 2] * az


@register_jitable(forceinline=True)
def side_of(d: DataView, c: int, geom: int) -> float:
    """1 where the normal of contact c points towards the geom, -1 where away, 0: not its contact.

    Contacts that push nothing (outside their margin, or left out by the engine) are not its own.
    """
    side = 0.0
    if d.contact_geom[c, 1] == geom:
        side = 1.0
    elif d.contact_geom[c, 0] == geom:
        side = -1.0
    if side != 0.0 and (
        d.contact_efc_address[c] < 0 or d.contact_dist[c] >= d.contact_includemargin[c]
    ):
        side = 0.0
    return side


@register_jitable(forceinline=True)
def contact_patch(d: DataView, geom: int) -> Patch:
    """The contacts of the geom as one, weighted by their share."""
    count, weight, deepest, ground = 0, 0.0, 0.0, -1
    nx = ny = nz = px = py = pz = 0.0
    for c in range(d.contact_dist.shape[0]):
        side = side_of(d, c, geom)
        if side == 0.0:
            continue
        row = d.contact_efc_address[c]
        share = d.efc_D[row] * d.efc_R[row]
        way = share * (d.contact_includemargin[c] - d.contact_dist[c])
        count += 1
        weight += way
        nx += way * side * d.contact_frame[c, 0]
        ny += way * side * d.contact_frame[c, 1]
        nz += way * side * d.contact_frame[c, 2]
        px += way * d.contact_pos[c, 0]
        py += way * d.contact_pos[c, 1]
        pz += way * d.contact_pos[c, 2]
        if way > deepest:
            deepest = way
            ground = d.contact_geom[c, 0] if side > 0.0 else d.contact_geom[c, 1]
    size = math.sqrt(nx * nx + ny * ny + nz * nz)
    if size == 0.0:
        return Patch(0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1)
    return Patch(
        count, nx / size, ny / size, nz / size, px / weight, py / weight, pz / weight, ground
    )


@register_jitable(forceinline=True)
def contact_load(d: DataView, geom: int, nx: float, ny: float, nz: float) -> float:
    """Solved load (N) of the geom's contacts along the normal; valid after the solve only."""
    load = 0.0
    for c in range(d.contact_dist.shape[0]):
        address = d.contact_efc_address[c]
        if address < 0:
            continue
        if d.contact_geom[c, 0] == geom:
            load -= d.efc_force[address] * dot(d.contact_frame, c, 0, nx, ny, nz)
        elif d.contact_geom[c, 1] == geom:
            load += d.efc_force[address] * dot(d.contact_frame, c, 0, nx, ny, nz)
    return max(load, 0.0)


@register_jitable
def depth_of(d: DataView, c: int) -> float:
    """How deep contact c is, m."""
    return d.contact_includemargin[c] - d.contact_dist[c]


@register_jitable
def overlap(m: ModelView, d: DataView, geom: int, deepest: int, a: int, b: int) -> float:
    """How much of the dent of contact a the dent of contact b brings along, 0 to 1.

    An ellipsoid (R, R, b) that is pressed in by D dents a floor over x^2 / R^2 + y^2 / b^2 =
    2 D / R, y along its axis.
    """
    p, mat, size = d.contact_pos, d.geom_xmat, m.geom_size
    sx, sy, sz = p[a, 0] - p[b, 0], p[a, 1] - p[b, 1], p[a, 2] - p[b, 2]
    y = sx * mat[geom, 2] + sy * mat[geom, 5] + sz * mat[geom, 8]
    x2 = max(sx * sx + sy * sy + sz * sz - y * y, 0.0)
    radius, half = size[geom, 0], size[geom, 2]
    q = radius * (x2 / (radius * radius) + y * y / (half * half)) / (2.0 * WIDTH)
    return max(1.0 - q / depth_of(d, deepest), 0.0)


@register_jitable
def ways_of_two(
    m: ModelView, d: DataView, geom: int, deepest: int, a: int, b: int
) -> tuple[float, float]:
    """Ways (m) of two contacts with which both just clear; one may be negative."""
    c = overlap(m, d, geom, deepest, a, b)
    det = 1.0 - c * c
    da, db = depth_of(d, a), depth_of(d, b)
    if det <= ENOUGH * ENOUGH:  # they overlap too much to tell
        return -1.0, -1.0
    return (da - c * db) / det, (db - c * da) / det


@register_jitable
def ways_of_three(
    m: ModelView, d: DataView, geom: int, deepest: int, a: int, b: int, c: int
) -> tuple[float, float, float]:
    """Ways (m) of three contacts with which all just clear (Cramer's rule); one may be negative."""
    ab = overlap(m, d, geom, deepest, a, b)
    ac = overlap(m, d, geom, deepest, a, c)
    bc = overlap(m, d, geom, deepest, b, c)
    da, db, dc = depth_of(d, a), depth_of(d, b), depth_of(d, c)
    det = 1.0 + 2.0 * ab * ac * bc - ab * ab - ac * ac - bc * bc
    if det <= ENOUGH * ENOUGH:  # they overlap too much to tell
        return -1.0, -1.0, -1.0
    way_a = da * (1.0 - bc * bc) + db * (ac * bc - ab) + dc * (ab * bc - ac)
    way_b = da * (ac * bc - ab) + db * (1.0 - ac * ac) + dc * (ab * ac - bc)
    way_c = da * (ab * bc - ac) + db * (ab * ac - bc) + dc * (1.0 - ab * ab)
    return way_a / det, way_b / det, way_c / det


@register_jitable
def least_cleared(
    m: ModelView,
    d: DataView,
    geom: int,
    deepest: int,
    a: int,
    way_a: float,
    b: int,
    way_b: float,
    c: int,
    way_c: float,
) -> tuple[int, float]:
    """The contact that the ways along a, b and c (-1: none) leave deepest, or -1, and how deep."""
    worst, left = -1, 0.0
    for i in range(d.contact_dist.shape[0]):
        if side_of(d, i, geom) == 0.0 or i in (a, b, c):
            continue
        still = depth_of(d, i) - way_a * overlap(m, d, geom, deepest, i, a)
        if b >= 0:
            still -= way_b * overlap(m, d, geom, deepest, i, b)
        if c >= 0:
            still -= way_c * overlap(m, d, geom, deepest, i, c)
        if still > left:
            worst, left = i, still
    return worst, left


@register_jitable
def sharers(
    m: ModelView, d: DataView, geom: int, deepest: int
) -> tuple[int, float, int, float, int, float]:
    """The contacts that share the load, at most three, and their ways (m).

    The deepest alone first; while a contact is left deeper than it may be, it joins, and
    those that then would pull are left out.

    Returns:
      a, way_a, b, way_b, c, way_c; an index is -1 and its way 0 where there are fewer.
    """
    a, b, c = deepest, -1, -1
    way_a, way_b, way_c = depth_of(d, a), 0.0, 0.0
    enough = ENOUGH * way_a
    for _ in range(MOST_TURNS):
        new, left = least_cleared(m, d, geom, deepest, a, way_a, b, way_b, c, way_c)
        if new < 0 or left <= enough:
            break
        if b < 0:
            b = new
            way_a, way_b = ways_of_two(m, d, geom, deepest, a, b)
        else:
            if c >= 0 and way_c > way_b:
                b = c
            c = new
            way_a, way_b, way_c = ways_of_three(m, d, geom, deepest, a, b, c)
        if way_a <= 0.0 or way_b <= 0.0 or (c >= 0 and way_c <= 0.0):
            a, way_a, b, way_b = best_pair(m, d, geom, deepest, a, b, c)
            c, way_c = -1, 0.0
    return a, way_a, b, way_b, c, way_c


@register_jitable
def best_pair(
    m: ModelView, d: DataView, geom: int, deepest: int, a: int, b: int, c: int
) -> tuple[int, float, int, float]:
    """Of three contacts (c may be -1) the two, or the one, that clear the three with a push each.

    Returns:
      a, way_a, b, way_b; b is -1 and its way 0 where one is enough.
    """
    best_a, best_b, best_left = -1, -1, math.inf
    for i, j in ((a, -1), (b, -1), (c, -1), (a, b), (a, c), (b, c)):
        if i < 0:
            continue
        way_i, way_j = depth_of(d, i), 0.0
        if j >= 0:
            way_i, way_j = ways_of_two(m, d, geom, deepest, i, j)
        if way_i <= 0.0 or way_j < 0.0:
            continue
        left = 0.0
        for k in (a, b, c):
            if k >= 0 and k != i and k != j:
                still = depth_of(d, k) - way_i * overlap(m, d, geom, deepest, k, i)
                if j >= 0:
                    still -= way_j * overlap(m, d, geom, deepest, k, j)
                left = max(left, still)
        if left < best_left:
            best_a, best_b, best_left = i, j, left
    if best_b < 0:
        return best_a, depth_of(d, best_a), -1, 0.0
    way_a, way_b = ways_of_two(m, d, geom, deepest, best_a, best_b)
    return best_a, way_a, best_b, way_b


@register_jitable
def give_share(d: DataView, c: int, way: float) -> None:
    """Let contact c push with the share of its stiffness that its way asks for."""
    row = d.contact_efc_address[c]
    d.efc_D[row] = min(way / depth_of(d, c), 1.0) / d.efc_R[row]
    if d.nisland > 0:
        d.iefc_D[d.map_efc2iefc[row]] = d.efc_D[row]


@register_jitable
def share_load(m: ModelView, d: DataView, geom: int) -> Patch:
    """Share the stiffness between the contacts of the geom, before the solve; their patch then."""
    deepest = -1
    for c in range(d.contact_dist.shape[0]):
        if side_of(d, c, geom) != 0.0 and (deepest < 0 or depth_of(d, c) > depth_of(d, deepest)):
            deepest = c
    a, way_a, b, way_b, c, way_c = sharers(m, d, geom, deepest)
    for i in range(d.contact_dist.shape[0]):
        if side_of(d, i, geom) != 0.0:
            give_share(d, i, 0.0)
    give_share(d, a, way_a)
    if b >= 0:
        give_share(d, b, way_b)
    if c >= 0:
        give_share(d, c, way_c)
    return contact_patch(d, geom)
