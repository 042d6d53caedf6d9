"""From a simulation's sensor data to the samples of a table, and the difference of two of these.

In: sensor data at every step. Out: (rows, channels) at the times of the samples.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.errors import MjchairError, nearest
from mjchair.measurement.sensors import sensor
from mjchair.model.wheels import base_name
from mjchair.simulation.channels import channels

Array = NDArray[np.float64]
TURN = 2.0 * np.pi
BEGINS = 0.1  # of the samples of a run: by which its first turn is told


def places(model: mujoco.MjModel, wanted: Sequence[str]) -> list[int]:
    """Places of channels in the sensor data of a model.

    Raises:
      MjchairError: the model has no sensor of a channel's name.
    """
    full = {c.name: c.index for c in channels(model)}
    short = {base_name(name): index for name, index in full.items()}
    for channel in wanted:
        if channel not in full and channel not in short:
            raise MjchairError(f"unknown channel {channel!r}" + nearest(channel, {*full, *short}))
    return [full[c] if c in full else short[c] for c in wanted]


def sampled(sensed: Array, step: float, time: Array, names: Sequence[str]) -> Array:
    """Sensor data at the times of samples, (rows, channels).

    Args:
      sensed: (steps, channels); row k belongs to the state before step k, each `step` (s) long.
      time: (rows,) s from the start of the simulation. names: of the channels.
    """
    at = np.clip(time / step, 0.0, len(sensed) - 1.001)
    low = at.astype(int)
    share = (at - low)[:, None]
    for i, name in enumerate(names):
        if sensor(name).wraps:
            sensed[:, i] = np.unwrap(sensed[:, i])
    return np.asarray((1.0 - share) * sensed[low] + share * sensed[low + 1])


def course(values: Array) -> Array:
    """An angle that wraps, (n,) with NaN where it was not measured, counted on over whole turns.

    Most of the first samples stay as they are. Where a heading wraps as a run begins, noise may put
    the very first one on the other side, and a gain would act on the heading of that side.
    """
    out, known = np.full(values.size, np.nan), np.isfinite(values)
    if known.any():
        shown = values[known]
        counted = np.unwrap(shown)
        begins = slice(max(1, math.ceil(BEGINS * shown.size)))
        out[known] = counted + TURN * np.round(np.median((shown - counted)[begins]) / TURN)
    return out


def beside(predicted: Array, measured: Array) -> Array:
    """A predicted angle, by whole turns moved to where the measured one begins; both (rows,).

    A gain of a heading shows by how far the chair has turned, so the turns must be counted alike.
    """
    known = np.flatnonzero(np.isfinite(measured))
    if not known.size:
        return predicted
    apart = measured[known[0]] - predicted[known[0]]
    return np.asarray(predicted + TURN * np.round(apart / TURN))


def residual(measured: Array, predicted: Array, names: Sequence[str]) -> Array:
    """Measured minus predicted (rows, channels); angles that wrap stay within half a turn."""
    out = measured - predicted
    for i, name in enumerate(names):
        if sensor(name).wraps:
            out[:, i] = (out[:, i] + np.pi) % TURN - np.pi
    return out
