"""The force that would close the gap, over what it may go with.

In: a diagnosis. Out: a figure with the mean force at every level of speed, yaw rate, heading and of
what else it goes with.
"""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from mjchair.diagnosis.explain.column_ids import Quantity
from mjchair.diagnosis.replay.pulses import Force
from mjchair.diagnosis.result import Diagnosis, ForceLevels, ForceSamples
from mjchair.diagnosis.rules import Verdict
from mjchair.report.colours import AXIS_LINE, BEFORE
from mjchair.report.diagnosis_words.forces import TURNING
from mjchair.report.figure import Figure

LABELS = {  # what a force is drawn against
    Quantity.SPEED: "speed (m/s)",
    Quantity.YAW_RATE: "yaw rate (rad/s)",
    Quantity.HEADING: "heading (rad)",
    Quantity.TORQUE: "torque, both wheels (N m)",
    Quantity.SWIVEL: "swivel of the casters (rad)",
    Quantity.LEFT_TURN: "angle, left wheel (rad)",
    Quantity.RIGHT_TURN: "angle, right wheel (rad)",
    Quantity.STROKE: "phase of the stroke (rad)",
}
FORCES = {Force.FORWARD: "missing force forward", Force.YAW: "missing yaw moment"}
USUAL = (Quantity.SPEED, Quantity.YAW_RATE, Quantity.HEADING)
PANELS = 4
VAGUE = 4.0  # times the median standard error, beyond which a level says nothing


def figure(diagnosis: Diagnosis) -> Figure | None:
    """Force and moment against speed, yaw rate, heading and the strongest other driver."""
    if diagnosis.evidence is None:
        return None
    evidence = diagnosis.evidence
    forces = {
        kind: force
        for kind, force in evidence.forces.items()
        if force.levels and (evidence.turns or kind == Force.FORWARD)
    }
    if not forces:
        return None
    drawn = Figure(figsize=(9.4, 2.5 * len(forces) + 0.2), layout="constrained")
    axes = drawn.subplots(len(forces), PANELS, sharey="row", squeeze=False)
    for row, (name, force) in zip(axes, forces.items(), strict=True):
        shown = _drivers(diagnosis, name, force)
        for ax, driver in zip(row, shown, strict=False):
            _levels(ax, force.levels[driver])
            ax.set_xlabel(LABELS[driver], fontsize=9)
        for ax in row[len(shown) :]:
            ax.set_axis_off()
        row[0].set_ylabel(f"{FORCES[name]}\n({force.unit})")
    return drawn


def caption(diagnosis: Diagnosis) -> str:
    """What the figure shows."""
    shown = (
        "Mean force that the runs ask for at each level, with its standard error; the levels of a "
        "panel are fitted together, and nothing draws them towards zero."
    )
    if diagnosis.verdict == Verdict.NONE:
        return f"{shown} Nothing is missing that matters (section 1)."
    return shown


def _drivers(diagnosis: Diagnosis, name: Force, force: ForceSamples) -> list[Quantity]:
    """The strongest drivers of this force first, then the usual ones."""
    strongest = [d.goes_with.quantity for d in diagnosis.drivers if d.force == name]
    order = dict.fromkeys([*USUAL, *strongest, Quantity.TORQUE, *LABELS])
    turns = diagnosis.evidence is None or diagnosis.evidence.turns
    shown = [d for d in order if d in force.levels and d in LABELS]
    return [d for d in shown if turns or d not in TURNING][:PANELS]


def _levels(ax: Axes, levels: ForceLevels) -> None:
    told = levels.std < VAGUE * np.median(levels.std)
    ax.axhline(0.0, color=AXIS_LINE, lw=0.8)
    ax.errorbar(
        levels.middle[told],
        levels.value[told],
        levels.std[told],
        fmt="o-",
        ms=4.5,
        lw=0.8,
        color=BEFORE,
    )
    ax.grid(alpha=0.3)
    ax.locator_params(axis="x", nbins=5)
