"""Strokes of a run: when they begin, their phase, and a body that moves in step with them."""

import numpy as np

import mjchair
from mjchair.diagnosis.data.study import Run, make_study
from mjchair.diagnosis.fit.bench import Bench
from mjchair.diagnosis.fit.parameter_columns import term_columns
from mjchair.diagnosis.fit.variant import Term, Variant, nudged
from mjchair.diagnosis.replay import noise, strokes
from mjchair.diagnosis.replay.derivatives import predictions
from mjchair.diagnosis.replay.sensor_errors import SensorErrors
from mjchair.diagnosis.replay.simulator import WindowSimulator
from mjchair.diagnosis.replay.window_states import track
from mjchair.effects import stroke_motion
from mjchair.measurement.trial import Trial
from mjchair.simulation.initial import Initial

TIME = np.arange(0.0, 20.0, 0.01)


def pushed(begins, width=0.45, peak=10.0):
    torque = np.zeros(TIME.size)
    for begin in begins:
        x = (TIME - begin) / width
        torque += np.where((x > 0.0) & (x < 1.0), peak * np.sin(np.pi * x) ** 2, 0.0)
    inputs = mjchair.Inputs(TIME, {"left_wheel": torque, "right_wheel": torque})
    channels = {"left_wheel_speed": np.ones(TIME.size)}
    return Run(Trial("push", TIME, channels, inputs, {}), "push", False, Initial(), frozenset())


def test_strokes_are_found_and_the_phase_grows_by_one_turn_each():
    begins = np.array([1.0, 2.0, 3.1, 4.0, 5.2])
    found = strokes.beginnings(pushed(begins))
    np.testing.assert_allclose(np.diff(found), np.diff(begins), atol=0.011)
    (bout,) = strokes.bouts(found)
    np.testing.assert_allclose(bout.phase(found), 2.0 * np.pi * np.arange(5), atol=1e-9)
    assert (np.diff(bout.phase(np.arange(0.5, 6.0, 0.01))) > 0.0).all()


def test_a_body_rests_before_and_after_and_in_a_pause():
    begins = np.r_[np.arange(2.0, 6.0), np.arange(12.0, 16.0)]
    course = strokes.courses(pushed(begins))["stroke_sine_1"]
    assert np.abs(course.place_at(np.array([0.0, 0.9, 8.5, 10.0, 18.5]))).max() < 1e-9
    assert np.abs(course.place_at(np.arange(2.0, 6.0, 0.01))).max() > 0.99
    speed = np.diff(course.place_at(np.arange(0.0, 20.0, 0.005))) / 0.005
    assert np.abs(np.diff(speed)).max() < 0.6  # no steps of speed: those would be blows


def test_two_pushes_or_a_coast_have_no_strokes():
    assert strokes.courses(pushed([2.0, 3.0])) == {}
    coast = Trial("coast", TIME, {"left_wheel_speed": np.ones(TIME.size)}, None, {})
    assert strokes.courses(Run(coast, "coast", False, Initial(), frozenset())) == {}


def test_a_study_of_a_moving_rider_starts_and_goes_on_as_its_tables_say():
    """Joints of the tables drive the study's chair: it predicts its own runs, a rigid one not."""
    time = np.arange(0.0, 4.0, 0.01)
    bend = 0.15 * np.cos(2.0 * np.pi * 0.9 * time)
    controls = {"rider_trunk_flexion": bend}
    moving = mjchair.load_spec(rider="moving")
    inputs = mjchair.Inputs(time, controls)
    run = mjchair.simulate(moving, inputs, 4.0, initial={"speed": 1.0}, sample_rate=100.0)
    seen = {"left_wheel_speed": np.array(run["left_wheel_speed"])}
    left = {}
    for name, spec, given in (("moving", moving, inputs), ("rigid", mjchair.load_spec(), None)):
        trial = Trial("nod", np.array(run.time), seen, given, {})
        study = make_study(spec, [Run(trial, "nod", False, Initial(), frozenset())])
        simulator = WindowSimulator(study)
        found = track(simulator, simulator.base, noise.estimate(study))
        left[name] = np.concatenate(
            [
                (simulator.measured(w) - predicted)[:, 0]
                for w, predicted in zip(simulator.windows, found.predicted, strict=True)
            ]
        )
    assert np.std(left["moving"]) < 0.02
    assert np.std(left["moving"]) < 0.1 * np.std(left["rigid"])


def test_a_body_that_moves_in_step_with_strokes_changes_nothing_where_there_are_none():
    """The windows of a coast are not simulated for it, and would show nothing if they were."""
    spec = mjchair.load_spec("manual")
    coast = Trial("coast", TIME, {"left_wheel_speed": np.ones(TIME.size)}, None, {})
    runs = [
        pushed(np.arange(1.0, 19.0)),
        Run(coast, "coast", False, Initial(speed=1.0), frozenset()),
    ]
    simulator = WindowSimulator(make_study(spec, runs, {"left_wheel_speed": 0.01}), threads=1)
    effect = stroke_motion.EFFECT.on(spec)
    still = simulator.without_motion(effect.measured)
    assert {simulator.windows[i].run for i in still} == {1}
    assert len(still) == sum(w.run == 1 for w in simulator.windows)
    assert simulator.without_motion(None) == frozenset()

    swaying = dict.fromkeys(stroke_motion.WAVES, 0.0) | {"sine_1": 1.0}
    variant = Variant((), terms=(Term(effect, swaying, ("sine_1",)),))
    bench = Bench(simulator, noise.estimate(simulator.study), ())
    here = track(simulator, simulator.compile(variant.edit), bench.noise)
    (column,) = term_columns(bench, here, variant).values()
    beside, _ = nudged(variant, variant.terms[0], effect.parameter("sine_1"))
    errors = SensorErrors(simulator.channels)
    model = simulator.compile(variant.edit)
    rest = predictions(simulator, here, model, errors, coarse=True)
    moved = predictions(simulator, here, simulator.compile(beside.edit), errors, coarse=True)
    for i, (values, one, other) in enumerate(zip(column, rest, moved, strict=True)):
        if i in still:
            assert not values.any() and np.abs(other - one).max() < 1e-12
        else:
            assert np.abs(values).max() > 1e-3
