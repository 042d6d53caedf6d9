"""Deflections of the tire, which carry its force at low speed and at standstill.

In: a deflection, its slip speed, the rolling speed. Out: the deflection after a step.

A deflection x follows its slip speed and relaxes over the distance rolled (Pacejka & Besselink,
Magic Formula Tyre Model with Transient Properties, 1997): dx/dt = Vs - |V| x / sigma. The
speed has no lower limit. The implicit step is stable at any |V| h / sigma, and at V = 0 the
deflection is a spring.

The carcass damper acts on dx/dt, not on the slip speed as that recipe has it: it then vanishes in
every steady state, also on a rig that creeps at 2 mm/s, and needs no fading speed.
"""

from __future__ import annotations

from numba.extending import register_jitable


@register_jitable
def relax(x: float, slip_speed: float, roll_speed: float, length: float, h: float) -> float:
    """The deflection after a step of `h` s.

    Args:
      x: deflection, m. slip_speed: m/s. roll_speed: m/s, its size counts.
      length: relaxation length, m. h: s.
    """
    return (x + h * slip_speed) / (1.0 + h * abs(roll_speed) / length)
