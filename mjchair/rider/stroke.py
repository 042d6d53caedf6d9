"""The motion of pushing: joint angles over time with which the hands follow the push rims.

Goes in: a compiled chair with push rims and a moving rider, and when the strokes are. Comes out:
time series of the rider's joints, to be driven beside the torques of the same strokes.

In the push the hands go with the rims from the start to the end of contact at a constant speed; in
the recovery they lift off and come back above the rims, while the trunk, which bent forward in the
push, comes up again. The single looping over the rim is one of the four patterns that people use
(Boninger et al. 2002, Arch Phys Med Rehabil 83, 718-723). The angles of the arms come from
inverse kinematics by bounded least squares (`mujoco.minimize`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import mujoco
import numpy as np
from mujoco import minimize
from numpy.typing import ArrayLike, NDArray

from mjchair.errors import MjchairError
from mjchair.rider.anatomy import JOINTS, SIDES

Array = NDArray[np.float64]

PHASES = 48  # of a cycle at which the arms are solved
LIFT = 0.25  # of the rim's radius, by which the hand is above it in the middle of the recovery
ASIDE = 0.03  # m, by which it is outside of it then
REACH = 0.01  # m: a hand that misses the rim by more has not reached it
SAME = 1e-3  # m: an arm's angles that bring the other hand so near to its path are used for it
GRIP_WEIGHT = 1000.0  # 1/m, against rad of the joints below
WRIST_WEIGHT, ARM_WEIGHT = 2.0, 1.0  # 1/rad away from the shipped posture


@dataclass(frozen=True)
class Stroke:
    """When strokes are and where the hands go; angles are forward of the rim's top.

    Attributes:
      period: from one stroke's start to the next, s. push: in which the hand is on the rim, s.
      start: of the first stroke, s. duration: of the whole, s; as in `push_strokes` a stroke that
        would not end within it is left out.
      contact, release: where the hand lands and leaves, rad. Assumption: 70 deg in all, which the
        arms of the shipped figure reach from its seat.
      trunk: flexion of the trunk from contact to release, rad. Assumption.

    Raises:
      MjchairError: a time that is not positive, a push longer than the period, or a release that
        is not ahead of the contact.
    """

    period: float
    push: float
    start: float
    duration: float
    contact: float = math.radians(-30.0)
    release: float = math.radians(40.0)
    trunk: float = math.radians(12.0)

    def __post_init__(self) -> None:
        """Check the numbers against one another."""
        if not 0.0 < self.push < self.period:
            raise MjchairError(
                f"push lasts {self.push:g} s; it must be positive and end within the period, "
                f"{self.period:g} s"
            )
        if self.start < 0.0 or not self.duration > 0.0:
            raise MjchairError(
                f"start is {self.start:g} s and duration {self.duration:g} s; start must not be "
                "negative, and duration must be positive"
            )
        if not -math.pi < self.contact < self.release < math.pi:
            raise MjchairError(
                f"the hand lands at {self.contact:.3g} rad and leaves at {self.release:.3g} rad; "
                "it must leave ahead of where it lands"
            )

    def phase(self, time: ArrayLike) -> Array:
        """Share of the cycle, 0 to 1, at the times given (s), of their shape.

        The hands set off from rest before the first stroke, and come to rest after the last one.
        """
        t = np.asarray(time, dtype=np.float64)
        share, recovery = self.push / self.period, self.period - self.push
        count = math.floor((self.duration - self.start - self.push) / self.period + 1e-9) + 1
        phase = np.mod((t - self.start) / self.period, 1.0)
        if self.start > 0.0:
            begin = (self.start**2 - t**2) / (2.0 * self.start * recovery)
            phase = np.where(t < self.start, 1.0 - (1.0 - share) * np.minimum(begin, 1.0), phase)
        last = self.start + (count - 1) * self.period + self.push
        late = np.clip((t - last) / (2.0 * recovery), 0.0, 1.0)
        ends = share + (1.0 - share) * (2.0 * late - late**2)
        return np.asarray(np.where(t > last, ends, phase))

    def hand(self, phase: ArrayLike) -> tuple[Array, Array, Array]:
        """Angle (rad) of the hand about the hub, its lift (of the radius) and way outwards (m)."""
        p = np.asarray(phase, dtype=np.float64)
        share, way = self.push / self.period, self.release - self.contact
        on_rim = self.contact + way * p / share
        s = np.clip((p - share) / (1.0 - share), 0.0, 1.0)
        slope = way / share * (1.0 - share)  # of the hand on the rim, in units of the recovery
        back = self.release - way * (3.0 * s**2 - 2.0 * s**3)
        back += slope * (s - 3.0 * s**2 + 2.0 * s**3)
        bump = np.where(p > share, np.sin(np.pi * s) ** 2, 0.0)
        return np.where(p > share, back, on_rim), LIFT * bump, ASIDE * bump

    def bend(self, phase: ArrayLike) -> Array:
        """Flexion of the trunk, rad: up to `trunk` at the release, and back."""
        p, share = np.asarray(phase, dtype=np.float64), self.push / self.period
        s = np.where(p < share, p / share, (1.0 - p) / (1.0 - share))
        return np.asarray(self.trunk * (3.0 * s**2 - 2.0 * s**3))


def has_rims(model: mujoco.MjModel) -> bool:
    """Whether both rear wheels have a push rim, a geom `<side>_wheel_pushrim`."""
    kind = mujoco.mjtObj.mjOBJ_GEOM
    return all(mujoco.mj_name2id(model, kind, f"{s}_wheel_pushrim") >= 0 for s in SIDES)


def push_motion(model: mujoco.MjModel, stroke: Stroke, time: ArrayLike) -> dict[str, Array]:
    """Joint angles with which the rider pushes.

    Args:
      model: compiled, with push rims and a moving rider, the names as shipped.
      stroke: when and where. time: (n,), s.

    Returns:
      Joint -> (n,) rad, of every joint that moves.

    Raises:
      MjchairError: no push rims, no moving rider, or hands that do not reach the rims.
    """
    _check(model)
    phases = np.linspace(0.0, 1.0, PHASES + 1)
    at = stroke.phase(time)
    moves = {JOINTS[0].name: stroke.bend(at)}
    solved = None
    for side in SIDES:
        solved = _arm(model, side, stroke, phases, solved)
        for joint, angles in zip(_joints(side), solved.T, strict=True):
            moves[joint] = _periodic(phases, angles, at)
    return moves


def _joints(side: str) -> list[str]:
    return [joint.name for joint in JOINTS if joint.name.startswith(f"rider_{side}_")]


def _periodic(phases: Array, values: Array, at: Array) -> Array:
    from scipy.interpolate import CubicSpline  # loads long

    closed = np.append(values[:-1], values[0])
    return np.asarray(CubicSpline(phases, closed, bc_type="periodic")(at))


def _check(model: mujoco.MjModel) -> None:
    if not has_rims(model):
        raise MjchairError(
            "the chair has no push rims (geoms left_wheel_pushrim and right_wheel_pushrim), so "
            "there is nothing to push; give the rider's joints another motion, or none"
        )
    if mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, JOINTS[0].name) < 0:
        raise MjchairError('the rider is rigid; build the chair with rider="moving"')


def _rim(model: mujoco.MjModel, data: mujoco.MjData, side: str) -> tuple[Array, Array, float]:
    """Centre (3,) m and axis to the outside (3,) of a push rim, and its radius, m."""
    geom = model.geom(f"{side}_wheel_pushrim").id
    center, axes = data.geom_xpos[geom].copy(), data.geom_xmat[geom].reshape(3, 3)
    if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = model.geom_dataid[geom]
        first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        points = model.mesh_vert[first : first + count]
        thin = int(np.argmin(np.ptp(points, axis=0)))
        far = np.linalg.norm(np.delete(points, thin, axis=1), axis=1)
        axis, radius = axes[:, thin], 0.5 * float(far.min() + far.max())
    else:
        axis, radius = axes[:, 2], float(model.geom_size[geom, 0])
    return center, axis * np.sign(axis[1] * SIDES[side]), radius


def _arm(
    model: mujoco.MjModel, side: str, stroke: Stroke, phases: Array, other: Array | None
) -> Array:
    """Angles (n, joints) of one arm at the phases (n,), rad.

    Args:
      other: those of the other arm, which are taken where they fit this side too.
    """
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    angle, target = _path(model, data, side, stroke, phases)
    bend = stroke.bend(phases)
    grip = _Grip(model, data, side)

    def missed(solved: Array) -> Array:
        return np.array([grip.miss(*row) for row in zip(target, bend, solved, strict=True)])

    if other is not None and missed(other).max() < SAME:
        return other
    solved = np.zeros((len(phases), len(_joints(side))))
    for k in range(len(phases)):
        solved[k] = grip.solve(target[k], float(bend[k]), solved[max(k - 1, 0)])
    miss = missed(solved)
    worst = int(np.argmax(miss))
    if miss[worst] > REACH:
        raise MjchairError(
            f"the {side} hand misses the path of the stroke by {1e3 * miss[worst]:.0f} mm, "
            f"{math.degrees(angle[worst]):.0f} deg ahead of the rim's top; the arms are too short "
            f"for contact from {math.degrees(stroke.contact):.0f} to "
            f"{math.degrees(stroke.release):.0f} deg from this seat: choose a smaller angle"
        )
    return solved


def _path(
    model: mujoco.MjModel, data: mujoco.MjData, side: str, stroke: Stroke, phases: Array
) -> tuple[Array, Array]:
    """Where the grip is at the phases (n,): angle about the hub (n,) rad, and place (n, 3) m."""
    center, out, radius = _rim(model, data, side)
    up = np.array([0.0, 0.0, 1.0]) - out * out[2]
    up /= np.linalg.norm(up)
    ahead = np.cross(SIDES[side] * out, up)
    angle, lift, aside = (value[:, None] for value in stroke.hand(phases))
    place = center + radius * (1.0 + lift) * (np.sin(angle) * ahead + np.cos(angle) * up)
    return angle[:, 0], place + aside * out


class _Grip:
    """Least squares of one hand's grip to a point."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, side: str) -> None:
        self.model, self.data = model, data
        joints = _joints(side)
        self.site = model.site(f"rider_{side}_grip").id
        ids = [model.joint(name).id for name in joints]
        self.qpos = model.jnt_qposadr[ids]
        self.dofs = model.jnt_dofadr[ids]
        self.trunk = model.jnt_qposadr[model.joint(JOINTS[0].name).id]
        wrist = np.array(["wrist" in name or "pronation" in name for name in joints])
        self.weight = np.where(wrist, WRIST_WEIGHT, ARM_WEIGHT)
        self.bounds = [np.array(bound) for bound in model.jnt_range[ids].T]

    def _place(self, angles: Array) -> Array:
        self.data.qpos[self.qpos] = angles
        mujoco.mj_kinematics(self.model, self.data)
        return np.asarray(self.data.site_xpos[self.site].copy())

    def solve(self, target: Array, bend: float, first: Array) -> Array:
        """Angles that bring the grip to the target (3,) m, near the shipped posture."""
        self.data.qpos[self.trunk] = bend

        def residual(points: Array) -> Array:
            rows = [
                np.r_[GRIP_WEIGHT * (self._place(x) - target), self.weight * x] for x in points.T
            ]
            return np.array(rows).T

        def jacobian(x: Array, _: Array) -> Array:
            self._place(x.ravel())
            mujoco.mj_comPos(self.model, self.data)
            full = np.zeros((3, self.model.nv))
            mujoco.mj_jacSite(self.model, self.data, full, None, self.site)
            return np.vstack([GRIP_WEIGHT * full[:, self.dofs], np.diag(self.weight)])

        inside = np.clip(first, *self.bounds)
        found, _ = minimize.least_squares(
            inside, residual, self.bounds, jacobian, verbose=minimize.Verbosity.SILENT
        )
        return np.asarray(found).ravel()

    def miss(self, target: Array, bend: float, angles: Array) -> float:
        """How far the grip is from the target, m."""
        self.data.qpos[self.trunk] = bend
        return float(np.linalg.norm(self._place(angles) - target))
