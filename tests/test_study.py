import numpy as np
import pytest

import mjchair
from mjchair.errors import MjchairError

TIME = np.arange(0.0, 3.0, 0.02)


def write(folder, columns, extra="", head='model = "manual"\n'):
    lines = [",".join(["time", *columns])]
    for k, t in enumerate(TIME):
        lines.append(",".join(f"{v}" for v in (t, *(c[k] for c in columns.values()))))
    (folder / "a.csv").write_text("\n".join(lines) + "\n")
    (folder / "study.toml").write_text(f'{head}[[trial]]\nfile = "a.csv"\n{extra}')
    return folder


def wheels(scale=1.0):
    speed = 3.0 - 0.3 * TIME
    return {"left_wheel_speed": scale * speed, "right_wheel_speed": speed}


def fails(folder, words):
    with pytest.raises(MjchairError, match=words) as error:
        mjchair.read_study(folder)
    assert "\n" not in str(error.value)


def test_a_good_study_is_read(tmp_path):
    study = mjchair.read_study(write(tmp_path, wheels()))
    assert study.channels == ("left_wheel_speed", "right_wheel_speed")


def test_missing_things_are_named(tmp_path):
    fails(tmp_path, "no study")
    write(tmp_path, wheels())
    (tmp_path / "a.csv").unlink()
    fails(tmp_path, "no file")
    (tmp_path / "study.toml").write_text('model = "manual"\n')
    fails(tmp_path, "no trial")


def test_degrees_are_recognised(tmp_path):
    fails(write(tmp_path, wheels(57.3)), "left_wheel_speed looks like degrees")


def test_g_is_recognised(tmp_path):
    columns = wheels() | {"imu_accelerometer.z": np.full(TIME.size, 1.0)}
    fails(write(tmp_path, columns), "imu_accelerometer.z looks like g")


def test_all_held_out_is_refused(tmp_path):
    fails(write(tmp_path, wheels(), "hold_out = true\n"), "every trial is held out")


def test_a_short_trial_is_refused(tmp_path):
    short = {"time": TIME[:20]} | {k: v[:20] for k, v in wheels().items()}
    lines = [
        "time,left_wheel_speed",
        *(f"{t},{v}" for t, v in zip(TIME[:20], short["left_wheel_speed"], strict=True)),
    ]
    (tmp_path / "a.csv").write_text("\n".join(lines) + "\n")
    (tmp_path / "study.toml").write_text('model = "manual"\n[[trial]]\nfile = "a.csv"\n')
    fails(tmp_path, "must last at least 1 s")


def test_a_dead_channel_is_left_out_and_said(tmp_path):
    columns = wheels() | {"imu_gyro.z": np.zeros(TIME.size)}
    study = mjchair.read_study(write(tmp_path, columns))
    assert "imu_gyro.z" not in study.channels
    assert any("imu_gyro.z is exactly zero" in note for note in study.notes)


def test_a_clock_that_jumps_is_refused(tmp_path):
    late = np.where(TIME > 1.5, TIME + 4.0, TIME)
    lines = ["time,left_wheel_speed", *(f"{t},{3.0}" for t in late)]
    (tmp_path / "a.csv").write_text("\n".join(lines) + "\n")
    (tmp_path / "study.toml").write_text('model = "manual"\n[[trial]]\nfile = "a.csv"\n')
    fails(tmp_path, "clock jumps")


def test_unknown_keys_are_named(tmp_path):
    fails(write(tmp_path, wheels(), "hold_ot = true\n"), "did you mean 'hold_out'")
