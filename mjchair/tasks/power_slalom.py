"""The task `power_slalom`: the posts of `slalom` with a power chair and its joystick.

In: deflections of the joystick. Out: the task (observations, reward and end of the episode) and
its scene.
"""

from __future__ import annotations

import mujoco

from mjchair.tasks import slalom
from mjchair.tasks.joystick import CHAIR, PROFILE, JoystickTask

TIME_LIMIT = 30.0  # s
SPEED = 0.6  # m/s, for the baseline


class PowerSlalom(JoystickTask, slalom.Slalom):
    """The reward is that of `slalom`."""


def spec() -> mujoco.MjSpec:
    """The power chair on a level floor with posts and the marks of the proposed path."""
    return slalom.spec(CHAIR, drive=PROFILE)
