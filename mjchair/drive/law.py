"""The equations of a drive, as small functions that Numba compiles: no MuJoCo in here.

In: numbers of one motor, of the battery or of the controller, in SI. Out: numbers. The parameters
and the state are named in mjchair.drive.block, with their units.

Motor: quasi-static direct-current machine, v = R i + k w (its electric time constant, about 1 ms,
is shorter than a step). Winding: copper, one thermal mass. Gear: a loss in proportion to the torque
that it passes on, and one without load. Controller: armature voltage with load compensation R i,
as wheelchair controllers have it (Dynamic DX manual, R-net documentation). Battery: a voltage that
falls with the charge behind an internal resistance. Parking brake: dry friction behind a spring,
so that a closed brake holds without creep.
"""

from __future__ import annotations

import math

from numba.extending import register_jitable

STANDARD = 20.0  # degC, at which the resistance of a winding is stated


@register_jitable(forceinline=True)
def clip(value: float, low: float, high: float) -> float:
    """The value within low to high."""
    return min(max(value, low), high)


@register_jitable(forceinline=True)
def joystick_demand(deflection: float, deadband: float, curve: float) -> float:
    """Demand, -1 to 1, of a joystick's deflection: none in the deadband, a power law beyond it."""
    size = (abs(deflection) - deadband) / (1.0 - deadband)
    if size <= 0.0:
        return 0.0
    return math.copysign(math.pow(size, curve), deflection)


@register_jitable(forceinline=True)
def ramp_step(
    now: float, wanted: float, rise: float, fall: float, reverse: float, h: float
) -> float:
    """The reference one step later.

    Args:
      now, wanted: m/s or rad/s. rise, fall: rates away from zero and towards it.
      reverse: rate towards zero while the opposite direction is wanted. h: s.
    """
    if now * wanted < 0.0:
        change = reverse * h
        return 0.0 if abs(now) <= change else now - math.copysign(change, now)
    if abs(wanted) >= abs(now):
        return now + clip(wanted - now, -rise * h, rise * h)
    return now + clip(wanted - now, -fall * h, fall * h)


@register_jitable(forceinline=True)
def open_circuit(charge: float, v0: float, v1: float, v2: float, v3: float, v4: float) -> float:
    """Voltage (V) without load at a charge, 0 to 1: straight lines between five points."""
    at = clip(charge, 0.0, 1.0) * 4.0
    if at < 1.0:
        return v0 + at * (v1 - v0)
    if at < 2.0:
        return v1 + (at - 1.0) * (v2 - v1)
    if at < 3.0:
        return v2 + (at - 2.0) * (v3 - v2)
    return v3 + (at - 3.0) * (v4 - v3)


@register_jitable(forceinline=True)
def battery_current(power: float, voltage: float, resistance: float) -> float:
    """Current (A) that gives a power (W) at the terminals: voltage i - R i^2 = power.

    Above the largest power that the battery can give, voltage^2 / (4 R), it is the current of that
    largest power.
    """
    root = voltage * voltage - 4.0 * resistance * power
    if root <= 0.0:
        return 0.5 * voltage / resistance
    return 2.0 * power / (voltage + math.sqrt(root))


@register_jitable(forceinline=True)
def charge_current(current: float, used: float, charge: float, capacity: float, h: float) -> float:
    """The part of a battery's current (A) that changes its charge, which stays within 0 to 1.

    A full battery takes no more charge, and an empty one has no more to give.

    Args:
      used: charge taken since the start, A s. charge: at the start, 0 to 1. capacity: A s. h: s.
    """
    lowest, highest = (charge - 1.0) * capacity, charge * capacity
    after = used + h * current
    if lowest <= after <= highest:
        return current
    return (clip(after, lowest, highest) - used) / h


@register_jitable(forceinline=True)
def current_limit(
    boost: float,
    temperature: float,
    boosted: float,
    continuous: float,
    band: float,
    warm: float,
    hot: float,
) -> float:
    """What the controller lets through, A: boost, then less; none where the winding is too hot.

    Args:
      boost: used share of the boost, 0 to 1. temperature: degC. boosted, continuous: A.
      band: last share of the boost, in which the limit falls. warm, hot: degC, between which the
        limit falls to zero.
    """
    limit = continuous + (boosted - continuous) * clip((1.0 - boost) / band, 0.0, 1.0)
    return limit * clip((hot - temperature) / (hot - warm), 0.0, 1.0)


@register_jitable(forceinline=True)
def motor_operating_point(
    wanted: float, emf: float, resistance: float, limit: float, supply: float
) -> tuple[float, float]:
    """Voltage (V) at a motor and its current (A), within the supply and the current limit."""
    voltage = clip(wanted, -supply, supply)
    current = (voltage - emf) / resistance
    if abs(current) > limit:
        voltage = clip(emf + resistance * math.copysign(limit, current), -supply, supply)
        current = (voltage - emf) / resistance
    return voltage, current


@register_jitable(forceinline=True)
def gear_friction(torque: float, spin: float, efficiency: float, idle: float, fade: float) -> float:
    """Friction (N m) of a gear at the wheel, against the spin (rad/s).

    It is (1 - efficiency) of the torque (N m) that is passed on, and `idle` (N m) without load,
    whichever way the power goes. Below `fade` (rad/s) it fades to nothing.
    """
    return ((1.0 - efficiency) * abs(torque) + idle) * spin / math.sqrt(spin * spin + fade * fade)


@register_jitable(forceinline=True)
def brake_step(
    windup: float, spin: float, torque_limit: float, stiffness: float, damping: float, h: float
) -> tuple[float, float]:
    """A parking brake: its windup (rad) one step later, and the torque (N m) against the spin.

    Args:
      spin: rad/s. torque_limit: N m, at which it slips. stiffness: N m/rad.
      damping: N m s/rad. h: s.
    """
    bound = torque_limit / stiffness
    windup = clip(windup + h * spin, -bound, bound)
    return windup, clip(stiffness * windup + damping * spin, -torque_limit, torque_limit)
