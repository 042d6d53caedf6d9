"""The most that something that happened once explains: a push, a bump, a gust in one run.

In: the screened columns, among them forces that act in one second of one run. Out: the chi2 that
such forces bring. Where it is about what an effect brings, nothing tells the two apart: a place
that is passed once looks like a moment.
"""

from __future__ import annotations

from mjchair.diagnosis.explain.column_ids import ForceColumn, Quantity
from mjchair.diagnosis.explain.screening import Base

LASTS = 2  # seconds that follow each other, which an event may lie across


def largest(base: Base) -> float:
    """Chi2 that the best event of one run brings: force and yaw moment, free in each second."""
    moments: dict[str, dict[int, list[ForceColumn]]] = {}
    for column in base.columns:
        if isinstance(column, ForceColumn) and column.group.driver.quantity == Quantity.TIME:
            run = moments.setdefault(column.group.driver.trial, {})
            run.setdefault(column.part, []).append(column)
    gains = [
        base.reduced.gain(base.reduced.index(_following(run, second)))
        for run in moments.values()
        for second in run
    ]
    return max(gains, default=0.0)


def _following(run: dict[int, list[ForceColumn]], second: int) -> list[ForceColumn]:
    """The forces of the seconds from one on."""
    return [c for k in range(LASTS) for c in run.get(second + k, ())]
