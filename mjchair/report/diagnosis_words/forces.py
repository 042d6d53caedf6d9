"""What the report says a missing force goes with, and what comes once a turn.

In: a diagnosis. Out: what of its forces is told, and how the chair moved where it disagrees.
"""

from __future__ import annotations

from mjchair.diagnosis.explain.column_ids import Quantity
from mjchair.diagnosis.fit.process import Part
from mjchair.diagnosis.next_experiment.wording import plain
from mjchair.diagnosis.replay.pulses import Force
from mjchair.diagnosis.result import Diagnosis, Disagreement, Estimate, MissingForce

# what a force may go with that is not known where nothing tells how the chair turns
TURNING = (Quantity.YAW_RATE, Quantity.HEADING, Quantity.SWIVEL, Quantity.RIGHT_TURN)
TURNS = {"wheel_turn": str(Part.WHEEL_TURN), "caster_turn": str(Part.CASTER_TURN)}
FORCES = {Force.FORWARD: "forward force", Force.YAW: "yaw moment"}
STANDS_OUT = 5.0  # sigmas, from which the first screen says what a force goes with
TOLD = 2  # of these
CLEAR = 0.5  # of what shakes the chair forward: a force once a turn of this size is told


def clear_turns(diagnosis: Diagnosis) -> dict[str, tuple[str, Estimate]]:
    """When and how large a force once a turn is that stands out of what shakes the chair."""
    process = diagnosis.process
    return {
        name: (when, process[name])
        for name, when in TURNS.items()
        if name in process and process[name].value > CLEAR * process["drive"].value
    }


def known_drivers(diagnosis: Diagnosis) -> list[MissingForce]:
    """What the force goes with; without what turns where nothing tells how the chair turns."""
    if diagnosis.evidence is None or diagnosis.evidence.turns:
        return diagnosis.drivers
    return [
        d
        for d in diagnosis.drivers
        if d.force == Force.FORWARD and d.goes_with.quantity not in TURNING
    ]


def goes_with(diagnosis: Diagnosis) -> str:
    """What the force that shows most goes with besides the time, as a clause; empty: nothing."""
    clear = [
        d
        for d in known_drivers(diagnosis)
        if d.sigmas > STANDS_OUT and d.goes_with.quantity != Quantity.TIME
    ]
    if not clear:
        return ""
    force = clear[0].force
    drivers = [plain(str(d.goes_with)) for d in clear if d.force == force][:TOLD]
    return f"the {FORCES.get(force, force)} that is missing goes with {' or '.join(drivers)}"


def regime(diagnosis: Diagnosis, cell: Disagreement) -> str:
    """How the chair moved where it disagrees, as far as that is known."""
    turns = diagnosis.evidence is None or diagnosis.evidence.turns
    known = {k: v for k, v in cell.regime.items() if turns or k != "yaw_rate"}
    return "; ".join(f"{plain(k)} {v}" for k, v in known.items())
