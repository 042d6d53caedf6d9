"""A chair starts at rest on its wheels or not at all, and a run in which it falls says so."""

import math

import mujoco
import numpy as np
import pytest

import mjchair
from mjchair.cli import main
from mjchair.errors import MjchairError, MjchairNote
from mjchair.simulation.initial import Initial, start
from mjchair.simulation.settling import NotStandingError
from mjchair.simulation.standing import UNLOADED, Fall, first_fall

# Where the shipped chair stands on its rear wheels' contacts: its centre of mass is 0.120 m before
# the axle and 0.648 m above the floor (models/manual/README.md), so it tips at atan(0.120 / 0.648).
TIP_ANGLE = math.atan2(0.120, 0.648)


def build(grade, scene="ramp", anti_tippers=True, **options):
    spec = mjchair.load_spec(scene=scene, grade=grade, **options)
    for geom in list(spec.geoms):
        if not anti_tippers and "anti_tip" in geom.name:
            spec.delete(geom)
    return spec.compile()


def lean(model, data):
    """Between the chair's z and the floor's normal, deg."""
    mujoco.mj_kinematics(model, data)
    normal = data.geom_xmat[model.geom("floor").id].reshape(3, 3)[:, 2]
    up = data.xmat[model.body("chair").id].reshape(3, 3)[:, 2]
    return math.degrees(math.acos(min(up @ normal, 1.0)))


@pytest.mark.parametrize("short_of", [1.0, 0.1])
def test_a_chair_stands_to_a_tenth_of_a_degree_from_its_tip_angle(short_of):
    grade = math.tan(TIP_ANGLE - math.radians(short_of))
    model = build(grade, anti_tippers=False)
    with mjchair.installed():
        data = start(model, Initial(), brakes=True)
        assert lean(model, data) < 0.5
        mujoco.mj_step(model, data, nstep=1000)
    assert lean(model, data) < 0.5, "it stands at t = 0, and must stand two seconds later"


def test_beyond_its_tip_angle_it_is_refused_in_one_line():
    model = build(math.tan(TIP_ANGLE + math.radians(0.15)), anti_tippers=False)
    with mjchair.installed(), pytest.raises(NotStandingError, match="tips over") as refused:
        start(model, Initial(), brakes=True)
    assert "\n" not in str(refused.value)
    assert "10.6 deg (18.8 %)" in str(refused.value), "the slope"
    assert "up to 10.4 deg" in str(refused.value)


def test_with_anti_tippers_it_leans_on_them():
    model = build(0.2)
    with mjchair.installed():
        data = start(model, Initial(), brakes=True)
    assert 3.0 < lean(model, data) < 7.0, "rollers 25 mm above the floor, 0.3 m behind the axle"
    assert np.abs(data.qvel).max() == 0.0


@pytest.mark.parametrize("grade", [0.2, 0.268])
def test_where_it_leans_with_its_brakes_locked_it_does_with_its_wheels_held(grade):
    model, at_rest = build(grade), []
    for brakes in (True, False):
        with mjchair.installed():
            at_rest.append(start(model, Initial(), brakes))
        model.eq_active0[:] = 0
    locked, held = (lean(model, data) for data in at_rest)
    assert held == pytest.approx(locked, abs=0.01)


@pytest.mark.parametrize("brakes", [True, False])
def test_a_run_that_starts_on_the_anti_tippers_says_so(brakes):
    spec = mjchair.load_spec(scene="ramp", grade=0.268)
    said = "leaning on left_anti_tip and right_anti_tip; left_caster and right_caster carry 0 N"
    with pytest.warns(MjchairNote, match=said):
        mjchair.simulate(spec, None, 0.05, brakes=brakes)
    with pytest.warns(MjchairNote, match=said):
        mjchair.Simulator(spec, brakes=brakes)


def test_a_run_that_starts_on_its_wheels_says_nothing_of_it(recwarn):
    mjchair.simulate(mjchair.load_spec(scene="ramp", grade=0.1), None, 0.05, brakes=True)
    assert not recwarn.list


@pytest.mark.parametrize("tilt", ["floor", "gravity"])
def test_a_chair_too_steep_to_stand_across_is_refused(tilt):
    model = build(0.5, "cross_slope", tilt=tilt)
    with mjchair.installed(), pytest.raises(NotStandingError, match=r"26.6 deg \(50 %\)"):
        start(model, Initial(), brakes=True)


def test_a_chair_that_slides_is_refused_as_sliding():
    model = build(0.3, tire="wheelchair", tilt="floor")
    for geom in ("left_wheel_tire", "right_wheel_tire"):
        model.geom(geom).user[10] = 0.3  # friction factor
    with mjchair.installed(), pytest.raises(NotStandingError, match="slides"):
        start(model, Initial(), brakes=True)


def test_held_wheels_do_not_creep_while_it_settles():
    model = build(0.08)
    with mjchair.installed():
        data = start(model, Initial())
    assert abs(data.joint("left_wheel").qpos[0]) < 1e-9, "rad"


def test_a_treadmill_waits_for_the_chair():
    model = build(None, "flat")
    model.geom_surfacevel[model.geom("floor").id] = (-1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    with mjchair.installed():
        data = start(model, Initial())
    assert np.abs(data.qpos[:2]).max() < 1e-3, "m"


def test_a_run_in_which_the_chair_tips_says_so(tmp_path):
    spec = mjchair.load_spec()
    for geom in list(spec.geoms):
        if "anti_tip" in geom.name:
            spec.delete(geom)
    torque = mjchair.constant({"left_wheel": 60.0, "right_wheel": 60.0}, 0.8)
    run = mjchair.simulate(spec, torque, 2.5, sample_rate=100.0)
    assert run.status is mjchair.Status.TIPPED
    assert run.time[-1] == pytest.approx(2.5), "the run is whole"
    assert 0.0 < run.stopped_at < 2.5 and "deg" in run.reason
    run.save(tmp_path / "run.npz")
    assert mjchair.load_recording(tmp_path / "run.npz").status is mjchair.Status.TIPPED


def test_a_kerb_is_no_fall():
    run = mjchair.simulate(
        mjchair.load_spec(scene="kerb"),
        {"left_wheel": 12.0, "right_wheel": 9.0},
        0.8,
        initial={"speed": 1.2},
    )
    loads = np.array([run[f"{wheel}_tire.Fz"] for wheel in run.wheels])
    assert (loads == 0.0).all(axis=0).any(), "no hop: the test sees nothing"
    assert run.status is mjchair.Status.COMPLETED


TIME = np.arange(0.0, 2.0, 0.01)
WHEELS = ("left_wheel", "right_wheel", "left_caster", "right_caster")


SIX = (*WHEELS, "left_rear_caster", "right_rear_caster")


def loads(*empty, since=0.5, until=2.0, wheels=WHEELS):
    given = {wheel: np.full(TIME.size, 250.0) for wheel in wheels}
    for wheel in empty:
        given[wheel][(since <= TIME) & (until > TIME)] = 0.0
    return given


@pytest.mark.parametrize(
    ("empty", "kind"),
    [
        (("left_wheel", "right_wheel"), Fall.TIPPED),
        (("left_wheel", "left_caster"), Fall.TIPPED),
        (("left_caster", "right_caster"), None),
        (("left_wheel", "right_caster"), None),
        (WHEELS, Fall.OFF_GROUND),
    ],
)
def test_which_wheels_may_be_in_the_air(empty, kind):
    level = np.zeros(TIME.size)
    fallen = first_fall(TIME, level, loads(*empty), 1000.0)
    assert (fallen and fallen.kind) is kind
    if fallen:
        assert fallen.time == pytest.approx(0.5)
    short = first_fall(TIME, level, loads(*empty, until=0.5 + 0.9 * UNLOADED), 1000.0)
    assert short is None
    long = first_fall(TIME, level, loads(*empty, until=0.5 + 1.5 * UNLOADED), 1000.0)
    assert (long and long.kind) is (kind if kind is Fall.OFF_GROUND else None), "it came back"


@pytest.mark.parametrize(
    ("empty", "kind"),
    [
        (("left_wheel", "right_wheel"), None),
        (("left_rear_caster", "right_rear_caster"), None),
        (("left_wheel", "right_wheel", "left_rear_caster", "right_rear_caster"), Fall.TIPPED),
        (("left_wheel", "left_caster"), None),
        (("left_wheel", "left_caster", "left_rear_caster"), Fall.TIPPED),
        (SIX, Fall.OFF_GROUND),
    ],
)
def test_which_of_six_wheels_may_be_in_the_air(empty, kind):
    fallen = first_fall(TIME, np.zeros(TIME.size), loads(*empty, wheels=SIX), 1000.0)
    assert (fallen and fallen.kind) is kind


def test_a_chair_that_lies_has_tipped_whatever_its_wheels_bear():
    leans = np.where(TIME < 1.0, 0.0, math.radians(70.0))
    fallen = first_fall(TIME, leans, loads(), 1000.0)
    assert fallen.kind is Fall.TIPPED and fallen.time == pytest.approx(1.0)


def test_a_grade_in_percent_without_its_sign_is_refused():
    with pytest.raises(MjchairError, match=r"grade is 8 \(800 %.*8 % is 0.08"):
        mjchair.load_spec(scene="ramp", grade=8.0)


def test_a_chair_on_springs_starts_moving_down_a_slope():
    """Its held casters swing faster than the time step resolves; it stands all the same."""
    heavy = {"occupant_mass": 100.0}
    model = mjchair.load_spec("power_mid", "ramp", grade=-0.17, parameters=heavy).compile()
    with mjchair.installed():
        data = start(model, Initial(speed=1.0))
    assert lean(model, data) < 6.0  # deg, 17 % slope and springs


def test_the_command_line_refuses_a_fall_before_the_start(tmp_path, capsys):
    given = ["--scene", "cross_slope", "--grade", "0.5", "--brakes", "--duration", "0.1"]
    assert main(["simulate", *given, "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err.strip().splitlines()
    assert len(said) == 1 and "slides with its brakes locked" in said[0]
    assert not (tmp_path / "out").exists()


def test_a_sweep_says_which_chairs_fell():
    from mjchair.sweep.chunk import run_chunk
    from mjchair.sweep.study import Study

    study = Study(
        {"scene": ["cross_slope"], "grade": [0.05, 0.6]}, duration=0.2
    )  # fmt: skip
    rows = run_chunk(study, study.cases())
    assert [row["status"] for row in rows] == ["completed", "not standing at the start"]
