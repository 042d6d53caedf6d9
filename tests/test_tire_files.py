"""Tire files: what is shipped, what goes out and comes back, and one line for what is bad."""

from pathlib import Path

import numpy as np
import pytest

from mjchair.errors import MjchairError
from mjchair.tire import Pac89, Tire, read, write

SHIPPED = sorted((Path(__file__).parents[1] / "models" / "tires").glob("*.toml"))


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_every_shipped_tire_reads_and_comes_back(path, tmp_path):
    tire = read(path)
    assert tire.name == path.stem
    assert tire.source
    copy = tmp_path / "copy.toml"
    write(tire, copy)
    assert read(copy) == tire


def test_the_shipped_sets_give_the_published_forces():
    folder = SHIPPED[0].parent
    table1 = read(folder / "genta_table1.toml").forces(2000.0, 0.0, np.radians([2, 5, 10, 15]))
    assert np.allclose(-table1.Fy, [1044.17, 1864.97, 2152.48, 2161.87], atol=0.005)
    measured = read(folder / "wheelchair_a0_148.toml").forces(210.0, 0.0, np.radians([5, 10, 15]))
    assert np.allclose(-measured.Fy, [31.9, 43.6, 45.7], atol=0.05)
    other = read(folder / "wheelchair_a0_048.toml").forces(210.0, 0.0, np.radians([5, 10, 15]))
    assert np.allclose(-other.Fy, [22.3, 26.6, 28.2], atol=0.08)


@pytest.mark.parametrize(
    ("name", "load", "mass", "h"),
    [
        ("caster", 200.0, 0.25, 0.004),
        ("wheelchair", 300.0, 1.4, 0.004),
        ("wheelchair", 600.0, 1.4, 0.002),
    ],
)
def test_the_default_tires_hold_still_at_a_long_step(name, load, mass, h):
    """k h^2/m + 2 c h/m < 4 with k = C/sigma; mass (kg) that the contact moves along."""
    tire = read(SHIPPED[0].parent / f"{name}.toml")
    slope = -tire.forces(load, 0.0, 1e-5).Fy / 1e-5
    k = slope / tire.relaxation_y
    assert k * h**2 / mass + 2.0 * tire.damping_time * k * h / mass < 4.0


def test_a_file_names_the_tire_where_its_text_does_not(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(
        'family = "pac89"\nload_unit = "N"\n[coefficients]\na = [1.3, 0.0, 0.8, 50, 500]'
    )
    assert read(path).name == "mine"


def test_suffixes_are_the_formats(tmp_path):
    with pytest.raises(MjchairError, match=r"'\.xml'.*\.tir"):
        write(Pac89(a=[1.3, 0, 0.8, 50, 500], load_unit="N"), tmp_path / "tire.xml")
    with pytest.raises(MjchairError, match="suffix"):
        read(tmp_path / "tire")


@pytest.mark.parametrize("suffix", [".toml", ".tir"])
@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "empty"),
        (b"\x00\x01\x02\x7fELF" * 100, "control characters"),
        (b"\xff\xfe" + bytes(range(128, 256)), "not TOML|any .SECTION."),
        (b"x" * 2_000_000, "more than 1000 kB"),
    ],
    ids=["empty", "binary", "latin", "large"],
)
def test_rubbish_gets_one_line(tmp_path, suffix, content, message):
    path = tmp_path / f"bad{suffix}"
    path.write_bytes(content)
    with pytest.raises(MjchairError, match=message) as caught:
        read(path)
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)


def test_a_sparse_100_mb_file_is_not_read_whole(tmp_path):
    path = tmp_path / "noise.tir"
    with path.open("wb") as stream:
        stream.seek(100_000_000)
        stream.write(b"x")
    with pytest.raises(MjchairError, match="more than"):
        read(path)


def test_what_is_not_there_gets_one_line(tmp_path):
    with pytest.raises(MjchairError, match="cannot read"):
        read(tmp_path / "none.toml")
    (tmp_path / "folder.toml").mkdir()
    with pytest.raises(MjchairError, match="cannot read"):
        read(tmp_path / "folder.toml")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("family = ", "not TOML"),
        ('family = "pac89"\nfamily = "linear"', "not TOML"),
        ('name = "x"', "no 'family'"),
        ('family = "pac98"', "unknown family 'pac98'|load_unit"),
        ('family = "pac89"\n[coefficients]\na = [1]', "load_unit"),
        ('family = "pac89"\nload_unit = "lb"', "load_unit is 'lb'"),
        ('family = "linear"\nload_unit = "N"', "load_unit is PAC89's"),
        ('family = "linear"\nrelaxation = 0.1', "unknown key 'relaxation'.*relaxation_x"),
        ('family = "linear"\nradius = "big"', "radius is 'big'"),
        ('family = "linear"\nradius = nan', "finite"),
        ('family = "linear"\nname = 3', "name is 3"),
        ('family = "linear"\ncoefficients = 3', "must be a table"),
        ('family = "linear"\n[coefficients]\nstiffness = 3', "unknown linear coefficient"),
        ('family = "pac89"\nload_unit = "N"\n[coefficients]\na = 3', "a must be a list of 1 to 14"),
        ('family = "linear"\nrelaxation_x = 0\n[coefficients]\ncornering_stiffness = 1', "is 0"),
        ("a = " + "[" * 5000, "not TOML"),
        ('family = "linear"\n[coefficients]\nfriction = 1', "slip stiffness is 0.*_stiffness"),
        ('family = "pac89"\nload_unit = "N"\n[coefficients]\na = [1.3, 0, 0.8, 0, 9]', "a3 and a4"),
        ('family = "linear"\nside = "top"\n', "unknown side 'top'.*left, right, symmetric"),
    ],
)
def test_bad_toml_gets_one_line(tmp_path, text, message):
    path = tmp_path / "bad.toml"
    path.write_text(text)
    with pytest.raises(MjchairError, match=message) as caught:
        read(path)
    assert "\n" not in str(caught.value)


def test_quotes_and_lists_survive_toml(tmp_path):
    tire = Pac89(
        a={"a0": 1.3, "a2": 0.8, "a3": 50.0, "a4": 500.0},
        b=[1.6, 0.0, 0.9, 0.0, 20.0],
        load_unit="N",
        name='a "quoted" \\ name',
        source="line\nbreak",
    )
    write(tire, tmp_path / "t.toml")
    again = read(tmp_path / "t.toml")
    assert again == tire
    assert np.array_equal(again.block(), tire.block())


def test_families_without_a_tir_are_named(tmp_path):
    linear = Tire("t", "linear", {"cornering_stiffness": 3600.0, "friction": 0.8})
    with pytest.raises(MjchairError, match="write a"):
        write(linear, tmp_path / "t.tir")
