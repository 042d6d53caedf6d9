"""How far the slow state of a window is fitted, on numbers alone: nothing is simulated."""

import contextlib
from types import SimpleNamespace

import numpy as np
import pytest

from mjchair.diagnosis.replay import window_search, window_states
from mjchair.diagnosis.replay.chair_state import SLOW, STEPS
from mjchair.diagnosis.replay.noise import Noise

CHANNELS = ("left_wheel_angle", "imu_gyro.z")
WHITE = np.array([0.01, 0.02])
SLOPE = np.linspace(0.0, 1.0, 50)


def _chair(simulator, errors):
    return window_search.Searched(
        simulator=simulator,
        model="fine",
        coarse="coarse",
        errors=errors,
        white=[WHITE] * len(simulator.windows),
        kept=True,
    )


@pytest.fixture
def step(monkeypatch):
    """A step of a state of which one part turns the chair, for a residual (rows, channels)."""
    monkeypatch.setattr(window_search, "prior", lambda *_: np.ones(len(SLOW)))
    monkeypatch.setattr(window_search, "residual", lambda measured, seen, _: measured - seen)
    slow = np.zeros((50, 2, len(SLOW)))
    slow[:, 1, 4] = SLOPE

    def promised(miss):
        simulator = SimpleNamespace(
            channels=CHANNELS, windows=[None], measured=lambda _: miss, chair=None
        )
        seen = np.zeros((50, 2))
        size = window_search.misfit(simulator, None, seen, WHITE)
        search = window_search.Search(None, None, size, predicted=seen, slow=slow)
        return window_search._step(simulator, 0, search, WHITE)

    return promised


def test_the_zero_of_a_wheel_promises_nothing_of_the_state(step):
    """It is free wherever the state is; counted, it kept windows going for six rounds."""
    miss = np.zeros((50, 2))
    miss[:, 0] = 0.3
    change, promise = step(miss)
    assert abs(promise) < 1e-6 and np.abs(change).max() < 1e-6


def test_a_step_promises_what_it_explains(step):
    miss = np.zeros((50, 2))
    miss[:, 0], miss[:, 1] = 0.3, 0.1 * SLOPE
    change, promise = step(miss)
    curvature = (SLOPE @ SLOPE) / WHITE[1] ** 2
    shrunk = curvature / (curvature + STEPS[4] ** 2)  # by its prior
    assert change[4] == pytest.approx(0.1 * shrunk)
    assert promise == pytest.approx(0.01 * curvature * shrunk)


@pytest.mark.parametrize(
    ("promise", "stands", "kept", "rounds"),
    [
        (window_search.PROMISE, False, False, 0),  # what it promises, the elimination does
        (5.0, False, False, window_search.ROUNDS + window_search.MORE),
        (5.0, True, False, window_search.ROUNDS),  # at rest a chair answers in steps
        (5.0, False, True, window_search.ROUNDS),  # answers of another chair lead astray
    ],
)
def test_how_long_a_window_goes_on(promise, stands, kept, rounds):
    search = window_search.Search(None, None, promise=promise)
    going = [window_search._goes_on(search, k, kept, stands) for k in range(9)]
    assert going == [True] * rounds + [False] * (9 - rounds)
    search.calm = True
    assert not window_search._goes_on(search, 0, kept, stands)


@pytest.mark.parametrize(("size", "rounds"), [(np.inf, 1), (100.0, 1), (40.0, 10)])
def test_the_state_of_a_shimmy_is_sought_longer_but_not_for_a_little_of_its_misfit(size, rounds):
    """A step promises 5; of a chair that is not right the rest is not for the state."""
    search = window_search.Search(None, None, size, promise=5.0, shimmies=True)
    going = [window_search._goes_on(search, k, False, False) for k in range(12)]
    assert going == [True] * rounds + [False] * (12 - rounds)


@pytest.mark.parametrize(
    ("slow", "rolls", "stands"), [(True, False, True), (True, True, False), (False, False, False)]
)
def test_a_chair_that_a_channel_sees_roll_does_not_stand(slow, rolls, stands):
    """A step of a fit that led to rest held a chair there that rolled: chi2 of 70 000 in 2 s."""
    chair = SimpleNamespace(stands=lambda _: slow)
    simulator = SimpleNamespace(chair=chair, rolls=[rolls])
    assert window_search.stands(simulator, 0, None) == stands


def test_what_a_wrong_chair_misses_tells_less_of_a_state_that_no_channel_sees(step):
    """Casters that no channel sees turned round to make up for a rider who was not there."""
    weak = 1e-3 * np.outer(SLOPE, [0.0, 1.0])  # of the residual, the caster would explain a part
    change, _ = step(weak)
    assert change[4] > 0.0
    louder = np.array([0.0, 2000.0]) * np.sin(20.0 * SLOPE)[:, None]  # of 1e5 deviations
    more, promise = step(weak + louder)
    alone, _ = step(louder)
    assert abs(more[4] - alone[4]) < 0.2 * abs(change[4])
    assert promise > window_search.PROMISE


def test_a_step_that_promised_much_and_failed_is_made_anew_with_small_changes(monkeypatch):
    """Answers to large changes, at a coarse step, lead astray where a wheel slides or shimmies."""
    asked = []

    def answers(simulator, model, errors, states, share, shown):
        asked.extend((model, i, share) for i in states)
        return {i: "new" for i in states}

    worse = SimpleNamespace(predicted=None, trace={})
    monkeypatch.setattr(window_search, "_traced", lambda *_: {0: worse, 1: worse})
    monkeypatch.setattr(window_search, "misfit", lambda *_: 9.0)
    monkeypatch.setattr(window_search, "answers", answers)
    monkeypatch.setattr(window_search, "_step", lambda *_: (np.ones(len(SLOW)), 5.0))
    chair = SimpleNamespace(stands=lambda _: False, moved=lambda state, change: change)
    simulator = SimpleNamespace(windows=[None, None], chair=chair, rolls=[True, True])
    errors = SimpleNamespace(applied=lambda *_: None)
    going = {k: window_search.Search("tried", "best", 4.0, slow="old") for k in range(2)}
    going[0].promise, going[1].promise = 2.0, 0.3
    window_search._fit_round(_chair(simulator, errors), going)
    assert asked == [("fine", 0, window_search.FINER)]
    assert [search.slow for search in going.values()] == ["new", "old"]
    assert going[0].touchy and not going[1].touchy
    assert window_search._goes_on(going[0], window_search.ROUNDS, kept=True, stands=False)
    assert not window_search._goes_on(going[1], window_search.ROUNDS, kept=True, stands=False)


def test_corrected_answers_are_right_of_the_last_step_and_as_they_were_beside_it():
    random = np.random.default_rng(7)
    slow, brought = random.normal(size=(5, 2, len(SLOW))), random.normal(size=(5, 2))
    change, other = random.normal(size=(2, len(SLOW)))
    other -= change * (other @ change) / (change @ change)
    corrected = window_search._corrected(slow, change, brought)
    np.testing.assert_allclose(corrected @ change, brought)
    np.testing.assert_allclose(corrected @ other, slow @ other)


@pytest.mark.parametrize(
    ("size", "fresh", "corrected", "what"),
    [
        (2.0, True, False, "old"),  # it brought 7 of the 8 that it promised
        (8.0, True, False, "corrected"),  # it brought 1
        (8.0, False, True, "new"),  # again, though answers were corrected by the step before
        (2.0, False, True, "old"),
        (9.5, False, False, "new"),  # it failed, and answers are of another place
        (9.5, False, True, "new"),
        (9.5, True, False, "old"),  # it failed by its length
    ],
)
def test_answers_are_corrected_and_then_made_anew_where_a_step_brings_less_than_they_promise(
    monkeypatch, size, fresh, corrected, what
):
    """A fit in which 11 of 12 windows were touchy took 2119 simulations, and so 597."""
    asked = []

    def answers(simulator, model, errors, states, share, shown):
        asked.extend(states)
        return dict.fromkeys(states, "new")

    seen = np.zeros((4, 2))
    shown = SimpleNamespace(predicted=seen, trace={})
    monkeypatch.setattr(window_search, "_traced", lambda *_: {0: shown})
    monkeypatch.setattr(window_search, "misfit", lambda *_: size)
    monkeypatch.setattr(window_search, "answers", answers)
    monkeypatch.setattr(window_search, "_corrected", lambda *_: "corrected")
    monkeypatch.setattr(window_search, "_step", lambda *_: (np.ones(len(SLOW)), 5.0))
    chair = SimpleNamespace(stands=lambda _: False, moved=lambda state, change: change)
    simulator = SimpleNamespace(windows=[None], chair=chair, rolls=[True])
    errors = SimpleNamespace(applied=lambda *_: seen)
    search = window_search.Search(
        "tried", "best", 9.0, touchy=True, fresh=fresh, corrected=corrected, promise=8.0
    )
    search.slow, search.predicted = "old", seen
    window_search._fit_round(_chair(simulator, errors), {0: search})
    assert search.slow == what and asked == ([0] if what == "new" else [])


@pytest.mark.parametrize("kept", [True, False])
def test_before_the_first_step_nothing_is_known_of_the_answers_of_a_chair_near_by(kept):
    search = window_search.Search("tried", "best", 9.0, touchy=True, predicted=np.zeros((4, 2)))
    before = window_search.Search("tried", "tried", touchy=True)
    window_search._weigh_answers(search, before, kept)
    assert not search.corrected and search.fresh is not kept


@pytest.mark.parametrize(("placed", "shimmies"), [(True, False), (False, True)])
def test_what_a_window_cannot_tell_is_not_simulated(placed, shimmies, monkeypatch):
    """The prior of a position that no channel sees holds it."""
    seen = np.r_[placed, placed, True, True, True, True, False]
    monkeypatch.setattr(window_search.first_state, "observed", lambda _: seen)

    def run(jobs):  # each channel shows the sum of the state
        return [SimpleNamespace(predicted=np.full((4, 2), job.state.sum())) for job in jobs]

    simulator = SimpleNamespace(
        chair=SimpleNamespace(moved=lambda state, step: state + step),
        windows=[SimpleNamespace(run=0, shimmies=shimmies)],
        study=SimpleNamespace(runs=[None]),
        run=run,
    )
    errors = SimpleNamespace(applied=lambda _simulator, _window, predicted: predicted)
    states = {0: np.ones(len(SLOW))}
    (answers,) = window_search.answers(simulator, None, errors, states, 0.5).values()
    # a caster that is not seen is told later; how one swings, only where it is seen to shimmy
    told = [placed, placed, True, True, True, True, True, shimmies, False, shimmies, False]
    expected = np.where(told, STEPS, 0.0)
    np.testing.assert_allclose(answers, np.broadcast_to(expected, (4, 2, len(SLOW))))


def test_the_states_of_a_hopeless_chair_are_not_sought(monkeypatch):
    """Casters that turn over and over cost 16 simulations a window, and no state helps."""
    rounds, misfit = [], [0.0]
    before = window_states.Track([np.zeros(2)], [np.zeros((4, 2))], ["kept"], [{}])
    shown = SimpleNamespace(predicted=np.full((4, 2), 1e4), trace={})
    monkeypatch.setattr(window_states, "installed", contextlib.nullcontext)
    monkeypatch.setattr(window_states, "SensorErrors", lambda _: SimpleNamespace())
    monkeypatch.setattr(window_search, "stands", lambda *_: False)
    monkeypatch.setattr(window_search, "_traced", lambda *_: {0: shown})
    for module in (window_search, window_states):
        monkeypatch.setattr(module, "misfit", lambda _s, _w, seen, _n: float(seen.sum()))

    def one(chair, going):
        rounds.append(len(going))
        for search in going.values():
            search.judge(misfit[0], shown.predicted, {})

    monkeypatch.setattr(window_search, "_fit_round", one)
    simulator = SimpleNamespace(
        channels=CHANNELS,
        windows=[SimpleNamespace(index=0, rows=np.arange(4), shimmies=False)],
        coarsened=lambda model: model,
    )
    errors = SimpleNamespace(applied=lambda _simulator, _window, predicted: predicted)
    noise = dict.fromkeys(CHANNELS, Noise(1.0, 0.0, 1.0, "given"))
    limit = window_states.HOPELESS * 8.0  # samples: the chair before misses none
    for size, expected in ((0.9 * limit, window_search.ROUNDS), (1.1 * limit, 1)):
        rounds.clear()
        misfit[0] = size
        found = window_states.track(simulator, "model", noise, errors, before)
        assert len(rounds) == expected
        assert found.states[0] is not before.states[0] and (found.predicted[0] == 1e4).all()
