import mujoco
import numpy as np
import pytest

from mjchair.errors import MjchairError
from mjchair.measurement.trial import read_trial

XML = """
<mujoco>
  <worldbody><body name="b"><joint name="left_wheel"/><geom size="0.1"/><site name="imu"/></body>
  </worldbody>
  <actuator><motor name="left_wheel" joint="left_wheel"/></actuator>
  <sensor><jointvel name="left_wheel_speed" joint="left_wheel"/><gyro name="imu_gyro" site="imu"/>
  </sensor>
</mujoco>
"""


@pytest.fixture(scope="module")
def model():
    return mujoco.MjModel.from_xml_string(XML)


def write(path, text):
    path.write_text(text)
    return path


def test_channels_keep_their_own_rates(tmp_path, model):
    lines = ["time,left_wheel,left_wheel_speed,imu_gyro.z [deg/s],rider_motion"]
    for k in range(100):
        lines.append(f"{k * 0.01},{k},{k if k % 5 == 0 else ''},180,0.1")
    trial = read_trial(write(tmp_path / "coast_east.csv", "\n".join(lines)), model)
    assert trial.name == "coast_east"
    assert trial.rate("left_wheel_speed") == pytest.approx(20.0)
    assert trial.rate("imu_gyro.z") == pytest.approx(100.0)
    time, speed = trial.samples("left_wheel_speed")
    np.testing.assert_allclose(speed, 100 * time)
    assert trial.channels["imu_gyro.z"][0] == pytest.approx(np.pi)
    assert list(trial.inputs.controls) == ["left_wheel"]
    assert list(trial.other) == ["rider_motion"]


def test_a_coast_has_no_inputs(tmp_path, model):
    trial = read_trial(write(tmp_path / "a.csv", "time,left_wheel_speed\n0,1\n1,0.9\n"), model)
    assert trial.inputs is None


@pytest.mark.parametrize(
    ("header", "line"),
    [
        ("left_wheel_sped", "unknown channel 'left_wheel_sped'; did you mean 'left_wheel_speed'"),
        ("imu_gyro", "unknown channel 'imu_gyro'; did you mean 'imu_gyro"),
        ("left_wheel", "no column is a sensor"),
    ],
)
def test_bad_columns_get_one_line(tmp_path, model, header, line):
    path = write(tmp_path / "a.csv", f"time,{header}\n0,1\n1,1\n")
    with pytest.raises(MjchairError, match=line):
        read_trial(path, model)


def test_an_unknown_channel_of_a_trial_is_named(tmp_path, model):
    trial = read_trial(write(tmp_path / "a.csv", "time,left_wheel_speed\n0,1\n1,1\n"), model)
    with pytest.raises(MjchairError, match="no column 'speed'"):
        trial.samples("speed")
