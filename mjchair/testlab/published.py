"""Published measurements beside the simulated values, and why they differ.

In: a design. Out: for manual chairs the change of the tip angle with the position of the seat, the
rear stability at several axle positions, the rolling resistance that toe and carpet add, and the
error of the component sum; for chairs with motors the tip angles, braking distances and range. The
published numbers and their sources are in `limits.toml`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from mjchair.errors import MjchairError
from mjchair.testlab.brakes import brakes
from mjchair.testlab.classes import table
from mjchair.testlab.design import Design
from mjchair.testlab.drive import Joystick, drive_of
from mjchair.testlab.energy import carpet, energy
from mjchair.testlab.platform import Platform, Setup
from mjchair.testlab.result import Grid, Result, Value
from mjchair.testlab.rolling import component_sum, treadmill

NAME = "published"
SEATS = (-0.03, 0.0, 0.03)  # m, positions of the person with the seat
AXLES = (-0.06, -0.03, 0.0, 0.03)  # m, positions of the rear axle
TOE = math.radians(1.0)


def published(design: Design, *, timestep: float | None = None) -> Result:
    """Simulated values beside the published ones.

    Returns:
      A value for each row of `limits.toml` that applies to the chair. The table has the published
      value, the simulated one, and the reason for the difference.
    """
    drive = drive_of(design)
    simulated = (
        _power(design, timestep) if isinstance(drive, Joystick) else _manual(design, timestep)
    )
    rows, values = [], {}
    for entry in table()["published"]:
        value = simulated.get(entry["key"])
        if value is None:
            continue
        values[entry["key"]] = Value(value, entry["unit"], note=f"published {entry['published']}")
        text = f"{value:.3g} {entry['unit']}"
        rows.append((entry["what"], entry["published"], text, entry["source"], entry["reason"]))
    return Result(
        NAME,
        values,
        setup=["the design as it is, with no other change than the row states"],
        grids=[
            Grid(
                "Published and simulated",
                ("quantity", "published", "simulated", "source", "reason for the difference"),
                tuple(rows),
            )
        ],
    )


def _tip(design: Design, setup: Setup, timestep: float | None) -> float:
    angle = Platform(design, setup, timestep).tilt().angle
    if angle is None:
        raise MjchairError("the chair does not tip on the platform")
    return math.degrees(angle)


def _changed(design: Design, **parameters: float) -> Design:
    """The design with parameters added to what it has."""
    changed: dict[str, Any] = dict(design.parameters)
    for name, value in parameters.items():
        changed[name] = changed.get(name, 0.0) + value
    return replace(design, parameters=changed)


def _manual(design: Design, timestep: float | None) -> Mapping[str, float]:
    values: dict[str, float] = {}
    rear, front = Setup("rearward", False), Setup("forward", False)
    try:
        seats = [_changed(design, rider_position=x) for x in SEATS]
        centimetres = [100.0 * x for x in SEATS]
        for key, setup in (("seat_slope_rearward", rear), ("seat_slope_forward", front)):
            angles = [_tip(seat, setup, timestep) for seat in seats]
            values[key] = float(np.polyfit(centimetres, angles, 1)[0])
    except MjchairError:
        pass  # a user's chair whose occupant cannot be moved
    try:
        axles = [_tip(_changed(design, axle_position=x), rear, timestep) for x in AXLES]
        values["rear_axle_rearmost"], values["rear_axle_foremost"] = axles[0], axles[-1]
    except MjchairError:
        pass
    plain = treadmill(design, timestep=timestep)
    values["treadmill"] = plain.drag / plain.weight
    on_carpet = treadmill(design, timestep=timestep, edit=carpet)
    values["carpet"] = (on_carpet.drag - plain.drag) / plain.weight
    toed = treadmill(_changed(design, toe=TOE), timestep=timestep)
    values["toe"] = 100.0 * (toed.drag / plain.drag - 1.0)
    values["component_sum"] = component_sum(design, plain.loads)[0] - plain.drag
    return values


def _power(design: Design, timestep: float | None) -> Mapping[str, float]:
    setups = [Setup(way, locked) for way in ("forward", "rearward") for locked in (True, False)]
    tips = [_tip(design, setup, timestep) for setup in (*setups, Setup("left"))]
    stops = brakes(design, timestep=timestep).values
    distances = [
        float(v.value) / 10.0
        for key, v in stops.items()
        if key.startswith("stopping") and key.endswith("_0_deg") and v.value is not None
    ]
    return {
        "power_tip_least": min(tips),
        "power_tip_most": max(tips),
        "power_braking_shortest": min(distances),
        "power_braking_longest": max(distances),
        "power_range": float(energy(design, timestep=timestep)["range"]),
    }
