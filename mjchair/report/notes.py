"""Put a title above and a note below a figure of a run, with lines that fit its width.

In: a figure and texts. Out: the figure with them.
"""

from __future__ import annotations

import textwrap

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mjchair.report.colours import NOTE

SIZE = 8.5  # points, of a note
LETTER = 0.56  # width of a letter of DejaVu Sans over its size, on average
POINTS = 72.0  # in an inch


def add_title_and_note(figure: Figure, axes: Axes, title: str, note: str) -> None:
    """Put a title above `axes`, and a note of several lines at the foot of the figure."""
    if title:
        axes.set_title(title, loc="left")
    if note:
        letters = int(0.96 * figure.get_figwidth() * POINTS / (LETTER * SIZE))
        lines = textwrap.fill(note, letters)
        figure.supxlabel(lines, fontsize=SIZE, color=NOTE, x=0.02, ha="left")
