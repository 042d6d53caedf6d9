"""Standard .tir files: read, written back, and refused in one line."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

from mjchair.errors import MjchairError
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
    assert unused["MODEL.TYRESIDE"] == "'LEFT'"
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
