"""The torque of a pushed run without torque and without free rolling, estimated from its motion.

In: the trial and the speed of a wheel. Out: the trial with a torque on both wheels. The torque is
what a rigid chair needs to move as measured: mass times acceleration plus rolling resistance, times
radius, a half on each wheel. Such a torque explains the motion that it comes from, whatever is
missing in the chair: the run can be simulated with it, and tells a diagnosis nothing.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from mjchair.measurement.gather.instruments import Instrument
from mjchair.measurement.gather.join import GatheredTrial
from mjchair.measurement.gather.known import Known

Array = NDArray[np.float64]

CUTOFF = 6.0  # Hz, usual for wheelchair propulsion at 100 Hz and more
MASS, RADIUS = 90.0, 0.3  # kg and m of the shipped manual chair with its rider
ROLLING = 0.012  # rolling resistance over weight: 0.005-0.03 on hard floors, assumption
SPIN = 1.0 + 0.03  # what the inertia of two wheels adds to the mass, assumption
GRAVITY = 9.81


def estimated(trial: GatheredTrial, motion: Instrument, known: Known) -> GatheredTrial:
    """The trial with the torque that its motion asks for on both wheels, and a note on it."""
    assert motion.speed is not None
    mass = known.mass or (known.rider_mass or 75.0) + (known.chair_mass or MASS - 75.0)
    radius = known.wheel_radius or motion.radius or RADIUS
    rate = 1.0 / float(np.median(np.diff(motion.time)))
    sos = butter(2, min(CUTOFF, 0.4 * rate), fs=rate, output="sos")
    seen = radius * motion.speed
    if motion.ground is not None:
        there = motion.seen
        seen = np.interp(motion.time, motion.time[there], motion.ground[there])
    speed = sosfiltfilt(sos, seen, padlen=min(100, seen.size - 2))
    gained = SPIN * mass * np.gradient(speed, motion.time)
    held = ROLLING * mass * GRAVITY * np.tanh(speed / 0.03)
    torque = np.interp(trial.time, motion.time - trial.begin, 0.5 * radius * (gained + held))
    said = (
        f"{trial.name}: no torque was measured, and no part of 1.5 s rolls freely; the torque is "
        f"estimated from the motion of {motion.name} with {mass:g} kg and {radius:.3f} m, rolling "
        f"resistance {ROLLING:g}. It explains that motion by construction, so that a diagnosis "
        "leaves the trial out: add a coast to the study"
    )
    columns = {"left_wheel": torque, "right_wheel": torque, **trial.columns}
    notes = (*trial.notes, said)
    return replace(trial, columns=columns, manoeuvre="push", notes=notes, torque_estimated=True)
