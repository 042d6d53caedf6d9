"""A battery of a power chair that is not as full as was thought."""

from __future__ import annotations

import mujoco

from mjchair.drive import block
from mjchair.effects.drive_numbers import change
from mjchair.effects.effect import Effect, Parameter


def edit(spec: mujoco.MjSpec, used: float) -> None:
    """Take `used` of the capacity (1) off the charge at the start; never below empty."""
    change(spec, block.DRIVE, "charge", lambda charge: max(charge - used, 0.0))


EFFECT = Effect(
    name="low_battery",
    parameters=(Parameter("used", "1", 0.5, 0.0, 0.98),),
    signature="full speed is not reached, the less the steeper; nothing at low speed",
    source="voltage of lead-acid batteries over their charge; assumed (models/power/drive.toml)",
    edit=edit,
    driven=True,
    drive=True,
    example={"used": 0.85},
)
