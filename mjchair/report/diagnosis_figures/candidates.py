"""What every effect of the library, alone, could do.

In: a diagnosis. Out: bars of size, of gain on runs left out and of likeness to what was chosen;
where nothing was chosen, of the share of the gap that each closes, if there is a gap.
"""

from __future__ import annotations

from matplotlib.ticker import EngFormatter, MaxNLocator

from mjchair.diagnosis.result import Candidate, Diagnosis
from mjchair.report.colours import AFTER, FAINT
from mjchair.report.figure import Figure

MOST = 12  # effects that are drawn
LOSS = 0.5  # of the largest gain, at which bars of losses are cut


def leading(diagnosis: Diagnosis, most: int) -> list[Candidate]:
    """Effects: those that were chosen first, then the largest in these data."""
    chosen = {(e.name, e.channel) for e in diagnosis.effects}
    order = sorted(
        diagnosis.candidates, key=lambda c: ((c.name, c.channel) not in chosen, -c.detectability)
    )
    return order[:most]


def figure(diagnosis: Diagnosis) -> Figure | None:
    """Bars of the leading effects, the chosen ones in the colour of the corrected chair."""
    top = leading(diagnosis, MOST)[::-1]
    if not top:
        return None
    chosen = {(e.name, e.channel) for e in diagnosis.effects}
    names = [c.name.replace("_", " ") + (f" ({c.channel})" if c.channel else "") for c in top]
    colours = [AFTER if (c.name, c.channel) in chosen else FAINT for c in top]
    drawn = Figure(figsize=(9.4, 0.28 * max(len(top), 3) + 1.0), layout="constrained")
    columns = [
        ("size in these data (sigma)", [c.detectability for c in top]),
        ("gain on runs left out (chi²)", _cut([c.held_out_gain for c in top])),
    ]
    shares = [("likeness to the chosen, |cos|", [c.collinear for c in top])]
    shares.append(("share of the gap that it closes", [c.closure for c in top]))
    columns += [share for share in shares if any(share[1])][:1]
    axes = drawn.subplots(1, len(columns), sharey=True)
    for ax, (label, values) in zip(axes, columns, strict=True):
        ax.barh(names, values, color=colours)
        ax.set_xlabel(label, fontsize=9)
        ax.grid(axis="x", alpha=0.3)
        ax.xaxis.set_major_locator(MaxNLocator(4))
        ax.xaxis.set_major_formatter(EngFormatter(sep=""))
    axes[0].tick_params(axis="y", labelsize=8.5)
    for ax in axes[2:]:
        ax.set_xlim(0.0, 1.0)
        ax.xaxis.set_major_formatter("{x:g}")
    return drawn


def _cut(gains: list[float]) -> list[float]:
    """Gains, with losses cut: how bad is of no interest."""
    least = -LOSS * max([*gains, 1.0])
    return [max(g, least) for g in gains]
