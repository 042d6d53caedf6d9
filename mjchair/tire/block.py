"""The block: a tire as a row of numbers, as it lies in the `user` field of a geom.

In: nothing. Out: the index of each number. The header comes first, then the coefficients of the
formula family. Everything that reads or writes a tire inside a model uses these indices.
"""

from __future__ import annotations

from typing import Protocol


class Block(Protocol):
    """A row of numbers, as an array or a row of one."""

    def __getitem__(self, index: int, /) -> float:
        """The number at an index of this file."""


TAG = 5066324.0  # "MJT" as a number: the geom carries a tire
VERSION = 1.0

# header
TAG_AT = 0
VERSION_AT = 1
FAMILY = 2  # number of the formula family, see mjchair.tire.families
RELAXATION_X = 3  # m; 0: the family's own
RELAXATION_Y = 4  # m; 0: the family's own
DAMPING_TIME = 5  # s, damping over stiffness of the carcass
ROLLING_RESISTANCE = 6  # 1, moment over load and radius
ROLLING_RELAXATION = 7  # m rolled until the resistance has built up
ROLLING_DAMPING_TIME = 8  # s
TURNING_MOMENT = 9  # N m, against the yaw rate of the contact patch
FRICTION_FACTOR = 10  # 1, scales the peak
STIFFNESS_FACTOR = 11  # 1, scales the slip stiffness
LOAD_EXPONENT = 12  # 1, forces over load fall with (Fz / nominal load) ** -exponent
NOMINAL_LOAD = 13  # N
PNEUMATIC_TRAIL = 14  # m at zero slip, where the family has no aligning moment of its own
SLIDE_SPEED = 15  # m/s, slip speed below which sliding at standstill keeps its peak
RADIUS = 16  # m, unloaded
LONGITUDINAL_FACTOR = 17  # 1, scales the slip stiffness along the heading alone; 0: 1
TURNING_RATE = 18  # rad/s, over which the turning moment's sign is smoothed; 0: the law's own
HEADER = 20  # the first coefficient

# the road's own block, on the geom that a tire stands on: places of other friction and resistance
ROAD_TAG = 5066322.0  # "MJR"
ROAD_COUNT = 2  # number of patches
ROAD_PATCHES = 4  # the first of them
ROAD_STRIDE = 5  # x, y (m, world), radius (m), added rolling resistance (1), friction factor (1)
