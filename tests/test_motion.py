"""The rolling chair as a whole: convergence, energy, symmetry, coasting."""

import mujoco
import numpy as np
import pytest
from conftest import roll, slalom

import mjchair

DURATION = 10.0


@pytest.fixture(autouse=True)
def native():
    mjchair.install()


def drive(model, time):
    """Controls at the times: two strong pulls, then a slalom; the same function at every step."""
    control = np.zeros((len(time), model.nu))
    start = np.where(time < 2.0, 6.0, 1.0)
    turn = 4.0 * np.sin(2 * np.pi * (time - 2.0) / 2.5) * (time > 2.0)
    control[:, model.actuator("left_wheel").id] = start - turn
    control[:, model.actuator("right_wheel").id] = start + turn
    return control


def path(timestep, mirrored=False, turned=0.0, duration=DURATION):
    spec = mjchair.load_spec()
    spec.option.timestep = timestep
    model = spec.compile()
    data = mujoco.MjData(model)
    if turned:
        data.qpos[3:7] = (np.cos(turned / 2), 0, 0, np.sin(turned / 2))
    every = round(0.02 / timestep)
    time = np.arange(round(duration / timestep)) * timestep
    control = drive(model, time)
    if mirrored:
        control[:, [0, 1]] = control[:, [1, 0]]
    points = []
    for start in range(0, len(time), every):
        for row in control[start : start + every]:
            data.ctrl[:] = row
            mujoco.mj_step(model, data)
        points.append(data.qpos[:2].copy())
    return np.array(points)


def test_path_converges_with_the_step():
    """Within 1 % of the path length at 2 ms, and the error falls at least in proportion to h."""
    fine = path(0.00025)
    length = np.linalg.norm(np.diff(fine, axis=0), axis=1).sum()
    error = {h: np.abs(path(h) - fine).max() for h in (0.002, 0.001, 0.0005)}
    assert length > 4.0
    assert error[0.002] < 0.01 * length
    order = np.log2(error[0.002] / error[0.0005]) / 2
    assert order > 0.9, error


def test_mirrored_inputs_give_the_mirrored_path():
    left, right = path(0.002), path(0.002, mirrored=True)
    assert np.abs(left[:, 1]).max() > 0.1
    np.testing.assert_allclose(left * (1, -1), right, atol=1e-6)


def test_a_turned_world_gives_the_turned_path():
    straight, turned = path(0.002), path(0.002, turned=0.7)
    c, s = np.cos(0.7), np.sin(0.7)
    np.testing.assert_allclose(straight @ np.array([[c, s], [-s, c]]), turned, atol=1e-6)


def test_energy_closes_over_a_slalom():
    """Work of drive and gravity turns into motion, height and loss, to 0.5 %."""
    spec = mjchair.load_spec(scene="ramp", grade=-0.01)
    model = spec.compile()
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=100)
    time = np.arange(round(DURATION / model.opt.timestep)) * model.opt.timestep
    control = drive(model, time)
    h = model.opt.timestep
    mujoco.mj_forward(model, data)
    before = data.energy.sum()
    work = lost = 0.0
    for row in control:
        data.ctrl[:] = row
        velocity = data.qvel.copy()
        mujoco.mj_step(model, data)
        mean = 0.5 * (velocity + data.qvel)
        work += h * data.qfrc_actuator @ mean
        lost -= h * (data.qfrc_applied + data.qfrc_passive + data.qfrc_constraint) @ mean
        lost -= h * tire_power(model, data, mean)
    mujoco.mj_forward(model, data)
    gained = data.energy.sum() - before
    assert work > 50.0 and lost > 20.0
    assert abs(work - lost - gained) < 0.005 * work, (work, lost, gained)


def tire_power(model, data, velocity):
    """Power (W) of the applied body forces, through the Jacobians of the step's start."""
    total = 0.0
    jacobian = np.zeros((6, model.nv))
    for body in np.flatnonzero(np.abs(data.xfrc_applied).sum(axis=1)):
        mujoco.mj_jacBodyCom(model, data, jacobian[:3], jacobian[3:], body)
        total += data.xfrc_applied[body] @ (jacobian @ velocity)
    return total


def test_coast_down_shows_the_rolling_resistance():
    """From 1.5 m/s the deceleration is c g over the mass and the wheels' inertia."""
    model = mjchair.load_spec().compile()
    data = mujoco.MjData(model)
    data.qvel[0] = 1.5
    for name, radius in (
        ("left_wheel", 0.3),
        ("right_wheel", 0.3),
        ("left_caster", 0.075),
        ("right_caster", 0.075),
    ):
        data.joint(name).qvel = 1.5 / radius
    mujoco.mj_step(model, data, nstep=500)
    first = data.sensor("velocity").data[0]
    mujoco.mj_step(model, data, nstep=1000)
    deceleration = (first - data.sensor("velocity").data[0]) / 2.0
    shares = sum(
        c * data.sensor(f"{side}_{wheel}_tire").data[2]
        for side in ("left", "right")
        for wheel, c in (("wheel", 0.010), ("caster", 0.015))
    )
    assert deceleration * 95.0 == pytest.approx(shares, rel=0.08)


def test_casters_swing_round_when_the_chair_reverses():
    model = mjchair.load_spec().compile()
    data = mujoco.MjData(model)
    data.joint("left_caster_swivel").qpos = data.joint("right_caster_swivel").qpos = 0.05
    data.actuator("left_wheel").ctrl = data.actuator("right_wheel").ctrl = -6.0
    mujoco.mj_step(model, data, nstep=1200)
    for side in ("left", "right"):
        assert abs(abs(data.sensor(f"{side}_caster_angle").data[0]) - np.pi) < 0.2


def test_a_treadmill_is_ground_in_motion():
    """On a belt at 1 m/s a chair that stands feels what it would feel rolling at 1 m/s."""
    spec = mjchair.load_spec()
    spec.geom("floor").surfacevel = (-1.0, 0, 0, 0, 0, 0)
    model = spec.compile()
    data = mujoco.MjData(model)
    for _ in range(1500):
        data.qvel[0] = 0.0
        mujoco.mj_step(model, data)
    assert data.joint("left_wheel").qvel[0] == pytest.approx(1.0 / 0.3, rel=0.02)
    assert data.sensor("left_wheel_tire").data[0] < 0.0


def test_sensors_say_what_they_should(manual):
    data = mujoco.MjData(manual)
    states = roll(manual, slalom(manual, 800), data)
    mujoco.mj_forward(manual, data)
    heading = 2 * np.arctan2(data.qpos[6], data.qpos[3])
    assert data.sensor("heading").data[0] == pytest.approx(heading, abs=1e-3)
    assert data.sensor("position").data[:2] == pytest.approx(data.qpos[:2], abs=0.02)
    assert len(states) == 800
    wheel = data.sensor("left_wheel_tire").data
    assert wheel[2] > 100.0 and abs(wheel[6]) < 0.02
