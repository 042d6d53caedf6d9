"""Height fields, kerbs and thresholds: one smooth load per wheel, energy kept, clean landings."""

import mujoco
import numpy as np
import pytest
from conftest import roll, slalom
from mujoco import batch

import mjchair
from mjchair.model.ground import uneven

WHEELS = ("left_wheel", "right_wheel", "left_caster", "right_caster")
TIRE_GEOMS = [f"{wheel}_tire" for wheel in WHEELS]


@pytest.fixture(autouse=True)
def native():
    mjchair.install()


def build(scene, **options):
    """A scene with the manual chair, without what is only seen."""
    spec = mjchair.load_spec(scene=scene, **options)
    for geom in list(spec.geoms):
        if geom.contype == 0 and geom.conaffinity == 0:
            spec.delete(geom)
    return spec.compile()


def rolled(model, speed=1.0, seconds=1.5, torque=(0.5, 1.5)):
    """Tire sensors (steps, 4, 7) and positions (steps, 3) of a run."""
    data = mujoco.MjData(model)
    data.qvel[0] = speed
    steps = round(seconds / model.opt.timestep)
    tires, places = np.empty((steps, 4, 7)), np.empty((steps, 3))
    for k in range(steps):
        data.ctrl[:2] = torque
        mujoco.mj_step(model, data)
        tires[k] = [data.sensor(name).data for name in TIRE_GEOMS]
        places[k] = data.sensor("position").data
    return tires, places


@pytest.fixture(scope="module")
def on_plane():
    mjchair.install()
    return rolled(build("flat"))


@pytest.mark.parametrize("cell", [0.2, 0.05])
def test_a_level_height_field_is_a_plane(cell, on_plane):
    shape = (round(5 / cell) + 1, round(10 / cell) + 1)
    tires, places = rolled(build("hfield", heights=np.zeros(shape)))
    plane, path = on_plane
    scale = plane[..., 2].mean(axis=0)[:, None]
    off = np.abs(tires - plane)[..., :3] / scale
    assert off.max() < 1e-3, "forces beyond 0.1 % of the load"
    assert np.abs(places - path).max() < 2e-4
    jump = np.abs(np.diff(tires[..., 2] - plane[..., 2], axis=0)) / scale[:, 0]
    assert jump[100:].max() < 1e-3, "a kick at a cell's edge"


def test_tiles_in_one_plane_count_once(on_plane):
    """A floor of boxes with seams under the wheels carries as one plane does."""
    spec = mjchair.load_spec()
    spec.option.ccd_tolerance, spec.option.ccd_iterations = 1e-10, 50
    for k in range(-10, 41):
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX, size=(0.05, 2, 0.05), pos=(0.1 * k, 0, -0.05), condim=3
        )
    floor = spec.geom("floor")
    floor.pos = (0, 0, -1.0)
    tires, _ = rolled(spec.compile())
    plane = on_plane[0]
    off = np.abs(tires - plane)[..., 2] / plane[..., 2].mean(axis=0)
    assert off.max() < 1e-3


def crossing(scene, speed, timestep=0.002):
    """Drive over the step at a held speed: work done (J) and loads (steps, 4)."""
    model = build(scene, step=0.010)
    model.opt.timestep = timestep
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    tire_geoms = {model.geom(name).id for name in TIRE_GEOMS}
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=round(1.0 / timestep))
    data.qpos[0] += 0.45
    mujoco.mj_step(model, data, nstep=round(0.5 / timestep))
    work = dict.fromkeys(("contact", "tire", "drive", "passive", "spring", "inertia"), 0.0)
    first, integral, loads, stored = None, 0.0, [], 0.0
    force = np.zeros(model.nv)
    while data.qpos[0] < 1.6:
        error = speed * min(1.0, len(loads) * timestep) - data.qvel[0]
        integral += 40.0 * error * timestep
        data.ctrl[:2] = np.clip(30.0 * error + integral, -60.0, 60.0)
        before = data.qvel.copy()
        mujoco.mj_step(model, data)
        mean = 0.5 * (before + data.qvel)
        if first is None:
            first = data.energy.sum()
        force[:] = 0.0
        for body in range(1, model.nbody):
            push = data.xfrc_applied[body]
            if push.any():
                mujoco.mj_applyFT(model, data, push[:3], push[3:], data.xipos[body], body, force)
        work["contact"] += timestep * data.qfrc_constraint @ mean
        work["tire"] += timestep * force @ mean
        work["drive"] += timestep * data.qfrc_actuator @ mean
        work["passive"] += timestep * data.qfrc_passive @ mean
        spring, inertia, stored = contact_parts(model, data, mean, tire_geoms)
        work["spring"] += timestep * spring
        work["inertia"] += timestep * inertia
        loads.append([data.sensor(name).data[2] for name in TIRE_GEOMS])
        assert len(loads) * timestep < 30.0, "it does not get over"
    work["gained"] = data.energy.sum() - first
    return work, np.array(loads), stored


def contact_parts(model, data, velocity, tire_geoms):
    """Power (W) of the contacts' springs and of their inertia, and the energy in the springs."""
    jacobian = np.zeros((data.nefc, model.nv))
    if mujoco.mj_isSparse(model):
        mujoco.mju_sparse2dense(
            jacobian, data.efc_J, data.efc_J_rownnz, data.efc_J_rowadr, data.efc_J_colind
        )
    else:
        jacobian = data.efc_J.reshape(-1, model.nv)
    spring = inertia = stored = 0.0
    for k in range(data.ncon):
        row = data.contact.efc_address[k]
        if not tire_geoms & set(data.contact.geom[k]) or data.efc_force[row] == 0.0:
            continue
        stiffness, damping, impedance, _ = data.efc_KBIP[row]
        depth, mass = data.contact.dist[k], data.efc_D[row]
        rate = jacobian[row] @ velocity
        elastic = -mass * stiffness * impedance * depth
        spring += elastic * rate
        inertia += (data.efc_force[row] - elastic + mass * damping * rate) * rate
        stored += 0.5 * mass * stiffness * impedance * depth * depth
    return spring, inertia, stored


@pytest.mark.parametrize("scene", ["threshold", "kerb"])
def test_a_10_mm_step_keeps_the_energy(scene):
    work, loads, _ = crossing(scene, speed=0.1)
    drive = work["drive"]
    assert drive > 10.0
    balance = work["gained"] - sum(work[k] for k in ("contact", "tire", "drive", "passive"))
    assert abs(balance) < 0.001 * drive, "kinetic, potential and work do not close"
    assert work["contact"] < 0.0, "a contact made energy"
    # what the contacts take is their dampers': springs and inertia give back what they took
    assert abs(work["spring"] + work["inertia"]) < 0.01 * drive
    assert loads.max() < 1000.0


def test_on_top_of_the_kerb_the_gain_is_height():
    model = build("kerb", step=0.010)
    low, high = mujoco.MjData(model), mujoco.MjData(model)
    high.qpos[0], high.qpos[2] = 2.0, 0.010
    for data in (low, high):
        mujoco.mj_step(model, data, nstep=2000)
        mujoco.mj_forward(model, data)
    assert high.qpos[2] - low.qpos[2] == pytest.approx(0.010, abs=1e-6)
    for name in TIRE_GEOMS:
        assert high.sensor(name).data[2] == pytest.approx(low.sensor(name).data[2], rel=1e-4)


def test_lift_forgets_deflection_and_landing_has_no_spike():
    model = build("flat")
    runs = []
    for stale in (0.0, 0.005):
        data = mujoco.MjData(model)
        mujoco.mj_step(model, data, nstep=500)
        data.act[:] = 0.0
        for k in range(4):
            data.act[4 * k : 4 * k + 2] = stale
            data.act[4 * k + 3] = 300.0 * (stale > 0.0)
        data.qpos[2] += 0.03
        forces = []
        for k in range(500):
            mujoco.mj_step(model, data)
            if k == 1:
                assert not data.act.any(), "deflection or load kept in the air"
            forces.append(np.array([data.sensor(name).data[:3] for name in TIRE_GEOMS]))
        runs.append((data.qpos.copy(), np.array(forces)))
    assert np.array_equal(runs[0][0], runs[1][0])
    forces = runs[1][1]
    assert forces[..., 2].max() > 500.0, "it should have landed hard"
    assert np.abs(forces[..., :2]).max() < 0.05 * forces[..., 2].max()
    assert not forces[:30].any(), "a force in the air"


def test_wheels_off_a_step_land_again():
    """Rolling down from the kerb at speed: load goes to zero, comes back, and stays in bounds."""
    spec = mjchair.load_spec(scene="kerb", step=0.05)
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[0], data.qpos[2], data.qvel[0] = 4.2, 0.05, 1.5
    loads = []
    for _ in range(1000):
        mujoco.mj_step(model, data)
        tires = np.array([data.sensor(name).data for name in TIRE_GEOMS])
        loads.append(tires[:, 2])
        before = loads[-2] if len(loads) > 1 else np.zeros(4)  # the load that the force is from
        assert (np.hypot(tires[:, 0], tires[:, 1]) <= 0.82 * before + 1e-9).all()
    loads = np.array(loads)
    assert (loads.min(axis=0) == 0.0).all() and not data.warning.number.any()
    assert abs(data.qpos[2]) < 0.01


@pytest.fixture(scope="module")
def rough():
    return build("hfield", heights=uneven(0.005, 0.8, seed=3))


def test_on_a_height_field_batch_is_mj_step(rough):
    control = slalom(rough, 400)
    expected = roll(rough, control)
    many = batch.Batch(rough, nsim=2, nthread=2)
    many.reset(stage=mujoco.mjtStage.mjSTAGE_NONE)
    for row in control:
        many.ctrl = row
        many.step()
    assert np.array_equal(many.qpos[1], expected[-1, 1 : 1 + rough.nq])


def test_on_a_height_field_compiled_is_plain(rough):
    control = slalom(rough, 150)
    compiled = roll(rough, control)
    mjchair.install(compiled=False)
    assert np.abs(roll(rough, control) - compiled).max() < 1e-9


def test_repeated_forward_changes_no_share(rough):
    data = mujoco.MjData(rough)
    mujoco.mj_step(rough, data, nstep=300)
    mujoco.mj_forward(rough, data)
    first = data.efc_D.copy()
    assert (first == 0.0).any(), "some contacts should have no share"
    mujoco.mj_forwardSkip(rough, data, mujoco.mjtStage.mjSTAGE_VEL, 0)
    assert np.array_equal(data.efc_D, first)


def test_without_islands_it_is_the_same_chair(rough):
    control = slalom(rough, 200)
    with_islands = roll(rough, control)
    rough.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ISLAND)
    try:
        without = roll(rough, control)
    finally:
        rough.opt.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_ISLAND)
    assert np.abs(with_islands - without).max() < 1e-6


def test_heights_survive_saving():
    spec = mjchair.load_spec(scene="hfield", heights=uneven(0.005, seed=1))
    model, again = spec.compile(), mujoco.MjModel.from_xml_string(spec.to_xml())
    assert np.array_equal(model.hfield_data, again.hfield_data)
    assert np.array_equal(model.hfield_size, again.hfield_size)


def test_bad_grounds_are_named():
    with pytest.raises(mjchair.MjchairError, match="no height field"):
        mjchair.load_spec(heights=np.zeros((3, 3)))
    with pytest.raises(mjchair.MjchairError, match="shape"):
        mjchair.load_spec(scene="hfield", heights=np.zeros(3))
    with pytest.raises(mjchair.MjchairError, match="no geom 'step'"):
        mjchair.load_spec(step=0.01)
    with pytest.raises(mjchair.MjchairError, match="step is -1 m"):
        mjchair.load_spec(scene="kerb", step=-1.0)
