"""Measured runs: a table of a chair's sensors, and of what drove it, if that was measured.

In: a table, or arrays. Out: a `Trial` in SI units.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import NoReturn

import mujoco
import numpy as np

from mjchair.errors import MjchairError, nearest
from mjchair.model.wheels import base_name
from mjchair.rider.anatomy import JOINT_NAMES
from mjchair.simulation.channels import channel_units
from mjchair.simulation.frozen import FrozenRecord
from mjchair.simulation.inputs import HAND_FORCES, OTHER_COLUMNS, Inputs, control_units, drivable
from mjchair.simulation.table import Array, Table, check_units, leave_out, merged, read_table

MOTION = "rider_motion"


@dataclass(frozen=True, eq=False)
class Trial(FrozenRecord):
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


def read_trial(
    path: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    model: mujoco.MjModel,
    hold: bool = False,
) -> Trial:
    """Read a measured run and check its columns against the model that is to explain it.

    Args:
      path: a table, see mjchair.simulation.table; or several that share one clock, which may have
        different rates.
      model: whose sensors and actuators the columns are named after.
      hold: inputs keep their value until the next sample, see Inputs.

    Raises:
      MjchairError: a column that is nearly a sensor's or an actuator's (others are left out, with
        a note), a run without measurements, or as read_table and merged do.
    """
    paths = [Path(path)] if isinstance(path, str | os.PathLike) else [Path(p) for p in path]
    table = merged([read_table(p) for p in paths])
    return trial_from_table(table, model, "+".join(p.stem for p in paths), hold)


def trial_from_table(table: Table, model: mujoco.MjModel, name: str, hold: bool = False) -> Trial:
    """A trial of a table; see `read_trial`."""
    sensed, driven = channel_units(model), _driven(model)
    check_units(table, {**sensed, **control_units(model), **OTHER_COLUMNS})
    moving = bool(driven & set(JOINT_NAMES))  # then its joints say where its mass is
    measured, controls, other = {}, {}, {}
    for column, values in table.columns.items():
        if column in driven:
            controls[column] = values
        elif column in sensed:
            measured[column] = values
        elif column in HAND_FORCES:  # its moment is what drives; outcomes alone take the force
            continue
        elif column in OTHER_COLUMNS and not (column == MOTION and moving):
            other[column] = values
    idle = set(JOINT_NAMES) - set(controls)  # a rigid rider has no joints to move
    told = {*measured, *controls, *OTHER_COLUMNS, *idle}
    unknown = [c for c in table.columns if c not in told]
    known = {*sensed, *driven, *OTHER_COLUMNS}
    if unknown and not measured:
        _refuse(unknown[0], known, table.source)
    if not measured:
        raise MjchairError(
            f"{table.source}: no column is a sensor of the model; a run needs a measurement"
        )
    leave_out(unknown, known, table.source)
    return Trial(
        name=name,
        time=table.time,
        channels=MappingProxyType(measured),
        inputs=_inputs(table, controls, hold) if controls else None,
        other=MappingProxyType(other),
    )


def _inputs(table: Table, controls: dict[str, Array], hold: bool) -> Inputs:
    """The inputs, at the times of their own samples: other columns may have other rates."""
    there = ~np.all([np.isnan(values) for values in controls.values()], axis=0)
    kept = {name: values[there] for name, values in controls.items()}
    return Inputs(table.time[there], kept, table.source, hold)


def check_columns(trial: Trial, model: mujoco.MjModel) -> None:
    """See that the model has a sensor or an actuator for every column of a trial.

    Raises:
      MjchairError: it has none; the line tells the nearest name.
    """
    controls = trial.inputs.controls if trial.inputs is not None else {}
    for columns, known in (
        (trial.channels, set(channel_units(model))),
        (controls, _driven(model)),
        (trial.other, set(OTHER_COLUMNS)),
    ):
        for column in columns:
            if column not in known:
                _refuse(column, known, f"trial {trial.name}")


def _driven(model: mujoco.MjModel) -> set[str]:
    """Names of the actuators that inputs may drive, with and without their prefix."""
    full = set(drivable(model))
    return full | {base_name(name) for name in full}


def _refuse(column: str, known: set[str], source: str) -> NoReturn:
    raise MjchairError(f"{source}: unknown channel {column!r}" + nearest(column, known))
