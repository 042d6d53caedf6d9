"""The paper's equations, each once, and its misprints with what is wrong in them."""

import csv
from math import atan, cos, pi, sin, tan
from pathlib import Path

import numpy as np
import pytest

from mjchair.tire import Pac89, Tire, paper

DATA = Path(__file__).parent / "data" / "tire"
TABLE_1 = [1.3, -53.31, 1190, 588.6, 2.5315, 0, -0.5178, 1]


def test_every_equation_is_a_function_that_says_its_number():
    assert list(paper.EQUATIONS) == list(range(1, 23))
    for number, function in paper.EQUATIONS.items():
        assert f"({number})" in function.__doc__


def test_1_a_positive_angle_gives_a_negative_force():
    assert paper.linear_force(0.1, 3000.0) == pytest.approx(-300.0)
    assert paper.linear_force(0.1, -3000.0) > 0.0  # the text's negative stiffness: wrong way


def test_2_is_1_with_a_stiffness_of_the_load():
    assert paper.quadratic_force(0.1, 200.0, 14.0, 0.007) == paper.linear_force(0.1, 2520.0)
    law = Tire("t", "quadratic", {"a": 14.0, "b": 0.007, "friction": 3.0})
    assert law.forces(200.0, 0.0, 0.1).Fy == pytest.approx(-252.0)


def test_1_and_2_are_the_laws_of_the_tire_up_to_friction():
    law = Tire("t", "linear", {"cornering_stiffness": 3000.0, "friction": 0.8})
    assert law.forces(300.0, 0.0, 0.05).Fy == pytest.approx(paper.linear_force(0.05, 3000.0))
    assert law.forces(300.0, 0.0, 0.3).Fy == pytest.approx(-240.0)


def test_3_a_wheel_ahead_of_a_turning_body_travels_to_the_side():
    assert paper.course_angle(2.0, 0.0, 0.5, 0.4, 0.0) == pytest.approx(atan(0.1))
    assert paper.course_angle(2.0, 0.0, 0.5, 0.0, 0.3) == 0.0  # beside it: slower, not aside
    assert paper.course_angle(2.0, 0.3, 0.5, 0.4, 0.3) == pytest.approx(atan(0.5 / 1.85))


def test_4_the_wheel_that_points_where_it_travels_has_no_slip():
    course = paper.course_angle(2.0, 0.1, 0.4, 0.4, 0.2)
    assert paper.slip_angle(2.0, 0.1, 0.4, 0.4, 0.2, course) == 0.0
    assert paper.slip_angle(2.0, 0.1, 0.4, 0.4, 0.2, 0.0) == course


def test_5_has_its_slope_and_its_peak():
    b, c, d, e = 0.2, 1.3, 900.0, -0.5
    assert paper.EQUATIONS[5](1e-6, b, c, d, e) / 1e-6 == pytest.approx(b * c * d)
    x = np.linspace(0.0, 200.0, 200001)
    y = [paper.EQUATIONS[5](value, b, c, d, e) for value in x[::100]]
    assert max(y) == pytest.approx(d, rel=1e-6)


def test_6_and_7_shift_the_curve_to_8():
    shifted = paper.lateral_force(4.0, 0.2, 1.3, 900.0, -0.5, 1.0, 30.0)
    assert shifted == paper.EQUATIONS[5](5.0, 0.2, 1.3, 900.0, -0.5) + 30.0
    assert paper.shifted_input(4.0, 1.0) == 5.0
    assert paper.shifted_output(7.0, 30.0) == 37.0


def test_8_as_printed_is_5_in_other_words():
    b, c, d, e, sh, sv = 0.2, 1.3, 900.0, -0.5, 0.7, 12.0
    for alpha in (-12.0, -1.0, 0.0, 3.0, 15.0):
        x = alpha + sh
        printed = d * sin(c * atan(b * (1 - e) * x + e * atan(b * x))) + sv
        assert paper.lateral_force(alpha, b, c, d, e, sh, sv) == pytest.approx(printed, abs=1e-9)


def coefficients(load):
    """B, C, D, E at a load (kN) of Table 1, from (9)-(13)."""
    c = paper.EQUATIONS[9](TABLE_1[0])
    d = paper.EQUATIONS[10](paper.EQUATIONS[11](TABLE_1[1], TABLE_1[2], load), load)
    e = paper.EQUATIONS[12](TABLE_1[6], TABLE_1[7], load)
    bcd = paper.EQUATIONS[13](TABLE_1[3], TABLE_1[4], TABLE_1[5], load, 0.0)
    return bcd / (c * d), c, d, e


def test_9_to_13_give_table_1_its_published_forces():
    b, c, d, e = coefficients(2.0)
    forces = [paper.lateral_force(alpha, b, c, d, e, 0.0, 0.0) for alpha in (2, 5, 10, 15)]
    assert np.allclose(forces, [1044.17, 1864.97, 2152.48, 2161.87], atol=0.005)


def test_11_read_in_newtons_gives_no_tire():
    load = 500.0
    d = paper.EQUATIONS[10](paper.EQUATIONS[11](TABLE_1[1], TABLE_1[2], load), load)
    assert d == pytest.approx(-12.7e6, rel=0.01)


@pytest.mark.parametrize(
    ("file", "a", "unit"),
    [
        ("pac89_table1_lateral.csv", TABLE_1, "kN"),
        (
            "pac89_wheelchair_c148_lateral.csv",
            [1.48, 5.238e-5, 0.20657, 8.8589, 355, 0, -1.67e-5, -0.0165],
            "N",
        ),
    ],
)
def test_9_to_15_agree_with_an_independent_code(file, a, unit):
    tire = Pac89(a=a, load_unit=unit, nominal_load=210.0)
    with (DATA / file).open() as stream:
        rows = list(csv.DictReader(stream))
    fz, alpha, gamma, fy = (
        np.array([float(row[key]) for row in rows])
        for key in ("fz_n", "alpha_deg", "gamma_deg", "fy_n")
    )
    ours = tire.forces(fz, 0.0, np.radians(alpha), np.radians(gamma)).Fy
    assert np.max(np.abs(ours + fy)) < 1e-8


def test_13_needs_the_size_of_camber():
    lean = paper.EQUATIONS[13](588.6, 2.5315, 0.02, 2.0, 4.0)
    other = paper.EQUATIONS[13](588.6, 2.5315, 0.02, 2.0, -4.0)
    assert lean == other  # a symmetric tire
    printed = [588.6 * sin(2 * atan(2.0 / 2.5315)) * (1 - 0.02 * g) for g in (4.0, -4.0)]
    assert printed[0] != pytest.approx(printed[1])  # without bars it is not
    assert printed[0] == pytest.approx(lean)


def test_14_and_15_shift_with_camber_and_load():
    assert paper.EQUATIONS[14](0.1, 0.2, 0.3, 2.0, 4.0) == pytest.approx(0.4 + 0.4 + 0.3)
    assert paper.EQUATIONS[15](10.0, 5.0, 3.0, 2.0, 4.0) == pytest.approx(80.0 + 10.0 + 3.0)


def test_16_and_17_recover_the_curve_they_were_measured_on():
    b, c, d, e = 0.2, 1.5, 900.0, -0.8
    x = np.linspace(0.0, 60.0, 600001)
    y = d * np.sin(c * np.arctan(b * x - e * (b * x - np.arctan(b * x))))
    asymptote = d * sin(c * pi / 2)
    found_c = paper.shape_from_curve(asymptote, d)
    assert found_c == pytest.approx(c)
    found_e = paper.curvature_from_curve(b, found_c, x[np.argmax(y)])
    assert found_e == pytest.approx(e, abs=1e-3)
    assert b * x[np.argmax(y)] * (1 - e) + e * atan(b * x[np.argmax(y)]) == pytest.approx(
        tan(pi / (2 * c)), abs=1e-3
    )


def test_18_tells_forward_from_backward():
    assert paper.steering_angle(1.0, 1.0, 2.0, 2.0) == pytest.approx(pi / 4)
    assert paper.steering_angle(2.0, 2.0, 1.0, 1.0) == pytest.approx(-3 * pi / 4)
    assert atan((1.0 - 2.0) / (1.0 - 2.0)) == pytest.approx(pi / 4)  # as printed: the same


@pytest.mark.parametrize(("along", "across"), [(19, 20), (21, 22)])
def test_19_to_22_are_a_rotation_and_as_printed_are_not(along, across):
    vx, vy, d = 1.2, -0.7, 0.6
    x1, y1 = paper.EQUATIONS[along](vx, vy, d), paper.EQUATIONS[across](vx, vy, d)
    assert x1**2 + y1**2 == pytest.approx(vx**2 + vy**2)
    assert complex(x1, y1) == pytest.approx(complex(vx, vy) * complex(cos(d), -sin(d)))
    printed = {
        19: (vx * cos(d) + vy * sin(d), vy * cos(d) + vx * sin(d)),
        21: (vx * cos(d) - vy * sin(d), vy * cos(d) - vx * sin(d)),
    }[along]
    assert printed[0] ** 2 + printed[1] ** 2 != pytest.approx(vx**2 + vy**2)
