"""Identifiers of the columns of effects, and of forces with a driver, that are tested.

In: nothing. Out: types that name a column or a group of columns of the linear system.

Columns of one group are tested together: a start of one effect, or one force with one driver.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from mjchair.diagnosis.fit.column_ids import ColumnId
from mjchair.diagnosis.replay.pulses import Force


class Quantity(StrEnum):
    """What a force may go with."""

    SPEED = "speed"
    YAW_RATE = "yaw_rate"
    HEADING = "heading"
    LEFT_TURN = "left wheel's turn"
    RIGHT_TURN = "right wheel's turn"
    SWIVEL = "swivel"
    TORQUE = "torque"
    STROKE = "stroke"
    TIME = "time"


@dataclass(frozen=True)
class Driver:
    """A quantity that a force goes with; for the time also the trial that it is a time in."""

    quantity: Quantity
    trial: str = ""

    def __str__(self) -> str:
        """As a person reads it, such as "time in coast_0"."""
        return f"{self.quantity} in {self.trial}" if self.trial else str(self.quantity)


@dataclass(frozen=True)
class EffectGroup:
    """The columns of one start of an effect, by the effect's key."""

    effect: str
    start: int


@dataclass(frozen=True)
class ForceGroup:
    """The columns of a force that goes with a driver."""

    force: Force
    driver: Driver


Group = EffectGroup | ForceGroup


@dataclass(frozen=True)
class EffectColumn(ColumnId):
    """A column of an effect: its group, and which of the group's it is."""

    group: EffectGroup
    part: int


@dataclass(frozen=True)
class ForceColumn(ColumnId):
    """A column of a force: its group, and which of the group's it is."""

    group: ForceGroup
    part: int
