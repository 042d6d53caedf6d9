"""Deflections of the tire, which carry its force at low speed and at standstill.

In: a deflection, its slip speed, the rolling speed. Out: the deflection after a step.

A deflection x follows its slip speed and relaxes over the distance rolled (Pacejka & Besselink,
Magic Formula Tyre Model with Transient Properties, 1997): dx/dt = Vs - |V| x / sigma. The
speed has no lower limit. The step is exact for speeds that stay the same during it, so it is stable
at any |V| h / sigma, and at V = 0 the deflection is a spring.

The carcass damper acts on dx/dt, not on the slip speed as that recipe has it: it then vanishes in
every steady state, also on a rig that creeps at 2 mm/s, and needs no fading speed.
"""

from __future__ import annotations

import math

from numba.extending import register_jitable

SMALL = 1e-5  # relaxed share of a step below which its series is more exact than the quotient


@register_jitable
def relax(x: float, slip_speed: float, roll_speed: float, length: float, h: float) -> float:
    """The deflection after a step of `h` s.

    Args:
      x: deflection, m. slip_speed: m/s. roll_speed: m/s, its size counts.
      length: relaxation length, m. h: s.
    """
    share = h * abs(roll_speed) / length
    relaxed = -math.expm1(-share)
    mean = relaxed / share if share > SMALL else 1.0 - 0.5 * share
    return x * (1.0 - relaxed) + h * slip_speed * mean
