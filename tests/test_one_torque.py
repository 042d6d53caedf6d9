"""One measured torque and a measured turn tell whether the other wheel was driven as well."""

from functools import cache

import numpy as np
import pytest

import mjchair
from mjchair.diagnosis.data.study import Run, make_study
from mjchair.diagnosis.diagnose import study_effects
from mjchair.measurement import samples
from mjchair.measurement.trial import Trial
from mjchair.simulation.initial import Initial
from mjchair.simulation.inputs import Inputs

SIDES = {"left": "right", "right": "left"}
TIME = np.arange(0.0, 6.0, 0.01)
PHASE = np.mod(TIME - 0.2, 1.15)
COURSES = {
    "strokes": np.where((TIME > 0.2) & (PHASE < 0.46), 12.0 * np.sin(np.pi * PHASE / 0.46) ** 2, 0),
    "one torque": np.full(TIME.size, 3.0),
    "hands at rest": np.full(TIME.size, 1e-3),
}


@cache
def rolled(model, course, side, other):
    """A chair with one wheel driven, and the other by a share of that."""
    torque = COURSES[course]
    controls = {f"{side}_wheel": torque, f"{SIDES[side]}_wheel": other * torque}
    spec = mjchair.load_spec(model)
    inputs = Inputs(TIME, controls, "run")
    return mjchair.simulate(spec, inputs, 6.0, sample_rate=100.0, initial={"speed": 0.5})


def study(model, course, side, other, channels):
    run = rolled(model, course, side, other)
    random = np.random.default_rng(3)
    seen = {c: run[c] + 0.01 * random.standard_normal(run.time.size) for c in channels}
    inputs = Inputs(TIME, {f"{side}_wheel": COURSES[course]}, "run")
    trial = Trial("run", run.time, seen, inputs, {})
    one = Run(trial, "push", False, Initial(), frozenset())
    return make_study(mjchair.load_spec(model), [one])


GYRO = ("left_wheel_speed", "imu_gyro.z")
WHEELS = ("left_wheel_speed", "right_wheel_speed")


@pytest.mark.parametrize("course", ["strokes", "one torque"])
@pytest.mark.parametrize("model", ["manual", "power"])
@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("channels", [GYRO, WHEELS])
@pytest.mark.parametrize(("other", "alike"), [(1.0, True), (0.75, True), (0.0, False)])
def test_the_turn_tells_whether_both_wheels_were_driven(
    model, course, side, channels, other, alike
):
    """One rim and an IMU: the chair that went straight was simulated with one wheel driven."""
    made = study(model, course, side, other, channels)
    controls = made.runs[0].trial.inputs.controls
    assert (set(controls) == {"left_wheel", "right_wheel"}) == alike
    said = "assumed to be driven alike" if alike else "is not driven, since the chair turns"
    assert sum(said in note for note in made.notes) == 1
    assert not alike or np.array_equal(controls["left_wheel"], controls["right_wheel"])


def test_a_chair_that_is_turned_by_both_hands_asks_for_the_other_torque():
    made = study("manual", "one torque", "left", -1.0, GYRO)
    assert set(made.runs[0].trial.inputs.controls) == {"left_wheel"}
    assert made.notes[0].endswith("If it was pushed the other way, add its torque")


def test_a_torque_that_was_measured_of_one_wheel_alone_is_doubted_for_the_other():
    """A right hand that pushed 7 % less came as a centre of mass 11 mm aside."""
    common = {
        other: {
            e.key: e.common for e in study_effects(study("manual", "strokes", "left", other, GYRO))
        }
        for other in (1.0, 0.0)
    }
    shipped = mjchair.read_study(samples.folder() / "smartwheel")  # nothing tells of a turn there
    straight = {e.key: e.common for e in study_effects(shipped)}
    assert straight["torque_gain"] == common[0.0]["torque_gain"]
    assert common[1.0]["torque_gain"] > 4.0 * common[0.0]["torque_gain"]
    assert common[1.0]["mass_offset"] == common[0.0]["mass_offset"]


def test_a_torque_that_turns_nothing_visibly_tells_nothing():
    made = study("manual", "hands at rest", "left", 0.0, GYRO)
    assert set(made.runs[0].trial.inputs.controls) == {"left_wheel"}
    assert "is not driven. If it was, add its torque" in made.notes[0]
