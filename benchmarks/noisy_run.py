"""A run of a simulated chair, sampled and with noise, as a measured run of a study.

In: a random generator, the specification of a chair, a first state, and inputs. Out: a
`mjchair.diagnosis.data.study.Run` with the channels of `NOISE`. Tests and benchmarks use it.
"""

from __future__ import annotations

import mujoco
import numpy as np

import mjchair
from mjchair.diagnosis.data.study import Run
from mjchair.measurement.trial import Trial
from mjchair.simulation.initial import Initial
from mjchair.simulation.inputs import Inputs

# standard deviation of the noise on each channel: rad, rad/s, m; assumed
NOISE = {
    "heading": 0.01,
    "left_wheel_speed": 0.05,
    "right_wheel_speed": 0.05,
    "imu_gyro.z": 0.02,
    "position.x": 0.02,
    "position.y": 0.02,
}


def noisy_run(
    rng: np.random.Generator,
    chair: mujoco.MjSpec,
    name: str,
    start: Initial,
    seconds: float,
    inputs: Inputs | None = None,
) -> Run:
    """A run of `seconds` (s), sampled at 50 Hz; its first state is not told to the study."""
    run = mjchair.simulate(chair, inputs, seconds, initial=start, sample_rate=50.0)
    noisy = {c: run[c] + std * rng.standard_normal(run.time.size) for c, std in NOISE.items()}
    return Run(Trial(name, run.time, noisy, inputs, {}), name, False, Initial(), frozenset())
