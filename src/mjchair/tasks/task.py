"""What the tasks have in common: two torques in, bounded observations out, a settled start."""

from __future__ import annotations

from collections import OrderedDict
from typing import Any

import numpy as np
from dm_control.suite import base
from dm_env import specs
from numpy.typing import NDArray

from mjchair.simulation.initial import Initial, start
from mjchair.tasks.physics import REAR, Physics
from mjchair.tasks.quantity import COMMON, Quantity

Array = NDArray[np.float64]


class ChairTask(base.Task):  # type: ignore[misc]
    """A task of a chair driven by torques on its two rear wheels.

    Attributes:
      quantities: what is observed, in order. torque: largest about each axle, N m.
    """

    torque = 20.0

    def __init__(self, random: np.random.RandomState | int | None = None) -> None:
        """Begin with the task's random state, or a seed for one."""
        super().__init__(random=random)
        self.quantities: tuple[Quantity, ...] = (*COMMON, *self.own_quantities())
        self._settled: tuple[Array, Array] | None = None

    def own_quantities(self) -> tuple[Quantity, ...]:
        """What this task observes beside the common quantities."""
        return ()

    def solved(self, physics: Physics) -> bool:
        """Whether the task is done, now."""
        raise NotImplementedError

    # -- the interface of dm_control ------------------------------------------------------------

    def action_spec(self, physics: Physics) -> specs.BoundedArray:
        """Torques about the axles of the left and the right wheel, N m, positive forward."""
        most = np.full(2, self.torque)
        return specs.BoundedArray((2,), np.float64, -most, most, "\t".join(REAR))

    def observation_spec(self, physics: Physics) -> OrderedDict[str, specs.BoundedArray]:
        """Shape, type and bounds of every observed quantity."""
        return OrderedDict((q.name, q.spec()) for q in self.quantities)

    def get_observation(self, physics: Physics) -> OrderedDict[str, Array]:
        """Every observed quantity, within its bounds."""
        return OrderedDict((q.name, q.value(physics)) for q in self.quantities)

    def initialize_episode(self, physics: Physics) -> None:
        """Put the chair, settled on its tires, where the task begins it."""
        if self._settled is None:
            data = start(physics.model.ptr, Initial())
            self._settled = data.qpos.copy(), data.act.copy()
        self.begin(physics)
        for side in ("left", "right"):
            swivel = f"{side}_caster_swivel"
            physics.named.data.qpos[swivel] = self.random.uniform(-0.3, 0.3)
        super().initialize_episode(physics)

    def begin(self, physics: Physics) -> None:
        """Place the chair and set the course; at the origin with a little variation by default."""
        self.put(
            physics,
            self.random.uniform(-0.05, 0.05),
            self.random.uniform(-0.05, 0.05),
            self.random.uniform(-0.05, 0.05),
        )

    def put(self, physics: Physics, x: float, y: float, heading: float) -> None:
        """Place the settled chair at x, y (m), turned by heading (rad) in the floor's plane."""
        assert self._settled is not None
        physics.place(*self._settled, x, y, heading)

    def before_step(self, action: Any, physics: Physics) -> None:
        """Torques to the motors; the tires' own controls are inert and stay 0."""
        for wheel, torque in zip(REAR, self.torques(np.asarray(action), physics), strict=True):
            physics.named.data.ctrl[wheel] = torque

    def torques(self, action: Array, physics: Physics) -> Array:
        """Torques (2,), N m, that an action makes."""
        return np.clip(action, -self.torque, self.torque)

    def get_termination(self, physics: Physics) -> float | None:
        """A chair that tips over or hits something ends the episode, with discount 0."""
        return 0.0 if physics.tipped() or physics.touches() else None
