"""Measured runs: a table of a chair's sensors, and of what drove it, if that was measured."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import mujoco
import numpy as np

from mjchair.errors import MjchairError, nearest
from mjchair.model.wheels import base_name
from mjchair.simulation.channels import channels
from mjchair.simulation.inputs import OTHER_COLUMNS, Inputs, drivable
from mjchair.simulation.table import Array, Table, read_table


@dataclass(frozen=True)
class Trial:
    """One measured run, in SI, on one clock.

    Attributes:
      name: of the trial.
      time: (n,), s.
      channels: sensor scalar -> (n,), NaN where a sample is missing; channels may have different
        rates, so a slow one is mostly NaN.
      inputs: what drove the chair; None: a coast.
      other: columns that are neither, such as `rider_motion` (m), -> (n,).
    """

    name: str
    time: Array
    channels: Mapping[str, Array]
    inputs: Inputs | None
    other: Mapping[str, Array]

    def samples(self, channel: str) -> tuple[Array, Array]:
        """Times (s) and values of the samples of a channel that are there.

        Raises:
          MjchairError: the trial has no such channel.
        """
        return Table(self.time, self.channels, self.name).samples(channel)

    def rate(self, channel: str) -> float:
        """Median sample rate of a channel, Hz; 0 for a single sample."""
        time, _ = self.samples(channel)
        return float(1.0 / np.median(np.diff(time))) if time.size > 1 else 0.0


def read_trial(path: str | os.PathLike[str], model: mujoco.MjModel) -> Trial:
    """Read a measured run and check its columns against the model that is to explain it.

    Args:
      path: a table, see mjchair.simulation.table.
      model: whose sensors and actuators the columns are named after.

    Raises:
      MjchairError: a column that is neither a sensor's nor an actuator's, a run without
        measurements, or as read_table does.
    """
    return trial_from_table(read_table(path), model, Path(path).stem)


def trial_from_table(table: Table, model: mujoco.MjModel, name: str) -> Trial:
    """A trial of a table; see `read_trial`."""
    sensed = {base_name(c.name) for c in channels(model)} | {c.name for c in channels(model)}
    driven = {base_name(a) for a in drivable(model)} | set(drivable(model))
    measured, controls, other = {}, {}, {}
    for column, values in table.columns.items():
        if column in driven:
            controls[column] = values
        elif column in sensed:
            measured[column] = values
        elif column in OTHER_COLUMNS:
            other[column] = values
        else:
            raise MjchairError(
                f"{table.source}: unknown channel {column!r}"
                + nearest(column, {*sensed, *driven, *OTHER_COLUMNS})
            )
    if not measured:
        raise MjchairError(
            f"{table.source}: no column is a sensor of the model; a run needs a measurement"
        )
    return Trial(
        name=name,
        time=table.time,
        channels=MappingProxyType(measured),
        inputs=Inputs(table.time, controls, table.source) if controls else None,
        other=MappingProxyType(other),
    )
