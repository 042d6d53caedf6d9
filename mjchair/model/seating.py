"""Edits of the seat and of its occupant: heights, angles, masses, fore-aft position.

In: an MjSpec of a chair whose geoms have the names and the masses of the shipped chairs', and
numbers in SI. Out: the specification, changed in place. Body `chair` has an explicit inertial, so
every edit of the position or mass of a part also changes this inertial.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.errors import MjchairError
from mjchair.model import inertials, parts
from mjchair.model.wheels import base_name

Array = NDArray[np.float64]
Move = Callable[[Array], Array]

# The occupant of the shipped chairs: mass in kg, and the geoms that are its segments with their
# shares of it (de Leva 1996, J Biomech 29, 1223-1230, male; the chairs' READMEs).
OCCUPANT_MASS = 75.0
OCCUPANT = {
    "head": 0.0694,
    "chest": 0.1596,
    "abdomen": 0.1633,
    "pelvis": 0.1117,
    **{
        f"{side}_{part}": share
        for side in ("left", "right")
        for part, share in {
            "upper_arm": 0.0271,
            "forearm": 0.0162,
            "hand": 0.0061,
            "thigh": 0.1416,
            "shank": 0.0433,
            "foot": 0.0137,
        }.items()
    },
}
PERSON = (*OCCUPANT, "shoulders", "neck", "hair", "nose")  # with its display geoms
LEGS = tuple(name for name in OCCUPANT if name.endswith(("thigh", "shank", "foot")))
TRUNK = tuple(name for name in PERSON if name not in LEGS and name != "pelvis")
SEAT = ("seat", "cushion")  # boxes, the upper one last
BACK = ("back_rest", "back_bar", *(f"{s}_{p}" for s in ("left", "right")
                                   for p in ("back_cane", "handle")))  # fmt: skip
RODS = (mujoco.mjtGeom.mjGEOM_CAPSULE, mujoco.mjtGeom.mjGEOM_CYLINDER)
REMEMBERED = "occupant_mass"  # custom numeric of a saved chair, kg
BELOW_SEAT = 0.03  # m below the middle of the seat: parts above this height move with the seat


def geoms(spec: mujoco.MjSpec) -> list[Any]:
    """The geoms of body `chair`.

    Raises:
      MjchairError: no such body.
    """
    return list(parts.named(spec.bodies, "chair", "body").geoms)


def remember_masses(spec: mujoco.MjSpec) -> None:
    """Restore the masses of the occupant's geoms where a saved file does not have them."""
    person = [g for g in geoms(spec) if base_name(g.name) in OCCUPANT]
    if not person or any(g.mass > 0.0 for g in person):
        return
    stored = next((n for n in spec.numerics if n.name == REMEMBERED), None)
    mass = OCCUPANT_MASS if stored is None else float(stored.data[0])
    for geom in person:
        geom.mass = OCCUPANT[base_name(geom.name)] * mass


@contextmanager
def _weighed(spec: mujoco.MjSpec) -> Iterator[None]:
    """Apply the changes of the chair's parts inside the block also to its inertial."""
    chair = parts.named(spec.bodies, "chair", "body")
    before = inertials.of_geoms(chair.geoms)
    yield
    if chair.explicitinertial:
        # add the new parts before the old ones are subtracted: they may be the whole body
        more = inertials.of_body(chair).plus(inertials.of_geoms(chair.geoms))
        inertials.write(chair, more.plus(before, sign=-1.0))


def occupant(spec: mujoco.MjSpec) -> list[Any]:
    """The geoms that are the occupant's segments.

    Raises:
      MjchairError: one of them is missing, so the occupant is not known.
    """
    known = {base_name(g.name): g for g in geoms(spec)}
    for name in OCCUPANT:
        if name not in known:
            raise MjchairError(f"the model has no geom {name!r}; its occupant cannot be changed")
    return [known[name] for name in OCCUPANT]


def set_occupant_mass(spec: mujoco.MjSpec, mass: float) -> None:
    """Give the occupant another mass (kg), its shape kept."""
    person = occupant(spec)
    with _weighed(spec):
        factor = mass / sum(g.mass for g in person)
        for geom in person:
            geom.mass *= factor
    stored = next((n for n in spec.numerics if n.name == REMEMBERED), None)
    if stored is None:
        stored = spec.add_numeric(name=REMEMBERED, size=1)
    stored.data = [mass]


def set_chair_mass(spec: mujoco.MjSpec, mass: float) -> None:
    """Give the chair without its occupant another mass (kg); wheels and casters keep theirs."""
    person = sum(g.mass for g in occupant(spec))
    chair = inertials.explicit(spec, "chair")
    below = [b for b in chair.find_all("body") if b.name != chair.name]
    rolling = sum(float(inertials.explicit(spec, b.name).mass) for b in below)
    if mass <= rolling:
        raise MjchairError(
            f"chair_mass is {mass:g} kg; its wheels and casters alone weigh {rolling:g} kg"
        )
    sitting = inertials.of_geoms(occupant(spec))
    frame = inertials.of_body(chair).plus(sitting, sign=-1.0)
    factor = (mass - rolling) / (float(chair.mass) - person)
    inertials.write(chair, frame.scaled(factor).plus(sitting))
    for geom in geoms(spec):
        if base_name(geom.name) not in OCCUPANT:
            geom.mass *= factor


def move_occupant(spec: mujoco.MjSpec, forward: float) -> None:
    """Move the occupant forward by `forward` (m)."""
    occupant(spec)
    _move(spec, PERSON, lambda p: np.add(p, (forward, 0.0, 0.0)))


def set_seat_height(spec: mujoco.MjSpec, height: float) -> None:
    """Bring the front edge of the seat's surface to `height` (m) above the ground.

    The seat and everything above it move with it; feet, footrest and the supports of the wheels
    stay.
    """
    _check_masses(spec, "seat_height")
    rise = height - seat_edge(spec)[2]
    low = _box(spec, SEAT[0]).pos[2] - BELOW_SEAT
    names = [base_name(g.name) for g in geoms(spec)]
    _move(spec, names, lambda p: np.add(p, (0.0, 0.0, rise if p[2] > low else 0.0)))


def set_seat_angle(spec: mujoco.MjSpec, angle: float) -> None:
    """Incline the seat to `angle` (rad from the horizontal, front up), about its front edge.

    Parts on the seat move with the point of the seat below them; the angle of the back stays.
    """
    _check_masses(spec, "seat_angle")
    edge, low = seat_edge(spec), _box(spec, SEAT[0]).pos[2] - BELOW_SEAT
    present, length = seat_angle(spec), 2.0 * float(_box(spec, SEAT[0]).size[0])

    def move(point: Array) -> Array:
        back = float(np.clip(edge[0] - point[0], 0.0, length * math.cos(present)))
        along = back / math.cos(present)
        if point[2] <= low or back == 0.0:
            return point
        shift = (back - along * math.cos(angle), 0.0, along * (math.sin(present) - math.sin(angle)))
        return np.asarray(point + shift)

    names = [base_name(g.name) for g in geoms(spec)]
    _move(spec, names, move, turned=dict.fromkeys(SEAT, present - angle))


def set_back_angle(spec: mujoco.MjSpec, angle: float) -> None:
    """Recline back and trunk to `angle` (rad from the vertical), about the hips."""
    _check_masses(spec, "back_angle")
    hips = np.array(parts.named(geoms(spec), "pelvis", "geom").pos, float)
    turn = -(angle - back_angle(spec))  # about y, which points left: a positive turn tips forward
    cos, sin = math.cos(turn), math.sin(turn)

    def move(point: Array) -> Array:
        x, z = point[0] - hips[0], point[2] - hips[2]
        if z < -0.15:  # the lower ends of the canes stand on the frame
            return point
        return np.array([hips[0] + cos * x + sin * z, point[1], hips[2] - sin * x + cos * z])

    _move(spec, (*TRUNK, *BACK), move, turned=dict.fromkeys((*TRUNK, *BACK), turn))


def move_stems(spec: mujoco.MjSpec, forward: float) -> None:
    """Move the stems of the casters, and the ends of the tubes that hold them, forward (m)."""
    stems = [parts.named(spec.bodies, f"{c}_swivel", "body") for c in parts.CASTERS]
    places = [np.array(stem.pos, float) for stem in stems]

    def move(point: Array) -> Array:
        held = any(np.linalg.norm(point[:2] - at[:2]) < 0.06 for at in places)
        return np.add(point, (forward, 0.0, 0.0)) if held else point

    for stem, at in zip(stems, places, strict=True):
        stem.pos = np.add(at, (forward, 0.0, 0.0))
    top = max(at[2] for at in places) + 0.12
    low = [g for g in geoms(spec) if g.type in RODS and g.pos[2] < top + 0.1]
    _move(spec, [base_name(g.name) for g in low], lambda p: move(p) if p[2] < top else p)


def remove_anti_tippers(spec: mujoco.MjSpec) -> None:
    """Remove the anti-tippers; their mass is added to the frame."""
    for geom in anti_tippers(spec):
        spec.delete(geom)


def anti_tippers(spec: mujoco.MjSpec) -> list[Any]:
    """The geoms of the anti-tippers and of their bars.

    Raises:
      MjchairError: the model has none.
    """
    ends = ("_anti_tip", "_anti_tip_bar")
    there = [g for g in geoms(spec) if base_name(g.name).endswith(ends)]
    if not there:
        raise MjchairError(
            "the model has no anti-tippers (geoms left_anti_tip and right_anti_tip); leave "
            "anti_tippers out"
        )
    return there


def seat_edge(spec: mujoco.MjSpec) -> Array:
    """The front edge of the seat's surface, (3,) m in the chair's frame."""
    names = {base_name(g.name) for g in geoms(spec)}
    box = _box(spec, next(name for name in reversed(SEAT) if name in names or name == SEAT[0]))
    return np.asarray(box.pos + _rotation(box) @ (box.size[0], 0.0, box.size[2]))


def seat_angle(spec: mujoco.MjSpec) -> float:
    """Of the seat from the horizontal, rad, positive with its front up."""
    forward = _rotation(_box(spec, SEAT[0]))[:, 0]
    return math.atan2(forward[2], forward[0])


def back_angle(spec: mujoco.MjSpec) -> float:
    """Of the back rest from the vertical, rad, positive reclined."""
    up = _rotation(_box(spec, BACK[0]))[:, 2]
    return math.atan2(-up[0], up[2])


def _box(spec: mujoco.MjSpec, name: str) -> Any:
    """A box of body `chair`."""
    geom = parts.named(geoms(spec), name, "geom")
    if geom.type != mujoco.mjtGeom.mjGEOM_BOX:
        raise MjchairError(f"geom {name!r} is no box, so its height and angle are not known")
    return geom


def _rotation(geom: Any) -> Array:
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, np.asarray(geom.quat, float))
    return matrix.reshape(3, 3)


def _check_masses(spec: mujoco.MjSpec, name: str) -> None:
    """Raise MjchairError where the seat has no mass, so the effect of moving it is unknown."""
    seat = _box(spec, SEAT[0])
    chair = parts.named(spec.bodies, "chair", "body")
    if chair.explicitinertial and not seat.mass > 0.0:
        raise MjchairError(
            f"{name}: geom 'seat' has no mass, so the effect of its motion on the inertia of the "
            "chair is not known; change the chair before it is saved, or give its geoms masses"
        )


def _move(
    spec: mujoco.MjSpec,
    names: tuple[str, ...] | list[str],
    move: Move,
    turned: dict[str, float] | None = None,
) -> None:
    """Move the geoms of the chair that have one of the names; names without a geom are ignored.

    Args:
      move: point (3,) m -> its new position. The two ends of a rod are moved separately, so it
        turns and stretches; of any other geom the middle is moved.
      turned: name -> angle (rad) about y by which a geom that is not a rod turns.
    """
    with _weighed(spec):
        for geom in geoms(spec):
            name = base_name(geom.name)
            if name not in names:
                continue
            if geom.type in RODS:
                _move_rod(geom, move)
                continue
            geom.pos = move(np.array(geom.pos, float))
            angle = (turned or {}).get(name, 0.0)
            if angle:
                out = np.zeros(4)
                by = np.array([math.cos(0.5 * angle), 0.0, math.sin(0.5 * angle), 0.0])
                mujoco.mju_mulQuat(out, by, np.asarray(geom.quat, float))
                geom.quat = out


def _move_rod(geom: Any, move: Move) -> None:
    """Move the ends of a capsule or cylinder; its radius stays."""
    axis = _rotation(geom)[:, 2]
    middle, half = np.array(geom.pos, float), float(geom.size[1])
    ends = [move(middle + sign * half * axis) for sign in (-1.0, 1.0)]
    if all(np.array_equal(e, middle + s * half * axis) for e, s in zip(ends, (-1, 1), strict=True)):
        return
    span = ends[1] - ends[0]
    length = float(np.linalg.norm(span))
    quat = np.zeros(4)
    mujoco.mju_quatZ2Vec(quat, span / length)
    geom.pos, geom.quat = 0.5 * (ends[0] + ends[1]), quat
    geom.size = (geom.size[0], 0.5 * length, geom.size[2])
