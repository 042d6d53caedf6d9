"""The task `power_doorway`: drive a power chair through a door with its joystick.

In: deflections of the joystick. Out: the task (observations, reward and end of the episode) and
its scene. The chair starts beside the middle of the door, so it has to line up on its way.
"""

from __future__ import annotations

import mujoco
import numpy as np

from mjchair.model.spec import load_spec
from mjchair.tasks import arena
from mjchair.tasks.course import Course
from mjchair.tasks.follow_path import MARKS, FollowPath
from mjchair.tasks.joystick import CHAIR, PROFILE, JoystickTask
from mjchair.tasks.physics import Physics
from mjchair.tasks.tight_turn import TightTurn

TIME_LIMIT = 25.0  # s
# m, between the door posts; ADA 2010, section 404.2.3, requires 32 inches (0.815 m) clear
WIDTH = 0.9
DOOR, END = 3.0, 4.6  # m, x of the door and of the end
BESIDE = 0.5  # m, at most, of the start beside the door's middle
ROOM = 2.0  # m, half of the wall's length
SPEED = 0.5  # m/s


class PowerDoorway(JoystickTask, TightTurn):
    """The reward is high near a proposed path through the door and at SPEED along it.

    Attributes:
      beside: of the start from the door's middle, positive to the left, m.
    """

    def __init__(self, random: np.random.RandomState | int | None = None) -> None:
        """Begin with the task's random state, or a seed for one."""
        self.beside = 0.0
        FollowPath.__init__(self, random=random, speed=SPEED)

    def new_course(self) -> Course:
        """Draw where the chair starts; the proposed path leads from there through the door."""
        self.beside = float(self.random.uniform(-BESIDE, BESIDE))
        turn = np.linspace(0.0, np.pi, 7)
        along = [0.4 + (DOOR - 1.4) * a / np.pi for a in turn]
        aside = [0.5 * self.beside * (1.0 + np.cos(a)) for a in turn]
        return Course(
            [(0.0, self.beside), *zip(along, aside, strict=True), (DOOR, 0.0), (END, 0.0)]
        )

    def put(self, physics: Physics, x: float, y: float, heading: float) -> None:
        """Place the chair beside the line through the door."""
        super().put(physics, x, y + self.beside, heading)


def spec() -> mujoco.MjSpec:
    """The power chair before a wall with a door, with the marks of the proposed path."""
    built = load_spec(CHAIR, drive=PROFILE)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        edge = sign * (0.5 * WIDTH + 0.02)
        arena.add_wall(built, side, (DOOR, edge + 0.02 * sign), (DOOR, sign * ROOM))
    for geom in built.geoms:
        if geom.name.startswith("wall_"):
            geom.group = 1
    arena.add_marks(built, MARKS)
    return built
