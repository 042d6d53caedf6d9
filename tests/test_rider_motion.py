"""A share of the rider's segments moves on the chair, and the whole stays what it was."""

import mujoco
import numpy as np
import pytest

import mjchair
from mjchair.effects import rider_motion, stroke_motion
from mjchair.effects.library import find, library
from mjchair.errors import MjchairError
from mjchair.model import inertials, merged_visual_geoms, moving_share


@pytest.fixture(scope="module")
def heavy():
    return mjchair.load_spec("manual", parameters={"occupant_mass": 90.0})


@pytest.mark.parametrize("mass", [5.0, 36.0, 60.0, 88.0, 94.0])
def test_the_whole_stays_and_both_parts_can_be(heavy, mass):
    before = inertials.of_body(heavy.body("chair"))
    spec = heavy.copy()
    moving = moving_share.take(spec, mass)
    left = inertials.of_body(spec.body("chair"))
    again = left.plus(moving)
    assert moving.mass == pytest.approx(min(mass, 90.0))  # no more than the person
    assert again.mass == pytest.approx(before.mass)
    assert again.centre == pytest.approx(before.centre, abs=1e-12)
    assert again.tensor == pytest.approx(before.tensor, abs=1e-10)
    for part in (moving, left):
        low, middle, high = np.linalg.eigvalsh(part.tensor)
        assert low > 0.0 and low + middle >= high


def test_what_moves_first_is_the_upper_body(heavy):
    upper, rest = moving_share.person(heavy)
    assert upper.mass + rest.mass == pytest.approx(90.0)
    # head, chest, abdomen and arms of de Leva's table
    assert upper.mass == pytest.approx(90.0 * (0.0694 + 0.1596 + 0.1633 + 2 * 0.0494))
    assert moving_share.share(heavy, 30.0).centre == pytest.approx(upper.centre)
    all_of_it = moving_share.share(heavy, 90.0)
    assert all_of_it.centre == pytest.approx(upper.plus(rest).centre)
    with pytest.raises(MjchairError, match=r"120 kg cannot move .* at most 112.5 kg"):
        moving_share.share(heavy, 120.0)


@pytest.mark.parametrize("mass", [20.0, 88.0])
def test_the_motion_is_followed_and_the_common_centre_of_mass_stays(heavy, mass):
    """Plain MuJoCo is a frictionless floor, so the common centre of mass stays where it is."""
    spec = heavy.copy()
    rider_motion.MEASURED.on(spec).apply(spec, {"mass": mass})
    model = spec.compile()
    data = mujoco.MjData(model)
    root = model.body("chair").id
    for _ in range(300):
        mujoco.mj_step(model, data)
    data.qvel[:] = 0.0
    data.time = 0.0
    mujoco.mj_forward(model, data)
    began = data.subtree_com[root].copy()
    for _ in range(500):
        data.actuator("rider_motion").ctrl[0] = 0.03 * (1.0 - np.cos(2.0 * np.pi * data.time))
        mujoco.mj_step(model, data)
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        assert abs(data.subtree_com[root][0] - began[0]) < 1e-6
        away = data.joint("rider_motion").qpos[0]
        asked = 0.03 * (1.0 - np.cos(2.0 * np.pi * (data.time - 0.002)))
        assert away == pytest.approx(asked, abs=0.002)


def test_the_bound_is_the_rider_in_the_chair(heavy):
    effects = library(("left_wheel_speed",), ("rider_motion",), chair=heavy)
    measured = [e for e in effects if e.name == "rider_motion"]
    assert len(measured) == 1 and measured[0].measured == "rider_motion"
    assert measured[0].parameter("mass").high == pytest.approx(1.25 * 90.0)
    # a chair that shows nobody: a part of its body
    bare = heavy.copy()
    merged_visual_geoms.separate(bare)
    bare.delete(bare.geom("head"))
    assert rider_motion.MEASURED.on(bare).parameter("mass").high == pytest.approx(90.0)
    spec = bare.copy()
    rider_motion.MEASURED.on(bare).apply(spec, {"mass": 89.0})
    assert spec.compile().body("rider_motion").mass[0] == pytest.approx(89.0)


def test_more_than_the_person_is_the_person_who_moves_farther(heavy):
    """A displacement that was measured short makes the mass large; the product is what counts."""
    spec = heavy.copy()
    rider_motion.MEASURED.on(spec).apply(spec, {"mass": 108.0})
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    for _ in range(750):  # 1.5 s: at the far end of the motion
        data.actuator("rider_motion").ctrl[0] = 0.03 * (1.0 - np.cos(2.0 * np.pi * data.time))
        mujoco.mj_step(model, data)
    asked = 0.03 * (1.0 - np.cos(2.0 * np.pi * (data.time - model.opt.timestep)))
    product = model.body("rider_motion").mass[0] * data.joint("rider_motion").qpos[0]
    assert model.body("rider_motion").mass[0] == pytest.approx(90.0)
    assert product == pytest.approx(108.0 * asked, rel=0.02)


def test_the_old_name_is_understood_with_a_note():
    with pytest.warns(FutureWarning, match="rider_sway is called rider_motion"):
        assert find("rider_sway") is find("rider_motion")


def test_a_wave_in_step_with_strokes_is_that_motion_without_further_harmonics(heavy):
    def built(effect, values):
        spec = heavy.copy()
        effect.on(spec).apply(spec, values)
        return spec.to_xml()

    values = {"sine_1": 1.5, "cosine_1": -0.7}
    whole = built(stroke_motion.EFFECT, values)
    assert built(stroke_motion.WAVE, values) == whole
    assert built(stroke_motion.EFFECT, values | {"sine_2": 0.3}) != whole
    said = stroke_motion.WAVE.remark(values, {"sine_1": 0.1, "cosine_1": 0.1})
    assert f"{np.hypot(1.5, 0.7):.2f} kg m" in said


def test_a_motion_in_step_with_strokes_keeps_the_common_centre_of_mass(heavy):
    """The first moment that is asked for comes about, and the whole stays where it is."""
    spec = heavy.copy()
    effect = stroke_motion.EFFECT.on(spec)
    asked = {"sine_1": 2.5, "cosine_2": -0.6}
    effect.apply(spec, asked)
    model = spec.compile()
    data = mujoco.MjData(model)
    mass = model.body("stroke_motion").mass[0]
    root = model.body("chair").id
    mujoco.mj_forward(model, data)
    for _ in range(300):
        _stroke_controls(data, 0.0)
        mujoco.mj_step(model, data)
    data.qvel[:] = 0.0
    mujoco.mj_forward(model, data)
    began, gone = data.subtree_com[root].copy(), []
    for k in range(600):
        phase = 2.0 * np.pi * 0.9 * k * model.opt.timestep
        _stroke_controls(data, phase * min(1.0, k / 300.0))
        mujoco.mj_step(model, data)
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        assert abs(data.subtree_com[root][0] - began[0]) < 1e-6
        gone.append(mass * data.joint("stroke_motion").qpos[0])
    assert np.ptp(gone) / 2.0 == pytest.approx(stroke_motion.first_moment(full(asked), {})[0], 0.02)


def full(values):
    return {wave: 0.0 for wave in stroke_motion.WAVES} | values


def _stroke_controls(data, phase):
    for name, value in stroke_motion.waves(phase).items():
        data.actuator(name).ctrl[0] = value


def test_what_a_trunk_can_do_bounds_the_product_and_never_a_mass(heavy):
    effect = stroke_motion.EFFECT.on(heavy)
    upper, _ = moving_share.person(heavy)
    assert effect.parameter("sine_1").high == pytest.approx(upper.mass * stroke_motion.REACH)
    assert effect.parameter("cosine_2").low == pytest.approx(-upper.mass * stroke_motion.REACH / 2)
    assert {p.unit for p in effect.parameters} == {"kg m"}
    said = effect.remark(full({"sine_1": 3.0}), {"sine_1": 0.1})
    assert "3.00 kg m" in said and "2.80 to 3.20" in said and "mass alone is not known" in said
    with pytest.raises(MjchairError, match="must be within"):
        effect.apply(heavy.copy(), {"sine_1": 9.0})


def test_a_measured_motion_stands_in_for_all_forms_that_were_not_measured(heavy):
    columns = stroke_motion.COLUMNS
    shown = [e for e in library((), columns, chair=heavy) if e.name == "rider_motion"]
    assert [len(e.parameters) for e in shown] == [4, 2, 6]
    measured = [e for e in library((), (*columns, "rider_motion")) if e.name == "rider_motion"]
    assert [e.measured for e in measured] == ["rider_motion"]


@pytest.mark.parametrize("mass", [20.0, 75.0])
def test_an_accelerometer_shows_how_the_chair_gains_speed_under_a_moving_rider(mass):
    spec = mjchair.load_spec("manual")
    rider_motion.MEASURED.on(spec).apply(spec, {"mass": mass})
    time = np.arange(0.0, 3.0, 0.005)
    sway = 0.03 * (1.0 - np.cos(2.0 * np.pi * time))
    inputs = mjchair.Inputs(time, {"rider_motion": sway})
    run = mjchair.simulate(spec, inputs, 3.0, initial={"speed": 1.0}, sample_rate=500.0)
    rolling = run.time > 1.0
    gained = np.gradient(run["velocity.x"], run.time)[rolling]
    # a chair that pitches by some mrad shows a little of gravity besides
    off = run["imu_accelerometer.x"][rolling] - gained
    assert np.std(off) < 0.1 * np.std(gained)
