"""Effects change the numbers of a chair's drive, in the `user` fields of its actuators."""

from __future__ import annotations

from collections.abc import Callable

import mujoco

from mjchair.drive import block
from mjchair.drive.attach import has_drive
from mjchair.errors import MjchairError
from mjchair.model import parts


def change(spec: mujoco.MjSpec, actuator: str, number: str, edit: Callable[[float], float]) -> None:
    """Replace a number of the drive's actuator by what `edit` makes of it.

    Args:
      actuator: `drive`, `left_motor` or `right_motor`. number: its name in mjchair.drive.block.

    Raises:
      MjchairError: the chair has no drive.
    """
    if not has_drive(spec):
        raise MjchairError(
            'the chair has no drive; build it with drive="normal" (drive = "normal" in study.toml)'
        )
    found = parts.named(spec.actuators, actuator, "actuator")
    places = block.CONTROLLER if actuator == block.DRIVE else block.MOTOR
    numbers = list(found.userdata)
    numbers[places[number]] = edit(numbers[places[number]])
    found.userdata = numbers
