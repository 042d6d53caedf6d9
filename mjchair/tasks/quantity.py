"""Observed quantities: name, unit, bounds, and how each is read from the physics.

In: the physics of a chair. Out: a reading within its bounds, for the observation of a task; COMMON
are the quantities that every task observes.
"""

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
      name: of the entry. unit: SI; "1" for a number without a unit.
      text: what the quantity is, and its frame.
      low, high: bounds, one number or one for each component; readings are clipped to them.
      read: gives the number or the vector from the physics.
      size: number of components; 0 for a scalar, which is observed as an array (1,).
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
        """Shape of the entry in the observation."""
        return (max(self.size, 1),)

    def spec(self) -> specs.BoundedArray:
        """Shape, type and bounds of the entry."""
        low, high = (np.broadcast_to(b, self.shape).astype(float) for b in (self.low, self.high))
        return specs.BoundedArray(self.shape, np.float64, low, high, name=self.name)

    def value(self, physics: Physics) -> Array:
        """The reading, clipped to its bounds, as a new array."""
        reading = np.array(self.read(physics), dtype=np.float64).reshape(self.shape)
        return np.clip(reading, self.low, self.high)


# the quantities that every task observes
SPEED = Quantity(
    "speed", "m/s", -5.0, 5.0, "forward speed of the rear axle's middle", Physics.speed
)
YAW_RATE = Quantity(
    "yaw_rate", "rad/s", -10.0, 10.0, "yaw rate about the chair's z axis", Physics.yaw_rate
)
WHEEL_SPEEDS = Quantity(
    "wheel_speeds",
    "rad/s",
    -40.0,
    40.0,
    "angular speeds of the left and right rear wheel",
    Physics.wheel_speeds,
    2,
)
CASTERS = Quantity(
    "casters",
    "1",
    -1.0,
    1.0,
    "swivel angles: cosine left, right, then sine left, right",
    Physics.caster_angles,
    4,
)
LATERAL_FORCES = Quantity(
    "lateral_forces",
    "N",
    -1500.0,
    1500.0,
    "Fy of the left and right rear tire, positive to the left",
    Physics.lateral_forces,
    2,
)
COMMON = (SPEED, YAW_RATE, WHEEL_SPEEDS, CASTERS, LATERAL_FORCES)
