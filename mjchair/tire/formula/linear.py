"""The paper's laws (1) and (2): lateral force linear in the slip angle, up to friction.

In: the block of a tire, load and slips. Out: forces and slopes; the two families at the end.

(1) Fy = -C_alpha alpha and (2) Fy = (a Fz - b Fz^2) alpha. As printed, (2) is positive for a
positive angle; here both give ISO-W signs. Neither says how far it holds nor what the wheel does
along its heading: the force is cut at friction * Fz, and longitudinal slip has the same stiffness
(isotropy), since a chair cannot be driven on a wheel without longitudinal force.
"""

from __future__ import annotations

import math

from numba.extending import register_jitable

from mjchair.tire.block import FAMILY, HEADER, PNEUMATIC_TRAIL, Block
from mjchair.tire.formula.family import Family

LINEAR_NUMBER, QUADRATIC_NUMBER = 0, 1  # of the families, in a block

# coefficients after the header
C_ALPHA = HEADER  # N/rad, linear
A = HEADER  # 1/rad, quadratic
B = HEADER + 1  # 1/(N rad), quadratic
FRICTION = HEADER + 2  # 1


@register_jitable
def cornering_stiffness(p: Block, fz: float) -> float:
    """N/rad, of equation (1) or (2), not negative."""
    if p[FAMILY] == LINEAR_NUMBER:
        return p[C_ALPHA]
    return max((p[A] - p[B] * fz) * fz, 0.0)


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
    """Steady-state forces and moments; see mjchair.tire.formula.family. No camber, no speed."""
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
def stiffness(p: Block, fz: float, gamma: float, speed: float) -> tuple[float, float, float, float]:
    """Slope at zero slip and friction limit, the same along and across."""
    c = cornering_stiffness(p, fz)
    return c, c, p[FRICTION] * fz, p[FRICTION] * fz


LINEAR = Family(
    number=LINEAR_NUMBER,
    name="linear",
    coefficients=("cornering_stiffness", "unused", "friction"),
    forces=forces,
    stiffness=stiffness,
    slopes=("cornering_stiffness", "cornering_stiffness"),
)
QUADRATIC = Family(
    number=QUADRATIC_NUMBER,
    name="quadratic",
    coefficients=("a", "b", "friction"),
    forces=forces,
    stiffness=stiffness,
    slopes=("a and b", "a and b"),
)
