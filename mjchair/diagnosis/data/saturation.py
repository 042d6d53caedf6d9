"""Whether a sensor was stuck, or at its end: samples that have one value to the last digit.

In: a study. Out: a note on each column of a run that is so. What a sensor at its end hides is no
noise, and nothing makes up for it; so the samples stay, and the person is told.
"""

from __future__ import annotations

import numpy as np

from mjchair.diagnosis.data.study import Study
from mjchair.diagnosis.data.trial_checks import STAYS
from mjchair.measurement.trial import Trial
from mjchair.simulation.table import Array
from mjchair.units import per_cent

SHARE = 0.02  # of the samples, at the end, from which on it is said (assumption)
VALUES = 30  # different values of a column at least: one that has fewer is coarse
PILE = 10.0  # times as often as other values are seen (median), and as the value next to it


def notes(study: Study) -> list[str]:
    """A line for each channel, and each measured torque, that was stuck or at its end."""
    return [line for run in study.runs for line in _of_run(run.trial, study.torque_measured)]


def _of_run(trial: Trial, torque_measured: bool) -> list[str]:
    rates = [n for n in trial.channels if not n.endswith(tuple(STAYS))]  # a chair may stop
    columns = {name: trial.samples(name)[1] for name in rates}
    if torque_measured and trial.inputs is not None:
        torques = {f"torque of {n}": trial.inputs.samples(n)[1] for n in trial.inputs.controls}
        columns |= torques
    out = []
    for name, values in columns.items():
        if values.size and values[0] != 0.0 and not np.ptp(values):
            out.append(f"{trial.name}: {name} is exactly {values[0]:.4g} throughout; was it stuck?")
        for which, end in _ends(values).items():
            share = float(np.mean(values == end))
            out.append(
                f"{trial.name}: {per_cent(share)} of {name} is exactly {end:.4g}, its {which} "
                "value; was the sensor at its end? What it did not see is missing in every answer"
            )
    return out


def _ends(values: Array) -> dict[str, float]:
    """The largest and the least value, where they pile up; 0 is no sensor's end."""
    seen, counts = np.unique(values, return_counts=True)
    if seen.size < VALUES:
        return {}
    enough = max(SHARE * values.size, PILE * float(np.median(counts)))
    ends = {"largest": (-1, -2), "least": (0, 1)}  # and the values next to them
    return {
        which: float(seen[end])
        for which, (end, beside) in ends.items()
        if seen[end] != 0.0 and counts[end] > max(enough, PILE * counts[beside])
    }
