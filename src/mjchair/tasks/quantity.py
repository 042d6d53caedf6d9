"""An observed quantity: its name, bounds and unit, and how it is read."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from dm_env import specs
from numpy.typing import NDArray

from mjchair.tasks.physics import Physics

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Quantity:
    """One entry of an observation.

    Attributes:
      name: of the entry. unit: SI; "1" where it has none. text: what it is, with its frame.
      low, high: bounds, of one number or one a component; readings are clipped to them.
      read: from the physics, the number or the vector.
      size: how many components; 0 for a scalar, which is observed as (1,).
    """

    name: str
    unit: str
    low: float | Sequence[float]
    high: float | Sequence[float]
    text: str
    read: Callable[[Physics], Any]
    size: int = 0

    @property
    def shape(self) -> tuple[int]:
        """Of the entry in the observation."""
        return (max(self.size, 1),)

    def spec(self) -> specs.BoundedArray:
        """Shape, type and bounds."""
        low, high = (np.broadcast_to(b, self.shape).astype(float) for b in (self.low, self.high))
        return specs.BoundedArray(self.shape, np.float64, low, high, name=self.name)

    def value(self, physics: Physics) -> Array:
        """The reading, within its bounds; memory of its own."""
        reading = np.array(self.read(physics), dtype=np.float64).reshape(self.shape)
        return np.clip(reading, self.low, self.high)


# what every task observes
SPEED = Quantity(
    "speed", "m/s", -5.0, 5.0, "of the rear axle's middle, forward", lambda p: p.speed()
)
YAW_RATE = Quantity("yaw_rate", "rad/s", -10.0, 10.0, "about the chair's z", Physics.yaw_rate)
WHEEL_SPEEDS = Quantity(
    "wheel_speeds", "rad/s", -40.0, 40.0, "left and right rear wheel", Physics.wheel_speeds, 2
)
CASTERS = Quantity(
    "casters", "1", -1.0, 1.0, "cosines, then sines of both swivels", Physics.caster_angles, 4
)
LATERAL_FORCES = Quantity(
    "lateral_forces",
    "N",
    -1500.0,
    1500.0,
    "Fy of the left and right rear tire, to the left",
    Physics.lateral_forces,
    2,
)
COMMON = (SPEED, YAW_RATE, WHEEL_SPEEDS, CASTERS, LATERAL_FORCES)
