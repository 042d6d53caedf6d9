"""Checks of a measured motion of a person: jumps that no body makes.

In: a trial. Out: the trial as it is, and a note for each run whose motion jumps.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import maximum_filter1d

from mjchair.measurement.trial import Trial
from mjchair.simulation.inputs import OTHER_COLUMNS
from mjchair.simulation.table import Array

CLEAR = 8.0  # standard deviations of a step beside the mean of its neighbours (assumption)
LEAST = 0.003  # m: markers on skin scatter by a millimetre (assumption)
FEWEST = 20  # steps
ONE = 1.5  # usual times between samples: less is one


def jumps(trial: Trial) -> tuple[Trial, list[str]]:
    """The trial, and a note where a measured motion jumps between two samples.

    Two markers that were taken for one another, or a marker that was lost, move the centre of mass
    by millimetres at once. No force goes with that, and what it leaves passes for noise.
    """
    motions = {name: v for name, v in trial.other.items() if OTHER_COLUMNS.get(name) == "m"}
    said = [_jump(trial.time, name, values) for name, values in motions.items()]
    return trial, [f"{trial.name}: {line}" for line in said if line]


def _jump(time: Array, name: str, values: Array) -> str:
    """What is said of the jumps of a motion (n,) m at times (n,) s; empty: there are none."""
    there = ~np.isnan(values)
    if there.sum() <= FEWEST:
        return ""
    time, between = time[there], np.diff(time[there])
    # across samples that are missing a person may have gone anywhere
    beyond = np.where(between < ONE * np.median(between), _beyond(values[there]), 0.0)
    at = np.flatnonzero(beyond)
    if not at.size:
        return ""
    worst = at[np.argmax(np.abs(beyond[at]))]
    times = "" if at.size == 1 else f", one of {at.size} such steps"
    return (
        f"{name} jumps by {abs(1e3 * beyond[worst]):.2g} mm at {time[worst + 1]:.2f} s{times}; was "
        "a marker lost, or taken for another? No force goes with a jump: mend it, or leave these "
        "samples empty"
    )


def _beyond(place: Array) -> Array:
    """By how much the step to the next sample differs from those around it, m; 0 where alike.

    Args:
      place: (n,) m.

    Returns:
      (n - 1,)
    """
    step = np.diff(place)
    off = np.zeros(step.size)
    off[1:-1] = step[1:-1] - 0.5 * (step[:-2] + step[2:])
    size = np.abs(off)
    usual = 1.4826 * float(np.median(size))  # standard deviation, if normal
    # a jump stands out in the steps to its two sides as well, by half
    largest = size >= maximum_filter1d(size, 3)
    return np.where(largest & (size > max(CLEAR * usual, LEAST)), off, 0.0)
