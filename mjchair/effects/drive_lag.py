"""Torque that follows its command late."""

from __future__ import annotations

import mujoco

from mjchair.effects.effect import Effect, Parameter
from mjchair.model import parts


def edit(spec: mujoco.MjSpec, time_constant: float) -> None:
    """Pass the torque of both rear wheels through a first-order lag (s)."""
    if time_constant <= 0.0:
        return
    for wheel in parts.REAR:
        actuator = parts.named(spec.actuators, wheel, "actuator")
        lag = list(actuator.dynprm)
        lagged = actuator.dyntype == mujoco.mjtDyn.mjDYN_FILTEREXACT
        lag[0] = (lag[0] if lagged else 0.0) + time_constant
        actuator.dyntype = mujoco.mjtDyn.mjDYN_FILTEREXACT
        actuator.dynprm = lag


EFFECT = Effect(
    name="drive_lag",
    parameters=(Parameter("time_constant", "s", 0.08, 0.0, 1.0),),
    signature="phase of torque",
    source="current loops 1-10 ms, gear and tire drives up to 0.2 s; assumed",
    edit=edit,
    driven=True,
    commanded=True,
    drive=False,
)
