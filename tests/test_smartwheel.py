import numpy as np
import pytest

from mjchair.errors import MjchairError
from mjchair.measurement import samples
from mjchair.measurement.smartwheel import (
    fit_baseline,
    push_inputs,
    read_smartwheel,
    still_baseline,
    without_baseline,
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


def test_speed_of_a_steady_wheel(tmp_path):
    run = read_smartwheel(write(tmp_path / "a.csv", rows(ticks=20.0)))
    np.testing.assert_allclose(run.speed, 20.0 * 240.0 * 2 * np.pi / 4096, rtol=1e-6)


def test_both_wheels_get_the_measured_torque(pushing):
    inputs = push_inputs(pushing)
    np.testing.assert_array_equal(inputs.controls["left_wheel"], pushing.torque)
    np.testing.assert_array_equal(inputs.controls["right_wheel"], pushing.torque)
    assert inputs.end == pushing.time[-1]


def test_licence_and_notice_lie_beside_the_data():
    for name in ("LICENSE.txt", "NOTICE.txt", "README.md"):
        assert (samples.folder() / "smartwheel" / name).is_file()


@pytest.mark.parametrize(
    ("change", "line"),
    [
        (lambda text: text.replace(",", ";"), "row 1 has 1 columns"),
        (lambda text: text.replace("\n2,2,", "\n7,7,", 1), "goes from 1 to 7 in row 2"),
        (lambda text: text.replace("1,1,", "x,1,", 1), "row 1 has a cell that is not a number"),
        (lambda text: text.replace("1,1,", "nan,1,", 1), "row 1 has a number that is not finite"),
        (lambda text: "\n".join(text.splitlines()[:5]), "5 samples; a speed needs at least"),
    ],
)
def test_bad_files_get_one_line(tmp_path, change, line):
    path = write(tmp_path / "a.csv", rows())
    path.write_text(change(path.read_text()))
    with pytest.raises(MjchairError, match=line):
        read_smartwheel(path)
    with pytest.raises(MjchairError, match="no file"):
        read_smartwheel(tmp_path / "none.csv")
