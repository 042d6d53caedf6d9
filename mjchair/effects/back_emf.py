"""Motors that brake with the speed they turn at, while they are driven."""

from __future__ import annotations

import mujoco

from mjchair.effects.effect import Effect, Parameter
from mjchair.model import parts


def edit(spec: mujoco.MjSpec, coefficient: float) -> None:
    """Take `coefficient` (N m s/rad) times wheel speed off the torque of each rear wheel."""
    for wheel in parts.REAR:
        actuator = parts.named(spec.actuators, wheel, "actuator")
        bias = list(actuator.biasprm)
        bias[2] -= coefficient
        actuator.biastype = mujoco.mjtBias.mjBIAS_AFFINE
        actuator.biasprm = bias


EFFECT = Effect(
    name="back_emf",
    parameters=(Parameter("coefficient", "N m s/rad", 0.1, 0.0, 10.0),),
    signature="in proportion to wheel speed, only when driven",
    source="k^2/R of small wheelchair motors seen at the wheel: 0.1-2 N m s/rad; assumed",
    edit=edit,
    driven=True,
    commanded=True,
    drive=False,
)
