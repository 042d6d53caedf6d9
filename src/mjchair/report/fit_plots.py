"""Figures of a fit to rig data: curves with their intervals, and residuals."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from mjchair.identification.causes import added_force
from mjchair.identification.fit import Fit
from mjchair.report.rig_plots import LOADS, SIGN


def fitted(fit: Fit) -> Figure:
    """Measured force and fitted curves with 95 % intervals; residuals over angle below.

    What the hidden causes add is taken off the measured points, so points and curves are of the
    tire alone; toe moves the points along the angle.
    """
    table = fit.table
    figure, (top, bottom) = plt.subplots(
        2, 1, figsize=(7.8, 6.4), height_ratios=(3, 1), sharex=True, layout="constrained"
    )
    n = len(fit.curve.parameters)
    values = {name: float(v) for name, v in zip(fit.causes, fit.theta[n:], strict=True)}
    angle = table.angle + values.get("toe", 0.0)
    force = table.fy - added_force(values, table)
    reach = np.linspace(min(angle.min(), 0.0), angle.max(), 201)
    residual = fit.residuals[: len(table)]
    for i, load in enumerate(np.unique(table.load)):
        colour = LOADS[i % len(LOADS)]
        rows = table.load == load
        curve, half = fit.lateral(reach, load)
        top.fill_between(reach, -curve - half, -curve + half, color=colour, alpha=0.2, lw=0)
        top.plot(reach, -curve, color=colour, lw=1.4)
        top.plot(angle[rows], -force[rows], "o", color=colour, ms=5, label=f"{load:g} N")
        bottom.plot(angle[rows], -residual[rows], "o", color=colour, ms=4)
    bottom.axhspan(-2.0 * fit.noise, 2.0 * fit.noise, color="0.9", zorder=0)
    for axis in (top, bottom):
        axis.axhline(0.0, color="0.8", lw=0.8, zorder=0)
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
    top.legend(fontsize=9, frameon=False, title="load", loc="upper left")
    return figure
