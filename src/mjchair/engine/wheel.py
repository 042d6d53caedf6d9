"""One wheel in MuJoCo: from its contacts and velocities to a force on its body, and its sensors.

Plain Python that Numba compiles, on the views of mjchair.engine.views. The tire's state lies in
the activation of the wheel's `user` actuator: longitudinal, lateral and rolling deflection (m) and
the load of the last solve (N). The callbacks run in this order within a step:

1. `act_dyn`, before the constraint solve: deflections first, then the force, into `xfrc_applied`.
   `efc_force` is old memory at this point, so the load is the state's.
2. `sense`, after the solve: the load that was solved goes into the state, and the sensors are
   filled.

Nothing is kept outside `act`, and `act` itself changes only when MuJoCo integrates, so any number
of `mj_forward` calls changes no trajectory.
"""

from __future__ import annotations

import math

from mujoco import mjtDyn, mjtObj, mjtSensor, mjtTrn
from numba.extending import register_jitable

from mjchair.tire import block, law

DYN_USER = int(mjtDyn.mjDYN_USER)
TRN_JOINT = int(mjtTrn.mjTRN_JOINT)
OBJ_ACTUATOR = int(mjtObj.mjOBJ_ACTUATOR)
OBJ_SITE = int(mjtObj.mjOBJ_SITE)
SENSOR_USER = int(mjtSensor.mjSENS_USER)

# a sensor's own block, in its `user` field
SENSOR_TAG = 5066323.0  # "MJS": what follows is the kind, then a bias and a scale per component
SENSOR_KIND = 1
SENSOR_BIAS = 2
PLAIN, HEADING = range(2)


@register_jitable
def dot(a, ax, ay, az):
    """Scalar product of the three numbers from a[0] with a vector."""
    return a[0] * ax + a[1] * ay + a[2] * az


@register_jitable
def tire_geom(m, actuator):
    """The tire geom that the actuator is the state of, or -1."""
    if m.actuator_dyntype[actuator] != DYN_USER or m.actuator_trntype[actuator] != TRN_JOINT:
        return -1
    body = m.jnt_bodyid[m.actuator_trnid[actuator, 0]]
    first = m.body_geomadr[body]
    if m.geom_user.shape[1] < block.HEADER:
        return -1
    for geom in range(first, first + m.body_geomnum[body]):
        if m.geom_user[geom, block.TAG_AT] == block.TAG:
            return geom
    return -1


@register_jitable
def contact_patch(d, geom):
    """Where and how the ground touches the geom: its contacts as one, weighted by depth.

    Weights fall to zero where a contact opens, so one that comes or goes makes no kick.

    Returns:
      weight (m, 0: no contact), normal towards the wheel (3), position (3), the other geom.
    """
    weight, deepest, ground = 0.0, 0.0, -1
    nx = ny = nz = px = py = pz = 0.0
    for c in range(d.contact_dist.shape[0]):
        side = 1.0
        other = d.contact_geom[c, 0]
        if other == geom:
            side = -1.0
            other = d.contact_geom[c, 1]
        elif d.contact_geom[c, 1] != geom:
            continue
        depth = d.contact_includemargin[c] - d.contact_dist[c]
        if depth <= 0.0 or d.contact_efc_address[c] < 0:
            continue
        weight += depth
        nx += depth * side * d.contact_frame[c, 0]
        ny += depth * side * d.contact_frame[c, 1]
        nz += depth * side * d.contact_frame[c, 2]
        px += depth * d.contact_pos[c, 0]
        py += depth * d.contact_pos[c, 1]
        pz += depth * d.contact_pos[c, 2]
        if depth > deepest:
            deepest, ground = depth, other
    size = math.sqrt(nx * nx + ny * ny + nz * nz)
    if size == 0.0:
        return 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1
    return weight, nx / size, ny / size, nz / size, px / weight, py / weight, pz / weight, ground


@register_jitable
def contact_load(d, geom, nx, ny, nz):
    """Solved load (N) of the geom's contacts along the normal; valid after the solve only."""
    load = 0.0
    for c in range(d.contact_dist.shape[0]):
        address = d.contact_efc_address[c]
        if address < 0:
            continue
        if d.contact_geom[c, 0] == geom:
            load -= d.efc_force[address] * dot(d.contact_frame[c], nx, ny, nz)
        elif d.contact_geom[c, 1] == geom:
            load += d.efc_force[address] * dot(d.contact_frame[c], nx, ny, nz)
    return max(load, 0.0)


@register_jitable
def wheel_axes(d, geom, nx, ny, nz):
    """Heading x and left y in the ground plane, and camber (rad), from the spin axis.

    Returns:
      x (3), y (3), gamma, spin axis (3). Where the axis is upright, the heading is undefined and
      the wheel's own x is taken.
    """
    mat = d.geom_xmat[geom]
    ax, ay, az = mat[2], mat[5], mat[8]
    hx, hy, hz = ay * nz - az * ny, az * nx - ax * nz, ax * ny - ay * nx
    size = math.sqrt(hx * hx + hy * hy + hz * hz)
    if size < 1e-9:
        hx, hy, hz, size = mat[0], mat[3], mat[6], 1.0
    hx, hy, hz = hx / size, hy / size, hz / size
    lx, ly, lz = ny * hz - nz * hy, nz * hx - nx * hz, nx * hy - ny * hx
    gamma = math.asin(min(max(ax * nx + ay * ny + az * nz, -1.0), 1.0))
    return hx, hy, hz, lx, ly, lz, gamma, ax, ay, az


@register_jitable
def velocity_at(m, d, body, px, py, pz):
    """Velocity (m/s) of the point of the body that is at p, and the body's spin (rad/s)."""
    com = d.subtree_com[m.body_rootid[body]]
    cvel = d.cvel[body]
    rx, ry, rz = px - com[0], py - com[1], pz - com[2]
    wx, wy, wz = cvel[0], cvel[1], cvel[2]
    vx = cvel[3] + wy * rz - wz * ry
    vy = cvel[4] + wz * rx - wx * rz
    vz = cvel[5] + wx * ry - wy * rx
    return vx, vy, vz, wx, wy, wz


@register_jitable
def ground_velocity(m, d, geom, px, py, pz):
    """Velocity (m/s) of the ground at p, with its surface velocity (a treadmill), and its spin."""
    vx, vy, vz, wx, wy, wz = velocity_at(m, d, m.geom_bodyid[geom], px, py, pz)
    s = m.geom_surfacevel[geom]
    if s[0] == 0.0 and s[1] == 0.0 and s[2] == 0.0 and s[3] == 0.0 and s[4] == 0.0 and s[5] == 0.0:
        return vx, vy, vz, wx, wy, wz
    mat, pos = d.geom_xmat[geom], d.geom_xpos[geom]
    rx, ry, rz = px - pos[0], py - pos[1], pz - pos[2]
    bx = mat[0] * s[3] + mat[1] * s[4] + mat[2] * s[5]
    by = mat[3] * s[3] + mat[4] * s[4] + mat[5] * s[5]
    bz = mat[6] * s[3] + mat[7] * s[4] + mat[8] * s[5]
    vx += mat[0] * s[0] + mat[1] * s[1] + mat[2] * s[2] + by * rz - bz * ry
    vy += mat[3] * s[0] + mat[4] * s[1] + mat[5] * s[2] + bz * rx - bx * rz
    vz += mat[6] * s[0] + mat[7] * s[1] + mat[8] * s[2] + bx * ry - by * rx
    return vx, vy, vz, wx + bx, wy + by, wz + bz


@register_jitable
def road(m, ground, px, py):
    """Added rolling resistance and friction factor of the ground geom's patches at p.

    A patch fades over the outer tenth of its radius.
    """
    added, friction = 0.0, 1.0
    user = m.geom_user[ground]
    if user[0] != block.ROAD_TAG:
        return added, friction
    for k in range(int(user[block.ROAD_COUNT])):
        at = block.ROAD_PATCHES + k * block.ROAD_STRIDE
        distance = math.hypot(px - user[at], py - user[at + 1]) / user[at + 2]
        inside = min(max((1.0 - distance) * 10.0, 0.0), 1.0)
        added += inside * user[at + 3]
        friction *= 1.0 + inside * (user[at + 4] - 1.0)
    return added, friction


@register_jitable
def act_dyn(m, d, actuator):
    """Step the deflections of one wheel and put its tire force into `xfrc_applied`."""
    geom = tire_geom(m, actuator)
    if geom < 0:
        return
    body = m.geom_bodyid[geom]
    at = m.actuator_actadr[actuator]
    h = m.timestep
    weight, nx, ny, nz, px, py, pz, ground = contact_patch(d, geom)
    u, w, r, load = d.act[at], d.act[at + 1], d.act[at + 2], d.act[at + 3]
    force = d.xfrc_applied[body]
    if weight == 0.0 or load <= 0.0:
        d.act_dot[at], d.act_dot[at + 1], d.act_dot[at + 2] = -u / h, -w / h, -r / h
        for i in range(6):
            force[i] = 0.0
        return

    hx, hy, hz, lx, ly, lz, gamma, ax, ay, az = wheel_axes(d, geom, nx, ny, nz)
    vx, vy, vz, wx, wy, wz = velocity_at(m, d, body, px, py, pz)
    gx, gy, gz, ox, oy, oz = ground_velocity(m, d, ground, px, py, pz)
    vx, vy, vz, wx, wy, wz = vx - gx, vy - gy, vz - gz, wx - ox, wy - oy, wz - oz
    center = d.geom_xpos[geom]
    cx, cy, cz = center[0] - px, center[1] - py, center[2] - pz
    # the arm on which spin moves the contact along the heading: (axis x centre) . heading
    radius = hx * (ay * cz - az * cy) + hy * (az * cx - ax * cz) + hz * (ax * cy - ay * cx)
    slip_x = vx * hx + vy * hy + vz * hz
    slip_y = vx * lx + vy * ly + vz * lz
    spin = wx * ax + wy * ay + wz * az
    yaw = wx * nx + wy * ny + wz * nz - spin * math.sin(gamma)
    added, friction = road(m, ground, px, py)

    new_u, new_w, new_r, _, _, fx, fy, mx, my, mz = law.step_tire(
        m.geom_user[geom],
        u,
        w,
        r,
        load,
        gamma,
        slip_x + spin * radius,
        slip_x,
        slip_y,
        spin,
        yaw,
        radius,
        added,
        friction,
        h,
    )
    d.act_dot[at] = (new_u - u) / h
    d.act_dot[at + 1] = (new_w - w) / h
    d.act_dot[at + 2] = (new_r - r) / h

    com = d.xipos[body]
    rx, ry, rz = px - com[0], py - com[1], pz - com[2]
    tx, ty, tz = fx * hx + fy * lx, fx * hy + fy * ly, fx * hz + fy * lz
    force[0], force[1], force[2] = tx, ty, tz
    force[3] = ry * tz - rz * ty + mx * hx + my * lx + mz * nx
    force[4] = rz * tx - rx * tz + mx * hy + my * ly + mz * ny
    force[5] = rx * ty - ry * tx + mx * hz + my * lz + mz * nz


@register_jitable
def sense_tire(m, d, actuator, geom, adr):
    """Put the solved load into the state, and fill Fx, Fy, Fz, Mz, kappa, tan_alpha, gamma."""
    at = m.actuator_actadr[actuator]
    h = m.timestep
    _, nx, ny, nz, px, py, pz, ground = contact_patch(d, geom)
    load = contact_load(d, geom, nx, ny, nz) if ground >= 0 else 0.0
    last = d.act[at + 3]
    d.act_dot[at + 3] = (load - last) / h
    out = d.sensordata[adr : adr + 7]
    for i in range(7):
        out[i] = 0.0
    if ground < 0:
        return
    body = m.geom_bodyid[geom]
    hx, hy, hz, lx, ly, lz, gamma, _, _, _ = wheel_axes(d, geom, nx, ny, nz)
    force, com = d.xfrc_applied[body], d.xipos[body]
    rx, ry, rz = px - com[0], py - com[1], pz - com[2]
    out[0] = dot(force, hx, hy, hz)
    out[1] = dot(force, lx, ly, lz)
    out[2] = load
    out[3] = (
        dot(force[3:6], nx, ny, nz)
        - (ry * force[2] - rz * force[1]) * nx
        - (rz * force[0] - rx * force[2]) * ny
        - (rx * force[1] - ry * force[0]) * nz
    )
    sigma_x, sigma_y = law.relaxation(m.geom_user[geom], last, gamma)
    out[4] = -(d.act[at] + h * d.act_dot[at]) / sigma_x
    out[5] = (d.act[at + 1] + h * d.act_dot[at + 1]) / sigma_y
    out[6] = gamma


@register_jitable
def sense(m, d):
    """Fill mjchair's sensors and apply the sensor blocks; for the acceleration stage."""
    for i in range(m.nsensor):
        adr = m.sensor_adr[i]
        if m.sensor_type[i] == SENSOR_USER and m.sensor_objtype[i] == OBJ_ACTUATOR:
            geom = tire_geom(m, m.sensor_objid[i])
            if geom >= 0:
                sense_tire(m, d, m.sensor_objid[i], geom, adr)
        if m.sensor_user.shape[1] <= SENSOR_KIND or m.sensor_user[i, 0] != SENSOR_TAG:
            continue
        user = m.sensor_user[i]
        if user[SENSOR_KIND] == HEADING:
            mat = d.site_xmat[m.sensor_objid[i]]
            d.sensordata[adr] = math.atan2(mat[3], mat[0])
        for k in range(m.sensor_dim[i]):
            at = SENSOR_BIAS + 2 * k
            if at + 1 < user.shape[0]:
                d.sensordata[adr + k] = user[at] + (1.0 + user[at + 1]) * d.sensordata[adr + k]
