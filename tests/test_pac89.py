"""The 1989 formula against forces that an independent code computed (tests/data/tire)."""

from pathlib import Path

import numpy as np
import pytest

from mjchair.model.spec import read_tire

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
