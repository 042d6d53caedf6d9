import mujoco
import numpy as np
import pytest

from mjchair.errors import MjchairError
from mjchair.measurement.trial import read_trial
from mjchair.simulation.table import read_table

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


def parts(folder, **texts):
    """Tables of one trial: name -> text."""
    return [write(folder / f"{name}.csv", text) for name, text in texts.items()]


def test_files_of_one_trial_share_a_clock_and_keep_their_rates_and_units(tmp_path, model):
    wheel = "".join(f"{0.01 * k!r},{57.3 * k}\n" for k in range(100))
    gyro = "".join(f"{20 * k + 3},{k}\n" for k in range(50))  # 3 ms later, half as often
    torque = "".join(f"{0.02 * k!r},{k}\n" for k in range(50))  # where the wheel has a sample too
    paths = parts(
        tmp_path,
        wheel="time,left_wheel_speed [deg/s]\n" + wheel,
        gyro="time [ms],imu_gyro.z\n" + gyro,
        torque="time,left_wheel\n" + torque,
    )
    trial = read_trial(paths, model)
    assert trial.name == "wheel+gyro+torque"
    assert trial.time.size == 150  # those of the torque are there already
    time, speed = trial.samples("left_wheel_speed")
    assert (time == 0.01 * np.arange(100)).all()
    np.testing.assert_allclose(speed, np.arange(100), rtol=1e-4)
    time, turn = trial.samples("imu_gyro.z")
    np.testing.assert_allclose(time, 0.02 * np.arange(50) + 0.003)
    assert (turn == np.arange(50)).all()
    assert (trial.inputs.time == 0.02 * np.arange(50)).all()  # its own: no sample is missing
    assert (trial.inputs.controls["left_wheel"] == np.arange(50)).all()
    assert trial.inputs.at("left_wheel", 0.03) == pytest.approx(1.5)


@pytest.mark.parametrize(
    ("column", "line"),
    [
        (
            "left_wheel_speed [km/h]",
            "left_wheel_speed is in km/h; it must be in rad/s or deg/s or rpm; divide what its rim "
            "rolls by the wheel's radius",
        ),
        ("imu_gyro.z [m/s^2]", "imu_gyro.z is in m/s^2; it must be in rad/s or deg/s or rpm"),
        (
            "left_wheel [deg/s]",
            "left_wheel is in deg/s; it must be in N m or Nm or N cm or Ncm or N mm or Nmm",
        ),
        ("rider_motion [deg]", "rider_motion is in deg; it must be in m or mm or cm or in"),
    ],
)
def test_a_unit_of_something_else_is_refused(column, line, tmp_path, model):
    path = write(tmp_path / "a.csv", f"time,imu_gyro.x,{column}\n0,1,1\n1,1,1\n")
    with pytest.raises(MjchairError) as error:
        read_trial(path, model)
    assert line in str(error.value)


def test_the_time_of_a_table_is_a_time(tmp_path):
    with pytest.raises(MjchairError, match="time is in deg; it must be in s or ms"):
        read_table(write(tmp_path / "a.csv", "time [deg],x\n0,1\n1,1\n"))


def test_inputs_of_two_files_are_each_straight_between_their_own_samples(tmp_path, model):
    both = XML.replace("</actuator>", '<motor name="right_wheel" joint="left_wheel"/></actuator>')
    model = mujoco.MjModel.from_xml_string(both)
    paths = parts(
        tmp_path,
        left="time,left_wheel,left_wheel_speed\n0,0,1\n1,10,1\n2,0,1\n",
        right="time,right_wheel\n0.5,5\n1.5,0\n2.5,5\n",
    )
    inputs = read_trial(paths, model).inputs
    assert inputs.at("left_wheel", [0.5, 1.5]) == pytest.approx([5.0, 5.0])
    assert inputs.at("right_wheel", [1.0, 2.0]) == pytest.approx([2.5, 2.5])
    assert list(inputs.samples("right_wheel")[0]) == [0.5, 1.5, 2.5]


@pytest.mark.parametrize(
    ("second", "line"),
    [
        ("time,left_wheel_speed\n0,1\n1,1\n", "'left_wheel_speed' is in .*a.csv and in .*b.csv"),
        ("time,imu_gyro.z\n10,1\n11,1\n", "a.csv lasts from 0 to 1 s and .*b.csv .* 10 to 11 s"),
        ("time,imu_gyro.z\n-1,1\n0,1\n", "b.csv lasts from -1 to 0 s and .*a.csv .* 0 to 1 s"),
        ("time,imu_gyro.z\n0,1\n1e-6,1\n1,1\n", "b.csv: two samples are less than 1e-05 s apart"),
    ],
)
def test_files_that_are_not_of_one_trial_get_one_line(tmp_path, model, second, line):
    paths = parts(tmp_path, a="time,left_wheel_speed\n0,1\n1,0.9\n", b=second)
    with pytest.raises(MjchairError, match=line) as error:
        read_trial(paths, model)
    assert "\n" not in str(error.value)
