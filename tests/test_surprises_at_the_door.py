"""What users ran into at the command line, in tables and with recordings; each in one line."""

import copy
import importlib.util
import pickle
import sys
import types

import mujoco
import numpy as np
import pytest

import mjchair
from mjchair import cli
from mjchair.errors import MjchairError, MjchairNote, closest
from mjchair.simulation import recording as recording_module
from mjchair.simulation.names import sensors
from mjchair.simulation.table import read_table

KNOWN = ("left_wheel", "left_wheel_speed", "left_wheel_angle", "left_wheel_tire", "imu_gyro")


@pytest.fixture(scope="module")
def run():
    return mjchair.simulate(mjchair.load_spec(), {"left_wheel": 3.0, "right_wheel": 2.0}, 0.2)


def write(path, text):
    path.write_text(text)
    return path


@pytest.mark.parametrize("again", [lambda r: pickle.loads(pickle.dumps(r)), copy.deepcopy])
def test_recordings_and_inputs_compare_copy_and_pickle(run, again):
    for one in (run, mjchair.Inputs([0.0, 1.0], {"left_wheel": [1.0, np.nan]}, hold=True)):
        two = again(one)
        assert two == one and two is not one
        assert not two.time.flags.writeable
    later = mjchair.Inputs([0.0, 2.0], {"left_wheel": [1.0, np.nan]}, hold=True)
    assert later != one and one != "inputs"


def test_a_recording_is_shown_in_a_line_and_in_a_table(run):
    assert repr(run) == f"<Recording completed: 0.2 s, 101 samples; {len(run.channels)} channels>"
    page = run._repr_html_()
    assert "<td>left_wheel_tire.Fz</td><td>N</td>" in page and len(page) < 20_000


def test_every_column_of_the_csv_is_there_by_name(run, tmp_path):
    run.to_csv(tmp_path / "run.csv")
    header = (tmp_path / "run.csv").read_text().partition("\n")[0].split(",")
    assert header == run.keys()
    assert run["left_wheel"][0] == 3.0 and "left_wheel" in run and "left" not in run
    assert dict(run).keys() == set(header)


def test_a_dataframe_is_of_the_library_that_is_there(run, monkeypatch):
    there = []
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: name in there or None)
    with pytest.raises(MjchairError, match="pandas or polars"):
        run.to_dataframe()
    for name in ("polars", "pandas"):  # pandas goes first where both are there
        there.append(name)
        made = types.SimpleNamespace(DataFrame=lambda columns, name=name: (name, columns))
        monkeypatch.setitem(sys.modules, name, made)
        frame = run.to_dataframe()
        assert frame[0] == name and list(frame[1])[:2] == ["time", "left_wheel"]


def test_a_recording_films_itself(run, tmp_path, monkeypatch):
    module = importlib.import_module(recording_module.FILMS)
    seen = []
    monkeypatch.setattr(module, "write_film", lambda *a, **named: seen.append((a, named)))
    run.film(tmp_path / "film.mp4", view="top")
    assert seen == [((run, tmp_path / "film.mp4"), {"view": "top"})]


@pytest.mark.parametrize(
    ("said", "meant"),
    [
        ("left_wheel_torque", "left_wheel"),
        ("left_wheel_velocity", "left_wheel_speed"),
        ("left_wheel_sped", "left_wheel_speed"),
        ("left_whel", "left_wheel"),
        ("imu_gyroscope", "imu_gyro"),
        ("battery", None),
        ("left_wheel_temperature", None),
    ],
)
def test_the_nearest_name_is_one_that_may_be_meant(said, meant, manual):
    assert closest(said, {*KNOWN, *sensors(manual)}) == meant


@pytest.mark.parametrize("word", ["rider", "user", "person"])
def test_who_sits_in_the_chair_is_the_occupant(word):
    """`chair_mass` was proposed, which is the mass of something else."""
    known = ["chair_mass", "occupant_mass", "wheel_mass", "seat_height", "occupant_height"]
    assert closest(f"{word}_mass", known) == "occupant_mass"
    assert closest(f"{word}_weight", known) == closest("ocupant_weight", known) == "occupant_mass"
    assert closest("left_wheel_torque", ["left_wheel_speed", "imu_gyro.z"]) is None


def test_a_table_of_semicolons_and_decimal_commas_is_read(tmp_path):
    table = read_table(write(tmp_path / "a.csv", "time;left_wheel\n0;1,5\n0,1;-2\n"))
    assert list(table.time) == [0.0, 0.1] and list(table.columns["left_wheel"]) == [1.5, -2.0]


def test_a_pandas_index_is_left_out_with_a_note(tmp_path):
    file = write(tmp_path / "a.csv", ",time,left_wheel\n0,0,1\n1,0.1,2\n")
    with pytest.warns(MjchairNote, match="pandas writes its index so"):
        assert list(read_table(file).columns) == ["left_wheel"]
    with pytest.raises(MjchairError, match=r"column 2 has no name; .*index=False"):
        read_table(write(tmp_path / "b.csv", "time,,left_wheel\n0,0,1\n"))


def test_columns_of_something_else_are_left_out_and_misspelt_ones_refused(tmp_path, manual):
    file = write(tmp_path / "a.csv", "time,left_wheel,battery\n0,1,12\n1,1,12\n")
    with pytest.warns(MjchairNote, match="left out what nothing in the model is called: 'battery'"):
        assert list(mjchair.read_inputs(file, manual).controls) == ["left_wheel"]
    file = write(tmp_path / "b.csv", "time,left_wheel,right_whel\n0,1,1\n1,1,1\n")
    with pytest.raises(MjchairError, match="did you mean 'right_wheel'"):
        mjchair.read_inputs(file, manual)


def test_milliseconds_are_recognised_and_told_how_to_write(tmp_path):
    rows = "".join(f"{5 * k},1\n" for k in range(40))
    with pytest.raises(MjchairError, match=r"steps of 5, .*name the column 'time \[ms\]'"):
        read_table(write(tmp_path / "a.csv", "time,left_wheel\n" + rows))
    assert read_table(write(tmp_path / "b.csv", "time [ms],left_wheel\n" + rows)).time[-1] == 0.195
    assert read_table(write(tmp_path / "c.csv", "time [s],left_wheel\n" + rows)).time[-1] == 195.0
    steps = "time,left_wheel\n0,1\n10,1\n20,4\n"  # few points in seconds are no log
    assert read_table(write(tmp_path / "d.csv", steps)).time[-1] == 20.0


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("time,a\n0,1\n\n1,x\n", "row 3, column 'a': 'x' is not a number"),
        ("time,a\n0,1\n1\n", "row 3 has 1 cells; the header has 2"),
        ("time,a\n0,inf\n", "infinite at 0 s; leave the cell of a missing sample empty"),
        ("time,a\nNaN,1\n", "every sample needs a time"),
        ("\n \n", "empty"),
    ],
)
def test_a_bad_cell_is_named_by_row_and_column(tmp_path, text, line):
    with pytest.raises(MjchairError, match=line):
        read_table(write(tmp_path / "a.csv", text))
    values = read_table(write(tmp_path / "b.csv", 'time, a\r\n0,+5\r\n1," 2.5 "\r\n2,\r\n')).columns
    np.testing.assert_array_equal(values["a"], [5.0, 2.5, np.nan])


@pytest.mark.parametrize("word", ["", "NaN", "nan", "NA", " NaN "])
def test_a_missing_sample_is_empty_or_written_as_matlab_pandas_and_r_do(tmp_path, word):
    rows = f"time,a,b\n0,1,+3\n1,{word},4\n"
    values = read_table(write(tmp_path / "a.csv", rows)).columns
    np.testing.assert_array_equal(values["a"], [1.0, np.nan])
    np.testing.assert_array_equal(values["b"], [3.0, 4.0])


def test_held_inputs_keep_their_value_until_the_next_sample():
    time, torque = [0.0, 0.1, 0.3], [1.0, np.nan, 5.0]
    held = mjchair.Inputs(time, {"left_wheel": torque}, hold=True)
    straight = mjchair.Inputs(time, {"left_wheel": torque})
    at = [-0.01, 0.0, 0.15, 0.299, 0.3, 0.31]
    np.testing.assert_array_equal(held.at("left_wheel", at), [0.0, 1.0, 1.0, 1.0, 5.0, 0.0])
    assert straight.at("left_wheel", 0.15) == pytest.approx(3.0)
    # steps of a simulation that fall on a sample belong to it, whatever the rounding
    steps = 0.002 * np.arange(151)
    wanted = np.where(np.arange(151) < 150, 1.0, 5.0)
    np.testing.assert_array_equal(held.at("left_wheel", steps), wanted)


def test_a_recording_keeps_how_its_inputs_were_read(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "log.csv", "time,left_wheel,right_wheel\n0,0,0\n0.1,4,4\n0.2,0,0\n")
    for options, middle in ((["--hold"], 0.0), ([], 2.0)):
        out = "".join(["run", *options])
        assert cli.main(["simulate", "--input", "log.csv", *options, "--out", out]) == 0
        back = mjchair.load_recording(tmp_path / out / "recording.npz")
        assert back.hold is bool(options)
        assert back["left_wheel"][25] == pytest.approx(middle)
    assert cli.main(["simulate", "--hold", "--duration", "0.1"]) == 2
    assert "--hold goes with --input" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("inputs", "line"),
    [(lambda t: 3.0, "inputs is a function; give Inputs"), (3.0, "inputs is a float")],
)
def test_inputs_that_are_none_are_one_line(inputs, line, manual_spec):
    with pytest.raises(MjchairError, match=line):
        mjchair.simulate(manual_spec, inputs, 0.1)


def test_a_control_callback_beside_inputs_is_refused_in_one_line(manual_spec):
    mujoco.set_mjcb_control(lambda model, data: None)
    try:
        with pytest.raises(MjchairError, match="a control callback of MuJoCo is set"):
            mjchair.simulate(manual_spec, {"left_wheel": 1.0}, 0.1)
    finally:
        mujoco.set_mjcb_control(None)


@pytest.mark.parametrize("grade", ["8%", "0.08", "2:25"])
def test_a_grade_may_be_text(grade, tmp_path):
    spec = mjchair.load_spec(scene="ramp", grade=grade)
    assert spec.geom("floor").quat[2] == pytest.approx(-np.sin(0.5 * np.arctan(0.08)))


def test_a_grade_that_is_none_is_one_line():
    for grade in ("steep", "1:0", "8 m"):
        with pytest.raises(MjchairError, match="grade is"):
            mjchair.load_spec(scene="ramp", grade=grade)


def test_negative_pairs_the_version_and_a_frame_beyond_the_end(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    backwards = ["simulate", "--torque", "-6,-6", "--duration", "0.1", "--out", "run"]
    assert cli.main(backwards) == 0
    assert mjchair.load_recording("run/recording.npz")["left_wheel"][0] == -6.0
    assert cli.main(["render", "run", "--frame", "99", "--out", "film"]) == 2
    assert "--frame is 99 s; the recording goes from 0 to 0.1 s" in capsys.readouterr().err
    assert not (tmp_path / "film").exists()
    with pytest.raises(SystemExit) as left:
        cli.main(["--version"])
    assert left.value.code == 0
    assert capsys.readouterr().out == f"mjchair {mjchair.__version__}\n"


STUDY = """scene = "kerb"
step = 0.02
inputs = "hold"
[chair]
camber = "3 deg"
occupant_mass = 82
[[trial]]
file = "one.csv"
[[trial]]
file = "two.csv"
inputs = "straight"
"""


def test_a_study_says_its_chair_its_step_and_how_its_inputs_are_read(tmp_path):
    header = "time,left_wheel,right_wheel,left_wheel_speed\n"
    for name, rate in (("one", 0.1), ("two", 0.12)):
        rows = "".join(f"{0.02 * k},{k % 7},{k % 5},{rate * k}\n" for k in range(100))
        write(tmp_path / f"{name}.csv", header + rows)
    told = STUDY
    write(tmp_path / "study.toml", told)
    study = mjchair.read_study(tmp_path)
    assert study.spec.body("chair").mass == pytest.approx(92.0)
    assert study.spec.geom("step").size[2] == pytest.approx(0.01)
    assert [run.trial.inputs.hold for run in study.runs] == [True, False]
    for bad, line in (
        (told.replace("camber", "cambre"), r"study.toml: \[chair\]: .*did you mean 'camber'"),
        (told.replace('"hold"', '"stairs"'), "inputs is 'stairs'"),
    ):
        write(tmp_path / "study.toml", bad)
        with pytest.raises(MjchairError, match=line):
            mjchair.read_study(tmp_path)


def test_hide_takes_parameters_of_the_effect_and_of_the_chair(tmp_path, capsys, monkeypatch):
    seen = []
    monkeypatch.setattr("mjchair.practice.hide", lambda *given: seen.append(given) or {})
    monkeypatch.chdir(tmp_path)
    chosen = ("--set", "symmetric=1deg", "--set", "occupant_mass=82")
    assert cli.main(["hide", "toe", *chosen, "--model", "power"]) == 0
    effect, values, seed, model, chair = seen[0]
    assert (effect.name, seed, model, chair) == ("toe", 0, "power", {"occupant_mass": "82"})
    assert values == pytest.approx({"symmetric": np.radians(1.0)})
    assert cli.main(["hide", "toe", "--set", "symetric=1deg", "--out", "other"]) == 2
    assert "neither toe nor the chair has a parameter 'symetric'; did you mean 'symmetric'" in (
        capsys.readouterr().err
    )


def test_set_is_fixed_for_every_case_of_a_sweep(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "s.toml", 'duration = 0.02\n[axes]\ncamber = [0.0, "3 deg"]\n')
    assert cli.main(["sweep", "s.toml", "--set", "occupant_mass=82", "--threads", "1"]) == 0
    rows = mjchair.sweep.read("out/sweep").to_pylist()
    assert [row["occupant_mass"] for row in rows] == [82.0, 82.0]
    assert cli.main(["sweep", "s.toml", "--set", "camber=1deg", "--out", "other"]) == 2
    assert "camber is both an axis and a fixed value" in capsys.readouterr().err


def test_public_names_are_there_for_editors_and_import_touches_no_graphics():
    import subprocess

    assert set(mjchair.LATER) <= set(mjchair.__all__) <= set(dir(mjchair))
    assert mjchair.measures.standard is mjchair.sweep.standard
    code = (
        "import os, sys; before = dict(os.environ); import mjchair; "
        "assert dict(os.environ) == before; "
        "heavy = {'OpenGL', 'mujoco.egl', 'matplotlib', 'dm_control', 'pyarrow', 'scipy.stats'}; "
        "assert not heavy & set(sys.modules), heavy & set(sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
