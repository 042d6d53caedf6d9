"""The 1989 Magic Formula (Bakker, Pacejka, Lidner, SAE 890087), and the paper's part of it.

In: the block of a tire, load and slips. Out: forces and slopes; the family at the end.

Coefficients stay as published: loads in the unit of the list (N or kN), slip angles and camber in
degrees, longitudinal slip in percent, forces in N, moments in N m. The published angle has the
opposite force sign to ISO-W, which is converted here, once: Fy and Mz change sign.

Combined slip is not in the 1989 formula. It is joined by the similarity method with the friction
ellipse as its limit (Pacejka, Tyre and Vehicle Dynamics, 2nd ed., section 4.2): each slip
is normalised by its own stiffness over peak, and the resultant points against the slip. The
horizontal shifts are no slip: they move the curves and take no part in combining them, so that
pure slip gives the published curve whatever the shifts are.
"""

from __future__ import annotations

import math

from numba.extending import register_jitable

from mjchair.tire.block import HEADER, PNEUMATIC_TRAIL, Block
from mjchair.tire.formula.family import Family
from mjchair.tire.formula.magic import brush_trail, magic_formula

# coefficients after the header
LOAD_UNIT = HEADER  # N in one unit of load of the list: 1 or 1000
HAS_B = HEADER + 1  # 0: the longitudinal curve is the lateral one (isotropy)
HAS_C = HEADER + 2  # 0: the aligning moment is the pneumatic trail's
A = HEADER + 3  # a0..a13
B = A + 14  # b0..b10
C = B + 11  # c0..c17

DEGREE = 180.0 / math.pi


@register_jitable
def shape_factor(a0: float) -> float:
    """C, equation (9) of the paper: C = a0, the same at every load."""
    return a0


@register_jitable
def peak(mu: float, fz: float) -> float:
    """D (N), equation (10): D = mu Fz. mu: N per unit of load of the list."""
    return mu * fz


@register_jitable
def peak_friction(a1: float, a2: float, fz: float) -> float:
    """mu (N per unit of load), equation (11): mu = a1 Fz + a2."""
    return a1 * fz + a2


@register_jitable
def curvature(a6: float, a7: float, fz: float) -> float:
    """E, equation (12): E = a6 Fz + a7."""
    return a6 * fz + a7


@register_jitable
def slope(a3: float, a4: float, a5: float, fz: float, gamma: float) -> float:
    """BCD (N/deg), equation (13): a3 sin(2 atan(Fz / a4)) (1 - a5 |gamma|), gamma in deg.

    Printed without the second bar of |gamma|. Without either bar, the same tire leant to the other
    side would be stiffer. sin(2 atan x) is written as 2 x / (1 + x^2), which it equals.
    """
    return a3 * 2.0 * fz * a4 / (fz * fz + a4 * a4) * (1.0 - a5 * abs(gamma))


@register_jitable
def horizontal_shift(a8: float, a9: float, a10: float, fz: float, gamma: float) -> float:
    """Sh (deg), equation (14): Sh = a8 gamma + a9 Fz + a10."""
    return a8 * gamma + a9 * fz + a10


@register_jitable
def vertical_shift(a11: float, a12: float, a13: float, fz: float, gamma: float) -> float:
    """Sv (N), equation (15): Sv = a11 gamma Fz + a12 Fz + a13."""
    return a11 * gamma * fz + a12 * fz + a13


@register_jitable
def lateral(p: Block, fz: float, gamma: float) -> tuple[float, float, float, float, float, float]:
    """C, D, E, BCD (N/deg), Sh (deg), Sv (N): equations (9)-(15) of the paper.

    Args:
      p: the block. fz: load, in the unit of the list. gamma: camber, deg.
    """
    return (
        shape_factor(p[A]),
        peak(peak_friction(p[A + 1], p[A + 2], fz), fz),
        curvature(p[A + 6], p[A + 7], fz),
        slope(p[A + 3], p[A + 4], p[A + 5], fz, gamma),
        horizontal_shift(p[A + 8], p[A + 9], p[A + 10], fz, gamma),
        vertical_shift(p[A + 11], p[A + 12], p[A + 13], fz, gamma),
    )


@register_jitable
def longitudinal(p: Block, fz: float) -> tuple[float, float, float, float, float]:
    """C, D, E, BCD (N/%), Sh (%) of the longitudinal curve; load in the unit of the list."""
    if p[HAS_B] == 0.0:
        c, d, e, bcd, _, _ = lateral(p, fz, 0.0)
        return c, d, e, bcd * DEGREE / 100.0, 0.0
    d = (p[B + 1] * fz + p[B + 2]) * fz
    bcd = (p[B + 3] * fz + p[B + 4]) * fz * math.exp(-p[B + 5] * fz)
    e = (p[B + 6] * fz + p[B + 7]) * fz + p[B + 8]
    return p[B], d, e, bcd, p[B + 9] * fz + p[B + 10]


@register_jitable
def aligning(p: Block, fz: float, gamma: float) -> tuple[float, float, float, float, float, float]:
    """C, D, E, BCD (N m/deg), Sh (deg), Sv (N m) of the aligning moment, as published."""
    d = (p[C + 1] * fz + p[C + 2]) * fz
    camber = 1.0 - p[C + 6] * abs(gamma)
    bcd = (p[C + 3] * fz + p[C + 4]) * fz * camber * math.exp(-p[C + 5] * fz)
    e = ((p[C + 7] * fz + p[C + 8]) * fz + p[C + 9]) * (1.0 - p[C + 10] * abs(gamma))
    sh = p[C + 11] * gamma + p[C + 12] * fz + p[C + 13]
    sv = (p[C + 14] * fz + p[C + 15]) * fz * gamma + p[C + 16] * fz + p[C + 17]
    return p[C], d, e, bcd, sh, sv


@register_jitable
def slope_factor(bcd: float, c: float, d: float) -> float:
    """B = BCD / (C D), zero where the peak is."""
    return bcd / (c * d) if c * d != 0.0 else 0.0


@register_jitable
def combined_curve(
    x: float,
    shift: float,
    share: float,
    b: float,
    c: float,
    d: float,
    e: float,
    vertical: float,
    fade: float,
) -> float:
    """A pure curve D sin(C atan(...)) of x + shift, plus `vertical`, in combined slip.

    Of what the slip makes, `share` is left; what is there without slip, through the shifts,
    is divided by `fade`. With `share` and `fade` of 1 it is the published curve.
    """
    if shift == 0.0:
        return share * magic_formula(x, b, c, d, e) + vertical / fade
    at_zero_slip = magic_formula(shift, b, c, d, e)
    if share == 1.0 and fade == 1.0:
        return magic_formula(x + shift, b, c, d, e) + vertical
    change = magic_formula(x + shift, b, c, d, e) - at_zero_slip
    return share * change + (at_zero_slip + vertical) / fade


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
    """Steady-state forces and moments; see mjchair.tire.formula.family. `speed` is not used."""
    load = fz / p[LOAD_UNIT]
    camber = gamma * DEGREE
    cy, dy, ey, ky, shy, sv = lateral(p, load, camber)
    cx, dx, ex, kx, shx = longitudinal(p, load)
    by = slope_factor(ky, cy, dy)
    bx = slope_factor(kx, cx, dx)
    x = 100.0 * kappa
    if p[HAS_B] == 0.0:  # the lateral curve, read at the angle whose tangent is the slip
        x = 100.0 * math.atan(kappa)
    y = DEGREE * math.atan(tan_alpha)

    # the shifts are no slip: they move the curves, and take no part in combining them
    rho_x = kx * x / dx if dx > 0.0 else 0.0
    rho_y = ky * y / dy if dy > 0.0 else 0.0
    rho = math.sqrt(rho_x * rho_x + rho_y * rho_y)
    share_x, share_y = 1.0, 1.0
    if rho_x != 0.0 and rho_y != 0.0 and kx > 0.0 and ky > 0.0:
        share_x, share_y = abs(rho_x) / rho, abs(rho_y) / rho
        x, y = math.copysign(rho * dx / kx, x), math.copysign(rho * dy / ky, y)
    fade_x = math.sqrt(1.0 + rho_y * rho_y)  # of what is there without longitudinal slip
    fade_y = math.sqrt(1.0 + rho_x * rho_x)
    fx = combined_curve(x, shx, share_x, bx, cx, dx, ex, 0.0, fade_x)
    fy = combined_curve(y, shy, share_y, by, cy, dy, ey, sv, fade_y)

    if p[HAS_C] == 0.0:
        mz = brush_trail(p[PNEUMATIC_TRAIL], rho) * fy
    else:
        cz, dz, ez, kz, shz, svz = aligning(p, load, camber)
        mz = -combined_curve(y, shz, share_y, slope_factor(kz, cz, dz), cz, dz, ez, svz, fade_y)
    return fx, -fy, 0.0, 0.0, mz * direction


@register_jitable
def stiffness(p: Block, fz: float, gamma: float, speed: float) -> tuple[float, float, float, float]:
    """Slopes at zero slip and peaks; see mjchair.tire.formula.family."""
    load = fz / p[LOAD_UNIT]
    _, dy, _, ky, _, _ = lateral(p, load, gamma * DEGREE)
    _, dx, _, kx, _ = longitudinal(p, load)
    return abs(kx) * 100.0, abs(ky) * DEGREE, abs(dx), abs(dy)


PAC89 = Family(
    number=2,
    name="pac89",
    coefficients=(
        "load_unit",
        "has_b",
        "has_c",
        *(f"a{i}" for i in range(14)),
        *(f"b{i}" for i in range(11)),
        *(f"c{i}" for i in range(18)),
    ),
    forces=forces,
    stiffness=stiffness,
    slopes=("b3 and b4 (a3 and a4 without b)", "a3 and a4"),
    odd=("a9", "a10", "a12", "a13", "c12", "c13", "c16", "c17"),
)
