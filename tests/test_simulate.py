import mujoco
import numpy as np
import pytest

import mjchair
from mjchair.errors import MjchairError
from mjchair.simulation.recording import Status, load_recording


@pytest.fixture(scope="module")
def pushed(manual_spec):
    pushes = mjchair.push_strokes({"left_wheel": 12.0, "right_wheel": 9.0}, 1.5)
    return mjchair.simulate(manual_spec, pushes, initial={"speed": 0.5, "yaw_rate": 0.2})


def test_every_sensor_has_a_name_and_a_unit(pushed):
    expected = {
        "left_wheel_angle": "rad",
        "left_wheel_speed": "rad/s",
        "right_caster_angle": "rad",
        "imu_gyro.z": "rad/s",
        "imu_accelerometer.x": "m/s^2",
        "position.y": "m",
        "heading": "rad",
        "velocity.x": "m/s",
        "left_wheel_tire.Fx": "N",
        "right_caster_tire.Mz": "N m",
        "left_caster_tire.kappa": "1",
        "left_wheel_tire.gamma": "rad",
    }
    assert {name: pushed.units[name] for name in expected} == expected
    assert "?" not in pushed.units.values()
    assert list(pushed.controls) == ["left_wheel", "right_wheel"]
    assert pushed.units["left_wheel"] == "N m"
    assert pushed.wheels == ["left_wheel", "right_wheel", "left_caster", "right_caster"]


def test_sensors_describe_the_same_instant_as_positions(manual, pushed):
    """A sensor that lagged by a step would be off by speed times timestep, 1e-3."""
    angle = manual.joint("left_wheel").qposadr[0]
    speed = manual.joint("left_wheel").dofadr[0]
    np.testing.assert_array_equal(pushed["left_wheel_angle"], pushed.qpos[:, angle])
    np.testing.assert_array_equal(pushed["left_wheel_speed"], pushed.qvel[:, speed])


def test_it_is_mj_step_with_the_callbacks(manual, pushed):
    data = mujoco.MjData(manual)
    from mjchair.simulation.initial import Initial, start

    with mjchair.installed():
        data = start(manual, Initial(speed=0.5, yaw_rate=0.2))
        for k in range(pushed.time.size - 1):
            np.testing.assert_array_equal(data.qpos, pushed.qpos[k])
            for name in ("left_wheel", "right_wheel"):
                data.actuator(name).ctrl = pushed.controls[name][k]
            mujoco.mj_step(manual, data)
    np.testing.assert_array_equal(data.qpos, pushed.qpos[-1])


@pytest.mark.parametrize("heading", [0.0, 2.0, -3.0])
@pytest.mark.parametrize(
    ("scene", "grade"), [("flat", None), ("ramp", 0.08), ("cross_slope", 0.08)]
)
def test_a_rolling_start_is_where_it_should_be_and_rolls_without_slip(scene, grade, heading):
    spec = mjchair.load_spec("manual", scene, grade=grade)
    start = mjchair.Initial(position=(1.0, -2.0), heading=heading, speed=0.8, yaw_rate=0.3)
    run = mjchair.simulate(spec, None, 0.2, initial=start)
    np.testing.assert_allclose(run.vector("position")[0, :2], (1.0, -2.0), atol=1e-9)
    assert run["heading"][0] == pytest.approx(heading, abs=1e-3)
    # the chair pitches a little on its tires, so its own x is not quite along the floor
    assert run["velocity.x"][0] == pytest.approx(0.8, abs=1e-3)
    assert run["velocity.y"][0] == pytest.approx(0.0, abs=1e-3)
    downhill = 90.0 * 9.81 * (grade or 0.0)  # N, which the tires carry across or along
    for wheel in run.wheels:
        for axis in ("Fx", "Fy"):  # a wheel with the wrong spin or heading would slide: 100 N
            assert np.abs(run[f"{wheel}_tire.{axis}"][:25]).max() < 20.0 + 0.5 * downhill


def test_backwards_the_casters_trail_the_other_way(manual_spec):
    run = mjchair.simulate(manual_spec, None, 0.2, initial={"speed": -0.8})
    assert abs(run["left_caster_angle"][0]) == pytest.approx(np.pi, abs=1e-6)
    assert run["left_wheel_speed"][0] == pytest.approx(-0.8 / 0.3, rel=0.01)


def test_at_rest_it_starts_settled(manual_spec):
    run = mjchair.simulate(manual_spec, None, 0.5)
    load = sum(run[f"{wheel}_tire.Fz"] for wheel in run.wheels)
    np.testing.assert_allclose(load, 90.0 * 9.81, rtol=1e-3)
    assert np.abs(run.vector("velocity")).max() < 2e-4


def test_brakes_hold_on_a_ramp_and_without_them_it_rolls():
    spec = mjchair.load_spec("manual", "ramp", grade=1 / 12)
    held = mjchair.simulate(spec, None, 1.0, brakes=True)
    free = mjchair.simulate(spec, None, 1.0)
    assert abs(held["position.x"][-1] - held["position.x"][0]) < 1e-6
    assert np.abs(held.qvel[0]).max() < 1e-6
    assert free["position.x"][-1] - free["position.x"][0] < -0.2


def test_brakes_lock_at_the_angle_the_wheels_have(manual_spec):
    spec = mjchair.load_spec("manual", "ramp", grade=1 / 12)
    run = mjchair.simulate(spec, None, 0.5, brakes=True, initial={"position": (3.0, 0.0)})
    assert np.ptp(run["left_wheel_angle"]) < 1e-3


@pytest.mark.filterwarnings("ignore:Attach conflict")
def test_a_prefixed_chair_is_driven_by_its_short_names(manual_spec):
    parent = mujoco.MjSpec()
    parent.worldbody.add_geom(name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1])
    chair = mjchair.load_spec("manual")
    chair.delete(chair.geom("floor"))
    parent.attach(chair, frame=parent.worldbody.add_frame(), prefix="a/")
    model = parent.compile()
    model.opt.timestep = 0.002
    run = mjchair.simulate(model, mjchair.constant({"left_wheel": 3.0}, 0.5))
    assert run["left_wheel_speed"][-1] > 0.2
    assert "a/left_wheel" in run.controls


def test_a_broken_run_says_when_and_keeps_what_it_has(manual_spec, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    ramp = mjchair.Inputs(np.array([0.0, 0.5, 0.6]), {"left_wheel": np.array([0.0, 0.0, 1e7])})
    run = mjchair.simulate(manual_spec, ramp, 1.0)
    assert run.status is Status.UNSTABLE
    assert 0.5 < run.stopped_at < 0.6
    assert run.time[-1] == pytest.approx(run.stopped_at - run.timestep)
    assert all(np.isfinite(values).all() for values in run.channels.values())
    assert run.reason
    assert not list(tmp_path.iterdir())  # MuJoCo's log file
    run.save(tmp_path / "run.npz")
    assert load_recording(tmp_path / "run.npz").status is Status.UNSTABLE


def test_chunks_and_sample_rate_change_nothing(manual_spec, monkeypatch):
    torque = mjchair.constant({"left_wheel": 5.0, "right_wheel": 2.0}, 0.5)
    whole = mjchair.simulate(manual_spec, torque)
    monkeypatch.setattr("mjchair.simulation.simulate.CHUNK", 37)
    parts = mjchair.simulate(manual_spec, torque)
    sparse = mjchair.simulate(manual_spec, torque, sample_rate=100.0)
    np.testing.assert_array_equal(whole.qpos, parts.qpos)
    np.testing.assert_array_equal(whole["imu_gyro.z"], parts["imu_gyro.z"])
    np.testing.assert_array_equal(whole.time[::5], sparse.time)
    np.testing.assert_array_equal(whole["left_wheel_tire.Fx"][::5], sparse["left_wheel_tire.Fx"])
    np.testing.assert_array_equal(whole.controls["left_wheel"][::5], sparse.controls["left_wheel"])


def test_plain_callbacks_give_the_same_run(manual_spec):
    torque = mjchair.constant({"left_wheel": 5.0, "right_wheel": 2.0}, 0.1)
    one = mjchair.simulate(manual_spec, torque)
    two = mjchair.simulate(manual_spec, torque, compiled=False)
    np.testing.assert_allclose(one.qpos, two.qpos, atol=1e-9)


def test_callbacks_and_model_are_left_as_they_were(manual):
    marker = lambda m, d, i: 0.0  # noqa: E731
    mujoco.set_mjcb_act_dyn(marker)
    before = manual.eq_active0.copy(), manual.opt.timestep
    mjchair.simulate(manual, None, 0.01, timestep=0.001, brakes=True)
    assert mujoco.get_mjcb_act_dyn() is marker
    np.testing.assert_array_equal(manual.eq_active0, before[0])
    assert manual.opt.timestep == before[1]


def test_a_recording_can_be_simulated_again(manual_spec, tmp_path):
    torque = mjchair.constant({"left_wheel": 5.0}, 0.2)
    run = mjchair.simulate(manual_spec, torque)
    run.save(tmp_path / "run.npz")
    again = mjchair.simulate(load_recording(tmp_path / "run.npz").model.load(), torque)
    np.testing.assert_array_equal(run.qpos, again.qpos)


@pytest.mark.parametrize(
    ("options", "line"),
    [
        ({}, "no duration and no inputs"),
        ({"duration": -1.0}, "duration is -1 s; it must be positive"),
        ({"duration": 1.0, "timestep": 0.0}, "timestep is 0 s; it must be positive"),
        ({"duration": 1.0, "timestep": 0.05}, "beyond the stability limit"),
        ({"duration": 1.0, "sample_rate": 333.0}, "the nearest at a step of 0.002 s is 250 Hz"),
        ({"duration": 1.0, "initial": {"sped": 1.0}}, "'sped' is unknown; did you mean 'speed'"),
        ({"duration": 1.0, "initial": {"speed": np.nan}}, "speed is nan; it must be finite"),
        ({"duration": 1.0, "initial": {"position": (1.0,)}}, "must be"),
    ],
)
def test_bad_options_get_one_line(manual_spec, options, line):
    with pytest.raises(MjchairError, match=line):
        mjchair.simulate(manual_spec, **options)


def test_what_a_model_lacks_is_named():
    bare = mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><body><joint name='j'/><geom size='0.1'/></body></worldbody></mujoco>"
    )
    with pytest.raises(MjchairError, match="no parking brake"):
        mjchair.simulate(bare, None, 0.1, brakes=True)
    with pytest.raises(MjchairError, match="unknown joint 'chair'"):
        mjchair.simulate(bare, None, 0.1, initial={"speed": 1.0})
    assert mjchair.simulate(bare, None, 0.1).status is Status.COMPLETED


def test_inputs_may_be_constants_or_a_table(tmp_path):
    spec = mjchair.load_spec()
    torque = {"left_wheel": 5.0, "right_wheel": 5.0}
    by_name = mjchair.simulate(spec, torque, 0.2)
    (tmp_path / "drive.csv").write_text("time,left_wheel,right_wheel\n0,5,5\n0.2,5,5\n")
    by_table = mjchair.simulate(spec, tmp_path / "drive.csv")
    assert np.array_equal(by_name.qpos, by_table.qpos)
    with pytest.raises(mjchair.MjchairError, match="need a duration"):
        mjchair.simulate(spec, torque)


def test_a_spec_is_simulated_as_its_model_is(manual_spec):
    torque = mjchair.constant({"left_wheel": 5.0, "right_wheel": 3.0}, 0.5)
    given, compiled = (mjchair.simulate(m, torque) for m in (manual_spec, manual_spec.compile()))
    np.testing.assert_array_equal(given.qpos, compiled.qpos)
    for name, values in given.channels.items():
        np.testing.assert_array_equal(values, compiled[name])
    assert given.model.load().ngeom == compiled.model.load().ngeom


def test_a_users_control_callback_drives_and_stays():

    spec = mjchair.load_spec()
    calls = []

    def mine(model, data):
        calls.append(data.time)
        data.ctrl[model.actuator("left_wheel").id] = 3.0

    mujoco.set_mjcb_control(mine)
    try:
        run = mjchair.simulate(spec, None, 0.1)
        assert mujoco.get_mjcb_control() is mine
    finally:
        mujoco.set_mjcb_control(None)
    assert run["left_wheel_speed"][-1] > 0.01
    assert len(calls) == 51, "one a step: settling is not driven"
