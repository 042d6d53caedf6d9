"""Speed, acceleration and retardation of chairs with motors (after ISO 7176-6:2018).

In: a design. Out: greatest speed forward and backward (m/s), greatest acceleration and
retardation (m/s^2) on a level floor.

The quantities, the level floor and the release of the joystick follow the standard. Assumptions:
the numbers of the chair's drive; accelerations are means over 0.2 s.
"""

from __future__ import annotations

import numpy as np

from mjchair.testlab.design import Design
from mjchair.testlab.drive import Joystick, drive_of, pilot_of
from mjchair.testlab.result import Result, Value
from mjchair.testlab.track import Track, View

NAME = "speed"
NO_MOTOR = "the chair has no motor; its speed depends on the person"


def speed(design: Design, *, timestep: float | None = None) -> Result:
    """Speed and acceleration of a chair with motors.

    Returns:
      `top_speed_forward`, `top_speed_backward` (m/s), `acceleration`, `retardation` (m/s^2).
    """
    drive = drive_of(design)
    if not isinstance(drive, Joystick):
        return Result(NAME, missing=NO_MOTOR)
    values, curves, runs = {}, {}, {}
    for name, sign in (("forward", 1.0), ("backward", -1.0)):
        seen, track = _there_and_still(design, drive, sign, timestep)
        time, pace = np.array(seen).T
        steady = pace[(time > 4.0) & (time < 5.0)]
        values[f"top_speed_{name}"] = Value(float(steady.mean()), "m/s")
        change = (pace[20:] - pace[:-20]) / (time[20:] - time[:-20])
        if sign > 0.0:
            values["acceleration"] = Value(float(change.max()), "m/s^2")
            values["retardation"] = Value(float(-change.min()), "m/s^2", note="joystick released")
        curves[name] = ([float(t) for t in time[::5]], [float(v) for v in pace[::5]])
        runs[name] = track.run()
    return Result(
        NAME,
        values,
        setup=["level hard floor, from rest, full joystick, then released", drive.describe()],
        curves=curves,
        axes=("time, s", "speed, m/s"),
        runs=runs,
    )


def _there_and_still(
    design: Design, drive: Joystick, sign: float, timestep: float | None
) -> tuple[list[tuple[float, float]], Track]:
    """Full joystick for 5 s, then release: time (s) and speed (m/s) in the commanded direction."""
    track = Track(design, timestep=timestep, driven=True)
    pilot = pilot_of(drive, track)
    seen: list[tuple[float, float]] = []

    def watch(view: View) -> None:
        seen.append((view.time, sign * view.speed))

    full = drive.top_speed if sign > 0.0 else -drive.reverse_speed
    track.drive(lambda view: pilot.ask(view, full), 5.0, watch=watch)
    track.drive(pilot.stop, 2.5, watch=watch)
    return seen, track
