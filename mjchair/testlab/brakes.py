"""Effectiveness of brakes (after ISO 7176-3:2012): parking brakes, and distances to stop.

In: a design. Out: the steepest slope (deg) on which the locked chair neither slides nor tips,
facing up and down; for chairs with motors also the distance (mm) from full speed to rest, on level
ground and down slopes of 3, 6 and 10 deg. A chair stops in three ways: the joystick is released, it
is reversed, or the power is switched off.

The quantities and the three ways to stop follow the standard. Assumptions: the slope is tilted
slowly under the standing chair; a parking brake locks its wheel and does not slip on it, but that
of a drive slips at the torque of its drive.toml; a distance is counted from the command to stop
until the chair is at rest; the numbers of the drive.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import mujoco
import numpy as np

from mjchair.engine.install import installed
from mjchair.model.wheels import REAR_CASTERS
from mjchair.testlab.design import CASTERS, GRAVITY, REAR, Design, parts
from mjchair.testlab.drive import STILL, Joystick, drive_of, pilot_of, switch_off
from mjchair.testlab.result import Grid, Result, Value
from mjchair.testlab.track import Run, Track

NAME = "brakes"
RATE = math.radians(1.0)  # rad/s
STEEPEST = math.radians(40.0)
SLIPS = 0.01  # m along the slope; tires deflect by a few millimetres before the chair slides
TIPS = 0.1  # s without load on the uphill wheels, from which on the chair counts as tipping
SLOPES = (0.0, 3.0, 6.0, 10.0)  # deg
WAYS = ("release", "reverse", "power_off")


def brakes(
    design: Design, *, timestep: float | None = None, slopes: Sequence[float] = SLOPES
) -> Result:
    """Parking brakes, and stopping distances of a chair with motors.

    Args:
      timestep: s. slopes: down which it stops, deg.

    Returns:
      `parking_uphill`, `parking_downhill` (deg; facing uphill or downhill) and
      `stopping_<way>_<slope>` (mm).
    """
    values: dict[str, Value] = {}
    curves: dict[str, tuple[list[float], list[float]]] = {}
    notes, runs = [], {}
    model = design.spec().compile()
    drive = drive_of(design)
    if parts(model).brakes or isinstance(drive, Joystick):
        for name, sign in (("uphill", 1.0), ("downhill", -1.0)):
            angle, why, curve, run = _parking(design, sign, timestep)
            note = f"then it {why}" if why else f"up to the {math.degrees(STEEPEST):g} deg tried"
            values[f"parking_{name}"] = Value(math.degrees(angle), "deg", note=note)
            curves[f"facing {name}"] = curve
            runs[f"parking-{name}"] = run
    else:
        for name in ("uphill", "downhill"):
            values[f"parking_{name}"] = Value(None, "deg", note="the chair has no parking brake")
    rows: list[tuple[float | str | None, ...]] = []
    setup = ["tires of the model on a dry hard floor", "anti-tippers as the model has them"]
    if isinstance(drive, Joystick):
        setup.append(drive.describe())
        for slope in slopes:
            row: list[float | str | None] = [f"{slope:g} deg down"]
            for way in WAYS:
                distance = stopping_distance(design, way, math.radians(slope), timestep)
                note = "" if distance is not None else "does not stop within 10 m"
                value = None if distance is None else 1000.0 * distance
                values[f"stopping_{way}_{slope:g}_deg"] = Value(value, "mm", note=note)
                row.append(value)
            rows.append(tuple(row))
    else:
        notes.append(
            "The chair has no motor: its running brakes are the person's hands, and the "
            "stopping test does not apply."
        )
    grids = [
        Grid("Stopping distance, mm", ("slope", *(w.replace("_", " ") for w in WAYS)), tuple(rows))
    ]
    return Result(
        NAME,
        values,
        setup=setup,
        grids=grids if rows else [],
        notes=notes,
        curves=curves,
        axes=("slope, deg", "moved along the slope, mm"),
        runs=runs,
    )


def _parking(
    design: Design, sign: float, timestep: float | None
) -> tuple[float, str, tuple[list[float], list[float]], Run]:
    """The slope (rad) up to which the locked chair stays in place, and what it does beyond it."""
    powered = design.own_drive() is not None
    track = Track(design, brakes=not powered, timestep=timestep, driven=powered)
    model, data, view = track.model, track.data, track.view
    begin, level, light = (view.x, view.y), view.pitch, 0.0
    radius = float(model.geom_size[view.parts.geoms["left_wheel"], 0])
    behind = tuple(wheel for wheel in REAR_CASTERS if wheel in view.loads) or REAR
    downhill = behind if sign > 0.0 else CASTERS
    uphill = [wheel for wheel in view.loads if wheel not in downhill]
    steps = max(1, round(0.01 / model.opt.timestep))
    angle, why = 0.0, ""
    tilts, moved = [], []
    with installed():
        while angle < STEEPEST:
            angle += RATE * steps * model.opt.timestep
            model.opt.gravity[:] = GRAVITY * np.array(
                [-sign * math.sin(angle), 0.0, -math.cos(angle)]
            )
            track._trace.add(data)
            mujoco.mj_step(model, data, nstep=steps)
            view.update()
            # a frame that pitches on its springs rolls the braked wheels along
            rolled = radius * abs(view.pitch - level)
            distance = max(0.0, math.dist((view.x, view.y), begin) - rolled)
            tilts.append(math.degrees(angle))
            moved.append(1000.0 * distance)
            light = light + 0.01 if sum(view.loads[w] for w in uphill) < 1.0 else 0.0
            if light > TIPS or distance > SLIPS:
                why = "tips" if light > 0.0 else "slides"
                break
    return angle, why, (tilts[::10], moved[::10]), track.run()


def stopping_distance(
    design: Design, way: str, slope: float, timestep: float | None = None
) -> float | None:
    """Distance (m) from full speed down a slope (rad) to rest; None: it does not stop.

    Args:
      way: one of WAYS.
    """
    drive = drive_of(design)
    track = Track(design, slope=-slope, speed=drive.top_speed, timestep=timestep, driven=True)
    pilot = pilot_of(drive, track)
    track.drive(lambda view: pilot.ask(view, drive.top_speed), 1.0)
    begin = (track.view.x, track.view.y)
    if way == "power_off":
        switch_off(track.model, track.data)
    stopped = track.drive(
        lambda view: pilot.stop(view, reverse=way == "reverse"),
        12.0,
        until=lambda view: view.speed < STILL or math.dist((view.x, view.y), begin) > 10.0,
    )
    distance = math.dist((track.view.x, track.view.y), begin)
    return distance if stopped and distance <= 10.0 and track.view.upright > 0.5 else None
