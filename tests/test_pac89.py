"""The 1989 formula against forces that an independent code computed (tests/data/tire)."""

from pathlib import Path

import numpy as np
import pytest

from mjchair.model.spec import read_tire
from mjchair.tire import Pac89

DATA = Path(__file__).parent / "data" / "tire"


@pytest.mark.parametrize(
    ("table", "tire"),
    [
        ("pac89_table1_lateral.csv", "genta_table1"),
        ("pac89_wheelchair_c148_lateral.csv", "wheelchair_a0_148"),
    ],
)
def test_lateral_force_is_the_reference(table, tire):
    rows = np.genfromtxt(DATA / table, delimiter=",", names=True)
    found = read_tire(tire).forces(
        rows["fz_n"], 0.0, np.radians(rows["alpha_deg"]), np.radians(rows["gamma_deg"])
    )
    assert rows.size > 50
    # the reference is positive for a positive angle, ISO-W is not; Table 1 goes up to 4.7 kN and
    # its digits end at 1e-8 N
    np.testing.assert_allclose(-found.Fy, rows["fy_n"], rtol=0, atol=1e-8)


def test_the_papers_figures_at_2_kn():
    """2, 5, 10, 15 deg on the car tire of Table 1; its list read in newtons is refused."""
    tire = read_tire("genta_table1")
    found = -tire.forces(2000.0, 0.0, np.radians([2, 5, 10, 15])).Fy
    np.testing.assert_allclose(found, [1044.17, 1864.97, 2152.48, 2161.87], atol=0.005)
    with pytest.raises(ValueError, match="peak friction"):
        type(tire)(
            "in newtons", "pac89", {**tire.coefficients, "load_unit": 1.0}, nominal_load=500.0
        )


def test_the_measured_set_at_210_n():
    """Both readings of a0; the expected digits are cut after the first, not rounded."""
    a148 = -read_tire("wheelchair_a0_148").forces(210.0, 0.0, np.radians([5, 10, 15])).Fy
    a048 = -read_tire("wheelchair_a0_048").forces(210.0, 0.0, np.radians([5, 10, 15])).Fy
    np.testing.assert_allclose(a148, [31.9, 43.6, 45.7], atol=0.1)
    np.testing.assert_allclose(a048, [22.3, 26.6, 28.2], atol=0.1)


LOAD, CAMBER = 0.4, 2.0  # kN, deg
A = [1.3, -20.0, 1000.0, 900.0, 2.5, 0.01, -0.5, 0.8, 0.05, 0.1, 0.2, 3.0, 5.0, 2.0]
B = [1.65, -20.0, 1100.0, 2.0, 200.0, 0.05, -0.01, 0.05, 0.2, 0.3, 0.5]
C = [
    2.4,
    -1.0,
    -2.0,
    -1.5,
    -3.0,
    0.1,
    0.01,
    -0.1,
    0.2,
    -1.0,
    0.02,
    0.1,
    0.2,
    0.3,
    0.4,
    0.5,
    0.6,
    1.0,
]


def curve(x, b, c, d, e):
    bx = b * x
    return d * np.sin(c * np.arctan(bx - e * (bx - np.arctan(bx))))


def published(alpha, kappa):
    """Fy, Fx, Mz of Bakker, Pacejka & Lidner (1989) as printed: kN, deg, percent."""
    f, g = LOAD, CAMBER
    d = (A[1] * f + A[2]) * f
    bcd = A[3] * np.sin(2 * np.arctan(f / A[4])) * (1 - A[5] * abs(g))
    fy = curve(alpha + A[8] * g + A[9] * f + A[10], bcd / (A[0] * d), A[0], d, A[6] * f + A[7])
    fy += A[11] * g * f + A[12] * f + A[13]
    d = (B[1] * f + B[2]) * f
    bcd = (B[3] * f**2 + B[4] * f) * np.exp(-B[5] * f)
    e = B[6] * f**2 + B[7] * f + B[8]
    fx = curve(kappa + B[9] * f + B[10], bcd / (B[0] * d), B[0], d, e)
    d = (C[1] * f + C[2]) * f
    bcd = (C[3] * f**2 + C[4] * f) * (1 - C[6] * abs(g)) * np.exp(-C[5] * f)
    e = (C[7] * f**2 + C[8] * f + C[9]) * (1 - C[10] * abs(g))
    mz = curve(alpha + C[11] * g + C[12] * f + C[13], bcd / (C[0] * d), C[0], d, e)
    mz += (C[14] * f**2 + C[15] * f) * g + C[16] * f + C[17]
    return fy, fx, mz


def test_pure_slip_is_the_published_curve_whatever_the_shifts():
    """A shift is no slip: it combines with nothing."""
    tire = Pac89(A, B, C, "kN", nominal_load=1000 * LOAD)
    alpha, kappa = np.linspace(-15.0, 15.0, 31), np.linspace(-40.0, 40.0, 31)
    fy, _, mz = published(alpha, 0.0)
    found = tire.forces(1000 * LOAD, 0.0, np.radians(alpha), np.radians(CAMBER))
    np.testing.assert_allclose(-found.Fy, fy, rtol=1e-12, atol=1e-10)
    np.testing.assert_allclose(-found.Mz, mz, rtol=1e-12, atol=1e-12)
    _, fx, _ = published(0.0, kappa)
    found = tire.forces(1000 * LOAD, kappa / 100.0, 0.0, np.radians(CAMBER))
    np.testing.assert_allclose(found.Fx, fx, rtol=1e-12, atol=1e-10)


def test_combined_slip_goes_over_into_pure_slip():
    tire = Pac89(A, B, C, "kN", nominal_load=1000 * LOAD)
    for alpha, kappa in ((0.1, 0.0), (0.0, 0.1), (0.0, 0.0)):
        at = tire.forces(1000 * LOAD, kappa, alpha)
        for da, dk in ((1e-9, 1e-9), (-1e-9, 1e-9), (1e-9, -1e-9), (1e-12, 1e-9), (1e-9, 1e-12)):
            near = tire.forces(1000 * LOAD, kappa + dk, alpha + da)
            np.testing.assert_allclose(np.array(near), np.array(at), atol=1e-3, rtol=0)
