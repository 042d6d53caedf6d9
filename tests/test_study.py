from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import mjchair
from mjchair.diagnosis.data import first_state, standstill
from mjchair.diagnosis.data.study import Run, make_study, with_copied_wheels
from mjchair.diagnosis.data.windows import calm, cut
from mjchair.diagnosis.driven_run import drive_run
from mjchair.diagnosis.explain import screening
from mjchair.diagnosis.replay import noise
from mjchair.errors import MjchairError
from mjchair.measurement import samples
from mjchair.measurement.trial import Trial
from mjchair.model import parts
from mjchair.model.rolling import rear_axle
from mjchair.simulation.initial import Initial
from mjchair.simulation.inputs import Inputs
from mjchair.tire import block

TIME = np.arange(0.0, 3.0, 0.02)


SIDES = ("left", "right")
EAST = "[trial.initial]\nheading = 0.0\n"


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
    fails(tmp_path / "a.csv", "no study")
    (tmp_path / "a.csv").unlink()
    fails(tmp_path, "no file")
    (tmp_path / "study.toml").write_text('model = "manual"\n')
    fails(tmp_path, "no trial")


def test_degrees_are_recognised(tmp_path):
    fails(write(tmp_path, wheels(57.3)), "left_wheel_speed looks like deg/s or rpm")


def on_a_bend(**changed):
    """Wheels, gyroscope, heading and places of a chair that turns to the left as it rolls."""
    forward, turn = 1.0 + 0.1 * np.sin(TIME), 1.0 + 0.3 * np.sin(2.0 * TIME)
    heading = np.cumsum(turn) * 0.02
    columns = {
        "left_wheel_speed": (forward - 0.28 * turn) / 0.3,
        "right_wheel_speed": (forward + 0.28 * turn) / 0.3,
        "imu_gyro.z": turn,
        "heading": heading,
        "position.x": np.cumsum(forward * np.cos(heading)) * 0.02,
        "position.y": np.cumsum(forward * np.sin(heading)) * 0.02,
    }
    return columns | {name: change(columns) for name, change in changed.items()}


def test_a_bend_in_si_with_the_right_signs_is_read(tmp_path):
    assert mjchair.read_study(write(tmp_path, on_a_bend())).notes == ()


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        (
            {
                "left_wheel_speed": lambda c: c["right_wheel_speed"],
                "right_wheel_speed": lambda c: c["left_wheel_speed"],
            },
            "turns left where the wheels turn right: the columns of the two wheels are swapped",
        ),
        ({"imu_gyro.z": lambda c: -c["imu_gyro.z"]}, "imu_gyro.z and heading turn opposite ways"),
        ({"left_wheel_speed": lambda c: -3.3 + 0.001 * TIME}, "does one of them count down"),
        (
            {f"{s}_wheel_speed": lambda c, s=s: 0.3 * c[f"{s}_wheel_speed"] for s in SIDES},
            "left_wheel_speed looks like m/s.* divide it by the wheel's radius, 0.3",
        ),
        *(
            (
                {f"position.{a}": lambda c, a=a, u=u: u * c[f"position.{a}"] for a in "xy"},
                f"position.x looks like {unit}",
            )
            for unit, u in (("mm", 1000.0), ("cm", 100.0))
        ),
    ],
)
def test_channels_that_contradict_each_other_are_named(changed, words, tmp_path):
    columns = on_a_bend(**changed)
    if "count down" in words:
        columns |= {"imu_gyro.z": 0.01 * np.sin(TIME), "heading": 0.01 * np.sin(TIME)}
    fails(write(tmp_path, columns), words)


@pytest.mark.parametrize("varies", [0.0, 0.01])
def test_a_gyroscope_with_a_bias_in_a_slow_turn_is_no_wheel_in_metres(varies, tmp_path):
    """A bias of 0.12 rad/s tells three times what the wheels do, and is for the diagnosis."""
    turn = 0.055 + varies * np.sin(2.0 * TIME)
    columns = {
        "left_wheel_speed": (1.0 - 0.28 * turn) / 0.3,
        "right_wheel_speed": (1.0 + 0.28 * turn) / 0.3,
        "imu_gyro.z": turn + 0.12,
        "heading": np.cumsum(turn + 0.12) * 0.02,
    }
    mjchair.read_study(write(tmp_path, columns))


@pytest.mark.parametrize("gain", [0.5, 0.7, 1.3, 1.5, 2.0])
@pytest.mark.parametrize("bends", [True, False])
def test_a_wheel_whose_sensor_has_a_gain_has_its_sign(gain, bends, tmp_path):
    """It tells a turn that no gyroscope sees, and is what the diagnosis is asked about."""
    columns = on_a_bend(left_wheel_speed=lambda c: gain * c["left_wheel_speed"])
    if not bends:
        columns |= {"imu_gyro.z": 0.01 * np.sin(TIME), "heading": 0.01 * np.sin(TIME)}
    mjchair.read_study(write(tmp_path, columns))


def test_alike_torques_do_not_spin_a_chair_on_the_spot(tmp_path):
    """Without a gyroscope nothing else tells that one wheel counts down; a spin has its moment."""
    for right, torque, wrong in ((-2.0, 3.0, True), (-2.0, -3.0, False), (2.0, 3.0, False)):
        stroke = 1.0 + 0.5 * np.sin(TIME)
        columns = {"left_wheel_speed": 2.0 * stroke, "right_wheel_speed": right * stroke}
        columns |= {"left_wheel": 3.0 * stroke, "right_wheel": torque * stroke}
        folder = write(tmp_path, columns)
        if wrong:
            fails(folder, "the wheels roll opposite ways, and their torques are alike")
        else:
            mjchair.read_study(folder)


@pytest.mark.parametrize(
    ("sign", "steers", "wrong"), [(-1.0, False, True), (1.0, False, False), (-1.0, True, False)]
)
def test_opposite_torques_do_not_drive_a_chair_faster(sign, steers, wrong, tmp_path):
    """One torque of the other sign came as a gain of -86 % after 256 s; a slalom has its signs."""
    torque = 6.0 * np.sin(2.0 * np.pi * TIME / 1.3)
    stroke = torque if steers else np.maximum(torque, 0.0)
    swing = 0.1 * np.cumsum(stroke) * (TIME[1] - TIME[0])
    left = 4.0 - swing if steers else 4.0 + swing  # a turn to the left is positive
    columns = {"left_wheel_speed": left, "right_wheel_speed": 4.0 + swing}
    columns |= {"left_wheel": sign * stroke, "right_wheel": stroke}
    folder = write(tmp_path, columns)
    if wrong:
        fails(folder, "are opposite, and the chair rolls straight and faster with them")
    else:
        mjchair.read_study(folder)


@pytest.mark.parametrize(("loses", "noted"), [(0.0, True), (0.05, False)])
def test_a_chair_that_keeps_its_speed_without_torque_may_be_pushed(
    loses, noted, tmp_path, monkeypatch
):
    """An attendant who pushed at 1 m/s came as a floor that falls by 1.2 %."""
    monkeypatch.setattr(f"{__name__}.TIME", np.arange(0.0, 4.0, 0.02))
    speed = (1.0 - loses * TIME) / 0.3 + 0.01 * np.sin(40.0 * TIME)
    columns = {f"{side}_wheel_speed": speed for side in SIDES}
    notes = mjchair.read_study(write(tmp_path, columns)).notes
    assert any("keeps its 1 m/s" in note and "pushed" in note for note in notes) == noted


def test_torques_that_take_what_the_chair_never_had_are_noted(tmp_path):
    """Positive torque drives forward; brakes that slow the chair down are no such case."""
    for speed, torque, doubt in ((3.0, -6.0, True), (3.0, 6.0, False), (9.0, -6.0, False)):
        falls = 0.0 if speed == 3.0 else 2.5
        rolls = speed - falls * TIME + 0.01 * np.sin(50.0 * TIME)
        columns = {f"{side}_wheel_speed": rolls for side in SIDES}
        columns |= {f"{side}_wheel": torque + 0.1 * np.sin(TIME) for side in SIDES}
        notes = mjchair.read_study(write(tmp_path, columns)).notes
        assert any("positive torque drives forward" in note for note in notes) == doubt


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


@pytest.mark.parametrize("stuck", ["left_wheel_speed", "imu_gyro.z"])
def test_a_sensor_stuck_at_one_value_is_left_out_and_said(stuck, tmp_path):
    columns = wheels() | {stuck: np.full(TIME.size, 3.0 if "wheel" in stuck else 0.02)}
    study = mjchair.read_study(write(tmp_path, columns))
    assert stuck not in study.channels
    assert sum(f"{stuck} is exactly" in note for note in study.notes) == 1


def test_a_wheel_of_one_speed_stays_where_nothing_else_changes(tmp_path):
    columns = {n: np.full(TIME.size, 3.0) for n in wheels()}
    study = mjchair.read_study(write(tmp_path, columns))
    assert set(study.channels) == set(columns)
    assert sum("left_wheel_speed is exactly 3 throughout; was" in n for n in study.notes) == 1


@pytest.mark.parametrize("clipped", [True, False])
def test_a_torque_at_its_sensors_end_is_said(clipped, tmp_path):
    torque = 5.0 + 5.0 * np.sin(5.0 * TIME)
    torque = np.minimum(torque, 8.0) if clipped else torque
    columns = wheels() | {"left_wheel": torque, "right_wheel": torque[::-1]}
    head = 'model = "manual"\ntorque = "measured"\n'
    study = mjchair.read_study(write(tmp_path, columns, head=head))
    ends = [n for n in study.notes if "exactly 8, its largest value" in n]
    assert len(ends) == (2 if clipped else 0), study.notes


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_end_of_a_sensor_is_called_by_its_side_and_not_by_its_sign(sign, tmp_path):
    """-2 above -10 was called the least value."""
    clipped = np.minimum(6.0 + 4.0 * np.sin(5.0 * TIME), 8.0)
    columns = wheels() | {"left_wheel": sign * clipped, "right_wheel": sign * (clipped - 10.0)}
    head = 'model = "manual"\ntorque = "measured"\n'
    study = mjchair.read_study(write(tmp_path, columns, head=head))
    which = "largest" if sign > 0.0 else "least"
    for value in (8.0 * sign, -2.0 * sign):
        assert sum(f"exactly {value:g}, its {which} value" in n for n in study.notes) == 1


def test_noise_may_be_given_of_a_sensor_or_of_a_channel(tmp_path):
    columns = wheels() | {"imu_gyro.z": 0.1 + 0.01 * TIME}
    told = '[noise]\n"imu_gyro" = 0.01\n"left_wheel_speed" = 0.02\n'
    study = mjchair.read_study(write(tmp_path, columns, extra=told))
    channels = ("imu_gyro.z", "left_wheel_speed", "right_wheel_speed")
    assert [study.noise_given(c) for c in channels] == [0.01, 0.02, None]


def test_two_runs_of_one_name_are_told_apart(tmp_path):
    """One folder a day: what was said of coast was said of both."""
    for day, factor in (("mon", 1.0), ("tue", 1.1), ("wed", 1.2)):
        (tmp_path / day).mkdir()
        write(tmp_path / day, wheels(factor))
    trials = "".join(f'[[trial]]\nfile = "{day}/a.csv"\n' for day in ("mon", "tue", "wed"))
    (tmp_path / "study.toml").write_text(f'model = "manual"\n{trials}')
    study = mjchair.read_study(tmp_path)
    assert [run.trial.name for run in study.runs] == ["a", "a_2", "a_3"]
    assert sum("trial 2 is called a_2, since another is a" in note for note in study.notes) == 1


@pytest.mark.parametrize("held_out", [False, True])
def test_a_run_without_a_window_is_left_out_and_said(held_out):
    """A stand of 2 s at 20 Hz, of which 2 s settle: the diagnosis ended in a KeyError."""
    spec = mjchair.load_spec("manual")
    time = np.arange(0.0, 2.0001, 0.05)
    speed = np.interp(np.arange(0.0, 4.0, 0.05), [0.0, 4.0], [6.0, 4.0])
    moves = {f"{side}_wheel_speed": speed for side in SIDES}
    stands = {f"{side}_wheel_speed": 1e-4 * np.cos(9.0 * time) for side in SIDES}
    runs = [
        Run(Trial("coast", np.arange(0.0, 4.0, 0.05), moves, None, {}), "coast", held_out,
            Initial(), frozenset()),
        Run(Trial("stand", time, stands, None, {}), "stand", False, Initial(), frozenset()),
    ]  # fmt: skip
    study = make_study(spec, runs)
    if held_out:
        with pytest.raises(MjchairError, match=r"stand: too few samples .* no other trial"):
            screening._of_windows(study, None, 1)
        return
    simulator = screening._of_windows(study, None, 1)
    assert [run.trial.name for run in simulator.study.runs] == ["coast"]
    assert {w.run for w in simulator.windows} == {0}
    assert "stand: too few samples" in simulator.study.notes[-1]


@pytest.mark.parametrize(("share", "copied"), [(1.0, True), (0.95, True), (0.6, False)])
def test_a_wheel_is_assumed_alike_where_its_torque_is(share, copied, tmp_path):
    torque = 3.0 + np.sin(5.0 * TIME)
    columns = {"left_wheel_speed": wheels()["left_wheel_speed"]}
    columns |= {"left_wheel": torque, "right_wheel": share * torque}
    study = mjchair.read_study(write(tmp_path, columns))
    assert (len(with_copied_wheels(study).channels) == 2) == copied
    said = "assumed alike" if copied else "driven unlike it, so it is simulated"
    assert any("only the left wheel was measured" in n and said in n for n in study.notes)


def test_an_angle_that_starts_again_once_a_turn_is_counted_on_and_said(tmp_path):
    turned = 3.0 * TIME - 0.15 * TIME**2
    columns = {f"{side}_wheel_angle": turned % (2.0 * np.pi) for side in ("left", "right")}
    study = mjchair.read_study(write(tmp_path, columns))
    for values in study.runs[0].trial.channels.values():
        np.testing.assert_allclose(values, turned, atol=1e-12)
    assert sum("wraps once a turn; it is counted on" in note for note in study.notes) == 2


def test_a_dead_channel_of_a_standing_chair_stays(tmp_path):
    still = {"left_wheel_speed": np.zeros(TIME.size), "imu_gyro.z": 0.01 * np.sin(40.0 * TIME)}
    study = mjchair.read_study(write(tmp_path, still, EAST))
    assert "left_wheel_speed" in study.channels and not study.notes


def test_what_lies_outside_the_measurements_is_left_out_and_said(tmp_path):
    torque = np.full(TIME.size, 3.0)
    seen = {n: np.where((TIME > 0.5) & (TIME < 2.5), v, np.nan) for n, v in wheels().items()}
    columns = {n: ["" if np.isnan(x) else x for x in v] for n, v in seen.items()}
    load = "[trial.load]\nmass = 20.0\nheight = 0.6\n"
    study = mjchair.read_study(write(tmp_path, columns | {"left_wheel": torque}, load))
    trial = study.runs[0].trial
    assert (trial.time[0], trial.time[-1]) == (0.52, 2.48)
    assert all(v.shape == trial.time.shape for v in trial.channels.values())
    assert trial.inputs.time[0] == 0.0
    assert any("nothing was measured before 0.52 s or after 2.48 s" in n for n in study.notes)
    found = SimpleNamespace(evidence=None, effects=())
    whole = drive_run(study, found).before  # from its first measurement on, by the same torque
    assert whole["time"][-1] == pytest.approx(1.96)
    np.testing.assert_allclose(whole["left_wheel"][:-1], 3.0)
    masses = [m.body_mass.sum() for m in (whole.model.load(), study.spec.compile())]
    assert masses[0] - masses[1] == pytest.approx(20.0)  # the load of the run


def test_one_measured_wheel_stands_for_both_and_that_is_said(tmp_path):
    torque = 3.0 + TIME
    columns = {"right_wheel_speed": wheels()["right_wheel_speed"], "right_wheel": torque}
    study = mjchair.read_study(write(tmp_path, columns, EAST))
    controls = study.runs[0].trial.inputs.controls
    assert np.array_equal(controls["left_wheel"], torque)
    assert study.notes == (
        "a: only the right wheel was measured; the left one is assumed alike, and nothing tells "
        "how the chair turns",
    )


def test_a_coast_with_one_wheel_is_said_and_one_with_a_gyroscope_needs_no_word(tmp_path):
    one = {"left_wheel_speed": wheels()["left_wheel_speed"]}
    assert "only the left wheel was measured" in mjchair.read_study(write(tmp_path, one)).notes[0]
    gyro = one | {"imu_gyro.z": 0.1 * np.sin(TIME)}
    assert mjchair.read_study(write(tmp_path, gyro, EAST)).notes == ()


def test_what_is_known_of_the_first_sample_may_have_units(tmp_path):
    told = '[trial.initial]\nheading = "180 deg"\nspeed = "3.6 km/h"\nyaw_rate = 0.1\n'
    (run,) = mjchair.read_study(write(tmp_path, wheels(), told)).runs
    assert run.initial.heading == pytest.approx(np.pi)
    assert (run.initial.speed, run.initial.yaw_rate) == (1.0, 0.1)
    assert run.given == {"heading", "speed", "yaw_rate"}


def test_one_torque_column_stands_for_both_where_the_chair_goes_straight(tmp_path):
    columns = wheels() | {"left_wheel": np.full(TIME.size, 3.0)}
    study = mjchair.read_study(write(tmp_path, columns, EAST))
    assert set(study.runs[0].trial.inputs.controls) == {"left_wheel", "right_wheel"}
    assert study.notes == (
        "a: no torque column of the right wheel; it is assumed to be driven alike, since the chair "
        "turns with 0 % of what the left one alone would do",
    )


def test_the_smartwheel_recording_is_a_study():
    study = mjchair.read_study(samples.folder() / "smartwheel")
    assert study.channels == ("left_wheel_angle",)
    controls = study.runs[0].trial.inputs.controls
    assert np.array_equal(controls["left_wheel"], controls["right_wheel"])
    assert controls["left_wheel"].max() > 8.0
    assert "the right one is assumed alike" in study.notes[0]


TRUE = {  # runs that a rule about units might take for something else
    "rolling down a slope that the accelerometer does not see": {
        "left_wheel_speed": (0.5 + 0.5 * TIME) / 0.3,
        "imu_accelerometer.x": np.full(TIME.size, -0.05),
    },
    "slowing up a slope": {
        "left_wheel_speed": (2.0 - 0.5 * TIME) / 0.3,
        "imu_accelerometer.x": np.full(TIME.size, -0.05),
    },
    "driven gently down a slope": {
        "left_wheel_speed": (0.1 + 0.5 * TIME) / 0.3,
        "imu_accelerometer.x": np.full(TIME.size, 0.05),
    },
    "one wheel rocked and the other spun": {
        "left_wheel_speed": 0.25 * np.sin(3.0 * TIME),
        "right_wheel_speed": np.full(TIME.size, 10.0),
    },
    "a turn about one wheel": {
        "left_wheel_speed": np.full(TIME.size, 0.04),
        "right_wheel_speed": np.full(TIME.size, 2.4),
        "imu_gyro.z": np.full(TIME.size, 1.26),
    },
    "a spin on the spot": {
        "left_wheel_speed": np.full(TIME.size, -5.0),
        "right_wheel_speed": np.full(TIME.size, 5.2),
        "velocity.x": np.full(TIME.size, 0.03),
        "heading": (5.4 * TIME + np.pi) % (2.0 * np.pi) - np.pi,
    },
    "a racer": {"left_wheel_speed": np.full(TIME.size, 28.0)},
    "a heading that goes on over turns": {
        "imu_gyro.z": np.full(TIME.size, 6.0),
        "heading": 1.0 + 6.0 * TIME,
    },
    "a sensor upside down": {"imu_accelerometer.z": -9.81 + 0.1 * np.sin(TIME)},
}


@pytest.mark.parametrize("name", TRUE)
def test_units_that_are_right_are_left_alone(name, tmp_path):
    assert set(mjchair.read_study(write(tmp_path, TRUE[name])).channels) == set(TRUE[name])


def test_a_model_is_found_beside_the_study(tmp_path, monkeypatch):
    (tmp_path / "chairs").mkdir()
    exact = mjchair.load_spec("power", "ramp", grade=0.05)
    (tmp_path / "chairs" / "mine.xml").write_text(exact.to_xml())
    write(tmp_path, wheels(), head='model = "chairs/mine.xml"\n')
    monkeypatch.chdir("/")
    study = mjchair.read_study(tmp_path)
    assert study.spec.compile().body_mass.sum() == pytest.approx(exact.compile().body_mass.sum())


def test_a_scene_and_its_grade_are_the_studys(tmp_path):
    write(tmp_path, wheels(), head='model = "power"\nscene = "ramp"\ngrade = 0.05\n')
    quat = mjchair.read_study(tmp_path).spec.geom("floor").quat
    assert 2.0 * np.arcsin(abs(quat[2])) == pytest.approx(np.arctan(0.05))


def test_trials_need_not_have_the_same_channels(tmp_path):
    write(tmp_path, wheels() | {"rider_motion": 0.02 * np.sin(TIME)})
    text = (tmp_path / "a.csv").read_text().splitlines()
    (tmp_path / "b.csv").write_text("\n".join(r.rsplit(",", 2)[0] for r in text) + "\n")
    with (tmp_path / "study.toml").open("a") as file:
        file.write('[[trial]]\nfile = "b.csv"\n')
    study = mjchair.read_study(tmp_path)
    assert [set(r.trial.other) for r in study.runs] == [{"rider_motion"}, set()]
    assert study.channels == ("left_wheel_speed", "right_wheel_speed")
    assert set(study.runs[1].trial.channels) == {"left_wheel_speed"}


def test_a_heading_that_nothing_tells_is_said(tmp_path):
    said = "the heading of a is neither measured nor given"
    assert mjchair.read_study(write(tmp_path, wheels())).notes[0].startswith(said)
    for columns, trial in ((wheels(), EAST), (wheels() | {"heading": 0.1 * TIME}, "")):
        assert not mjchair.read_study(write(tmp_path, columns, trial)).notes


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("turn", [0.0, 0.4, -0.4])
def test_places_tell_the_first_heading(sign, turn, tmp_path):
    rng = np.random.default_rng(0)
    heading = 2.5 + turn * TIME
    x = 3.0 + np.cumsum(sign * np.cos(heading)) * 0.02
    y = 1.0 + np.cumsum(sign * np.sin(heading)) * 0.02
    columns = {
        "left_wheel_speed": np.full(TIME.size, sign / 0.3 - turn * 0.28 / 0.3),
        "right_wheel_speed": np.full(TIME.size, sign / 0.3 + turn * 0.28 / 0.3),
        "position.x": x + 0.01 * rng.standard_normal(TIME.size),
        "position.y": y + 0.01 * rng.standard_normal(TIME.size),
    }
    found = _first(mjchair.read_study(write(tmp_path, columns)))
    assert found.heading == pytest.approx(2.5, abs=0.06)
    assert found.speed == pytest.approx(sign, abs=0.02)


def test_noise_is_that_of_the_runs_that_are_fitted_to(tmp_path):
    rng = np.random.default_rng(0)
    quiet = {n: v + 0.02 * rng.standard_normal(v.size) for n, v in wheels().items()}
    write(tmp_path, quiet)
    loud = {n: v + 0.5 * rng.standard_normal(v.size) for n, v in wheels().items()}
    loud["imu_gyro.z"] = 0.3 * rng.standard_normal(TIME.size)
    (tmp_path / "more").mkdir()
    write(tmp_path / "more", loud)
    with (tmp_path / "study.toml").open("a") as file:
        file.write('[[trial]]\nfile = "more/a.csv"\nhold_out = true\n')
    found = noise.estimate(mjchair.read_study(tmp_path))
    assert found["left_wheel_speed"].total == pytest.approx(0.02, rel=0.3)
    assert found["imu_gyro.z"].total == pytest.approx(0.3, rel=0.3)  # no other run has it


def test_a_clock_that_jumps_is_refused(tmp_path):
    late = np.where(TIME > 1.5, TIME + 4.0, TIME)
    lines = ["time,left_wheel_speed", *(f"{t},{3.0}" for t in late)]
    (tmp_path / "a.csv").write_text("\n".join(lines) + "\n")
    (tmp_path / "study.toml").write_text('model = "manual"\n[[trial]]\nfile = "a.csv"\n')
    fails(tmp_path, "clock jumps")


def _rolled(damping_time, speed=0.7):
    """Columns of a coast uphill that stops, by tires that damp their rocking for so long (s).

    Args:
      speed: at first, m/s; 0: it stands from its first sample on.
    """
    spec = mjchair.load_spec("manual", scene="ramp", grade=0.006)
    for wheel in ("left_wheel", "right_wheel"):
        parts.edit_tires(spec, block.ROLLING_DAMPING_TIME, lambda _: damping_time, (wheel,))
    run = mjchair.simulate(spec, None, 10.0, initial={"speed": speed}, sample_rate=100.0)
    names = ("left_wheel_speed", "right_wheel_speed")
    return run.time, {name: run[name] for name in names}


def _run(time, columns):
    start = Initial()
    return Run(Trial("a", time, columns, None, {}), "coast", False, start, frozenset())


def test_how_a_chair_rocks_as_it_stops_is_in_no_window():
    """Two chairs that only rock differently where they stop are alike in what is compared."""
    (time, one), (_, other) = _rolled(0.25), _rolled(0.6)
    run = _run(time, one)
    apart = np.abs(one["left_wheel_speed"] - other["left_wheel_speed"])
    windows = cut([run], 0.002)
    rows = np.concatenate([w.rows for w in windows])
    assert apart.max() > 0.015
    assert apart[rows].max() < 0.25 * apart.max()
    assert [w.index for w in windows] == list(range(len(windows)))
    ((first, after),) = standstill.rests(run.trial)
    kept = time[rows]
    assert kept.min() < 1.0 and kept.max() > 9.0  # the chair still stands: that it does is told
    assert not np.any((kept > first + 0.01) & (kept < after - 0.01))


def test_how_a_model_settles_where_a_run_begins_with_a_stand_is_in_no_window():
    """A chair let stand on a slope drew a right answer (81 %) to a bearing's friction (48 %)."""
    (time, one), (_, other) = _rolled(0.25, speed=0.0), _rolled(0.6, speed=0.0)
    (window,) = cut([_run(time, one)], 0.002)
    apart = np.abs(one["left_wheel_speed"] - other["left_wheel_speed"])
    assert apart.max() > 1e-3
    assert apart[window.rows].max() < 0.25 * apart.max()
    assert window.start == 0.0 and window.stands  # the simulation settles as the chair did
    assert window.last - window.first == pytest.approx(8.0, abs=0.01)


def test_a_chair_that_stands_before_it_rolls_settles_there():
    """One window stands, and the first that rolls is simulated from the stand."""
    time = np.arange(0.0, 10.0, 0.01)
    speed = np.maximum(time - 5.0, 0.0)
    stands, *rolls = cut([_run(time, {"left_wheel_speed": speed})], 0.002)
    assert stands.stands and not any(w.stands for w in rolls)
    assert (stands.start, stands.first) == (0.0, pytest.approx(2.0))
    assert stands.last == rolls[0].first == pytest.approx(5.0, abs=0.15)
    assert rolls[0].first - rolls[0].start == pytest.approx(standstill.ROCKS, abs=0.01)
    assert rolls[1].first - rolls[1].start == pytest.approx(0.2)
    late = time > 3.9  # too short a stand for a window of its own
    first, *_ = cut([_run(time[late], {"left_wheel_speed": speed[late]})], 0.002)
    assert first.start == time[late][0] and not first.stands
    assert first.first == pytest.approx(5.0, abs=0.15)


def test_what_a_late_torque_does_at_the_end_of_a_run_is_in_no_window():
    """Torques 50 ms late came as a rider who moves and two early sensors: in the last 50 ms of a
    run the torque that acts is recorded after its end."""
    time = np.arange(0.0, 6.0, 0.01)
    run = _run(time, {"left_wheel_speed": 1.0 + time})
    driven = replace(run, trial=replace(run.trial, inputs=Inputs(time, {"left_wheel": time})))
    ends = [
        cut([r], 0.002, measured=m)[-1].last
        for r, m in ((driven, True), (driven, False), (run, True))
    ]
    assert ends == pytest.approx([5.792, 5.992, 5.992])


@pytest.mark.parametrize("kind", ["left angle", "angles", "places"])
def test_angles_and_places_tell_as_well_as_speeds_when_a_chair_stops(kind):
    """A coast whose wheels had angles alone was fitted through its stop: chi2 of 400 a window."""
    time = np.arange(0.0, 10.0, 1.0 / 240.0)
    speed = np.maximum(1.0 - 0.125 * time, 0.0)  # m/s; it stands from 8 s on
    way = np.cumsum(speed) * (time[1] - time[0])
    rng = np.random.default_rng(1)
    tick = 2.0 * np.pi / 4096.0
    angle = np.round(way / 0.3 / tick) * tick
    place = {
        f"position.{axis}": by * way + 5e-4 * rng.standard_normal(time.size)
        for axis, by in (("x", 0.8), ("y", -0.6))
    }
    wheels = {f"{side}_wheel_angle": angle for side in ("left", "right")}
    columns = {
        "left angle": {"left_wheel_angle": angle}, "angles": wheels, "places": place
    }[kind]  # fmt: skip
    ((first, _),) = standstill.rests(_run(time, columns).trial)
    assert 7.6 < first < 8.0
    assert standstill.rests(_run(time[time < 7.5], _cut(columns, time < 7.5)).trial) == []


def _cut(columns, kept):
    return {name: values[kept] for name, values in columns.items()}


def test_a_chair_that_is_pushed_to_and_fro_before_it_rolls_is_used_from_there():
    """Bodies that swing on a chair at rest rock it on its tires: no fit follows that."""
    time = np.arange(0.0, 8.0, 0.01)
    dithers = np.where((time > 1.0) & (time < 3.0), 0.3 * np.sin(4.0 * np.pi * time), 0.0)
    speed = dithers + np.maximum(time - 3.0, 0.0)
    run = _run(time, {"left_wheel_speed": speed, "right_wheel_speed": speed})
    ((begin, onward),) = standstill.rests(run.trial)
    assert begin == 0.0 and 2.9 < onward < 3.2
    assert min(w.rows[0] for w in cut([run], 0.002)) * 0.01 > 2.9


def test_strokes_on_the_spot_are_no_pushing_to_and_fro():
    """A spin by three strokes, between which the chair stood, was used from the third one on."""
    time = np.arange(0.0, 8.0, 0.01)
    strokes = np.where(
        (time > 1.0) & (time < 3.0), np.maximum(np.sin(2.0 * np.pi * time), 0.0), 0.0
    )
    speed = 0.5 * strokes + np.maximum(time - 3.0, 0.0)
    run = _run(time, {"left_wheel_speed": -speed, "right_wheel_speed": speed})
    for push, count in ((12.0, 0), (1.0, 1)):  # N m; hands that rest on the rims give less
        torques = {"left_wheel": -push * strokes, "right_wheel": push * strokes}
        driven = replace(run.trial, inputs=Inputs(time, torques))
        assert len(standstill.rests(driven)) == count


def test_a_stroke_that_begins_as_the_chair_stops_once_more_is_none_on_the_spot():
    """A person moved on a chair at rest, which stopped once more as the first stroke began.

    The stroke passed for one on the spot, and 1.9 s that tell of the person alone were fitted.
    """
    time = np.arange(0.0, 8.0, 0.01)
    speed = np.where(
        time < 2.8, np.maximum(0.4 * np.sin(2.0 * np.pi * time) - 0.2, 0.0), time - 2.8
    )
    torque = np.clip(20.0 * (time - 2.3), 0.0, 16.0)
    speed[(time > 2.56) & (time < 2.62)] = 0.2  # the stroke begins, and the chair stops again
    both = {"left_wheel_speed": speed, "right_wheel_speed": speed}
    run = _run(time, both)
    driven = replace(run.trial, inputs=Inputs(time, {"left_wheel": torque, "right_wheel": torque}))
    assert [after for _, after in standstill.rests(driven)] == pytest.approx([2.85], abs=0.1)


def test_a_chair_that_stands_as_its_run_ends_has_come_to_rest():
    """A coast that stood for its last 0.7 s was fitted through its stop."""
    time = np.arange(0.0, 8.0, 0.01)
    speed = np.maximum(3.0 - 0.4 * time, 0.0)  # stands from 7.5 s on
    run = _run(time, {"left_wheel_speed": speed, "right_wheel_speed": speed})
    ((first, _),) = standstill.rests(run.trial)
    assert 7.1 < first < 7.5
    assert standstill.rests(_run(time[:730], {"left_wheel_speed": speed[:730]}).trial) == []


def test_wheel_angles_tell_yaw_rate_as_wheel_speeds_do():
    axle = rear_axle(mjchair.load_spec("manual").compile())
    time = np.arange(0.0, 2.0, 0.01)
    speeds = {"left_wheel_speed": 3.0 + 0.0 * time, "right_wheel_speed": 3.5 + 0.0 * time}
    angles = {name.replace("speed", "angle"): w * time for name, w in speeds.items()}
    told = [first_state.initial(_run(time, columns), axle) for columns in (speeds, angles)]
    assert told[0].yaw_rate > 0.1
    assert told[1].yaw_rate == pytest.approx(told[0].yaw_rate, rel=1e-9)
    assert told[1].speed == pytest.approx(told[0].speed, rel=1e-9)


def test_a_chair_that_turns_back_or_begins_at_rest_does_not_come_to_rest():
    time = np.arange(0.0, 8.0, 0.01)
    back = 2.0 - 0.8 * time
    starts = np.maximum(time - 3.0, 0.0)
    for speed, settled in ((back, 0.2), (starts, standstill.ROCKS)):
        run = _run(time, {"left_wheel_speed": speed, "right_wheel_speed": speed})
        assert standstill.rests(run.trial) == []
        rows = np.concatenate([w.rows for w in cut([run], 0.002)])
        assert np.array_equal(rows, np.flatnonzero(time >= settled))


def test_windows_are_short_where_a_caster_shimmies():
    """A person who steers, noise and a caster that turns over once do not shimmy."""
    time = np.arange(0.0, 8.0, 0.01)
    shakes = 0.3 * np.sin(2.0 * np.pi * 7.0 * time) * ((time > 3.0) & (time < 5.0))
    steers = 0.6 * np.sin(2.0 * np.pi * 0.8 * time)
    over = np.pi * (time > 4.0) + 0.02 * np.random.default_rng(5).standard_normal(time.size)
    runs = [_run(time, {"left_caster_angle": angle}) for angle in (shakes + steers, steers, over)]
    shaky, *calm_ones = (cut([run], 0.002) for run in runs)
    for windows in calm_ones:
        assert max(w.last - w.first for w in windows) > 1.9
        assert not any(w.shimmies for w in windows)
    # six swings of 1/14 s
    assert max(w.last - w.first for w in shaky) < 0.5
    inside = [w for w in shaky if w.shimmies]
    assert 2.0 < inside[0].first < 3.1 and 4.9 < inside[-1].last < 6.0
    assert calm(shaky, range(len(shaky))) == [k for k, w in enumerate(shaky) if not w.shimmies]
    assert calm(inside, range(len(inside))) == list(range(len(inside)))  # else none were left


def test_a_stop_is_said(tmp_path):
    speed = np.maximum(3.0 - 2.0 * TIME, 0.0)
    columns = {"left_wheel_speed": speed, "right_wheel_speed": speed}
    (said,) = [n for n in mjchair.read_study(write(tmp_path, columns)).notes if "rest" in n]
    assert "a at 1.5 s" in said


def test_unknown_keys_are_named(tmp_path):
    fails(write(tmp_path, wheels(), "hold_ot = true\n"), "did you mean 'hold_out'")


def _first(study):
    return first_state.initial(study.runs[0], study.axle)


def test_a_measured_torque_lags_behind_no_motor(tmp_path):
    """Lag and braking of a motor are tried where torques are commands, and else are not."""
    from mjchair.diagnosis.diagnose import study_effects

    torque = {"left_wheel": np.sin(TIME), "right_wheel": np.sin(TIME)}
    motors, rims = {"drive_lag", "back_emf"}, {"torque_delay"}

    def tried(head):
        study = mjchair.read_study(write(tmp_path, wheels() | torque, head=head))
        return (motors | rims) & {effect.name for effect in study_effects(study)}

    assert tried('model = "manual"\n') == motors
    assert tried('model = "manual"\ntorque = "measured"\n') == rims
    smartwheel = mjchair.read_study(samples.folder() / "smartwheel")
    assert not motors & {effect.name for effect in study_effects(smartwheel)}
    # the gain of a sensor is only roughly known, and that of a command is no such number
    known = 'model = "manual"\n{}[nuisance]\ntorque = 0.02\n'
    measured = known.format('torque = "measured"\n')
    mjchair.read_study(write(tmp_path, wheels() | torque, head=measured))
    for head, columns in ((known.format(""), wheels() | torque), (measured, wheels())):
        fails(write(tmp_path, columns, head=head), "unknown nuisance 'torque'")
    fails(write(tmp_path, wheels(), head='torque = "mesured"\n'), "did you mean 'measured'")


KNOWN = """indoors = true
torque = "measured"
[material]
force = 2.5
[noise]
"left_wheel_speed" = 0.02
[noise.process]
drive = 0.5
[nuisance]
"scale:left_wheel_speed" = 0.04
"""


def test_what_a_person_measured_makes_effects_rarer_that_say_it_is_wrong(tmp_path):
    from mjchair.diagnosis.data.roughly_known import MISTAKEN
    from mjchair.diagnosis.diagnose import study_effects

    def common(head):
        study = mjchair.read_study(write(tmp_path, wheels(), head=head))
        return {effect.key: effect.common for effect in study_effects(study)}

    usual = common("")
    told = common(
        "[nuisance]\ncentre_x = 0.002\nmass = 1e-6\nrolling_radius = 0.01\n"
        '"scale:left_wheel_speed" = 0.005\n'
    )
    assert told.keys() == usual.keys()
    share = {key: told[key] / usual[key] for key in usual if told[key] != usual[key]}
    assert share == pytest.approx(
        {
            "mass_offset": 0.2,  # 2 mm of the usual 10
            "payload": MISTAKEN,
            "sensor_scale:left_wheel_speed": 0.5,  # half a percent of the usual one
        }
    )


@pytest.mark.parametrize(
    ("starts", "unplaced"),
    [
        (["", ""], ("a", "b")),
        (["position = [0.0, 1.0]\n", ""], ("b",)),
        (["position = [0.0, 1.0]\n", "position = [2.0, 0.0]\n"], ()),
        ([""], ()),  # a lone run has a frame of its own
    ],
)
def test_a_place_on_the_floor_is_looked_for_where_runs_share_a_frame(starts, unplaced, tmp_path):
    """Each run was taken to start at the origin, and two coasts over one joint were a patch."""
    from mjchair.diagnosis.diagnose import study_effects

    lines = []
    for k, (name, start) in enumerate(zip("ab", starts, strict=False)):
        write(tmp_path, wheels(1.0 - 0.1 * k))
        (tmp_path / "a.csv").rename(tmp_path / f"run_{name}.csv")
        lines.append(f'[[trial]]\nfile = "run_{name}.csv"\n[trial.initial]\nheading = 0.0\n{start}')
    (tmp_path / "study.toml").write_text("\n".join(lines))
    study = mjchair.read_study(tmp_path)
    assert study.unplaced == tuple(f"run_{name}" for name in unplaced)
    looked_for = "surface_patch" in {e.name for e in study_effects(study)}
    assert looked_for == (not unplaced)


def test_what_shows_in_turns_alone_is_not_looked_for_where_one_wheel_stands_for_both(tmp_path):
    from mjchair.diagnosis.diagnose import study_effects

    found = {}
    for name, columns in (
        ("both", wheels()),
        ("one", {"left_wheel_speed": wheels()["left_wheel_speed"]}),
        ("gyroscope", {"left_wheel_speed": wheels()["left_wheel_speed"], "imu_gyro.z": 0.1 * TIME}),
    ):
        (tmp_path / name).mkdir()
        study = mjchair.read_study(write(tmp_path / name, columns))
        found[name] = {e.name for e in study_effects(study)}
        assert study.straight == (name == "one")
    turning = {"cornering_stiffness", "relaxation_length", "caster_trail", "turning_scrub"}
    assert not turning & found["one"]
    assert turning <= found["both"] & found["gyroscope"]
    assert {"rolling_resistance", "caster_friction", "tire_friction"} <= found["one"]


def test_what_a_person_knows_reaches_the_rules_of_the_diagnosis(tmp_path):
    from mjchair.diagnosis.diagnose import study_effects
    from mjchair.diagnosis.fit import noise_levels
    from mjchair.diagnosis.material import limit

    plain, told = (mjchair.read_study(write(tmp_path, wheels(), head=h)) for h in ("", KNOWN))
    assert limit(told) == 2.5 != limit(plain)
    assert "wind" in {e.name for e in study_effects(plain)} - {e.name for e in study_effects(told)}
    levels = noise_levels.known_parts(told)
    assert np.hypot(*levels.values()) == pytest.approx(0.5)
    assert not noise_levels.known_parts(plain)
    assert noise.estimate(told)["left_wheel_speed"].source == "study.toml"
    for bad, words in (
        ("[noise]\nprocess = 3.0\n", "process .* is a table .drive, side, yaw"),
        ("[noise.process]\ndrift = 1.0\n", "unknown key 'drift'"),
        ("[material]\nforce = 0.0\n", "force is 0.0; it must be positive"),
        ('indoors = "yes"\n', "indoors is 'yes'; it must be true or false"),
        ('kind = "rgi"\n', "kind is 'rgi'; did you mean 'rig'"),
        ("[chair]\ncambre = 0.1\n", r"\[chair\].* did you mean 'camber'"),
        ('[nuisance]\n"scale:left_weel_speed" = 0.1\n', "did you mean 'scale:left_wheel_speed'"),
    ):
        fails(write(tmp_path, wheels(), head=bad), words)


def test_a_trial_of_two_files_tells_resistance_and_the_gain_of_a_doubtful_gauge(tmp_path):
    """Wheels at 100 Hz, of which the left gauge shows 3 % too much, and an IMU at 50 Hz."""
    from mjchair.diagnosis.diagnose import prepare
    from mjchair.diagnosis.fit.column_ids import RoughlyKnown
    from mjchair.diagnosis.fit.nonlinear import refit
    from mjchair.diagnosis.fit.variant import Term, Variant
    from mjchair.effects.library import find

    effect, rng = find("rolling_resistance"), np.random.default_rng(0)
    spec = mjchair.load_spec()
    effect.apply(spec, {"coefficient": 0.005})
    run = mjchair.simulate(spec, None, 4.0, initial={"speed": 1.5}, sample_rate=100.0)
    measured = {
        c: gain * run[c] + size * rng.standard_normal(run.time.size)
        for c, gain, size in (
            ("left_wheel_speed", 1.03, 0.02),
            ("right_wheel_speed", 1.0, 0.02),
            ("imu_gyro.z", 1.0, 0.01),
            ("imu_accelerometer.x", 1.0, 0.1),
        )
    }
    for file, every, names in (("wheels", 1, list(measured)[:2]), ("imu", 2, list(measured)[2:])):
        rows = np.column_stack([run.time, *(measured[n] for n in names)])[::every]
        np.savetxt(
            tmp_path / f"{file}.csv",
            rows,
            "%.9g",
            ",",
            header=",".join(["time", *names]),
            comments="",
        )
    files = 'file = ["wheels.csv", "imu.csv"]\n'
    (tmp_path / "study.toml").write_text(f"{KNOWN}[[trial]]\n{files}{EAST}")
    study = mjchair.read_study(tmp_path)
    trial = study.runs[0].trial
    assert [round(trial.rate(c)) for c in measured] == [100, 100, 50, 50]
    assert not study.notes
    bench, first = prepare(study)
    coast = Term(effect, {"coefficient": 0.0}, ("coefficient",))
    found = refit(bench, Variant(bench.nuisances, {}, (coast,)), first)
    assert found.variant.terms[0].values["coefficient"] == pytest.approx(0.005, rel=0.05)
    gain = found.step[list(found.columns).index(RoughlyKnown("scale:left_wheel_speed"))]
    assert 0.04 * gain == pytest.approx(0.03, abs=0.005)
