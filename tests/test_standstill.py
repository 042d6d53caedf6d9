"""A parked chair stays where it is, and a free one at rest stays at rest."""

import mujoco
import numpy as np
import pytest

import mjchair
from mjchair.effects import rider_motion
from mjchair.simulation.initial import Initial, start

CREEP = 1e-10  # m/s


@pytest.fixture(autouse=True)
def native():
    mjchair.install()


def parked(scene, grade, tilt="floor", timestep=0.002, settle=20.0):
    spec = mjchair.load_spec(scene=scene, grade=grade, tilt=tilt)
    spec.option.timestep = timestep
    model = spec.compile()
    data = mujoco.MjData(model)
    data.eq_active[:] = 1
    mujoco.mj_step(model, data, nstep=round(settle / timestep))
    return model, data


def largest_speed(model, data, steps):
    speeds = []
    for _ in range(steps):
        mujoco.mj_step(model, data)
        speeds.append(np.linalg.norm(data.sensor("velocity").data))
    return max(speeds)


@pytest.mark.parametrize(
    ("scene", "grade", "tilt"),
    [
        ("ramp", 1 / 12, "floor"),
        ("ramp", 1 / 12, "gravity"),
        ("ramp", 0.1, "floor"),
        ("ramp", -0.1, "floor"),
        ("ramp", 0.2, "floor"),
        ("ramp", 0.3, "floor"),
        ("cross_slope", 0.2, "floor"),
        ("cross_slope", -0.2, "gravity"),
    ],
)
def test_locked_chair_does_not_creep(scene, grade, tilt):
    model, data = parked(scene, grade, tilt)
    assert largest_speed(model, data, 500) < CREEP
    pull = np.hypot(
        *np.array([data.sensor(f"{s}_wheel_tire").data[:2] for s in ("left", "right")]).T
    )
    slope = 90.0 * 9.81 * abs(grade) / np.hypot(1.0, grade)
    assert pull.sum() == pytest.approx(slope, rel=0.1), "the rear tires should hold the chair"


@pytest.mark.parametrize("timestep", [0.0005, 0.004])
def test_locked_chair_does_not_creep_at_other_steps(timestep):
    model, data = parked("ramp", 1 / 12, timestep=timestep)
    assert largest_speed(model, data, 200) < CREEP


def test_native_friction_creeps_so_the_figure_can_fail():
    spec = mjchair.load_spec(scene="ramp", grade=1 / 12)
    for geom in spec.geoms:
        if geom.name.endswith("_tire"):
            geom.condim, geom.friction = 3, (0.8, 0.005, 0.0001)
            geom.solref, geom.solimp = (0.02, 1.0), (0.9, 0.95, 0.001, 0.5, 2)
    mjchair.uninstall()
    model = spec.compile()
    data = mujoco.MjData(model)
    data.eq_active[:] = 1
    mujoco.mj_step(model, data, nstep=10_000)
    assert largest_speed(model, data, 200) > 1e4 * CREEP


def test_beyond_friction_it_slides():
    model, data = parked("ramp", -0.3, settle=1.0)
    assert largest_speed(model, data, 100) > 0.1


def test_free_chair_rests_on_the_flat(manual):
    data = mujoco.MjData(manual)
    mujoco.mj_step(manual, data, nstep=round(20.0 / manual.opt.timestep))
    loads, fastest = [], 0.0
    for _ in range(400):
        mujoco.mj_step(manual, data, nstep=50)
        fastest = max(fastest, np.linalg.norm(data.sensor("velocity").data))
        loads.append([data.sensor(f"{w}_tire").data[:4] for w in ("left_wheel", "left_caster")])
    assert fastest < CREEP
    assert np.ptp(loads, axis=0).max() < 1e-6, "ripple in the forces, N"
    total = sum(
        data.sensor(f"{s}_{w}_tire").data[2] for s in ("left", "right") for w in ("wheel", "caster")
    )
    assert total == pytest.approx(90.0 * 9.81, rel=1e-9)


def test_a_chair_starts_at_rest_though_its_rider_sways():
    """The sway begins with the run; a force that never rests would never let the chair rest."""
    rests = []
    for amplitude in (0.0, 0.05):
        spec = mjchair.load_spec("manual")
        rider_motion.harmonic(spec, mass=40.0, amplitude=amplitude, frequency=0.9, phase=0.5)
        model = spec.compile()
        data = start(model, Initial())
        rests.append(data.qpos.copy())
    assert np.array_equal(*rests)
    mujoco.mj_step(model, data, nstep=100)
    assert abs(data.sensor("velocity").data[0]) > 1e-3


def test_rolling_resistance_holds_on_a_slope_smaller_than_it():
    model = mjchair.load_spec(scene="ramp", grade=0.004).compile()
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=20_000)
    assert largest_speed(model, data, 200) < 1e-9
    steep = mjchair.load_spec(scene="ramp", grade=0.02).compile()
    data = mujoco.MjData(steep)
    mujoco.mj_step(steep, data, nstep=5_000)
    assert data.sensor("velocity").data[0] < -0.4
