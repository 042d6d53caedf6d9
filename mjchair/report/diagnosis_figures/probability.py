"""The probability of every explanation, as bars.

In: a diagnosis. Out: a figure, or None where the diagnosis gives no probabilities.
"""

from __future__ import annotations

from mjchair.diagnosis.result import Diagnosis
from mjchair.report.colours import AFTER, FAINT
from mjchair.report.diagnosis_words.explanations import explanations
from mjchair.report.diagnosis_words.names import hypothesis_words
from mjchair.report.figure import Figure
from mjchair.units import probable

MOST = 8  # bars; the rest is one more
LEAST = 0.005  # a probability below this has no bar of its own


def figure(diagnosis: Diagnosis) -> Figure | None:
    """Bars, the most probable first; what is named has the colour of the corrected chair.

    Explanations that hold what is named and more are one bar under it: together they are how
    probable it is that the named effects are there.
    """
    if not diagnosis.probability:
        return None
    shown = [e for e in explanations(diagnosis) if e.alone >= LEAST][:MOST]
    bars = []
    for e in shown:
        colour = AFTER if e.named else FAINT
        bars.append((hypothesis_words(e.name), e.alone, colour))
        if e.more >= LEAST:
            bars.append(("the same, and more", e.more, colour))
    rest = sum(diagnosis.probability.values()) - sum(p for _, p, _ in bars)
    if rest >= LEAST:
        bars.append(("everything else", rest, FAINT))
    names, values, colours = zip(*bars[::-1], strict=True)
    drawn = Figure(figsize=(9.4, 0.3 * len(bars) + 0.7), layout="constrained")
    ax = drawn.subplots()
    ax.barh(names, [100.0 * v for v in values], color=colours)
    for k, value in enumerate(values):
        ax.text(100.0 * value + 1.0, k, probable(value), va="center", fontsize=9)
    ax.set_xlim(0.0, 112.0)
    ax.set_xticks([0, 20, 40, 60, 80, 100])
    ax.set_xlabel("probability (%)")
    ax.spines["bottom"].set_bounds(0.0, 100.0)
    for side in ("top", "right"):
        ax.spines[side].set_visible(False)
    return drawn
