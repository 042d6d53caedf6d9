"""Studies that cannot be right: one line says what, exit code 2, and nothing is written."""

import re
from contextlib import nullcontext

import numpy as np
import pytest

from mjchair import cli
from mjchair.diagnosis.data import unit_checks
from mjchair.diagnosis.data.study_file import read_study
from mjchair.errors import MjchairError
from mjchair.model.rolling import RearAxle

TIME = np.round(np.arange(0.0, 4.0, 0.02), 6)
SIDES = ("left", "right")
EMPTY = np.full(TIME.size, np.nan)
HEAD = 'model = "manual"\n'
PUSH = 1.0 + np.sin(2.0 * np.pi * TIME)  # m/s, with strokes
PULL = 2.0 * np.pi * np.cos(2.0 * np.pi * TIME)  # m/s^2, that goes with it


def coast(speed=3.0, turn=0.0):
    """Wheel speeds (rad/s) of a chair that slows down, and turns (rad/s)."""
    rolls = speed - 0.1 * speed * TIME
    return {
        "left_wheel_speed": rolls - turn * 0.28 / 0.3,
        "right_wheel_speed": rolls + turn * 0.28 / 0.3,
    }


def table(columns, time=TIME):
    """The text of a table; NaN becomes an empty cell."""
    rows = [",".join(["time", *columns])]
    for k, t in enumerate(time):
        cells = (t, *(c[k] for c in columns.values()))
        rows.append(",".join("" if np.isnan(v) else repr(float(v)) for v in cells))
    return "\n".join(rows) + "\n"


def write(folder, columns, trial="", head=HEAD, time=TIME, file='"a.csv"', kind="[[trial]]"):
    """A study of one table."""
    folder.mkdir()
    (folder / "a.csv").write_text(table(columns, time))
    (folder / "study.toml").write_text(f"{head}{kind}\nfile = {file}\n{trial}")


def cut(values, first, last):
    """A column without its samples outside two times (s)."""
    return np.where((first <= TIME) & (last >= TIME), values, np.nan)


def hole(values, first, last):
    """A column without its samples between two times (s)."""
    return np.where((first < TIME) & (last > TIME), np.nan, values)


def drive(gains):
    """Torques (N m) that give a chair of 90 kg an acceleration (m/s^2) against a resistance."""
    return {f"{side}_wheel": 0.15 * (90.0 * gains + 12.0) for side in SIDES}


TORQUE = np.full(TIME.size, 4.0)
DRIVEN = coast() | {"left_wheel": TORQUE, "right_wheel": TORQUE}
# name -> what is written, and what the line says
CASES = {
    "missing table": ({"columns": coast(), "file": '"b.csv"'}, "no file .*b.csv; did you mean"),
    "too short": ({"columns": {"left_wheel_speed": np.ones(20)}, "time": TIME[:20]}, "one window"),
    "one sample": ({"columns": {"left_wheel_speed": np.ones(1)}, "time": TIME[:1]}, "lasts 0 s"),
    "no sample": ({"columns": {"left_wheel_speed": np.ones(0)}, "time": TIME[:0]}, "no samples"),
    "inputs begin late": (
        {"columns": DRIVEN | {"left_wheel": cut(TORQUE, 1.0, 9.0)}},
        "left_wheel is there from 1 to 3.98 s, and the run lasts from 0 to 3.98 s; write 0",
    ),
    "inputs end early": (
        {"columns": DRIVEN | {"right_wheel": cut(TORQUE, 0.0, 3.0)}},
        "right_wheel is there from 0 to 3 s",
    ),
    "inputs with a hole": (
        {"columns": DRIVEN | {"left_wheel": hole(TORQUE, 1.0, 2.0)}},
        "left_wheel is not there from 1 to 2 s",
    ),
    "every channel zero": ({"columns": coast(0.0)}, "every channel is zero throughout"),
    "a column without samples": (
        {"columns": coast() | {"imu_gyro.z": EMPTY}},
        "imu_gyro.z has no samples; leave the column out",
    ),
    "clock jumps": (
        {"columns": coast(), "time": np.where(TIME > 2.0, TIME + 5.0, TIME)},
        "the clock jumps from 2 to 7.02 s; cut the trial in two",
    ),
    "clock goes back": (
        {"columns": coast(), "time": np.where(TIME > 2.0, TIME - 1.0, TIME)},
        "time goes from 2 to 1.02 s in sample 102",
    ),
    "a time twice": (
        {"columns": coast(), "time": np.where(TIME == 2.0, 1.98, TIME)},
        "time goes from 1.98 to 1.98 s in sample 101",
    ),
    "a clock in ms": (
        {"columns": coast(), "time": 1000.0 * TIME},
        r"in steps of 20, which looks like milliseconds; name the column 'time \[ms\]'",
    ),
    "fewer samples than a window holds": (
        {"columns": {n: v[::25] for n, v in coast().items()}, "time": TIME[::25]},
        "a sample comes every 0.5 s; .* sample it faster",
    ),
    "a wheel in degrees": (
        {"columns": coast() | {"left_wheel_speed": coast()["left_wheel_speed"] * 57.3}},
        "left_wheel_speed looks like deg/s or rpm",
    ),
    "both wheels in degrees": (
        {"columns": {n: v * 57.3 for n, v in coast().items()}},
        "wheel_speed looks like deg/s or rpm: it reaches",
    ),
    "one slow wheel in degrees": (
        {"columns": coast(0.5) | {"left_wheel_speed": coast(0.5)["left_wheel_speed"] * 57.3}},
        "left_wheel_speed looks like degrees: it tells 57.3 times what right_wheel_speed does",
    ),
    "turns a minute under a header of deg/s, beside the angle": (
        {
            "columns": coast()
            | {
                "left_wheel_angle": np.cumsum(coast()["left_wheel_speed"]) * (TIME[1] - TIME[0]),
                "left_wheel_speed": coast()["left_wheel_speed"] / 6.0,
            }
        },
        r"left_wheel_speed looks like another unit: it tells 0.17 times what left_wheel_angle does",
    ),
    "turns a minute under a header of deg/s, beside places": (
        {
            "columns": {"left_wheel_speed": coast()["left_wheel_speed"] / 6.0}
            | {"position.x": 1.2 * TIME, "position.y": 0.0 * TIME}
        },
        r"left_wheel_speed looks like another unit: the wheels roll 0\.\d+ m by it, and the "
        r"chair gets 4\.\d m away; give rad/s, or the unit in its header, as in left_wheel_speed "
        r"\[rpm\]",
    ),
    "a velocity in km/h beside wheels": (
        {"columns": coast() | {"velocity.x": 3.5 * 0.3 * coast()["left_wheel_speed"]}},
        r"velocity.x looks like km/h: it tells 3.\d+ times .* as in velocity.x \[km/h\]",
    ),
    "a velocity in km/h beside nothing but torques": (
        {"columns": {"velocity.x": 3.6 * PUSH} | drive(PULL)},
        r"a: its torques and speeds go with a mass of 2\d kg, and the study gives \d+ kg: are the "
        r"speeds in km/h",
    ),
    "forces at the rim taken for torques": (
        {"columns": {"velocity.x": PUSH} | drive(PULL / 0.27)},
        r"go with a mass of 3\d\d kg, .* are the torques forces at the rim \(N\)",
    ),
    "the only channel in degrees": (
        {"columns": {"left_wheel_speed": coast()["left_wheel_speed"] * 57.3}},
        "left_wheel_speed looks like deg/s or rpm",
    ),
    "slow wheels in degrees beside an accelerometer": (
        {
            "columns": {
                "left_wheel_speed": 57.3 * 0.08 * PUSH / 0.3,
                "imu_accelerometer.x": 0.08 * PULL,
            }
        },
        "left_wheel_speed looks like degrees: its speed changes 5[78]",
    ),
    "a wheel's angle in degrees": (
        {"columns": {"left_wheel_angle": 57.3 * 3.0 * TIME}},
        "left_wheel_angle looks like degrees",
    ),
    "a gyroscope in degrees": (
        {"columns": coast(turn=0.5) | {"imu_gyro.z": np.full(TIME.size, 0.5 * 57.3)}},
        "imu_gyro.z looks like degrees",
    ),
    "a slow gyroscope in degrees": (
        {"columns": coast(turn=0.1) | {"imu_gyro.z": np.full(TIME.size, 0.1 * 57.3)}},
        "imu_gyro.z looks like degrees: it tells 57.3 times what the difference of the wheels",
    ),
    "a heading in degrees": (
        {"columns": coast() | {"heading": np.full(TIME.size, 90.0) + 0.1 * TIME}},
        "heading looks like degrees: it begins at 90",
    ),
    "a turning heading in degrees": (
        {"columns": coast(turn=0.1) | {"heading": 0.1 * TIME * 57.3}},
        "heading looks like degrees",
    ),
    "a first heading in degrees": (
        {"columns": coast(), "trial": "[trial.initial]\nheading = 90\n"},
        "the initial heading looks like degrees: it is 90, .* give 1.571",
    ),
    "gravity in g": (
        {"columns": coast() | {"imu_accelerometer.z": np.full(TIME.size, 1.01)}},
        r"imu_accelerometer.z looks like g: it stays near 1.01, .* imu_accelerometer.z \[g\]",
    ),
    "gravity taken off": (
        {"columns": coast() | {"imu_accelerometer.z": 0.1 * np.sin(TIME)}},
        "imu_accelerometer.z looks as if gravity was taken off",
    ),
    "acceleration in g": (
        {
            "columns": {
                "left_wheel_speed": PUSH / 0.3,
                "imu_accelerometer.x": PULL / 9.81,
            }
        },
        "imu_accelerometer.x looks like g: the wheels gain 9.. times",
    ),
    "acceleration of gentle strokes in g": (
        {
            "columns": {
                "left_wheel_speed": (1.0 + 0.05 * PUSH) / 0.3,
                "imu_accelerometer.x": 0.05 * PULL / 9.81,
            }
        },
        "imu_accelerometer.x looks like g: the wheels gain 9.. times",
    ),
    "acceleration of the other sign": (
        {"columns": {"left_wheel_speed": PUSH / 0.3, "imu_accelerometer.x": -PULL}},
        "imu_accelerometer.x falls where left_wheel_speed rises: x is forward, so turn its sign",
    ),
    "another axis of the accelerometer": (
        {"columns": coast() | {"imu_accelerometer.x": 9.81 + 0.1 * PULL}},
        "imu_accelerometer.x stays near 9.8., as the axis does that points up",
    ),
    "a wheel in m/s beside an accelerometer": (
        {"columns": {"left_wheel_speed": PUSH, "imu_accelerometer.x": PULL}},
        "left_wheel_speed looks like m/s: .* divide it by the wheel's radius, 0.3 m",
    ),
    "wheels in m/s beside a gyroscope": (
        {
            "columns": {n: 0.3 * v for n, v in coast(turn=0.5).items()}
            | {"imu_gyro.z": np.full(TIME.size, 0.5)}
        },
        "left_wheel_speed looks like m/s: the wheels tell 0.3. times what imu_gyro.z does",
    ),
    "places in mm": (
        {"columns": {"position.x": 1200.0 * TIME, "position.y": 0.01 * TIME}},
        r"position.x looks like mm or cm: it moves by 1.2e\+03 a second, .* position.x \[mm\]",
    ),
    "angles in turns beside places": (
        {
            "columns": {
                "left_wheel_angle": 1.2 * TIME / 0.3 / (2.0 * np.pi),
                "position.x": 1.2 * TIME,
                "position.y": 0.0 * TIME + 0.1,
            }
        },
        r"left_wheel_angle looks like turns: .* left_wheel_angle \[rev\]",
    ),
    "torques of left and right swapped": (
        {
            "columns": coast()
            | {
                "imu_gyro.z": 0.5 * np.sin(2.0 * TIME),
                "left_wheel": 5.0 * np.sin(2.0 * TIME) + 8.0 * np.cos(2.0 * TIME),
                "right_wheel": -5.0 * np.sin(2.0 * TIME) - 8.0 * np.cos(2.0 * TIME),
            }
        },
        "the torques turn the chair right where imu_gyro.z turns left; are .* swapped, or of",
    ),
    "torque in N mm": (
        {"columns": DRIVEN | {"left_wheel": 1000.0 * TORQUE}},
        r"left_wheel looks like N mm: it reaches 4000, .* left_wheel \[N mm\]",
    ),
    "all held out": ({"columns": coast(), "trial": "hold_out = true\n"}, "every trial is held out"),
    "the same trial twice": (
        {"columns": coast(), "trial": '[[trial]]\nfile = "a.csv"\n'},
        "trial a holds the samples of a again",
    ),
    "a word for hold_out": ({"columns": coast(), "trial": 'hold_out = "no"\n'}, "true or false"),
    "a word for a heading": (
        {"columns": coast(), "trial": '[trial.initial]\nheading = "east"\n'},
        "initial heading is 'east'; it must be a number",
    ),
    "a number for the file": ({"columns": coast(), "file": "3"}, "file is 3; it must be text"),
    "no file in the list": ({"columns": coast(), "file": "[]"}, "has no file; name its table"),
    "a number in the list": ({"columns": coast(), "file": '["a.csv", 3]'}, "it must be text"),
    "a missing table in the list": (
        {"columns": coast(), "file": '["a.csv", "b.csv"]'},
        "no file .*b.csv; did you mean 'a.csv'",
    ),
    "one table twice in the list": (
        {"columns": coast(), "file": '["a.csv", "a.csv"]'},
        "column 'left_wheel_speed' is in .*a.csv and in .*a.csv; leave it out of one",
    ),
    "a SmartWheel beside a table": (
        {"columns": coast(), "file": '["a.csv", "a.csv"]', "trial": 'smartwheel = "left"\n'},
        "smartwheel goes with one file",
    ),
    "no file": ({"columns": coast(), "file": '""'}, "has no file"),
    "one [trial]": (
        {"columns": coast(), "kind": "[trial]"},
        r"trial is {'file': 'a.csv'}; it must be \[\[trial\]\]",
    ),
    "a trial that is a word": (
        {"columns": coast(), "head": "", "kind": 'trial = ["a.csv"]\n[noise]', "file": "1.0"},
        "a trial is 'a.csv'; it must be a ",
    ),
    "a number for the noise": ({"columns": coast(), "head": HEAD + "noise = 3\n"}, "a table"),
    "no noise at all": (
        {"columns": coast(), "head": HEAD + '[noise]\n"left_wheel_speed" = 0\n'},
        "noise of left_wheel_speed is 0; it must be positive",
    ),
    "noise of no channel": (
        {"columns": coast(), "head": HEAD + "[noise]\nleft_wheel_sped = 0.1\n"},
        "'left_wheel_sped', which is no channel; did you mean 'left_wheel_speed'",
    ),
    "a nuisance in percent": (
        {"columns": coast(), "head": HEAD + "[nuisance]\nmass = 30\n"},
        "mass is 30; it is a standard deviation as a share",
    ),
    "a first speed that is not seen": (
        {"columns": coast(), "trial": "[trial.initial]\nspeed = 36\n"},
        "its initial speed is 36 m/s, and by left_wheel_speed it starts at 0.8",
    ),
    "torques of the other sign": (
        {
            "columns": {f"{s}_wheel_speed": PUSH / 0.3 for s in SIDES}
            | {f"{s}_wheel": -8.0 - PULL for s in SIDES}
        },
        "it gains speed the more they brake: positive torque drives forward",
    ),
    "an unknown nuisance": (
        {"columns": coast(), "head": HEAD + "[nuisance]\nmas = 0.1\n"},
        "unknown nuisance 'mas'; did you mean 'mass'",
    ),
    "a word for the grade": (
        {"columns": coast(), "head": HEAD + 'scene = "ramp"\ngrade = "steep"\n'},
        "grade is 'steep'; it must be a rise over run",
    ),
    "an unknown scene": (
        {"columns": coast(), "head": HEAD + 'scene = "flatt"\n'},
        "did you mean 'flat'",
    ),
    "another instrument": (
        {"columns": coast(), "trial": 'smartwheel = "left"\n'},
        "a SmartWheel file has 24",
    ),
    "a baseline of nothing": (
        {"columns": coast(), "trial": 'baseline = "a.csv"\n'},
        "baseline goes with smartwheel",
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_bad_studies_are_one_line_and_nothing_is_written(case, tmp_path, capsys):
    written, words = CASES[case]
    write(tmp_path / "study", **written)
    assert cli.main(["diagnose", str(tmp_path / "study"), "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert said.startswith("mjchair: ") and said.count("\n") == 1, said
    assert "Error" not in said and re.search(words, said), said
    assert not (tmp_path / "out").exists()


def pivot(radius):
    """A turn about the left wheel, seen by a marker at this distance (m) from it."""
    return {
        "left_wheel_speed": 0.001 * TIME,
        "position.x": radius * np.sin(TIME),
        "position.y": -radius * np.cos(TIME),
    }


@pytest.mark.parametrize(
    "columns",
    [
        pivot(0.28),
        pivot(0.9),
        # a wheel's sensor that was lost after a second
        {"left_wheel_speed": cut(np.full(TIME.size, 4.0), 0.0, 1.0), "position.x": 1.2 * TIME}
        | {"position.y": 0.0 * TIME},
        # on rollers
        {"left_wheel_speed": 4.0 + TIME, "position.x": 0.001 * TIME, "position.y": 0.0 * TIME},
        # places that were measured for a moment
        {"left_wheel_speed": 4.0 + TIME, "position.x": cut(TIME, 0.0, 0.04)}
        | {"position.y": cut(TIME, 0.0, 0.04)},
    ],
)
def test_wheels_may_tell_other_ways_than_the_places(columns, tmp_path):
    write(tmp_path / "study", columns)
    (run,) = read_study(tmp_path / "study").runs
    unit_checks.check(run.trial, RearAxle(left=0.3, right=0.3, track=0.56))


@pytest.mark.parametrize(("more", "refused"), [(0.05, False), (0.5, True)])
def test_a_centre_of_mass_aside_is_no_torque_of_the_other_sign(more, refused, tmp_path):
    """A straight push turns such a chair, whichever rim is pushed a little harder."""
    push = 6.0 * np.sin(2.0 * TIME)
    columns = coast() | {
        "imu_gyro.z": -0.25 * np.cos(2.0 * TIME),  # left while both push
        "left_wheel": (1.0 + more) * push,
        "right_wheel": (1.0 - more) * push,
    }
    write(tmp_path / "study", columns)
    with pytest.raises(MjchairError, match="swapped") if refused else nullcontext():
        read_study(tmp_path / "study")


@pytest.mark.parametrize("sides", [("left", "right"), ("left",), ("right",)])
def test_a_slalom_at_an_even_speed_says_nothing_of_an_accelerometer(sides, tmp_path):
    """What an accelerometer ahead of the axle feels went against the left wheel: was refused."""
    swing, away = np.sin(2.0 * np.pi * TIME), {"left": -1.0, "right": 1.0}
    columns = {f"{s}_wheel_speed": (1.0 + 0.2 * away[s] * swing) / 0.3 for s in sides}
    columns |= {"imu_gyro.z": 0.4 / 0.56 * swing}
    for sign in (-1.0, 1.0):
        felt = {"imu_accelerometer.x": sign * 0.12 * np.cos(2.0 * np.pi * TIME)}
        write(tmp_path / f"study{sign:g}", columns | felt)
        read_study(tmp_path / f"study{sign:g}")


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        (
            {side: 2.0 + 0.4 * TIME for side in SIDES},
            "it gains 0.4[0-9] m/s and no torque is given",
        ),
        ({side: 3.0 - 0.4 * TIME for side in SIDES}, None),
        ({side: -3.0 + 0.4 * TIME for side in SIDES}, "rolls backward all along, by 2.[5-7] m"),
        ({side: -1.0 + 0.4 * TIME for side in SIDES}, None),  # to and fro
    ],
)
def test_a_run_that_nothing_drives_or_that_rolls_back_is_noted(columns, said, tmp_path):
    """Somebody pushed gently (0.12 m/s^2), or both signs are turned."""
    write(tmp_path / "study", {f"{side}_wheel_speed": rolls for side, rolls in columns.items()})
    notes = [n for n in read_study(tmp_path / "study").notes if "gains" in n or "backward" in n]
    assert len(notes) == (said is not None)
    assert said is None or re.search(said, notes[0])


def test_torques_of_a_rim_that_nobody_holds_give_no_speed(tmp_path):
    rolls = {f"{side}_wheel_speed": 2.0 + 0.4 * TIME for side in SIDES}
    for size, noted in ((0.3, True), (4.0, False)):
        held = {f"{side}_wheel": np.full(TIME.size, size) for side in SIDES}
        write(tmp_path / f"{size}", rolls | held, head=HEAD + 'torque = "measured"\n')
        notes = read_study(tmp_path / f"{size}").notes
        assert any("no torque is given" in n for n in notes) == noted
