"""The noise that a study shows: powers of sensors and levels of what shakes the chair, drawn and
found again on small systems; none of them is moved by what an effect makes."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import block_diag
from scipy.stats import multivariate_normal

from mjchair.diagnosis.fit import noise_levels
from mjchair.diagnosis.fit.noise_levels import Levels, WindowColumns
from mjchair.diagnosis.fit.process import KINDS, Part
from mjchair.diagnosis.fit.whitening import cosines
from mjchair.diagnosis.replay.noise import EDGES, Noise
from mjchair.diagnosis.replay.pulses import Force

ROWS, KNOTS, RUNS, WINDOWS = 40, 6, 6, 6
SPEED, GYRO = 0, 1  # channels
TRUE = {
    Part.DRIVE_FAST: 2.0,
    Part.DRIVE_SLOW: 0.5,
    Part.SIDE: 0.0,
    Part.YAW_FAST: 0.6,
    Part.YAW_SLOW: 0.1,
    Part.PERSON: 0.0,
    Part.WHEEL_TURN: 0.0,
    Part.CASTER_TURN: 0.0,
}
POWER = np.array([[4.0, 4.0, 4.0], [0.5, 1.0, 1.0]])


def windows(rng, shaken=1.0, effect=0.0):
    """Windows of two channels, each with the answers to forces that knots make.

    Args:
      shaken: by what the forces of the last run are multiplied. effect: size of a column.
    """
    frequency = np.tile(np.linspace(0.0, 9.9, ROWS), 2)
    channel = np.repeat([SPEED, GYRO], ROWS)
    band = np.minimum(np.searchsorted(EDGES, frequency, side="right"), len(EDGES) - 1)
    time = np.linspace(0.0, 2.0, KNOTS)
    apart = np.abs(time[:, None] - time[None, :])
    correlations = {p: np.exp(-apart / kind.time) for p, kind in KINDS.items()}
    out = []
    for run in np.repeat(np.arange(RUNS), WINDOWS):
        answers = {
            force: rng.standard_normal((2 * ROWS, KNOTS))
            for force in (Force.FORWARD, Force.LEFTWARD, Force.YAW)
        }
        column, state = rng.standard_normal((2, 2 * ROWS, 1))
        r = np.sqrt(POWER[channel, band]) * rng.standard_normal(2 * ROWS)
        r = r + effect * column[:, 0] + 3.0 * state[:, 0] * rng.standard_normal()
        for part, kind in KINDS.items():
            size = TRUE[part] * (shaken if run == RUNS - 1 else 1.0)
            course = rng.multivariate_normal(np.zeros(KNOTS), correlations[part])
            r = r + answers[kind.force] @ (size * course)
        out.append(
            WindowColumns(
                run=int(run),
                r=r,
                J=10.0 * column,
                Z=5.0 * state,
                pulses=answers,
                correlations=correlations,
                wobbles={},
                band=band,
                channel=channel,
                tells=frequency > noise_levels.LEAST_HZ,
            )
        )
    return out


def found(drawn, fixed=frozenset(), kinds=1):
    first = Levels(
        parts={part: np.full(RUNS, kind.first) for part, kind in KINDS.items()},
        wobbles={},
        bands=np.ones((2 * kinds, len(EDGES))),
    )
    least = np.full(first.bands.shape, 1e-4)
    return noise_levels.estimate(drawn, first, least, fixed, steps=40)


@pytest.fixture(scope="module")
def plain():
    return found(windows(np.random.default_rng(1)))


def test_the_powers_of_the_sensors_are_found(plain):
    np.testing.assert_allclose(plain.bands, POWER, rtol=0.2)


def test_the_levels_of_what_shakes_the_chair_are_found(plain):
    assert np.median(plain.parts[Part.DRIVE_FAST]) == pytest.approx(2.0, rel=0.15)
    assert np.median(plain.parts[Part.YAW_FAST]) == pytest.approx(0.6, rel=0.15)
    assert np.median(plain.parts[Part.SIDE]) < 0.15  # nothing pushes sideways


def test_what_an_effect_makes_is_no_noise(plain):
    more = found(windows(np.random.default_rng(1), effect=20.0))
    np.testing.assert_allclose(more.bands, plain.bands, rtol=0.02)
    np.testing.assert_allclose(more.parts[Part.DRIVE_FAST], plain.parts[Part.DRIVE_FAST], rtol=0.02)


def test_one_run_that_is_pushed_hard_does_not_raise_the_level_of_all():
    event = found(windows(np.random.default_rng(2), shaken=20.0)).parts[Part.DRIVE_FAST]
    assert np.median(event[:-1]) < 3.0
    assert event[-1] < 2.5 * np.median(event[:-1])  # of the 20 times that an event made of it


def test_a_run_that_stands_tells_nothing_of_what_shakes_one_that_rolls(plain):
    """Beside a run that stood, what shakes coasts was taken for a third of what it is."""
    drawn = windows(np.random.default_rng(1), shaken=0.0)
    stand = [replace(w, stands=w.run == RUNS - 1) for w in drawn]
    known, all_roll = (found(ws).parts[Part.DRIVE_FAST] for ws in (stand, drawn))
    assert all_roll[-1] < 0.5 * known[-1]
    np.testing.assert_allclose(known[-1], np.median(known), rtol=0.2)
    none = found([replace(w, stands=True) for w in drawn]).parts[Part.DRIVE_FAST]
    np.testing.assert_array_equal(none, KINDS[Part.DRIVE_FAST].first)


def test_a_level_that_a_person_gave_stays():
    kept = found(windows(np.random.default_rng(1)), frozenset({Part.DRIVE_FAST}))
    np.testing.assert_array_equal(kept.parts[Part.DRIVE_FAST], KINDS[Part.DRIVE_FAST].first)


def test_the_deviance_is_that_of_all_numbers_together():
    """Against the density of the normal distribution that the levels make of three windows."""
    drawn = windows(np.random.default_rng(3), effect=1.0)[:3]
    levels = Levels(
        parts={part: np.full(RUNS, 0.5 * kind.first) for part, kind in KINDS.items()},
        wobbles={},
        bands=POWER,
    )
    J = np.vstack([w.J for w in drawn])
    cover = block_diag(
        *(
            np.diag(POWER[w.channel, w.band])
            + w.Z @ w.Z.T
            + sum(
                levels.parts[part][w.run] ** 2
                * w.pulses[kind.force]
                @ w.correlations[part]
                @ w.pulses[kind.force].T
                for part, kind in KINDS.items()
            )
            for w in drawn
        )
    )
    law = multivariate_normal(cov=cover + J @ J.T)
    r = np.concatenate([w.r for w in drawn])
    constant = r.size * np.log(2.0 * np.pi)
    expected = -2.0 * law.logpdf(r) - constant
    assert noise_levels.deviance(drawn, levels) == pytest.approx(expected, rel=1e-6)


def test_windows_in_which_a_caster_shimmies_have_powers_of_their_own():
    """What is left of a shimmy made a caster's angle 12 times as loud in every window."""
    rng = np.random.default_rng(1)
    drawn = []
    for k, w in enumerate(windows(rng)):
        if k % 2 == 0:
            louder = np.sqrt(8.0 * POWER[w.channel, w.band]) * rng.standard_normal(w.r.size)
            w = replace(w, r=w.r + louder, channel=w.channel + len(POWER))
        drawn.append(w)
    apart = found(drawn, kinds=2)
    ratio = apart.bands / np.vstack([POWER, 9.0 * POWER])
    np.testing.assert_allclose(ratio.mean(axis=1), 1.0, rtol=0.15)
    known = {c: Noise(1.0, 0.0, 1.0, "a guess") for c in ("speed", "gyro")}
    noise = noise_levels.with_levels(known, list(known), np.array([0.01, 0.01]), apart)
    frequency = np.array([1.0, 4.0, 8.0])
    for k, channel in enumerate(known):
        calm, shimmying = (noise[channel].where(s).power(frequency, 0.01) for s in (False, True))
        np.testing.assert_array_equal(calm, apart.bands[k])
        np.testing.assert_array_equal(shimmying, apart.bands[len(POWER) + k])
    alike = Noise(0.3, 0.4, 0.05, "given")
    assert alike.where(True) is alike


def test_what_shakes_harder_than_it_can_is_left_in_the_gap():
    drawn = windows(np.random.default_rng(1))
    first = Levels(
        parts={part: np.full(RUNS, kind.first) for part, kind in KINDS.items()},
        wobbles={},
        bands=np.ones((2, len(EDGES))),
    )
    held = noise_levels.estimate(
        drawn,
        first,
        np.full((2, len(EDGES)), 1e-4),
        most={
            part: np.full(RUNS, most)
            for part, most in ((Part.DRIVE_FAST, 0.7), (Part.DRIVE_SLOW, 0.7), (Part.PERSON, 0.0))
        },
    )
    assert held.parts[Part.DRIVE_FAST].max() == pytest.approx(0.7)
    assert held.parts[Part.YAW_FAST].max() > 0.4


@pytest.mark.parametrize(("turns", "told"), [(1e-5, False), (1.0, True)])
def test_a_level_that_no_number_tells_does_not_wander(turns, told):
    """Where casters hardly turned, a force once a turn went from nearly nothing to 1.9 N."""
    drawn = windows(np.random.default_rng(1))
    drawn[0].correlations[Part.CASTER_TURN] *= turns  # which all windows share
    first = Levels(  # the last run is held out
        parts={part: np.full(RUNS + 1, kind.first) for part, kind in KINDS.items()},
        wobbles={},
        bands=np.ones((2, len(EDGES))),
    )
    most = {part: np.full(RUNS + 1, 5.0) for part in KINDS}
    shown = noise_levels.estimate(drawn, first, np.full((2, len(EDGES)), 1e-4), most=most)
    quiet = shown.parts[Part.CASTER_TURN] == pytest.approx(noise_levels.UNTOLD * 5.0)
    assert quiet != told
    assert np.median(shown.parts[Part.YAW_FAST]) == pytest.approx(0.6, rel=0.15)


def test_the_cosines_of_a_window_are_orthonormal():
    waves = cosines(50, 20)
    np.testing.assert_allclose(waves.T @ waves, np.eye(20), atol=1e-12)


def test_the_power_of_an_autoregressive_noise_is_that_of_its_samples():
    """The mean over all frequencies is the variance of a sample, and a draw shows the shape."""
    noise, step, n = Noise(0.3, 0.4, 0.05, "given"), 0.01, 400
    every = noise.power(np.arange(n) / (2.0 * n * step), step)
    assert every.mean() == pytest.approx(0.25, rel=0.01)
    rng = np.random.default_rng(3)
    keep = np.exp(-step / noise.time)
    drawn = np.zeros((2000, n))
    drawn[:, 0] = noise.slow * rng.standard_normal(2000)
    for k in range(1, n):
        kick = noise.slow * np.sqrt(1.0 - keep**2) * rng.standard_normal(2000)
        drawn[:, k] = keep * drawn[:, k - 1] + kick
    drawn += noise.white * rng.standard_normal(drawn.shape)
    seen = ((drawn @ cosines(n, 40)) ** 2).mean(axis=0)
    np.testing.assert_allclose(seen[1:], every[1:40], rtol=0.15)


def test_measured_bands_stand_in_for_the_model():
    noise = Noise(0.3, 0.4, 0.05, "given", bands=(9.0, 4.0, 1.0))
    power = noise.power(np.array([0.0, 2.9, 3.0, 6.0, 50.0]), 0.01)
    np.testing.assert_array_equal(power, [9.0, 9.0, 4.0, 1.0, 1.0])


def test_of_two_runs_an_event_in_one_is_no_level():
    """A push by an attendant, once, was what no two strokes have alike: nothing was missing."""
    level, due = np.array([0.01, 0.01, 0.01]), np.array([2e5, 2e5, 1e2])
    shown = due * np.array([1.0, 400.0, 0.0])  # the last run hardly tells it
    quiet, loud, _ = noise_levels._of_runs(level, shown, due)
    assert loud < 2.0 * quiet * (1.0 + 1e-9)
    assert quiet == pytest.approx(0.01, rel=0.3)
