"""Every shipped chair keeps the contract, and bad models are refused in one line."""

import math
import warnings

import mujoco
import numpy as np
import pytest

import mjchair
from mjchair.effects.library import find
from mjchair.model import assets
from mjchair.model.wheels import WHEELS, check_timestep, springs, wheels

CHAIRS = sorted(assets.chairs())
SENSORS = {
    "left_wheel_angle": 1, "right_wheel_angle": 1, "left_wheel_speed": 1, "right_wheel_speed": 1,
    "left_caster_angle": 1, "right_caster_angle": 1, "imu_gyro": 3, "imu_accelerometer": 3,
    "position": 3, "heading": 1, "velocity": 3,
    **{f"{wheel}_tire": 7 for wheel in WHEELS},
}  # fmt: skip


@pytest.fixture(params=CHAIRS)
def chair(request):
    mjchair.install()
    return mjchair.load_spec(request.param).compile()


def test_contract_names(chair):
    for name, size in SENSORS.items():
        assert chair.sensor(name).dim[0] == size
    for name in (*WHEELS, "left_caster_swivel", "right_caster_swivel", "chair"):
        chair.joint(name)
    assert chair.joint("chair").type[0] == mujoco.mjtJoint.mjJNT_FREE
    for name in ("left_wheel", "right_wheel"):
        assert chair.actuator(name).trnid[0] == chair.joint(name).id
    for name in ("imu", "axle"):
        assert chair.site(name).bodyid[0] == chair.body("chair").id


def test_every_element_is_named(chair):
    kinds = ("body", "jnt", "geom", "site", "actuator", "sensor", "eq", "cam", "light", "mat")
    for kind in kinds:
        addresses = getattr(chair, f"name_{kind}adr")
        for index, address in enumerate(addresses):
            if kind == "body" and index == 0:
                continue
            assert chair.names[address : address + 1] != b"\0", f"{kind} {index} has no name"


@pytest.mark.parametrize("timestep", [0.0005, 0.002, 0.004])
@pytest.mark.parametrize("seed", [0, 1])
def test_random_drive_raises_no_warning(chair, timestep, seed):
    chair.opt.timestep = timestep
    data = mujoco.MjData(chair)
    rng = np.random.default_rng(seed)
    for _ in range(30):
        data.ctrl[:] = rng.normal(0.0, 12.0, chair.nu)
        mujoco.mj_step(chair, data, nstep=round(0.1 / timestep))
    assert not any(warning.number for warning in data.warning)
    assert np.isfinite(data.qpos).all()


def test_forward_torque_drives_forward_and_left_turns_right(chair):
    data = mujoco.MjData(chair)
    data.actuator("left_wheel").ctrl = 6.0
    data.actuator("right_wheel").ctrl = 4.0
    mujoco.mj_step(chair, data, nstep=1000)
    assert data.sensor("velocity").data[0] > 0.05
    assert data.sensor("heading").data[0] < -0.001


def test_loads_add_up_and_the_rear_axle_carries_its_share(chair):
    data = mujoco.MjData(chair)
    mujoco.mj_step(chair, data, nstep=3000)
    names = [wheel.name for wheel in wheels(chair)]
    loads = np.array([data.sensor(f"{name}_tire").data[2] for name in names])
    assert loads.sum() == pytest.approx(9.81 * chair.body_mass.sum(), rel=1e-6)
    assert 0.55 < loads[:2].sum() / loads.sum() < 0.81


def test_grade_is_rise_over_run_by_floor_and_by_gravity():
    mjchair.install()
    for tilt in ("floor", "gravity"):
        model = mjchair.load_spec(scene="ramp", grade=0.1, tilt=tilt).compile()
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        normal = data.geom("floor").xmat.reshape(3, 3)[:, 2]
        down = model.opt.gravity / np.linalg.norm(model.opt.gravity)
        assert math.tan(math.acos(-down @ normal)) == pytest.approx(0.1, rel=1e-9)
        mujoco.mj_step(model, data, nstep=1000)
        assert data.sensor("velocity").data[0] < -0.3, "it should roll backwards, down the ramp"


def test_a_saved_chair_is_taken_whole(tmp_path):
    spec = mjchair.load_spec(scene="ramp", grade=0.05, tire="wheelchair_a0_148")
    path = tmp_path / "model.xml"
    path.write_text(spec.to_xml())
    again = mjchair.load_spec(path).compile()
    first = spec.compile()
    assert np.array_equal(again.geom_user, first.geom_user)
    assert np.array_equal(again.geom("floor").quat, first.geom("floor").quat)


def test_tires_by_group_and_by_wheel():
    model = mjchair.load_spec(tire={"wheels": "genta_table1", "left_caster": "linear"}).compile()
    families = {wheel.name: wheel.block[2] for wheel in wheels(model)}
    assert families == {"left_wheel": 2, "right_wheel": 2, "left_caster": 0, "right_caster": 2}


def test_a_step_beyond_the_stability_limit_is_refused():
    spec = mjchair.load_spec()
    model = spec.compile()
    limit = min(spring.largest_step() for _, spring in springs(model))
    model.opt.timestep = 1.05 * limit
    with pytest.raises(mjchair.MjchairError, match=r"stability limit of .*use at most"):
        check_timestep(model)
    model.opt.timestep = 0.9 * limit
    check_timestep(model)
    assert limit > 0.004


def test_a_tire_without_relaxation_is_refused_in_one_line():
    """NumPy's warnings came to the terminal, and "use at most nan s"."""
    spec = mjchair.load_spec()
    find("relaxation_length").apply(spec, {"length": -0.03})  # all that a caster's tire has
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(mjchair.MjchairError, match=r"caster's tire across; use at most 0 s"):
            check_timestep(spec.compile())


def without(name):
    spec = mjchair.load_spec()
    for element in [*spec.actuators, *spec.geoms, *spec.sensors]:
        if element.name == name:
            spec.delete(element)
    spec.compile()
    return spec.to_xml()


def heavier(mass):
    text = mjchair.load_spec().to_xml()
    return text.replace('mass="85"', f'mass="{mass}"')


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: without("left_caster_tire"), "'left_caster' has no tire"),
        (lambda: heavier(-5), "mass"),
        (lambda: "<mujoco><worldbody/>", "not a model MuJoCo can read"),
        (lambda: "rubbish", "not a model MuJoCo can read"),
    ],
)
def test_bad_models(tmp_path, make, words):
    path = tmp_path / "chair.xml"
    path.write_text(make())
    with pytest.raises(mjchair.MjchairError, match=words) as caught:
        mjchair.load_spec(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"model": "manul"}, "did you mean 'manual'"),
        ({"model": "there/is/none.xml"}, "no model file"),
        ({"scene": "ramps"}, "did you mean 'ramp'"),
        ({"tire": "castor"}, "did you mean 'caster'"),
        ({"tire": {"left_weel": "caster"}}, "did you mean 'left_wheel'"),
        ({"scene": "flat", "grade": 0.1}, "has no grade"),
        ({"scene": "ramp", "grade": math.inf}, "finite rise over run"),
        ({"scene": "ramp", "grade": 0.1, "tilt": "flor"}, "did you mean 'floor'"),
    ],
)
def test_bad_names(given, words):
    with pytest.raises(mjchair.MjchairError, match=words) as caught:
        mjchair.load_spec(**given)
    assert "\n" not in str(caught.value)
