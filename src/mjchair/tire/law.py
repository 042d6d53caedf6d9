"""One tire, one step: deflections first, then forces from them.

Written once, in plain Python: the compiled callback, the plain callback and the arrays of
`Tire.forces` all call these functions.
"""

from __future__ import annotations

import math

from numba.extending import register_jitable

from mjchair.tire import block
from mjchair.tire.formula import linear, mf61, pac89
from mjchair.tire.transient import relax

TURNING_RATE = 0.05  # rad/s, over which the turning moment's sign is smoothed; assumed

pac89_forces, pac89_stiffness = pac89.forces, pac89.stiffness
linear_forces, linear_stiffness = linear.forces, linear.stiffness
mf_forces, mf_stiffness, mf_relaxation = mf61.forces, mf61.stiffness, mf61.relaxation


@register_jitable
def family_forces(p, fz, kappa, tan_alpha, gamma, speed, direction):
    """Forces of the family that the block `p` names; see mjchair.tire.formula."""
    if p[block.FAMILY] == block.PAC89:
        return pac89_forces(p, fz, kappa, tan_alpha, gamma, speed, direction)
    if p[block.FAMILY] >= block.MF52:
        return mf_forces(p, fz, kappa, tan_alpha, gamma, speed, direction)
    return linear_forces(p, fz, kappa, tan_alpha, gamma, speed, direction)


@register_jitable
def family_stiffness(p, fz, gamma, speed):
    """Slopes and peaks of the family that the block `p` names; see mjchair.tire.formula."""
    if p[block.FAMILY] == block.PAC89:
        return pac89_stiffness(p, fz, gamma, speed)
    if p[block.FAMILY] >= block.MF52:
        return mf_stiffness(p, fz, gamma, speed)
    return linear_stiffness(p, fz, gamma, speed)


@register_jitable
def family_relaxation(p, fz, c_kappa, c_alpha):
    """Relaxation lengths (m) along and across: the block's, or the family's own where that is 0."""
    x, y = p[block.RELAXATION_X], p[block.RELAXATION_Y]
    if p[block.FAMILY] >= block.MF52 and (x == 0.0 or y == 0.0):
        own_x, own_y = mf_relaxation(p, fz, c_kappa, c_alpha)
        x = own_x if x == 0.0 else x
        y = own_y if y == 0.0 else y
    return x, y


@register_jitable
def relaxation(p, fz, gamma):
    """Relaxation lengths (m) along and across at this load, for whoever has no stiffness yet."""
    if p[block.RELAXATION_X] > 0.0 and p[block.RELAXATION_Y] > 0.0:
        return p[block.RELAXATION_X], p[block.RELAXATION_Y]
    c_kappa, c_alpha, _, _ = family_stiffness(p, max(fz, 1.0), gamma, 0.0)
    return family_relaxation(p, fz, c_kappa, c_alpha)


@register_jitable
def factors(p, fz):
    """Peak and stiffness factors of the block at this load."""
    share = 1.0
    if p[block.LOAD_EXPONENT] != 0.0:
        share = (fz / p[block.NOMINAL_LOAD]) ** -p[block.LOAD_EXPONENT]
    return p[block.FRICTION_FACTOR] * share, p[block.STIFFNESS_FACTOR] * share


@register_jitable
def steady_forces(p, fz, kappa, tan_alpha, gamma, speed, direction, braked, radius, friction):
    """Steady-state forces and moments of one tire.

    The factors scale the curve by similarity (Pacejka 2006, section 4.2.1): the slip by stiffness
    over peak, the force by the peak.

    Args:
      p: the block of mjchair.tire.block.
      fz: load, N, not negative. kappa: longitudinal slip, 1, positive when driving.
      tan_alpha: Vsy / |Vx|, 1. gamma: camber, rad, about +x. speed: Vx, m/s.
      direction: of rolling, -1 to 1. braked: the same for the rolling moment, which is damped.
      radius: of rolling, m. friction: factor of the road, 1.

    Returns:
      Fx, Fy (N), Mx, My, Mz (N m) on the wheel, ISO-W axes.
    """
    if fz <= 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    peak, slope = factors(p, fz)
    peak *= friction
    stretch = slope / peak
    fx, fy, mx, my, mz = family_forces(
        p, fz, kappa * stretch, tan_alpha * stretch, gamma, speed, direction
    )
    my = (my - p[block.ROLLING_RESISTANCE] * fz * radius) * braked
    return peak * fx, peak * fy, mx, my, peak * mz


@register_jitable
def norm(x, y):
    """Length of a vector; the numbers here are far from overflow, which hypot would guard."""
    return math.sqrt(x * x + y * y)


@register_jitable
def held_slip(u, w, limit_u, limit_w, sigma_x, sigma_y, vx, vsx, vsy, slide_speed):
    """Deflections cut back where the tire slides, so that nothing winds up.

    A deflection may stand for as much slip as slides (three times the knee D/C), or for the
    kinematic slip where that is more. A wheel that slides without rolling has `slide_speed` added
    to its rolling speed. One that rolls, however slowly, has next to nothing added, and up to twice
    its slip allowed: rolling itself brings its deflections back, and a cut that followed every
    tremor of its slip would shake it.
    """
    size = norm(u / limit_u, w / limit_w)
    if size <= 1.0:
        return u, w
    slip = vsx * vsx + vsy * vsy
    sliding = slip / (slip + vx * vx) if slip > 0.0 else 0.0
    rolled = abs(vx) + slide_speed * sliding**4
    if rolled == 0.0:
        return u / size, w / size
    kinematic = norm(vsx * sigma_x / limit_u, vsy * sigma_y / limit_w) / rolled
    allowed = max(1.0, kinematic * (2.0 - sliding))
    return (u * allowed / size, w * allowed / size) if size > allowed else (u, w)


@register_jitable
def step_tire(p, u, w, r, fz, gamma, vx, vsx, vsy, spin, yaw_rate, radius, added, friction, h):
    """One step of one tire: deflections first, then the force from them.

    Args:
      p: the block. u, w, r: longitudinal, lateral and rolling deflection, m.
      fz: load of the last solve, N. gamma: camber, rad.
      vx: speed of the wheel along its heading, m/s. vsx, vsy: slip speed, m/s.
      spin: about the wheel's axis, rad/s. yaw_rate: about the ground's normal, rad/s.
      radius: from centre to contact, m. added: rolling resistance of the road, 1.
      friction: factor of the road, 1. h: step, s.

    Returns:
      u, w, r, kappa, tan_alpha, Fx, Fy, Mx, My, Mz.
    """
    if fz <= 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    c_kappa, c_alpha, d_x, d_y = family_stiffness(p, fz, gamma, vx)
    sigma_x, sigma_y = family_relaxation(p, fz, c_kappa, c_alpha)
    peak, slope = factors(p, fz)
    peak *= friction
    c_kappa, c_alpha, d_x, d_y = c_kappa * slope, c_alpha * slope, d_x * peak, d_y * peak

    new_u = relax(u, vsx, vx, sigma_x, h)
    new_w = relax(w, vsy, vx, sigma_y, h)
    new_u, new_w = held_slip(
        new_u,
        new_w,
        3.0 * sigma_x * d_x / c_kappa,
        3.0 * sigma_y * d_y / c_alpha,
        sigma_x,
        sigma_y,
        vx,
        vsx,
        vsy,
        p[block.SLIDE_SPEED],
    )
    roll_length = p[block.ROLLING_RELAXATION]
    new_r = relax(r, spin * radius, spin * radius, roll_length, h)
    direction = new_r / roll_length

    braked = direction + p[block.ROLLING_DAMPING_TIME] * (new_r - r) / (h * roll_length)
    braked = min(max(braked, -1.0), 1.0)

    kappa, tan_alpha = -new_u / sigma_x, new_w / sigma_y
    fx, fy, mx, my, mz = steady_forces(
        p, fz, kappa, tan_alpha, gamma, vx, direction, braked, radius, friction
    )
    my -= added * fz * radius * braked
    if p[block.TURNING_MOMENT] != 0.0:
        mz -= p[block.TURNING_MOMENT] * math.tanh(yaw_rate / TURNING_RATE)

    damping = p[block.DAMPING_TIME] / h
    total_x = fx - damping * c_kappa / sigma_x * (new_u - u)
    total_y = fy - damping * c_alpha / sigma_y * (new_w - w)
    used = norm(total_x / d_x, total_y / d_y)
    limit = max(norm(fx / d_x, fy / d_y), 1.0)
    if used > limit:
        total_x *= limit / used
        total_y *= limit / used
    return new_u, new_w, new_r, kappa, tan_alpha, total_x, total_y, mx, my, mz
