"""How large the force is by which a person who moves pushes the chair, along a run.

In: a run. Out: the size (N) of that force, over about a stroke around any time. No measured motion
is quite that of the body (markers slide on the skin, segments are no rigid bodies) and no stroke is
quite like another, so a part of this force is in no model; how large a part, the data tell
(mjchair.diagnosis.fit.process).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from mjchair.diagnosis.data.study import Run, Study
from mjchair.diagnosis.replay import strokes
from mjchair.diagnosis.replay.measured_motion import motions
from mjchair.model import moving_share

Array = NDArray[np.float64]
STROKE = 1.0  # s, about the time of a stroke
STEP = 0.01  # s, of the grid on which the force is kept


def person_force(study: Study, run: Run) -> tuple[Array, Array]:
    """Times (n,) s, and the size (n,) N of the force there; 0 where nothing tells of a person.

    With a measured motion it is the rider's mass times the acceleration of the motion. Without one
    it is what the hands push, taken as about the size of what trunk and arms do (assumption).
    """
    time = np.arange(run.trial.time[0], run.trial.time[-1] + STEP, STEP)
    measured = [motion.acceleration_at(time) for motion in motions(run).values()]
    if measured:
        force = moving_share.rider_mass(study.spec) * np.linalg.norm(measured, axis=0)
    elif study.torque_measured and strokes.courses(run):
        force = _pushed(study, run, time)
    else:
        return time, np.zeros(time.size)
    around = uniform_filter1d(force**2, max(1, round(STROKE / STEP)), mode="nearest")
    return time, np.sqrt(np.maximum(around, 0.0))


def _pushed(study: Study, run: Run, time: Array) -> Array:
    """Force (n,) N of the hands' torques at the ground."""
    inputs = run.trial.inputs
    assert inputs is not None
    out = np.zeros(time.size)
    for name in inputs.controls:
        for side in ("left", "right"):
            if name.endswith(f"{side}_wheel"):
                out += inputs.at(name, time) / study.axle.radius(side)
    return out
