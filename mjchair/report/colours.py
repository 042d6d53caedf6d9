"""The colours of every figure, film and page: one table, so that a colour keeps its meaning.

In: nothing. Out: colours as hexadecimal text for matplotlib and pages, and as RGB for films.

The hues are those of Okabe and Ito (Color Universal Design, 2008) and of Paul Tol's `muted` scheme
(SRON technical note EPS/TN/09-002, 2021), which people with any of the usual kinds of colour
blindness tell apart. Two lines of one figure also differ in their style (solid, dashed) or marker.
"""

from __future__ import annotations

from matplotlib import colors

# The tire's forces, in films and figures. Lateral is green, as in Silva & Dedini (2007).
FORCES = {"lateral": "#009e73", "longitudinal": "#e69f00", "load": "#0072b2"}

# The two sides of a chair.
SIDES = {"left_wheel": "#332288", "right_wheel": "#cc6677"}

# A measurement, and the chair before and after a correction.
MEASURED, BEFORE, AFTER = "#222222", "#d55e00", "#0072b2"

# Series without a meaning of their own, such as loads on the rig or axle positions, in this order.
SERIES = (
    "#0072b2",
    "#d55e00",
    "#009e73",
    "#cc79a7",
    "#332288",
    "#999933",
    "#56b4e9",
    "#661100",
)

# What stays in the background.
PATH, WHEEL, FAINT, AXIS_LINE, NOTE = "#555555", "#999999", "#9aa7b5", "#cccccc", "#444444"

# Sizes from small to large, as in a map of residuals: equal steps of lightness, from light to dark.
SIZES = "cividis_r"


def rgb(colour: str) -> tuple[float, float, float]:
    """A colour of this table as red, green and blue, 0 to 1."""
    return colors.to_rgb(colour)
