"""Starts of an effect: every choice of its sizes; what only shapes them is no column."""

from dataclasses import replace

import numpy as np
import pytest
from noisy_run import NOISE, noisy_run

import mjchair
from mjchair.diagnosis import diagnose
from mjchair.diagnosis.data.study import make_study
from mjchair.diagnosis.explain import candidates
from mjchair.diagnosis.explain.column_ids import EffectGroup
from mjchair.diagnosis.fit.variant import Variant
from mjchair.effects import caster_friction
from mjchair.effects.library import find
from mjchair.errors import MjchairError
from mjchair.simulation.initial import Initial
from mjchair.simulation.inputs import Inputs

EFFECT = caster_friction.ONE_SIDED
GROUP = EffectGroup("caster_friction", 0)


def starts():
    (seed,) = EFFECT.starts()
    assert len(seed.points) == len(seed.factors) == 2
    return candidates._choices(EFFECT, GROUP, candidates._ids(GROUP, len(seed.points)))


def test_a_column_is_the_answer_to_one_size_with_what_shapes_it_as_it_is():
    (seed,) = EFFECT.starts()
    assert [point["slope"] for point in seed.points] == [2.0, 2.0]
    sizes = np.array([[point["left"], point["right"]] for point in seed.points])
    np.testing.assert_allclose(sizes * np.array(seed.factors)[:, None], 0.3 * np.eye(2))


def test_what_shapes_an_effect_is_free_in_every_choice_of_its_sizes():
    free = [start.free for start in starts()]
    assert free == [("left", "slope"), ("right", "slope"), ("left", "right", "slope")]
    assert [len(start.columns) for start in starts()] == [1, 1, 2]


def test_coefficients_are_of_the_sizes_alone():
    left, _, both = starts()
    assert left.term(np.array([2.0])).values == {"left": 0.6, "right": 0.0, "slope": 2.0}
    assert both.term(np.array([1.0, 2.0])).values == {"left": 0.3, "right": 0.6, "slope": 2.0}


@pytest.mark.parametrize(
    ("coefficients", "allowed", "possible"),
    [([1.0, 1.0], True, True), ([1.0, -0.1], False, False), ([1.0, 67.0], True, False)],
)
def test_sizes_are_on_their_side_and_not_far_beyond_their_bounds(coefficients, allowed, possible):
    *_, both = starts()
    assert both.allows(np.array(coefficients)) == allowed
    assert both.can_be(np.array(coefficients)) == possible


def test_the_slope_below_the_friction_has_bounds():
    EFFECT.check({"left": 0.5, "slope": 0.3})
    with pytest.raises(
        MjchairError, match=r"slope is 0\.1 N m s/rad; it must be within 0\.3 to 60"
    ):
        EFFECT.check({"left": 0.5, "slope": 0.1})


GYRO = "imu_gyro.z"


def slalom(late, rolling):
    """Where effects are screened: a slalom whose gyroscope is late (s), of a chair that drags."""
    time = np.arange(0.0, 4.02, 0.01)
    swing = 2.0 * np.sin(2.0 * np.pi * 0.8 * time)
    pushed = Inputs(time, {"left_wheel": 1.0 + swing, "right_wheel": 1.0 - swing}, "slalom")
    spec = mjchair.load_spec()
    find("rolling_resistance").apply(spec, {"coefficient": rolling})
    rng = np.random.default_rng(5)
    run = noisy_run(rng, spec, "slalom", Initial((0.0, 0.0), 0.0, 1.0), 4.0, pushed)
    shown = np.interp(run.trial.time - late, run.trial.time, run.trial.channels[GYRO])
    trial = replace(run.trial, channels={**run.trial.channels, GYRO: shown})
    study = make_study(mjchair.load_spec(), [replace(run, trial=trial)], NOISE)
    bench, first = diagnose.prepare(study)
    variant = Variant(bench.nuisances)
    return candidates.Around(bench=bench, track=first, variant=variant, pulses=(), answers=())


@pytest.mark.parametrize(
    ("channel", "late", "rolling", "size"),
    [
        (GYRO, 0.2, 0.0, 0.2),
        (GYRO, -0.1, 0.0, -0.1),
        (GYRO, 0.0, 0.0, 0.02),
        ("right_wheel_speed", 0.0, 0.01, 0.02),  # 0.2 s early tells more, but not of a delay
    ],
)
def test_a_delay_is_screened_by_the_column_that_tells_it(channel, late, rolling, size):
    """An accelerometer 0.2 s late passed for one that shows nothing."""
    effect = find("sensor_delay", channel)
    around = slalom(late, rolling)
    assert candidates._best_delay(around, effect, effect.fitted[0]) == size
    made = candidates.collect(around, [effect], lambda _: None)
    (start,) = made.starts
    # what the column promises of a delay is that delay
    assert start.term(np.array([size / 0.02])).values == pytest.approx({"delay": size})
    promised = size / 0.02 * np.concatenate(made.columns[start.columns[0]])
    shown = np.concatenate(candidates._of_sensor(around, effect, size))
    np.testing.assert_allclose(promised, shown, atol=1e-12)
