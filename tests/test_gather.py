"""Files of a laboratory with a known motion into a study."""

from dataclasses import replace
from types import SimpleNamespace

import lab_files as lab
import numpy as np
import pytest

import mjchair
from mjchair.cli import main
from mjchair.diagnosis.data.study import without_estimated_torques
from mjchair.diagnosis.data.study_file import read_study
from mjchair.errors import MjchairError
from mjchair.measurement import samples
from mjchair.measurement.clocks import Signal, align, best_alignment
from mjchair.measurement.delimited import read_delimited
from mjchair.measurement.exports import matching, read_export, read_formats
from mjchair.measurement.gather import join, study_file
from mjchair.measurement.gather.coasts import coasts, pushes
from mjchair.measurement.gather.gather import gather, table_text
from mjchair.measurement.gather.join import GatheredTrial
from mjchair.measurement.gather.known import Known
from mjchair.measurement.gather.sources import find_sources
from mjchair.simulation.table import read_table

# the chair's axes in a sensor's: x, y, z as rows; it lies on its side and looks backwards
TILTED = np.array([[-0.5, 0.866, 0.0], [0.0, 0.0, -1.0], [-0.866, -0.5, 0.0]])


@pytest.fixture(scope="module")
def run():
    return lab.motion(30.0)


@pytest.fixture(scope="module")
def folder(run, tmp_path_factory):
    """Two push rims that start apart, one with decimal commas, and an NGIMU on the frame."""
    place = tmp_path_factory.mktemp("lab")
    lab.smartwheel(place / "push1_left.csv", run, "left")
    lab.smartwheel(place / "push1_right.csv", run, "right", start=0.21, semicolon=True)
    own, _, gyroscope, level = lab.frame_sensor(run, mounted=TILTED)
    lab.ngimu(place / "push1_imu" / "sensors.csv", own, gyroscope, level)
    return place


@pytest.fixture(scope="module")
def gathered(folder):
    return gather(folder, Known(rider_mass=77.0, chair_mass=15.0, floor="overground"))


def test_sides_signs_and_wraps_are_told_and_said(gathered):
    said = "\n".join(gathered.notes)
    assert "push1_left.csv: left wheel; counts down as it rolls forward, Mz > 0" in said
    assert "push1_right.csv: right wheel; counts up as it rolls forward, Mz < 0" in said
    assert "wraps at 4095" in said
    assert "the gyroscope confirms the sides" in said


def test_clocks_are_put_on_one_within_their_uncertainty(gathered):
    (trial,) = gathered.trials
    for name, true in (("push1_right.csv", 0.21), ("push1_imu/sensors.csv", 0.7)):
        found = trial.alignments[name]
        assert found.how == "shared motion"
        assert 0.0 < found.offset_std < 0.03
        assert abs(found.offset - true) < 3.0 * found.offset_std


def test_torque_speed_and_turning_are_those_of_the_chair(gathered, run):
    (trial,) = gathered.trials
    time, wheels, torque = run
    assert trial.begin == pytest.approx(0.21, abs=0.02)
    at = trial.time + trial.begin
    for side, column in (("left", 0), ("right", 1)):
        there = np.isfinite(trial.columns[f"{side}_wheel"])
        true = np.interp(at[there], time, torque[:, column])
        assert np.sqrt(np.mean((trial.columns[f"{side}_wheel"][there] - true) ** 2)) < 0.35
        there = np.isfinite(trial.columns[f"{side}_wheel_angle"])
        turned = np.cumsum(wheels[:, column]) * 1e-3
        true = np.interp(at[there], time, turned)
        off = trial.columns[f"{side}_wheel_angle"][there] - true
        assert np.std(off) < 0.05
    there = np.isfinite(trial.columns["imu_gyro.z"])
    yaw = np.interp(at[there], time, (wheels[:, 1] - wheels[:, 0]) * lab.RADIUS / lab.TRACK)
    assert np.std(trial.columns["imu_gyro.z"][there] - yaw) < 0.015
    pull = np.interp(at[there], time, np.gradient(wheels.mean(axis=1) * lab.RADIUS, time))
    assert np.std(trial.columns["imu_accelerometer.x"][there] - pull) < 0.15
    assert np.mean(trial.columns["imu_accelerometer.z"][there]) == pytest.approx(9.81, abs=0.03)


def test_noise_is_that_of_the_sensors(gathered):
    assert gathered.noise["imu_gyro.z"] == pytest.approx(0.005, rel=0.25)
    assert gathered.noise["imu_accelerometer.y"] == pytest.approx(0.05, rel=0.25)
    assert gathered.noise["left_wheel_angle"] == pytest.approx(2 * np.pi / 4096 / 12**0.5, rel=0.5)


def test_the_study_has_a_comment_at_every_line_and_can_be_read(gathered, tmp_path):
    for name, text in gathered.files.items():
        (tmp_path / name).write_text(text)
    lines = [line for line in gathered.files["study.toml"].splitlines() if "=" in line]
    assert len(lines) >= 10
    assert all("#" in line for line in lines)
    study = mjchair.read_study(tmp_path)
    assert study.runs[0].trial.inputs.controls.keys() == {"left_wheel", "right_wheel"}
    assert study.spec.compile().body_mass.sum() == pytest.approx(92.0, abs=0.01)


@pytest.mark.parametrize(("torque", "pushed"), [(0.0, False), (0.3, False), (8.0, True)])
def test_a_rim_that_nobody_pushes_is_no_hands_torque(torque, pushed):
    time = np.linspace(0.0, 2.0, 21)
    columns = {"left_wheel": np.r_[np.full(20, torque), np.nan]}
    assert join._is_pushed(time, columns) is pushed
    trial = GatheredTrial("run", time, columns, "push" if pushed else "coast")
    assert trial.driven
    said = "with a hand's torque" if pushed else "no torque: it rolls freely"
    assert said in "\n".join(study_file._trial(trial, held_out=False))


def test_what_cannot_be_known_is_asked_for_by_name(folder):
    found = gather(folder)
    asked = " ".join(found.asked)
    for flag in ("--rider-mass", "--chair-mass", "--floor"):
        assert flag in asked
    assert "--wheel-radius" not in asked  # the instrumented wheel was set to one
    text = found.files["study.toml"]
    assert "# occupant_mass = 75" in text
    assert "wheel_radius = 0.300" in text


def test_a_wheel_in_a_unit_of_something_else_is_refused(tmp_path):
    rows = "".join(f"{0.02 * k!r},{3.6 - 0.02 * k!r}\n" for k in range(100))
    (tmp_path / "coast.csv").write_text("time,left_wheel_speed [km/h]\n" + rows)
    with pytest.raises(MjchairError, match="left_wheel_speed is in km/h; it must be in rad/s"):
        gather(tmp_path)


def test_swapped_sides_are_seen_by_the_gyroscope(folder, tmp_path):
    (tmp_path / "push1_imu").mkdir()
    (tmp_path / "push1_imu" / "sensors.csv").write_bytes(
        (folder / "push1_imu" / "sensors.csv").read_bytes()
    )
    for one, other in (("left", "right"), ("right", "left")):
        content = (folder / f"push1_{one}.csv").read_bytes()
        (tmp_path / f"push1_{other}.csv").write_bytes(content)
    with pytest.raises(MjchairError, match="the sides of the wheels are swapped"):
        gather(tmp_path)


def test_files_of_two_motions_are_not_put_together(tmp_path, run):
    lab.smartwheel(tmp_path / "a_left.csv", run, "left")
    other = lab.motion(30.0, seed=11)
    own, _, gyroscope, level = lab.frame_sensor(other)
    lab.ngimu(tmp_path / "a_imu" / "sensors.csv", own, gyroscope, level)
    with pytest.raises(MjchairError, match=r"cannot be aligned: .* at .* s; give .* FILE=SECONDS"):
        gather(tmp_path)
    told = gather(tmp_path, offsets={"sensors.csv": 0.4}).trials[0]
    assert told.alignments["a_imu/sensors.csv"].how == "given"


def test_samples_of_two_clocks_stay_apart_in_the_table_of_a_long_trial(tmp_path):
    """20 minutes in, two instruments have samples 12 microseconds apart."""
    time = np.array([0.0, 1200.0, 1200.000012])
    speeds = {"left_wheel_speed": np.array([1.0, 0.1, np.nan]), "imu_gyro.z": np.array([0, 0, 1.0])}
    (tmp_path / "a.csv").write_text(table_text(GatheredTrial("a", time, speeds, "coast")))
    table = read_table(tmp_path / "a.csv")
    np.testing.assert_allclose(table.time, time, rtol=0.0, atol=1e-9)
    np.testing.assert_array_equal(table.columns["left_wheel_speed"], speeds["left_wheel_speed"])


def test_even_strokes_leave_the_lag_open():
    time = np.arange(0.0, 20.0, 0.01)
    stroke = np.sin(2 * np.pi * time)
    noise = np.random.default_rng(0).normal(size=(2, time.size)) * 0.3
    found = best_alignment(Signal(time, stroke + noise[0]), Signal(time, stroke + noise[1]))
    assert not found.clear
    with pytest.raises(MjchairError, match="cannot be aligned"):
        align(Signal(time, stroke + noise[0]), Signal(time, stroke + noise[1]))


@pytest.mark.parametrize("seed", range(6))
def test_a_run_of_ten_seconds_that_slows_down_is_aligned(seed):
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 10.0, 0.01)
    begins = 0.6 + np.cumsum(np.r_[0.0, 1.05 * (1.0 + 0.06 * rng.normal(size=6))])
    strengths = 1.0 + 0.06 * rng.normal(size=begins.size)
    pulls = [
        size * np.exp(-(((time - t) / 0.15) ** 2))
        for t, size in zip(begins, strengths, strict=True)
    ]
    speed = 2.5 + np.cumsum(np.sum(pulls, axis=0) - 0.35) * 0.01 * 3.0
    own = np.arange(0.0, 9.4, 0.01)
    one = speed + 0.01 * rng.normal(size=time.size)
    two = np.interp(own + 0.37, time, speed) + 0.01 * rng.normal(size=own.size)
    found = align(Signal(time, one), Signal(own, two))
    assert abs(found.offset - 0.37) < 4.0 * found.offset_std < 0.02


@pytest.mark.parametrize("drift", [0.0, 400e-6])
def test_drift_is_found_with_its_uncertainty(drift):
    rng = np.random.default_rng(4)
    time = np.arange(0.0, 80.0, 0.01)
    motion = np.convolve(rng.normal(size=time.size), np.hanning(60), "same")
    own = np.arange(0.0, 78.0, 0.013)
    seen = np.interp(own * (1 + drift) + 1.1, time, motion) + 0.5 * rng.normal(size=own.size)
    found = align(Signal(time, motion), Signal(own, seen))
    middle = found.offset + found.drift * 39.0
    assert abs(middle - 1.1 - drift * 39.0) < 0.01
    assert abs(found.drift - drift) < 4.0 * found.drift_std
    assert found.drift_std < 100e-6
    assert (found.drift != 0.0) == (drift != 0.0)


XSENS = "PacketCounter,SampleTimeFine,Acc_X,Acc_Y,Acc_Z,Gyr_X,Gyr_Y,Gyr_Z"
EXPORTS = {  # format -> lines before, header, counts a second, gyroscope first, units of both
    "ximu3": ((), "Timestamp (us)," + ",".join(
        f"{s} {a} ({u})" for s, u in (("Gyroscope", "deg/s"), ("Accelerometer", "g")) for a in "XYZ"
    ), 1e6, True, 180 / np.pi, 1 / 9.80665),
    "ximu": ((), "Packet number," + ",".join(
        f"{s} {a} ({u})" for s, u in (("Gyroscope", "deg/s"), ("Accelerometer", "g")) for a in "XYZ"
    ), 256.0, True, 180 / np.pi, 1 / 9.80665),
    "xsens_mt": (("// Start Time: Unknown",), XSENS, 1e4, False, 1.0, 1.0),
    "xsens_dot": (("DeviceTag:,wheel",), XSENS, 1e6, False, 180 / np.pi, 1.0),
}  # fmt: skip


@pytest.mark.parametrize("name", EXPORTS)
def test_mappings_of_known_instruments_come_along(name, tmp_path):
    before, header, ticks, gyroscope_first, gyro, acc = EXPORTS[name]
    rng = np.random.default_rng(5)
    time = np.arange(300) / 256.0
    turning, pull = rng.normal(size=(300, 3)), rng.normal(size=(300, 3))
    clock = np.round(
        (time * ticks + 4294967296 - 5000) % 4294967296 if "xsens" in name else time * ticks
    )
    vectors = [gyro * turning, acc * pull]
    columns = vectors if gyroscope_first else [np.arange(300), *vectors[::-1]]
    order = [clock, *columns] if gyroscope_first else [columns[0], clock, *columns[1:]]
    lab.write(tmp_path / "a.csv", header, np.column_stack(order), before)
    file = read_delimited(tmp_path / "a.csv")
    form = matching(file, read_formats())
    assert form.name == name
    read = read_export(file, form)
    np.testing.assert_allclose(read.time, time, atol=1e-4)
    np.testing.assert_allclose(read.gyroscope, turning, atol=1e-5)
    np.testing.assert_allclose(read.accelerometer, pull, atol=2e-5)


def xsens(path, run, before=(), *, rate=100.0, clock=False):
    """A text export of MT Manager, counted from 65500; SampleTimeFine: None, blank."""
    own, _, gyroscope, level = lab.frame_sensor(run, rate=rate)
    count = (np.arange(own.size) + 65500) % 65536
    rows = np.column_stack([count, level, gyroscope])
    header = XSENS if clock else XSENS.replace("SampleTimeFine,", "")
    lines = [",".join(f"{value:.8g}" for value in row) for row in rows]
    if clock:
        lines = [line.replace(",", ",,", 1) for line in lines]
    path.write_text("\n".join([*before, header, *lines]) + "\n")


def test_a_blank_clock_is_replaced_by_the_packet_counter(run, tmp_path):
    xsens(tmp_path / "a.csv", run, ["// Update Rate: 100.0Hz"], clock=True)
    file = read_delimited(tmp_path / "a.csv")
    form = matching(file, read_formats())
    assert form.name == "xsens_mtw"
    assert read_export(file, form).time[1000] == pytest.approx(10.0)


def test_a_blank_clock_without_another_is_refused(run, tmp_path):
    """A DOT's gyroscope is in deg/s: what reads a counter takes it in rad/s, and is no way out."""
    xsens(tmp_path / "a.csv", run, ["DeviceTag:,D422CD00"], clock=True)
    file = read_delimited(tmp_path / "a.csv")
    with pytest.raises(MjchairError, match="no cell of its time column 'SampleTimeFine' is filled"):
        read_export(file, matching(file, read_formats()))


def test_a_rate_is_read_from_the_first_lines_and_an_assumed_one_is_said(run, tmp_path):
    for before, rate, said in (
        (["// Update Rate: 60.0Hz"], 60.0, "a.csv: 60.0 Hz, as its first lines say"),
        ([], 100.0, "a.csv: it has no clock and tells no rate; 100 Hz is assumed, give yours with"),
    ):
        xsens(tmp_path / "a.csv", run, before, rate=rate)
        file = read_delimited(tmp_path / "a.csv")
        read = read_export(file, matching(file, read_formats()))
        assert read.time[60] == pytest.approx(60.0 / rate)
        assert read.notes[0].startswith(said)
        assert read.assumed == (None if before else rate)


def test_clocks_that_cannot_be_aligned_are_told_of_an_assumed_rate(run, tmp_path):
    lab.smartwheel(tmp_path / "push_left.csv", run, "left")
    xsens(tmp_path / "push_frame.csv", run, rate=60.0)
    with pytest.raises(
        MjchairError, match=r"cannot be aligned.*is read at 100 Hz, which is assumed"
    ):
        gather(tmp_path)
    xsens(tmp_path / "push_frame.csv", run, ["// Update Rate: 60.0Hz"], rate=60.0)
    assert len(gather(tmp_path).trials) == 1


def trials_of(folder, names):
    for name in names:
        (folder / name).write_text(XSENS + "\n0,0,0,0,9.8,0,0,0\n1,100,0,0,9.8,0,0,0\n")
    return {source.path.name: source.trial for source in find_sources(folder).sources}


@pytest.mark.parametrize(
    "tag", ["MT_0120034-001", "MT_012005D6-000_00B4C3A2", "D422CD00", "D422CD006044"]
)
def test_the_tag_of_a_sensor_is_no_part_of_the_trials_name(tag, tmp_path):
    names = [f"push1_{tag}.csv", f"push2_{tag}.csv", "push1_left_wheel.csv"]
    found = trials_of(tmp_path, names)
    assert found == dict(zip(names, ["push1", "push2", "push1"], strict=True))


def test_a_file_too_short_for_its_clock_to_be_told_is_named(run, tmp_path):
    lab.smartwheel(tmp_path / "day_left.csv", run, "left")
    own, _, gyroscope, level = lab.frame_sensor(run)
    lab.ngimu(tmp_path / "day_frame.csv", own[:100], gyroscope[:100], level[:100])
    with pytest.raises(MjchairError, match=r"^day_frame.csv: clocks need 3 s of common motion"):
        gather(tmp_path)


def test_a_tag_that_alone_tells_recordings_apart_is_kept(tmp_path):
    """Also a date of eight digits is no tag."""
    names = ["MT_0120034-001.csv", "day_MT_0120034-001.csv", "day_MT_0120034-002.csv"]
    found = trials_of(tmp_path, [*names, "a_20210302.csv", "a_20210303.csv"])
    assert len(set(found.values())) == 5


def test_a_pushed_run_of_a_frame_sensor_alone_is_no_coast(run, tmp_path):
    own, _, gyroscope, level = lab.frame_sensor(run)
    lab.ngimu(tmp_path / "day_frame.csv", own, gyroscope, level)
    with pytest.raises(MjchairError, match=r"'day': day_frame.csv shows .* pushes, and no file"):
        gather(tmp_path)
    own, _, gyroscope, level = lab.frame_sensor(lab.motion(12.0, pushed=False))
    lab.ngimu(tmp_path / "night_frame.csv", own, gyroscope, level)
    found = gather(tmp_path)
    (trial,) = found.trials
    assert trial.name == "night" and trial.manoeuvre == "coast"
    assert any(n.startswith("left out: trial 'day'") for n in found.notes)


def test_the_word_nan_stands_for_a_missing_sample_in_an_export(run, tmp_path):
    """Programs that write tables put NaN where a sample was lost."""
    own, _, gyroscope, level = lab.frame_sensor(lab.motion(12.0, pushed=False))
    path = tmp_path / "day_frame.csv"
    lab.ngimu(path, own, gyroscope, level)
    lines = path.read_text().splitlines()
    cells = lines[50].split(",")
    empty, nan = ([cells[0], *[word] * (len(cells) - 1)] for word in ("", "NaN"))
    seen = []
    for lost in (empty, nan):
        lines[50] = ",".join(lost)
        path.write_text("\n".join(lines) + "\n")
        (trial,) = gather(tmp_path).trials
        seen.append(trial.columns["imu_accelerometer.x"])
    np.testing.assert_array_equal(*seen)


def test_any_table_comes_in_by_a_mapping_of_ones_own(tmp_path, run):
    time, wheels, torque = run
    at = np.arange(0.0, 30.0, 0.02)
    left, right = (np.degrees(np.interp(at, time, w)) for w in wheels.T)
    moment = np.interp(at, time, torque[:, 0])
    rows = np.column_stack([at * 1000 + 5e5, left, -right, moment])
    lab.write(tmp_path / "trial.txt", "ms;omega L;omega R;M".replace(";", ","), rows)
    (tmp_path / "mine.toml").write_text(
        'kind = "table"\nhas = ["ms", "omega L"]\n'
        'time = { column = "ms", unit = "ms" }\n[columns]\n'
        'left_wheel_speed = { column = "omega L", unit = "deg/s" }\n'
        'right_wheel_speed = { column = "omega R", unit = "deg/s", sign = -1 }\n'
        'left_wheel = { column = "M", unit = "N m" }\n'
    )
    (trial,) = gather(tmp_path, mappings=[tmp_path / "mine.toml"]).trials
    np.testing.assert_allclose(trial.columns["right_wheel_speed"], np.radians(right), atol=1e-4)
    np.testing.assert_allclose(trial.columns["left_wheel"], moment, atol=1e-4)
    assert trial.time[0] == 0.0


def wheel_sensor(path, run, rate=200.0):
    """An x-IMU3 on the left wheel, its axle along -y: a wheel's turning and gravity that turns."""
    time, wheels, _ = run
    at = np.arange(0.0, time[-1], 1.0 / rate)
    speed = np.interp(at, time, wheels[:, 0])
    angle = np.cumsum(speed) / rate
    zero = np.zeros_like(at)
    level = np.column_stack([np.cos(angle), zero, np.sin(angle)])
    gyroscope = np.column_stack([zero, np.degrees(-speed), zero])
    header = EXPORTS["ximu3"][1]
    lab.write(path, header, np.column_stack([at * 1e6, gyroscope, level]))
    return at, speed


def test_without_torque_the_free_rolling_parts_are_used_and_it_says_so(tmp_path, run):
    wheel_sensor(tmp_path / "push_left_wheel.csv", run)
    found = gather(tmp_path)
    assert "no torque was measured, and it is pushed; its 1 free-rolling parts" in found.notes[-1]
    (trial,) = found.trials
    assert trial.manoeuvre == "coast"
    assert not trial.driven
    assert 6.0 < trial.time[-1] - trial.time[0] < 8.0  # the coast at the end lasts about 7 s
    assert 21.5 < trial.time[0] < 23.5


def test_without_torque_and_coasts_the_torque_is_estimated_and_it_says_so(tmp_path):
    run = lab.motion(20.0, coast=0.2)
    wheel_sensor(tmp_path / "push_left_wheel.csv", run)
    found = gather(tmp_path, Known(mass=92.0, wheel_radius=0.3))
    assert "the torque is estimated" in found.notes[-1]
    (trial,) = found.trials
    true = np.interp(trial.time, run[0], run[2].mean(axis=1))
    assert np.corrcoef(trial.columns["left_wheel"], true)[0, 1] > 0.95


def test_a_torque_made_from_the_motion_is_no_evidence(tmp_path):
    """Its diagnosis named camber and a payload of the sprint that the torque was made from."""
    files = tmp_path / "files"
    files.mkdir()
    wheel_sensor(files / "push_left_wheel.csv", lab.motion(20.0, coast=0.2))
    found = gather(files, Known(mass=92.0, wheel_radius=0.3))
    for name, text in found.files.items():
        (tmp_path / name).write_text(text)
    study = read_study(tmp_path)
    assert not study.torque_measured
    with pytest.raises(MjchairError, match="no other trial is left"):
        without_estimated_torques(study)
    (run,) = study.runs
    coast = replace(run, torque_estimated=False)
    left = without_estimated_torques(replace(study, runs=(coast, run)))
    assert left.runs == (coast,)
    assert "left out" in left.notes[-1]


def test_a_coast_is_a_coast_and_strokes_are_none(run):
    time, wheels, _ = run
    (only,) = coasts(time[::5], wheels[::5, 0])
    assert 21.5 < only[0] < 23.5
    assert only[1] > 29.0
    assert coasts(*_column(lab.motion(20.0, coast=0.2))) == []


def test_where_markers_were_lost_nothing_rolls_freely(run):
    """A straight line between the last sample and the next would be the evenest coast of all."""
    time, wheels, _ = run
    (only,) = coasts(time, wheels[:, 0])
    seen = (time < only[0] + 0.2) | (time > only[1] - 0.2)
    assert coasts(time[seen], wheels[seen, 0]) == []
    assert coasts(time[:1], wheels[:1, 0]) == []


def test_pushes_are_counted_either_way_and_a_few_samples_hold_none(run):
    time, wheels, _ = run
    pull = np.gradient(wheels.mean(axis=1) * lab.RADIUS, time)[::10]
    assert pushes(time[::10], pull + 0.5) == pushes(time[::10], -pull) > 10
    assert pushes(np.arange(3.0), np.array([0.0, 5.0, 0.0])) == 0


def _column(run):
    return run[0][::5], run[1][::5, 0]


def test_the_recording_that_ships_is_gathered_by_one_command(tmp_path, capsys):
    source = tmp_path / "mine"
    source.mkdir()
    for path in (samples.propulsion(), samples.baseline()):
        (source / path.name).write_bytes(path.read_bytes())
    out = tmp_path / "study"
    assert main(["gather", str(source), "--out", str(out), "--mass", "92"]) == 0
    said = capsys.readouterr()
    assert "N once a turn taken off by baseline baseline.csv" in (out / "gather.log").read_text()
    assert len(said.out.splitlines()) < 8
    assert f"next: mjchair diagnose {out}" in said.out
    assert "--floor" in said.err
    files = ["gather.log", "gathered.png", "propulsion.csv", "study.toml"]
    assert sorted(p.name for p in out.iterdir()) == files


def test_a_study_that_cannot_be_read_is_named_by_its_own_folder(tmp_path, capsys, monkeypatch):
    from mjchair.diagnosis.data import study_file

    def refuse(folder):
        raise MjchairError(f"{folder}/study.toml: not good")

    monkeypatch.setattr(study_file, "read_study", refuse)
    source, out = tmp_path / "mine", tmp_path / "study"
    source.mkdir()
    (source / "run.csv").write_bytes(samples.propulsion().read_bytes())
    assert main(["gather", str(source), "--out", str(out), "--mass", "92"]) == 2
    assert f"{out}/study.toml: not good" in capsys.readouterr().err


def test_force_takes_the_tables_of_an_earlier_gather_away_and_no_other_file(tmp_path):
    source, out = tmp_path / "mine", tmp_path / "study"
    source.mkdir()
    rolls = samples.propulsion().read_bytes()
    (source / "first.csv").write_bytes(rolls)
    command = ["gather", str(source), "--out", str(out), "--mass", "92", "--force"]
    assert main(command) == 0
    for name in ("mine.csv", "named.csv"):
        (out / name).write_text("time,left_wheel\n0,1\n")
    with (out / "study.toml").open("a") as study:
        study.write('[[trial]]\nfile = "named.csv"\n')
    (source / "first.csv").rename(source / "second.csv")
    assert main(command) == 0
    left = {path.name for path in out.glob("*.csv")}
    assert left == {"mine.csv", "named.csv", "second.csv"}


def test_a_study_inside_the_folder_of_the_files_is_no_raw_file_and_never_takes_its_place(
    tmp_path, capsys
):
    source = tmp_path / "mine"
    source.mkdir()
    raw = samples.propulsion().read_bytes()
    (source / "first.csv").write_bytes(raw)
    command = ["gather", str(source), "--mass", "92", "--force", "--out"]
    assert main([*command, str(source)]) == 2
    assert "is the folder of the files" in capsys.readouterr().err
    assert (source / "first.csv").read_bytes() == raw
    out = source / "study"
    made = []
    for _ in range(2):
        assert main([*command, str(out)]) == 0
        made.append({p.name: p.read_bytes() for p in out.iterdir() if p.suffix != ".png"})
    assert made[0] == made[1]


BAD = {
    "no folder": (["{empty}/none"], "no folder"),
    "nothing in it": (["{empty}"], "no file of a known kind"),
    "cut short": (["{cut}"], "is the file cut short"),
    "text inside": (["{text}"], "is not a number"),
    "only a baseline": (["{rest}"], "a recording of an untouched rim, and none of the rim in use"),
    "an untouched rim by its name": (["{rest}"], "take 'baseline' out of its name if it is one"),
    "one word for it": (["{bare}"], "take 'bare' out of its name if it is one"),
    "a run that is empty": (["{void}"], "; push_left.csv is not used: it is empty"),
    "one file as two sides": (["{sides}"], "a_right.csv holds the samples of a_left.csv again"),
    "heavy rider": (["{good}", "--rider-mass", "95", "--mass", "92"], "the rider weighs 95 kg"),
    "radius in mm": (["{good}", "--wheel-radius", "300"], "is it in mm?"),
    "light together": (
        ["{good}", "--mass", "18"],
        "less the 15 kg of the model's chair",
    ),
    "light rider": (["{good}", "--mass", "18", "--chair-mass", "15"], "leaves 3 kg for the rider"),
    "round brackets": (["{round}"], "a table has its units in [ ], as in 'time [ms]'"),
    "unknown floor": (["{good}", "--floor", "overgroud"], "did you mean 'overground'"),
    "no such file": (["{good}", "--offset", "imu.csv=3"], "--offset imu.csv: no such file"),
    "no offset": (["{good}", "--offset", "3"], "is not FILE=SECONDS"),
    "no mapping": (["{good}", "--mapping", "none.toml"], "cannot read none.toml"),
    "wrong plan": (["{plan}"], "unknown key 'sides' in a [[files]]; did you mean 'side'?"),
    "both left": (["{twice}"], "are both of the left wheel"),
    "one row": (["{row}"], "run.csv is not used: 1 row of numbers; a motion takes at least 3"),
    "torque in N mm": (["{milli}"], "run.csv: left_wheel looks like N mm: it reaches "),
}


def table_of(torque=12.0, code=None, header="time,left_wheel,left_wheel_speed"):
    """A table at 100 Hz of strokes (N m); with a code for missing samples of the wheel's speed."""
    time = np.arange(0.0, 8.0, 0.01)
    drive = torque * np.maximum(np.sin(2.0 * np.pi * time), 0.0)
    speed = 2.0 + 0.1 * time - 0.3 * np.cos(2.0 * np.pi * time)
    if code is not None:
        speed[300:340] = code
    rows = zip(time, drive, speed, strict=True)
    return "\n".join([header, *(f"{t:.2f},{d:.4f},{v:.5f}" for t, d, v in rows)]) + "\n"


def test_a_file_with_one_row_is_named_and_the_others_are_gathered(tmp_path):
    (tmp_path / "push_left.csv").write_bytes(samples.propulsion().read_bytes())
    (tmp_path / "run.csv").write_text("time,left_wheel,left_wheel_speed\n0,0.1,2\n")
    gathered = gather(tmp_path)
    assert [trial.name for trial in gathered.trials] == ["push"]
    assert "run.csv is not used: 1 row of numbers" in gathered.unused[0]
    assert gathered.unused[0] in gathered.files["gather.log"]


def test_a_recording_that_is_not_read_is_listed_and_a_picture_is_not(tmp_path):
    (tmp_path / "push1.csv").write_text(
        "time,left_wheel_speed\n"
        + "".join(f"{0.01 * k:.2f},{0.5 + 0.01 * k}\n" for k in range(200))
    )
    for name in ("kinetics.ktk.zip", "trial.mat", "photo.png"):
        (tmp_path / name).write_bytes(b"0")
    found = find_sources(tmp_path)
    assert [line.partition(" is not used: export it")[0] for line in found.unused] == [
        "kinetics.ktk.zip",
        "trial.mat",
    ]
    assert len(found.sources) == 1


def test_a_table_of_both_wheels_is_called_and_drawn_as_both(tmp_path):
    from mjchair.report.gathered import gathered_figure

    time = np.arange(0.0, 8.0, 0.01)
    drive = 12.0 * np.maximum(np.sin(2.0 * np.pi * time), 0.0)
    speed = 2.0 + 0.1 * time - 0.3 * np.cos(2.0 * np.pi * time)
    rows = np.column_stack([time, drive, drive, speed, 1.1 * speed])
    header = "time,left_wheel,right_wheel,left_wheel_speed,right_wheel_speed"
    np.savetxt(tmp_path / "run.csv", rows, "%.6g", ",", header=header, comments="")
    gathered = gather(tmp_path)
    assert gathered.summary[0].endswith("left and right table")
    lines = gathered_figure(gathered.trials).axes[0].get_lines()
    assert [line.get_label() for line in lines] == ["left wheel, run.csv", "right wheel, run.csv"]
    np.testing.assert_allclose(lines[1].get_ydata(), rows[:, 4], rtol=1e-5)
    assert lines[0].get_color() != lines[1].get_color()


def test_a_table_of_an_accelerometer_in_the_axes_of_the_chair_is_joined_and_drawn(tmp_path):
    """With samples that are missing; its own clock begins 1.5 s later."""
    from mjchair.report.gathered import gathered_figure

    rng = np.random.default_rng(3)
    time = np.arange(0.0, 15.0, 0.01)
    gains = np.interp(time, np.linspace(0.0, 15.0, 40), rng.normal(size=40))
    speed = 4.0 + np.cumsum(gains) * 0.01
    wheel = np.column_stack([time, speed])
    np.savetxt(tmp_path / "run_enc.csv", wheel, "%.6g", ",", header="time,left_wheel_speed",
               comments="")  # fmt: skip
    rows = [f"{t - 1.5:.2f},{0.3 * g:.4f}" for t, g in zip(time, gains, strict=True) if t >= 1.5]
    rows[200] = rows[200].split(",")[0] + ","
    (tmp_path / "run_imu.csv").write_text("\n".join(["time,imu_accelerometer.x", *rows]) + "\n")
    (trial,) = gather(tmp_path).trials
    (found,) = trial.alignments.values()
    assert found.offset == pytest.approx(1.5, abs=0.02)
    summed = gathered_figure([trial]).axes[0].get_lines()[-1]
    assert summed.get_label() == "run_imu.csv, acceleration summed"
    np.testing.assert_allclose(summed.get_ydata(), speed[150:][np.arange(1350) != 200], atol=0.2)


@pytest.mark.parametrize(("drive", "word"), [(0.0, "coast"), (6.0, "push")])
def test_a_torque_that_is_noise_makes_a_coast_no_push(drive, word, tmp_path):
    rng, time = np.random.default_rng(2), np.arange(0.0, 8.0, 0.01)
    hand = drive * np.maximum(np.sin(2.0 * np.pi * time), 0.0)
    speed = 4.0 - 0.1 * time - 0.02 * drive * np.cos(2.0 * np.pi * time)
    torque = [hand + 0.3 * rng.normal(size=time.size) for _ in range(2)]
    header = "time,left_wheel,right_wheel,left_wheel_speed,right_wheel_speed"
    rows = np.column_stack([time, *torque, speed, speed])
    np.savetxt(tmp_path / "run.csv", rows, "%.6g", ",", header=header, comments="")
    (trial,) = gather(tmp_path).trials
    assert trial.manoeuvre == word and trial.driven


def test_a_code_for_missing_samples_is_no_speed(tmp_path):
    (tmp_path / "run.csv").write_text(table_of(code=-9999.0))
    gathered = gather(tmp_path)
    speed = gathered.trials[0].columns["left_wheel_speed"]
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(speed)), np.arange(300, 340))
    said = [line for line in gathered.notes if "run.csv" in line]
    assert said == [
        "run.csv: left_wheel_speed repeats -9999 from 3.00 to 3.39 s and then jumps; left out there"
    ]


def propulsion_with(path, moment):
    """The SmartWheel excerpt at `path` with Mz (N m), column 24, as `moment` makes it."""
    rows = [line.split(",") for line in samples.propulsion().read_text().splitlines()]
    for row in rows:
        row[23] = f"{moment(float(row[23])):.2f}"
    path.write_text("\n".join(",".join(row) for row in rows) + "\n")
    return path


def test_a_moment_that_was_not_recorded_is_said_and_is_no_torque(tmp_path, capsys):
    path = propulsion_with(tmp_path / "push_left.csv", lambda moment: 0.0)
    gathered = gather(tmp_path)
    said = "\n".join(gathered.notes)
    assert "push_left.csv: Mz is 0.00 N m in every sample, while F" in said
    assert not gathered.trials[0].instruments[0].torque
    assert main(["outcomes", str(path)]) == 2
    assert "Mz is 0.00 N m in every sample" in capsys.readouterr().err


def test_a_channel_at_its_end_is_said_and_a_whole_one_is_not(tmp_path, capsys):
    propulsion_with(tmp_path / "push_left.csv", lambda moment: min(moment, 6.0))
    ends = [line for line in gather(tmp_path).notes if "sensor at its end" in line]
    values = read_delimited(samples.propulsion()).values[:, 23]
    share = 100.0 * np.mean(values >= 6.0)
    assert ends == [
        f"push_left.csv: Mz is 6.00 N m in {share:.0f} % of the samples and never "
        "beyond: a sensor at its end tells less than was there"
    ]
    assert main(["outcomes", str(tmp_path / "push_left.csv")]) == 0
    assert ends[0] in capsys.readouterr().err
    propulsion_with(tmp_path / "push_left.csv", lambda moment: moment)
    assert "sensor at its end" not in "\n".join(gather(tmp_path).notes)


def test_a_baseline_of_the_other_rim_is_listed(tmp_path):
    (tmp_path / "push_left.csv").write_bytes(samples.propulsion().read_bytes())
    rest = samples.baseline().read_bytes()
    (tmp_path / "baseline_right.csv").write_bytes(rest)
    gathered = gather(tmp_path)
    assert gathered.unused == (
        "baseline_right.csv is not used: it is of the right rim, and no recording of that rim in "
        "use is there",
    )
    assert gathered.unused[0] in gathered.files["gather.log"]
    (tmp_path / "baseline_right.csv").rename(tmp_path / "baseline_left.csv")
    assert not gather(tmp_path).unused


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("swl_push.csv", "'swl' in its name tells the side"),
        ("push.csv", "taken as left, say it in gather.toml"),
    ],
)
def test_a_side_that_no_plain_word_tells_is_said(name, said, tmp_path, capsys):
    (tmp_path / name).write_bytes(samples.propulsion().read_bytes())
    assert main(["gather", str(tmp_path), "--out", str(tmp_path / "study")]) == 0
    assert said in capsys.readouterr().out


@pytest.fixture(scope="module")
def bad_folders(tmp_path_factory):
    place = tmp_path_factory.mktemp("bad")
    lines = samples.propulsion().read_text().splitlines()[:1200]
    whole = "\n".join(lines) + "\n"
    content = {
        "empty/notes.txt": "no numbers here\n",
        "cut/run.csv": whole[:-60],
        "text/run.csv": "\n".join([*lines[:50], lines[50].replace("1", "x", 1), *lines[51:]]),
        "rest/baseline.csv": whole,
        "good/run.csv": whole,
        "plan/run.csv": whole,
        "plan/gather.toml": '[files."run.csv"]\nsides = "left"\n',
        "round/run.csv": "Time (ms),left_wheel_speed (rpm)\n0,0\n10,1\n20,2\n",
        "bare/bare_rim.csv": whole,
        "void/baseline.csv": whole,
        "void/push_left.csv": "",
        "sides/a_left.csv": whole,
        "sides/a_right.csv": whole,
        "row/run.csv": "time,left_wheel,left_wheel_speed\n0,0.1,2\n",
        "milli/run.csv": table_of(torque=12e3),
        "twice/a_left.csv": whole,
        "twice/left_a.csv": whole.replace("0.30", "0.31"),
    }
    for name, text in content.items():
        (place / name).parent.mkdir(exist_ok=True)
        (place / name).write_text(text)
    return {path.name: path for path in place.iterdir()}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_gets_one_line_and_nothing_is_written(case, bad_folders, tmp_path, capsys):
    arguments, line = BAD[case]
    out = tmp_path / "study"
    given = [a.format(**bad_folders) for a in arguments]
    assert main(["gather", *given, "--out", str(out)]) == 2
    said = capsys.readouterr().err
    assert line in said
    assert said.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_a_riders_motion_comes_on_to_the_clock_of_the_study(run, tmp_path):
    """Markers see the chair go, and so their clock is found; both riders can be read."""
    time, wheels, _ = run
    lab.smartwheel(tmp_path / "push1_left.csv", run, "left")
    own = np.arange(2.0, 27.0, 0.01)
    speed = np.interp(own, time, wheels[:, 0]) * lab.RADIUS
    sway = 0.04 * np.sin(2.0 * np.pi * 0.9 * own)
    bend = 0.15 * np.sin(2.0 * np.pi * 0.9 * own)
    rows = np.column_stack([own - 2.0, bend, sway, speed])
    header = "time,rider_trunk_flexion,rider_motion,chair_speed"
    np.savetxt(tmp_path / "push1_rider.csv", rows, "%.6g", ",", header=header, comments="")
    gathered = gather(tmp_path, Known(mass=92.0))
    (trial,) = gathered.trials
    found = trial.alignments["push1_rider.csv"]
    assert abs(found.offset - 2.0) < max(3.0 * found.offset_std, 0.02)
    there = np.isfinite(trial.columns["rider_motion"])
    at = trial.time[there] + trial.begin
    off = trial.columns["rider_motion"][there] - np.interp(at, own, sway)
    assert np.std(off) < 0.002
    assert 'rider = "rigid"' in gathered.files["study.toml"]
    assert "chair_speed" not in trial.columns
    for name, text in gathered.files.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    rigid = mjchair.read_study(tmp_path).runs[0].trial
    assert set(rigid.other) == {"rider_motion"}
    assert set(rigid.inputs.controls) == {"left_wheel", "right_wheel"}
    text = gathered.files["study.toml"].replace('rider = "rigid"', 'rider = "moving"')
    (tmp_path / "study.toml").write_text(text, encoding="utf-8")
    moving = mjchair.read_study(tmp_path).runs[0].trial
    assert set(moving.other) == set() and "rider_trunk_flexion" in moving.inputs.controls


def test_markers_alone_are_a_study_of_the_chairs_speed(tmp_path):
    """Nothing but a rider's table: pushes without torque, of which the free rolling is used."""
    time = np.arange(0.0, 12.0, 0.01)
    pushed = np.where(time < 5.0, 1.0 + 0.2 * time + 0.1 * np.sin(6.0 * time), np.nan)
    speed = np.where(time < 5.0, pushed, 1.9 - 0.09 * (time - 5.0))
    rows = np.column_stack([time, 0.03 * np.sin(6.0 * time), speed])
    header = "time,rider_motion,chair_speed"
    np.savetxt(tmp_path / "run_rider.csv", rows, "%.6g", ",", header=header, comments="")
    gathered = gather(tmp_path)
    assert all(trial.manoeuvre == "coast" for trial in gathered.trials)
    (trial,) = gathered.trials
    assert trial.time[0] > 4.6 and "velocity.x" in trial.columns
    assert any("free-rolling parts" in note for note in gathered.notes)


@pytest.mark.parametrize(
    ("floor", "said"),
    [
        (None, r"trial 'run': the markers of the chair in run_rider.csv stay within 0.02 m"),
        ("rollers", "on rollers the chair stays in place, and run_rider.csv does not tell how"),
    ],
)
def test_a_chair_that_rocks_in_place_is_no_push(floor, said, tmp_path):
    """On rollers: a rider's table alone, whose markers go to and fro with the strokes."""
    time = np.arange(0.0, 12.0, 0.01)
    rows = np.column_stack([time, 0.03 * np.sin(6.0 * time), 0.05 * np.sin(6.0 * time)])
    header = "time,rider_motion,chair_speed"
    np.savetxt(tmp_path / "run_rider.csv", rows, "%.6g", ",", header=header, comments="")
    with pytest.raises(MjchairError, match=said):
        gather(tmp_path, Known(floor=floor))
    rows[:, 2] += 0.5
    np.savetxt(tmp_path / "run_rider.csv", rows, "%.6g", ",", header=header, comments="")
    if floor is None:
        assert gather(tmp_path, Known(floor=floor)).trials


def test_a_marker_file_whose_chair_stands_cannot_be_put_on_a_clock(run, tmp_path):
    lab.smartwheel(tmp_path / "push1_left.csv", run, "left")
    own = np.arange(0.0, 20.0, 0.01)
    rng = np.random.default_rng(1)
    rows = np.column_stack([own, np.sin(own), 0.01 * rng.normal(size=own.size)])
    header = "time,rider_motion,chair_speed"
    np.savetxt(tmp_path / "push1_rider.csv", rows, "%.6g", ",", header=header, comments="")
    with pytest.raises(MjchairError, match=r"cannot be aligned: correlation .*--offset FILE="):
        gather(tmp_path, Known(mass=92.0))


def test_gravity_is_read_where_the_chair_stands_and_not_where_it_speeds_up():
    from mjchair.measurement import imu

    time = np.arange(0.0, 20.0, 0.01)
    gains = np.where(time < 2.0, 0.0, np.where(time % 1.0 < 0.3, 1.5, -0.4))
    tilt = np.radians(8.0)
    signal = np.column_stack(
        [
            gains * np.cos(tilt) + imu.GRAVITY * np.sin(tilt),
            np.zeros(time.size),
            imu.GRAVITY * np.cos(tilt) - gains * np.sin(tilt),
        ]
    )

    def leans(rest):
        speed = np.cumsum(gains) * 0.01
        sits = imu.mounting(time, signal, np.zeros_like(signal), (time, speed), rest)
        return abs(np.mean((signal @ sits.axes.T)[:, 0] - gains))

    assert leans(time < 2.0) < 1e-3
    assert leans(None) > 0.1  # by what the chair loses most of the time


@pytest.mark.parametrize("turns", [0.0, 0.8], ids=["straight", "slalom"])
def test_forward_is_told_in_a_straight_run_and_in_a_slalom(turns):
    """Where the frame shakes askew, sideways and forward alike, and much more than it speeds up."""
    from mjchair.measurement import imu

    rng = np.random.default_rng(8)
    time = np.arange(0.0, 20.0, 0.01)
    speed = 1.0 + 0.2 * np.sin(2.0 * time)
    yaw_rate = turns * np.sin(2.0 * time + 0.5)  # turns as it slows down
    gains, aside = np.gradient(speed, time), speed * yaw_rate
    shakes = 1.5 * rng.normal(size=time.size)
    askew = np.radians(37.0)
    c, s = np.cos(askew), np.sin(askew)
    x, y = gains + shakes, aside - shakes + 0.1 * rng.normal(size=time.size)
    signal = np.column_stack([c * x + s * y, c * y - s * x, np.full(time.size, imu.GRAVITY)])
    gyroscope = np.column_stack([np.zeros((time.size, 2)), yaw_rate])
    wheels = (time, speed / 0.3 + 0.01 * rng.normal(size=time.size))
    sits = imu.mounting(time, signal, gyroscope, wheels)
    assert sits.axes[0] == pytest.approx([c, -s, 0.0], abs=np.radians(12.0))
    assert np.degrees(np.arctan2(-sits.axes[0, 1], sits.axes[0, 0])) == pytest.approx(
        37.0, abs=3.0 if turns else 12.0
    )


def test_the_chair_rests_where_the_wheels_that_are_recorded_do():
    from mjchair.measurement.gather.join import _at_rest

    time = np.arange(0.0, 5.0, 0.1)

    def wheel(first, rolls):
        mine = time[time >= first]
        speed = np.where(mine < rolls, 0.0, 3.0)
        return SimpleNamespace(time=mine, speed=speed)

    late = _at_rest(time, [wheel(0.0, 1.0), wheel(2.3, 2.3)])
    assert late[:9].all() and not late[11:].any()
    assert not _at_rest(time, []).any()
