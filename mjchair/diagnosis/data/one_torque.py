"""Whether the wheel without a torque column was driven as well, where a turn was measured.

In: a trial with the torque of one wheel and a channel that tells how the chair turns. Out: the
trial, with that torque on both wheels if the chair hardly turns by it, and a note. One instrumented
rim beside an IMU is the usual set-up of a laboratory, and both hands push then; driven by one wheel
alone a chair turns as fast as its own inertia lets it.
"""

from __future__ import annotations

import numpy as np

from mjchair.diagnosis.data.sign_checks import torque_at
from mjchair.diagnosis.data.trial_checks import (
    SIDES,
    driven_sides,
    tells_turning,
    with_torque_on_both,
)
from mjchair.diagnosis.data.unit_checks import turning
from mjchair.measurement.trial import Trial
from mjchair.model.rolling import RearAxle
from mjchair.units import per_cent

# of the turn that the one torque would make alone, below which both wheels were driven: 0.75 to
# 1.1 are seen of simulated chairs with one wheel driven, and 0.3 to 0.4 where the other has 0.6 of
# the torque
ALONE = 0.5
OTHERWISE = 1.5  # of it, above which the other wheel turned the chair as well
TOLD = 0.15  # standard error of that share, up to which it is believed
FEW = 8  # intervals, of which less tells no course


def shared(trial: Trial, axle: RearAxle, mass: float) -> tuple[Trial, list[str]]:
    """The trial with its one torque on both wheels, unless the chair turns by it, and a note.

    Args:
      axle: of the chair. mass: of chair and rider, kg.
    """
    driven = driven_sides(trial)
    if len(driven) != 1 or not tells_turning(trial.channels):
        return trial, []
    (side,) = driven
    said = f"{trial.name}: no torque column of the {SIDES[side]} wheel; it "
    turn = _share(trial, side, axle, mass)
    if turn is None:
        return trial, [f"{said}is not driven. If it was, add its torque"]
    seen = f"the chair turns with {per_cent(max(turn, 0.0))} of what the {side} one alone would do"
    if turn > OTHERWISE:
        seen += ". If it was pushed the other way, add its torque"
    if abs(turn) >= ALONE:
        return trial, [f"{said}is not driven, since {seen}"]
    alike = f"{said}is assumed to be driven alike, since {seen}"
    return with_torque_on_both(trial, side), [alike]


def _share(trial: Trial, side: str, axle: RearAxle, mass: float) -> float | None:
    """Turn of the chair, over that which the one torque would make; None: too little is told.

    What brakes a turn goes with its rate. The chair's radius of gyration is about half its track
    (0.28 m of the manual chair with its occupant, whose half is 0.27 m).
    """
    assert trial.inputs is not None
    stories = [s for s in turning(trial, axle).values() if s.time.size > FEW]
    if not stories:
        return None
    rate = stories[0]
    torque = torque_at(trial.inputs, side, rate.time)
    if not torque.any():
        return None
    sign = -1.0 if side == "left" else 1.0
    moved = sign * torque / (axle.radius(side) * 0.5 * axle.track * mass)  # rad/s^2
    steps = np.diff(rate.time)
    columns = [0.5 * (v[1:] + v[:-1]) * steps for v in (moved, rate.values)]
    design, change = np.stack(columns, axis=1), np.diff(rate.values)
    cover = np.linalg.pinv(
        design.T @ design
    )  # of a chair that does not turn at all, one column is 0
    shares = cover @ design.T @ change
    left = change - design @ shares
    error = np.sqrt(cover[0, 0] * (left @ left) / (change.size - 2))
    return float(shares[0]) if error < TOLD else None
