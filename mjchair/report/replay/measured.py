"""How a measured chair moved, told from its channels, so that it can be drawn beside a simulation.

In: a recording of a simulated chair, and a measured run (a Trial) or other channels of one. Out: a
Track. The measured chair stands at the recording's first place and heading, and moves from there
along the floor plane, wheels rolling and casters trailing without slip:

- it turns as `heading` says; where that was not measured as `imu_gyro.z` says, then as the
  difference of the wheels' angles or speeds does; a chair with one measured wheel goes straight;
- it travels as `position` says; else as the wheels' angles, then their speeds, then `velocity.x`.

What was not measured is not invented: trunk and arms keep their first pose, and the chair neither
leans nor climbs. Gaps in a channel are bridged by straight lines.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import mujoco
import numpy as np
from scipy.integrate import cumulative_trapezoid

from mjchair.errors import MjchairError
from mjchair.measurement.trial import Trial
from mjchair.model.rolling import rear_axle
from mjchair.model.wheels import base_name
from mjchair.report.replay.track import MOST, Array, Track, evenly, poses
from mjchair.simulation import names
from mjchair.simulation.recording import Recording

SIDES = ("left", "right")
SUBSTEP = 0.002  # s, of the casters' swivel
LAID = "laid on the first place and heading; it is drawn without leaning or climbing"
NEEDED = "position.x and position.y, a wheel's angle or speed, or velocity.x"

Channel = Callable[[str], Array | None]


@dataclass(frozen=True)
class PlaneMotion:
    """A motion along the floor: travelled (n,) m, turned (n,) rad, both from 0; rolled: wheel
    angles by side, rad; world: (n, 2), m, where places were measured, else None."""

    time: Array
    travelled: Array
    turned: Array
    rolled: Mapping[str, Array]
    world: Array | None


def measured_track(recording: Recording, trial: Trial, label: str, status: str = LAID) -> Track:
    """The track of a measured run.

    Args:
      recording: gives the chair, and where it starts. trial: what was measured; its first sample
        is laid on the recording's first time. label: for the page. status: how it came about.

    Raises:
      MjchairError: no channel tells how far the chair went, or the recorded chair has no joint
        `chair`, no rear wheels, or does not load.
    """
    model = recording.model.load()
    motion = plane_motion(trial, model)
    qpos = chair_positions(model, recording.qpos[0], motion)
    places, quaternions = poses(model, qpos)
    time = motion.time - motion.time[0] + recording.time[0]
    ground = _ground_below(model, recording.qpos[0])
    chair = int(model.jnt_bodyid[_joint(model, "chair")])
    path = places[:, chair] - (places[0, chair] - ground)
    kept = evenly(time, min(MOST, time.size))
    signals = {name: _filled(trial, name, motion.time) for name in trial.channels}
    if trial.inputs is not None:
        for name in trial.inputs.controls:
            signals[name] = np.interp(motion.time, *trial.inputs.samples(name))
    span = float(np.ptp(time))
    return Track(
        label=label,
        time=time[kept],
        places=places[kept],
        quaternions=quaternions[kept],
        path=path[kept],
        contacts={},
        signals={name: values[kept] for name, values in signals.items() if values is not None},
        units=dict(recording.units),
        rate=kept.size / span if kept.size < time.size and span > 0.0 else None,
        status=status,
    )


def plane_motion(trial: Trial, model: mujoco.MjModel) -> PlaneMotion:
    """How far a measured chair went and turned; the module says from which channels.

    Raises:
      MjchairError: none of them was measured.
    """
    axle = rear_axle(model)
    time = trial.time

    def channel(name: str) -> Array | None:
        return _filled(trial, name, time)

    rolled = {
        side: angle for side in SIDES if (angle := _wheel_angle(channel, side, time)) is not None
    }
    turned = _turned(channel, rolled, time, axle.left, axle.right, axle.track)
    x, y = channel("position.x"), channel("position.y")
    world = None
    if x is not None and y is not None:
        world = np.column_stack([x - x[0], y - y[0]])
        heading = channel("heading")
        if heading is not None:  # into axes along and across the first heading
            c, s = np.cos(heading[0]), np.sin(heading[0])
            world = world @ np.array([[c, -s], [s, c]])
        step = np.diff(world, axis=0)
        middle = 0.5 * (turned[1:] + turned[:-1])
        ahead = step[:, 0] * np.cos(middle) + step[:, 1] * np.sin(middle)
        travelled = np.append(0.0, np.cumsum(ahead))
    elif rolled:
        travelled = np.mean([axle.radius(side) * angle for side, angle in rolled.items()], axis=0)
        if len(rolled) == 1:  # of the axle's middle, while the chair turns about it
            side = next(iter(rolled))
            travelled = travelled + (0.5 if side == "left" else -0.5) * axle.track * turned
    else:
        speed = channel("velocity.x")
        if speed is None:
            raise MjchairError(
                f"{trial.name}: no channel tells how far the chair went; a ghost needs {NEEDED}"
            )
        travelled = _integral(speed, time)
    for side, sign in (("left", -1.0), ("right", 1.0)):
        if side not in rolled:
            rolled[side] = (travelled + 0.5 * sign * axle.track * turned) / axle.radius(side)
    return PlaneMotion(time, travelled, turned, rolled, world)


def chair_positions(model: mujoco.MjModel, first: Array, motion: PlaneMotion) -> Array:
    """Positions (n, nq) of a chair that moves so from its first ones, (nq,).

    Raises:
      MjchairError: the model has no joint `chair` or no site `axle`.
    """
    data = mujoco.MjData(model)
    data.qpos[:] = first
    mujoco.mj_kinematics(model, data)
    address = int(model.jnt_qposadr[_joint(model, "chair")])
    sites = names.names(model, mujoco.mjtObj.mjOBJ_SITE, model.nsite)
    axle = data.site_xpos[names.find("axle", sites, "site")].copy()
    turn = data.xmat[model.jnt_bodyid[_joint(model, "chair")]].reshape(3, 3).copy()
    normal = _normal(model, data)
    ahead = turn[:, 0] - (turn[:, 0] @ normal) * normal
    ahead /= np.linalg.norm(ahead)
    left = np.cross(normal, ahead)
    along = _along(motion)
    moved = along[:, :1] * ahead + along[:, 1:] * left
    qpos = np.tile(first, (motion.time.size, 1))
    start, quaternion = first[address : address + 3] - axle, first[address + 3 : address + 7]
    for k, angle in enumerate(motion.turned):
        spin, turned, arm = np.empty(4), np.empty(4), np.empty(3)
        mujoco.mju_axisAngle2Quat(spin, normal, angle)
        mujoco.mju_rotVecQuat(arm, start, spin)
        mujoco.mju_mulQuat(turned, spin, quaternion)
        qpos[k, address : address + 3] = axle + moved[k] + arm
        qpos[k, address + 3 : address + 7] = turned
    for side in SIDES:
        wheel = model.jnt_qposadr[_joint(model, f"{side}_wheel")]
        qpos[:, wheel] += motion.rolled[side] - motion.rolled[side][0]
        _trail(model, data, side, motion, qpos)
    return qpos


def _along(motion: PlaneMotion) -> Array:
    """Places (n, 2), m, along and across the first heading."""
    if motion.world is not None:
        return motion.world
    middle = 0.5 * (motion.turned[1:] + motion.turned[:-1])
    step = np.diff(motion.travelled)
    steps = np.column_stack([step * np.cos(middle), step * np.sin(middle)])
    return np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])


def _trail(
    model: mujoco.MjModel, data: mujoco.MjData, side: str, motion: PlaneMotion, qpos: Array
) -> None:
    """Let a caster trail and roll without slip, in place; a chair may have none.

    With the pivot's velocity v in the chair's axes, the trail L, the direction d from the wheel to
    the pivot at angle delta, and the yaw rate w: v across d = L (w + d delta / d t).
    """
    try:
        swivel, wheel = (_joint(model, f"{side}_caster{end}") for end in ("_swivel", ""))
    except MjchairError:
        return
    chair = model.jnt_bodyid[_joint(model, "chair")]
    axes = data.xmat[chair].reshape(3, 3)
    sites = names.names(model, mujoco.mjtObj.mjOBJ_SITE, model.nsite)
    axle = data.site_xpos[names.find("axle", sites, "site")]
    arm = axes.T @ (data.xanchor[swivel] - axle)
    to_pivot = (axes.T @ (data.xanchor[swivel] - data.xanchor[wheel]))[:2]
    trail, delta = float(np.hypot(*to_pivot)), float(np.arctan2(to_pivot[1], to_pivot[0]))
    if trail < 1e-3:
        return
    geom = next(
        i for i, name in enumerate(names.geoms(model)) if base_name(name) == f"{side}_caster_tire"
    )
    radius = float(model.geom_size[geom, 0])
    swivelled, rolled, angle = np.zeros(motion.time.size), np.zeros(motion.time.size), 0.0
    for k in range(1, motion.time.size):
        dt = motion.time[k] - motion.time[k - 1]
        speed = (motion.travelled[k] - motion.travelled[k - 1]) / dt
        yaw = (motion.turned[k] - motion.turned[k - 1]) / dt
        v = np.array([speed - yaw * arm[1], yaw * arm[0]])
        pieces = max(1, int(np.ceil(dt / SUBSTEP)))
        for _ in range(pieces):
            across = -v[0] * np.sin(delta) + v[1] * np.cos(delta)
            delta += (across / trail - yaw) * dt / pieces
            angle += (v[0] * np.cos(delta) + v[1] * np.sin(delta)) / radius * dt / pieces
        swivelled[k], rolled[k] = delta, angle
    swivelled[0] = float(np.arctan2(to_pivot[1], to_pivot[0]))
    qpos[:, model.jnt_qposadr[swivel]] += swivelled - swivelled[0]
    qpos[:, model.jnt_qposadr[wheel]] += rolled


def _turned(
    channel: Channel,
    rolled: Mapping[str, Array],
    time: Array,
    left: float,
    right: float,
    track: float,
) -> Array:
    """Turned from the first sample (n,), rad; left and right: radii, m."""
    heading = channel("heading")
    if heading is not None:
        unwrapped = np.unwrap(heading)
        return np.asarray(unwrapped - unwrapped[0])
    rate = channel("imu_gyro.z")
    if rate is not None:
        return _integral(rate, time)
    if len(rolled) == len(SIDES):
        return (right * rolled["right"] - left * rolled["left"]) / track
    return np.zeros(time.size)


def _wheel_angle(channel: Channel, side: str, time: Array) -> Array | None:
    angle = channel(f"{side}_wheel_angle")
    if angle is not None:
        return np.asarray(angle - angle[0])
    speed = channel(f"{side}_wheel_speed")
    return None if speed is None else _integral(speed, time)


def _integral(rate: Array, time: Array) -> Array:
    return np.asarray(cumulative_trapezoid(rate, time, initial=0.0))


def _filled(trial: Trial, name: str, time: Array) -> Array | None:
    """A channel at all times, straight between its samples; None where it has none."""
    for full, values in trial.channels.items():
        if names.same(full, name):
            there = np.isfinite(values)
            return np.interp(time, trial.time[there], values[there]) if there.any() else None
    return None


def _joint(model: mujoco.MjModel, name: str) -> int:
    return names.find(name, names.joints(model), "joint")


def _normal(model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    """Of the plane `floor`, upwards; the vertical where there is none."""
    for i, name in enumerate(names.geoms(model)):
        if names.same(name, "floor") and model.geom_type[i] == mujoco.mjtGeom.mjGEOM_PLANE:
            return np.asarray(data.geom_xmat[i].reshape(3, 3)[:, 2].copy())
    return np.array([0.0, 0.0, 1.0])


def _ground_below(model: mujoco.MjModel, first: Array) -> Array:
    """The place (3,), m, on the ground below the middle of the rear axle."""
    data = mujoco.MjData(model)
    data.qpos[:] = first
    mujoco.mj_kinematics(model, data)
    sites = names.names(model, mujoco.mjtObj.mjOBJ_SITE, model.nsite)
    axle = data.site_xpos[names.find("axle", sites, "site")]
    radii = rear_axle(model)
    return np.asarray(axle - 0.5 * (radii.left + radii.right) * _normal(model, data))
