"""An axis that goes by factors, with few and plain numbers.

In: an axis of matplotlib, already logarithmic, and the values that it reaches to. Out: its ticks.
"""

from __future__ import annotations

from matplotlib.axis import Axis
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

WIDE = 500.0  # highest over lowest value, beyond which only powers of ten are written


def write_factors(axis: Axis, low: float, high: float) -> None:
    """Ticks at 1, 2 and 5 times powers of ten, or at powers of ten where there would be many."""
    steps = (1.0,) if high > WIDE * low else (1.0, 2.0, 5.0)
    axis.set_major_locator(LogLocator(10.0, subs=steps))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.7g}"))
    axis.set_minor_locator(NullLocator())
