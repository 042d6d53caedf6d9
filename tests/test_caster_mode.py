"""The mode in which casters shimmy, from the model stepped once, by the step that it takes."""

import mujoco
import numpy as np
import pytest

import mjchair
from mjchair.effects import relaxation_length
from mjchair.simulation.initial import Initial, start

LENGTH = 0.09  # m, added to the chair's own: at 1.5 m/s its casters shimmy
CHANGE = 1e-6  # of a state, to either side


def _mode(timestep):
    """Growth (1/s) and frequency (Hz) of the fastest growing swing of a chair that rolls."""
    spec = mjchair.load_spec("manual", timestep=timestep)
    relaxation_length.edit(spec, LENGTH)
    model = spec.compile()
    with mjchair.installed():
        data = start(model, Initial(speed=1.5))
        mujoco.mj_step(model, data, nstep=round(0.1 / timestep))
        matrix = _matrix(model, data)
    rates = np.log(np.linalg.eigvals(matrix).astype(complex)) / timestep
    swings = rates[(rates.imag > 2.0 * np.pi * 10.0) & (rates.imag < 2.0 * np.pi * 25.0)]
    fastest = swings[np.argmax(swings.real)]
    return fastest.real, fastest.imag / (2.0 * np.pi)


def _matrix(model, data):
    """Derivative of the state after a step by the state before it."""
    position, velocity, tires = data.qpos.copy(), data.qvel.copy(), data.act.copy()
    nv = model.nv

    def after(change):
        data.qpos[:] = position
        mujoco.mj_integratePos(model, data.qpos, change[:nv], 1.0)
        data.qvel[:] = velocity + change[nv : 2 * nv]
        data.act[:] = tires + change[2 * nv :]
        mujoco.mj_step(model, data)
        moved = np.zeros(nv)
        mujoco.mj_differentiatePos(model, moved, 1.0, position, data.qpos)
        return np.concatenate([moved, data.qvel, data.act])

    changes = CHANGE * np.eye(2 * nv + model.na)
    return np.column_stack([(after(c) - after(-c)) / (2.0 * CHANGE) for c in changes])


@pytest.fixture(scope="module")
def fine():
    return _mode(0.00025)


def test_a_step_of_2_ms_neither_damps_a_shimmy_nor_hurries_it(fine):
    growth, frequency = _mode(0.002)
    assert growth == pytest.approx(fine[0], abs=0.1)
    assert frequency == pytest.approx(fine[1], rel=0.005)


def test_half_of_the_step_is_at_least_twice_as_close(fine):
    away = [abs(np.array(_mode(h)) - fine) for h in (0.002, 0.001)]
    assert (away[1] < 0.55 * away[0]).all()
