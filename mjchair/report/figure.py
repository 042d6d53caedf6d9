"""A figure that shows itself as the last line of a notebook's cell.

In: what matplotlib's Figure takes. Out: the same figure. A bare Figure of matplotlib is a line of
text in a notebook, unless pyplot was imported there before.
"""

from __future__ import annotations

import io

from matplotlib import figure


class Figure(figure.Figure):
    """matplotlib's Figure, with its picture for notebooks."""

    def _repr_png_(self) -> bytes:
        """The picture as PNG."""
        out = io.BytesIO()
        self.savefig(out, format="png")
        return out.getvalue()
