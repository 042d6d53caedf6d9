"""A chair whose drive is off, as in a run that nothing drives.

In: a compiled model. Out: the model without what its drive does by itself, as brake with the speed
that it turns at.
"""

from __future__ import annotations

import copy

import mujoco

from mjchair.model.parts import REAR
from mjchair.simulation import names


def undriven(model: mujoco.MjModel) -> mujoco.MjModel:
    """A copy of the model with its drive off; the model itself where its drive does nothing.

    Raises:
      MjchairError: a rear wheel has no actuator.
    """
    known = names.actuators(model)
    rear = [names.find(wheel, known, "actuator") for wheel in REAR]
    if not model.actuator_biasprm[rear].any():
        return model
    off = copy.copy(model)
    off.actuator_biasprm[rear] = 0.0
    return off
