"""The figure of a tire that was fitted to rig data: curves with their intervals, and residuals.

In: a fit of mjchair.identification. Out: a matplotlib figure.
"""

from __future__ import annotations

import numpy as np

from mjchair.identification.causes import added_force
from mjchair.identification.fit import Fit
from mjchair.report.colours import AXIS_LINE
from mjchair.report.figure import Figure
from mjchair.report.rig_figures import SIGN, load_colour


def fitted(fit: Fit) -> Figure:
    """Measured force and fitted curves with 95 % intervals; residuals over angle below.

    The force from hidden causes is subtracted from the measured points, so points and curves show
    the tire alone; toe shifts the points along the angle axis.
    """
    table = fit.table
    figure = Figure(figsize=(7.8, 6.4), layout="constrained")
    top, bottom = figure.subplots(2, 1, height_ratios=(3, 1), sharex=True)
    n = len(fit.curve.parameters)
    values = {name: float(v) for name, v in zip(fit.causes, fit.theta[n:], strict=True)}
    angle = table.angle + values.get("toe", 0.0)
    force = table.fy - added_force(values, table)
    reach = np.linspace(min(angle.min(), 0.0), angle.max(), 201)
    residual = fit.residuals[: len(table)]
    for i, load in enumerate(np.unique(table.load)):
        colour = load_colour(i)
        rows = table.load == load
        curve, half = fit.lateral(reach, load)
        top.fill_between(reach, -curve - half, -curve + half, color=colour, alpha=0.2, lw=0)
        top.plot(reach, -curve, color=colour, lw=1.4)
        top.plot(angle[rows], -force[rows], "o", color=colour, ms=5, label=f"{load:g} N")
        bottom.plot(angle[rows], -residual[rows], "o", color=colour, ms=4)
    bottom.axhspan(-2.0 * fit.noise, 2.0 * fit.noise, color="0.9", zorder=0)
    for axis in (top, bottom):
        axis.axhline(0.0, color=AXIS_LINE, lw=0.8, zorder=0)
        for side in ("top", "right"):
            axis.spines[side].set_visible(False)
    top.set_ylabel(SIGN)
    bottom.set_ylabel("residual (N)")
    bottom.set_xlabel("slip angle (deg)")
    bottom.annotate(
        f"grey: twice the noise of {fit.noise:.2g} N",
        (0.99, 0.96),
        xycoords="axes fraction",
        ha="right",
        va="top",
        fontsize=8,
        color="0.35",
    )
    removed = f", {' and '.join(fit.causes)} taken off" if fit.causes else ""
    top.set_title(f"{fit.curve.family} fitted to {len(table)} runs{removed}; bands: 95 %")
    top.legend(
        fontsize=9, frameon=False, title="load", loc="center left", bbox_to_anchor=(1.0, 0.5)
    )
    return figure
