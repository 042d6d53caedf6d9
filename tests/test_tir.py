"""Standard .tir files: read, written back, and refused in one line."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

from mjchair.errors import MjchairError, MjchairNote
from mjchair.tire import Pac89, read, write

DATA = Path(__file__).parent / "data" / "tire"
BOOK = tomllib.loads((DATA / "mf61_book205.toml").read_text())

HEAD = """[MDI_HEADER]
FILE_TYPE = 'tir'
$----------------------------------------------------------------units
[UNITS]
LENGTH = 'meter'
FORCE = 'newton'
ANGLE = 'radians'
MASS = 'kg'
TIME = 'second'
[MODEL]
FITTYP = {fit}   $Magic Formula Version number
TYRESIDE = 'LEFT'
LONGVL = 16.67
VXLOW = 1
[DIMENSION]
UNLOADED_RADIUS = 0.313 ! m
WIDTH = 0.205
[SHAPE]
{{radial width}}
 1.0   0.0
 0.9   0.5
[OPERATING_CONDITIONS]
INFLPRES =
NOMPRES = 220000
[VERTICAL]
FNOMIN = 4000
VERTICAL_STIFFNESS = 2.0D5
"""


def text(fit=61, head=HEAD, **changes):
    lines = {"LONGITUDINAL": "PR", "LATERAL": "PR", "ALIGNING": "QS", "ROLLING": "Q"}
    parts = [head.format(fit=fit)]
    for section in lines:
        parts.append(f"[{section}_COEFFICIENTS]")
        for name, value in (BOOK | changes).items():
            if home(name) == section:
                parts.append(f"{name} = {value}  $ {section.lower()}")
    return "\n".join(parts) + "\n"


def home(name):
    if name[:2] in ("QS",) and name[2] == "Y":
        return "ROLLING"
    if name[:2] in ("QB", "QC", "QD", "QE", "QH", "SS"):
        return "ALIGNING"
    if len(name) > 3 and name[0] in "PR":
        return {"X": "LONGITUDINAL", "Y": "LATERAL"}.get(name[2])
    return None


def put(tmp_path, content, name="book.tir"):
    path = tmp_path / name
    path.write_text(content)
    return path


@pytest.mark.parametrize(("fit", "family"), [(61, "mf61"), (62, "mf61"), (6, "mf52"), (5, "mf52")])
def test_a_file_reads_and_is_written_back(tmp_path, fit, family):
    tire = read(put(tmp_path, text(fit)))
    assert tire.family == family
    assert tire.name == "book"
    assert tire.radius == 0.313
    assert tire.nominal_load == 4000.0
    assert tire.coefficients["PDY3"] == -11.23
    write(tire, tmp_path / "again.tir")
    again = read(tmp_path / "again.tir")
    assert again == tire
    write(tire, tmp_path / "as.toml")
    assert read(tmp_path / "as.toml") == tire


def test_what_is_not_used_is_listed_with_its_text(tmp_path):
    unused = read(put(tmp_path, text(62))).unused
    assert unused["DIMENSION.WIDTH"] == "0.205"
    assert "MODEL.TYRESIDE" not in unused
    assert unused["MODEL.FITTYP"] == "62"  # its vertical differs from 6.1 and is not used
    assert unused["SHAPE.#2"] == "1.0   0.0"
    assert unused["VERTICAL.VERTICAL_STIFFNESS"] == "2.0D5"
    assert unused["OPERATING_CONDITIONS.INFLPRES"] == ""
    assert "UNITS.LENGTH" not in unused
    assert "LATERAL_COEFFICIENTS.PDY1" not in unused


def test_it_has_the_forces_of_its_coefficients(tmp_path):
    tire = read(put(tmp_path, text()))
    force = tire.forces(4000.0, 0.0, 0.1)
    stiffer = read(put(tmp_path, text(PKY1=-30.0), "stiff.tir"))
    assert -stiffer.forces(4000.0, 0.0, 0.01).Fy > -1.5 * tire.forces(4000.0, 0.0, 0.01).Fy
    assert -4500.0 < force.Fy < -2500.0


def test_pac89_files_read_in_kn_and_are_written_back(tmp_path):
    path = put(
        tmp_path,
        "[UNITS]\nLENGTH='meter'\n[MODEL]\nPROPERTY_FILE_FORMAT = 'PAC89'\n[DIMENSION]\n"
        "UNLOADED_RADIUS = 0.34\n[LATERAL_COEFFICIENTS]\na0=1.3\na1=-53.31\na2=1190\na3=588.6\n"
        "a4=2.5315\na6=-0.5178\na7=1\n",
        "genta.tir",
    )
    tire = read(path)
    assert tire.radius == 0.34
    angles = np.radians([2, 5, 10, 15])
    published = [1044.17, 1864.97, 2152.48, 2161.87]
    assert np.allclose(-tire.forces(2000.0, 0.0, angles).Fy, published, atol=0.005)
    write(tire, tmp_path / "again.tir")
    assert read(tmp_path / "again.tir") == tire
    newton = Pac89(
        a=[1.48, 5.238e-5, 0.20657, 8.8589, 355.0],
        b=[1.6, 0, 0.2, 0, 9],
        load_unit="N",
        nominal_load=210.0,
    )
    write(newton, tmp_path / "newton.tir")
    assert read(tmp_path / "newton.tir") == newton


def test_files_as_other_programs_write_them_read(tmp_path):
    """PAC2002 without FITTYP or combined slip; MF_05 whose slip range has no driving side."""
    head = HEAD.replace("FITTYP = {fit} ", "PROPERTY_FILE_FORMAT ='PAC2002' ")
    ranges = (
        "[SLIP_ANGLE_RANGE]\nALPMIN = -1.5708 $Minimum\nALPMAX = 1.5708\n"
        "[LONG_SLIP_RANGE]\nKPUMIN = -0.80000\nKPUMAX = 0.00000 $Maximum valid wheel slip\n"
    )
    bare = {name: 0.0 for name in BOOK if name[0] == "R"}
    tire = read(put(tmp_path, text(head=head, **bare) + ranges))
    assert tire.family == "mf52"
    assert tire.forces(4000.0, 0.05, 0.0).Fx > 2000.0
    assert abs(tire.forces(4000.0, 0.0, 1.4).Fy) > 2000.0
    both = tire.forces(4000.0, 0.3, 0.3)
    assert np.hypot(both.Fx, both.Fy) < 1.3 * 4000.0
    write(tire, tmp_path / "again.tir")
    assert read(tmp_path / "again.tir") == tire
    swift = head.replace("'PAC2002'", "'MF_05'\nFITTYP = 5")
    assert read(put(tmp_path, text(head=swift) + ranges)).family == "mf52"


def cut(at):
    whole = text()
    return whole[: int(at * len(whole))]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (cut(0.1), "missing"),
        (cut(0.3), "missing"),
        (cut(0.5), "missing"),
        (text().replace("[ALIGNING_COEFFICIENTS]", "[OTHER]"), "ALIGNING_COEFFICIENTS"),
        (text().replace("[UNITS]", "[OTHER]"), r"\[UNITS\] is missing"),
        (text().replace("'meter'", "'mm'"), "LENGTH is 'mm'.*SI"),
        (text().replace("'newton'", "'pound_force'"), "FORCE is 'pound_force'"),
        (text().replace("'radians'", "'degrees'"), "ANGLE is 'degrees'"),
        (text().replace("PDY1 = -0.99", "PDY1 = -0.99\nPDY1 = -0.9"), "PDY1 is twice"),
        (text().replace("PDY1 = -0.99", "PDY1 = -0.99\nPCX1 = 1.6"), "PCX1 is in"),
        (text() + "[VERTICAL]\nFNOMIN = 1\n", r"\[VERTICAL\] is there twice"),
        (text().replace("PDY1 = -0.99", "PDY1 = much"), "PDY1 is 'much'"),
        (text().replace("PDY1 = -0.99", "PDY1 = nan"), "must be finite"),
        (text().replace("PDY1 = -0.99", "PDY1 -0.99"), "no '='"),
        (text().replace("[VERTICAL]", "[VERTICAL"), "no .SECTION."),
        (text(fit=60), "'60' is not known"),
        (text().replace("FITTYP = 61", "FITTYP ="), "no FITTYP"),
        (text().replace("FNOMIN = 4000", "FNOMIN ="), "FNOMIN is missing or 0"),
        ("hello world\n" * 50, "before any .SECTION."),
        ("$ only a comment\n", "no .SECTION."),
    ],
)
def test_bad_files_get_one_line(tmp_path, content, message):
    path = put(tmp_path, content, "bad.tir")
    with pytest.raises(MjchairError, match=message) as caught:
        read(path)
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)


def with_section(name, *lines):
    return text() + "\n".join([f"[{name}]", *lines]) + "\n"


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (text().replace("PKY1 =", "PKYY1 ="), "unknown key 'PKYY1'; did you mean 'PKY1'?"),
        (text().replace("PDY1 =", "PDY_1 ="), "unknown key 'PDY_1'; did you mean 'PDY1'?"),
        (text().replace("RBY1 =", "RYB1 ="), "unknown key 'RYB1'; did you mean 'RBY1'?"),
        (text().replace("PHY1 =", "PHYY1 ="), "unknown key 'PHYY1'; did you mean 'PHY1'?"),
        (text().replace("PHY1 =", "PHYl ="), "unknown key 'PHYL'; did you mean 'PHY1'?"),
        (text().replace("PKX1 =", "PJX1 ="), "unknown key 'PJX1'; did you mean 'PKX1'?"),
        (text().replace("TYRESIDE", "TIRESIDE"), "unknown key 'TIRESIDE'; did you mean 'TYRESIDE'"),
        (with_section("SCALING_COEFFICIENTS", "LMUYY = 0.5"), "did you mean 'LMUY'?"),
        (with_section("MY_OWN", "LMUYY = 0.5"), r"\[MY_OWN\] unknown key 'LMUYY'"),
        (text().replace("'LEFT'", "'UPPER'"), "TYRESIDE is 'UPPER'.* LEFT, RIGHT, SYMMETRIC"),
    ],
)
def test_a_misspelled_key_is_refused_with_the_one_that_was_meant(tmp_path, content, message):
    with pytest.raises(MjchairError, match=message.replace("?", r"\?")) as caught:
        read(put(tmp_path, content, "bad.tir"))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["PKY1", "PKX1", "PDY1", "PDX1", "PCY1", "PKY2"])
@pytest.mark.parametrize("how", ["left out", "0"])
def test_a_file_without_stiffness_or_peak_is_refused_by_the_key(tmp_path, name, how):
    line = next(line for line in text().splitlines() if line.startswith(f"{name} ="))
    content = text().replace(line, "" if how == "left out" else f"{name} = 0")
    with pytest.raises(MjchairError, match=f"{name} is missing or 0"):
        read(put(tmp_path, content, "bad.tir"))


@pytest.mark.parametrize(
    ("name", "lines", "message"),
    [
        *[
            ("SCALING_COEFFICIENTS", [f"{key} = -1"], f"{key} is -1; it must be above 0")
            for key in ("LFZO", "LCX", "LMUX", "LKX", "LCY", "LMUY", "LKY")
        ],
        ("SCALING_COEFFICIENTS", ["LMUY = 0"], "LMUY is 0; it must be above 0"),
        ("SCALING_COEFFICIENTS", ["LMY = -1"], "LMY is -1; it must not be below 0"),
        ("VERTICAL_FORCE_RANGE", ["FZMIN = 5000", "FZMAX = 100"], "FZMIN is 5000, above FZMAX"),
        ("LONG_SLIP_RANGE", ["KPUMIN = 1", "KPUMAX = -1"], "KPUMIN is 1, above KPUMAX, -1"),
        ("SLIP_ANGLE_RANGE", ["ALPMIN = 1", "ALPMAX = -1"], "ALPMIN is 1, above ALPMAX"),
        ("INCLINATION_ANGLE_RANGE", ["CAMMIN = 1", "CAMMAX = -1"], "CAMMIN is 1, above CAMMAX"),
        ("INFLATION_PRESSURE_RANGE", ["PRESMIN = 2", "PRESMAX = 1"], "PRESMIN is 2, above PRESMAX"),
    ],
)
def test_what_no_tire_has_is_refused_by_the_key(tmp_path, name, lines, message):
    with pytest.raises(MjchairError, match=message):
        read(put(tmp_path, with_section(name, *lines), "bad.tir"))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"PKY1": 14.95}, "PKY1 is 14.95: the lateral force would grow .* PKY1 is below 0"),
        ({"PKY2": -2.13}, "PKY1 is -14.95, PKY2 -2.13: the lateral force would grow"),
        ({"PKX1": -21.51}, "PKX1 is -21.51; a slip stiffness is above 0"),
    ],
)
def test_a_stiffness_of_the_wrong_sign_is_refused(tmp_path, changes, message):
    with pytest.raises(MjchairError, match=message):
        read(put(tmp_path, text(**changes), "bad.tir"))


def test_either_sign_of_the_peak_and_two_signs_of_the_stiffness_are_one_tire(tmp_path):
    """Files have PDY1 of both signs, and PKY1 and PKY2 of one sign or the other together."""
    tire = read(put(tmp_path, text()))
    for changes in ({"PDY1": 0.99, "PDY2": -0.145}, {"PKY1": 14.95, "PKY2": -2.13}):
        other = read(put(tmp_path, text(**changes), "other.tir"))
        angles = np.linspace(-0.2, 0.2, 9)
        want = tire.forces(4000.0, 0.0, angles).Fy
        assert np.allclose(other.forces(4000.0, 0.0, angles).Fy, want, rtol=1e-12)


def test_shifts_may_be_scaled_by_minus_one(tmp_path):
    content = with_section("SCALING_COEFFICIENTS", "LHY = -1", "LVY = -1", "LRES = -1")
    assert read(put(tmp_path, content)).coefficients["LHY"] == -1.0


# of files that other programs write: what a tire has and this project does not use
OTHERS = """[GOODYEAR]
CONSTRUCTION = '0L5001'
INFLATION_PRESSURE = 4.14
TIRE_DOT = ''
[INERTIA]
MASS = 9.3
BELT_IYY = 0.7
[DEFLECTION_LOAD_CURVE]
{pen fz}
0.000 0.000
0.005 2004.057
[CONTACT_PATCH]
Q_RA1 = 0.5
ENV_C1 = 0
[TURNSLIP_COEFFICIENTS]
PDXP1 = 0.4
QDRP1 = 1
[SCALING_COEFFICIENTS]
LMP = 1
LGAY = 1
LGYR = 1
LMY = 0
[OVERTURNING_COEFFICIENTS]
QSX1 = 0
"""


def test_keys_of_other_programs_are_read_without_a_word(tmp_path, recwarn):
    head = HEAD.replace(
        "VXLOW", "USE_MODE = 4\nFE_METHOD = 'YES'\nMFSAFE1 = -7128\nROAD_DIRECTION = 1\nVXLOW"
    )
    lines = "QTZ1 = 0.2\nMBELT = 4.9\nPTX1 = 1.9\nPTY1 = 2.1\nPHY3 = 0.04\nQDZ5 = 0\n"
    tire = read(put(tmp_path, text(head=head) + lines + OTHERS))
    assert not recwarn.list
    assert tire.unused["ROLLING_COEFFICIENTS.QTZ1"] == "0.2"
    assert tire.unused["GOODYEAR.CONSTRUCTION"] == "'0L5001'"


def test_a_key_near_nothing_is_read_with_a_note(tmp_path):
    with pytest.warns(MjchairNote, match="tire book: left out keys .*: SHINE, PKY8$"):
        tire = read(put(tmp_path, text() + "SHINE = 3\nPKY8 = 1\n[SCALING_COEFFICIENTS]\n"))
    assert tire.unused["ROLLING_COEFFICIENTS.SHINE"] == "3"


def test_a_slip_beside_the_right_key_is_a_note(tmp_path):
    with pytest.warns(MjchairNote, match="left out .*: PKYY1$"):
        tire = read(put(tmp_path, text() + "PKYY1 = -30\n"))
    assert tire.coefficients["PKY1"] == -14.95


def test_a_file_without_its_radius_says_what_is_taken(tmp_path):
    content = text().replace("UNLOADED_RADIUS = 0.313 ! m\n", "")
    with pytest.warns(MjchairNote, match="no UNLOADED_RADIUS; 0.3 m is taken"):
        assert read(put(tmp_path, content)).radius == 0.3


@pytest.mark.parametrize(
    ("said", "side"),
    [("'LEFT'", "left"), ("'Right'", "right"), ("'SYMMETRIC'", "symmetric"), ("'UNKNOWN'", "")],
)
def test_the_side_of_the_tire_is_read(tmp_path, said, side):
    tire = read(put(tmp_path, text().replace("'LEFT'", said)))
    assert tire.side == side
    assert ("MODEL.TYRESIDE" in tire.unused) == (side == "")
    write(tire, tmp_path / "again.tir")
    assert read(tmp_path / "again.tir") == tire
