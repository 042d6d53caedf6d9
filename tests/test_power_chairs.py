"""Rear, mid and front drive under a joystick: how they go and what they use."""

import math
from dataclasses import replace

import numpy as np
import pytest

import mjchair
from mjchair.simulation.energy import energy_balance
from mjchair.testlab import Design
from mjchair.testlab.brakes import stopping_distance
from mjchair.testlab.energy import energy

CHAIRS = ("power", "power_mid", "power_front")
GRAVITY = 9.81


def held(times, x, y=None):
    """Stick positions that hold between the times."""
    controls = {"joystick_x": np.array(x, float)}
    if y is not None:
        controls["joystick_y"] = np.array(y, float)
    return mjchair.Inputs(np.array(times, float), controls, hold=True)


@pytest.mark.parametrize("name", CHAIRS)
def test_it_stands_on_all_its_wheels_drives_turns_and_stops(name):
    spec = mjchair.load_spec(name, drive="normal")
    model = spec.compile()
    inputs = held([0.0, 1.5, 3.0, 5.5], [0.8, 0.6, 0.0, 0.0], [0.0, 0.7, 0.0, 0.0])
    run = mjchair.simulate(spec, inputs, 5.5)
    assert run.status is mjchair.Status.COMPLETED
    loads = np.array([run[f"{wheel}_tire.Fz"][0] for wheel in run.wheels])
    assert loads.sum() == pytest.approx(GRAVITY * model.body_mass.sum(), rel=1e-4)
    assert loads.min() > 0.05 * loads.sum()
    assert 0.5 < loads[:2].sum() / loads.sum() < 0.7
    assert run["velocity.x"].max() > 0.8 and run["heading"][-1] > 0.3
    assert abs(run["velocity.x"][-1]) < 0.02 and abs(run["imu_gyro.z"][-1]) < 0.02


def test_casters_of_the_mid_drive_go_over_a_threshold_on_their_springs():
    spec = mjchair.load_spec("power_mid", "threshold", step=0.012, drive="indoor")
    run = mjchair.simulate(spec, {"joystick_x": 1.0}, 3.5)
    model = spec.compile()
    for caster in ("left_caster", "left_rear_caster"):
        at = model.joint(f"{caster}_slide").qposadr[0]
        assert np.ptp(run.qpos[:, at]) > 0.004
    assert run["position.x"][-1] > 1.5 and run.status is mjchair.Status.COMPLETED


def test_all_casters_take_the_parameters_of_casters():
    model = mjchair.load_spec("power_mid", parameters={"caster_radius": 0.08}).compile()
    sizes = [model.geom(f"{c}_tire").size[0] for c in ("left_caster", "right_rear_caster")]
    assert sizes == [0.08, 0.08]


# what it uses


@pytest.mark.parametrize(
    ("name", "scene", "grade"),
    [("power", "ramp", 0.08), ("power_mid", "flat", None), ("power_front", "cross_slope", 0.05)],
)
def test_energy_closes(name, scene, grade):
    spec = mjchair.load_spec(name, scene, grade=grade, drive="normal")
    inputs = held([0, 2, 3, 4, 5, 7], [1.0, 0.7, -0.6, 0.9, 0.0, 0.0], [0.0, 0.6, 0.0, -0.5, 0, 0])
    balance = energy_balance(spec, inputs)
    assert abs(balance.missing) < 0.005 * balance.battery
    for part in ("internal", "standby", "winding", "gear", "rolling", "bearings"):
        assert getattr(balance, part) > 0.0


def test_what_is_left_of_the_energy_is_the_error_of_the_step():
    """Halved with the step: what does not go away is energy that is kept or lost somewhere else."""
    inputs = held([0, 2, 4, 5], [0.8, 0.8, 0.0, 0.0], [0.0, 0.5, 0.0, 0.0])
    left = []
    for step in (0.002, 0.001):
        spec = mjchair.load_spec("power", "ramp", grade=-1 / 12, drive="normal")
        spec.option.timestep = step
        left.append(energy_balance(spec, inputs).missing)
    assert abs(left[0]) < 1.0, "J"
    assert abs(left[1] - 0.5 * left[0]) < 0.02, "J"


def test_a_full_battery_takes_no_charge_and_warms_instead():
    spec = mjchair.load_spec("power", "ramp", grade=-1 / 6, drive="normal")
    inputs = held([0, 4], [0.9, 0.9])
    run = mjchair.simulate(spec, inputs, sample_rate=50.0)
    assert run["drive.battery_current"].min() < -1.0, "A: it brakes downhill, or nothing is tested"
    assert run["drive.battery_charge"].max() <= 1.0
    assert run["drive.battery_power"][-1] == 0.0, "W: it is full again, and takes no more"
    balance = energy_balance(spec, inputs)
    assert abs(balance.battery) < 1.0 and abs(balance.missing) < 1.0, "J"
    assert balance.internal > 400.0, "J: what it gives back is heat in the battery"


def test_an_energy_balance_needs_a_drive():
    with pytest.raises(mjchair.MjchairError, match="0 drives"):
        energy_balance(mjchair.load_spec("power"), {"left_wheel": 1.0}, 0.1)


def test_torques_of_others_are_in_the_balance():
    spec = mjchair.load_spec("power", drive="normal")
    balance = energy_balance(spec, {"joystick_x": 0.6, "left_wheel": 6.0, "right_wheel": 6.0}, 2.5)
    assert balance.torques > 50.0
    assert abs(balance.missing) < 0.005 * balance.battery


def test_published_ranges_are_bracketed_by_the_shipped_profiles():
    """Braking 7.4 to 117.3 cm, range 18.2 to 32.0 km: Pearlman 2005; a dummy of 100 kg."""
    normal, gentle = (Design("power", 100.0, drive=p) for p in ("normal", "training"))
    assert stopping_distance(gentle, "power_off", 0.0) < 0.074  # m
    level, down = (stopping_distance(normal, "release", math.radians(s)) for s in (0.0, 3.0))
    assert 0.9 < level < 1.173 < down
    assert energy(normal)["range_manoeuvring"] < 18.2  # km
    assert energy(gentle)["range_continuous"] > 32.0


# where it goes


def on_slope(compensation, efficiency=1.0, friction=0.0):
    """At 1 m/s along a cross slope of 2 deg: the drive, and means over the last 0.2 s of a run."""
    drive = mjchair.load_drive("power", "normal")
    drive = replace(
        drive,
        gear=replace(drive.gear, efficiency=efficiency, friction=friction),
        controller=replace(drive.controller, compensation=compensation),
    )
    spec = mjchair.load_spec("power", "cross_slope", grade=math.tan(math.radians(2.0)), drive=drive)
    x, _ = drive.joystick(1.0, 0.0)
    run = mjchair.simulate(spec, {"joystick_x": x}, 1.5, initial={"speed": 1.0})
    return drive, lambda channel: float(run[channel][-100:].mean())


def turn_of_wheels(mean):
    """Difference of the wheels' speeds over the track, rad/s."""
    return (mean("right_wheel_speed") - mean("left_wheel_speed")) * 0.17 / 0.54


def moment_of_casters(mean):
    """Moment (N m) about the middle of the drive axle of the casters' tire forces.

    Stems 0.55 m ahead and 0.24 m to each side, trail 0.05 m (models/power/README.md).
    """
    moment = 0.0
    for side, aside in (("left", 0.24), ("right", -0.24)):
        turned = mean(f"{side}_caster_angle")
        c, s = math.cos(turned), math.sin(turned)
        along, across = (mean(f"{side}_caster_tire.{f}") for f in ("Fx", "Fy"))
        x, y = 0.55 - 0.05 * c, aside - 0.05 * s
        moment += x * (s * along + c * across) - y * (c * along - s * across)
    return moment


@pytest.mark.parametrize("compensation", [0.0, 0.1, 0.2])
def test_it_veers_down_a_cross_slope_as_the_closed_form_says(compensation):
    """Turn of the wheels: w = -2 M r^2 (R - Rc) / (k track)^2, M the moment that the motors bear.

    The weight and the turn itself give M = m d (g sin b + v yaw) about the drive axle. The casters
    and the aligning moments of the driven tires bear 2 to 6 % of it, and the wheels' own losses
    differ, since the lower wheel carries more: these terms partly cancel.
    """
    drive, mean = on_slope(compensation)
    rest = drive.motor.resistance - compensation
    constant = drive.wheel_constant
    turn, yaw = turn_of_wheels(mean), mean("imu_gyro.z")
    speed = 0.5 * 0.17 * (mean("left_wheel_speed") + mean("right_wheel_speed"))
    pull = GRAVITY * math.sin(math.radians(2.0)) * math.cos(mean("heading")) + speed * yaw
    whole = 160.0 * 0.2 * pull
    assert yaw < 0.0
    assert turn == pytest.approx(-2.0 * whole * rest * (0.17 / (constant * 0.54)) ** 2, rel=0.02)
    driven = ("left_wheel", "right_wheel")
    aligning = sum(mean(f"{wheel}_tire.Mz") for wheel in driven)
    moment = whole - moment_of_casters(mean) - aligning
    more_load = mean("right_wheel_tire.Fz") - mean("left_wheel_tire.Fz")
    torques = 2.0 * moment * 0.17 / 0.54  # N m, right minus left, at the tires
    torques += 0.01 * 0.17 * more_load + 0.05 * turn * 0.54 / 0.17  # rolling resistance, bearings
    assert turn == pytest.approx(-torques * rest / constant**2 * 0.17 / 0.54, rel=0.01)


def test_load_compensation_lessens_the_veer_of_the_shipped_chair():
    shipped = mjchair.load_drive("power", "normal")
    gear = {"efficiency": shipped.gear.efficiency, "friction": shipped.gear.friction}
    without, with_it = (turn_of_wheels(on_slope(c, **gear)[1]) for c in (0.0, 0.15))
    assert 0.3 < with_it / without < 0.7


def test_without_load_compensation_it_creeps_at_a_threshold():
    least = []
    for compensation in (0.0, 0.2):
        drive = mjchair.load_drive("power", "indoor")
        drive = replace(drive, controller=replace(drive.controller, compensation=compensation))
        spec = mjchair.load_spec("power", "threshold", step=0.015, drive=drive)
        run = mjchair.simulate(spec, {"joystick_x": drive.joystick(0.4, 0.0)[0]}, 5.0)
        least.append(run["velocity.x"][(run.time > 1.0) & (run["position.x"] < 1.6)].min())
    assert least[0] < least[1] - 0.03


def test_direction_is_lost_most_where_both_casters_stand_across():
    lost = {}
    for degrees in (0, 45, 90, 135, 180):
        simulator = mjchair.Simulator(mjchair.load_spec("power", drive="normal"), rate=50)
        for side in ("left", "right"):
            joint = simulator.data.joint(f"{side}_caster_swivel")
            joint.qpos[0] = math.radians(degrees)
        run = simulator.run(lambda observation: (-0.6, 0.0), 1.6)
        lost[degrees] = abs(run["heading"][-1])
    assert max(lost, key=lost.get) == 90
    assert lost[0] < 1e-3 and lost[180] < 1e-3 and lost[90] > 5 * lost[0] + 1e-3


def test_a_drive_is_part_of_a_saved_chair(tmp_path):
    spec = mjchair.load_spec("power_mid", drive="indoor")
    path = tmp_path / "chair.xml"
    path.write_text(spec.to_xml())
    again = mjchair.load_spec(path)
    inputs = {"joystick_x": 0.7, "joystick_y": 0.3}
    one, two = (mjchair.simulate(s, inputs, 0.5) for s in (spec, again))
    assert np.array_equal(one.qpos, two.qpos)
