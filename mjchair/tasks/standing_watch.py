"""Whether the chair of a task still stands on its wheels, checked after every control step.

In: the physics of a task, step by step. Out: how the chair stopped standing, if it did.

The rule and its limits are those of a recording's status. mjchair.simulation.standing applies them
to a finished run; this module applies them to the part of an episode that has been simulated.
"""

from __future__ import annotations

import math

import numpy as np

from mjchair.simulation.standing import (
    LEAST,
    TIPPED,
    UNLOADED,
    Fall,
    floor_normal,
    groups,
    load_places,
)
from mjchair.tasks.physics import Physics


class StandingWatch:
    """Follows the lean of a chair and the loads on its wheels through the episodes of a task.

    Attributes:
      fall: how the chair stopped standing on its wheels; None while it stands.
    """

    def __init__(self, physics: Physics) -> None:
        """Read floor normal, weight and wheels, four or six, from the model."""
        model = physics.model.ptr
        self.fall: Fall | None = None
        self._normal = floor_normal(model)
        self._chair = model.body("chair").id
        gravity = float(np.linalg.norm(model.opt.gravity))
        self._least_load = LEAST * gravity * float(model.body_subtreemass[self._chair])
        self._load_places = load_places(model, self._chair)
        self._groups = list(groups(self._load_places).values())
        self._unloaded_since: dict[str, float] = {}  # names of wheels, joined -> time, s

    def restart(self) -> None:
        """Begin a new episode with a chair that stands."""
        self.fall = None
        self._unloaded_since.clear()

    def update(self, physics: Physics) -> None:
        """Judge the state after a control step. A fall is kept until `restart`."""
        if self.fall is None:
            self.fall = self._judge(physics)

    def _judge(self, physics: Physics) -> Fall | None:
        data = physics.data
        vertical = data.xmat[self._chair][[2, 5, 8]]  # the chair's z, in the world's frame
        if float(vertical @ self._normal) < math.cos(TIPPED):
            return Fall.TIPPED
        unloaded = {
            wheel: not data.sensordata[place] > self._least_load
            for wheel, place in self._load_places.items()
        }
        time = float(data.time)
        if self._lasts("all", all(unloaded.values()), time):
            return Fall.OFF_GROUND
        lasting = [
            self._lasts(" ".join(group), all(unloaded[wheel] for wheel in group), time)
            for group in self._groups
        ]
        return Fall.TIPPED if any(lasting) else None

    def _lasts(self, wheels: str, unloaded: bool, time: float) -> bool:
        """Whether these wheels have borne no load for `UNLOADED` seconds without interruption."""
        if not unloaded:
            self._unloaded_since.pop(wheels, None)
            return False
        return time - self._unloaded_since.setdefault(wheels, time) >= UNLOADED
