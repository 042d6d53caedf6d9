"""Whether the torques, the speeds and the mass of a study go together.

In: runs, the rear axle of the chair and its mass. Out: notes, or one line that names what may be in
other units. By Newton's second law the impulse of the torques at the rear wheels is mass times what
the chair gains in speed, but for a steady resistance and one in proportion to speed. This finds
km/h, forces at the rim in N, pounds and a missing rider where no other channel contradicts them.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from scipy.integrate import cumulative_trapezoid

from mjchair.diagnosis.data.sign_checks import SIDES, speeds, torque_at
from mjchair.diagnosis.data.unit_checks import Story, at, wheel_pairs
from mjchair.errors import MjchairError
from mjchair.measurement.trial import Trial
from mjchair.model.rolling import RearAxle
from mjchair.simulation.inputs import Inputs
from mjchair.simulation.table import Array

# A load of 40 kg on a chair of 90 kg comes out as 1.6, a rider who moves (a measured run of 30
# pushes) as 1.03, and one wheel seen of a chair that turns as 0.87; km/h are 0.28, a force at the
# rim 3.7 and pounds 0.5
DOUBTFUL, WRONG = 1.75, 2.5
SEEN = 1.0  # N s rms of an impulse, below which it tells nothing: strokes make 4 to 16
TOLD = 0.8  # of the variance of an impulse, that must go with the speed (0.84 with strokes)


def check(trials: Iterable[tuple[Trial, float]], axle: RearAxle) -> list[str]:
    """Refuse units that no chair of this mass can have, and note a doubtful mass.

    The run in the middle speaks for all: a single run may have another fault.

    Args:
      trials: each run, and the mass of chair, rider and load, kg. axle: of the chair.

    Raises:
      MjchairError: torques and speeds tell a mass WRONG times as large, or as small, as is given.
    """
    masses = [(_mass(trial, axle), given, trial.name) for trial, given in trials]
    told = sorted((mass / given, name, mass, given) for mass, given, name in masses if mass > 0.0)
    if not told:
        return []
    ratio, name, mass, given = told[len(told) // 2]
    off = max(ratio, 1.0 / ratio)
    if off < DOUBTFUL:
        return []
    said = (
        f"{name}: its torques and speeds go with a mass of {mass:.0f} kg, and the study gives "
        f"{given:.0f} kg"
    )
    asked = _doubts(ratio)
    if off > WRONG:
        raise MjchairError(f"{said}: {asked}? Give SI units, or the unit in the header")
    return [f"{said}: {asked}?"]


def _doubts(ratio: float) -> str:
    """What may be wrong where a run tells so many times the mass that is given."""
    if ratio < 1.0:
        return "are the speeds in km/h, or the masses in lb, or is a torque of one wheel missing"
    return "are the torques forces at the rim (N) or in N cm, or is the rider's mass left out"


def _mass(trial: Trial, axle: RearAxle) -> float:
    """The mass that torques and speeds tell, kg; 0 where they do not tell it."""
    if trial.inputs is None or not {f"{s}_wheel" for s in SIDES} <= set(trial.inputs.controls):
        return 0.0
    for story in _rolling(trial, axle):
        mass = _told(story, _force(trial.inputs, axle, story.time))
        if mass > 0.0:
            return mass
    return 0.0


def _rolling(trial: Trial, axle: RearAxle) -> list[Story]:
    """How fast the chair rolls (m/s): the mean of both wheels where both are seen."""
    seen = speeds(trial, axle)
    both = [
        Story(left.time, 0.5 * (left.values + at(right, left.time)), "")
        for left, right in wheel_pairs(seen)
    ]
    return both or list(seen.values())


def _force(inputs: Inputs, axle: RearAxle, time: Array) -> Array:
    """By which the torques drive the chair (n,), N."""
    return sum(
        (torque_at(inputs, side, time) / axle.radius(side) for side in SIDES), np.zeros(time.size)
    )


def _told(story: Story, force: Array) -> float:
    """The mass (kg) by which a force (n,), N, changes a speed; 0 where it is not told."""
    since = story.time - story.time[0]
    impulse, way = (cumulative_trapezoid(v, story.time, initial=0.0) for v in (force, story.values))
    steady = np.column_stack([np.ones(since.size), since, way])
    impulse, speed = (v - steady @ np.linalg.lstsq(steady, v)[0] for v in (impulse, story.values))
    varies = float(impulse @ impulse)
    if varies < SEEN**2 * since.size or not speed.any():
        return 0.0
    mass = float(impulse @ speed / (speed @ speed))
    left = impulse - mass * speed
    return mass if left @ left < (1.0 - TOLD) * varies else 0.0
