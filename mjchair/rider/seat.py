"""The edit of a chair's specification that lets its occupant move.

Goes in: the specification of a chair that shows an occupant as the shipped ones do, that chair
compiled, and a `Rider`. Comes out: the same specification with a body, joints, position inputs
and sensors for each segment of `anatomy.SEGMENTS`; the body `chair` keeps what is left.

With every joint at zero the whole has the mass, the centre of mass and the inertia of the chair
that was given: each segment has those of de Leva's table, and the chair's body takes the
difference, which includes the person's pelvis and legs.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import mujoco
import numpy as np

from mjchair.errors import MjchairError
from mjchair.rider import anatomy, bias_sensor, driven_joint
from mjchair.rider.anatomy import JOINTS, LANDMARKS, SEGMENTS, SIDES, STATURE, joints_of
from mjchair.rider.driven_joint import Following
from mjchair.rider.rider import (
    SHOULDER_WIDTH,
    Array,
    Inertial,
    Rider,
    segment_inertial,
    together,
)

CHAIR = "chair"
# Change of a joint's speed in one time step h: by STIFFNESS of gap / h, by DAMPING of the speed. A
# steady motion is then DAMPING / STIFFNESS = 0.6 steps late. A joint is stable for STIFFNESS <
# 4 - 2 DAMPING, which is up to 1.3 times the time step that it was built for.
STIFFNESS, DAMPING = 1.2, 0.72
LONGEST = 1.2  # of that time step: more is refused
LIGHT = 0.02  # kg m^2: lighter joints (wrists, forearms) get the armature of this inertia
LEAST_INERTIA = 1e-9  # kg m^2, of rounding: what is smaller is none


def is_moving(spec: mujoco.MjSpec) -> bool:
    """Whether the specification has a moving rider already."""
    return any(joint.name.endswith(anatomy.JOINT_NAMES[0]) for joint in spec.joints)


@dataclass(frozen=True)
class Figure:
    """The occupant that a chair shows, in the chair's frame.

    Attributes:
      origins: segment -> its joint (3,) m; None -> the middle of the hips.
      rotations: segment -> (3, 3), from the segment's frame.
      lengths: segment -> m, and "shoulder_width".
      angles: joint -> anatomical angle, rad.
      hips: left and right hip joint (3,) m.
    """

    origins: Mapping[str, Array]
    rotations: Mapping[str, Array]
    lengths: Mapping[str, float]
    angles: Mapping[str, float]
    hips: tuple[Array, Array]


def turn(axis: tuple[float, float, float] | Array, angle: float) -> Array:
    """Rotation (3, 3) about an axis by an angle, rad."""
    quat, matrix = np.zeros(4), np.zeros(9)
    mujoco.mju_axisAngle2Quat(quat, np.asarray(axis, dtype=np.float64), angle)
    mujoco.mju_quat2Mat(matrix, quat)
    return matrix.reshape(3, 3)


def figure(model: mujoco.MjModel) -> Figure:
    """The figure of a compiled chair with a rigid occupant, at the posture it is shown in.

    Raises:
      MjchairError: the chair does not show an occupant with the geoms of the shipped ones.
    """
    hips = tuple(_ends(model, f"{side}_thigh", f"{side}_shank")[0] for side in SIDES)
    arms = {side: _ends(model, f"{side}_upper_arm", f"{side}_forearm") for side in SIDES}
    wrists = {side: _ends(model, f"{side}_forearm", f"{side}_hand")[1] for side in SIDES}
    hip = 0.5 * (hips[0] + hips[1])
    shoulder = 0.5 * (arms["left"][0] + arms["right"][0])
    trunk = float(np.linalg.norm(shoulder - hip))
    angles: dict[str, float] = {}
    rotations = {"trunk": _upright(shoulder - hip, "trunk", np.eye(3), angles)}
    neck = trunk * anatomy.NECK_HEIGHT["male"] / anatomy.TRUNK_LENGTH["male"]
    origins = {"trunk": hip, "head": hip + rotations["trunk"] @ (0.0, 0.0, neck)}
    above = _center(model, "head") - origins["head"]
    rotations["head"] = _upright(above, "head", rotations["trunk"], angles)
    scale = STATURE / anatomy.SAMPLE_STATURE["male"]
    rows = anatomy.TABLE["male"]
    lengths = {
        "trunk": trunk,
        "head": rows["head"].length * scale,
        SHOULDER_WIDTH: float(np.linalg.norm(arms["left"][0] - arms["right"][0])),
    }
    for side, (joint, elbow) in arms.items():
        chain = (joint, elbow, wrists[side], _center(model, f"{side}_hand"))
        names = tuple(f"{side}_{part}" for part in ("upper_arm", "forearm", "hand"))
        rotations |= _arm_rotations(side, chain, rotations["trunk"], angles)
        origins |= dict(zip(names, chain, strict=False))
        lengths[names[0]] = float(np.linalg.norm(elbow - joint))
        lengths[names[1]] = float(np.linalg.norm(wrists[side] - elbow))
        lengths[names[2]] = rows["hand"].length * scale
    return Figure(origins, rotations, lengths, angles, (hips[0], hips[1]))


def _geom(model: mujoco.MjModel, name: str) -> int:
    index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, name)
    chair = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, CHAIR)
    if index < 0 or chair < 0 or model.geom_bodyid[index] != chair:
        raise MjchairError(
            f"the chair shows no occupant who could move: its body {CHAIR!r} has no geom {name!r}; "
            "keep the rider rigid, or give it the occupant's geoms of models/manual"
        )
    return int(index)


def _center(model: mujoco.MjModel, name: str) -> Array:
    return np.array(model.geom_pos[_geom(model, name)])


def _ends(model: mujoco.MjModel, name: str, towards: str) -> tuple[Array, Array]:
    """The end points of a capsule, the one towards another geom last."""
    index = _geom(model, name)
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, model.geom_quat[index])
    half = matrix.reshape(3, 3)[:, 2] * model.geom_size[index, 1]
    if half @ (_center(model, towards) - model.geom_pos[index]) < 0.0:
        half = -half
    return model.geom_pos[index] - half, model.geom_pos[index] + half


def _upright(vector: Array, segment: str, parent: Array, angles: dict[str, float]) -> Array:
    """Rotation of trunk or head that points along `vector`; notes its joints' angles."""
    x, y, z = parent.T @ (vector / np.linalg.norm(vector))
    flexion, lean = math.atan2(x, z), -math.asin(y)
    found = dict(zip((j.name for j in joints_of(segment)), (flexion, lean, 0.0), strict=True))
    angles.update(found)
    return parent @ _joint_rotation(segment, found)


def _arm_rotations(
    side: str, chain: tuple[Array, Array, Array, Array], trunk: Array, angles: dict[str, float]
) -> dict[str, Array]:
    """Rotations of upper arm, forearm and hand from shoulder, elbow, wrist and the hand's middle.

    The forearm is not turned (pronation 0).
    """
    y = SIDES[side]
    arm, forearm, hand = (f"{side}_{part}" for part in ("upper_arm", "forearm", "hand"))
    along = [(b - a) / np.linalg.norm(b - a) for a, b in pairwise(chain)]
    down = trunk.T @ along[0]
    found = {
        f"rider_{side}_shoulder_flexion": math.atan2(down[0], -down[2]),
        f"rider_{side}_shoulder_abduction": y * math.asin(down[1]),
        f"rider_{side}_shoulder_rotation": 0.0,
    }
    ahead = (trunk @ _joint_rotation(arm, found)).T @ along[1]
    found[f"rider_{side}_shoulder_rotation"] = -y * math.atan2(ahead[1], ahead[0])
    rotations = {arm: trunk @ _joint_rotation(arm, found)}
    ahead = rotations[arm].T @ along[1]
    found[f"rider_{side}_elbow_flexion"] = math.atan2(ahead[0], -ahead[2])
    found[f"rider_{side}_forearm_pronation"] = 0.0
    rotations[forearm] = rotations[arm] @ _joint_rotation(forearm, found)
    ahead = rotations[forearm].T @ along[2]
    found[f"rider_{side}_wrist_flexion"] = -y * math.atan2(ahead[1], -ahead[2])
    found[f"rider_{side}_wrist_deviation"] = -math.asin(ahead[0])
    rotations[hand] = rotations[forearm] @ _joint_rotation(hand, found)
    angles.update(found)
    return rotations


def _joint_rotation(segment: str, angles: Mapping[str, float]) -> Array:
    """Rotation of a segment in its parent's frame at the anatomical angles, rad."""
    rotation = np.eye(3)
    for joint in joints_of(segment):
        rotation = rotation @ turn(joint.axis, angles[joint.name])
    return rotation


def add(spec: mujoco.MjSpec, model: mujoco.MjModel, rider: Rider, mass: float) -> dict[str, float]:
    """Let the occupant of a chair move; call `tune` with the result compiled.

    Args:
      spec: edited in place. model: compiled from it. mass: of the occupant, kg.

    Returns:
      The anatomical angle (rad) at which each joint is zero.

    Raises:
      MjchairError: a chair without such an occupant, a rider heavier than the chair's body, or one
        whose upper body leaves no physical body behind.
    """
    shown = figure(model)
    lengths = rider.scaled(shown.lengths)
    _check_reach(shown)
    _take_from_chair(spec, model, shown, rider, mass)
    bodies: dict[str | None, mujoco.MjsBody] = {None: spec.body(CHAIR)}
    for segment in SEGMENTS:
        parent = bodies[segment.parent]
        body = parent.add_body(name=segment.body)
        body.pos = _joint_place(segment.name, shown, lengths, rider.sex)
        above = np.eye(3) if segment.parent is None else shown.rotations[segment.parent]
        body.quat = _quat(above.T @ shown.rotations[segment.name])
        own = segment_inertial(segment, rider.sex, mass, lengths[segment.name])
        body.mass, body.ipos, body.inertia = own.mass, own.center, np.diag(own.inertia)
        body.iquat = (1.0, 0.0, 0.0, 0.0)
        body.explicitinertial = True
        _add_joints(body, segment.name, shown.angles)
        _move_geoms(spec, model, body, segment, shown, lengths)
        bodies[segment.name] = body
    _add_landmarks(bodies, shown, lengths, rider.stature / STATURE)
    _add_inputs(spec, shown.angles)
    bias_sensor.add(spec, CHAIR)
    return dict(shown.angles)


def _check_reach(shown: Figure) -> None:
    for joint in JOINTS:
        angle = shown.angles[joint.name]
        if not joint.low <= angle <= joint.high:
            raise MjchairError(
                f"the chair shows its occupant with {joint.name} at {math.degrees(angle):.0f} deg; "
                f"a body reaches {math.degrees(joint.low):.0f} to {math.degrees(joint.high):.0f}"
            )


def _joint_place(
    segment: str, shown: Figure, lengths: Mapping[str, float], sex: str
) -> tuple[float, float, float] | Array:
    """Where a segment's joint is in its parent's frame, m."""
    side, _, part = segment.partition("_")
    if segment == "trunk":
        return shown.origins["trunk"]
    if segment == "head":
        height = anatomy.NECK_HEIGHT[sex] / anatomy.TRUNK_LENGTH[sex]
        return (0.0, 0.0, lengths["trunk"] * height)
    if part == "upper_arm":
        return (0.0, SIDES[side] * 0.5 * lengths[SHOULDER_WIDTH], lengths["trunk"])
    above = "upper_arm" if part == "forearm" else "forearm"
    return (0.0, 0.0, -lengths[f"{side}_{above}"])


def _take_from_chair(
    spec: mujoco.MjSpec, model: mujoco.MjModel, shown: Figure, rider: Rider, mass: float
) -> None:
    """Leave to the chair's body what the figure's segments do not have.

    Longer or shorter segments change the whole, not what is left.
    """
    index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, CHAIR)
    axes = np.zeros(9)
    mujoco.mju_quat2Mat(axes, model.body_iquat[index])
    turned = axes.reshape(3, 3)
    whole = Inertial(
        float(model.body_mass[index]),
        np.array(model.body_ipos[index]),
        turned @ np.diag(model.body_inertia[index]) @ turned.T,
    )
    if mass >= whole.mass:
        raise MjchairError(
            f"a rider of {mass:g} kg is heavier than chair and occupant together without wheels, "
            f"{whole.mass:g} kg; set occupant_mass to what the model's occupant has"
        )
    parts = [
        segment_inertial(segment, rider.sex, mass, shown.lengths[segment.name]).placed(
            shown.rotations[segment.name], shown.origins[segment.name]
        )
        for segment in SEGMENTS
    ]
    left = together(parts, -1.0, whole)
    principal, axes = np.linalg.eigh(left.inertia)
    if principal[0] <= LEAST_INERTIA or principal[0] + principal[1] < principal[2]:
        raise MjchairError(
            f"a moving upper body of {sum(part.mass for part in parts):.4g} kg leaves no body "
            f"behind that can be: principal inertias {', '.join(f'{p:.3g}' for p in principal)} "
            "kg m^2; keep the rider rigid, or give the chair's own mass and inertia more"
        )
    if np.linalg.det(axes) < 0.0:
        axes[:, 0] *= -1.0
    chair = spec.body(CHAIR)
    chair.mass, chair.ipos, chair.inertia, chair.iquat = (
        left.mass,
        left.center,
        principal,
        _quat(axes),
    )
    chair.explicitinertial = True


def _quat(rotation: Array) -> Array:
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, np.ascontiguousarray(rotation).ravel())
    return quat


def _add_joints(body: mujoco.MjsBody, segment: str, angles: Mapping[str, float]) -> None:
    """Hinges whose angles are zero as the segment is shown, about the anatomical axes."""
    behind = np.eye(3)
    hinges = []
    for joint in reversed(joints_of(segment)):
        hinges.append((joint, behind.T @ np.asarray(joint.axis, dtype=np.float64)))
        behind = turn(joint.axis, angles[joint.name]) @ behind
    for joint, axis in reversed(hinges):
        added = body.add_joint(name=joint.name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=axis)
        added.range = joint.low - angles[joint.name], joint.high - angles[joint.name]
        added.limited = mujoco.mjtLimited.mjLIMITED_TRUE


def _move_geoms(
    spec: mujoco.MjSpec,
    model: mujoco.MjModel,
    body: mujoco.MjsBody,
    segment: anatomy.Segment,
    shown: Figure,
    lengths: Mapping[str, float],
) -> None:
    """Show the segment with the chair's geoms of it, stretched to its length."""
    rotation, origin = shown.rotations[segment.name], shown.origins[segment.name]
    stretch = np.ones(3)
    stretch[2] = lengths[segment.name] / shown.lengths[segment.name]
    if segment.name == "trunk":
        stretch[1] = lengths[SHOULDER_WIDTH] / shown.lengths[SHOULDER_WIDTH]
    for name in segment.geoms:
        old = spec.geom(name)
        if old is None:
            continue
        index = _geom(model, name)
        axes = np.zeros(9)
        mujoco.mju_quat2Mat(axes, model.geom_quat[index])
        own = rotation.T @ axes.reshape(3, 3)
        size = np.array(model.geom_size[index])
        if old.type == mujoco.mjtGeom.mjGEOM_CAPSULE:
            size[1] *= np.linalg.norm(stretch * own[:, 2])
        else:
            size *= np.linalg.norm(stretch[:, None] * own, axis=0)
        new = body.add_geom(
            type=old.type,
            size=size,
            pos=stretch * (rotation.T @ (model.geom_pos[index] - origin)),
            quat=_quat(own),
            material=old.material,
            rgba=old.rgba,
            group=old.group,
            contype=old.contype,
            conaffinity=old.conaffinity,
            mass=old.mass,
        )
        spec.delete(old)
        new.name = name


def _add_landmarks(
    bodies: Mapping[str | None, mujoco.MjsBody],
    shown: Figure,
    lengths: Mapping[str, float],
    scale: float,
) -> None:
    for mark in LANDMARKS:
        if mark.segment is None:
            place = shown.hips["right" in mark.name]
        else:
            up = 1.0 if mark.segment in ("trunk", "head") else -1.0
            x, y = scale * mark.across[0], scale * mark.across[1]
            if mark.wide:
                y = mark.across[1] * 0.5 * lengths[SHOULDER_WIDTH]
            place = np.array([x, y, up * mark.along * lengths[mark.segment]])
        bodies[mark.segment].add_site(
            name=anatomy.PREFIX + mark.name, pos=place, size=[0.01] * 3, group=4
        )


def _add_inputs(spec: mujoco.MjSpec, angles: Mapping[str, float]) -> None:
    for joint in JOINTS:
        actuator = spec.add_actuator(
            name=joint.name,
            trntype=mujoco.mjtTrn.mjTRN_JOINT,
            target=joint.name,
        )
        actuator.ctrlrange = joint.low - angles[joint.name], joint.high - angles[joint.name]
        actuator.ctrllimited = mujoco.mjtLimited.mjLIMITED_TRUE
        spec.add_sensor(
            name=f"{joint.name}_angle",
            type=mujoco.mjtSensor.mjSENS_JOINTPOS,
            objtype=mujoco.mjtObj.mjOBJ_JOINT,
            objname=joint.name,
        )


def tune(spec: mujoco.MjSpec, model: mujoco.MjModel) -> None:
    """Let each of the rider's joints follow its input, set to the inertia that it moves at rest.

    Args:
      spec: edited in place. model: compiled from it.
    """
    step = spec.option.timestep
    following = Following(stiffness=STIFFNESS / step**2, damping=DAMPING / step)
    for joint in JOINTS:
        inertia = max(float(model.dof_M0[model.joint(joint.name).dofadr[0]]), LIGHT)
        driven_joint.damp(spec, spec.joint(joint.name), inertia, following)
        driven_joint.drive(spec.actuator(joint.name), spec.joint(joint.name), following)


def check_timestep(model: mujoco.MjModel) -> None:
    """Hold the time step against that which the rider's joints were built for.

    Raises:
      MjchairError: a time step so long that a joint may oscillate about its input.
    """
    for i in range(model.njnt):
        if model.joint(i).name.endswith(anatomy.JOINT_NAMES):
            most = LONGEST * driven_joint.delay(model, i) * STIFFNESS / DAMPING
            if 0.0 < most < model.opt.timestep:
                raise MjchairError(
                    f"timestep {model.opt.timestep:g} s is beyond the stability limit of the "
                    f"rider's joints, {most:.3g} s; build the chair with that timestep "
                    "(load_spec(timestep=...), --timestep)"
                )
