"""Simulations that fail in a search are silent: no line on the terminal, no log file."""

import mujoco
import numpy as np
import pytest

import mjchair
from mjchair.model.engine_warnings import without_engine_warnings
from mjchair.simulation import batch


@pytest.fixture
def blows_up(tmp_path, monkeypatch):
    """A simulation whose state is not finite after a step."""
    monkeypatch.chdir(tmp_path)
    model = mjchair.load_spec().compile()
    state = {
        "time": np.zeros(2),
        "qpos": np.tile(model.qpos0, (2, 1)),
        "qvel": np.full((2, model.nv), 1e12),
        "act": np.zeros((2, model.na)),
    }

    def run():
        control = np.zeros((2, 5, model.nu))
        with mjchair.installed():
            batch.roll([model] * 2, state, control, what=batch.CONTROL, record=("qpos",), threads=2)

    return run


def test_a_chair_that_blows_up_in_a_search_writes_nothing(blows_up, tmp_path, capfd):
    with without_engine_warnings():
        blows_up()
    assert capfd.readouterr() == ("", "")
    assert not list(tmp_path.iterdir())


def test_outside_the_block_who_listened_before_hears_the_engine_again(blows_up):
    """Whoever listened: MuJoCo's own log, or another library in the same process."""
    before, heard = mujoco.get_mju_user_warning(), []
    mujoco.set_mju_user_warning(heard.append)
    try:
        with without_engine_warnings():
            blows_up()
        assert heard == []
        blows_up()
        assert any("unstable" in line for line in heard)
    finally:
        mujoco.set_mju_user_warning(before)
