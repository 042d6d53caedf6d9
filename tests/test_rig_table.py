"""Rig tables: what reads, and one line for what does not."""

import numpy as np
import pytest

from mjchair.errors import MjchairError
from mjchair.measurement.rig import read_rig, write_rows


def put(tmp_path, text):
    path = tmp_path / "rig.csv"
    path.write_text(text)
    return path


def test_cells_are_averaged_and_blanks_are_free_rolling(tmp_path):
    table = read_rig(
        put(tmp_path, "slip_angle_deg,load_n,kappa,cell_1_n,cell_2_n,note\n5,100,,-20,-22,a\n")
    )
    assert table.fy.tolist() == [-21.0]
    assert table.kappa.tolist() == [0.0]
    assert np.isnan(table.fx).all()
    assert len(table) == 1


def test_the_papers_sign_is_turned(tmp_path):
    path = put(tmp_path, "slip_angle_deg,load_n,fy_n\n5,100,21\n")
    assert read_rig(path, paper_sign=True).fy.tolist() == [-21.0]


def test_what_is_written_reads(tmp_path):
    path = tmp_path / "t.csv"
    write_rows(path, ("slip_angle_deg", "load_n", "fy_n", "kappa"), [(0.1, 30.0, -1 / 3, None)])
    assert read_rig(path).fy[0] == -1 / 3


def test_a_heading_may_carry_another_unit(tmp_path):
    head = "slip_angle [rad],load [kN],fy [kN],camber [deg],kappa [%],speed [km/h],p [bar],fx [N]"
    table = read_rig(put(tmp_path, f"{head}\n0.1,0.2,-0.05,3,5,36,2.4,7\n"))
    assert table.angle[0] == pytest.approx(np.degrees(0.1), rel=1e-15)
    for name, value in (("load", 200), ("fy", -50), ("camber", 3), ("kappa", 0.05), ("speed", 10)):
        assert getattr(table, name)[0] == pytest.approx(value, rel=1e-14), name
    same = read_rig(put(tmp_path, "slip_angle [deg],load_n [N],fy_n\n0.1,0.2e3,-5\n"))
    assert (same.angle[0], same.load[0], same.fx[0]) == (
        0.1,
        200.0,
        pytest.approx(np.nan, nan_ok=True),
    )


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "empty"),
        ("slip_angle,load_n,fy_n\n1,2,3\n", "no column 'slip_angle_deg'"),
        ("slip_angle_deg,load_n\n1,2\n", "no lateral force"),
        ("slip_angle_deg,load_n,fy_n\n", "no runs"),
        ("slip_angle_deg,load_n,fy_n\n1,2\n", "row 2 has 2 cells"),
        ("slip_angle_deg,load_n,fy_n\n1,2,much\n", "row 2, column 'fy_n': 'much' is not a number"),
        ("slip_angle_deg,load_n,fy_n\n1,2,inf\n", "must be finite"),
        ("slip_angle_deg,load_n,fy_n\n1,,3\n", "load_n in row 2 is empty"),
        ("slip_angle_deg,load_n,fy_n\n1,-2,3\n", "load_n in row 2 is -2"),
        ("slip_angle_deg,load_n,fy_n,fy_n\n1,2,3,3\n", "twice"),
        ("slip_angle_deg,load_n,fy_n,turned\n1,2,3,5\n", "turned in row 2 is 5"),
        ("Slip_Angle_Deg,load_n,fy_n\n1,2,3\n", "no column 'slip_angle_deg'; is it 'Slip_Ang"),
        ("slip_angle_rad,load_n,fy_n\n1,2,3\n", r"is it 'slip_angle_rad'\?.*slip_angle \[rad\]"),
        ("slip_angle_deg,Load,fy_n\n1,2,3\n", "no column 'load_n'; is it 'Load'"),
        ("slip_angle_deg,load_n,fy\n1,2,3\n", r"is it 'fy'\? name it fy_n or 'fy \[N\]'"),
        ("slip_angle_deg,load [kN],load_n,fy_n\n1,2,3,4\n", "twice"),
        ("slip_angle_deg,load [kg],fy_n\n1,2,3\n", r"'load \[kg\]'; it must be in N or kN"),
        ("slip_angle_deg,load [stone],fy_n\n1,2,3\n", "unknown unit 'stone'"),
        ("slip_angle_deg,load_n [kN],fy_n\n1,2,3\n", r"'load_n \[kN\]'; it must be in N$"),
        ("slip_angle_deg,load_n,fy_n\n1,0.1,3\n2,0.45,3\n", r"0.45 N only.* 'load \[kN\]'"),
    ],
)
def test_bad_tables_get_one_line(tmp_path, text, message):
    with pytest.raises(MjchairError, match=message) as caught:
        read_rig(put(tmp_path, text))
    assert "\n" not in str(caught.value)


def test_binary_and_missing_files_get_one_line(tmp_path):
    path = tmp_path / "rig.csv"
    path.write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(MjchairError, match="UTF-8"):
        read_rig(path)
    with pytest.raises(MjchairError, match="cannot read"):
        read_rig(tmp_path / "none.csv")
