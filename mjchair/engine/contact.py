"""The contacts of one wheel as one contact: its place, its normal, and its load.

In: the views of a model and its data, and a tire geom. Out: the patch that stands for all of its
contacts, and a share of stiffness for each of them, in `efc_D`.

MuJoCo makes one contact with a plane, a box or a mesh, and engine/field.py makes one with a height
field. A floor may consist of several geoms, as tiles do, or a kerb on a plane. Each contact is a
spring, so two contacts with one flat floor would be twice as stiff as one, and a contact with the
edge of a neighbouring tile pushes in a slanted direction. Therefore the springs of overlapping
contacts share the depth. Contact i has the depth d_i (m) and its spring the compression c_i (m).
The compressions solve a linear complementarity problem:

    c_i >= 0,   sum over j of overlap_ij c_j >= d_i,   one of the two with equality.

overlap_ij is the part of the dent of contact i that the dent of contact j makes: 1 at the same
place; it falls with the square of the distance as the ellipsoid rises, to 0 where the dents end.
Tiles in one plane count once, as the deepest contact alone; a floor and a kerb that are a dent's
length apart are two springs. Between the two cases the compressions change continuously: a contact
that begins or ends has a compression of 0. For a given overlap the force has the potential
stiffness * (c . d - c . overlap c / 2), so that rolling over an edge neither adds nor removes
energy. The stiffness of contact i is multiplied by its share, c_i / d_i.

The shares are written as factors of `efc_D`, the mass of the constraint. `efc_R` stays as MuJoCo
made it, so doing this twice gives the same result as once. Solvers of the primal problem (Newton,
CG) read `efc_D`; PGS does not, and `mj_inverse` computes its own.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from numba.extending import register_jitable

from mjchair.engine.views import Array, DataView, ModelView

DEPTH_TOLERANCE = 1e-6  # of the depth: below it, what the others leave of a depth counts as 0
OVERLAP_WIDTH = (
    1.5  # times the greatest depth: dents of that depth overlap; on a flat floor 1 is enough
)
MAX_ITERATIONS = 20  # of the search for the contacts that bear load; it takes one or two


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
def normal_sign(d: DataView, c: int, geom: int) -> float:
    """1: the normal of contact c points towards the geom; -1: away from it; 0: it has no part in c.

    Contacts without force (outside their margin, or left out by the engine) give 0 as well.
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
    """The contacts of the geom as one: place and normal are means, weighted by compression."""
    count, weight, deepest, ground = 0, 0.0, 0.0, -1
    nx = ny = nz = px = py = pz = 0.0
    for c in range(d.contact_dist.shape[0]):
        side = normal_sign(d, c, geom)
        if side == 0.0:
            continue
        row = d.contact_efc_address[c]
        share = d.efc_D[row] * d.efc_R[row]
        compression = share * (d.contact_includemargin[c] - d.contact_dist[c])
        count += 1
        weight += compression
        nx += compression * side * d.contact_frame[c, 0]
        ny += compression * side * d.contact_frame[c, 1]
        nz += compression * side * d.contact_frame[c, 2]
        px += compression * d.contact_pos[c, 0]
        py += compression * d.contact_pos[c, 1]
        pz += compression * d.contact_pos[c, 2]
        if compression > deepest:
            deepest = compression
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
    """The part, 0 to 1, of the dent of contact a that the dent of contact b makes.

    An ellipsoid (R, R, b) that is pressed in by D dents a floor over x^2 / R^2 + y^2 / b^2 =
    2 D / R, y along its axis.
    """
    p, mat, size = d.contact_pos, d.geom_xmat, m.geom_size
    sx, sy, sz = p[a, 0] - p[b, 0], p[a, 1] - p[b, 1], p[a, 2] - p[b, 2]
    y = sx * mat[geom, 2] + sy * mat[geom, 5] + sz * mat[geom, 8]
    x2 = max(sx * sx + sy * sy + sz * sz - y * y, 0.0)
    radius, half = size[geom, 0], size[geom, 2]
    q = radius * (x2 / (radius * radius) + y * y / (half * half)) / (2.0 * OVERLAP_WIDTH)
    return max(1.0 - q / depth_of(d, deepest), 0.0)


@register_jitable
def compressions_of_two(
    m: ModelView, d: DataView, geom: int, deepest: int, a: int, b: int
) -> tuple[float, float]:
    """Compressions (m) of two contacts, both with equality; one may be negative."""
    c = overlap(m, d, geom, deepest, a, b)
    det = 1.0 - c * c
    da, db = depth_of(d, a), depth_of(d, b)
    if det <= DEPTH_TOLERANCE * DEPTH_TOLERANCE:  # nearly one contact: the system is singular
        return -1.0, -1.0
    return (da - c * db) / det, (db - c * da) / det


@register_jitable
def compressions_of_three(
    m: ModelView, d: DataView, geom: int, deepest: int, a: int, b: int, c: int
) -> tuple[float, float, float]:
    """Compressions (m) of three contacts, all with equality (Cramer's rule); may be negative."""
    ab = overlap(m, d, geom, deepest, a, b)
    ac = overlap(m, d, geom, deepest, a, c)
    bc = overlap(m, d, geom, deepest, b, c)
    da, db, dc = depth_of(d, a), depth_of(d, b), depth_of(d, c)
    det = 1.0 + 2.0 * ab * ac * bc - ab * ab - ac * ac - bc * bc
    if det <= DEPTH_TOLERANCE * DEPTH_TOLERANCE:  # nearly one contact: the system is singular
        return -1.0, -1.0, -1.0
    compression_a = da * (1.0 - bc * bc) + db * (ac * bc - ab) + dc * (ab * bc - ac)
    compression_b = da * (ac * bc - ab) + db * (1.0 - ac * ac) + dc * (ab * ac - bc)
    compression_c = da * (ab * bc - ac) + db * (ab * ac - bc) + dc * (1.0 - ab * ab)
    return compression_a / det, compression_b / det, compression_c / det


@register_jitable
def deepest_remaining(
    m: ModelView,
    d: DataView,
    geom: int,
    deepest: int,
    a: int,
    compression_a: float,
    b: int,
    compression_b: float,
    c: int,
    compression_c: float,
) -> tuple[int, float]:
    """The contact with most depth left after the compressions of a, b and c (-1: none).

    Returns:
      Its index, -1 where none is left, and its remaining depth (m).
    """
    deepest_left, left = -1, 0.0
    for i in range(d.contact_dist.shape[0]):
        if normal_sign(d, i, geom) == 0.0 or i in (a, b, c):
            continue
        remaining = depth_of(d, i) - compression_a * overlap(m, d, geom, deepest, i, a)
        if b >= 0:
            remaining -= compression_b * overlap(m, d, geom, deepest, i, b)
        if c >= 0:
            remaining -= compression_c * overlap(m, d, geom, deepest, i, c)
        if remaining > left:
            deepest_left, left = i, remaining
    return deepest_left, left


@register_jitable
def load_bearing_contacts(
    m: ModelView, d: DataView, geom: int, deepest: int
) -> tuple[int, float, int, float, int, float]:
    """The contacts that bear the load, at most three, and their compressions (m).

    An active-set search: the deepest contact comes first. A contact that is left with depth joins;
    contacts that would then have a negative compression are removed.

    Returns:
      a, compression_a, b, compression_b, c, compression_c; an index is -1 and its
      compression 0 where there are fewer.
    """
    a, b, c = deepest, -1, -1
    compression_a, compression_b, compression_c = depth_of(d, a), 0.0, 0.0
    enough = DEPTH_TOLERANCE * compression_a
    for _ in range(MAX_ITERATIONS):
        new, left = deepest_remaining(
            m, d, geom, deepest, a, compression_a, b, compression_b, c, compression_c
        )
        if new < 0 or left <= enough:
            break
        if b < 0:
            b = new
            compression_a, compression_b = compressions_of_two(m, d, geom, deepest, a, b)
        else:
            if c >= 0 and compression_c > compression_b:
                b = c
            c = new
            compression_a, compression_b, compression_c = compressions_of_three(
                m, d, geom, deepest, a, b, c
            )
        if compression_a <= 0.0 or compression_b <= 0.0 or (c >= 0 and compression_c <= 0.0):
            a, compression_a, b, compression_b = best_one_or_two(m, d, geom, deepest, a, b, c)
            c, compression_c = -1, 0.0
    return a, compression_a, b, compression_b, c, compression_c


@register_jitable
def best_one_or_two(
    m: ModelView, d: DataView, geom: int, deepest: int, a: int, b: int, c: int
) -> tuple[int, float, int, float]:
    """Of three contacts (c may be -1) the one or two that leave least depth to the others.

    Only those with positive compressions are compared.

    Returns:
      a, compression_a, b, compression_b; b is -1 and its compression 0 where one is enough.
    """
    best_a, best_b, best_left = -1, -1, math.inf
    for i, j in ((a, -1), (b, -1), (c, -1), (a, b), (a, c), (b, c)):
        if i < 0:
            continue
        compression_i, compression_j = depth_of(d, i), 0.0
        if j >= 0:
            compression_i, compression_j = compressions_of_two(m, d, geom, deepest, i, j)
        if compression_i <= 0.0 or compression_j < 0.0:
            continue
        left = 0.0
        for k in (a, b, c):
            if k >= 0 and k != i and k != j:
                remaining = depth_of(d, k) - compression_i * overlap(m, d, geom, deepest, k, i)
                if j >= 0:
                    remaining -= compression_j * overlap(m, d, geom, deepest, k, j)
                left = max(left, remaining)
        if left < best_left:
            best_a, best_b, best_left = i, j, left
    if best_b < 0:
        return best_a, depth_of(d, best_a), -1, 0.0
    compression_a, compression_b = compressions_of_two(m, d, geom, deepest, best_a, best_b)
    return best_a, compression_a, best_b, compression_b


@register_jitable
def set_stiffness_share(d: DataView, c: int, compression: float) -> None:
    """Multiply the stiffness of contact c by its share: its compression over its depth."""
    row = d.contact_efc_address[c]
    d.efc_D[row] = min(compression / depth_of(d, c), 1.0) / d.efc_R[row]
    if d.nisland > 0:
        d.iefc_D[d.map_efc2iefc[row]] = d.efc_D[row]


@register_jitable
def share_stiffness(m: ModelView, d: DataView, geom: int) -> Patch:
    """Share the stiffness between the contacts of the geom, before the solve; gives their patch."""
    deepest = -1
    for c in range(d.contact_dist.shape[0]):
        if normal_sign(d, c, geom) != 0.0 and (
            deepest < 0 or depth_of(d, c) > depth_of(d, deepest)
        ):
            deepest = c
    a, compression_a, b, compression_b, c, compression_c = load_bearing_contacts(
        m, d, geom, deepest
    )
    for i in range(d.contact_dist.shape[0]):
        if normal_sign(d, i, geom) != 0.0:
            set_stiffness_share(d, i, 0.0)
    set_stiffness_share(d, a, compression_a)
    if b >= 0:
        set_stiffness_share(d, b, compression_b)
    if c >= 0:
        set_stiffness_share(d, c, compression_c)
    return contact_patch(d, geom)
