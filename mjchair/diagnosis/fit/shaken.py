"""What shakes the chair, as one channel would show it, told by the others.

In: the misses of a window, and the process noise. Out: for a channel what its sensor sees besides
what the chair does without noise, as far as the other channels tell it.

A sensor that shows half of a turn shows half of every turn, also where a rough floor makes it. The
channel's own samples must not tell that turn: their noise would look like a gain. With a gain g and
the others telling s, the channel shows (1 + g) (y + s) with the rest of what shakes the chair as
noise, where y is what the chair does without it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from mjchair.diagnosis.data.study import other_wheel
from mjchair.diagnosis.fit.elimination import RIDGE, own_columns
from mjchair.diagnosis.fit.process import Process
from mjchair.diagnosis.fit.whitening import Whitener
from mjchair.diagnosis.replay.sampling import residual
from mjchair.diagnosis.replay.simulator import WindowSimulator
from mjchair.diagnosis.replay.window_states import Track

Array = NDArray[np.float64]


def told_by_others(
    simulator: WindowSimulator, track: Track, whitener: Whitener, process: Process, window: int
) -> Array:
    """What shakes the chair in a window as every channel would show it, (rows, channels).

    It is 0 where nothing was measured. A wheel that was copied tells nothing of the one that it is
    a copy of.

    Args:
      track: of the chair from which the channels miss. process: what shakes it.
    """
    names, copied = simulator.channels, simulator.study.copied
    measured = simulator.measured(simulator.windows[window])
    miss = residual(measured, track.predicted[window], names)
    white = whitener(window, np.nan_to_num(miss[:, :, None], posinf=0.0, neginf=0.0))
    Z, precision, _ = own_columns(simulator, track, whitener, window, process)
    out = np.zeros_like(miss)
    for k, name in enumerate(names):
        own = whitener.channel[window] == k
        other = other_wheel(name)
        same = own.copy()
        if other in names and {name, other} & copied:
            same |= whitener.channel[window] == names.index(other)
        out[:, k] = whitener.samples(window, k, foretold(white[:, 0], Z, precision, same)[own])
    return out


def foretold(r: Array, Z: Array, precision: Array, own: NDArray[np.bool_]) -> Array:
    """What the other samples foretell of all, (samples,).

    Args:
      r: (samples,) white. Z: (samples, k) columns of what they share, with prior precisions (k,).
      own: (samples,) those that are not asked.
    """
    rest = Z[~own]
    factor = cho_factor(rest.T @ rest + np.diag(precision + RIDGE))
    return np.asarray(Z @ cho_solve(factor, rest.T @ r[~own]))
