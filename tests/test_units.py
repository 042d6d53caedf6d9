"""Units: what may be written, what is asked back, and how a number is printed with one."""

import pytest

import mjchair
from mjchair.drive.files import read_drive
from mjchair.errors import MjchairError
from mjchair.model import assets
from mjchair.model.spec import drive_file
from mjchair.units import UNITS, factor, nearest_unit, split_header, with_unit


@pytest.mark.parametrize(("unit", "si"), [("N cm", 0.01), ("Ncm", 0.01), ("Nmm", 1e-3)])
def test_torques_in_centimetres_are_torques(unit, si):
    assert UNITS[unit][0] == "N m"
    assert factor(split_header(f"left_wheel [{unit}]")[1]) == si


@pytest.mark.parametrize(
    ("given", "meant"),
    [("KM/H", "km/h"), ("m/s²", "m/s^2"), ("degrees/s", "deg/s"), ("n.m", "N m"), ("°", "deg")],
)
def test_another_way_to_write_a_unit_is_asked_for(given, meant):
    assert f"did you mean '{meant}'?" in nearest_unit(given)


@pytest.mark.parametrize("given", ["lbf", "N in", "kN m", "kg m", "rad/m", "mph", "N/m"])
def test_what_only_looks_like_a_unit_is_not_proposed(given):
    said = nearest_unit(given)
    assert "did you mean" not in said and "known: s, ms, m, mm" in said


def test_the_unit_1_is_not_printed_as_a_number():
    assert (with_unit(1.5, "1"), with_unit(1.5, "N"), with_unit("0 to 1", "1")) == (
        "1.5",
        "1.5 N",
        "0 to 1",
    )


def drive(tmp_path, old, new):
    """The shipped power chair's drive with a text replaced, read again."""
    text = drive_file(assets.find("model", "power", assets.chairs())).read_text()
    assert old in text
    (tmp_path / "drive.toml").write_text(text.replace(old, new, 1))
    return read_drive(tmp_path / "drive.toml")


DEADBAND = 'deadband = { value = 0.25, unit = "1", source = "25 % (Rhino2 controller)" }\n'


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("charge = { value = 1.0", "charge = { value = 1.5", "battery charge is 1.5; it must"),
        ("efficiency = { value = 0.8", "efficiency = { value = 80", "gear efficiency is 80; it"),
        ("deadband = { value = 0.25", "deadband = { value = 1.0", "profile deadband is 1; it"),
        ("ambient = { value = 20.0", "ambient = { value = 99", "motor ambient is 99 degC; it"),
        (DEADBAND, "", "[profile.normal] has no 'deadband'; give it as deadband = { value"),
    ],
)
def test_a_wrong_drive_says_what_is_wrong_and_what_is_right(tmp_path, old, new, line):
    with pytest.raises(MjchairError) as refused:
        drive(tmp_path, old, new)
    assert line in str(refused.value) and "\n" not in str(refused.value)


def test_chair_parameters_and_effects_print_no_1():
    with pytest.raises(MjchairError, match=r"tire_pressure is 9; it must be within"):
        mjchair.ChairParameters(tire_pressure=9.0)
