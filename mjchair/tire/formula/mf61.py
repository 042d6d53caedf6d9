"""Magic Formula 6.1 and 6.2, and 5.2 where it differs: pure and combined slip, all five moments.

In: the block of a tire, load, slips, camber and speed. Out: forces and slopes; the two families at
the end.

Pacejka, Tyre and Vehicle Dynamics, 2nd ed. (2006), section 4.3.2, equations (4.E1)-(4.E78), with
alpha* = tan(alpha) and without turn slip. Where the book's moments differ from the tire codes in
use, those of Besselink, Schmeitz & Pacejka, "An improved Magic Formula/Swift tyre model that can
handle inflation pressure changes" (2010) are taken: their (A54)-(A60) for the trail, (A48)
for My, and the draft's (49) for Mx. 6.2 has the forces of 6.1 (it differs in the vertical). 5.2
differs in the lateral shift, the lateral force that the trail acts on, My and relaxation, and
takes camber as the angle (in radians) where 6.1 takes its sine.

What is done beyond the equations, and why:

- Load, slips and camber are held to the ranges of the file, as trusted codes do. Below FZMIN the
  equations are simply used: they vanish with the load. Curvature factors stay at 1 or less, and
  peaks and stiffnesses keep their sign.
- A file without coefficients of combined slip has its forces held to the friction ellipse.
- Every moment of the formula is in proportion to the radius, so on a wheel of another radius than
  the file's they are scaled to it.
- There is no low-speed branch: the tire's deflections carry standstill. Instead the shifts that
  come of ply steer and rolling (SHx, SVx, SHy, SVy without camber) follow the direction of
  rolling, which passes through 0 smoothly at standstill; camber thrust does not turn with it.
- cos(atan(x)) is written 1/sqrt(1 + x^2), and sin(2 atan(x)) 2x/(1 + x^2).
"""

from __future__ import annotations

import math
from functools import partial

from numba.extending import register_jitable

from mjchair.tire.block import FAMILY, RADIUS, Block
from mjchair.tire.formula.family import Family
from mjchair.tire.formula.mf_constants import AT, run_constants
from mjchair.tire.formula.mf_names import NAMES_52, NAMES_61, ODD, ODD_RANGES

NUMBER_52, NUMBER_61 = 3, 4  # of the families, in a block
BELT_FRICTION = 5.0  # peak force over load: racing tires on test belts pass 3; an assumption

SHORTEST_RELAXATION = 0.3  # of the radius: a shorter one is too stiff for a light wheel at 2 ms
ASSUMED_RELAXATION = 0.5  # of the radius, where the file gives neither; an assumption


@register_jitable
def clamp(x: float, low: float, high: float) -> float:
    """`x`, held within `low` to `high`."""
    return min(max(x, low), high)


@register_jitable
def keep_sign(change: float, nominal: float) -> float:
    """nominal + change, which keeps the sign of `nominal`: at least a twentieth of it is left.

    Far from the nominal load, or at great camber, the linear terms of the formula would do it.
    """
    least = 0.05 * nominal
    return max(nominal + change, least) if nominal > 0.0 else min(nominal + change, least)


@register_jitable
def sign(x: float) -> float:
    """1 or -1; 1 at 0."""
    return -1.0 if x < 0.0 else 1.0


@register_jitable
def sine_curve(x: float, b: float, c: float, e: float) -> float:
    """sin(C atan(Bx - E (Bx - atan Bx))), the Magic Formula over its peak."""
    bx = b * x
    return math.sin(c * math.atan(bx - e * (bx - math.atan(bx))))


@register_jitable
def cosine_curve(x: float, b: float, c: float, e: float) -> float:
    """cos(C atan(Bx - E (Bx - atan Bx))), the shape of trail and of combined slip."""
    bx = b * x
    return math.cos(c * math.atan(bx - e * (bx - math.atan(bx))))


@register_jitable
def combined_factor(x: float, shift: float, b: float, c: float, e: float) -> float:
    """What combined slip leaves of a force: `cosine_curve` at x + shift over that at the shift."""
    if b == 0.0 or c == 0.0:
        return 1.0
    if shift == 0.0:
        return cosine_curve(x, b, c, e)
    return cosine_curve(x + shift, b, c, e) / cosine_curve(shift, b, c, e)


@register_jitable
def camber_of(p: Block, gamma: float) -> float:
    """What the equations take for camber: sin(gamma), (4.E4); of 5.2 the angle gamma, rad."""
    return gamma if p[FAMILY] == NUMBER_52 else math.sin(gamma)


@register_jitable
def slip_stiffness(p: Block, fz: float, dfz: float) -> float:
    """Kxk (N), (4.E15)."""
    return fz * keep_sign(p[AT.KX2] * dfz, p[AT.KX1]) * math.exp(p[AT.KX3] * dfz)


@register_jitable
def cornering_stiffness(p: Block, fz: float, camber: float) -> float:
    """Kya (N/rad), with the formula's own sign, (4.E25). camber: `camber_of`."""
    x = fz / (p[AT.F0] * keep_sign(p[AT.KY5] * camber * camber, p[AT.KY2]))
    c = p[AT.KY4]
    peak = 2.0 * x / (1.0 + x * x) if c == 2.0 else math.sin(c * math.atan(x))
    return p[AT.KY1] * keep_sign(-p[AT.KY3] * abs(camber), 1.0) * peak


@register_jitable
def friction_x(p: Block, dfz: float, gamma: float) -> float:
    """Longitudinal peak friction, (4.E13)."""
    return keep_sign(p[AT.MUX2] * dfz, p[AT.MUX1]) * keep_sign(-p[AT.MUX3] * gamma * gamma, 1.0)


@register_jitable
def friction_y(p: Block, dfz: float, camber: float) -> float:
    """Lateral peak friction, with the formula's own sign, (4.E23)."""
    return keep_sign(p[AT.MUY2] * dfz, p[AT.MUY1]) * keep_sign(-p[AT.MUY3] * camber * camber, 1.0)


@register_jitable
def pure_fx(
    p: Block, fz: float, dfz: float, kappa: float, gamma: float, kxk: float, direction: float
) -> float:
    """Fx0 (N), (4.E9)-(4.E18)."""
    d = friction_x(p, dfz, gamma) * fz
    if d == 0.0:
        return 0.0
    x = kappa + direction * (p[AT.HX1] + p[AT.HX2] * dfz)
    e = (p[AT.EX1] + p[AT.EX2] * dfz + p[AT.EX3] * dfz * dfz) * (1.0 - p[AT.EX4] * sign(x))
    shift = direction * fz * (p[AT.VX1] + p[AT.VX2] * dfz)
    return d * sine_curve(x, kxk / (p[AT.CX] * d), p[AT.CX], min(e, 1.0)) + shift


@register_jitable
def shifts_y(
    p: Block, fz: float, dfz: float, camber: float, kya: float, direction: float
) -> tuple[float, float]:
    """SHy (1) and SVy (N), (4.E27)-(4.E30); 5.2 shifts by PHY3 instead of by (4.E30)."""
    camber_force = fz * (p[AT.VY3] + p[AT.VY4] * dfz) * camber
    if p[FAMILY] == NUMBER_52:
        camber_slip = p[AT.HY3] * camber
    elif kya == 0.0:
        camber_slip = 0.0
    else:
        camber_slip = (fz * (p[AT.KYG1] + p[AT.KYG2] * dfz) * camber - camber_force) / kya
    sh = direction * (p[AT.HY1] + p[AT.HY2] * dfz) + camber_slip
    sv = direction * fz * (p[AT.VY1] + p[AT.VY2] * dfz) + camber_force
    return sh, sv


@register_jitable
def pure_fy(
    p: Block,
    fz: float,
    dfz: float,
    slip: float,
    camber: float,
    kya: float,
    sh: float,
    sv: float,
    direction: float,
) -> float:
    """Fy0 (N), (4.E19)-(4.E26)."""
    d = friction_y(p, dfz, camber) * fz
    if d == 0.0:
        return 0.0
    y = slip + sh
    skew = (p[AT.EY3] * direction + p[AT.EY4] * camber) * sign(y)
    e = (p[AT.EY1] + p[AT.EY2] * dfz) * (1.0 + p[AT.EY5] * camber * camber - skew)
    return d * sine_curve(y, kya / (p[AT.CY] * d), p[AT.CY], min(e, 1.0)) + sv


@register_jitable
def combined_factor_x(
    p: Block, dfz: float, kappa: float, slip: float, camber: float, direction: float
) -> float:
    """Gxa, what side slip leaves of Fx, (4.E51)-(4.E57)."""
    turn = p[AT.BXA_K] * kappa
    b = (p[AT.BXA] + p[AT.BXA_G] * camber * camber) / math.sqrt(1.0 + turn * turn)
    e = min(p[AT.EXA1] + p[AT.EXA2] * dfz, 1.0)
    return combined_factor(slip, direction * p[AT.HXA], b, p[AT.CXA], e)


@register_jitable
def combined_factor_y(p: Block, dfz: float, kappa: float, slip: float, camber: float) -> float:
    """Gyk, what longitudinal slip leaves of Fy, (4.E59)-(4.E65)."""
    turn = p[AT.BYK_A] * (slip - p[AT.BYK_0])
    b = (p[AT.BYK] + p[AT.BYK_G] * camber * camber) / math.sqrt(1.0 + turn * turn)
    e = min(p[AT.EYK1] + p[AT.EYK2] * dfz, 1.0)
    return combined_factor(kappa, p[AT.HYK1] + p[AT.HYK2] * dfz, b, p[AT.CYK], e)


@register_jitable
def induced_fy(p: Block, fz: float, dfz: float, kappa: float, slip: float, camber: float) -> float:
    """SVyk (N), the side force that longitudinal slip brings, (4.E66)-(4.E67)."""
    size = p[AT.RVY1] + p[AT.RVY2] * dfz + p[AT.RVY3] * camber
    if kappa == 0.0 or size == 0.0:
        return 0.0
    turn = p[AT.RVY4] * slip
    d = friction_y(p, dfz, camber) * fz * size / math.sqrt(1.0 + turn * turn)
    return d * math.sin(p[AT.RVY5] * math.atan(p[AT.RVY6] * kappa))


@register_jitable
def equivalent_slip(slip: float, stretch: float) -> float:
    """The side slip that stands for combined slip in the moments, (A54) and (A55).

    Beyond 1.4 the tangent would run away and then turn round; from there on it is left out.

    Args:
      slip: with its shift. stretch: (Kxk kappa / Kya)^2.
    """
    if stretch == 0.0:
        return slip
    held = min(abs(slip), 1.4)
    joint = math.atan(math.sqrt(math.tan(held) ** 2 + stretch))
    return (joint + abs(slip) - held) * sign(slip)


@register_jitable
def trail(
    p: Block, fz: float, dfz: float, slip: float, gamma: float, camber: float, stretch: float
) -> float:
    """Pneumatic trail (m) over cos(alpha), (4.E33)-(4.E35), (4.E73), (A58), (A60).

    stretch: (Kxk kappa / Kya)^2, what longitudinal slip adds to the square of the slip.
    """
    x = slip + p[AT.HT1] + p[AT.HT2] * dfz + (p[AT.HT3] + p[AT.HT4] * dfz) * camber
    size = abs(gamma)
    b = (p[AT.BT1] + p[AT.BT2] * dfz + p[AT.BT3] * dfz * dfz) * (
        1.0 + p[AT.BT4] * gamma + p[AT.BT5] * size + p[AT.BT6] * gamma * gamma
    )
    d = fz * (p[AT.DT1] + p[AT.DT2] * dfz) * (1.0 + p[AT.DT3] * gamma + p[AT.DT4] * gamma * gamma)
    e = p[AT.ET1] + p[AT.ET2] * dfz + p[AT.ET3] * dfz * dfz
    skew = p[AT.ET4] + p[AT.ET5] * camber
    if e != 0.0 and skew != 0.0:
        e *= 1.0 + skew * (2.0 / math.pi) * math.atan(b * p[AT.CT] * x)
    return d * cosine_curve(equivalent_slip(x, stretch), b, p[AT.CT], min(e, 1.0))


@register_jitable
def residual_mz(
    p: Block,
    fz: float,
    dfz: float,
    slip: float,
    camber: float,
    kya: float,
    sh: float,
    sv: float,
    stretch: float,
) -> float:
    """Residual moment Mzr (N m) over cos(alpha), (4.E36)-(4.E38), (4.E45)-(4.E47), (4.E75)."""
    d = p[AT.DR6] + p[AT.DR7] * dfz + (p[AT.DR8] + p[AT.DR9] * dfz) * camber
    d += (p[AT.DR10] + p[AT.DR11] * dfz) * camber * abs(camber)
    if d == 0.0:
        return 0.0
    x = slip + sh + (sv / kya if kya != 0.0 else 0.0)
    b = p[AT.BR9]
    if p[AT.BR10] != 0.0:
        dy = friction_y(p, dfz, camber) * fz
        b += p[AT.BR10] * (kya / dy if dy != 0.0 else 0.0)
    bx = b * equivalent_slip(x, stretch)
    return d * fz / math.sqrt(1.0 + bx * bx)


@register_jitable
def within_ellipse(
    fx: float, fy: float, zero_slip_x: float, zero_slip_y: float, d_x: float, d_y: float
) -> tuple[float, float]:
    """Both forces cut to the friction ellipse, but neither alone to less than it was.

    The force at zero slip (zero_slip_x, zero_slip_y, N: shifts and camber) is not counted, so
    that pure slip keeps its curve.
    """
    if d_x == 0.0 or d_y == 0.0:
        return fx, fy
    slip_x, slip_y = fx - zero_slip_x, fy - zero_slip_y
    x, y = abs(slip_x / d_x), abs(slip_y / d_y)
    if x == 0.0 or y == 0.0:
        return fx, fy
    cut = max(1.0, x, y) / max(1.0, math.hypot(x, y), x, y)
    return zero_slip_x + slip_x * cut, zero_slip_y + slip_y * cut


@register_jitable
def overturning(p: Block, fz: float, fy: float, gamma: float) -> float:
    """Mx (N m), (49) of the draft of Besselink, Schmeitz & Pacejka (2010)."""
    m = p[AT.X1] - p[AT.X2] * gamma + p[AT.X3] * fy - p[AT.X12] * gamma * abs(gamma)
    if p[AT.X4] != 0.0:
        square = (p[AT.X6] * fz) ** 2
        wave = math.sin(p[AT.X7] * gamma + p[AT.X8] * math.atan(p[AT.X9] * fy))
        m += p[AT.X4] * math.cos(p[AT.X5] * math.atan(square)) * wave
    if p[AT.X10] != 0.0:
        m += p[AT.X10] * math.atan(p[AT.X11] * fz) * gamma
    return fz * m + fy * (p[AT.X13] + p[AT.X14] * abs(gamma))


@register_jitable
def rolling(p: Block, fz: float, fx: float, gamma: float, speed: float) -> float:
    """My (N m) of a wheel that rolls forward, hence negative, (A48)."""
    load = fz * p[AT.LFZ]
    m = p[AT.Y1] + p[AT.Y2] * fx + p[AT.Y3] * abs(speed)
    if p[AT.Y4] != 0.0:
        m += p[AT.Y4] * speed**4
    m += (p[AT.Y5] + p[AT.Y6] * fz) * gamma * gamma
    if p[AT.Y7] == 1.0:
        return -m * load
    return -m * load ** p[AT.Y7]


@register_jitable
def forces(
    p: Block,
    fz: float,
    kappa: float,
    tan_alpha: float,
    gamma: float,
    speed: float,
    direction: float,
) -> tuple[float, float, float, float, float]:
    """Steady-state forces and moments; see mjchair.tire.formula.family."""
    fz = min(fz, p[AT.FZ_MAX])
    kappa = clamp(kappa, p[AT.KAPPA_MIN], p[AT.KAPPA_MAX])
    slip = clamp(tan_alpha, p[AT.TAN_MIN], p[AT.TAN_MAX])
    gamma = clamp(gamma, p[AT.GAMMA_MIN], p[AT.GAMMA_MAX])
    dfz = fz / p[AT.F0] - 1.0
    camber = camber_of(p, gamma)
    kxk = slip_stiffness(p, fz, dfz)
    kya = cornering_stiffness(p, fz, camber)
    sh, sv = shifts_y(p, fz, dfz, camber, kya, direction)

    fx0 = pure_fx(p, fz, dfz, kappa, gamma, kxk, direction)
    fy0 = pure_fy(p, fz, dfz, slip, camber, kya, sh, sv, direction)
    factor_y = combined_factor_y(p, dfz, kappa, slip, camber)
    induced = induced_fy(p, fz, dfz, kappa, slip, camber)
    fx = combined_factor_x(p, dfz, kappa, slip, camber, direction) * fx0
    fy = factor_y * fy0 + induced
    if p[AT.BXA] == 0.0 and p[AT.BYK] == 0.0:
        zero_slip_x = pure_fx(p, fz, dfz, 0.0, gamma, kxk, direction)
        zero_slip_y = pure_fy(p, fz, dfz, 0.0, camber, kya, sh, sv, direction)
        d_x, d_y = friction_x(p, dfz, gamma) * fz, friction_y(p, dfz, camber) * fz
        fx, fy = within_ellipse(fx, fy, zero_slip_x, zero_slip_y, d_x, d_y)

    stretch = (kxk * kappa / kya) ** 2 if kya != 0.0 else 0.0
    upright = fy0
    if (
        p[FAMILY] != NUMBER_52 and camber != 0.0
    ):  # (4.E74): the trail acts on the force of no camber
        k0 = cornering_stiffness(p, fz, 0.0)
        sh0, sv0 = shifts_y(p, fz, dfz, 0.0, k0, direction)
        upright = pure_fy(p, fz, dfz, slip, 0.0, k0, sh0, sv0, direction)
    cosine = 1.0 / math.sqrt(1.0 + tan_alpha * tan_alpha)
    mz = -trail(p, fz, dfz, slip, gamma, camber, stretch) * factor_y * upright
    mz += residual_mz(p, fz, dfz, slip, camber, kya, sh, sv, stretch)
    arm = p[AT.S1] + p[AT.S2] * fy + (p[AT.S3] + p[AT.S4] * dfz) * gamma
    mz = mz * cosine * direction + arm * fx
    mx, my = overturning(p, fz, fy, gamma), rolling(p, fz, fx, gamma, speed)
    size = p[RADIUS] / p[AT.R0]
    return fx, fy, size * mx, size * my, size * mz


@register_jitable
def stiffness(p: Block, fz: float, gamma: float, speed: float) -> tuple[float, float, float, float]:
    """Slopes at zero slip and peaks; see mjchair.tire.formula.family."""
    fz = min(fz, p[AT.FZ_MAX])
    gamma = clamp(gamma, p[AT.GAMMA_MIN], p[AT.GAMMA_MAX])
    dfz = fz / p[AT.F0] - 1.0
    camber = camber_of(p, gamma)
    d_x = abs(friction_x(p, dfz, gamma)) * fz
    d_y = abs(friction_y(p, dfz, camber)) * fz
    c_kappa = abs(slip_stiffness(p, fz, dfz))
    c_alpha = abs(cornering_stiffness(p, fz, camber))
    least = 1e-3 * fz  # a coefficient that passes through zero must not divide by it
    return max(c_kappa, least), max(c_alpha, least), max(d_x, least), max(d_y, least)


@register_jitable
def relaxation(p: Block, fz: float, c_kappa: float, c_alpha: float) -> tuple[float, float]:
    """Relaxation lengths (m) along and across of the file.

    6.1: slip stiffness over carcass stiffness ((17)-(19) of Besselink, Schmeitz & Pacejka 2010).
    5.2: PTX, PTY; what camber takes off the lateral one is left out.
    """
    fz = min(fz, p[AT.FZ_MAX])
    dfz = fz / p[AT.F0] - 1.0
    if p[FAMILY] == NUMBER_52:
        x = fz * (p[AT.SX1] + p[AT.SX2] * dfz) * math.exp(-p[AT.SX3] * dfz)
        load = fz / p[AT.SY2] if p[AT.SY2] != 0.0 else 0.0
        y = p[AT.SY1] * 2.0 * load / (1.0 + load * load)
    else:
        carcass_x = p[AT.SX1] + (p[AT.SX2] + p[AT.SX3] * dfz) * dfz
        carcass_y = p[AT.SY1] + (p[AT.SY2] + p[AT.SY3] * dfz) * dfz
        x = c_kappa / carcass_x if carcass_x > 0.0 else 0.0
        y = c_alpha / carcass_y if carcass_y > 0.0 else 0.0
    x = ASSUMED_RELAXATION * p[AT.R0] if p[AT.SX1] == 0.0 else abs(x)
    y = ASSUMED_RELAXATION * p[AT.R0] if p[AT.SY1] == 0.0 else abs(y)
    return max(x, SHORTEST_RELAXATION * p[AT.R0]), max(y, SHORTEST_RELAXATION * p[AT.R0])


MF52 = Family(
    number=NUMBER_52,
    name="mf52",
    coefficients=NAMES_52,
    forces=forces,
    stiffness=stiffness,
    relaxation=relaxation,
    pack=partial(run_constants, version_52=True),
    largest_friction=BELT_FRICTION,
    slopes=("PKX1", "PKY1"),
    odd=ODD,
    odd_ranges=ODD_RANGES,
)
MF61 = Family(
    number=NUMBER_61,
    name="mf61",
    coefficients=NAMES_61,
    forces=forces,
    stiffness=stiffness,
    relaxation=relaxation,
    pack=partial(run_constants, version_52=False),
    largest_friction=BELT_FRICTION,
    slopes=("PKX1", "PKY1"),
    odd=ODD,
    odd_ranges=ODD_RANGES,
)
