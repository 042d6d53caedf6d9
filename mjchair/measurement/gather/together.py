"""Instruments that were started together: one offset of their clocks for all recordings.

In: trials, each with its own alignments. Out: for each pair of instruments whose offsets agree
within their standard deviations, their weighted mean. Clocks that are started one by one differ by
seconds from recording to recording; those that agree to milliseconds have one trigger.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.special import chdtri

from mjchair.measurement.clocks import Alignment
from mjchair.measurement.gather.instruments import Instrument
from mjchair.measurement.gather.join import GatheredTrial

CHANCE = 0.001  # by which offsets that agree would be this far apart
GIVEN = ("given", "trigger")  # alignments that stay as they are

Agreed = dict[str, dict[str, Alignment]]  # trial -> file -> alignment


def started_together(trials: Sequence[GatheredTrial]) -> tuple[Agreed, tuple[str, ...]]:
    """The alignments that several recordings share, and a line for every pair of instruments.

    An alignment with a drift, one by a trigger and one that was given stay as they are.
    """
    pairs: dict[tuple[str, str], list[tuple[str, str, Alignment]]] = {}
    for trial in trials:
        label = {one.name: label_of(one) for one in trial.instruments}
        for file, found in trial.alignments.items():
            if found.how in GIVEN or found.drift != 0.0 or file not in label:
                continue
            pair = (label[file], label_of(trial.instruments[0]))
            pairs.setdefault(pair, []).append((trial.name, file, found))
    agreed: Agreed = {}
    notes = []
    for (other, reference), found_ones in pairs.items():
        names = [name for name, _, _ in found_ones]
        if len(names) < 2 or len(set(names)) < len(names):
            continue
        off = np.array([a.offset for _, _, a in found_ones])
        weight = np.array([a.offset_std for _, _, a in found_ones]) ** -2.0
        mean, spread = float(off @ weight / weight.sum()), float(weight.sum() ** -0.5)
        chi2, limit = float(weight @ (off - mean) ** 2), float(chdtri(len(names) - 1, CHANCE))
        said = f"chi2 {chi2:.1f} with {len(names) - 1} degrees of freedom"
        if chi2 > limit:
            notes.append(
                f"clock of {other} on that of {reference}: {off.min():+.4f} to {off.max():+.4f} s "
                f"in {len(names)} recordings ({said}); they were not started together, or their "
                "uncertainties are too small: each keeps its own"
            )
            continue
        for name, file, found in found_ones:
            how = f"mean of {len(names)} recordings, started together; alone {found.short()}"
            same = replace(found, offset=mean, offset_std=spread, how=how)
            agreed.setdefault(name, {})[file] = same
        notes.append(
            f"clock of {other} on that of {reference}: one for all {len(names)} recordings, "
            f"{same.short()} ({said}); they were started together"
        )
    return agreed, tuple(notes)


def label_of(one: Instrument) -> str:
    """What an instrument is, the same in all trials: kind, and side or place."""
    kind = {"smartwheel": "rim", "imu": "sensor", "markers": "markers", "table": "table"}
    words = [kind.get(one.source.kind, one.source.kind)]
    sides = " and ".join(one.sides) or one.side
    where = one.source.place.replace("_", " ") or sides
    return " ".join([where, *words]) if where and one.ground is None else words[0]
