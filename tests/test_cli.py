import os
import subprocess
import sys

import numpy as np
import pytest

import mjchair
from mjchair import cli


def run(*arguments, capsys=None):
    try:
        code = cli.main([str(a) for a in arguments])
    except SystemExit as left:
        code = left.code
    out = capsys.readouterr() if capsys else None
    return code, out


def write(path, text):
    path.write_text(text)
    return path


@pytest.fixture
def there(tmp_path, monkeypatch):
    """An empty folder to run in, with a table that drives a chair for a tenth of a second."""
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "drive.csv", "time,left_wheel,right_wheel\n0,5,5\n0.1,5,4\n")
    return tmp_path


def test_simulate_writes_a_recording_a_table_and_figures(there, capsys):
    code, out = run("simulate", "--input", "drive.csv", "--out", "run", capsys=capsys)
    assert code == 0, out.err
    assert out.err == ""
    assert out.out == "completed: 0.1 s, 51 samples; written to run\n"
    names = {"recording.npz", "recording.csv", "trajectory.png", "wheel_speed.png"}
    assert {p.name for p in (there / "run").iterdir()} == names
    recording = mjchair.load_recording(there / "run" / "recording.npz")
    np.testing.assert_allclose(recording.controls["right_wheel"][[0, 25, 50]], [5.0, 4.5, 4.0])


@pytest.mark.parametrize(
    "options",
    [
        ["--torque", "3,2"],
        ["--push", "12,8", "--push-period", "0.5", "--push-time", "0.05"],
        ["--model", "power", "--torque", "3,2"],
        ["--scene", "ramp", "--grade", "1:12", "--brakes"],
        ["--scene", "cross_slope", "--grade", "5%", "--tilt", "gravity", "--speed", "0.5"],
        ["--tire", "wheels=wheelchair_a0_148", "--tire", "casters=caster"],
        ["--timestep", "0.001", "--sample-rate", "100"],
        ["--set", "occupant_mass=82", "--set", "camber=3 deg"],
        ["--model", "power", "--set", "seat_angle=8deg"],
        ["--scene", "kerb", "--step", "20mm"],
        ["--scene", "hfield", "--heights", "uneven:rms=5mm,seed=2"],
        ["--scene", "hfield", "--heights", "floor.csv"],
        ["--position", "1,2", "--heading", "-0.5", "--speed", "0.5", "--yaw-rate", "0.1"],
    ],
    ids=" ".join,
)
def test_any_chair_scene_tire_and_input(there, capsys, options):
    write(there / "floor.csv", "0,0,0\n0,0.001,0\n0,0,0\n")
    code, out = run("simulate", *options, "--duration", "0.1", "--out", "run", capsys=capsys)
    assert code == 0, out.err


def test_nothing_is_overwritten_without_force(there, capsys):
    drive = ("simulate", "--input", "drive.csv", "--out", "run")
    (there / "run").mkdir()
    write(there / "run" / "mine.txt", "keep")
    code, out = run(*drive, capsys=capsys)
    assert code == 2
    assert "run is not empty" in out.err and "--force" in out.err
    assert [p.name for p in (there / "run").iterdir()] == ["mine.txt"]
    assert run(*drive, "--force", capsys=capsys)[0] == 0
    assert (there / "run" / "mine.txt").read_text() == "keep"


BAD = {
    "missing file": (["--input", "driv.csv"], "no file driv.csv; did you mean 'drive.csv'"),
    "decreasing time": (["--input", "back.csv"], "time goes from 1 to 0.5 s"),
    "infinite": (["--input", "inf.csv"], "leave the cell of a missing sample empty"),
    "unknown channel": (["--input", "name.csv"], "did you mean 'left_wheel'"),
    "unknown unit": (["--input", "unit.csv"], "unknown unit 'lbf'"),
    "unknown model": (["--model", "manul"], "unknown model 'manul'; did you mean 'manual'"),
    "unknown scene": (["--scene", "rmp"], "did you mean 'ramp'"),
    "unknown tire": (["--tire", "wheelchar"], "did you mean 'wheelchair'"),
    "unknown wheel": (["--tire", "left_whee=caster"], "did you mean 'left_wheel'"),
    "negative mass": (["--model", "negative.xml"], "mass"),
    "no tire": (["--model", "bare.xml"], "has no tire"),
    "wrong unit of a tire": (["--tire", "newtons.toml"], "peak friction"),
    "timestep": (["--timestep", "0.1"], "stability limit"),
    "grade of the flat": (["--grade", "0.1"], "has no grade"),
    "no number": (["--speed", "fast"], "'fast' is not a finite number"),
    "no pair": (["--torque", "3"], "'3' is not two numbers"),
    "two drives": (["--torque", "3,3", "--push", "3,3"], "not allowed with"),
    "baseline alone": (["--baseline", "a.csv"], "--baseline goes with --smartwheel"),
    "no SmartWheel file": (["--smartwheel", "drive.csv"], "a SmartWheel file has 24"),
    "unknown option": (["--sped", "1"], "unrecognized arguments: --sped"),
    "duration": (["--duration", "-1"], "duration is -1 s"),
    "unknown parameter": (["--set", "cambre=3deg"], "did you mean 'camber'"),
    "no assignment": (["--set", "camber"], "--set 'camber' is not NAME=VALUE"),
    "parameter twice": (["--set", "toe=0", "--set", "toe=1deg"], "--set gives toe twice"),
    "parameter unit": (["--set", "camber=3kg"], "its unit must be one of rad, deg"),
    "parameter of another chair": (
        ["--model", "power", "--set", "anti_tippers=no"],
        "anti_tippers: the model has no anti-tippers",
    ),
    "step of the flat": (["--step", "20mm"], "the scene has no geom 'step'"),
    "no heights": (["--scene", "hfield", "--heights", "gone.csv"], "cannot read gone.csv"),
    "heights in metres": (
        ["--scene", "hfield", "--heights", "uneven:rms=5"],
        "rms is 5 m; it must be within 0 to 0.2; write mm, as rms=5mm",
    ),
    "words for heights": (["--scene", "hfield", "--heights", "drive.csv"], "no table of numbers"),
}


@pytest.fixture
def bad_files(there):
    write(there / "back.csv", "time,left_wheel\n0,1\n1,1\n0.5,1\n")
    write(there / "inf.csv", "time,left_wheel\n0,inf\n")
    write(there / "name.csv", "time,left_whel\n0,1\n")
    write(there / "unit.csv", "time,left_wheel [lbf]\n0,1\n")
    chair = mjchair.load_spec("manual").to_xml()
    write(there / "negative.xml", chair.replace('mass="85"', 'mass="-85"'))
    wheel = '<body name="left_wheel"><joint name="left_wheel"/><geom size="0.1"/></body>'
    write(
        there / "bare.xml",
        f'<mujoco><worldbody><geom name="floor" type="plane" size="1 1 1"/>{wheel}</worldbody>'
        "</mujoco>",
    )
    a = [1.3, -53.31, 1190, 588.6, 2.5315]  # in kN, called N
    write(
        there / "newtons.toml",
        'name = "x"\nfamily = "pac89"\nload_unit = "N"\nsource = "test"\n'
        f"[coefficients]\na = {a}\n",
    )
    return there


@pytest.mark.parametrize("case", BAD)
def test_bad_input_gets_one_line_and_writes_nothing(bad_files, capsys, case):
    options, line = BAD[case]
    before = sorted(bad_files.rglob("*"))
    code, out = run("simulate", *options, "--out", "made", capsys=capsys)
    assert code == 2
    assert line in out.err
    assert out.err.count("\n") == 1, out.err
    assert "Traceback" not in out.err and "fault of mjchair" not in out.err
    assert out.out == ""
    assert sorted(bad_files.rglob("*")) == before


def test_a_run_that_breaks_says_when_keeps_what_it_has_and_exits_with_2(there, capsys):
    write(there / "wild.csv", "time,left_wheel\n0,0\n0.05,0\n0.06,1e8\n0.5,1e8\n")
    code, out = run("simulate", "--input", "wild.csv", "--out", "run", capsys=capsys)
    assert code == 2
    assert out.err.startswith("mjchair: unstable at 0.05") and out.err.count("\n") == 1
    recording = mjchair.load_recording(there / "run" / "recording.npz")
    assert recording.status is mjchair.Status.UNSTABLE
    assert recording.time.size > 20


def test_a_run_that_breaks_by_torques_in_n_mm_says_so(there, capsys):
    write(there / "milli.csv", "time,left_wheel\n0,0\n0.05,0\n0.06,9e3\n9,9e3\n")
    code, out = run("simulate", "--input", "milli.csv", "--out", "run", capsys=capsys)
    assert code == 2
    assert "unstable" in out.err and "its input: left_wheel looks like N mm" in out.err
    assert out.err.count("\n") == 1


def test_render_needs_a_recording(there, capsys):
    for path in ("none.npz", "drive.csv"):
        code, out = run("render", path, "--out", "film", capsys=capsys)
        assert code == 2 and out.err.count("\n") == 1
        assert "recording" in out.err
    assert not (there / "film").exists()


def test_render_refuses_bad_pictures(there, capsys):
    assert run("simulate", "--input", "drive.csv", "--out", "run", capsys=capsys)[0] == 0
    for options, line in (
        (["--view", "inside"], "unknown view"),
        (["--size", "wide"], "is not a size such as 960x540"),
        (["--size", "961x540"], "even numbers"),
        (["--fps", "0"], "must be positive"),
        (["--slow", "0"], "--slow is 0"),
    ):
        code, out = run("render", "run", *options, "--out", "film", capsys=capsys)
        assert code == 2 and line in out.err and out.err.count("\n") == 1
        assert not (there / "film").exists()


def test_models_lists_all_that_ships_with_units_and_sources(capsys):
    code, out = run("models", capsys=capsys)
    assert code == 0
    for word in ("manual", "power", "flat", "ramp", "cross_slope", "genta_table1", "kg", "source"):
        assert word in out.out
    code, out = run("models", "wheelchair", capsys=capsys)
    assert code == 0
    assert "relaxation_x" in out.out and " m " in out.out
    code, out = run("models", "manul", capsys=capsys)
    assert code == 2 and "did you mean 'manual'" in out.err


def test_view_says_so_where_there_is_no_screen(capsys, monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setattr(sys, "platform", "linux")
    code, out = run("view", capsys=capsys)
    assert code == 2
    assert "no screen" in out.err and out.err.count("\n") == 1


@pytest.mark.parametrize("command", [c.__name__.rsplit(".", 1)[-1] for c in cli.COMMANDS])
def test_every_command_has_help(command, capsys):
    name = command.replace("_", "-")
    code, out = run(name, "--help", capsys=capsys)
    assert code == 0
    assert name in out.out


def test_an_interrupt_is_no_traceback(there, capsys, monkeypatch):
    def interrupted(args):
        raise KeyboardInterrupt

    monkeypatch.setattr(cli.COMMANDS[0], "run", interrupted)
    code, out = run("simulate", capsys=capsys)
    assert code == 130
    assert out.err == "mjchair: interrupted\n"


def test_the_module_is_the_command(there):
    done = subprocess.run(
        [sys.executable, "-m", "mjchair", "simulate", "--model", "none"],
        capture_output=True,
        text=True,
        env=os.environ,
    )
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1 and "Traceback" not in done.stderr
    assert done.stdout == ""


def test_set_reaches_the_chair(there, capsys):
    made = ("--set", "occupant_mass=82", "--set", "camber=3deg", "--duration", "0.1")
    assert run("simulate", *made, "--out", "run", capsys=capsys)[0] == 0
    recording = mjchair.load_recording(there / "run" / "recording.npz")
    assert recording.model.load().body("chair").mass == pytest.approx(92.0)
    assert abs(recording["left_wheel_tire.gamma"][-1]) == pytest.approx(np.radians(3.0), rel=0.02)


def test_models_lists_the_parameters_of_a_chair(capsys):
    from mjchair.model.parameters import NAMES

    code, out = run("models", "parameters", capsys=capsys)
    assert code == 0 and all(name in out.out for name in NAMES)


def test_a_chair_without_its_option_is_told_of_it(capsys):
    with pytest.raises(SystemExit):
        cli.main(["simulate", "manual"])
    assert "--model manual" in capsys.readouterr().err
