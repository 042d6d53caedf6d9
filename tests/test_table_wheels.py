"""Wheels of one's own tables: angles that wrap, and wheels that count down."""

import lab_files as lab
import numpy as np
import pytest

from mjchair.cli import main
from mjchair.measurement.gather.gather import gather
from mjchair.measurement.outcomes import outcomes, read_rim
from mjchair.measurement.table_wheels import put_right

TURN = 2.0 * np.pi


@pytest.fixture(scope="module")
def run():
    """Clock (s), speed (rad/s), angle (rad) and torque (N m) of both wheels, 100 Hz."""
    time, wheels, torque = lab.motion(25.0)
    angle = np.cumsum(wheels, axis=0) * 1e-3
    return time[::10], wheels[::10], angle[::10], torque[::10]


def write(path, time, **columns):
    header = ",".join(["time", *columns])
    rows = np.column_stack([time, *columns.values()])
    np.savetxt(path, rows, "%.5f", ",", header=header, comments="")


def test_an_angle_that_wraps_is_counted_on_and_it_says_so(run, tmp_path):
    time, _, angle, torque = run
    for unit, turn in (("", TURN), (" [deg]", 360.0)):
        wrapped = {"left_wheel_angle" + unit: (angle[:, 0] * turn / TURN) % turn}
        write(tmp_path / "push.csv", time, **wrapped, left_wheel=torque[:, 0])
        found = gather(tmp_path)
        assert "push.csv: left_wheel_angle wraps once a turn; it is counted on" in found.notes
        (trial,) = found.trials
        np.testing.assert_allclose(
            trial.columns["left_wheel_angle"], angle[:, 0] - angle[0, 0], atol=1e-3
        )
        rim = read_rim(tmp_path / "push.csv")
        assert rim.angle[-1] == pytest.approx(angle[-1, 0], abs=0.01)
        assert rim.speed.min() > -0.2


def test_an_angle_across_a_gap_is_counted_on_by_the_speed_beside_it():
    time = np.arange(0.0, 10.0, 0.01)
    angle = 8.0 * time
    seen = np.where((time > 4.0) & (time < 5.5), np.nan, angle % TURN)
    out, _ = put_right(time, {"left_wheel_angle": seen}, "a.csv")
    there = np.isfinite(seen)
    np.testing.assert_allclose(out["left_wheel_angle"][there], angle[there], atol=1e-9)


@pytest.mark.parametrize(
    "angle",
    [
        lambda t: 3.0 * np.sin(0.5 * t),  # within a turn, to and fro
        lambda t: 0.3 * t - 3.1,  # a slow run of less than a turn
        lambda t: t + 2.0 * (t > 5.0),  # an encoder that jumps by a third of a turn
        lambda t: 2.0 * t,  # counted on already
    ],
)
def test_an_angle_that_does_not_wrap_is_left(angle):
    time = np.arange(0.0, 10.0, 0.01)
    for column in ("left_wheel_angle", "heading"):
        out, _ = put_right(time, {column: angle(time)}, "a.csv")
        np.testing.assert_array_equal(out[column], angle(time))


def test_a_heading_that_wraps_is_no_wheel():
    time = np.arange(0.0, 10.0, 0.01)
    heading = (time + np.pi) % TURN - np.pi
    out, said = put_right(time, {"heading": heading}, "a.csv")
    np.testing.assert_array_equal(out["heading"], heading)
    assert said == []


@pytest.mark.parametrize("motion, moment", [(-1, -1), (-1, 1), (1, -1)])
def test_a_wheel_that_counts_down_is_turned_and_it_says_so(run, tmp_path, motion, moment):
    time, speed, _, torque = run
    write(
        tmp_path / "push.csv",
        time,
        left_wheel_speed=motion * speed[:, 0],
        right_wheel_speed=speed[:, 1],
        left_wheel=moment * torque[:, 0],
        right_wheel=torque[:, 1],
    )
    found = gather(tmp_path)
    (trial,) = found.trials
    np.testing.assert_allclose(trial.columns["left_wheel_speed"], speed[:, 0], atol=1e-4)
    np.testing.assert_allclose(trial.columns["left_wheel"], torque[:, 0], atol=1e-4)
    (said,) = [line for line in found.notes if "turned so that forward is positive" in line]
    assert said.startswith("push.csv: left wheel")
    assert outcomes(read_rim(tmp_path / "push.csv")).mean("work") > 0.0


def test_the_outcomes_say_what_was_turned(run, tmp_path, capsys):
    time, speed, _, torque = run
    write(tmp_path / "a.csv", time, left_wheel_speed=speed[:, 0], left_wheel=-torque[:, 0])
    assert main(["outcomes", str(tmp_path / "a.csv")]) == 0
    assert "left wheel slows down where its torque drives it; turned" in capsys.readouterr().err


def test_a_chair_that_rolls_backwards_or_turns_on_the_spot_is_left_and_it_says_so(run):
    time, speed, _, torque = run
    short = time < 8.0
    for sides, line in (
        ((-1, -1), "rolls backwards on balance"),
        ((-1, 1), "turns against the other one, as on the spot; it is left as it is"),
    ):
        columns = {}
        for side, sign, k in zip(("left", "right"), sides, (0, 1), strict=True):
            columns[f"{side}_wheel_speed"] = sign * speed[short, k]
            columns[f"{side}_wheel"] = sign * torque[short, k]
        out, said = put_right(time[short], columns, "a.csv")
        for name, values in columns.items():
            np.testing.assert_array_equal(out[name], values)
        assert line in said[0]


def test_a_gyroscope_in_the_table_tells_a_spin_from_a_wheel_that_counts_down(run):
    time, speed, _, _ = run
    for seconds, sign in ((25.0, -1), (8.0, 1)):  # a long spin is left, a short way is turned
        some = time < seconds
        wheels = {"left_wheel_speed": -speed[some, 0], "right_wheel_speed": speed[some, 1]}
        turning = (speed[some, 0] + speed[some, 1]) * lab.RADIUS / lab.TRACK
        yaw = turning if sign < 0 else 0.01 * np.sin(time[some])
        out, said = put_right(time[some], {**wheels, "imu_gyro.z": yaw}, "a.csv")
        np.testing.assert_array_equal(out["left_wheel_speed"], sign * speed[some, 0])
        assert bool(said) == (sign > 0)


def test_signs_that_a_mapping_gives_are_believed(run):
    time, speed, _, torque = run
    columns = {"left_wheel_speed": speed[:, 0], "left_wheel": -torque[:, 0]}
    out, (said,) = put_right(time, columns, "a.csv", turn=False)
    np.testing.assert_array_equal(out["left_wheel"], columns["left_wheel"])
    assert "its mapping is believed, is a sign = -1 missing?" in said


def test_a_hand_that_brakes_all_the_way_is_no_wrong_sign():
    time = np.arange(0.0, 10.0, 0.01)
    brake = np.where(np.sin(3.0 * time) > 0.5, -8.0, 0.0)
    speed = 6.0 + np.cumsum(0.5 + 0.2 * brake) * 0.01
    columns = {"left_wheel_speed": speed, "left_wheel": brake}
    out, said = put_right(time, columns, "a.csv")
    np.testing.assert_array_equal(out["left_wheel"], brake)
    assert said == []
