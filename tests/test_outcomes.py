"""Outcomes against Kinetics Toolkit on the same file, and against pushes that are known."""

import sys

import numpy as np
import pytest

import mjchair
from mjchair.cli import main
from mjchair.errors import MjchairError, MjchairNote
from mjchair.measurement import samples
from mjchair.measurement.gather.gather import gather
from mjchair.measurement.outcomes import UNITS, Outcomes, Rim, of_recording, outcomes, read_rim

TOLERANCE = {"rtol": 1e-6, "atol": 1e-6}


@pytest.fixture(scope="module")
def toolkit():
    """Kinetics Toolkit, which looks for news over the network at import unless it cannot."""
    sys.modules.setdefault("requests_cache", None)
    import kineticstoolkit
    import kineticstoolkit_extensions.pushrimkinetics as push_rim

    return kineticstoolkit, push_rim


@pytest.fixture(scope="module")
def theirs(toolkit):
    ktk, push_rim = toolkit
    run = push_rim.read_smartwheel(str(samples.propulsion()))
    run = push_rim.remove_offsets(run, push_rim.read_smartwheel(str(samples.baseline())))
    run = push_rim.calculate_power(push_rim.calculate_velocity(run))
    run.data["Mz"] = run.data["Moments"][:, 2]
    run.data["Ftot"] = np.linalg.norm(run.data["Forces"][:, :3], axis=1)
    return ktk.cycles.detect_cycles(
        run,
        "Ftot",
        event_names=("push", "recovery"),
        thresholds=(5, 2),
        min_durations=(0.1, 0.1),
        min_peak_heights=(25, -np.inf),
    )


@pytest.fixture(scope="module")
def ours():
    return outcomes(read_rim(samples.propulsion(), samples.baseline()))


def test_every_outcome_is_kinetics_toolkits(theirs, ours):
    count = theirs.count_events("push")
    assert len(ours) == count == 8
    for i in range(count):
        push = theirs.get_ts_between_events("push", "recovery", i, i, inclusive=True)
        time, power = push.time, push.data["Power"]
        want = {
            "start": time[0],
            "push_time": time[-1] - time[0],
            "peak_moment": push.data["Mz"].max(),
            "mean_moment": push.data["Mz"].mean(),
            "peak_power": power.max(),
            "mean_power": power.mean(),
            "work": np.trapezoid(power, time),
            "contact_angle": np.degrees(np.ptp(push.data["Angle"][[0, -1]])),
        }
        ends = [e.time for e in theirs.events if e.name == "_"]
        if i < len(ends):
            whole = theirs.get_ts_between_times(time[0], ends[i], inclusive=True)
            speed = whole.data["Velocity"]
            want |= {
                "recovery_time": ends[i] - time[-1],
                "cadence": 60.0 / (ends[i] - time[0]),
                "mean_speed": speed.mean(),
                "speed_change": speed.max() - speed.min(),
            }
        for name, value in want.items():
            np.testing.assert_allclose(ours[name][i], value, **TOLERANCE, err_msg=name)


def test_angle_speed_and_moment_are_kinetics_toolkits(theirs):
    rim = read_rim(samples.propulsion(), samples.baseline())
    turned = theirs.data["Angle"] - theirs.data["Angle"][0]
    np.testing.assert_allclose(rim.angle, turned, **TOLERANCE)
    np.testing.assert_allclose(rim.speed, theirs.data["Velocity"], **TOLERANCE)
    np.testing.assert_allclose(rim.moment, theirs.data["Mz"], **TOLERANCE)


@pytest.fixture(scope="module")
def simulated():
    pushes = mjchair.push_strokes({"left_wheel": 12.0, "right_wheel": 12.0}, duration=3.0)
    return mjchair.simulate(mjchair.load_spec("manual"), pushes, initial={"speed": 0.8})


def test_a_rim_that_rings_as_it_is_let_go_makes_no_push_and_ends_none():
    """Of eight strokes of a sprint, each followed by a swing of 2 N m, two were counted."""
    time = np.arange(0.0, 8.0, 1.0 / 240.0)
    phase = time % 1.0
    moment = np.where(phase < 0.4, 30.0 * np.sin(np.pi * phase / 0.4), 0.0)
    let_go = (phase > 0.4) & (phase < 0.48)
    moment = np.where(let_go, 2.0 * np.sin(2.0 * np.pi * (phase - 0.4) / 0.04), moment)
    moment = np.where(time > 7.5, -8.0, moment)  # a hand that brakes
    angle, speed = 4.0 * time, np.full(time.size, 4.0)
    for way in (1.0, -1.0):
        rim = Rim(time, way * angle, way * speed, way * moment, None, "wheel")
        found = outcomes(rim)
        assert len(found) == 8 and found.smaller == 0
        assert found["push_time"] == pytest.approx(0.4, abs=0.05)


def test_a_simulated_run_has_the_outcomes_of_the_pushes_that_made_it(simulated):
    table = outcomes(of_recording(simulated))
    assert len(table) == 3
    assert table["cadence"][0] == pytest.approx(60 / 1.15, rel=0.01)
    assert table["peak_moment"] == pytest.approx(12.0, rel=0.01)
    # sin^2 of 12 N m over 0.46 s is above 1.35 and 0.54 N m for a known part of it
    begins, ends = (np.arcsin(np.sqrt(f * 0.27 / 12)) / np.pi for f in (5.0, 2.0))
    assert table["push_time"] == pytest.approx(0.46 * (1 - begins - ends), abs=0.011)
    # work is force along the path: what the chair gains and loses on the way, half a wheel
    rim = of_recording(simulated)
    want = np.trapezoid(rim.moment * rim.speed, rim.time)
    assert table["work"].sum() == pytest.approx(want, rel=0.02)


def test_a_table_of_a_study_has_the_outcomes_of_its_recording(simulated, tmp_path):
    from_run = outcomes(of_recording(simulated, "right_wheel"))
    simulated.to_csv(tmp_path / "run.csv")
    simulated.save(tmp_path / "run.npz")
    for file in ("run.csv", "run.npz"):
        table = outcomes(read_rim(tmp_path / file, wheel="right_wheel"))
        for name in UNITS:
            apart = 0.02 if name == "peak_speed_at" else 5e-3  # a table's speed is from its angle
            close = {"rtol": 5e-3, "atol": apart, "equal_nan": True, "err_msg": name}
            np.testing.assert_allclose(table[name], from_run[name], **close)


def test_the_command_prints_and_writes_a_row_a_stroke(tmp_path, capsys):
    out = tmp_path / "outcomes.csv"
    given = [str(samples.propulsion()), "--baseline", str(samples.baseline()), "--out", str(out)]
    assert main(["outcomes", *given]) == 0
    assert "8 strokes" in capsys.readouterr().out
    rows = out.read_text().splitlines()
    assert len(rows) == 9
    assert rows[0].startswith("push [1],start [s],push_time [s]")


def test_a_gathered_recording_has_the_outcomes_of_its_file(ours, tmp_path):
    """The force that cuts pushes comes along; a table without it says what it does not count."""
    (tmp_path / "push_left.csv").write_bytes(samples.propulsion().read_bytes())
    (tmp_path / "baseline.csv").write_bytes(samples.baseline().read_bytes())
    gathered = gather(tmp_path)
    for name, text in gathered.files.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    table = outcomes(read_rim(tmp_path / "push.csv"))
    for name in UNITS:
        apart = 0.02 if name == "peak_speed_at" else 2e-3  # cells have seven digits
        np.testing.assert_allclose(table[name], ours[name], rtol=2e-3, atol=apart, err_msg=name)
    assert "not counted" not in table.text()
    trial = mjchair.read_study(tmp_path).runs[0].trial
    assert not trial.other and set(trial.channels) == {"left_wheel_angle"}
    assert "left_wheel_force" not in gathered.noise

    trial = gathered.trials[0]
    rows = np.column_stack(
        [trial.time, 0.8 * trial.columns["left_wheel"], trial.columns["left_wheel_angle"]]
    )
    header = "time,left_wheel,left_wheel_angle"
    np.savetxt(tmp_path / "moment.csv", rows, "%.6f", ",", header=header, comments="")
    fewer = outcomes(read_rim(tmp_path / "moment.csv"))
    small = int(np.sum(0.8 * ours["peak_moment"] < 25.0 * 0.27))
    assert 0 < small < len(ours)
    assert (len(fewer), fewer.smaller) == (len(ours) - small, small)
    assert f"{small} smaller pushes are not counted, below 6.8 N m" in fewer.text()


def table_with(simulated, path, change):
    """The table of a run at `path`, after `change` of its rows (n, columns) by name -> column."""
    simulated.to_csv(path)
    header, *rows = (line.split(",") for line in path.read_text().splitlines())
    change(rows, {name: k for k, name in enumerate(header)})
    path.write_text("\n".join(",".join(row) for row in [header, *rows]) + "\n")
    return path


def test_strokes_in_which_the_wheel_is_not_seen_have_no_speed_and_the_others_stay(
    simulated, tmp_path
):
    whole = outcomes(of_recording(simulated))
    begin = whole["start"][1] + 0.15

    def change(rows, column):
        for row in rows:
            if begin < float(row[column["time"]]) < begin + 0.4:
                row[column["left_wheel_angle"]] = row[column["left_wheel_speed"]] = "-9999"

    path = table_with(simulated, tmp_path / "run.csv", change)
    with pytest.warns(MjchairNote, match="left_wheel_angle repeats -9999 from"):
        table = outcomes(read_rim(path))
    for name in ("mean_power", "work", "contact_angle", "mean_speed", "peak_speed_at"):
        assert np.isnan(table[name][1])
        assert table[name][0] == pytest.approx(whole[name][0], rel=5e-3, abs=0.02)
    np.testing.assert_allclose(table["peak_moment"], whole["peak_moment"], rtol=5e-3)


def test_large_numbers_stay_apart():
    columns = {name: np.array([-1.5e6, 2.5e7]) for name in UNITS}
    for line in Outcomes(columns, "wheel").text().splitlines()[2:]:
        assert line[22:].split() == ["11750000.000", "18738329.701", "-1500000.000", "25000000.000"]


def test_a_table_of_one_row_and_a_torque_in_n_mm_get_one_line(simulated, tmp_path, capsys):
    row = table_with(
        simulated, tmp_path / "row.csv", lambda rows, _: rows.__delitem__(slice(1, None))
    )

    def scale(rows, column):
        for row in rows:
            row[column["left_wheel"]] = str(1e3 * float(row[column["left_wheel"]]))

    milli = table_with(simulated, tmp_path / "milli.csv", scale)
    for path, line in ((row, "row.csv: 1 row of numbers"), (milli, "left_wheel looks like N mm")):
        assert main(["outcomes", str(path)]) == 2
        said = capsys.readouterr().err
        assert line in said.splitlines()[-1]
        assert "Warning" not in said


def test_the_folder_of_the_table_is_made_or_refused_before_the_work(tmp_path, capsys):
    out = tmp_path / "new" / "deep" / "outcomes.csv"
    assert main(["outcomes", str(samples.propulsion()), "--out", str(out)]) == 0
    assert out.is_file()
    capsys.readouterr()
    for command in (["outcomes", "nowhere.csv"], ["rider", "nowhere.c3d"]):
        assert main([*command, "--out", str(out / "more" / "x.csv")]) == 2
        assert f"{out} is a file, and must be a folder" in capsys.readouterr().err
    assert main(["gather", "nowhere", "--out", str(out / "study")]) == 2
    assert f"{out} is a file, and must be a folder" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["{baseline}"], "no push of 0.1 s that reaches 25 N"),
        (["nowhere.csv"], "cannot read nowhere.csv"),
        (["{folder}/README.md"], "no row of numbers"),
    ],
)
def test_bad_input_gets_one_line(arguments, line, capsys):
    places = {"baseline": samples.baseline(), "folder": samples.folder() / "smartwheel"}
    assert main(["outcomes", *(a.format(**places) for a in arguments)]) == 2
    said = capsys.readouterr().err
    assert line in said
    assert said.count("\n") == 1


def test_a_recording_without_the_wheel_says_so(simulated):
    with pytest.raises(MjchairError, match="lef_wheel was not driven; did you mean 'left_wheel'"):
        of_recording(simulated, "lef_wheel")
