"""Bring a chair to rest on its tires, as on a platform that is tilted slowly.

In: a model and data, with the chair at its position. Out: the same data with the chair at rest, or
an error that says why the chair does not come to rest. A chair that is dropped on a slope rocks,
and may tip over although it could stand there. So it settles as in the tests of ISO 7176-1: first
with gravity along the chair's own z, then gravity is turned slowly into its true direction. During
this time a viscous drag acts on all joints. At rest this drag has no force, so the final state is a
static equilibrium of the chair.
"""

from __future__ import annotations

import copy
import enum
import math

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.engine import element
from mjchair.errors import MjchairError
from mjchair.model.wheels import wheels
from mjchair.simulation.floor import on_field
from mjchair.simulation.standing import (
    LEAST,
    TIPPED,
    chair_joints,
    groups,
    lean,
)

Array = NDArray[np.float64]

LEVEL_TIME = 0.4  # s, with gravity along the chair's z
TILT_TIME = 2.0  # s, during which gravity turns into its true direction
MOST_TIME = 25.0  # s in total; a chair that tips slowly onto its anti-tippers takes longest
BLOCK = 0.02  # s between two changes of gravity; afterwards the motion is checked every five blocks
DRAG = 20.0  # 1/s: drag over inertia; tires and contacts swing with about 40 rad/s
HELD = 1e12  # kg m^2 added to a hinge to hold it: no torque turns it in 25 s
TOLERANCE = 1e-12  # of the solver, so that its error does not appear as speed
FINE_TOLERANCE = 1e-15  # where it does all the same
SETTLED = 1e-9  # m/s or rad/s
REST = 1e-6  # m/s or rad/s: largest speed at the end of MOST_TIME
SWING = 0.01  # m/s or rad/s
SLID = 0.2  # m along the floor; larger: the chair slides. Tipping onto anti-tippers rolls it 0.03
LIMIT_WITHIN = math.radians(0.1)  # of the steepest slope on which a refused chair would stand


class NotStandingError(MjchairError):
    """The chair does not come to rest on its wheels: it tips over, slides, or moves on."""


class Outcome(enum.Enum):
    """How settling ended, in words that follow "the chair"."""

    STANDS = "stands"
    TIPS = "tips over"
    SLIDES = "slides"
    MOVES = "does not come to rest"


def settle(model: mujoco.MjModel, data: mujoco.MjData, held: bool) -> None:
    """Bring the chair in `data` to rest; its velocities end at zero. Callbacks must be in place.

    Meanwhile a moving surface (a treadmill) stands still, a rider who sways sits still, and the
    user's `mjcb_control` is not called.

    Args:
      model: of the chair. data: at time 0, with the chair at its position.
      held: hold every hinge; otherwise the brakes hold the wheels, and casters are free.

    Raises:
      NotStandingError: the chair does not come to rest on its wheels.
    """
    placed = copy.copy(data)
    control = mujoco.get_mjcb_control()
    mujoco.set_mjcb_control(None)
    try:
        outcome = _tried(model, data, held)
        data.qvel[:] = 0.0
        if outcome is not Outcome.STANDS and chair_joints(model):
            raise NotStandingError(_refusal(model, placed, held, outcome))
    finally:
        mujoco.set_mjcb_control(control)


def _tried(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    held: bool,
    share: float = 1.0,
) -> Outcome:
    """Settle as `_settled`, and a chair that stands but for a small swing or creep once more.

    With their hinges held, casters on springs swing on their tires faster than the model's time
    step resolves, and the swing grows slowly; half the step ends it. A chair that leans on its
    anti-tippers creeps by the solver's error, since held hinges weigh so much more than the chair.
    """
    placed = copy.copy(data)
    outcome = _settled(model, data, held, share)
    nearly = bool(np.abs(data.qvel).max(initial=0.0) < SWING)
    if outcome is Outcome.STANDS or not nearly:
        return outcome
    mujoco.mj_copyData(data, model, placed)
    finer = copy.copy(model)
    finer.opt.timestep = 0.5 * model.opt.timestep
    finer.opt.tolerance = FINE_TOLERANCE
    return _settled(finer, data, held, share)


def _settled(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    held: bool,
    share: float = 1.0,
) -> Outcome:
    """Settle with gravity turned by a share of its angle, within `MOST_TIME`; the outcome."""
    settling = copy.copy(model)
    settling.dof_damping[:] += DRAG * model.dof_M0
    settling.geom_surfacevel[:] = 0.0
    element.hold_sway(settling)
    settling.opt.tolerance = min(settling.opt.tolerance, TOLERANCE)
    if held:
        hinges = model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE
        settling.dof_armature[model.jnt_dofadr[hinges]] = HELD
    steps = max(1, round(BLOCK / settling.opt.timestep))
    level, way = _tilt(model, data)
    begun, joints = data.qpos.copy(), chair_joints(model)
    tilt_time = TILT_TIME if way[0] > 0.0 else 0.0
    clock, turned = 0.0, 0.0
    while clock < MOST_TIME:
        turned = min(max((clock - LEVEL_TIME) / tilt_time, 0.0), 1.0) if tilt_time else 1.0
        smooth = turned * turned * (3.0 - 2.0 * turned)
        settling.opt.gravity = _turned(level, way, share * smooth)
        many = steps if turned < 1.0 else 5 * steps
        mujoco.mj_step(settling, data, nstep=many)
        clock += many * settling.opt.timestep
        if turned == 1.0 and np.abs(data.qvel).max(initial=0.0) < SETTLED:
            break
        if not np.isfinite(data.qpos).all() or _gone(model, joints, data, begun):
            break
    return _outcome(model, joints, data, begun)


def _tilt(model: mujoco.MjModel, data: mujoco.MjData) -> tuple[Array, tuple[float, Array]]:
    """Gravity (3,) along the chair's z, and the angle (rad) and axis (3,) of its true direction."""
    gravity = np.array(model.opt.gravity)
    size = float(np.linalg.norm(gravity))
    joints = chair_joints(model)
    if not joints or size == 0.0:
        return gravity, (0.0, np.zeros(3))
    mujoco.mj_kinematics(model, data)
    down = -data.xmat[model.jnt_bodyid[joints[0]]].reshape(3, 3)[:, 2]
    axis = np.cross(down, gravity / size)
    sine = float(np.linalg.norm(axis))
    angle = math.atan2(sine, float(down @ gravity) / size)
    if angle < 1e-6:
        return gravity, (0.0, np.zeros(3))
    return size * down, (angle, axis / max(sine, 1e-12))


def _turned(vector: Array, way: tuple[float, Array], share: float) -> Array:
    """The vector (3,) turned by a share of an angle (rad) about an axis."""
    quat, turned = np.zeros(4), np.zeros(3)
    mujoco.mju_axisAngle2Quat(quat, way[1], share * way[0])
    mujoco.mju_rotVecQuat(turned, vector, quat)
    return turned


def _gone(
    model: mujoco.MjModel, joints: list[int], data: mujoco.MjData, begun: Array
) -> Outcome | None:
    """How a chair has left its position in `begun`: tipped or slid away; None: it has not."""
    for joint in joints:
        at = int(model.jnt_qposadr[joint])
        up = np.zeros(3)
        mujoco.mju_rotVecQuat(up, np.array([0.0, 0.0, 1.0]), begun[at + 3 : at + 7])
        if lean(model, joint, data.qpos[None], up)[0] > TIPPED:
            return Outcome.TIPS
        way = data.qpos[at : at + 3] - begun[at : at + 3]
        if np.linalg.norm(way - (way @ up) * up) > SLID:
            return Outcome.SLIDES
    return None


def _outcome(
    model: mujoco.MjModel, joints: list[int], data: mujoco.MjData, begun: Array
) -> Outcome:
    gone = _gone(model, joints, data, begun)
    if gone is not None:
        return gone
    if not np.isfinite(data.qvel).all():
        return Outcome.MOVES
    if _tipping(model, data):
        return Outcome.TIPS
    if np.abs(data.qvel).max(initial=0.0) <= REST:
        return Outcome.STANDS
    for joint in joints:
        dof = int(model.jnt_dofadr[joint])
        speed, turning = data.qvel[dof : dof + 3], data.qvel[dof + 3 : dof + 6]
        if np.linalg.norm(speed) > max(REST, float(np.linalg.norm(turning[:2]))):
            return Outcome.SLIDES
    return Outcome.MOVES


def _tipping(model: mujoco.MjModel, data: mujoco.MjData) -> bool:
    """Whether a chair at rest is tipped, by the rule of mjchair.simulation.standing."""
    weight = float(model.body_subtreemass[0] * np.linalg.norm(model.opt.gravity))
    for joint in chair_joints(model):
        body = int(model.jnt_bodyid[joint])
        loads = {
            wheel.name: data.act[model.actuator_actadr[wheel.actuator] + 3]
            for wheel in wheels(model)
            if model.body_rootid[wheel.body] == body
        }
        pairs = groups(loads).values()
        if any(all(loads[name] <= LEAST * weight for name in pair) for pair in pairs):
            return True
    return False


def _refusal(model: mujoco.MjModel, placed: mujoco.MjData, held: bool, outcome: Outcome) -> str:
    """The error message: what the chair does on this slope, and up to which slope it stands."""
    how = "with its wheels held" if held else "with its brakes locked"
    angle = _tilt(model, placed)[1][0]
    rule = "a run starts with the chair at rest on its wheels"
    if on_field(model):
        return f"the chair {outcome.value} {how} at this place of the height field; {rule}"
    if angle == 0.0:
        return f"the chair {outcome.value} {how} where it is placed; {rule}"
    low, high = 0.0, 1.0
    while (high - low) * angle > LIMIT_WITHIN:
        middle = 0.5 * (low + high)
        ended = _tried(model, copy.copy(placed), held, middle)
        low, high = (middle, high) if ended is Outcome.STANDS else (low, middle)
    limit = (
        f"stands so up to {_slope(low * angle)}" if low else "does not stand on the level either"
    )
    return (
        f"the chair {outcome.value} {how} on a slope of {_slope(angle)}; {rule}, "
        f"and this one {limit}"
    )


def _slope(angle: float) -> str:
    """An angle (rad) in words, in degrees and as a grade in percent."""
    steep = f" ({100.0 * math.tan(angle):.3g} %)" if angle < 0.5 * math.pi else ""
    return f"{math.degrees(angle):.1f} deg{steep}"
