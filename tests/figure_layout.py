"""What makes a figure hard to read, measured with matplotlib's own renderer."""

from __future__ import annotations

import itertools

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox

SLACK = 1.0  # pixels that letters may share


class Layout:
    """A figure as it is drawn: where its texts and legends stand, in pixels."""

    def __init__(self, figure: Figure) -> None:
        """Draw the figure once."""
        self.figure = figure
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        self.renderer = canvas.get_renderer()

    def texts(self) -> list[tuple[str, Bbox]]:
        """Every text that is drawn, with its place."""
        hidden = {
            label
            for axes in self.figure.axes
            for axis in _axis_lines(axes)
            for tick in (*axis.get_major_ticks(), *axis.get_minor_ticks())
            for label in (tick.label1, tick.label2)
            if not _drawn(axis, tick)
        }
        return [
            (text.get_text(), text.get_window_extent(self.renderer))
            for text in self.figure.findobj(Text)
            if text.get_visible() and text.get_text().strip() and text not in hidden
        ]

    def overlapping(self) -> list[tuple[str, str]]:
        """Pairs of texts that are drawn over each other."""
        boxes = [(text, _shrunk(box)) for text, box in self.texts()]
        return [(a, b) for (a, p), (b, q) in itertools.combinations(boxes, 2) if p.overlaps(q)]

    def cut_off(self) -> list[str]:
        """Texts that reach beyond the figure's edge."""
        edge = self.figure.bbox
        return [
            text
            for text, box in self.texts()
            if box.x0 < edge.x0 - SLACK
            or box.y0 < edge.y0 - SLACK
            or box.x1 > edge.x1 + SLACK
            or box.y1 > edge.y1 + SLACK
        ]

    def legends_over_axes(self) -> list[str]:
        """First labels of legends whose box lies where something may be drawn."""
        axes = [a for a in self.figure.axes if a.axison]
        legends = [*self.figure.legends, *(a.get_legend() for a in axes if a.get_legend())]
        return [
            legend.get_texts()[0].get_text()
            for legend in legends
            if any(
                _shrunk(legend.get_window_extent(self.renderer)).overlaps(
                    a.get_window_extent(self.renderer)
                )
                for a in axes
            )
        ]


def _axis_lines(axes):
    """The axes' own x and y axis, and those of second axes at its rims."""
    return [axis for a in (axes, *axes.child_axes) for axis in (a.xaxis, a.yaxis)]


def _drawn(axis, tick):
    """Whether a tick is drawn: those beyond the axis' ends are not."""
    low, high = sorted(axis.get_view_interval())
    margin = 1e-6 * (high - low)
    return low - margin <= tick.get_loc() <= high + margin


def _shrunk(box: Bbox) -> Bbox:
    return Bbox.from_extents(box.x0 + SLACK, box.y0 + SLACK, box.x1 - SLACK, box.y1 - SLACK)


def assert_legible(figure: Figure) -> None:
    """Nothing overlaps, nothing is cut, no legend covers a drawing."""
    layout = Layout(figure)
    assert not layout.overlapping()
    assert not layout.cut_off()
    assert not layout.legends_over_axes()
