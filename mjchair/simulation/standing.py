"""Whether a chair stands on its wheels: the rule, and its use on a simulated run.

In: the angle between the chair's z and the floor's normal, and the loads on the wheels. Out: how
and when the chair stopped standing, or None. The rule:

- A chair that leans more than `TIPPED` from the floor's normal has tipped over. The normal is that
  of the plane geom `floor`, or the vertical where there is no such plane.
- A chair has tipped over when both rear wheels, or both wheels of one side, bear no load during
  at least the last `UNLOADED` seconds of a run, without interruption: it lies on its footrest or on
  its side. With rear casters behind the driven wheels, the driven wheels and the rear casters count
  together, since such a chair may stand on its casters alone. Casters in the air do not count as
  tipping, since a chair may stand on its anti-tippers or in a wheelie.
- A chair has left the ground when no wheel bears load for `UNLOADED` seconds. A chair that hops
  over a kerb is in the air for less than 0.1 s; in 0.5 s it falls 1.2 m.

A wheel that bears less than `LEAST` of the weight counts as one without load.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Iterable, Mapping
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.model.wheels import REAR_CASTERS, SUFFIX, WHEELS, base_name, wheels
from mjchair.simulation import names
from mjchair.simulation.channels import tire_place

Array = NDArray[np.float64]

TIPPED = math.radians(45.0)  # rad; its handles or its side touch the floor by then
UNLOADED = 0.5  # s
LEAST = 1e-6  # of the weight


class Fall(enum.Enum):
    """How a chair stops standing on its wheels."""

    TIPPED = "tipped over"
    OFF_GROUND = "left the ground"


class Fallen(NamedTuple):
    """How and when a chair stopped standing. time: s, when it began. reason: in words."""

    kind: Fall
    time: float
    reason: str


def chair_joints(model: mujoco.MjModel) -> list[int]:
    """The free joints of bodies that stand on tires: one a chair."""
    roots = {int(model.body_rootid[wheel.body]) for wheel in wheels(model)}
    joints = [int(model.body_jntadr[root]) for root in sorted(roots)]
    free = int(mujoco.mjtJoint.mjJNT_FREE)
    return [joint for joint in joints if joint >= 0 and model.jnt_type[joint] == free]


def floor_normal(model: mujoco.MjModel) -> Array:
    """Upward normal (3,) of the plane geom `floor` at the start; the vertical where there is none.

    A plane that hangs on a moving body counts as it lies at the model's initial pose.
    """
    for i, name in enumerate(names.geoms(model)):
        if names.same(name, "floor") and model.geom_type[i] == mujoco.mjtGeom.mjGEOM_PLANE:
            data = mujoco.MjData(model)
            mujoco.mj_kinematics(model, data)
            return np.asarray(data.geom_xmat[i].reshape(3, 3)[:, 2]).copy()
    gravity = np.asarray(model.opt.gravity)
    size = float(np.linalg.norm(gravity))
    return -gravity / size if size > 0.0 else np.array([0.0, 0.0, 1.0])


def lean(model: mujoco.MjModel, joint: int, qpos: Array, normal: Array) -> Array:
    """Angle (n,), rad, between a chair's z and the normal, at positions (n, nq)."""
    return np.arccos(np.clip(upward(model, joint, qpos) @ normal, -1.0, 1.0))


def upward(model: mujoco.MjModel, joint: int, qpos: Array) -> Array:
    """A chair's z (n, 3) in the world, at positions (n, nq)."""
    at = int(model.jnt_qposadr[joint]) + 3
    w, x, y, z = (qpos[:, at + i] for i in range(4))
    up = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), w * w - x * x - y * y + z * z], axis=1)
    size = np.maximum(w * w + x * x + y * y + z * z, 1e-12)
    return np.asarray(up / size[:, None])


def groups(wheel_names: Iterable[str]) -> dict[str, list[str]]:
    """Groups of wheels that must not be without load: words for the group -> names of its wheels.

    Only for a chair whose wheels have the names of mjchair.model.wheels.WHEELS.
    """
    known = {base_name(name): name for name in wheel_names}
    if not set(WHEELS) <= set(known):
        return {}
    behind = [caster for caster in REAR_CASTERS if caster in known]
    many = len(behind) == len(REAR_CASTERS)
    listed = {
        f"{'all' if many else 'both'} wheels of its {side} side": [
            wheel for wheel in (*WHEELS, *behind) if wheel.startswith(side)
        ]
        for side in ("left", "right")
    }
    rear = "the driven wheels and the rear casters" if many else "both rear wheels"
    listed[rear] = ["left_wheel", "right_wheel", *behind]
    return {words: [known[name] for name in group] for words, group in listed.items()}


def first_fall(
    time: Array, leans: Array, loads: Mapping[str, Array], weight: float
) -> Fallen | None:
    """How and when a chair stopped standing on its wheels during a run, if it did.

    Args:
      time: (n,), s. leans: (n,), rad, from the floor's normal. loads: wheel -> (n,), N.
      weight: of the chair, N.
    """
    falls = []
    over = np.flatnonzero(leans > TIPPED)
    if over.size:
        k = int(over[0])
        words = f"it leans {math.degrees(leans[k]):.0f} deg from the floor's normal"
        falls.append(Fallen(Fall.TIPPED, float(time[k]), words))
    empty = {wheel: ~(load > LEAST * weight) for wheel, load in loads.items()}
    in_air = "bore no load from then on"
    if empty:
        began = _lasting(time, np.logical_and.reduce(list(empty.values())))
        if began is not None:
            falls.append(Fallen(Fall.OFF_GROUND, began, f"no wheel bore load for {UNLOADED:g} s"))
    for words, group in groups(loads).items():
        together = np.logical_and.reduce([empty[wheel] for wheel in group])
        began = _lasting(time, together, to_the_end=True)
        if began is not None:
            falls.append(Fallen(Fall.TIPPED, began, f"{words} {in_air}"))
    # in the air every group of wheels is without load: leaving the ground takes precedence
    return min(falls, key=lambda f: (f.time, f.kind is Fall.TIPPED), default=None)


def _lasting(time: Array, true: NDArray[np.bool_], to_the_end: bool = False) -> float | None:
    """Start of the first interval of at least `UNLOADED` seconds in which `true` holds, s, or None.

    Args:
      to_the_end: count only an interval that lasts until the end.
    """
    edges = np.diff(np.concatenate([[False], true, [False]]).astype(np.int8))
    for first, end in zip(np.flatnonzero(edges == 1), np.flatnonzero(edges == -1), strict=True):
        long = time[end - 1] - time[first] >= UNLOADED
        if long and (end == time.size or not to_the_end):
            return float(time[first])
    return None


def fall_of_run(model: mujoco.MjModel, time: Array, qpos: Array, sensed: Array) -> Fallen | None:
    """How and when the first of the model's chairs stopped standing in a run.

    Args:
      time: (n,), s. qpos: (n, nq). sensed: (n, nsensordata).
    """
    normal = floor_normal(model)
    weights = float(np.linalg.norm(model.opt.gravity)) * model.body_subtreemass
    falls = []
    for joint in chair_joints(model):
        body = int(model.jnt_bodyid[joint])
        loads = {wheel: sensed[:, at] for wheel, at in load_places(model, body).items()}
        fallen = first_fall(time, lean(model, joint, qpos, normal), loads, weights[body])
        if fallen is not None:
            falls.append(fallen)
    return min(falls, key=lambda f: f.time, default=None)


def load_places(model: mujoco.MjModel, chair: int) -> dict[str, int]:
    """Wheel of the chair whose body is `chair` -> index of its load in the sensor data.

    A wheel without a tire sensor is left out.
    """
    sensors = names.sensors(model)
    return {
        wheel.name: tire_place(model, wheel.name, "Fz")
        for wheel in wheels(model)
        if model.body_rootid[wheel.body] == chair and wheel.name + SUFFIX in sensors
    }


def leaning_on(model: mujoco.MjModel, data: mujoco.MjData) -> str:
    """In words, what a settled chair leans on beside its wheels, and which carry nothing; "": none.

    Args:
      data: after the last step of settling, with that step's contacts and forces.
    """
    joints = chair_joints(model)
    roots = {int(model.jnt_bodyid[joint]) for joint in joints}
    weight = float(model.body_subtreemass[0] * np.linalg.norm(model.opt.gravity))
    known, touching, force = names.geoms(model), set(), np.zeros(6)
    for i, contact in enumerate(data.contact):
        mujoco.mj_contactForce(model, data, i, force)
        of_chair = [g for g in contact.geom if model.body_rootid[model.geom_bodyid[g]] in roots]
        if force[0] > LEAST * weight and len(of_chair) == 1:
            touching |= {known[g] for g in of_chair if not known[g].endswith("_tire")}
    if not touching:
        return ""
    loads = {w.name: data.act[model.actuator_actadr[w.actuator] + 3] for w in wheels(model)}
    empty = [name for name, load in loads.items() if load <= LEAST * weight]
    carry = f"; {' and '.join(empty)} {'carry' if len(empty) > 1 else 'carries'} 0 N"
    return f"the chair starts leaning on {' and '.join(sorted(touching))}{carry if empty else ''}"
