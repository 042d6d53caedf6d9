"""The probability of every explanation, as bars.

In: a diagnosis. Out: a figure, or None where the diagnosis gives no probabilities.
"""

from __future__ import annotations

from collections.abc import Mapping

from mjchair.diagnosis.result import Diagnosis
from mjchair.report.colours import AFTER, FAINT
from mjchair.report.diagnosis_words import hypothesis_words, named_keys, with_more
from mjchair.report.figure import Figure

MOST = 8  # bars; the rest is one more
LEAST = 0.005  # a probability below this has no bar of its own


def figure(diagnosis: Diagnosis) -> Figure | None:
    """Bars, the most probable first; what is named has the colour of the corrected chair.

    Explanations that hold what is named and more are one bar under it: together they are how
    probable it is that the named effects are there.
    """
    probability: Mapping[str, float] | None = getattr(diagnosis, "probability", None)
    if not probability:
        return None
    named = named_keys(diagnosis)
    _, more, others = with_more(probability, named)
    ordered = sorted(others.items(), key=lambda item: -item[1])
    shown = [(name, p) for name, p in ordered if p >= LEAST][:MOST]
    bars = []
    for name, p in shown:
        own = set(name.split("+")) == named
        bars.append((hypothesis_words(name), p, AFTER if own else FAINT))
        if own and more >= LEAST:
            bars.append(("the same, and more", more, AFTER))
    rest = sum(probability.values()) - sum(p for _, p, _ in bars)
    if rest >= LEAST:
        bars.append(("everything else", rest, FAINT))
    names, values, colours = zip(*bars[::-1], strict=True)
    drawn = Figure(figsize=(9.4, 0.3 * len(bars) + 0.7), layout="constrained")
    ax = drawn.subplots()
    ax.barh(names, [100.0 * v for v in values], color=colours)
    for k, value in enumerate(values):
        ax.text(100.0 * value + 1.0, k, f"{100.0 * value:.0f} %", va="center", fontsize=9)
    ax.set_xlim(0.0, 112.0)
    ax.set_xticks([0, 20, 40, 60, 80, 100])
    ax.set_xlabel("probability (%)")
    for side in ("top", "right"):
        ax.spines[side].set_visible(False)
    return drawn
