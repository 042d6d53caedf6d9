"""The common centre of mass of chair and moving rider, kept on the path of the forces from outside.

In: the views of a model and its data (mjchair.engine.views) after MuJoCo's acceleration stage. Out:
`qfrc_smooth`, which MuJoCo's implicit step still reads, with a force on the chair's free joint.

A step carries the centre of mass from `x` to `x+`, the step before brought it from `x-`. Newton
asks that `x+ - 2 x + x-` is what the forces from outside give, to the last digit. Hinges turn in
a step by a finite angle, so MuJoCo's step, which knows the centre's speed and acceleration only at
`x`, is off by the square of the step, even when the centripetal forces come at the right time
(mjchair.engine.bias_force). Both ways are calculated here with finite turns, and what is missing
acts as a force at the centre of mass. It is some mN for a rider who swings both arms.

Only a free chair whose model has the sensor `rider_bias_force` is touched, and nothing is kept:
the force follows from MuJoCo's state. `qacc` and sensors of acceleration are without it. RK4, and
Euler in a model without damping, do not read `qfrc_smooth` and go on without it.
"""

from __future__ import annotations

import math

from mujoco import mjtDisableBit, mjtJoint
from numba.extending import register_jitable

from mjchair.engine import bias_force
from mjchair.engine.contact import dot
from mjchair.engine.views import DataView, ModelView

FREE = int(mjtJoint.mjJNT_FREE)
BALL = int(mjtJoint.mjJNT_BALL)
WITHOUT_GRAVITY = int(mjtDisableBit.mjDSBL_GRAVITY)

Vector = tuple[float, float, float]


@register_jitable(forceinline=True)
def keep(m: ModelView, d: DataView) -> None:
    """Add the missing force on every free chair that has a sensor of the bias force."""
    if bias_force.is_asked_for(m):
        for sensor in range(m.nsensor):
            if bias_force.shows(m, sensor):
                root = m.body_rootid[m.sensor_objid[sensor]]
                first = m.body_dofadr[root]
                if first >= 0 and m.jnt_type[m.dof_jntid[first]] == FREE:
                    fx, fy, fz = _missing_force(m, d, root)
                    for dof in range(first, first + 6):
                        d.qfrc_smooth[dof] += dot(d.cdof, dof, 3, fx, fy, fz)


@register_jitable(forceinline=True)
def _missing_force(m: ModelView, d: DataView, root: int) -> Vector:
    """What the step as MuJoCo takes it lacks on a chair, N, along the world's axes.

    All that acts on it makes, as Newton says, `mass * (onward + back) / step^2`.
    """
    step, first = m.timestep, m.body_dofadr[root]
    mass, heavy = m.body_subtreemass[root], 0.0
    if not m.disableflags & WITHOUT_GRAVITY:
        heavy = mass
    ox, oy, oz = _travel(m, d, root, step, step)
    bx, by, bz = _travel(m, d, root, 0.0, -step)
    per = mass / (step * step)
    return (
        _acting(d, first) + heavy * m.gravity[0] - per * (ox + bx),
        _acting(d, first + 1) + heavy * m.gravity[1] - per * (oy + by),
        _acting(d, first + 2) + heavy * m.gravity[2] - per * (oz + bz),
    )


@register_jitable(forceinline=True)
def _acting(d: DataView, dof: int) -> float:
    """What acts on a degree of freedom besides the weight, which `qfrc_bias` holds, N or N m."""
    return float(d.qfrc_smooth[dof] + d.qfrc_constraint[dof] + d.qfrc_bias[dof])


@register_jitable(forceinline=True)
def _travel(m: ModelView, d: DataView, root: int, ahead: float, span: float) -> Vector:
    """How far the centre goes in `span` (s) at the speeds of `ahead` (s) from now, m.

    Every joint turns or slides from where it is now, the last of a body first (product of
    exponentials, as `mj_integratePos` and `mj_kinematics` together), the chair's own at the end.
    """
    x = y = z = 0.0
    own = m.body_dofadr[root] + 6
    cx, cy, cz = d.subtree_com[root, 0], d.subtree_com[root, 1], d.subtree_com[root, 2]
    for body in range(root, m.nbody):
        if m.body_rootid[body] == root:
            ox, oy, oz = d.xipos[body, 0] - cx, d.xipos[body, 1] - cy, d.xipos[body, 2] - cz
            px, py, pz = ox, oy, oz
            dof = _last_dof(m, body)
            while dof >= own:
                begin = dof - 2 if m.jnt_type[m.dof_jntid[dof]] == BALL else dof
                px, py, pz = _moved(d, begin, dof + 1, ahead, span, px, py, pz)
                dof = m.dof_parentid[begin]
            mass = m.body_mass[body]
            x, y, z = x + mass * (px - ox), y + mass * (py - oy), z + mass * (pz - oz)
    whole = m.body_subtreemass[root]
    x, y, z = _moved(d, own - 3, own, ahead, span, x / whole, y / whole, z / whole)
    return _moved(d, own - 6, own - 3, ahead, span, x, y, z)


@register_jitable(forceinline=True)
def _moved(
    d: DataView,
    begin: int,
    end: int,
    ahead: float,
    span: float,
    px: float,
    py: float,
    pz: float,
) -> Vector:
    """Where degrees of freedom of one joint, which turn or slide together, carry a point."""
    wx = wy = wz = vx = vy = vz = 0.0
    for k in range(begin, end):
        by = span * (d.qvel[k] + ahead * d.qacc[k])
        wx, vx = wx + by * d.cdof[k, 0], vx + by * d.cdof[k, 3]
        wy, vy = wy + by * d.cdof[k, 1], vy + by * d.cdof[k, 4]
        wz, vz = wz + by * d.cdof[k, 2], vz + by * d.cdof[k, 5]
    return _screwed(px, py, pz, wx, wy, wz, vx, vy, vz)


@register_jitable(forceinline=True)
def _last_dof(m: ModelView, body: int) -> int:
    """The last degree of freedom that moves a body, -1: none does."""
    moved = m.body_weldid[body]
    return m.body_dofadr[moved] + m.body_dofnum[moved] - 1 if m.body_dofnum[moved] > 0 else -1


@register_jitable
def _screwed(
    px: float,
    py: float,
    pz: float,
    wx: float,
    wy: float,
    wz: float,
    vx: float,
    vy: float,
    vz: float,
) -> Vector:
    """A point after a turn `w` (rad) that moves the origin at first by `v`, or after the shift `v`.

    Rodrigues's formula about an axis beside the origin: `v` is square to `w`, or `w` is zero.
    """
    ux, uy, uz = wy * pz - wz * py + vx, wz * px - wx * pz + vy, wx * py - wy * px + vz
    angle = math.sqrt(wx * wx + wy * wy + wz * wz)
    if angle > 0.0:
        half = math.sin(0.5 * angle) / angle
        along, across = math.sin(angle) / angle, 2.0 * half * half
    else:
        along, across = 1.0, 0.5
    return (
        px + along * ux + across * (wy * uz - wz * uy),
        py + along * uy + across * (wz * ux - wx * uz),
        pz + along * uz + across * (wx * uy - wy * ux),
    )
