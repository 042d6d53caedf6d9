"""The virtual rig: its forces against the formula, its cells, its faults."""

from pathlib import Path

import numpy as np
import pytest

from mjchair.errors import MjchairError, MjchairNote
from mjchair.simulation import rig
from mjchair.simulation.rig import Faults, Point, measure, sweep
from mjchair.tire import read

TIRES = Path(__file__).parents[1] / "models" / "tires"


def tire(name="wheelchair_a0_148", **changes):
    return read(TIRES / f"{name}.toml").with_(**changes)


@pytest.fixture(scope="module")
def paper():
    return measure(tire(), sweep())


def test_the_papers_sweep_is_its_angles_loads_and_speeds():
    points = sweep()
    assert len(points) == 24
    assert {p.angle for p in points} == {0.0, 5.0, 10.0, 15.0}
    assert {p.load for p in points} == {30.0, 110.0, 210.0}
    assert {p.speed for p in points} == {0.002, 0.004}


def test_steady_forces_are_the_formulas(paper):
    peak = max(abs(run.force[1]) for run in paper)
    for run in paper:
        assert abs(run.force[1] - run.formula[1]) < 1e-3 * peak
        assert abs(run.force[0] - run.formula[0]) < 1e-3 * peak
    # and of the formula at the slip that was set, but for the slip of free rolling
    last = paper[11]
    direct = tire().forces(210.0, 0.0, np.radians(15.0)).Fy
    assert last.force[1] == pytest.approx(direct, rel=2e-3)


def test_the_slip_is_the_one_that_was_set(paper):
    for run in paper:
        assert run.slip[1] == pytest.approx(np.tan(np.radians(run.point.angle)), abs=1e-4)


def test_the_lateral_force_is_the_mean_of_the_lateral_cells(paper):
    run = paper[7]  # 15 deg, 110 N
    yaw = -np.radians(15.0)
    lateral = 0.5 * (run.reading[0] + run.reading[1])
    back = run.force[0] * np.sin(yaw) + run.force[1] * np.cos(yaw)
    assert lateral == pytest.approx(back)
    assert run.reading == pytest.approx(run.cells[-20:].mean(axis=0))


def test_the_trace_builds_up_over_the_relaxation_length(paper):
    run = paper[5]  # 5 deg, 110 N, 2 mm/s: 1 - exp(-1) after 40 mm, short of it beyond the slope
    lateral = 0.5 * (run.cells[:, 0] + run.cells[:, 1])
    after = float(np.interp(0.04 / 0.002, run.time, lateral / lateral[-1]))
    assert 0.63 < after < 0.9
    assert abs(lateral[0]) < 0.1 * abs(lateral[-1])


def test_speed_changes_no_steady_force(paper):
    for slow, fast in zip(paper[:12], paper[12:], strict=True):
        assert fast.force[1] == pytest.approx(slow.force[1], abs=0.02)


def test_the_pneumatic_trail_turns_the_wheel():
    run = measure(tire("wheelchair"), [Point(2.0, 200.0, 0.01)])[0]
    formula = tire("wheelchair").forces(200.0, run.slip[0], np.arctan(run.slip[1]))
    assert run.moment == pytest.approx(float(formula.Mz), rel=0.02)


def test_driven_and_braked_wheels_follow_the_curve_along():
    default = tire("wheelchair")
    points = [Point(angle, 200.0, 0.1, kappa=k) for k in (-0.2, 0.05) for angle in (0.0, 5.0)]
    for run in measure(default, points):
        assert run.slip[0] == pytest.approx(run.point.kappa, abs=2e-3)
        formula = default.forces(200.0, run.slip[0], np.arctan(run.slip[1]))
        assert run.force[0] == pytest.approx(float(formula.Fx), abs=0.3)
        assert run.force[1] == pytest.approx(float(formula.Fy), abs=0.3)


def test_camber_and_load_are_those_that_were_set():
    run = measure(tire("wheelchair"), [Point(0.0, 150.0, 0.01, camber=4.0)])[0]
    expected = tire("wheelchair").forces(150.0, 0.0, 0.0, np.radians(4.0)).Fy
    assert run.force[1] == pytest.approx(float(expected), rel=2e-3)
    assert expected < 0.0


def test_faults_are_seen_in_the_table_and_not_in_the_point():
    point = [Point(0.0, 110.0, 0.02)]
    plain = measure(tire(), point)[0].force[1]
    toe = measure(tire(), point, Faults(toe=1.0))[0]
    assert toe.point == point[0]
    assert toe.force[1] < plain - 3.0
    offset = measure(tire(), point, Faults(offset=(2.0, 2.0, 0.0)))[0]
    assert offset.force[1] == pytest.approx(plain + 2.0)


def test_noise_is_of_its_size_and_seed():
    clean = measure(tire(), sweep(speeds=(0.02,)))
    one, same, other = (rig._with_noise(clean, Faults(noise=0.02, seed=seed)) for seed in (1, 1, 2))
    assert one[5].force == same[5].force
    assert one[5].force != other[5].force
    errors = [a.reading[2] - b.reading[2] for a, b in zip(one, clean, strict=True)]
    peak = max(abs(run.force[1]) for run in clean)
    assert 0.5 < np.std(errors) / (0.02 * peak) < 1.6


def test_turning_the_wheel_round_turns_its_conicity():
    plain = tire()
    cone = rig.replace(plain, coefficients={**plain.coefficients, "a12": 0.03, "a9": 0.001})
    kept, turned = (
        measure(cone, [Point(0.0, 110.0, 0.02, turned=side)])[0].force[1] for side in (False, True)
    )
    assert kept + turned == pytest.approx(2.0 * -0.001 * 110.0 * 5.27, rel=0.1)  # ply steer
    assert turned - kept == pytest.approx(2.0 * 0.03 * 110.0, rel=1e-2)


@pytest.mark.parametrize(
    ("numbers", "message"),
    [
        ({"angle": 80.0}, "slip angle is 80 deg"),
        ({"load": 0.0}, "load is 0 N"),
        ({"speed": 0.0}, "speed is 0 m/s"),
        ({"kappa": -2.0}, "kappa is -2"),
        ({"camber": 60.0}, "camber is 60 deg"),
    ],
)
def test_points_out_of_range_are_refused(numbers, message):
    with pytest.raises(MjchairError, match=message):
        Point(**({"angle": 0.0, "load": 100.0, "speed": 0.002} | numbers))


def test_an_empty_sweep_and_a_standing_table_are_refused():
    with pytest.raises(MjchairError, match="no points"):
        measure(tire(), [])
    with pytest.raises(MjchairError, match="travel"):
        measure(tire(), sweep(), travel=0.0)


@pytest.mark.parametrize(
    ("load", "largest", "message"),
    [
        (5000.0, 0.0, "load 5000 N is 24 times the nominal load of wheelchair_a0_148, 210 N"),
        (1000.0, 0.0, None),
        (9500.0, 9000.0, "load 9500 N is beyond FZMAX of book, 9000 N"),
        (8500.0, 9000.0, None),
    ],
)
def test_a_load_far_beyond_the_tires_is_noted(load, largest, message, recwarn):
    from test_mf61 import book

    from mjchair.tire import Tire

    numbers = book(FZMAX=largest)
    measured = Tire("book", "mf61", numbers, nominal_load=1000.0) if largest else tire()
    rig._note_load(measured, load)
    said = [str(w.message) for w in recwarn.list if w.category is MjchairNote]
    assert len(said) == (message is not None)
    assert message is None or message in said[0]


def test_a_car_tire_of_a_tir_file_runs_on_the_rig(tmp_path):
    """Beyond the paper's loads cells and guide grow with the load."""
    from test_mf61 import book

    from mjchair.tire import Tire, write

    numbers = book(LATERAL_STIFFNESS=1e5, LONGITUDINAL_STIFFNESS=3e5)
    car = Tire("car", "mf61", numbers, relaxation_x=0.0, relaxation_y=0.0, nominal_load=4000.0)
    write(car, tmp_path / "car.tir")
    runs = measure(read(tmp_path / "car.tir"), [Point(a, 4000.0, 0.05) for a in (2.0, 8.0)])
    for run in runs:
        assert abs(run.force[1] - run.formula[1]) < 1e-3 * 4000.0
    assert runs[1].force[1] < -3000.0
