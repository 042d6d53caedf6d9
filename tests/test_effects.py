import math

import mujoco
import numpy as np
import pytest

import mjchair
from mjchair.effects import bearing_friction, caster_friction, rolling_resistance, toe
from mjchair.effects.library import MECHANICAL, find, library, names
from mjchair.errors import MjchairError
from mjchair.model import parts
from mjchair.simulation.initial import Initial, start
from mjchair.tire import block

CONTRACT = {
    "rolling_resistance": {"coefficient"},
    "bearing_friction": {"coulomb", "viscous"},
    "air_drag": {"drag_area"},
    "wind": {"x", "y", "drag_area"},
    "floor_slope": {"x", "y"},
    "toe": {"symmetric", "asymmetric"},
    "camber": {"angle"},
    "mass_offset": {"x", "y"},
    "payload": {"mass", "height"},
    "wheel_radius": {"left", "right"},
    "cornering_stiffness": {"front", "rear"},
    "load_sensitivity": {"exponent"},
    "tire_friction": {"factor"},
    "relaxation_length": {"length"},
    "turning_scrub": {"moment", "rate"},
    "caster_friction": {"moment", "slope"},
    "caster_trail": {"length"},
    "torque_gain": {"left", "right"},
    "torque_delay": {"delay"},
    "drive_lag": {"time_constant"},
    "back_emf": {"coefficient"},
    "weak_motor": {"left", "right"},
    "low_battery": {"used"},
    "dragging_brake": {"left", "right"},
    "rider_motion": {"mass", "amplitude", "frequency", "phase"},
    "surface_patch": {"x", "y", "radius", "coefficient"},
}


def test_names_and_parameters_are_those_of_the_contract():
    for name, parameters in CONTRACT.items():
        assert {p.name for p in find(name).parameters} == parameters
    assert set(names()) == {*CONTRACT, "sensor_bias", "sensor_scale", "sensor_delay"}


@pytest.mark.parametrize("effect", library(["imu_gyro.z"]), ids=lambda e: e.key)
def test_an_effect_at_neutral_changes_nothing_and_at_its_start_survives_xml(effect):
    base = mjchair.load_spec()
    same = base.copy()
    effect.apply(same, effect.neutral())
    a, b = base.copy().compile(), same.compile()
    with mjchair.installed():
        runs = [_rolled(a), _rolled(b)]
        np.testing.assert_allclose(runs[0], runs[1], atol=1e-9)
        start = effect.starts()[0]
        spec = base.copy()
        effect.apply(spec, start.combine(np.ones(len(start.points))))
        saved = mujoco.MjModel.from_xml_string(spec.to_xml())
        np.testing.assert_allclose(_rolled(saved), _rolled(spec.compile()), atol=1e-5)


@pytest.fixture(scope="module")
def driven():
    return mjchair.load_spec("power", "ramp", grade=0.1, drive="normal")


FAULTS = [e for e in MECHANICAL if e.drive]


def _going(spec, duration=2.0):
    return mjchair.simulate(spec, {"joystick_x": 1.0}, duration)


@pytest.mark.parametrize("effect", FAULTS, ids=lambda e: e.key)
def test_a_fault_of_a_drive_at_neutral_changes_nothing_and_survives_xml(driven, effect):
    same, faulty = driven.copy(), driven.copy()
    effect.apply(same, effect.neutral())
    effect.apply(faulty, effect.example)
    sound, broken = _going(driven, 1.2), _going(faulty, 1.2)
    assert np.array_equal(_going(same, 1.2).qpos, sound.qpos)
    assert np.abs(broken.qpos - sound.qpos).max() > 1e-4
    saved = mujoco.MjModel.from_xml_string(faulty.to_xml())
    assert np.array_equal(_going(saved, 1.2).qpos, broken.qpos)
    with pytest.raises(mjchair.MjchairError, match="no drive"):
        effect.apply(mjchair.load_spec("power"), effect.example)


def test_a_weak_motor_turns_the_chair_to_its_side_and_a_low_battery_slows_it(driven):
    ends = {}
    for effect in FAULTS:
        spec = driven.copy()
        effect.apply(spec, effect.example)
        ends[effect.name] = _going(spec)
    sound = _going(driven)
    assert ends["weak_motor"]["heading"][-1] > 0.02  # its left one is the weak one
    assert ends["dragging_brake"]["heading"][-1] > 0.02
    assert ends["low_battery"]["velocity.x"][-1] < sound["velocity.x"][-1] - 0.02
    assert abs(ends["low_battery"]["heading"][-1]) < 1e-3


def test_the_library_shows_what_a_chair_can_have(driven):
    powered = {e.name for e in library(chair=driven)}
    assert {"weak_motor", "low_battery", "dragging_brake"} <= powered
    assert not powered & {"torque_gain", "back_emf", "drive_lag"}
    plain = {e.name for e in library(chair=mjchair.load_spec("power"))}
    assert not plain & {"weak_motor", "low_battery", "dragging_brake"} and "torque_gain" in plain


def _rolled(model):
    data = mujoco.MjData(model)
    data.qvel[0] = 1.0
    for _ in range(100):
        mujoco.mj_step(model, data)
    return data.qvel[:6].copy()


def test_rolling_resistance_slows_by_its_coefficient():
    speeds = []
    for added in (0.0, 0.01):
        spec = mjchair.load_spec()
        find("rolling_resistance").apply(spec, {"coefficient": added})
        run = mjchair.simulate(spec, None, 2.0, initial={"speed": 1.5})
        speeds.append(run.channels["velocity.x"][-1])
    # rotating wheels add 2 % to the inertia of the chair
    assert (speeds[0] - speeds[1]) / 2.0 == pytest.approx(0.01 * 9.81, rel=0.05)


@pytest.mark.parametrize(
    ("form", "values"),
    [
        (rolling_resistance.ONE_SIDED, {"left": 0.02, "right": 0.0}),
        (bearing_friction.ONE_SIDED, {"left": 1.0, "right": 0.0}),
    ],
)
def test_a_drag_on_one_side_turns_the_chair_there_and_mirrored_to_the_other(form, values):
    """Of a soft tire or of what rubs on one wheel: half of what both do, and a turn to its side."""
    bare = mjchair.load_spec()
    mirrored = {"left": values["right"], "right": values["left"]}
    both = dict.fromkeys(values, max(values.values()))
    turns, losses = {}, {}
    for name, put in (("left", values), ("right", mirrored), ("both", both), ("none", None)):
        spec = bare.copy()
        if put is not None:
            form.apply(spec, put)
        run = mjchair.simulate(spec, duration=2.0, initial=mjchair.Initial(speed=1.5))
        turns[name] = float(np.asarray(run.channels["heading"])[-1])
        losses[name] = 1.5 - float(np.asarray(run.channels["velocity.x"])[-1])
    assert turns["left"] > 0.01
    assert turns["left"] == pytest.approx(-turns["right"], rel=1e-6)
    assert abs(turns["both"]) < 1e-3 * turns["left"]
    of_one, of_both = (losses[n] - losses["none"] for n in ("left", "both"))
    assert of_one == pytest.approx(0.5 * of_both, rel=0.05)


def _rear_axles(form, values):
    """Directions of the rear wheels' frames, (2, 4)."""
    spec = mjchair.load_spec()
    form.apply(spec, values)
    model = spec.compile()
    return np.array([model.body(wheel).quat for wheel in ("left_wheel", "right_wheel")])


@pytest.mark.parametrize(
    ("sides", "axle"), [((0.03, 0.03), (0.03, 0.0)), ((-0.02, 0.02), (0.0, 0.02))]
)
def test_the_toe_of_each_wheel_and_that_of_the_axle_are_one_effect(sides, axle):
    by_side = _rear_axles(toe.ONE_SIDED, dict(zip(("left", "right"), sides, strict=True)))
    by_axle = _rear_axles(toe.EFFECT, dict(zip(("symmetric", "asymmetric"), axle, strict=True)))
    np.testing.assert_allclose(by_side, by_axle, atol=1e-12)


def test_a_toe_of_one_wheel_brakes_with_its_square_and_turns_the_chair_to_its_side():
    """The chair goes aslant, so that each wheel slips by half of the toe."""
    runs = {}
    for size in (0.0, 0.02, 0.04):
        for side in ("left", "right"):
            spec = mjchair.load_spec()
            toe.ONE_SIDED.apply(spec, {"left": 0.0, "right": 0.0, side: size})
            runs[size, side] = mjchair.simulate(spec, duration=2.0, initial={"speed": 1.5})
    ends = {key: run["velocity.x"][-1] for key, run in runs.items()}
    small, large = (ends[0.0, "left"] - ends[size, "left"] for size in (0.02, 0.04))
    assert large == pytest.approx(4.0 * small, rel=0.1)
    left, right = (runs[0.04, side]["heading"][-1] for side in ("left", "right"))
    assert left > 0.005 and left == pytest.approx(-right, rel=1e-3)


def test_drag_is_the_same_in_plain_python_and_against_the_air():
    ends = {}
    for name, values in (("air_drag", {"drag_area": 1.0}), ("wind", {"x": 3.0, "y": 0.0})):
        spec = mjchair.load_spec()
        find(name).apply(spec, values)
        for compiled in (True, False):
            run = mjchair.simulate(spec, None, 0.1, initial={"speed": 2.0}, compiled=compiled)
            ends[name, compiled] = run.channels["velocity.x"][-1]
        assert ends[name, True] == pytest.approx(ends[name, False], abs=1e-12)
    assert ends["wind", True] > ends["air_drag", True]


def test_errors_name_the_value_and_the_rule():
    with pytest.raises(MjchairError, match="did you mean 'rolling_resistance'"):
        find("rolling_resistence")
    with pytest.raises(MjchairError, match="must be within"):
        find("toe").apply(mjchair.load_spec(), {"symmetric": 2.0})


def test_a_delayed_heading_is_in_the_model_itself():
    time = np.arange(0.0, 2.0, 0.01)
    swing = 5.0 * np.sin(2.0 * np.pi * time)
    inputs = mjchair.Inputs(time, {"left_wheel": -swing, "right_wheel": swing})
    seen = []
    for delay in (0.0, 0.04):
        spec = mjchair.load_spec()
        find("sensor_delay", "heading").apply(spec, {"delay": delay})
        model = mujoco.MjSpec.from_string(spec.to_xml())
        start = {"speed": 1.0, "heading": math.pi}  # where the angle wraps
        seen.append(mjchair.simulate(model, inputs, 2.0, initial=start, sample_rate=250.0))
    plain, late = (np.unwrap(run["heading"]) for run in seen)
    after = seen[0].time > 0.1
    expected = np.interp(seen[0].time - 0.04, seen[0].time, plain)
    assert np.abs(seen[1]["heading"]).max() <= math.pi
    off = np.abs(late - expected)[after].max()
    assert off < 0.1 * np.abs(plain - expected)[after].max()


def test_what_cannot_be_delayed_says_so():
    with pytest.raises(MjchairError, match="MuJoCo delays no sensor of a tire"):
        find("sensor_delay", "left_wheel_tire.Fx")


@pytest.mark.parametrize("speed", [2.0, 8.0])
def test_bearings_brake_a_wheel_in_the_air_as_they_say(speed):
    spec = mjchair.load_spec()
    spec.option.gravity = [0.0, 0.0, 0.0]
    drag = []
    for viscous in (0.0, 0.05):
        changed = spec.copy()
        find("bearing_friction").apply(changed, {"coulomb": 0.0, "viscous": viscous})
        model = changed.compile()
        data = mujoco.MjData(model)
        data.qpos[2] += 1.0
        dof = model.joint("left_wheel").dofadr[0]
        data.qvel[dof] = speed
        mujoco.mj_forward(model, data)
        drag.append(data.qfrc_passive[dof])
    assert drag[0] - drag[1] == pytest.approx(0.05 * speed, rel=1e-9)


def swivel_rate(spec, moment, side="left"):
    """Rate (rad/s) at which a lifted swivel of a chair turns that a moment (N m) has turned."""
    model = spec.compile()
    model.opt.gravity[:] = 0.0
    data = mujoco.MjData(model)
    data.qpos[2] += 1.0
    swivel = model.joint(f"{side}_caster_swivel").dofadr[0]
    with mjchair.installed():
        for _ in range(200):
            data.qfrc_applied[swivel] = moment
            mujoco.mj_step(model, data)
    return data.qvel[swivel]


@pytest.mark.parametrize(("moment", "slope"), [(0.2, 2.0), (0.8, 8.0), (0.8, 1.8), (3.0, 60.0)])
def test_a_caster_creeps_in_proportion_below_its_friction_and_slides_above_it(moment, slope):
    spec = mjchair.load_spec()
    find("caster_friction").apply(spec, {"moment": moment, "slope": slope})
    for share in (0.5, 0.9):
        assert swivel_rate(spec, share * moment) == pytest.approx(share * moment / slope, rel=0.01)
    assert swivel_rate(spec, 1.2 * moment) > 10.0 * moment / slope


@pytest.mark.parametrize(
    ("effect", "values", "std", "said"),
    [
        (
            "floor_slope",
            {"x": 0.00523, "y": -0.0021},
            {"x": 8e-5, "y": 3e-4},
            "the floor rises by 0.5230 ± 0.0080 % towards heading 0 "
            "and 0.210 ± 0.030 % towards heading 270 deg",
        ),
        (
            "floor_slope",
            {"x": -0.01, "y": 0.0},
            {},
            "the floor rises by 1 % towards heading 180 deg",
        ),
        ("mass_offset", {"x": -0.04, "y": 0.0}, {"x": 0.005}, "40.0 ± 5.0 mm behind"),
        (
            "wind",
            {"x": 0.0, "y": 3.0, "drag_area": 0.6},
            {"y": 0.4, "drag_area": 0.1},
            "it blows with 3.00 ± 0.40 m/s towards heading 90 deg, "
            "on a drag area of 0.60 ± 0.10 m^2",
        ),
    ],
)
def test_a_size_along_two_axes_says_which_way(effect, values, std, said):
    assert find(effect).remark(values, std) == said


@pytest.mark.parametrize(("side", "free"), [("left", "right"), ("right", "left")])
def test_one_caster_holds_and_the_other_turns(side, free):
    spec = mjchair.load_spec()
    values = {"left": 0.0, "right": 0.0, "slope": 5.0, side: 0.5}
    caster_friction.ONE_SIDED.apply(spec, values)
    assert swivel_rate(spec, 0.25, side) == pytest.approx(0.05, rel=0.01)
    assert swivel_rate(spec, 0.25, free) > 1.0
    said = caster_friction.ONE_SIDED.remark(values, {side: 0.03})
    assert said == f"{side} +0.50 ± 0.03 N m, the {side} caster by itself"


def test_frictions_of_one_caster_add_up_and_a_little_changes_little():
    spec, effect = mjchair.load_spec(), find("caster_friction")
    effect.apply(spec, {"moment": 0.3, "slope": 3.0})
    effect.apply(spec, {"moment": 0.5, "slope": 2.0})
    slope = (0.3 * 3.0 + 0.5 * 2.0) / 0.8
    assert swivel_rate(spec, 0.4) == pytest.approx(0.4 / slope, rel=0.01)
    assert swivel_rate(spec, 0.9) > 1.0
    held = swivel_rate(spec, 0.4)
    effect.apply(spec, {"moment": 1e-6, "slope": 60.0})
    assert swivel_rate(spec, 0.4) == pytest.approx(held, rel=1e-3)


def spinning_moment(moment, rate, yaw_rate):
    """Moment (N m) of a rear tire of a chair that turns on the spot, against its turn."""
    spec = mjchair.load_spec()
    find("turning_scrub").apply(spec, {"moment": moment, "rate": rate})
    model = spec.compile()
    with mjchair.installed():
        data = start(model, Initial(yaw_rate=yaw_rate))
        mujoco.mj_step(model, data)
    return -data.sensor("left_wheel_tire").data[3]


@pytest.mark.parametrize(("rate", "yaw_rate"), [(0.3, 0.1), (0.3, -0.3), (0.05, 0.05), (0.02, 2.0)])
def test_tires_resist_a_slow_turn_in_proportion_and_a_fast_one_in_full(rate, yaw_rate):
    of_both = 4.0
    more = spinning_moment(of_both, rate, yaw_rate) - spinning_moment(0.0, rate, yaw_rate)
    assert more == pytest.approx(0.5 * of_both * np.tanh(yaw_rate / rate), rel=1e-4)


def test_a_light_wind_is_told_from_still_air_and_what_goes_with_it():
    """Beside a faster chair the force of a light wind is linear in it, of either sign."""
    seed = find("wind").seeds[-1]
    speed = np.linspace(1.0, 2.0, 20)

    def force(x, y, drag_area):
        along = speed - x
        return -drag_area * np.hypot(along, y) * along

    parts = np.array([force(**{**p, "y": 0.0}) for p in seed.points])
    for truth in (-0.2, 0.15):
        coefficients = np.linalg.lstsq(parts[:2].T, force(truth, 0.0, 0.9), rcond=None)[0]
        values = seed.combine(np.r_[coefficients, 0.0])
        assert values["x"] == pytest.approx(truth, rel=0.35)  # where a fit begins
        assert values["drag_area"] == pytest.approx(0.9, rel=0.1)


def test_of_two_torque_gains_the_difference_is_said():
    """Beside a mass that is only roughly known, runs tell the difference better than the sides."""
    said = find("torque_gain").remark
    both = said({"left": 0.171, "right": 0.007}, {"left": 0.044, "right": 0.038})
    assert both == "left +17.1 ± 4.4 %, right +0.7 ± 3.8 %, left less right +16.4 %"
    assert said({"left": 0.163, "right": 0.0}, {"left": 0.004}) == "left +16.3 ± 0.4 %"


@pytest.mark.parametrize(
    ("channel", "most"),
    [("left_wheel_speed", 2.0), ("imu_gyro.z", 0.4), ("velocity.x", 1.0), ("heading", math.pi)],
)
def test_a_bias_is_no_larger_than_a_sensor_may_have(channel, most):
    """Two wheels 10 rad/s off explained a chair that slowed down too soon."""
    (bias,) = find("sensor_bias", channel).parameters
    assert (bias.low, bias.high) == pytest.approx((-most, most))


def test_wheels_lean_outwards_no_further_than_a_bent_axle():
    """A sprint whose torque was estimated from its own motion had camber of -17 degrees."""
    spec, camber = mjchair.load_spec(), find("camber")
    assert camber.on(spec).parameter("angle").low == pytest.approx(-0.05, abs=1e-9)
    camber.apply(spec, {"angle": 0.2})
    assert camber.on(spec).parameter("angle").low == pytest.approx(-0.25, abs=1e-9)


PLACE = block.ROLLING_RESISTANCE


def test_rolling_resistance_takes_away_what_the_tires_have_and_no_more():
    """A report said -0.0108 where the rear tires have 0.010, and the corrected chair had 0."""
    spec = mjchair.load_spec()
    has = {w: parts.tire_geom(spec, w).userdata[PLACE] for w in parts.REAR}
    of_all, of_one = (e.on(spec) for e in MECHANICAL if e.name == "rolling_resistance")
    low = of_all.parameter("coefficient").low
    assert low == -min(*has.values(), parts.tire_geom(spec, parts.CASTERS[0]).userdata[PLACE])
    assert of_one.parameter("left").low == -has[parts.REAR[0]]
    of_all.apply(spec, {"coefficient": low})
    left = [parts.tire_geom(spec, w).userdata[PLACE] for w in (*parts.REAR, *parts.CASTERS)]
    assert min(left) == 0.0
    assert sum(left) == pytest.approx(2.0 * (0.015 - 0.010))


def test_an_effect_of_no_sensor_has_no_channel():
    """`mjchair hide caster_friction:slope=0.01` hid the usual size."""
    with pytest.raises(MjchairError, match="its numbers are moment, slope"):
        find("caster_friction", "slope=0.01")
