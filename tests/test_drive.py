"""The drive of a power chair: its laws, its state, and a chair that is driven with a joystick."""

import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from conftest import roll
from mujoco import batch, rollout

import mjchair
from mjchair.drive import block, law
from mjchair.drive.attach import attach, drives
from mjchair.drive.files import profiles, read_drive
from mjchair.engine import drivetrain
from mjchair.model import assets, parts

FILE = assets.chairs()["power"].parent / "drive.toml"
FULL = mujoco.mjtState.mjSTATE_FULLPHYSICS
RADIUS, TRACK, FLYWHEEL = 0.17, 0.54, 3.0  # m, m, kg m^2

# a stand with two flywheels in place of the driven wheels
STAND = f"""
<mujoco>
  <option timestep="0.002" integrator="implicitfast"/>
  <worldbody>
    <body name="chair">
      <body name="left_wheel" pos="0 {TRACK / 2} 1"><joint name="left_wheel" axis="0 1 0"/>
        <inertial pos="0 0 0" mass="9" diaginertia="2 {FLYWHEEL} 2"/>
        <geom name="left_wheel_tire" size="{RADIUS}" contype="0" conaffinity="0"/></body>
      <body name="right_wheel" pos="0 {-TRACK / 2} 1"><joint name="right_wheel" axis="0 1 0"/>
        <inertial pos="0 0 0" mass="9" diaginertia="2 {FLYWHEEL} 2"/>
        <geom name="right_wheel_tire" size="{RADIUS}" contype="0" conaffinity="0"/></body>
    </body>
  </worldbody>
  <actuator>
    <motor name="left_wheel" joint="left_wheel"/><motor name="right_wheel" joint="right_wheel"/>
  </actuator>
</mujoco>
"""


def plain_drive(**controller):
    """The shipped drive without friction, compensation and warming, whose battery has no sag."""
    given = read_drive(FILE)
    profile = replace(given.profile, tremor=0.0, curve=1.0, deadband=0.01)
    return replace(
        given,
        motor=replace(given.motor, temperature_coefficient=0.0),
        gear=replace(given.gear, efficiency=1.0, friction=0.0),
        battery=replace(given.battery, internal_resistance=0.001, resistance_growth=0.0),
        controller=replace(given.controller, **{"compensation": 0.0, **controller}),
        profile=profile,
    )


def stand(drive):
    """The stand with a drive: model and data, its brakes open."""
    spec = mujoco.MjSpec.from_string(STAND)
    attach(spec, drive, parts.named)
    model = spec.compile()
    data = mujoco.MjData(model)
    for at in drives(model)[0].motor_states:
        data.act[at + drivetrain.OPEN] = 1.0
    return model, data


def push(data, x, y=0.0):
    data.actuator("joystick_x").ctrl[0] = x
    data.actuator("joystick_y").ctrl[0] = y


def motor(data, name, side="left"):
    names = [component for component, _ in block.MOTOR_SENSOR]
    return float(data.sensor(f"{side}_motor").data[names.index(name)])


@pytest.fixture(autouse=True)
def native():
    mjchair.install()


# equations


def test_a_quarter_of_the_demand_at_half_stick():
    profile = read_drive(FILE).profile
    assert law.joystick_demand(0.5, profile.deadband, profile.curve) == pytest.approx(
        0.25, abs=0.002
    )
    assert law.joystick_demand(-1.0, profile.deadband, profile.curve) == -1.0
    assert law.joystick_demand(0.2499, 0.25, 1.26) == 0.0


@pytest.mark.parametrize("power", [-500.0, 0.0, 40.0, 3000.0])
def test_the_battery_gives_the_power_that_is_taken(power):
    current = law.battery_current(power, 25.0, 0.03)
    assert 25.0 * current - 0.03 * current**2 == pytest.approx(power, abs=1e-9)


def test_a_ramp_is_monotone_and_ends_at_its_goal():
    rng = np.random.default_rng(4)
    for _ in range(200):
        now, wanted = rng.uniform(-2, 2, 2)
        rates = rng.uniform(0.1, 5, 3)
        for _ in range(20000):
            new = law.ramp_step(now, wanted, *rates, 0.002)
            assert abs(new - now) <= max(rates) * 0.002 + 1e-12
            assert abs(new - wanted) <= abs(now - wanted)
            if new == wanted:
                break
            now = new
        assert new == wanted


# motor, on a stand


def test_a_motor_runs_up_as_the_closed_form_says():
    """Behind a ramp a t: a (t - T + T e^(-t/T)), T = R J / k^2."""
    drive = plain_drive()
    model, data = stand(drive)
    k = drive.wheel_constant
    late = drive.motor.resistance * (FLYWHEEL + drive.armature) / k**2
    push(data, 1.0)
    rate = drive.profile.forward_acceleration[1] / RADIUS
    top = drive.profile.forward_speed[1] / RADIUS
    for _ in range(400):
        mujoco.mj_step(model, data)
        t = data.time
        expected = rate * (t - late * (1.0 - math.exp(-t / late)))
        assert data.joint("left_wheel").qvel[0] == pytest.approx(expected, rel=0.01, abs=0.01)
    mujoco.mj_step(model, data, nstep=2000)
    assert data.joint("right_wheel").qvel[0] == pytest.approx(top, rel=1e-3)


def test_a_motor_is_that_of_mujoco():
    """The same voltage on MuJoCo's own dcmotor turns the same flywheel alike."""
    drive = plain_drive()
    model, data = stand(drive)
    reference = mujoco.MjModel.from_xml_string(f"""
        <mujoco><option timestep="0.002" integrator="implicitfast"/>
        <worldbody><body><joint name="j" axis="0 1 0" armature="{drive.armature}"/>
        <inertial pos="0 0 0" mass="9" diaginertia="2 {FLYWHEEL} 2"/></body></worldbody>
        <actuator><dcmotor joint="j" motorconst="{drive.wheel_constant}"
        resistance="{drive.motor.resistance}"/></actuator></mujoco>""")
    theirs = mujoco.MjData(reference)
    rng = np.random.default_rng(1)
    for _ in range(20):
        push(data, rng.uniform(-1, 1))
        for _ in range(100):
            mujoco.mj_step(model, data)
            theirs.ctrl[0] = motor(data, "voltage")
            mujoco.mj_step(reference, theirs)
            assert data.joint("left_wheel").qvel[0] == pytest.approx(theirs.qvel[0], abs=0.03)
    assert abs(theirs.qvel[0]) > 0.1


@pytest.mark.parametrize("compensation", [0.0, 0.1])
def test_load_slows_a_motor_by_what_is_not_compensated(compensation):
    drive = plain_drive(compensation=compensation)
    model, data = stand(drive)
    push(data, 0.5)
    load = -20.0
    data.ctrl[:2] = load
    mujoco.mj_step(model, data, nstep=4000)
    free = law.joystick_demand(0.5, 0.01, 1.0) * drive.profile.forward_speed[1] / RADIUS
    drop = -load * (drive.motor.resistance - compensation) / drive.wheel_constant**2
    assert free - data.joint("left_wheel").qvel[0] == pytest.approx(drop, rel=0.01)


def test_a_stalled_motor_heats_by_its_current_and_folds_back():
    drive = plain_drive()
    model, data = stand(drive)
    model.dof_M0[:] = model.dof_armature[:] = 1e9  # held
    push(data, 1.0)
    mujoco.mj_step(model, data, nstep=1000)
    boosted = drive.controller.boost_current
    assert motor(data, "current") == pytest.approx(boosted)
    heat = boosted**2 * drive.motor.resistance
    assert motor(data, "heat") == pytest.approx(heat)
    warm = motor(data, "temperature")
    mujoco.mj_step(model, data, nstep=500)
    rise = (motor(data, "temperature") - warm) / 1.0
    lost = (warm - drive.motor.ambient) / drive.motor.thermal_resistance
    assert rise == pytest.approx((heat - lost) / drive.motor.heat_capacity, rel=0.02)
    before = motor(data, "current")
    seen = []
    for _ in range(60):
        mujoco.mj_step(model, data, nstep=500)
        seen.append(motor(data, "current"))
    assert (np.diff([before, *seen]) <= 1e-9).all()
    assert seen[-1] < 1.05 * drive.controller.continuous_current
    assert motor(data, "temperature") < drive.controller.largest_temperature


def test_turning_is_to_the_left_of_a_stick_to_the_left():
    model, data = stand(plain_drive())
    push(data, 0.0, 1.0)
    mujoco.mj_step(model, data, nstep=1000)
    left, right = data.joint("left_wheel").qvel[0], data.joint("right_wheel").qvel[0]
    turn = read_drive(FILE).profile.turn_speed[1]
    assert right == pytest.approx(-left, rel=1e-9)
    assert (right - left) * RADIUS / TRACK == pytest.approx(turn, rel=0.01)


def test_a_full_battery_empties_by_what_is_drawn():
    model, data = stand(plain_drive())
    push(data, 1.0)
    used = 0.0
    for _ in range(1000):
        mujoco.mj_step(model, data)
        used += data.sensor("drive").data[5] * model.opt.timestep
    charge = data.sensor("drive").data[3] - data.sensor("drive").data[5] * 0.002 / (50 * 3600)
    assert 1.0 - charge == pytest.approx(used / (50.0 * 3600.0), rel=1e-9)


def test_an_empty_battery_stops_the_chair():
    drive = plain_drive()
    model, data = stand(replace(drive, battery=replace(drive.battery, charge=0.0)))
    push(data, 1.0)
    mujoco.mj_step(model, data, nstep=500)
    assert data.joint("left_wheel").qvel[0] == 0.0
    assert data.sensor("drive").data[3] == 0.0, "standby takes no charge that is not there"


def test_a_battery_that_runs_empty_stays_empty():
    drive = plain_drive()
    model, data = stand(replace(drive, battery=replace(drive.battery, charge=1e-4, capacity=1.0)))
    push(data, 1.0)
    charge = np.empty(3000)
    for k in range(charge.size):
        mujoco.mj_step(model, data)
        charge[k] = data.sensor("drive").data[3]
    assert charge[0] > 0.0 and (np.diff(charge) <= 0.0).all() and charge.min() >= 0.0
    assert charge[-1] < 1e-9 and abs(data.joint("left_wheel").qvel[0]) < 1e-3


# state


@pytest.fixture(scope="module")
def spec():
    return mjchair.load_spec("power", drive="normal")


def winding(model, steps=1200, prefix=""):
    """Stick to and fro, with releases, (steps, nu)."""
    time = np.arange(steps) * model.opt.timestep
    control = np.zeros((steps, model.nu))
    control[:, model.actuator(prefix + "joystick_x").id] = np.where(time < 1.6, 0.9, 0.0)
    control[:, model.actuator(prefix + "joystick_y").id] = np.where(
        time < 1.6, 0.7 * np.sin(4.0 * time), 0.0
    )
    return control


@pytest.fixture(scope="module")
def reference(spec):
    mjchair.install()
    model = spec.compile()
    states = roll(model, winding(model))
    assert np.ptp(states[:, 1]) > 0.5 and np.ptp(states[:, 2]) > 0.03
    return states


def test_batch_rollout_and_xml_are_mj_step(spec, reference):
    model = spec.compile()
    control = winding(model)
    many = batch.Batch(model, nsim=2, nthread=2)
    many.reset(stage=mujoco.mjtStage.mjSTAGE_NONE)
    for row, expected in zip(control[:300], reference, strict=False):
        many.ctrl = row
        many.step()
        assert np.array_equal(many.qpos[1], expected[1 : 1 + model.nq])
    start = np.empty(mujoco.mj_stateSize(model, FULL))
    mujoco.mj_getState(model, mujoco.MjData(model), start, FULL)
    data = [mujoco.MjData(model) for _ in range(2)]
    with rollout.Rollout(nthread=2) as runner:
        states, _ = runner.rollout(model, data, np.tile(start, (2, 1)), control)
    assert np.array_equal(states[0], reference) and np.array_equal(states[1], reference)
    again = mujoco.MjModel.from_xml_string(spec.to_xml())
    assert np.array_equal(roll(again, winding(again)), reference)


def test_stopped_and_gone_on_in_the_middle_is_the_same(spec, reference):
    model = spec.compile()
    control = winding(model)
    data = mujoco.MjData(model)
    mujoco.mj_setState(model, data, reference[499], FULL)
    data.qacc_warmstart[:] = 0.0
    first = mujoco.MjData(model)
    roll(model, control[:500], first)
    data.qacc_warmstart[:] = first.qacc_warmstart
    for _ in range(3):
        mujoco.mj_forward(model, data)
    data.qacc_warmstart[:] = first.qacc_warmstart
    assert np.array_equal(roll(model, control[500:], data), reference[500:])


def test_the_plain_callbacks_are_the_compiled_ones(spec, reference):
    model = spec.compile()
    mjchair.install(compiled=False)
    states = roll(model, winding(model)[:150])
    assert np.allclose(states, reference[:150], rtol=0.0, atol=1e-9)


def test_attached_under_a_prefix_is_the_same_chair(spec, reference):
    parent = mujoco.MjSpec()
    for field in ("timestep", "integrator", "tolerance", "cone"):
        setattr(parent.option, field, getattr(spec.option, field))
    parent.attach(
        mjchair.load_spec("power", drive="normal"), prefix="a/", frame=parent.worldbody.add_frame()
    )
    model = parent.compile()
    states = roll(model, winding(model, 300, "a/"))
    assert np.array_equal(
        states[:, : 1 + model.nq + model.nv], reference[:300, : 1 + model.nq + model.nv]
    )


def test_without_a_drive_nothing_is_added():
    model = mjchair.load_spec("power").compile()
    assert not drives(model) and model.nu == 6
    assert mjchair.load_spec("power", drive="normal").compile().nu == 11


def test_torques_act_besides_the_drive(spec):
    torque = mjchair.simulate(spec, {"left_wheel": 30.0, "right_wheel": 30.0}, 0.6)
    assert abs(torque["velocity.x"][-1]) < 1e-3, "the parking brakes hold it"
    both = mjchair.simulate(spec, {"left_wheel": 10.0, "right_wheel": 10.0, "joystick_x": 0.6}, 2.0)
    alone = mjchair.simulate(spec, {"joystick_x": 0.6}, 2.0)
    assert both["velocity.x"][-1] > alone["velocity.x"][-1] + 0.01


# the chair


def test_released_at_full_speed_it_stops_and_stays_on_a_slope():
    spec = mjchair.load_spec("power", "ramp", grade="1:6", drive="normal")
    time = np.array([0.0, 3.0, 3.001, 9.0])
    run = mjchair.simulate(
        spec, mjchair.Inputs(time, {"joystick_x": np.array([1.0, 1.0, 0.0, 0.0])}), 9.0
    )
    moving = run["velocity.x"]
    assert moving.max() > 1.5
    last = run.time > 8.9
    speed = np.abs(run.qvel[last]).max()
    assert speed < 1e-10
    assert (run["left_motor.brake"][last] == 1.0).all()
    # the reference goes down as the profile says
    falling = (run.time > 3.3) & (run["drive.speed_reference"] > 0.1)
    slope = np.diff(run["drive.speed_reference"][falling]) / run.timestep
    assert slope == pytest.approx(-2.4, rel=1e-6)


def test_it_stands_where_it_was_put_on_a_slope():
    spec = mjchair.load_spec("power", "ramp", grade="1:6", drive="indoor")
    run = mjchair.simulate(spec, {"joystick_x": 0.0}, 0.5)
    assert np.abs(run.qvel).max() < 1e-6
    assert np.ptp(run["position.x"]) < 1e-7


@pytest.mark.parametrize("name", profiles(FILE))
def test_every_profile_drives(name):
    spec = mjchair.load_spec("power", drive=name)
    run = mjchair.simulate(spec, {"joystick_x": 1.0, "joystick_y": 0.4}, 2.5)
    assert run["velocity.x"][-1] > 0.3 and run["heading"][-1] > 0.1


def test_a_chair_that_starts_moving_goes_on(spec):
    run = mjchair.simulate(spec, {"joystick_x": 1.0}, 0.5, initial={"speed": 1.9})
    assert run["velocity.x"].min() > 1.8


# bad input


def bad(**change):
    text = FILE.read_text()
    for old, new in change.values():
        assert old in text
        text = text.replace(old, new)
    return text


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("capacity = { value = 50.0", "capacity = { value = 0.0", "capacity is 0 A h"),
        ("[0.25, 1.0]", "[0.25, 3.0]", "reverse_speed is 3 m/s; the motors reach 2.38"),
        ('unit = "ohm"', 'unit = "Ohm"', "unit is 'Ohm'"),
        ("standby = ", "stanby = ", "did you mean 'standby'"),
        ("value = 0.15,", "value = 0.25,", "compensation is 0.25 ohm"),
        ("[23.2, 24.0", "[24.2, 24.0", "five rising numbers"),
        ("[0.5, 2.0]", "[2.0, 0.5]", "the second not the smaller"),
        ('source = "copper"', 'source = " "', "source is empty"),
        ("[profile.indoor]", "[profile.indoor", "not TOML"),
        ("boost_current = { value = 70.0", "boost_current = { value = nan", "boost_current is nan"),
    ],
)
def test_a_bad_drive_file_is_refused_in_one_line(tmp_path, old, new, words):
    path = tmp_path / "drive.toml"
    path.write_text(bad(it=(old, new)))
    with pytest.raises(mjchair.MjchairError) as error:
        mjchair.load_spec("power", drive=path)
    assert words in str(error.value) and "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("model", "drive", "words"),
    [
        ("power", "indor", "did you mean 'indoor'"),
        ("manual", "indoor", "manual has no drive"),
        ("power", "nowhere.toml", "no drive file"),
    ],
)
def test_a_drive_that_is_not_there(model, drive, words):
    with pytest.raises(mjchair.MjchairError, match=words):
        mjchair.load_spec(model, drive=drive)


def test_a_joystick_beyond_its_reach(spec):
    with pytest.raises(mjchair.MjchairError, match=r"joystick_x is 1.2 at 0 s; .*-1 to 1"):
        mjchair.simulate(spec, {"joystick_x": 1.2}, 0.1)


def test_a_joystick_for_a_chair_without_a_drive(tmp_path):
    path = tmp_path / "stick.csv"
    path.write_text("time,joystick_x\n0,1\n1,1\n")
    with pytest.raises(mjchair.MjchairError, match="drive="):
        mjchair.simulate(mjchair.load_spec("power"), path)


def test_the_time_step_is_held_against_the_drive():
    with pytest.raises(mjchair.MjchairError, match="stability limit of the drive"):
        drive = read_drive(FILE)
        slack = replace(drive, motor=replace(drive.motor, rotor_inertia=1e-6, resistance=0.17))
        mjchair.load_spec("power", drive=slack)
