"""Torques that were recorded late or early: how a chair takes them, and how a fit finds them."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from noisy_run import NOISE, noisy_run

import mjchair
from mjchair import practice
from mjchair.diagnosis.data.study import make_study
from mjchair.diagnosis.explain import hypotheses
from mjchair.diagnosis.explain.fits import Fits
from mjchair.diagnosis.explain.screening import prepare, screen_columns
from mjchair.diagnosis.fit.column_ids import ParameterId
from mjchair.diagnosis.replay.simulator import Job, WindowSimulator
from mjchair.diagnosis.replay.window_states import first_states
from mjchair.effects.library import find
from mjchair.model import torque_timing
from mjchair.simulation.initial import Initial
from mjchair.simulation.inputs import Inputs, push_strokes

DELAY = 0.06  # s
TIME = np.arange(0.0, 6.0, 0.01)
# a record that begins and ends without torque is the same whenever it was started
STROKES = push_strokes({"left_wheel": 5.0, "right_wheel": 4.5}, 5.5)


# one that ends amid a stroke, whose torque is recorded after the end
ONWARD = push_strokes({"left_wheel": 5.0, "right_wheel": 4.5}, 9.0)


def recorded(late, strokes=STROKES):
    """The strokes, as a device writes them that is late (s)."""
    moved = {name: strokes.at(name, TIME - late) for name in strokes.controls}
    return Inputs(TIME, moved)


def with_delay(spec, delay):
    changed = spec.copy()
    find("torque_delay").apply(changed, {"delay": delay})
    return changed


@pytest.mark.parametrize("late", [DELAY, -DELAY])
def test_a_chair_with_the_delay_takes_late_torques_as_they_acted(late):
    spec = mjchair.load_spec()
    truth = mjchair.simulate(spec, recorded(0.0), 5.0)
    taken = mjchair.simulate(with_delay(spec, late), recorded(late), 5.0)
    wrong = mjchair.simulate(spec, recorded(late), 5.0)
    speed = truth["velocity.x"]
    assert (
        np.abs(taken["velocity.x"] - speed).max() < 0.02 * np.abs(wrong["velocity.x"] - speed).max()
    )


def test_two_delays_add_and_stay_in_a_saved_model():
    spec = with_delay(with_delay(mjchair.load_spec(), DELAY), -0.02)
    with mjchair.installed():
        saved = mujoco.MjModel.from_xml_string(spec.to_xml())
    for model in (spec.compile(), saved):
        assert torque_timing.recorded_late(model, 0) == pytest.approx(DELAY - 0.02)
        assert torque_timing.recorded_late(model, 2) == 0.0  # a tire's


def study(strokes=STROKES, seconds=5.0):
    """Two pushed runs whose torques were recorded late, and a coast."""
    rng = np.random.default_rng(3)
    spec = mjchair.load_spec()
    start = Initial((0.0, 0.0), 0.0, 0.6)
    pushed = recorded(0.0, strokes)
    runs = [noisy_run(rng, spec, f"push {k}", start, seconds, pushed) for k in range(2)]
    device, there = recorded(DELAY, strokes), seconds >= TIME
    known = Inputs(TIME[there], {name: torque[there] for name, torque in device.controls.items()})
    late = [replace(r, trial=replace(r.trial, inputs=known)) for r in runs]
    coast = noisy_run(rng, spec, "coast", Initial((0.0, 0.0), 0.0, 1.2), 4.0)
    return replace(make_study(spec, [*late, coast], NOISE), torque_measured=True)


def test_models_of_one_batch_keep_their_own_delays():
    """The controls of a window were made once for all models that have as many actuators."""
    known = study()
    simulator = WindowSimulator(known, threads=1)
    window = simulator.windows[0]
    models = [simulator.compile(lambda s, d=d: find("torque_delay").apply(s, {"delay": d}))
              for d in (0.0, DELAY)]  # fmt: skip
    state = first_states(simulator, models[0])[0]
    jobs = [Job(model=m, window=window, state=state) for m in models]
    together = [o.predicted for o in simulator.run(jobs)]
    alone = [simulator.run([job])[0].predicted for job in jobs]
    assert np.abs(together[0] - together[1]).max() > 1e-3
    np.testing.assert_array_equal(together, alone)


@pytest.mark.parametrize(("strokes", "seconds"), [(STROKES, 5.0), (ONWARD, 5.3)])
def test_the_delay_comes_back(strokes, seconds):
    """40 ms of another simulation were `unknown`, and chair and rider not one rigid body; 50 ms of
    runs that end amid a stroke were a rider who moves, and two early sensors."""
    bench, first = prepare(study(strokes, seconds), threads=1)
    base = screen_columns(bench, first, [find("torque_delay")])
    (found,) = hypotheses.singles(base.reduced, base.starts)
    fitted = Fits(base, lambda line: None).fit(found).fitted
    (term,) = fitted.variant.terms
    std = fitted.std[ParameterId("torque_delay", "delay")]
    assert abs(term.values["delay"] - DELAY) < 3.0 * std < 0.03
    assert base.plain.total - fitted.total > 50.0


def test_the_remark_says_which_is_late():
    said = find("torque_delay").remark
    assert said({"delay": 0.04}, {"delay": 0.002}).endswith(
        "40.0 ± 2 ms later than the other columns"
    )
    assert "40.0 ± 2 ms earlier" in said({"delay": -0.04}, {"delay": 0.002})


def test_a_practice_study_says_that_its_torques_were_measured():
    """Of commands no delay is looked for, so that the hidden one was not found."""
    files = practice.hide(find("torque_delay"))
    assert 'torque = "measured"' in files["study.toml"]
    assert "torque =" not in practice.hide(find("toe"))["study.toml"]
