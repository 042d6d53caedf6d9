"""The gap of every trial before and after the correction, beside what noise gives.

In: a diagnosis. Out: a figure with a row a trial.
"""

from __future__ import annotations

import numpy as np

from mjchair.diagnosis.result import Diagnosis
from mjchair.report.colours import AFTER, BEFORE
from mjchair.report.diagnosis_figures.factor_axis import write_factors
from mjchair.report.figure import Figure

WIDE = 12.0  # largest over smallest value, beyond which the axis goes by factors


def figure(diagnosis: Diagnosis) -> Figure | None:
    """Rms of the whitened residual of each trial, with the noise floor."""
    if diagnosis.evidence is None:
        return None
    trials = diagnosis.evidence.trials
    before = np.array([np.nan if t.before is None else t.before for t in trials])
    after = np.array([np.nan if t.after is None else t.after for t in trials])
    drawn = Figure(figsize=(9.4, 0.3 * len(trials) + 1.3), layout="constrained")
    ax = drawn.subplots()
    at = np.arange(len(trials))
    ax.axvline(1.0, color="0.4", ls=":", lw=1.2, label="noise alone")
    if diagnosis.effects:
        ax.hlines(at, after, before, color="0.75", lw=1.5, zorder=1)
        ax.plot(after, at, "s", color=AFTER, label="corrected chair")
    ax.plot(before, at, "o", color=BEFORE, label="chair as it was")
    ax.set_yticks(at, [t.trial + (", held out" if t.held_out else "") for t in trials], fontsize=9)
    ax.set_ylim(len(trials) - 0.4, -0.6)
    values = np.r_[before, after if diagnosis.effects else np.nan, 1.0]
    low, high = max(float(np.nanmin(values)), 0.1), float(np.nanmax(values))
    if high > WIDE * low:
        ax.set_xscale("log")
        write_factors(ax.xaxis, low, high)
    else:
        ax.set_xlim(left=0.0)
    highest = diagnosis.evidence.windows.highest
    ax.set_xlabel(f"rms of the residual below {highest:g} Hz over the noise (1)")
    drawn.legend(frameon=False, fontsize=9, loc="outside right center")
    ax.grid(axis="x", alpha=0.3)
    return drawn
