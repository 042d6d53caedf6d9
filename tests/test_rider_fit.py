"""The mass that moves on a chair, fitted to a push of a person of five segments."""

import math
from dataclasses import replace

import numpy as np
import pytest
from five_segments import NOISE, Case, Hidden, tables

import mjchair
from mjchair.diagnosis.data.roughly_known import nuisances
from mjchair.diagnosis.data.study import Run, make_study
from mjchair.diagnosis.fit import bounded, nonlinear
from mjchair.diagnosis.fit.bench import Bench
from mjchair.diagnosis.fit.column_ids import ParameterId, RoughlyKnown
from mjchair.diagnosis.fit.nonlinear import refit
from mjchair.diagnosis.fit.parameter_columns import nuisance_columns, term_columns
from mjchair.diagnosis.fit.variant import Term, Variant
from mjchair.diagnosis.replay import noise
from mjchair.diagnosis.replay.derivatives import predictions
from mjchair.diagnosis.replay.measured_motion import _smoothed
from mjchair.diagnosis.replay.sensor_errors import SensorErrors
from mjchair.diagnosis.replay.simulator import WindowSimulator
from mjchair.diagnosis.replay.window_states import track
from mjchair.effects import rider_motion
from mjchair.measurement.trial import Trial
from mjchair.simulation.initial import Initial
from mjchair.simulation.inputs import Inputs

SECONDS = 4.2
KEY = ParameterId("rider_motion", "mass")


def pushed(hidden, torque_measured=False):
    """A bench of one push, its first track, and the variant in which a mass (kg) moves."""
    spec = mjchair.load_spec("manual")
    columns = tables(Case(hidden, coasts=0, pushes=1), seed=3)[0]["push_1"]
    columns = {name: values[columns["time"] < SECONDS] for name, values in columns.items()}
    time = columns.pop("time")
    driven = {name: columns.pop(name) for name in ("left_wheel", "right_wheel")}
    other = {"rider_motion": columns.pop("rider_motion")}
    trial = Trial("push", time, columns, Inputs(time, driven), other)
    made = Run(trial, "push", False, Initial(speed=0.9), frozenset({"heading"}))
    study = make_study(spec, [made], NOISE)
    simulator = WindowSimulator(study, threads=1)
    known = nuisances(study.channels, {}, torque_measured)
    bench = Bench(simulator, noise.estimate(study), known)
    effect = rider_motion.MEASURED.on(spec)

    def moving(mass):
        return Variant(bench.nuisances, terms=(Term(effect, {"mass": mass}, ("mass",)),))

    return bench, track(simulator, simulator.base, bench.noise), moving


@pytest.fixture(scope="module")
def push():
    return pushed(Hidden())


def test_the_fit_ends_at_the_same_mass_from_starts_25_kg_apart(push):
    bench, first, moving = push
    ends = [refit(bench, moving(mass), first) for mass in (55.0, 80.0)]
    # columns of what is roughly known are those of the start, so once more from the end
    ends = [refit(bench, end.variant, end.track) for end in ends]
    one, other = (end.variant.terms[0].values["mass"] for end in ends)
    error = max(end.std[KEY] for end in ends)
    assert abs(one - other) < 0.2 * error
    assert all(end.total - end.promised < 1.0 for end in ends)
    # the whole person of 75 kg moves, on a chair that does not rock and whose wheels do not slip;
    # nothing else that is roughly known has to stand in for that
    assert one == pytest.approx(75.0, rel=0.03)
    for end in ends:
        assert all(abs(by) < 1.5 for by in end.variant.offsets.values())
        soft = [end.step[end.system.places[RoughlyKnown(name)]] for name in ("rocking", "slip")]
        assert all(-4.0 < by < -1.5 for by in soft)


def test_the_interval_of_the_mass_knows_that_torques_were_measured():
    """Rims pushed with a tenth more than was measured: mass, torque and moving mass go together."""
    hidden = Hidden(gain_left=0.1, gain_right=0.1)
    bench, first, moving = pushed(hidden, torque_measured=True)
    end = refit(bench, moving(70.0), first)
    mass, error = end.variant.terms[0].values["mass"], end.std[KEY]
    assert abs(mass - 75.0) < 2.0 * error < 15.0
    assert end.variant.offsets["torque"] > 0.5


def test_what_is_roughly_known_is_in_the_chair_before_a_person_moves_on_it(push):
    """A chair 5 % heavier is 4 kg heavier, not 5 % of what the person leaves of it."""
    bench, first, moving = push
    simulator, variant = bench.simulator, moving(70.0)
    errors = SensorErrors(simulator.channels)
    model = simulator.compile(variant.edit)
    here = track(simulator, model, bench.noise, errors, first, anew=True)
    heavier = simulator.compile(replace(variant, offsets={"mass": 1.0}).edit)
    change = predictions(simulator, here, heavier, errors)
    column = nuisance_columns(bench, here, variant)[RoughlyKnown("mass")]
    speed = list(simulator.channels).index("left_wheel_speed")
    for mine, there, linear in zip(here.predicted, change, column, strict=True):
        seen = (there - mine)[:, speed]
        assert np.std(linear[:, speed] - seen) < 0.2 * np.std(seen)


def test_a_variant_too_light_for_its_rider_moves_less_mass_farther(push):
    bench, _, moving = push
    light = replace(moving(80.0), offsets={"mass": -3.0})
    model = bench.simulator.compile(light.edit)
    body, actuator = model.body("rider_motion"), model.actuator("rider_motion")
    reach = actuator.gainprm[0] / -actuator.biasprm[1]
    assert body.mass[0] < 72.25 and math.isclose(body.mass[0] * reach, 80.0, rel_tol=1e-9)
    # the simulator shows no person, and moves one nevertheless: the upper body is high
    half = bench.simulator.compile(moving(36.0).edit)
    assert half.body("rider_motion").ipos[2] + half.body("rider_motion").pos[2] > 0.85


def test_a_body_at_rest_shakes_no_chair_and_one_that_moves_is_followed():
    """Noise of 0.5 mm at 100 Hz, unsmoothed, is 12 m/s^2 of acceleration."""
    rng, time = np.random.default_rng(0), np.arange(0.0, 8.0, 0.01)
    noise = 5e-4 * rng.standard_normal(time.size)
    sway = 0.03 * np.sin(2.0 * np.pi * 0.9 * time) + 0.01 * np.sin(2.0 * np.pi * 1.8 * time)
    rate = 2.0 * np.pi * 0.9
    gained = -(rate**2) * (0.03 * np.sin(rate * time) + 0.04 * np.sin(2.0 * rate * time))
    for place, truth in ((noise, 0.0 * time), (sway + noise, gained)):
        motion = _smoothed(time, place)
        seen = motion.place_at(time)
        acceleration = np.gradient(np.gradient(seen, time), time)
        inside = (time > 0.3) & (time < 7.5)
        assert np.std((acceleration - truth)[inside]) < 0.1
    # beyond its end a motion keeps its speed: a stop would be a blow
    after = motion.place_at(np.array([motion.time[-1], motion.time[-1] + 0.02]))
    assert np.diff(after)[0] == pytest.approx(0.02 * motion.start(motion.time[-1])[1])


def test_the_chi2_of_a_variant_is_that_of_its_linear_system(push):
    """It is known before the columns of its effects are made, with all else as it is."""
    bench, first, moving = push
    variant = replace(moving(60.0), offsets={"mass": 0.5, "centre_x": -1.0})
    known = nuisance_columns(bench, first, variant)
    here = nonlinear.placed(bench, variant, first, known)
    end = nonlinear._around(bench, here, known)
    outside = end.system.index(nonlinear._outside(bench, known))
    total = bounded.solve_nuisances(end.system, bench.windows, outside)[1]
    assert end.total == here.total == pytest.approx(total, rel=1e-12)


def test_no_columns_are_made_of_steps_that_fail(push, monkeypatch):
    """A body that moves 55 kg, and steps that are all made to fit worse than it."""
    bench, first, moving = push
    known = nuisance_columns(bench, first, moving(55.0))
    placed, made, tried = nonlinear.placed, [], []

    def worse(*args):
        tried.append(args[1].terms[0].values["mass"])
        here = placed(*args)
        return here if len(tried) == 1 else replace(here, total=here.total + 1e6)

    def columns(*args):
        made.append(args[2].terms[0].values["mass"])
        return term_columns(*args)

    monkeypatch.setattr(nonlinear, "placed", worse)
    monkeypatch.setattr(nonlinear, "term_columns", columns)
    end = nonlinear.refit(bench, moving(55.0), first, known)
    assert end.variant.terms[0].values["mass"] == 55.0
    assert len(tried) == 1 + nonlinear.FAILS and made == [55.0]
