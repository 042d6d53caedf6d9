"""The paper's laws (1) and (2): lateral force linear in the slip angle, up to friction.

(1) Fy = -C_alpha alpha and (2) Fy = (a Fz - b Fz^2) alpha. As printed, (2) is positive for a
positive angle; here both give ISO-W signs. Neither says how far it holds nor what the wheel does
along its heading: the force is cut at friction * Fz, and longitudinal slip has the same stiffness
(isotropy), since a chair cannot be driven on a wheel without longitudinal force.
"""

from __future__ import annotations

import math

from numba.extending import register_jitable

from mjchair.tire.block import FAMILY, HEADER, LINEAR, PNEUMATIC_TRAIL

# coefficients after the header
C_ALPHA = HEADER  # N/rad, linear
A = HEADER  # 1/rad, quadratic
B = HEADER + 1  # 1/(N rad), quadratic
FRICTION = HEADER + 2  # 1


@register_jitable
def cornering_stiffness(p, fz):
    """N/rad, of equation (1) or (2), not negative."""
    if p[FAMILY] == LINEAR:
        return p[C_ALPHA]
    return max((p[A] - p[B] * fz) * fz, 0.0)


@register_jitable
def forces(p, fz, kappa, tan_alpha, gamma, speed, direction):
    """Steady-state forces and moments; see mjchair.tire.formula. No camber, no speed."""
    c = cornering_stiffness(p, fz)
    fx = c * kappa
    fy = -c * math.atan(tan_alpha)
    total = math.hypot(fx, fy)
    limit = p[FRICTION] * fz
    if total > limit:
        fx *= limit / total
        fy *= limit / total
    return fx, fy, 0.0, 0.0, -p[PNEUMATIC_TRAIL] * fy * direction


@register_jitable
def stiffness(p, fz, gamma, speed):
    """Slope at zero slip and friction limit, the same along and across."""
    c = cornering_stiffness(p, fz)
    return c, c, p[FRICTION] * fz, p[FRICTION] * fz
