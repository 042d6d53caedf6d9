"""The base class of the tasks.

In: an action of two torques, and the physics of the chair. Out: bounded observations, an initial
state in which the chair has settled on its tires, and the end of the episode where the chair tips
over, leaves the ground or touches something. Rewards and goals belong to each task.
"""

from __future__ import annotations

from collections import OrderedDict
from typing import Any

import numpy as np
from dm_control.suite import base
from dm_env import specs
from numpy.typing import NDArray

from mjchair.simulation.initial import Initial, start
from mjchair.simulation.standing import Fall
from mjchair.tasks.given import checked_action
from mjchair.tasks.physics import REAR, Physics
from mjchair.tasks.quantity import COMMON, Quantity
from mjchair.tasks.standing_watch import StandingWatch

Array = NDArray[np.float64]


class ChairTask(base.Task):  # type: ignore[misc]
    """A task of a chair that is driven by torques on its two rear wheels.

    Attributes:
      quantities: the observed quantities, in order. torque: the largest about each axle, N m.
    """

    torque = 20.0

    def __init__(self, random: np.random.RandomState | int | None = None) -> None:
        """Make the task. random: its random state, or the seed of one."""
        super().__init__(random=random)
        self.quantities: tuple[Quantity, ...] = (*COMMON, *self.own_quantities())
        self._settled: tuple[Array, Array] | None = None  # qpos and act of the chair at rest
        self._standing: StandingWatch | None = None

    def own_quantities(self) -> tuple[Quantity, ...]:
        """The quantities that this task observes in addition to the common ones."""
        return ()

    def solved(self, physics: Physics) -> bool:
        """Whether the task is solved in the present state."""
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
        """Place the chair, settled on its tires, at the start of the task."""
        if self._settled is None:
            data = start(physics.model.ptr, Initial())
            self._settled = data.qpos.copy(), data.act.copy()
        if self._standing is None:
            self._standing = StandingWatch(physics)
        self._standing.restart()
        self.begin(physics)
        for side in ("left", "right"):
            swivel = f"{side}_caster_swivel"
            physics.named.data.qpos[swivel] = self.random.uniform(-0.3, 0.3)
        super().initialize_episode(physics)

    def begin(self, physics: Physics) -> None:
        """Place the chair and choose the goal; by default near the origin, with a random offset."""
        self.put(
            physics,
            self.random.uniform(-0.05, 0.05),
            self.random.uniform(-0.05, 0.05),
            self.random.uniform(-0.05, 0.05),
        )

    def put(self, physics: Physics, x: float, y: float, heading: float) -> None:
        """Place the settled chair at x, y (m) with a heading (rad) on a level floor."""
        assert self._settled is not None
        physics.place(*self._settled, x, y, heading)

    def before_step(self, action: Any, physics: Physics) -> None:
        """Set the wheel torques. The controls of the tires have no effect and stay 0.

        Raises:
          MjchairError: the action is not two finite numbers; beyond its bounds it is clipped.
        """
        given = checked_action(action, self.action_spec(physics))
        for wheel, torque in zip(REAR, self.torques(given, physics), strict=True):
            physics.named.data.ctrl[wheel] = torque

    def torques(self, action: Array, physics: Physics) -> Array:
        """Torques (2,), N m, on the left and right wheel for an action."""
        return np.clip(action, -self.torque, self.torque)

    def after_step(self, physics: Physics) -> None:
        """Judge whether the chair still stands on its wheels."""
        if self._standing is not None:
            self._standing.update(physics)
        super().after_step(physics)

    @property
    def fall(self) -> Fall | None:
        """How the chair stopped standing on its wheels in this episode; None while it stands."""
        return None if self._standing is None else self._standing.fall

    def get_termination(self, physics: Physics) -> float | None:
        """Discount 0 where the chair fell or touches something, which ends the episode; else None.

        A chair falls when it tips over or leaves the ground, by the rule of a recording's status
        (mjchair.simulation.standing).
        """
        return 0.0 if self.fall is not None or physics.touches() else None
