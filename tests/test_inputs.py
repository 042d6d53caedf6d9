import mujoco
import numpy as np
import pyarrow
import pyarrow.parquet
import pytest

from mjchair.errors import MjchairError, nearest
from mjchair.simulation.inputs import Inputs, constant, push_strokes, read_inputs
from mjchair.simulation.table import read_table
from mjchair.units import UNITS, quantity

XML = """
<mujoco>
  <worldbody><body name="b"><joint name="left_wheel"/><geom size="0.1"/>
    <body><joint name="right_wheel"/><geom size="0.1"/></body></body></worldbody>
  <actuator>
    <motor name="left_wheel" joint="left_wheel"/><motor name="right_wheel" joint="right_wheel"/>
    <general name="left_wheel_tire" joint="left_wheel" dyntype="user" actdim="4"/>
  </actuator>
  <sensor><jointvel name="left_wheel_speed" joint="left_wheel"/></sensor>
</mujoco>
"""


@pytest.fixture(scope="module")
def model():
    return mujoco.MjModel.from_xml_string(XML)


@pytest.fixture(scope="module")
def prefixed():
    parent, child = mujoco.MjSpec(), mujoco.MjSpec.from_string(XML)
    parent.worldbody.add_frame().attach_body(child.body("b"), "chair/", "")
    return parent.compile()


def write(path, text):
    path.write_text(text)
    return path


def test_constant_drives_until_its_end_and_not_after(model):
    torque = constant({"left_wheel": 3.0, "right_wheel": -1.0}, 2.0)
    out = torque.control_array(model, [-0.1, 0.0, 1.0, 2.0, 2.1])
    assert out[:, 0].tolist() == [0.0, 3.0, 3.0, 3.0, 0.0]
    assert out[:, 1].tolist() == [0.0, -1.0, -1.0, -1.0, 0.0]
    assert not out[:, 2].any()


def test_values_over_time_are_no_constant(model):
    line = r"left_wheel is 3 values; a constant control is one number.*mjchair\.Inputs"
    with pytest.raises(MjchairError, match=line):
        constant({"left_wheel": np.ones(3)}, 1.0)


def test_a_prefix_from_attachment_is_tolerated(prefixed):
    out = constant({"right_wheel": 2.0}, 1.0).control_array(prefixed, [0.5])
    assert out.tolist() == [[0.0, 2.0, 0.0]]


def test_missing_samples_are_bridged_by_their_own_channel(tmp_path, model):
    path = write(tmp_path / "a.csv", "time,left_wheel,right_wheel\n0,0,\n1,,5\n2,2,7\n")
    out = read_inputs(path, model).control_array(model, [0.5, 1.0, 1.5])
    assert out[:, 0].tolist() == [0.5, 1.0, 1.5]
    assert out[:, 1].tolist() == [0.0, 5.0, 6.0]


def test_sensor_columns_are_left_alone(tmp_path, model):
    path = write(tmp_path / "a.csv", "time,left_wheel,left_wheel_speed\n0,1,9\n1,1,9\n")
    assert list(read_inputs(path, model).controls) == ["left_wheel"]


def test_parquet_says_the_same_as_csv(tmp_path, model):
    write(tmp_path / "a.csv", "time,left_wheel\n0,1\n0.5,\n1,3\n")
    columns = {"time": [0.0, 0.5, 1.0], "left_wheel": [1.0, None, 3.0]}
    pyarrow.parquet.write_table(pyarrow.table(columns), tmp_path / "a.parquet")
    one, two = (read_inputs(tmp_path / f"a.{end}", model) for end in ("csv", "parquet"))
    np.testing.assert_array_equal(one.time, two.time)
    np.testing.assert_array_equal(one.controls["left_wheel"], two.controls["left_wheel"])


def test_units_in_brackets_become_si(tmp_path):
    table = read_table(
        write(tmp_path / "a.csv", "time [ms],speed [km/h],turn [deg/s]\n500,36,180\n")
    )
    assert table.time[0] == 0.5
    assert table.columns["speed"][0] == pytest.approx(10.0)
    assert table.columns["turn"][0] == pytest.approx(np.pi)


@pytest.mark.parametrize(
    ("written", "unit", "size"),
    [
        ("°/s", "deg/s", np.pi / 180.0),
        ("°", "deg", np.pi / 180.0),
        ("N·m", "N m", 1.0),
        ("N.m", "N m", 1.0),
    ],
)
def test_what_people_write_for_a_unit_is_that_unit(written, unit, size, tmp_path):
    table = read_table(write(tmp_path / "a.csv", f"time,x [{written}]\n0,2\n"))
    assert table.columns["x"][0] == pytest.approx(2.0 * size)
    assert table.units["x"] == unit
    assert quantity(f"2{written}", UNITS[unit][0], "x") == pytest.approx(2.0 * size)


def test_push_strokes_have_the_impulse_they_promise():
    strokes = push_strokes({"left_wheel": 10.0}, 4.0, period=1.0, push=0.4, start=0.0, rate=2000.0)
    torque = strokes.controls["left_wheel"]
    assert torque.max() == pytest.approx(10.0, rel=1e-4)
    assert torque.min() == 0.0
    # impulse of a stroke: half of peak times push
    assert np.trapezoid(torque, strokes.time) == pytest.approx(4 * 0.5 * 10.0 * 0.4, rel=1e-6)
    recovery = (strokes.time % 1.0 > 0.401) & (strokes.time % 1.0 < 0.999)
    assert not torque[recovery].any()


def test_a_stroke_that_would_not_end_is_left_out():
    strokes = push_strokes({"left_wheel": 10.0}, 1.2, period=1.0, push=0.4, start=0.0)
    assert not strokes.controls["left_wheel"][strokes.time > 0.5].any()


def test_inputs_are_frozen():
    torque = constant({"left_wheel": 1.0}, 1.0)
    with pytest.raises(ValueError):
        torque.controls["left_wheel"][0] = 2.0
    with pytest.raises(TypeError):
        torque.controls["left_wheel"] = np.zeros(2)


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("time,left_wheel\n0,1\n1,1\n0.5,1\n", "time goes from 1 to 0.5 s in sample 3"),
        ("time,left_wheel\n0,1\n0,1\n", "must increase strictly"),
        (
            "time,left_wheel\n0,1\n0,1\n0.01,1\n0.01,1\n0.02,1\n",
            "if the samples came evenly, k / 200 s for sample k",
        ),
        ("time,left_wheel\n0,1\n,1\n", "every sample needs a time"),
        ("time,left_wheel\n0,nan\n", "left_wheel has no samples"),
        ("time,left_wheel\n0,inf\n", "infinite at 0 s"),
        ("time,left_wheel\n0,\n1,\n", "left_wheel has no samples"),
        ("time,left_wheel\n0,x\n", "row 2, column 'left_wheel': 'x' is not a number"),
        ('time,left_wheel\n"0,5",1\n', "'0,5' is not a number; a decimal comma is read where semi"),
        ("time,left_wheel\n0,1,2\n", "row 2 has 3 cells; the header has 2"),
        ("# me\ntime,left_wheel\n0,1\n", "the header has 1; a comma, a semicolon or a tab"),
        ("time left_wheel\n0 1\n", "a comma, a semicolon or a tab parts the cells"),
        ("t,left_wheel\n0,1\n", "the first column is 't'; it must be time"),
        ("time,left_wheel,left_wheel\n0,1,2\n", "'left_wheel' is there twice"),
        ("time,left_whel\n0,1\n", "unknown channel 'left_whel'; did you mean 'left_wheel'?"),
        ("time,left_wheel_speed [Deg/S]\n0,1\n", "unknown unit 'Deg/S'; did you mean 'deg/s'?"),
        ("time,left_wheel [lbf in]\n0,1\n", "unknown unit 'lbf in'; known: s, ms"),
        ("time,joystickx\n0,1\n", "unknown channel 'joystickx'; did you mean 'joystick_x'?"),
        ("time,joystick_x\n0,1\n", "take a power chair with its drive"),
        ("time,left_wheel_speed\n0,1\n", "no column drives an actuator"),
        ("time,left_wheel_tire\n0,1\n", "unknown channel 'left_wheel_tire'"),
        ("time,left_wheel\n", "no samples"),
        ("", "empty"),
    ],
)
def test_bad_tables_get_one_line(tmp_path, model, text, line):
    path = write(tmp_path / "a.csv", text)
    with pytest.raises(MjchairError) as caught:
        read_inputs(path, model)
    assert line in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_missing_file_names_its_neighbour(tmp_path, model):
    write(tmp_path / "pushes.csv", "time,left_wheel\n0,1\n")
    with pytest.raises(MjchairError, match=r"no file .*push.csv; did you mean 'pushes.csv'"):
        read_inputs(tmp_path / "push.csv", model)


def test_a_folder_is_no_table(tmp_path):
    with pytest.raises(MjchairError, match=r"is a folder; give a \.csv"):
        read_table(tmp_path)


def test_of_many_known_names_the_most_alike_are_listed():
    few, many = (nearest("speed", [f"wheel_{k}" for k in range(n)]) for n in (40, 60))
    assert few.count("wheel_") == 40 and "more" not in few
    assert many.count("wheel_") == 12 and many.endswith("and 48 more")


def test_other_suffixes_and_broken_parquet_are_refused(tmp_path, model):
    with pytest.raises(MjchairError, match=r"ends in \.csv or \.parquet"):
        read_inputs(write(tmp_path / "a.txt", "time\n"), model)
    with pytest.raises(MjchairError, match=r"cannot read .* as Parquet"):
        read_inputs(write(tmp_path / "a.parquet", "time\n"), model)


@pytest.mark.parametrize(
    ("make", "line"),
    [
        (lambda: constant({"left_wheel": 1.0}, 0.0), "duration is 0 s"),
        (lambda: constant({"left_wheel": np.nan}, 1.0), "no finite samples"),
        (lambda: push_strokes({"left_wheel": 1.0}, 5.0, push=2.0), "push lasts 2 s"),
        (lambda: push_strokes({"left_wheel": 1.0}, 5.0, period=-1.0), "period is -1 s"),
        (lambda: push_strokes({"left_wheel": 1.0}, 5.0, start=-1.0), "start is -1 s"),
        (lambda: Inputs(np.array([1.0, 0.0]), {}), "time goes from 1 to 0 s"),
        (lambda: Inputs(np.arange(2.0), {"left_wheel": np.zeros(3)}), "has shape"),
    ],
)
def test_bad_numbers_get_one_line(make, line):
    with pytest.raises(MjchairError, match=line):
        make()


def test_unknown_and_inert_actuators_are_named(model):
    with pytest.raises(MjchairError, match="unknown actuator 'left'; "):
        constant({"left": 1.0}, 1.0).control_array(model, [0.0])
    with pytest.raises(
        MjchairError, match="is the state of a tire or of the drive and takes no input"
    ):
        constant({"left_wheel_tire": 1.0}, 1.0).control_array(model, [0.0])
