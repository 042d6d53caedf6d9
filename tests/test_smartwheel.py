import numpy as np
import pytest

from mjchair.errors import MjchairError
from mjchair.measurement import samples
from mjchair.measurement.baseline import (
    fit_baseline,
    free_baseline,
    still_baseline,
    without_baseline,
)
from mjchair.measurement.smartwheel import (
    as_trial,
    orientation,
    oriented,
    push_inputs,
    read_smartwheel,
)


@pytest.fixture(scope="module")
def pushing():
    return read_smartwheel(samples.propulsion())


@pytest.fixture(scope="module")
def baseline():
    return read_smartwheel(samples.baseline())


def rows(count=240, mz=0.0, offset=0.0, wave=0.0, ticks=20.0):
    out = np.zeros((count, 24))
    out[:, 0] = out[:, 1] = np.arange(count) + 1
    out[:, 2] = np.round(100 + ticks * np.arange(count))
    angle = out[:, 2] * 2 * np.pi / 4096
    out[:, 23] = mz + offset + wave * np.cos(angle)
    return out


def write(path, table):
    path.write_text("\n".join(",".join(f"{x:g}" for x in row) + "," for row in table) + "\n")
    return path


def test_the_encoder_gives_the_instruments_own_speed_at_its_radius(pushing):
    radius = (pushing.ground_speed @ pushing.speed) / (pushing.speed @ pushing.speed)
    assert radius == pytest.approx(0.298, abs=0.001)
    assert np.std(pushing.ground_speed - radius * pushing.speed) < 0.02


def test_clock_and_angle_start_at_zero(pushing):
    assert pushing.time[0] == 0.0
    assert pushing.time[-1] == pytest.approx(2879 / 240)
    assert pushing.angle[0] == 0.0
    assert pushing.angle[-1] > 20.0


def test_pushing_is_propulsive_and_the_baseline_is_not(pushing, baseline):
    clean = without_baseline(pushing, baseline)
    assert clean.torque.max() > 8.0
    assert np.trapezoid(clean.torque * clean.speed, clean.time) > 50.0  # J by the hand on the rim
    assert np.abs(without_baseline(baseline, baseline).torque.mean()) < 1e-9


def test_offset_and_wave_are_found_and_taken_off(tmp_path):
    bare = read_smartwheel(write(tmp_path / "b.csv", rows(480, 0.0, 0.3, 0.2)))
    run = read_smartwheel(write(tmp_path / "a.csv", rows(480, 5.0, 0.3, 0.2)))
    found = fit_baseline(bare)
    assert found.offset[5] == pytest.approx(0.3, abs=1e-5)
    assert found.cosine[5] == pytest.approx(0.2, abs=1e-5)
    np.testing.assert_allclose(without_baseline(run, bare).torque, 5.0, atol=1e-5)


def test_standing_at_the_start_gives_an_offset(tmp_path):
    table = rows(480, 0.0, 0.3, ticks=0.0)
    table[240:, 4] = 1.0
    run = read_smartwheel(write(tmp_path / "a.csv", table))
    assert still_baseline(run).offset[5] == pytest.approx(0.3, abs=1e-5)
    table[:, 4] = 1.0
    with pytest.raises(MjchairError, match="give a baseline recording"):
        still_baseline(read_smartwheel(write(tmp_path / "b.csv", table)))


def test_a_hand_that_pushes_before_the_wheel_rolls_is_no_offset(tmp_path):
    """A run of 2 s from rest had 0.75 N m of its push in its offset."""
    table = rows(480, 0.0, 0.3, ticks=0.0)
    table[72:192, 23] += np.minimum(0.3 * np.arange(120), 14.0)  # from 0.3 s on
    table[96:, 4] = 1.0  # the wheel rolls from 0.4 s on
    table[:, 23] += 0.05 * np.random.default_rng(2).standard_normal(480)
    run = read_smartwheel(write(tmp_path / "a.csv", table))
    assert still_baseline(run).offset[5] == pytest.approx(0.3, abs=0.05)


def test_speed_of_a_steady_wheel(tmp_path):
    run = read_smartwheel(write(tmp_path / "a.csv", rows(ticks=20.0)))
    np.testing.assert_allclose(run.speed, 20.0 * 240.0 * 2 * np.pi / 4096, rtol=1e-6)


def test_both_wheels_get_the_measured_torque(pushing):
    inputs = push_inputs(pushing)
    np.testing.assert_array_equal(inputs.controls["left_wheel"], pushing.torque)
    np.testing.assert_array_equal(inputs.controls["right_wheel"], pushing.torque)
    assert inputs.end == pushing.time[-1]


def test_a_file_with_semicolons_decimal_commas_a_header_and_a_column_more_is_the_same(tmp_path):
    plain = read_smartwheel(samples.propulsion())
    lines = samples.propulsion().read_text().splitlines()
    other = [line.rstrip(",").replace(",", ";").replace(".", ",") + ";0" for line in lines]
    names = ";".join(f"column {i}" for i in range(1, 26))
    path = tmp_path / "a.csv"
    path.write_text("\n".join(["SmartWheel export", names, *other]))
    read = read_smartwheel(path)
    np.testing.assert_array_equal(read.angle, plain.angle)
    np.testing.assert_array_equal(read.forces, plain.forces)


def wrapped(table, turn=4096):
    """The file of an encoder that starts again from 0 after every turn."""
    out = table.copy()
    out[:, 2] %= turn
    out[:, 3] = np.round(out[:, 2] / 4096 * 360, 2)
    return out


def test_an_encoder_that_wraps_is_counted_on(tmp_path):
    table = rows(1600, ticks=20.0)
    straight = read_smartwheel(write(tmp_path / "a.csv", table))
    read = read_smartwheel(write(tmp_path / "b.csv", wrapped(table)))
    np.testing.assert_allclose(read.angle, straight.angle, atol=2e-4)
    assert read.angle[-1] == pytest.approx(1599 * 20 / 4096 * 2 * np.pi, abs=1e-3)
    assert "wraps at 4095" in read.notes[0]
    by_degrees = wrapped(table)
    by_degrees[:, 2] = 0.0
    np.testing.assert_allclose(
        read_smartwheel(write(tmp_path / "c.csv", wrapped(table))).speed, straight.speed, atol=0.02
    )


def pushed(count=2400, down=False, negative=False):
    """Pushes of 10 N m twice a second on a wheel that rolls all the time."""
    table = rows(count, ticks=20.0)
    time = np.arange(count) / 240
    bell = np.clip(np.sin(2 * np.pi * 0.8 * time), 0.0, None)
    angle = table[:, 2] * 2 * np.pi / 4096
    table[:, 18] = 40 * bell + 2.0 + 6.0 * np.sin(angle)  # the rim's weight, once a turn
    table[:, 23] = (-1 if negative else 1) * 10 * bell + 0.3
    table[:, 4] = 1.0
    if down:
        table[:, 2] = 50000 - table[:, 2]
        table[:, 3] = np.round(table[:, 2] / 4096 * 360 % 360, 2)
    else:
        table[:, 3] = np.round(table[:, 2] / 4096 * 360 % 360, 2)
    return table, 10 * bell


@pytest.mark.parametrize(
    ("down", "negative", "side"),
    [(True, False, "left"), (False, True, "right"), (False, False, ""), (True, True, "")],
)
def test_signs_are_told_by_the_way_rolled_and_the_work_done(tmp_path, down, negative, side):
    table, push = pushed(down=down, negative=negative)
    read = read_smartwheel(write(tmp_path / "a.csv", table))
    signs = orientation(read)
    assert signs == (-1 if down else 1, -1 if negative else 1, side, True)
    clean = oriented(without_baseline(read))
    assert clean.angle[-1] == pytest.approx(2399 * 20 / 4096 * 2 * np.pi, abs=2e-3)
    assert (clean.speed > 0).all()
    np.testing.assert_allclose(clean.torque, push, atol=0.1)


def test_a_rolling_start_needs_no_baseline(tmp_path, pushing, baseline):
    table, _ = pushed()
    read = read_smartwheel(write(tmp_path / "a.csv", table))
    with pytest.raises(MjchairError, match="the wheel moves after 0 s"):
        still_baseline(read)
    rim = free_baseline(read)
    assert rim.offset[0] == pytest.approx(2.0, abs=0.1)
    assert np.hypot(rim.cosine[0], rim.sine[0]) == pytest.approx(6.0, abs=0.1)
    real = free_baseline(pushing)  # parts without a hand, against a recording without one
    rest = fit_baseline(baseline)
    np.testing.assert_allclose(real.offset[3:], rest.offset[3:], atol=0.05)
    np.testing.assert_allclose(real.offset[:3], rest.offset[:3], atol=0.6)
    np.testing.assert_allclose(real.sine[0], rest.sine[0], atol=0.5)


@pytest.mark.parametrize("stay", [True, False])
def test_jumps_once_a_turn_are_masked(tmp_path, stay):
    count, jump = 3000, 60
    true = 11.0 * np.arange(count) + 300 * np.sin(np.arange(count) / 200)
    turns = np.floor((true - 1000.0) / 4096)
    table = rows(count)
    if stay:  # 60 ticks more at every passage
        table[:, 2] = np.round(true + jump * turns)
    else:  # a reading 60 ticks off at the mark, right again after it
        table[:, 2] = np.round(true + jump * np.r_[0.0, np.diff(turns)])
    table[:, 3] = np.round(table[:, 2] / 4096 * 360 % 360, 2)
    read = read_smartwheel(write(tmp_path / "a.csv", table))
    angle = (true - true[0]) * 2 * np.pi / 4096
    np.testing.assert_allclose(read.angle, angle, atol=0.012)
    assert np.abs(read.speed - np.gradient(angle) * 240).max() < 0.35  # a jump alone gives 1.8
    assert "of every turn" in read.notes[0]
    assert "jumps by 5.2" in read.notes[0]  # deg: 60 of 4096 ticks
    passed = np.flatnonzero(np.diff(turns))
    assert not read.there[passed + 1].any()
    assert (~read.there).sum() < 4 * passed.size + 4
    there = np.isfinite(as_trial(read, "left", "a").channels["left_wheel_angle"])
    np.testing.assert_array_equal(there, read.there)


def test_the_shipped_recordings_have_no_jumps(pushing, baseline):
    assert pushing.there.all()
    assert baseline.there.all()


def test_licence_and_notice_lie_beside_the_data():
    for name in ("LICENSE.txt", "NOTICE.txt", "README.md"):
        assert (samples.folder() / "smartwheel" / name).is_file()


@pytest.mark.parametrize(
    ("change", "line"),
    [
        (lambda text: text.replace(",0,0,", ","), "row 1 has 1[0-9] columns"),
        (lambda text: text.replace("\n2,2,", "\n7,7,", 1), "goes from 1 to 7 in row 2"),
        (lambda text: text.replace("1,1,", "x,1,", 1), "row 1 has 'x' among its numbers"),
        (
            lambda text: text.replace("\n9,9,", "\nx,9,", 1),
            "row 9, column '1': 'x' is not a number",
        ),
        (lambda text: text.replace("1,1,", "nan,1,", 1), "row 1 has no finite number in column 1"),
        (lambda text: "\n".join(text.splitlines()[:5]), "5 samples; a speed needs at least"),
        (lambda text: text[: len(text) - 40], "row 240 has .* is the file cut short"),
        (
            lambda text: "\n".join([*text.splitlines()[:200], "battery low"]),
            "row 201 has 1 cells",
        ),
        (lambda text: "", "it is empty"),
    ],
)
def test_bad_files_get_one_line(tmp_path, change, line):
    path = write(tmp_path / "a.csv", rows())
    path.write_text(change(path.read_text()))
    with pytest.raises(MjchairError, match=line):
        read_smartwheel(path)
    with pytest.raises(MjchairError, match="no file"):
        read_smartwheel(tmp_path / "none.csv")
