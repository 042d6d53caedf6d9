"""Height fields, kerbs and thresholds: one smooth load per wheel, energy kept, clean landings."""

import mujoco
import numpy as np
import pytest
from conftest import roll, slalom
from mujoco import batch

import mjchair
from mjchair.model.ground import uneven
from mjchair.simulation.initial import _place

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
    assert off.max() < 1e-9, "other forces than the plane's"
    assert np.abs(places - path).max() < 1e-9


@pytest.mark.parametrize("grade", [1 / 12, 0.2])
def test_a_sloping_height_field_is_a_plane(grade):
    """Depth and normal of contacts 1.5 mm deep; the heights themselves are single precision."""
    heights = np.tile(grade * np.linspace(-5.0, 5.0, 201), (101, 1))
    model = build("hfield", heights=heights)
    data = mujoco.MjData(model)
    up = np.array([-grade, 0.0, 1.0]) / np.hypot(1.0, grade)
    for k in range(20):
        for name in TIRE_GEOMS:
            geom = model.geom(name).id
            data.qpos[:] = model.qpos0
            data.qpos[:2] = 0.013 * k, 0.007 * k
            mujoco.mj_kinematics(model, data)
            axes = data.geom_xmat[geom].reshape(3, 3) * model.geom_size[geom]
            far = up @ data.geom_xpos[geom] - np.linalg.norm(up @ axes)
            data.qpos[2] -= (far + 0.0015) / up[2]
            mujoco.mj_forward(model, data)
            (at,) = np.flatnonzero((data.contact.geom == geom).any(axis=1))
            assert data.contact.dist[at] == pytest.approx(-0.0015, rel=5e-5)
            assert np.abs(data.contact.frame[at, :3] - up).max() < 1e-5


def test_no_kick_where_the_slope_changes():
    """Over creases of up to 0.01 rad at 1 m/s the load goes over as on a smooth floor."""
    model = build("hfield", heights=uneven(0.002, 1.0, seed=2))
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=500)
    data.qvel[0] = 1.0
    for name in WHEELS:
        data.joint(name).qvel = 1.0 / model.geom(f"{name}_tire").size[0]
    loads = []
    for _ in range(1200):
        mujoco.mj_step(model, data)
        loads.append([data.sensor(name).data[2] for name in TIRE_GEOMS])
        assert data.ncon == 4, "a wheel has one contact"
    loads = np.array(loads)[200:]
    assert np.ptp(loads, axis=0).min() > 40.0, "it should be uneven"
    assert loads.min() > 0.0, "it should not lift"
    assert np.abs(np.diff(loads, axis=0)).max() < 3.0


def test_the_ground_is_where_mujoco_has_it():
    """At the field's points, a ray from above: rows along y, columns along x."""
    from mjchair.engine import field

    random = np.random.default_rng(5)
    model = build("hfield", heights=random.uniform(0.0, 0.1, (11, 21)))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    floor, which = model.geom("floor").id, np.zeros(1, np.int32)
    others = np.array([g == 0 for g in range(mujoco.mjNGROUP)], np.uint8)
    for row, column in ((2, 3), (5, 18), (9, 1)):
        place = np.array([-5.0 + 0.5 * column + 1e-6, -2.5 + 0.5 * row + 1e-6, 3.0])
        down = np.array([0.0, 0.0, -1.0])
        ray = mujoco.mj_ray(model, data, place, down, others, 1, -1, which)
        assert which[0] == floor
        sizes = (model.hfield_adr[0], 11, 21, *model.hfield_size[0, :3])
        ground = field.HeightField(model.hfield_data, *sizes)
        _, height, _, _ = field.ground_at(ground, place[0], place[1])
        assert 3.0 - ray == pytest.approx(height + data.geom_xpos[floor, 2], abs=1e-5)


def test_a_contact_is_whole_in_any_pose():
    """Upside down, on its side, across the rim, deep in the ground; on 50 mm steps."""
    random = np.random.default_rng(3)
    model = build("hfield", heights=random.uniform(0.0, 0.05, (101, 201)))
    data, seen = mujoco.MjData(model), 0
    tires = [model.geom(name).id for name in TIRE_GEOMS]
    for _ in range(500):
        data.qpos[:3] = random.uniform([-5.6, -3.0, -0.6], [5.6, 3.0, 0.8])
        turned = random.normal(size=4)
        data.qpos[3:7] = turned / np.linalg.norm(turned)
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_collision(model, data)
        for at in np.flatnonzero(np.isin(data.contact.geom[:, 1], tires)):
            seen += 1
            tire = data.contact.geom[at, 1]
            away = np.linalg.norm(data.contact.pos[at] - data.geom_xpos[tire])
            assert data.contact.dist[at] <= 0.0
            assert np.linalg.norm(data.contact.frame[at, :3]) == pytest.approx(1.0)
            assert away <= model.geom_size[tire, 0] - data.contact.dist[at]
    assert seen > 500


def test_an_ellipsoid_that_is_no_tire_keeps_mujocos_contacts():
    xml = """<mujoco><asset><hfield name="f" nrow="9" ncol="9" size="1 1 0.1 0.1"/></asset>
    <worldbody><geom type="hfield" hfield="f"/><body pos="0.03 0.02 0.09"><freejoint/>
    <geom type="ellipsoid" size="0.3 0.3 0.1"/></body></worldbody></mujoco>"""
    model = mujoco.MjModel.from_xml_string(xml)
    data, found = mujoco.MjData(model), []
    for callbacks in (mjchair.uninstall, mjchair.install):
        callbacks()
        mujoco.mj_forward(model, data)
        found.append(data.contact.dist.copy())
    assert found[0].size > 1
    assert np.array_equal(*found)


def tiled():
    """A floor of boxes with seams across, under the manual chair."""
    spec = mjchair.load_spec()
    spec.option.ccd_tolerance, spec.option.ccd_iterations = 1e-10, 50
    for k in range(-10, 41):
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX, size=(0.05, 2, 0.05), pos=(0.1 * k, 0, -0.05), condim=3
        )
    floor = spec.geom("floor")
    floor.pos = (0, 0, -1.0)
    return spec.compile()


def test_tiles_in_one_plane_count_once(on_plane):
    """A floor of boxes with seams under the wheels carries as one plane does."""
    tires, _ = rolled(tiled())
    plane = on_plane[0]
    off = np.abs(tires - plane)[..., 2] / plane[..., 2].mean(axis=0)
    assert off.max() < 1e-3


def crossing(model, speed):
    """Drive 1.15 m at a held speed: work done, gain and rest (J), and loads (steps, 4).

    The rest is what springs and inertia of the tires' contacts gave and did not take back. A
    contact's inertia comes with the wheel's speed when the contact begins, and what spring and
    inertia hold when it ends goes to its damper, which relaxes without load; neither is rest.
    """
    timestep = model.opt.timestep
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=round(1.0 / timestep))
    data.qpos[0] += 0.45
    mujoco.mj_step(model, data, nstep=round(0.5 / timestep))
    work = dict.fromkeys(("contact", "tire", "drive", "passive", "rest"), 0.0)
    first, integral, loads, held = None, 0.0, [], {}
    while data.qpos[0] < 1.6:
        error = speed * min(1.0, len(loads) * timestep) - data.qvel[0]
        integral += 40.0 * error * timestep
        data.ctrl[:2] = np.clip(30.0 * error + integral, -60.0, 60.0)
        before = data.qvel.copy()
        mujoco.mj_step(model, data)
        mean = 0.5 * (before + data.qvel)
        if first is None:
            first = data.energy.sum()
        work["contact"] += timestep * data.qfrc_constraint @ mean
        work["tire"] += timestep * pushed(model, data) @ mean
        work["drive"] += timestep * data.qfrc_actuator @ mean
        work["passive"] += timestep * data.qfrc_passive @ mean
        now = tire_contacts(model, data, mean)
        for pair, (given, start, _) in now.items():
            work["rest"] += given + start - held.get(pair, (0.0, 0.0, start))[2]
        work["rest"] += sum(end - start for _, start, end in now.values())
        held = now
        loads.append([data.sensor(name).data[2] for name in TIRE_GEOMS])
        assert len(loads) * timestep < 30.0, "it does not get over"
    work["gained"] = data.energy.sum() - first
    return work, np.array(loads)


def pushed(model, data):
    """Generalized forces (nv,) of what is applied to the bodies."""
    force = np.zeros(model.nv)
    for body in np.flatnonzero(data.xfrc_applied.any(axis=1)):
        push = data.xfrc_applied[body]
        mujoco.mj_applyFT(model, data, push[:3], push[3:], data.xipos[body], body, force)
    return force


def tire_contacts(model, data, mean):
    """Work and energies (J) of spring and inertia in this step, for each pair of geoms that push.

    Returns:
      pair -> work done on the chair, energy held before the step, and after it if the share of
      the stiffness stayed.
    """
    tires = {model.geom(name).id for name in TIRE_GEOMS}
    step, jacobian, found = model.opt.timestep, data.efc_J.reshape(-1, model.nv), {}
    for k in range(data.ncon):
        row, pair = data.contact.efc_address[k], tuple(data.contact.geom[k])
        if not tires & set(pair) or data.efc_force[row] == 0.0:
            continue
        stiffness, damping, impedance, _ = data.efc_KBIP[row]
        mass, depth, rate = data.efc_D[row], data.contact.dist[k], jacobian[row] @ mean
        start, end = data.efc_vel[row], 2.0 * rate - data.efc_vel[row]
        given = step * (data.efc_force[row] + mass * damping * start) * rate
        spring = 0.5 * mass * stiffness * impedance
        after = spring * min(depth + step * end, 0.0) ** 2 + 0.5 * mass * end**2
        found[pair] = given, spring * depth**2 + 0.5 * mass * start**2, after
    return found


def ridge():
    """A level height field (cells of 2.5 cm) with a rounded ridge of 10 mm across it at x = 1 m."""
    x = np.linspace(-5.0, 5.0, 401)
    height = 0.005 * (1.0 + np.cos(np.pi * np.clip((x - 1.0) / 0.15, -1.0, 1.0)))
    return np.tile(height, (21, 1))


@pytest.mark.parametrize("speed", [0.1, 0.3, 0.6, 1.0])
@pytest.mark.parametrize("scene", ["threshold", "kerb"])
def test_a_10_mm_step_keeps_the_energy(scene, speed):
    work, loads = crossing(build(scene, step=0.010), speed)
    drive = work["drive"]
    assert drive > 10.0
    balance = work["gained"] - sum(work[k] for k in ("contact", "tire", "drive", "passive"))
    assert abs(balance) < 0.001 * drive, "kinetic, potential and work do not close"
    assert work["contact"] < 0.0, "a contact made energy"
    assert abs(work["rest"]) < 0.01 * drive, "springs or inertia made energy"
    assert loads.max() < 1100.0


@pytest.mark.parametrize("speed", [0.1, 0.3, 0.6, 1.0])
def test_a_ridge_in_a_height_field_costs_nothing(speed):
    work, loads = crossing(build("hfield", heights=ridge()), speed)
    assert np.ptp(loads, axis=0).min() > 20.0, "it should be felt"
    assert abs(work["contact"]) < 0.01 * work["drive"], "more than its dampers should take"
    assert abs(work["rest"]) < 0.0025 * work["drive"], "its force has no potential"


def test_the_inertia_of_the_contacts_makes_no_energy():
    """With a tenth of it, spring and damper unchanged, the contacts take the same energy."""
    found = []
    for part in (1.0, 0.1):
        model = build("threshold", step=0.010)
        model.opt.timestep = 0.0005
        for name in TIRE_GEOMS:
            geom = model.geom(name).id
            impedance = model.geom_solimp[geom, 0]
            model.geom_solimp[geom, :2] = part * impedance
            model.geom_solref[geom] *= (1.0 - part * impedance) / (1.0 - impedance)
        found.append(crossing(model, 0.3)[0])
    whole, tenth = found
    assert abs(whole["contact"] - tenth["contact"]) < 0.01 * whole["drive"]


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


def test_repeated_forward_changes_no_share():
    model = tiled()
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=300)
    data.qpos[0] += 0.05
    mujoco.mj_forward(model, data)
    first = data.efc_D.copy()
    assert (first == 0.0).any(), "some contacts should have no share"
    mujoco.mj_forwardSkip(model, data, mujoco.mjtStage.mjSTAGE_VEL, 0)
    assert np.array_equal(data.efc_D, first)


def test_without_islands_it_is_the_same_chair():
    model = tiled()
    control = slalom(model, 200)
    with_islands = roll(model, control)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ISLAND)
    assert np.abs(with_islands - roll(model, control)).max() < 1e-6


def test_heights_survive_saving():
    spec = mjchair.load_spec(scene="hfield", heights=uneven(0.005, seed=1))
    model, again = spec.compile(), mujoco.MjModel.from_xml_string(spec.to_xml())
    assert np.array_equal(model.hfield_data, again.hfield_data)
    assert np.array_equal(model.hfield_size, again.hfield_size)


def test_bad_grounds_are_named():
    with pytest.raises(mjchair.MjchairError, match="not a height field"):
        mjchair.load_spec(heights=np.zeros((3, 3)))
    with pytest.raises(mjchair.MjchairError, match="shape"):
        mjchair.load_spec(scene="hfield", heights=np.zeros(3))
    with pytest.raises(mjchair.MjchairError, match="no geom 'step'"):
        mjchair.load_spec(step=0.01)
    with pytest.raises(mjchair.MjchairError, match="step is -1 m"):
        mjchair.load_spec(scene="kerb", step=-1.0)


def test_on_a_sloping_height_field_a_run_starts_as_on_a_ramp():
    grade, begin = 0.08, {"position": (-2.0, 1.0), "heading": 0.7, "speed": 0.8, "yaw_rate": 0.2}
    heights = np.tile(grade * np.linspace(-5.0, 5.0, 201), (101, 1))
    field = mjchair.load_spec(scene="hfield", heights=heights)
    on_field = mjchair.simulate(field, None, 0.3, initial=begin)
    on_ramp = mjchair.simulate(
        mjchair.load_spec(scene="ramp", grade=grade), None, 0.3, initial=begin
    )
    assert np.abs(on_field.qpos - on_ramp.qpos).max() < 1e-4  # m, rad; heights in single precision
    assert np.abs(on_field.qvel[0] - on_ramp.qvel[0]).max() < 1e-4


def test_on_an_uneven_field_a_run_starts_where_how_and_as_fast_as_it_is_told():
    spec = mjchair.load_spec(scene="hfield", heights=uneven(0.005, seed=1))
    begin = mjchair.Initial((-2.0, 1.0), 0.7, speed=0.8)
    run = mjchair.simulate(spec, None, 0.1, initial=begin)
    np.testing.assert_allclose(run.vector("position")[0, :2], (-2.0, 1.0), atol=1e-9)
    assert run["heading"][0] == pytest.approx(0.7, abs=1e-3)
    assert run["velocity.x"][0] == pytest.approx(0.8, abs=1e-3)
    load = sum(run[f"{wheel}_tire.Fz"][0] for wheel in WHEELS)
    assert load == pytest.approx(90.0 * 9.81, rel=0.02), "it is settled"
    sliding = [np.abs(run[f"{wheel}_tire.Fx"][:25]).max() for wheel in WHEELS]
    assert max(sliding) < 20.0, "N; wheels with another speed slide: 100 N"


def test_no_wheel_is_placed_inside_of_a_ridge():
    """60 mm high and 0.15 m before the axle: the wheels' round (0.3 m) rests on it."""
    heights = np.tile(np.where(abs(np.linspace(-5.0, 5.0, 201) - 1.2) < 0.01, 0.06, 0.0), (101, 1))
    model = mjchair.load_spec(scene="hfield", heights=heights).compile()
    data = mujoco.MjData(model)
    _place(model, data, mjchair.Initial((1.05, 0.0)))
    assert data.qpos[2] == pytest.approx(0.06 - (0.3 - np.sqrt(0.3**2 - 0.15**2)), abs=1e-3)


@pytest.mark.parametrize(
    "begin", [{"position": (4.8, 0.0)}, {"position": (7.0, 0.0), "speed": 1.0}]
)
def test_beside_the_height_field_no_run_starts(begin):
    spec = mjchair.load_spec(scene="hfield")
    with pytest.raises(mjchair.MjchairError, match=r"goes to 5 and 2.5 m .*start the chair on it"):
        mjchair.simulate(spec, None, 0.1, initial=begin)
