"""The Magic Formula's curve, and the similarity method that joins two pure curves.

In: a slip and B, C, D, E. Out: the curve's value, or the trail.
"""

from __future__ import annotations

import math

from numba.extending import register_jitable


@register_jitable
def magic_formula(x: float, b: float, c: float, d: float, e: float) -> float:
    """D sin(C atan(B x - E (B x - atan(B x)))): equation (5) of Silva & Dedini (2007)."""
    bx = b * x
    if e != 0.0:
        bx -= e * (bx - math.atan(bx))
    return d * math.sin(c * math.atan(bx))


@register_jitable
def brush_trail(trail: float, rho: float) -> float:
    """Pneumatic trail (m) of the brush model at the normalised slip `rho` = slip * C / D.

    Pacejka, Tyre and Vehicle Dynamics, 2nd ed., equations (3.11)-(3.13), with theta sigma = rho/3:
    a third of the contact half-length at zero slip, zero from full sliding (rho = 3) on.
    """
    q = rho / 3.0
    if q >= 1.0:
        return 0.0
    return trail * (1.0 - q) ** 3 / (1.0 - q + q * q / 3.0)
