"""Sensors between the simulation and the table: bias, scale and delay of channels.

In: predictions of perfect sensors. Out: predictions of these.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis.data.windows import Window
from mjchair.diagnosis.replay.simulator import WindowSimulator

Array = NDArray[np.float64]


@dataclass
class SensorErrors:
    """What the channels make of the simulated sensors: their faults.

    Attributes:
      channels: in the order of the columns. bias, scale, delay: by channel (SI, 1, s).
    """

    channels: Sequence[str]
    bias: Mapping[str, float] = field(default_factory=dict)
    scale: Mapping[str, float] = field(default_factory=dict)
    delay: Mapping[str, float] = field(default_factory=dict)

    def applied(self, simulator: WindowSimulator, window: Window, predicted: Array) -> Array:
        """Predictions (rows, channels) as the channels show them."""
        if not (self.bias or self.scale or self.delay):
            return predicted
        out = predicted.copy()
        time = simulator.study.runs[window.run].trial.time[window.rows]
        for i, name in enumerate(self.channels):
            if self.delay.get(name):
                out[:, i] = delayed(time, predicted[:, i], self.delay[name])
            out[:, i] = (1.0 + self.scale.get(name, 0.0)) * out[:, i] + self.bias.get(name, 0.0)
        return out


def delayed(time: Array, values: Array, delay: float) -> Array:
    """Values as they were `delay` (s) earlier, or will be later where it is negative.

    Before the first and after the last of them they go on along the slope there.
    """
    shown = time - delay
    out = np.interp(shown, time, values)
    if time.size > 3:
        for end, inner, beyond in ((0, 3, shown < time[0]), (-1, -4, shown > time[-1])):
            slope = (values[inner] - values[end]) / (time[inner] - time[end])
            out[beyond] = values[end] + slope * (shown[beyond] - time[end])
    return np.asarray(out)
