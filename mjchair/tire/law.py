"""One tire in one time step: its deflections first, then its forces from them.

In: the block of a tire (mjchair.tire.block), its state, its load and its motion over the ground.
Out: the new state, and forces and moments in ISO-W axes.

The law is written once, in plain Python that Numba compiles: the compiled callback, the plain
callback and `Tire.forces` all call these functions. Those that others enter by are marked
`forceinline=False`, or they and all that they call would be compiled once for the callback, which
is inlined, and once more for `Tire.forces`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from numba.extending import register_jitable

from mjchair.tire import block
from mjchair.tire.block import Block
from mjchair.tire.families import REGISTERED, choose_by_number
from mjchair.tire.transient import relax


class Deflection(NamedTuple):
    """The state of a tire: how far its contact patch is displaced, m.

    Attributes:
      longitudinal, lateral: of the carcass. rolling: of the rolling resistance.
    """

    longitudinal: float
    lateral: float
    rolling: float


class Slip(NamedTuple):
    """Slip and inclination of a wheel.

    Attributes:
      kappa: longitudinal slip, 1, positive when driving. tan_alpha: Vsy / |Vx|, 1.
      gamma: camber, rad, about +x.
    """

    kappa: float
    tan_alpha: float
    gamma: float


class Rolling(NamedTuple):
    """How a wheel rolls.

    Attributes:
      speed: Vx, m/s. direction: of rolling, -1 to 1. braked: the same for the rolling moment,
        which is damped. radius: of rolling, m.
    """

    speed: float
    direction: float
    braked: float
    radius: float


class Motion(NamedTuple):
    """Motion of a wheel over the ground.

    Attributes:
      vx: speed of the wheel along its heading, m/s. vsx, vsy: slip speed, m/s.
      spin: about the wheel's axis, rad/s. yaw_rate: about the ground's normal, rad/s.
      radius: from centre to contact, m.
    """

    vx: float
    vsx: float
    vsy: float
    spin: float
    yaw_rate: float
    radius: float


class Road(NamedTuple):
    """What the ground under a wheel changes.

    Attributes:
      rolling_resistance: added to the tire's, 1. friction: factor of the tire's, 1.
    """

    rolling_resistance: float
    friction: float


class TireForce(NamedTuple):
    """Forces (N) and moments (N m) on the wheel, ISO-W axes, without the load."""

    fx: float
    fy: float
    mx: float
    my: float
    mz: float


TURNING_RATE = 0.05  # rad/s, over which the turning moment's sign is smoothed; assumed

# those of the family that a block names; what they take and give: mjchair.tire.formula.family
family_forces = choose_by_number([family.forces for family in REGISTERED])
family_stiffness = choose_by_number([family.stiffness for family in REGISTERED])
formula_relaxation = choose_by_number([family.relaxation for family in REGISTERED])


@register_jitable
def family_relaxation(p: Block, fz: float, c_kappa: float, c_alpha: float) -> tuple[float, float]:
    """Relaxation lengths (m) along and across: the block's, or the family's own where that is 0."""
    x, y = p[block.RELAXATION_X], p[block.RELAXATION_Y]
    if x == 0.0 or y == 0.0:
        own_x, own_y = formula_relaxation(p, fz, c_kappa, c_alpha)
        x = own_x if x == 0.0 else x
        y = own_y if y == 0.0 else y
    return x, y


@register_jitable(forceinline=False)
def relaxation(p: Block, fz: float, gamma: float) -> tuple[float, float]:
    """Relaxation lengths (m) along and across at this load, where the slopes are not yet known."""
    if p[block.RELAXATION_X] > 0.0 and p[block.RELAXATION_Y] > 0.0:
        return p[block.RELAXATION_X], p[block.RELAXATION_Y]
    c_kappa, c_alpha, _, _ = family_stiffness(p, max(fz, 1.0), gamma, 0.0)
    return family_relaxation(p, fz, c_kappa, c_alpha)


@register_jitable
def factors(p: Block, fz: float) -> tuple[float, float]:
    """Peak and stiffness factors of the block at this load."""
    share = 1.0
    if p[block.LOAD_EXPONENT] != 0.0:
        share = (fz / p[block.NOMINAL_LOAD]) ** -p[block.LOAD_EXPONENT]
    return p[block.FRICTION_FACTOR] * share, p[block.STIFFNESS_FACTOR] * share


@register_jitable
def along(p: Block) -> float:
    """Factor of the slip stiffness along the heading; blocks of older models have none."""
    factor = p[block.LONGITUDINAL_FACTOR]
    return factor if factor > 0.0 else 1.0


@register_jitable(forceinline=False)
def steady_forces(p: Block, fz: float, slip: Slip, rolling: Rolling, friction: float) -> TireForce:
    """Steady-state forces and moments of one tire.

    The factors scale the curve by similarity (Pacejka 2006, section 4.2.1): the slip by stiffness
    over peak, the force by the peak.

    Args:
      p: the block of mjchair.tire.block. fz: load, N, not negative. friction: factor of the
        road, 1.
    """
    if fz <= 0.0:
        return TireForce(0.0, 0.0, 0.0, 0.0, 0.0)
    peak, slope = factors(p, fz)
    peak *= friction
    stretch = slope / peak
    fx, fy, mx, my, mz = family_forces(
        p,
        fz,
        slip.kappa * stretch * along(p),
        slip.tan_alpha * stretch,
        slip.gamma,
        rolling.speed,
        rolling.direction,
    )
    my = (my - p[block.ROLLING_RESISTANCE] * fz * rolling.radius) * rolling.braked
    return TireForce(peak * fx, peak * fy, mx, my, peak * mz)


@register_jitable
def norm(x: float, y: float) -> float:
    """Length of a vector; the numbers here are far from overflow, which hypot would guard."""
    return math.sqrt(x * x + y * y)


@register_jitable
def limit_deflections(
    u: float,
    w: float,
    limits: tuple[float, float],
    sigma: tuple[float, float],
    motion: Motion,
    slide_speed: float,
) -> tuple[float, float]:
    """Limit the deflections of a tire that slides, so that they do not grow while it slides.

    A deflection may reach the slip of full sliding, or the kinematic slip where that is larger. A
    wheel that rolls may have up to twice its kinematic slip: rolling itself reduces its
    deflections, and a limit that follows every small change of the slip makes the wheel vibrate.

    Args:
      u, w: deflections along and across, m. limits: the two deflections at full sliding, m: three
        times peak over stiffness (3 D/C), times the relaxation length.
      sigma: the two relaxation lengths, m. motion: of the wheel. slide_speed: m/s, added to the
        rolling speed of a wheel that slides without rolling; where it rolls, however slowly,
        almost nothing is added.

    Returns:
      The limited deflections, m.
    """
    size = norm(u / limits[0], w / limits[1])
    if size <= 1.0:
        return u, w
    vx, vsx, vsy = motion.vx, motion.vsx, motion.vsy
    slip = vsx * vsx + vsy * vsy
    sliding = slip / (slip + vx * vx) if slip > 0.0 else 0.0
    rolled = abs(vx) + slide_speed * sliding**4
    if rolled == 0.0:
        return u / size, w / size
    kinematic = norm(vsx * sigma[0] / limits[0], vsy * sigma[1] / limits[1]) / rolled
    allowed = max(1.0, kinematic * (2.0 - sliding))
    return (u * allowed / size, w * allowed / size) if size > allowed else (u, w)


@register_jitable(forceinline=False)
def step_tire(
    p: Block, old: Deflection, fz: float, gamma: float, motion: Motion, road: Road, h: float
) -> tuple[Deflection, Slip, TireForce]:
    """One step of one tire: deflections first, then the force from them.

    Args:
      p: the block. old: the deflection before the step. fz: load of the last solve, N.
      gamma: camber, rad. motion: of the wheel. road: under it. h: step, s.

    Returns:
      The new deflection, the slip it stands for, and the force.
    """
    if fz <= 0.0:
        return (
            Deflection(0.0, 0.0, 0.0),
            Slip(0.0, 0.0, 0.0),
            TireForce(0.0, 0.0, 0.0, 0.0, 0.0),
        )
    vx, radius = motion.vx, motion.radius
    c_kappa, c_alpha, d_x, d_y = family_stiffness(p, fz, gamma, vx)
    sigma_x, sigma_y = family_relaxation(p, fz, c_kappa, c_alpha)
    peak, slope = factors(p, fz)
    peak *= road.friction
    c_kappa, c_alpha = c_kappa * slope * along(p), c_alpha * slope
    d_x, d_y = d_x * peak, d_y * peak

    u, w = limit_deflections(
        relax(old.longitudinal, motion.vsx, vx, sigma_x, h),
        relax(old.lateral, motion.vsy, vx, sigma_y, h),
        (3.0 * sigma_x * d_x / c_kappa, 3.0 * sigma_y * d_y / c_alpha),
        (sigma_x, sigma_y),
        motion,
        p[block.SLIDE_SPEED],
    )
    roll_length = p[block.ROLLING_RELAXATION]
    r = relax(old.rolling, motion.spin * radius, motion.spin * radius, roll_length, h)
    direction = r / roll_length

    braked = direction + p[block.ROLLING_DAMPING_TIME] * (r - old.rolling) / (h * roll_length)
    braked = min(max(braked, -1.0), 1.0)

    slip = Slip(-u / sigma_x, w / sigma_y, gamma)
    fx, fy, mx, my, mz = steady_forces(
        p, fz, slip, Rolling(vx, direction, braked, radius), road.friction
    )
    my -= road.rolling_resistance * fz * radius * braked
    if p[block.TURNING_MOMENT] != 0.0:
        rate = p[block.TURNING_RATE] or TURNING_RATE
        mz -= p[block.TURNING_MOMENT] * math.tanh(motion.yaw_rate / rate)

    damping = p[block.DAMPING_TIME] / h
    total_x = fx - damping * c_kappa / sigma_x * (u - old.longitudinal)
    total_y = fy - damping * c_alpha / sigma_y * (w - old.lateral)
    used = norm(total_x / d_x, total_y / d_y)
    limit = max(norm(fx / d_x, fy / d_y), 1.0)
    if used > limit:
        total_x *= limit / used
        total_y *= limit / used
    return Deflection(u, w, r), slip, TireForce(total_x, total_y, mx, my, mz)
