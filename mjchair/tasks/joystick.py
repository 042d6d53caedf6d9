"""Tasks of a power chair that is driven with its joystick: what they share.

In: an action of two deflections, forward and to the left, -1 to 1. Out: the controls `joystick_x`
and `joystick_y` of the chair's drive, and what a person at the joystick feels of it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from dm_env import specs
from numpy.typing import NDArray

from mjchair.drive import block
from mjchair.tasks.given import checked_action
from mjchair.tasks.physics import Physics
from mjchair.tasks.quantity import Quantity
from mjchair.tasks.task import ChairTask

Array = NDArray[np.float64]
CHAIR, PROFILE = "power", "indoor"


def _references(physics: Physics) -> Array:
    """Reference speed (m/s) and yaw rate (rad/s) of the controller, (2,)."""
    return np.array(physics.named.data.sensordata[block.DRIVE][:2])


def _currents(physics: Physics) -> Array:
    """Currents of the left and the right motor, (2,), A."""
    return np.array([physics.named.data.sensordata[motor][0] for motor in block.MOTORS])


class JoystickTask(ChairTask):
    """A task whose action is the joystick of the power chair's drive."""

    def own_quantities(self) -> tuple[Quantity, ...]:
        """The references of the controller and the currents of the motors."""
        return (
            *super().own_quantities(),
            Quantity(
                "references",
                "m/s, rad/s",
                -10.0,
                10.0,
                "speed and yaw rate that the chair's controller has ramped to",
                _references,
                2,
            ),
            Quantity("currents", "A", -200.0, 200.0, "left and right motor", _currents, 2),
        )

    def action_spec(self, physics: Physics) -> specs.BoundedArray:
        """Deflections of the joystick: forward and to the left, -1 to 1."""
        most = np.ones(2)
        return specs.BoundedArray((2,), np.float64, -most, most, "\t".join(block.JOYSTICK))

    def before_step(self, action: Any, physics: Physics) -> None:
        """Set the joystick. The controls of tires, motors and wheels stay 0.

        Raises:
          MjchairError: as ChairTask does.
        """
        given = checked_action(action, self.action_spec(physics))
        for axis, deflection in zip(block.JOYSTICK, given, strict=True):
            physics.named.data.ctrl[axis] = np.clip(deflection, -1.0, 1.0)
