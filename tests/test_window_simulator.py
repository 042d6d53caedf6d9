"""Windows that are simulated together: each as it is alone, whatever the others last."""

from dataclasses import replace

import numpy as np
import pytest

import mjchair
from mjchair.diagnosis.data.study import Run, make_study
from mjchair.diagnosis.replay import simulator as replayed
from mjchair.diagnosis.replay.simulator import STATE, Job, WindowSimulator
from mjchair.diagnosis.replay.window_states import first_states
from mjchair.measurement.trial import Trial
from mjchair.simulation import batch
from mjchair.simulation.initial import Initial

CHANNELS = ("left_wheel_speed", "imu_gyro.z", "heading")


@pytest.fixture(scope="module")
def jobs():
    """A simulator, and jobs of windows from 1.2 to 2 s of one coast."""
    begin = Initial(speed=1.0, yaw_rate=0.5)
    run = mjchair.simulate(
        mjchair.load_spec("manual"), None, 3.0, initial={"speed": 1.0, "yaw_rate": 0.5}
    )
    trial = Trial("coast", run.time, {c: np.asarray(run.channels[c]) for c in CHANNELS}, None, {})
    made = Run(trial, "coast", False, begin, frozenset({"speed"}))
    study = make_study(mjchair.load_spec("manual"), [made], dict.fromkeys(CHANNELS, 0.01))
    simulator = WindowSimulator(study, threads=1)
    first, state = simulator.windows[0], first_states(simulator, simulator.base)[0]
    cut = [
        replace(first, last=last, rows=np.flatnonzero(trial.time <= last))
        for last in (1.2, 1.9, 1.95, 2.0)
    ]
    return simulator, [Job(simulator.base, w, state) for w in cut]


def test_a_window_among_longer_ones_is_as_it_is_alone(jobs):
    simulator, several = jobs
    together = simulator.run(several, trace=STATE)
    for job, found in zip(several, together, strict=True):
        (alone,) = simulator.run([job], trace=STATE)
        assert np.array_equal(found.predicted, alone.predicted)
        for name in STATE:
            assert np.array_equal(found.trace[name], alone.trace[name])
            assert len(found.trace[name]) == simulator.steps(job.model, job.window)


def test_windows_of_about_as_many_steps_go_together(jobs, monkeypatch):
    """In batches of two or three windows, two threads were idle a quarter of the time."""
    simulator, several = jobs
    sizes, roll = [], batch.roll
    monkeypatch.setattr(
        replayed.batch,
        "roll",
        lambda models, *a, **k: sizes.append(len(models)) or roll(models, *a, **k),
    )
    simulator.run(several)
    assert sorted(sizes) == [1, 3]
