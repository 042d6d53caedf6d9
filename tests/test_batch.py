"""Many simulations at once are what each would be alone."""

import copy
import ctypes
from contextlib import ExitStack

import mujoco
import numpy as np
import pytest
from conftest import roll, slalom

import mjchair
from mjchair.diagnosis.replay.simulator import NEEDLESS
from mjchair.engine import layout, step_timers
from mjchair.model.engine_warnings import without_engine_warnings
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
    with without_engine_warnings():  # else MUJOCO_LOG.TXT is left behind
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


def clock():
    return ctypes.c_void_p.from_address(layout.address("mjcb_time")).value


def test_the_timers_of_a_step_come_back_after_the_last_block(manual):
    before = clock()
    assert before
    first, second = ExitStack(), ExitStack()
    first.enter_context(step_timers.stopped())
    second.enter_context(step_timers.stopped())
    first.close()
    assert clock() is None  # as of another thread that is still at it
    second.close()
    assert clock() == before
    with pytest.raises(ValueError), step_timers.stopped():
        raise ValueError
    assert clock() == before
    mjchair.install()
    batch.roll([manual], {"qvel": np.zeros((1, manual.nv))}, np.zeros((1, 2, manual.nu)))
    assert clock() == before


@pytest.mark.parametrize("chair", ["manual", "power"])
@pytest.mark.parametrize("thrown", [False, True])
def test_what_a_diagnosis_switches_off_changes_no_bit(chair, thrown):
    """Also of a chair that falls on its side, whose frame then touches the floor."""
    mjchair.install()
    model = mjchair.load_spec(chair).compile()
    light = copy.copy(model)
    light.opt.disableflags |= NEEDLESS
    control = np.zeros((600, model.nu)) if thrown else slalom(model, 600)
    datas = [mujoco.MjData(m) for m in (model, light)]
    for data in datas:
        data.qvel[3] = 4.0 if thrown else 0.0
    one, other = (roll(m, control, d) for m, d in zip((model, light), datas, strict=True))
    assert np.array_equal(one, other)
    upright = datas[0].xmat[1].reshape(3, 3)[2, 2]
    assert (upright < 0.5) == thrown
