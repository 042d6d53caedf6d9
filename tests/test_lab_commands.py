"""`mjchair rig` and `mjchair fit-tire`, from a tire to a table to a tire."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from mjchair.cli import main
from mjchair.tire import read, write


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    """A rig table and a fit, as the command line leaves them."""
    out = tmp_path_factory.mktemp("lab")
    rig = ["rig", "--noise", "0.02", "--speeds", "0.02", "--out", str(out / "rig")]
    assert main([*rig, "--against", "rig_flexible"]) == 0
    fit = ["fit-tire", str(out / "rig" / "rig.csv"), "--out", str(out / "fit"), "--name", "mine"]
    assert main(fit) == 0
    return out


def test_the_rig_writes_its_table_traces_and_figures(lab):
    names = {path.name for path in (lab / "rig").iterdir()}
    assert names == {"rig.csv", "traces.csv", "traces.png", "lateral.png", "compared.png"}
    rows = list(csv.DictReader((lab / "rig" / "rig.csv").open()))
    assert len(rows) == 12
    assert float(rows[-1]["fy_n"]) == pytest.approx(-45.6, abs=3.0)
    assert rows[0]["kappa"] == ""


def test_the_fit_writes_a_tire_that_drives_the_rig_again(lab, tmp_path):
    assert {path.name for path in (lab / "fit").iterdir()} == {
        "mine.toml",
        "fit.txt",
        "fit.json",
        "fit.png",
    }
    tire = str(lab / "fit" / "mine.toml")
    assert read(tire).name == "mine"
    arguments = ["rig", "--tire", tire, "--angles", "10", "--loads", "210", "--speeds", "0.02"]
    assert main([*arguments, "--out", str(tmp_path / "again")]) == 0
    row = next(csv.DictReader((tmp_path / "again" / "rig.csv").open()))
    assert float(row["fy_n"]) == pytest.approx(-43.6, abs=1.5)


def test_the_report_says_what_is_not_determined(lab):
    text = (lab / "fit" / "fit.txt").read_text()
    assert "Not determined by 3 loads and angles to 15 deg" in text
    assert "held by its prior" in text
    assert "BIC" in text
    record = json.loads((lab / "fit" / "fit.json").read_text())
    by_name = {entry["name"]: entry for entry in record["parameters"]}
    assert by_name["mu"]["determined_by_data"]
    assert not by_name["E"]["determined_by_data"]
    assert len(record["correlations"]) == len(record["parameters"])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["rig", "--tire", "wheelchiar"], "wheelchair"),
        (["rig", "--angles", "80"], "slip angle is 80 deg"),
        (["rig", "--noise", "-1"], "noise is -1"),
        (["rig", "--tire", "linear", "--travel", "0"], "travel is 0"),
        (["fit-tire", "nowhere.csv"], "cannot read nowhere.csv"),
        (["fit-tire", "nowhere.csv", "--family", "linear", "--format", "tir"], "no family"),
    ],
)
def test_bad_input_is_one_line_and_code_2(arguments, message, tmp_path, capsys):
    assert main([*arguments, "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_an_option_that_is_no_number_is_refused(capsys):
    with pytest.raises(SystemExit) as caught:
        main(["rig", "--angles", "5,many"])
    assert caught.value.code == 2
    assert "'many' is not a finite number" in capsys.readouterr().err


def test_nothing_is_overwritten_without_force(lab, capsys):
    assert main(["rig", "--out", str(lab / "rig")]) == 2
    assert "--force" in capsys.readouterr().err


def test_a_fit_of_61_can_be_a_tir_file(lab, tmp_path):
    table = str(lab / "rig" / "rig.csv")
    arguments = ["fit-tire", table, "--family", "mf61", "--format", "tir"]
    assert main([*arguments, "--out", str(tmp_path / "fit")]) == 0
    tire = read(tmp_path / "fit" / "fitted.tir")
    assert tire.family == "mf61"
    assert tire.forces(210.0, 0.0, 0.1745).Fy == pytest.approx(-43.6, abs=2.0)


def test_what_a_tire_file_has_besides_is_listed(tmp_path, capsys):
    known = read(Path(__file__).parents[1] / "models" / "tires" / "wheelchair.toml")
    path = tmp_path / "more.tir"
    write(known, path)
    path.write_text(path.read_text() + "[VERTICAL]\nVERTICAL_STIFFNESS = 2e5\n")
    arguments = ["rig", "--tire", str(path), "--angles", "5", "--loads", "110"]
    assert main([*arguments, "--speeds", "0.05", "--out", str(tmp_path / "rig")]) == 0
    assert "not used of the tire's file: VERTICAL.VERTICAL_STIFFNESS" in capsys.readouterr().out


def lines_of(force):
    """A rig table of the shipped tire, its forces changed by `force(row, fy)`."""
    tire = read(Path(__file__).parents[1] / "models" / "tires" / "wheelchair.toml")
    rows = ["slip_angle_deg,load_n,fy_n"]
    for load in (100.0, 200.0, 300.0):
        for angle in (-12, -8, -4, -2, 2, 4, 8, 12):
            fy = float(tire.forces(load, 0.0, np.radians(angle)).Fy)
            rows.append(f"{angle},{load},{force(len(rows), fy):.4f}")
    return "\n".join(rows) + "\n"


@pytest.mark.parametrize(
    ("force", "message"),
    [
        (lambda row, fy: -fy, "24 of 24 runs, and in ISO-W it has the other; give --paper-sign"),
        (lambda row, fy: 100.0 * np.sin(1e3 * row**2), "% of the force, and of a tire it must be"),
    ],
)
def test_data_without_a_tire_in_it_write_nothing(force, message, tmp_path, capsys):
    (tmp_path / "rig.csv").write_text(lines_of(force))
    assert main(["fit-tire", str(tmp_path / "rig.csv"), "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_an_outlier_is_noted_by_its_row(tmp_path, capsys):
    (tmp_path / "rig.csv").write_text(
        lines_of(lambda row, fy: (10.0 if row == 14 else 1.0) * fy + np.sin(1e3 * row**2))
    )
    assert main(["fit-tire", str(tmp_path / "rig.csv"), "--out", str(tmp_path / "out")]) == 0
    assert f"note: row 15 of {tmp_path / 'rig.csv'}: its lateral force" in capsys.readouterr().err
