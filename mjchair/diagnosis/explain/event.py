"""The most that something that happened once explains: a push, a bump, a gust in one run.

In: the screened columns, among them forces that act in one second of one run. Out: which brings
most chi2. Where it is about what an effect brings, nothing tells the two apart: a place
that is passed once looks like a moment.
"""

from __future__ import annotations

from dataclasses import dataclass

from mjchair.diagnosis.explain.column_ids import ForceColumn, Quantity
from mjchair.diagnosis.explain.screening import Base

LASTS = 2  # seconds that follow each other, which an event may lie across


@dataclass(frozen=True)
class Event:
    """Chi2 that an event brings, the run's name, and the second of the run's clock it begins in."""

    gain: float
    trial: str = ""
    second: int = 0


def largest(base: Base) -> Event:
    """The event of one run that brings most: force and yaw moment, free in each second."""
    moments: dict[str, dict[int, list[ForceColumn]]] = {}
    for column in base.columns:
        if isinstance(column, ForceColumn) and column.group.driver.quantity == Quantity.TIME:
            run = moments.setdefault(column.group.driver.trial, {})
            run.setdefault(column.part, []).append(column)
    events = (
        Event(base.reduced.gain(base.reduced.index(_following(run, second))), trial, second)
        for trial, run in moments.items()
        for second in run
    )
    return max(events, key=lambda event: event.gain, default=Event(0.0))


def _following(run: dict[int, list[ForceColumn]], second: int) -> list[ForceColumn]:
    """The forces of the seconds from one on."""
    return [c for k in range(LASTS) for c in run.get(second + k, ())]
