"""The one picture of the report's first screen: a run before and after, and the gap.

In: a diagnosis. Out: the channel that tells most in a held-out run, measured and simulated, beside
bars of what the chairs leave against the noise.
"""

from __future__ import annotations

from matplotlib.axes import Axes

from mjchair.diagnosis.result import Diagnosis
from mjchair.report.colours import AFTER, BEFORE
from mjchair.report.diagnosis_figures.whole_runs import draw_run, telling
from mjchair.report.diagnosis_words.first_screen import unforeseen_words
from mjchair.report.diagnosis_words.names import size
from mjchair.report.figure import Figure

PLATE = {"facecolor": "white", "edgecolor": "none", "pad": 1.0}  # behind a number


def figure(diagnosis: Diagnosis) -> Figure | None:
    """A held-out run, or the first that is shown where none is, and the gap."""
    evidence = diagnosis.evidence
    if evidence is None or not evidence.runs or diagnosis.gap is None:
        return None
    run = evidence.runs[0]
    lacks = any(e.of_chair for e in diagnosis.effects)
    channels = telling(run, 1, [e.channel for e in diagnosis.effects if e.channel and not lacks])
    if not channels:
        return None
    drawn = Figure(figsize=(9.4, 3.3), layout="constrained")
    left, right = drawn.subplots(1, 2, width_ratios=(3, 1))
    draw_run(left, run, channels[0])
    left.set_xlabel("time (s)")
    drawn.legend(loc="outside upper left", ncols=3, frameon=False, fontsize=9, markerscale=3.0)
    _bars(right, diagnosis)
    return drawn


def _bars(ax: Axes, diagnosis: Diagnosis) -> None:
    """What is left, in times the noise."""
    gap = diagnosis.gap
    assert gap is not None
    bars = [("as it was", gap.before, BEFORE)]
    if diagnosis.effects and gap.after is not None:
        bars.append(("corrected", gap.after, AFTER))
    names, values, colours = zip(*bars, strict=True)
    ax.bar(names, values, color=colours, width=0.6)
    ax.set_xlim(-0.7, len(bars) - 0.3)
    for k, value in enumerate(values):
        ax.annotate(
            size(value),
            (k, value),
            xytext=(0, 5),
            textcoords="offset points",
            ha="center",
            va="bottom",
            fontsize=9,
            bbox=PLATE,
        )
    ax.axhline(gap.noise_floor, color="0.3", ls=":", lw=1.3)
    ax.set_ylim(0.0, 1.18 * max(*values, gap.noise_floor))
    ax.set_ylabel("left over the noise (1)", fontsize=9)
    ax.set_title("dotted: noise alone", loc="left", fontsize=9)
    for side in ("top", "right"):
        ax.spines[side].set_visible(False)


def caption(diagnosis: Diagnosis) -> str:
    """What the picture shows."""
    runs = diagnosis.evidence.runs if diagnosis.evidence else ()
    if not runs:
        return ""
    kind = "that no fit has seen" if runs[0].held_out else "of the fit, since none is held out"
    return (
        f"Left: the run {runs[0].trial}, {kind}, simulated in one go from its first state with the "
        "measured inputs. Right: what the windows of 2\N{NO-BREAK SPACE}s leave, each from its own "
        "fitted state, so that what adds up over a whole run does not show there."
        + (unforeseen_words(diagnosis) if diagnosis.effects else "")
    )
