"""One wheel in MuJoCo: from its contacts and velocities to a force on its body, and its sensors.

In: the views of a model and its data (mjchair.engine.views) and an actuator. Out: the tire's force
in `xfrc_applied`, the rates of its state in `act_dot`, and its sensors in `sensordata`.

The tire's state lies in the activation of the wheel's `user` actuator: longitudinal, lateral and
rolling deflection (m), and the load of the last constraint solve (N).

The callbacks run in this order within a step:

1. `act_dyn`, before the constraint solve: deflections first, then the force, into `xfrc_applied`.
   MuJoCo has not yet written this step's `efc_force`, so the load is the one in the state.
2. `sense`, after the solve: the solved load goes into the state, and the sensors are filled.

Nothing is kept outside `act`, and `act` itself changes only when MuJoCo integrates, so any number
of `mj_forward` calls changes no trajectory.

This is plain Python that Numba compiles. Every function that takes a view is marked
`forceinline`, so that the compiler copies its body to the place of the call: a real call would
hand over some 200 words of array descriptions, and take three times as long as the wheel itself.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from mujoco import mjtDyn, mjtObj, mjtSensor, mjtTrn
from numba.extending import register_jitable

from mjchair.engine import drivetrain
from mjchair.engine.contact import contact_load, contact_patch, dot, share_stiffness
from mjchair.engine.views import DataView, ModelView
from mjchair.tire import block, law

DYN_USER = int(mjtDyn.mjDYN_USER)
TRN_JOINT = int(mjtTrn.mjTRN_JOINT)
OBJ_ACTUATOR = int(mjtObj.mjOBJ_ACTUATOR)
SENSOR_USER = int(mjtSensor.mjSENS_USER)

# a sensor's own block, in its `user` field
SENSOR_TAG = 5066323.0  # "MJS": what follows is the kind, then a bias and a scale per component
SENSOR_KIND = 1
SENSOR_BIAS = 2
SENSOR_LAG = 4  # of a heading, s: the sensor shows it this much late, at an even turning speed
PLAIN, HEADING = range(2)


class WheelFrame(NamedTuple):
    """Directions of a wheel over the ground, as unit vectors in the world.

    Attributes:
      hx, hy, hz: heading. lx, ly, lz: left, in the ground plane. gamma: camber, rad.
      ax, ay, az: spin axis.
    """

    hx: float
    hy: float
    hz: float
    lx: float
    ly: float
    lz: float
    gamma: float
    ax: float
    ay: float
    az: float


Six = tuple[float, float, float, float, float, float]


@register_jitable(forceinline=True)
def tire_geom(m: ModelView, actuator: int) -> int:
    """The tire geom whose state the actuator carries, or -1."""
    if m.actuator_dyntype[actuator] != DYN_USER or m.actuator_trntype[actuator] != TRN_JOINT:
        return -1
    if drivetrain.kind(m, actuator) != 0:
        return -1
    body = m.jnt_bodyid[m.actuator_trnid[actuator, 0]]
    first = m.body_geomadr[body]
    if m.geom_user.shape[1] < block.HEADER:
        return -1
    for geom in range(first, first + m.body_geomnum[body]):
        if m.geom_user[geom, block.TAG_AT] == block.TAG:
            return geom
    return -1


@register_jitable(forceinline=True)
def wheel_axes(d: DataView, geom: int, nx: float, ny: float, nz: float) -> WheelFrame:
    """Heading x and left y in the ground plane, and camber (rad), from the spin axis.

    Where the axis is upright, the heading is undefined and the wheel's own x is taken.
    """
    mat = d.geom_xmat
    ax, ay, az = mat[geom, 2], mat[geom, 5], mat[geom, 8]
    hx, hy, hz = ay * nz - az * ny, az * nx - ax * nz, ax * ny - ay * nx
    size = math.sqrt(hx * hx + hy * hy + hz * hz)
    if size < 1e-9:
        hx, hy, hz, size = mat[geom, 0], mat[geom, 3], mat[geom, 6], 1.0
    hx, hy, hz = hx / size, hy / size, hz / size
    lx, ly, lz = ny * hz - nz * hy, nz * hx - nx * hz, nx * hy - ny * hx
    gamma = math.asin(min(max(ax * nx + ay * ny + az * nz, -1.0), 1.0))
    return WheelFrame(hx, hy, hz, lx, ly, lz, gamma, ax, ay, az)


@register_jitable(forceinline=True)
def velocity_at(m: ModelView, d: DataView, body: int, px: float, py: float, pz: float) -> Six:
    """Velocity (m/s) of the point of the body that is at p, and the body's spin (rad/s)."""
    com, root, cvel = d.subtree_com, m.body_rootid[body], d.cvel
    rx, ry, rz = px - com[root, 0], py - com[root, 1], pz - com[root, 2]
    wx, wy, wz = cvel[body, 0], cvel[body, 1], cvel[body, 2]
    vx = cvel[body, 3] + wy * rz - wz * ry
    vy = cvel[body, 4] + wz * rx - wx * rz
    vz = cvel[body, 5] + wx * ry - wy * rx
    return vx, vy, vz, wx, wy, wz


@register_jitable(forceinline=True)
def ground_velocity(m: ModelView, d: DataView, geom: int, px: float, py: float, pz: float) -> Six:
    """Velocity (m/s) of the ground at p, with its surface velocity (a treadmill), and its spin."""
    vx, vy, vz, wx, wy, wz = velocity_at(m, d, m.geom_bodyid[geom], px, py, pz)
    s = m.geom_surfacevel
    moving = False
    for i in range(6):
        moving = moving or s[geom, i] != 0.0
    if not moving:
        return vx, vy, vz, wx, wy, wz
    mat, pos = d.geom_xmat, d.geom_xpos
    rx, ry, rz = px - pos[geom, 0], py - pos[geom, 1], pz - pos[geom, 2]
    ux, uy, uz = s[geom, 0], s[geom, 1], s[geom, 2]
    tx, ty, tz = s[geom, 3], s[geom, 4], s[geom, 5]
    bx = dot(mat, geom, 0, tx, ty, tz)
    by = dot(mat, geom, 3, tx, ty, tz)
    bz = dot(mat, geom, 6, tx, ty, tz)
    vx += dot(mat, geom, 0, ux, uy, uz) + by * rz - bz * ry
    vy += dot(mat, geom, 3, ux, uy, uz) + bz * rx - bx * rz
    vz += dot(mat, geom, 6, ux, uy, uz) + bx * ry - by * rx
    return vx, vy, vz, wx + bx, wy + by, wz + bz


@register_jitable(forceinline=True)
def road(m: ModelView, ground: int, px: float, py: float) -> law.Road:
    """Added rolling resistance and friction factor of the ground geom's patches at p.

    A patch fades over the outer tenth of its radius.
    """
    added, friction = 0.0, 1.0
    user = m.geom_user
    if user[ground, 0] != block.ROAD_TAG:
        return law.Road(added, friction)
    for k in range(int(user[ground, block.ROAD_COUNT])):
        at = block.ROAD_PATCHES + k * block.ROAD_STRIDE
        distance = math.hypot(px - user[ground, at], py - user[ground, at + 1])
        inside = min(max((1.0 - distance / user[ground, at + 2]) * 10.0, 0.0), 1.0)
        added += inside * user[ground, at + 3]
        friction *= 1.0 + inside * (user[ground, at + 4] - 1.0)
    return law.Road(added, friction)


@register_jitable(forceinline=True)
def act_dyn(m: ModelView, d: DataView, actuator: int) -> None:
    """Step the deflections of one wheel and put its tire force into `xfrc_applied`.

    An actuator `drive` steps the drive instead (mjchair.engine.drivetrain).
    """
    if drivetrain.kind(m, actuator) == drivetrain.DRIVE:
        drivetrain.act_dyn(m, d, actuator)
        return
    geom = tire_geom(m, actuator)
    if geom < 0:
        return
    body = m.geom_bodyid[geom]
    at = m.actuator_actadr[actuator]
    h = m.timestep
    count, nx, ny, nz, px, py, pz, ground = contact_patch(d, geom)
    if count > 1:
        _, nx, ny, nz, px, py, pz, ground = share_stiffness(m, d, geom)
    old = law.Deflection(d.act[at], d.act[at + 1], d.act[at + 2])
    load = d.act[at + 3]
    force = d.xfrc_applied
    if ground < 0 or load <= 0.0:
        for i in range(3):
            d.act_dot[at + i] = -old[i] / h
        for i in range(6):
            force[body, i] = 0.0
        return

    hx, hy, hz, lx, ly, lz, gamma, ax, ay, az = wheel_axes(d, geom, nx, ny, nz)
    vx, vy, vz, wx, wy, wz = velocity_at(m, d, body, px, py, pz)
    gx, gy, gz, ox, oy, oz = ground_velocity(m, d, ground, px, py, pz)
    vx, vy, vz, wx, wy, wz = vx - gx, vy - gy, vz - gz, wx - ox, wy - oy, wz - oz
    center = d.geom_xpos
    cx, cy, cz = center[geom, 0] - px, center[geom, 1] - py, center[geom, 2] - pz
    # the arm on which spin moves the contact along the heading: (axis x centre) . heading
    radius = hx * (ay * cz - az * cy) + hy * (az * cx - ax * cz) + hz * (ax * cy - ay * cx)
    slip_x = vx * hx + vy * hy + vz * hz
    slip_y = vx * lx + vy * ly + vz * lz
    spin = wx * ax + wy * ay + wz * az
    yaw = wx * nx + wy * ny + wz * nz - spin * math.sin(gamma)
    # MuJoCo's velocities belong to a time half a step before its positions. The heading in which
    # the slip speed is resolved is turned back to that time, or a caster that shimmies at 2 ms does
    # so 1 % too fast, and too damped
    slip_y += 0.5 * h * yaw * (slip_x + spin * radius)

    new, _, (fx, fy, mx, my, mz) = law.step_tire(
        m.geom_user[geom],
        old,
        load,
        gamma,
        law.Motion(slip_x + spin * radius, slip_x, slip_y, spin, yaw, radius),
        road(m, ground, px, py),
        h,
    )
    for i in range(3):
        d.act_dot[at + i] = (new[i] - old[i]) / h

    com = d.xipos
    rx, ry, rz = px - com[body, 0], py - com[body, 1], pz - com[body, 2]
    tx, ty, tz = fx * hx + fy * lx, fx * hy + fy * ly, fx * hz + fy * lz
    force[body, 0], force[body, 1], force[body, 2] = tx, ty, tz
    force[body, 3] = ry * tz - rz * ty + mx * hx + my * lx + mz * nx
    force[body, 4] = rz * tx - rx * tz + mx * hy + my * ly + mz * ny
    force[body, 5] = rx * ty - ry * tx + mx * hz + my * lz + mz * nz


@register_jitable(forceinline=True)
def sense_tire(m: ModelView, d: DataView, actuator: int, geom: int, adr: int) -> None:
    """Put the solved load into the state, and fill Fx, Fy, Fz, Mz, kappa, tan_alpha, gamma."""
    at = m.actuator_actadr[actuator]
    h = m.timestep
    _, nx, ny, nz, px, py, pz, ground = contact_patch(d, geom)
    load = contact_load(d, geom, nx, ny, nz) if ground >= 0 else 0.0
    last = d.act[at + 3]
    d.act_dot[at + 3] = (load - last) / h
    out = d.sensordata
    for i in range(7):
        out[adr + i] = 0.0
    if ground < 0:
        return
    body = m.geom_bodyid[geom]
    hx, hy, hz, lx, ly, lz, gamma, _, _, _ = wheel_axes(d, geom, nx, ny, nz)
    force, com = d.xfrc_applied, d.xipos
    rx, ry, rz = px - com[body, 0], py - com[body, 1], pz - com[body, 2]
    tx, ty, tz = force[body, 0], force[body, 1], force[body, 2]
    out[adr] = tx * hx + ty * hy + tz * hz
    out[adr + 1] = tx * lx + ty * ly + tz * lz
    out[adr + 2] = load
    out[adr + 3] = dot(force, body, 3, nx, ny, nz) - (
        (ry * tz - rz * ty) * nx + (rz * tx - rx * tz) * ny + (rx * ty - ry * tx) * nz
    )
    sigma_x, sigma_y = law.relaxation(m.geom_user[geom], last, gamma)
    out[adr + 4] = -(d.act[at] + h * d.act_dot[at]) / sigma_x
    out[adr + 5] = (d.act[at + 1] + h * d.act_dot[at + 1]) / sigma_y
    out[adr + 6] = gamma


@register_jitable(forceinline=True)
def sense(m: ModelView, d: DataView) -> None:
    """Fill mjchair's sensors and apply the sensor blocks; for the acceleration stage."""
    for i in range(m.nsensor):
        adr = m.sensor_adr[i]
        if m.sensor_type[i] == SENSOR_USER and m.sensor_objtype[i] == OBJ_ACTUATOR:
            actuator = m.sensor_objid[i]
            kind, geom = drivetrain.kind(m, actuator), tire_geom(m, actuator)
            if kind == drivetrain.DRIVE:
                drivetrain.sense_drive(m, d, actuator, adr)
            elif kind == drivetrain.MOTOR:
                drivetrain.sense_motor(m, d, actuator, adr)
            elif geom >= 0:
                sense_tire(m, d, actuator, geom, adr)
        if m.sensor_user.shape[1] <= SENSOR_KIND or m.sensor_user[i, 0] != SENSOR_TAG:
            continue
        user = m.sensor_user
        if user[i, SENSOR_KIND] == HEADING:
            site = m.sensor_objid[i]
            heading = math.atan2(d.site_xmat[site, 3], d.site_xmat[site, 0])
            if user.shape[1] > SENSOR_LAG and user[i, SENSOR_LAG] != 0.0:
                heading -= user[i, SENSOR_LAG] * d.cvel[m.site_bodyid[site], 2]
                heading = math.atan2(math.sin(heading), math.cos(heading))
            d.sensordata[adr] = heading
        for k in range(m.sensor_dim[i]):
            at = SENSOR_BIAS + 2 * k
            if at + 1 < user.shape[1]:
                d.sensordata[adr + k] = (
                    user[i, at] + (1.0 + user[i, at + 1]) * d.sensordata[adr + k]
                )
