"""Many simulations at once are what each would be alone."""

import mujoco
import numpy as np
from conftest import roll, slalom

import mjchair
from mjchair.simulation import batch


def test_each_is_what_it_would_be_alone(manual):
    mjchair.install()
    control = slalom(manual, 120)
    speeds = np.zeros((3, manual.nv))
    speeds[:, 0] = 0.4, 0.8, 1.2
    records, broken = batch.roll(
        [manual] * 3,
        {"qvel": speeds},
        np.stack([control] * 3),
        record=("sensordata", "qpos"),
        threads=2,
    )
    assert not broken.any()
    for speed, sensed, places in zip(speeds, records["sensordata"], records["qpos"], strict=True):
        data = mujoco.MjData(manual)
        data.qvel[:] = speed
        states = roll(manual, control, data)
        assert np.array_equal(places, states[:, 1 : 1 + manual.nq])
        assert np.array_equal(sensed[-1], data.sensordata)


def test_what_breaks_is_told(manual):
    mjchair.install()
    speeds = np.zeros((2, manual.nv))
    speeds[1, 2] = 1e12
    _, broken = batch.roll([manual] * 2, {"qvel": speeds}, np.zeros((2, 5, manual.nu)))
    assert broken.tolist() == [False, True]


def test_groups_keep_sizes_steps_and_kinds_apart_and_fit_memory(manual, monkeypatch):
    power, quick = mjchair.load_spec("power").compile(), mjchair.load_spec().compile()
    quick.opt.timestep = 0.001
    power.opt.timestep = 0.004
    models = [manual, power, manual, quick, manual]

    def found(apart=None):
        return list(batch.groups(models, [100] * 5, apart=apart))

    assert found() == [[0, 2, 4], [1], [3]]
    assert found("aaaab") == [[0, 2], [1], [3], [4]]
    monkeypatch.setattr(batch, "BYTES", 2 * 8 * 100 * manual.nsensordata)
    assert found() == [[0, 2], [4], [1], [3]]
