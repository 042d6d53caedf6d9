"""A rider who moves: masses of de Leva, inputs that are followed, momentum that is kept."""

import momentum
import mujoco
import numpy as np
import pytest
from conftest import roll
from mujoco import batch, rollout

import mjchair
from mjchair.errors import MjchairError
from mjchair.model.parameters import ChairParameters
from mjchair.model.wheels import wheels
from mjchair.rider import anatomy, seat
from mjchair.rider.anatomy import JOINTS, SEGMENTS, TABLE
from mjchair.rider.rider import Rider, segment_inertial

FULLPHYSICS = mujoco.mjtState.mjSTATE_FULLPHYSICS
CHAIRS = ("manual", "power")


@pytest.fixture(scope="module")
def moving_spec():
    return mjchair.load_spec("manual", rider="moving")


@pytest.fixture
def moving(moving_spec):
    return moving_spec.compile()


def whole(model):
    """Mass, centre of mass and inertia about it of everything but the world, as the model is."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mass = model.body_mass[1:]
    center = mass @ data.xipos[1:] / mass.sum()
    inertia = np.zeros((3, 3))
    for body in range(1, model.nbody):
        axes, arm = data.ximat[body].reshape(3, 3), data.xipos[body] - center
        inertia += axes @ np.diag(model.body_inertia[body]) @ axes.T
        inertia += model.body_mass[body] * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return np.r_[mass.sum(), center, inertia.ravel()]


@pytest.mark.parametrize("chair", CHAIRS)
@pytest.mark.parametrize("mass", [None, 140.0])
def test_the_whole_is_the_rigid_one(chair, mass):
    parameters = ChairParameters(occupant_mass=mass)
    rigid = mjchair.load_spec(chair, parameters=parameters).compile()
    moving = mjchair.load_spec(chair, parameters=parameters, rider="moving").compile()
    assert np.abs(whole(moving) - whole(rigid)).max() < 1e-9
    for inertia in moving.body_inertia[1:]:
        low, middle, high = sorted(inertia)
        assert low > 0.0 and low + middle >= high
    for wheel in wheels(rigid):
        other = moving.geom(rigid.geom(wheel.geom).name)
        assert np.array_equal(moving.geom_user[other.id], wheel.block)
        stiffness = [
            m.geom_solref[g] / m.body_invweight0[m.geom_bodyid[g], 0]
            for m, g in ((rigid, wheel.geom), (moving, other.id))
        ]
        assert np.allclose(*stiffness, rtol=1e-12)


def test_segments_are_those_of_de_leva(moving):
    shares = {"head": 0.0694, "upper_arm": 0.0271, "forearm": 0.0162, "hand": 0.0061}
    for segment in SEGMENTS[1:]:
        share = shares[segment.rows[0]]
        assert moving.body(segment.body).mass[0] == pytest.approx(75.0 * share)
    assert moving.body("rider_trunk").mass[0] == pytest.approx(75.0 * (0.1596 + 0.1633))
    # the forearm of the figure is 0.2362 m long: centre at 45.74 %, radii 27.6, 26.5, 12.1 %
    forearm = moving.body("rider_left_forearm")
    length = np.linalg.norm([0.153, 0.0, 0.18])
    assert forearm.ipos == pytest.approx([0.0, 0.0, -0.4574 * length], abs=1e-9)
    assert forearm.inertia == pytest.approx(1.215 * (length * np.r_[0.276, 0.265, 0.121]) ** 2)


@pytest.mark.parametrize(
    ("sex", "mass", "center", "radii"),
    [
        ("male", 0.4346, 0.4310, (0.384, 0.358, 0.197)),
        ("female", 0.4257, 0.3782, (0.379, 0.361, 0.182)),
    ],
)
def test_parts_of_the_trunk_make_de_levas_whole_trunk(sex, mass, center, radii):
    """His row for the whole trunk, hips to shoulders, was measured apart from its three parts."""
    rows, length = TABLE[sex], anatomy.TRUNK_LENGTH[sex]
    tops = np.cumsum([rows[n].length for n in ("lower_trunk", "middle_trunk", "upper_trunk")])
    parts = [rows[n] for n in ("lower_trunk", "middle_trunk", "upper_trunk")]
    masses = np.array([row.mass for row in parts])
    heights = tops - [row.center * row.length for row in parts]
    middle = masses @ heights / masses.sum()
    own = np.array([[r.sagittal, r.transverse, r.longitudinal] for r in parts])
    own *= np.array([[r.length] for r in parts])
    squares = own**2
    squares[:, :2] += ((heights - middle) ** 2)[:, None]
    assert masses.sum() == pytest.approx(mass, abs=2e-4)
    assert middle == pytest.approx((1.0 - center) * length, rel=0.02)
    assert np.sqrt(masses @ squares / masses.sum()) == pytest.approx(
        length * np.array(radii), rel=0.03
    )


def test_the_trunk_is_its_two_parts():
    one = segment_inertial(SEGMENTS[0], "male", 75.0, anatomy.TRUNK_LENGTH["male"])
    low, high = 0.1457 + 0.2155 * (1 - 0.4502), 0.1457 + 0.2155 + 0.1707 * (1 - 0.2999)
    assert one.mass == pytest.approx(24.2175)
    assert one.center[2] == pytest.approx((12.2475 * low + 11.97 * high) / 24.2175)


def test_names_ranges_and_landmarks(moving):
    for joint in JOINTS:
        low, high = moving.joint(joint.name).range
        assert low < 0.0 < high and high - low == pytest.approx(joint.high - joint.low)
        assert np.array_equal(moving.actuator(joint.name).ctrlrange, moving.joint(joint.name).range)
    data = mujoco.MjData(moving)
    mujoco.mj_kinematics(moving, data)
    place = {mark.name: data.site("rider_" + mark.name).xpos for mark in anatomy.LANDMARKS}
    assert place["left_shoulder"] == pytest.approx([-0.0364, 0.205, 1.03])
    assert place["right_elbow"] == pytest.approx([-0.0694, -0.318, 0.765])
    assert place["left_wrist"] == pytest.approx([0.0836, 0.318, 0.585])
    assert place["c7"][2] > place["left_acromion"][2] > place["left_shoulder"][2]


@pytest.mark.parametrize(
    ("name", "direction"),
    [
        ("trunk_flexion", (1, 0, 0)),
        ("trunk_lean", (0, -1, 0)),
        ("trunk_twist", (-1, 0, 0)),
        ("left_shoulder_flexion", (1, 0, 0)),
        ("left_shoulder_abduction", (0, 1, 1)),
        ("right_shoulder_abduction", (0, -1, 1)),
        ("left_elbow_flexion", (1, 0, 1)),
        ("right_elbow_flexion", (1, 0, 1)),
    ],
)
def test_positive_angles_go_where_the_table_says(moving, name, direction):
    """Of the left wrist (on the right: the right wrist), or the trunk's left acromion."""
    site = "left_acromion" if "trunk" in name else f"{name.split('_')[0]}_wrist"
    data = mujoco.MjData(moving)
    mujoco.mj_kinematics(moving, data)
    before = data.site(f"rider_{site}").xpos.copy()
    data.joint(f"rider_{name}").qpos[0] = 0.3
    mujoco.mj_kinematics(moving, data)
    went = data.site(f"rider_{site}").xpos - before
    for axis, sign in enumerate(direction):
        assert sign == 0 or sign * went[axis] > 0.005


def test_a_rider_of_another_build(moving):
    tall = mjchair.load_spec(rider=Rider(stature=1.9, lengths={"left_forearm": 0.29})).compile()
    data = mujoco.MjData(tall)
    mujoco.mj_kinematics(tall, data)
    place = {mark.name: data.site("rider_" + mark.name).xpos for mark in anatomy.LANDMARKS}
    assert np.linalg.norm(place["left_wrist"] - place["left_elbow"]) == pytest.approx(0.29)
    arm = np.linalg.norm(place["right_elbow"] - place["right_shoulder"])
    assert arm == pytest.approx(1.9 / 1.75 * np.linalg.norm([0.033, 0.113, 0.265]))
    assert whole(tall)[0] == pytest.approx(whole(moving)[0])
    assert whole(tall)[3] > whole(moving)[3]


def winding(model, steps=400, rate=2.0):
    """Controls (steps, nu): every joint of the rider at 2 Hz, wheels driven."""
    time = np.arange(steps) * model.opt.timestep
    control = np.zeros((steps, model.nu))
    for k, joint in enumerate(JOINTS):
        low, high = model.actuator(joint.name).ctrlrange
        size = min(0.2, 0.8 * high, -0.8 * low)
        turn = np.sin(2.0 * np.pi * rate * time + k) - np.sin(k)
        control[:, model.actuator(joint.name).id] = 0.5 * size * turn
    for wheel in ("left_wheel", "right_wheel"):
        control[:, model.actuator(wheel).id] = 3.0
    return control


def test_any_door_gives_the_same_motion(moving_spec, moving):
    mjchair.install()
    control = winding(moving, 150)
    states = roll(moving, control)
    again = mujoco.MjModel.from_xml_string(moving_spec.to_xml())
    assert np.array_equal(roll(again, control), states)
    start = np.empty(mujoco.mj_stateSize(moving, FULLPHYSICS))
    mujoco.mj_getState(moving, mujoco.MjData(moving), start, FULLPHYSICS)
    out, _ = rollout.rollout(moving, mujoco.MjData(moving), start, control)
    assert np.array_equal(out[0], states)
    many = batch.Batch(moving, nsim=2, nthread=2)
    many.reset(stage=mujoco.mjtStage.mjSTAGE_NONE)
    for row in control:
        many.ctrl = row
        many.step()
    assert np.array_equal(many.qpos[1], states[-1, 1 : 1 + moving.nq])


def test_a_run_resumes_to_the_bit(moving):
    mjchair.install()
    control = winding(moving, 200)
    states = roll(moving, control)
    data = mujoco.MjData(moving)
    roll(moving, control[:100], data)
    kind = mujoco.mjtState.mjSTATE_INTEGRATION
    kept = np.empty(mujoco.mj_stateSize(moving, kind))
    mujoco.mj_getState(moving, data, kept, kind)
    other = mujoco.MjData(moving)
    mujoco.mj_setState(moving, other, kept, kind)
    assert np.array_equal(roll(moving, control[100:], other), states[100:])


@pytest.mark.parametrize("chair", CHAIRS)
def test_the_motion_follows_the_table(chair):
    spec = mjchair.load_spec(chair, rider="moving")
    model = spec.compile()
    time = np.arange(0.0, 1.5, 0.01)
    moves = {}
    for k, joint in enumerate(JOINTS):
        low, high = model.actuator(joint.name).ctrlrange
        middle, size = 0.3 * (low + high), min(0.4, 0.3 * (high - low))
        moves[joint.name] = middle + size * np.sin(4.0 * np.pi * time + k)
        assert low < moves[joint.name].min() and moves[joint.name].max() < high
    recording = mjchair.simulate(spec, mjchair.Inputs(time, moves))
    # so wild a motion tips the chair; it is followed all the same
    assert recording.status is not mjchair.Status.UNSTABLE
    for name, values in moves.items():
        given = np.interp(recording.time, time, values)
        gap = np.abs(recording.channels[f"{name}_angle"] - given)
        # at rest the motion begins within a few steps; from then on it is followed
        assert np.degrees(gap[10:].max()) < 0.5, name
        assert recording.units[name] == "rad"


@pytest.mark.parametrize("rate", [1.0, 2.0])
def test_an_accelerometer_shows_how_the_chair_gains_speed_while_the_trunk_nods(moving_spec, rate):
    time = np.arange(0.0, 2.0, 0.005)
    nod = {"rider_trunk_flexion": 0.05 * (1.0 - np.cos(2.0 * np.pi * rate * time))}
    inputs = mjchair.Inputs(time, nod)
    run = mjchair.simulate(moving_spec, inputs, initial={"speed": 1.0}, sample_rate=500.0)
    rolling = run.time > 1.0
    gained = np.gradient(run["velocity.x"], run.time)[rolling]
    # a chair that pitches by some mrad shows a little of gravity besides
    off = run["imu_accelerometer.x"][rolling] - gained
    assert np.std(off) < 0.12 * np.std(gained)


def test_without_inputs_the_posture_is_held():
    rigid = mjchair.simulate(mjchair.load_spec(), {"left_wheel": 4.0, "right_wheel": 6.0}, 2.0)
    spec = mjchair.load_spec(rider="moving")
    moving = mjchair.simulate(spec, {"left_wheel": 4.0, "right_wheel": 6.0}, 2.0)
    for joint in JOINTS:
        assert np.abs(moving.channels[f"{joint.name}_angle"]).max() < np.radians(1e-3)
    for name in ("velocity.x", "heading", "imu_gyro.z"):
        scale = np.abs(rigid.channels[name]).max()
        assert np.abs(moving.channels[name] - rigid.channels[name]).max() < 2e-3 * scale


def test_a_position_is_held_beyond_its_samples(moving):
    inputs = mjchair.Inputs(
        np.array([1.0, 1.1]),
        {"rider_trunk_flexion": np.array([0.1, 0.3]), "left_wheel": np.ones(2)},
    )
    rows = inputs.control_array(moving, [0.0, 1.05, 2.0])
    trunk, wheel = moving.actuator("rider_trunk_flexion").id, moving.actuator("left_wheel").id
    assert rows[:, trunk] == pytest.approx([0.1, 0.2, 0.3])
    assert rows[:, wheel].tolist() == [0.0, 1.0, 0.0]


def test_a_joint_that_cannot_be(tmp_path, moving):
    with pytest.raises(MjchairError, match=r"rider_trunk_flexion is 3 rad .* a body reaches"):
        mjchair.simulate(moving, {"rider_trunk_flexion": 3.0}, 1.0)
    with pytest.raises(MjchairError, match=r"'rider_trunk_flex'.*rider_trunk_flexion"):
        mjchair.simulate(moving, {"rider_trunk_flex": 0.1}, 1.0)
    table = tmp_path / "moves.csv"
    table.write_text("time,rider_trunk_flexion\n0,0\n1,0.1\n")
    with pytest.raises(MjchairError, match="rider, who is rigid here"):
        mjchair.simulate(mjchair.load_spec(), table)
    with pytest.raises(MjchairError, match=r"timestep 0.004 s .* rider"):
        mjchair.simulate(moving, None, 1.0, timestep=0.004)


def test_a_rider_that_cannot_be(tmp_path):
    with pytest.raises(MjchairError, match=r"rider 'movin'.*moving"):
        mjchair.load_spec(rider="movin")
    with pytest.raises(MjchairError, match=r"stature is 175 m"):
        Rider(stature=175)
    with pytest.raises(MjchairError, match="'thigh'"):
        Rider(lengths={"thigh": 0.4})
    with pytest.raises(MjchairError, match=r"length of trunk is -0.1 m"):
        Rider(lengths={"trunk": -0.1})
    with pytest.raises(MjchairError, match=r"sex 'man'.*male"):
        Rider(sex="man")
    light = mjchair.load_spec(merge_visual_geoms=False)
    light.body("chair").mass = 60.0
    with pytest.raises(MjchairError, match=r"rider of 75 kg is heavier than .* 60 kg"):
        seat.add(light, light.compile(), Rider(), 75.0)
    thin = mjchair.load_spec(merge_visual_geoms=False)
    thin.body("chair").inertia = (0.5, 0.5, 0.5)
    with pytest.raises(MjchairError, match="leaves no body behind"):
        seat.add(thin, thin.compile(), Rider(), 75.0)
    empty = mjchair.load_spec(merge_visual_geoms=False)
    empty.delete(empty.geom("left_thigh"))
    with pytest.raises(MjchairError, match="no geom 'left_thigh'"):
        seat.add(empty, empty.compile(), Rider(), 75.0)


MOTIONS = {
    "trunk": (("trunk_flexion",), 0.1, 1.0),
    "fast": (("trunk_flexion",), 0.3, 2.0),
    "all": (("trunk_flexion", "trunk_twist", "left_shoulder_flexion"), 0.2, 2.0),
}


def moves(name, timestep=0.002, bias_force=True):
    """What a motion does on a floor without friction."""
    model = momentum.model_of(timestep, bias_force)
    return momentum.wandering(model, momentum.swing(model, *MOTIONS[name]))


@pytest.mark.parametrize("name", MOTIONS)
def test_the_common_centre_of_mass_stays_where_it_is(name):
    """A force of 0.001 N from outside would move it by 6e-6 m in a second. The trunk that twists
    has an angular momentum of 0.6 kg m^2/s."""
    found = moves(name)
    assert found.chair > 0.01
    assert found.centre < 1e-8
    assert found.turn < 5e-5


def test_strokes_of_both_arms_leave_the_common_centre_of_mass_where_it_is():
    model = momentum.model_of(0.002)
    found = momentum.wandering(model, momentum.strokes(model))
    assert found.chair > 0.04
    assert found.centre < 1e-9


def test_angular_momentum_is_kept_to_the_second_order_of_the_step():
    coarse, fine = moves("all", 0.002), moves("all", 0.001)
    assert fine.turn < 0.3 * coarse.turn
    bare = moves("all", bias_force=False)
    assert bare.turn > 20.0 * coarse.turn and bare.centre > 1e-5


@pytest.mark.parametrize("weightless", [False, True])
def test_a_chair_in_free_fall_falls_as_its_common_centre_of_mass(weightless):
    """Newton's law in the air, for a chair that turns over while its rider swings his arms."""
    model = momentum.model_of(0.002)
    model.opt.gravity[:] = 1.0, -2.0, -9.81
    if weightless:
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_GRAVITY
    data, root, step = mujoco.MjData(model), model.body("chair").id, model.opt.timestep
    data.qpos[2] = 50.0
    data.qvel[:6] = 0.1, 0.2, 0.3, 1.0, -2.0, 0.5
    path = []
    for row in momentum.swing(model, *MOTIONS["all"])[:500]:
        data.ctrl[:] = row
        mujoco.mj_step(model, data)
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        path.append(data.subtree_com[root].copy())
    fall = np.diff(path, 2, axis=0) / step**2
    expected = np.zeros(3) if weightless else model.opt.gravity
    np.testing.assert_allclose(fall, np.tile(expected, (len(fall), 1)), atol=5e-6)


def test_the_bias_force_is_the_same_compiled_and_in_python_and_a_rigid_rider_has_none():
    found = []
    model = mjchair.load_spec("manual", rider="moving").compile()
    for compiled in (True, False):
        with mjchair.installed(compiled=compiled):
            data = mujoco.MjData(model)
            for row in momentum.swing(model, *MOTIONS["all"])[:100]:
                data.ctrl[:] = row
                mujoco.mj_step(model, data)
            found.append(np.r_[data.qpos, data.qvel, data.sensor("rider_bias_force").data])
    np.testing.assert_allclose(*found, rtol=1e-9, atol=1e-9)
    assert np.abs(found[0][-3:]).max() > 1e-4
    rigid = mjchair.load_spec("manual").compile()
    assert not [i for i in range(rigid.nsensor) if "bias" in rigid.sensor(i).name]


def test_forward_and_inverse_dynamics_leave_the_state_as_it_was():
    with mjchair.installed():
        model = mjchair.load_spec("manual", rider="moving").compile()
        data = mujoco.MjData(model)
        for row in momentum.swing(model, *MOTIONS["all"])[:50]:
            data.ctrl[:] = row
            mujoco.mj_step(model, data)
        mujoco.mj_forward(model, data)
        kept = [np.copy(a) for a in (data.qvel, data.qacc, data.cvel, data.sensordata)]
        mujoco.mj_inverse(model, data)
        mujoco.mj_forward(model, data)
        for before, after in zip(
            kept, (data.qvel, data.qacc, data.cvel, data.sensordata), strict=True
        ):
            assert np.array_equal(before, after)
