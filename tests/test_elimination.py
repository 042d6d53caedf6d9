"""What a window frees beside its state: the drift of sensors, on numbers alone."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from mjchair.diagnosis.fit import elimination
from mjchair.diagnosis.replay.chair_state import SLOW
from mjchair.measurement.sensors import sensor

CHANNELS = ("left_wheel_speed", "imu_gyro.z", "imu_accelerometer.x")
ROWS = 40


def simulator(count, nuisance=None):
    """A study of one run of some windows, and of another of one."""
    windows = [SimpleNamespace(run=0) for _ in range(count)] + [SimpleNamespace(run=1)]
    return SimpleNamespace(
        channels=CHANNELS, windows=windows, study=SimpleNamespace(nuisance=nuisance or {})
    )


@pytest.mark.parametrize("count", [1, 4])
def test_the_mean_of_a_run_is_known_as_well_as_its_bias_stays(count, monkeypatch):
    """Each window has a bias of its own, and together they tell what the one of the run does."""
    monkeypatch.setattr(elimination, "prior", lambda *_: np.ones(len(SLOW)))
    track = SimpleNamespace(slow=[np.zeros((ROWS, 3, len(SLOW)))] * (count + 1), states=[None] * 9)
    variance = []
    for i in range(count):
        free, precision = elimination.state_columns(simulator(count), track, i)
        assert free.shape == (ROWS, 3, len(SLOW) + 2)
        assert (free[:, 2, -1] == 1.0).all() and not free[:, :2, -1].any()
        variance.append(1.0 / precision[-1])
    mean = np.mean(variance) / count  # of windows that know nothing of one another
    assert mean == pytest.approx(sensor("imu_accelerometer.x").drift ** 2)


def test_a_force_that_only_the_level_of_an_accelerometer_shows_is_not_surer_with_more_samples():
    """A slope was named at 24 standard errors from biases that differed by 0.02 m/s^2."""
    drift = sensor("imu_accelerometer.x").drift
    known = []
    for rows in (100, 10_000):
        one = np.ones(rows) / 0.04  # white
        free, precision = one[:, None], np.array([drift**-2])
        known.append(elimination.eliminate(one, one[:, None], free, precision).G[0, 0] ** -0.5)
    assert known[1] == pytest.approx(drift, rel=1e-2) and known[1] > 0.95 * known[0]


def test_a_study_says_how_far_its_sensors_drift(monkeypatch):
    monkeypatch.setattr(elimination, "prior", lambda *_: np.ones(len(SLOW)))
    track = SimpleNamespace(slow=[np.zeros((ROWS, 3, len(SLOW)))] * 2, states=[None] * 2)
    known = simulator(1, {"drift:imu_accelerometer": 0.1, "drift:imu_gyro": 0.0})
    free, precision = elimination.state_columns(known, track, 0)
    assert free.shape[2] == len(SLOW) + 1 and precision[-1] == pytest.approx(0.1**-2)


def test_what_confines_a_window_is_what_its_evidence_has_beside_chi2():
    """-2 log p(r) of r = Z x + noise, with x beforehand of its prior and nothing eliminated."""
    rng = np.random.default_rng(3)
    Z, precision = rng.standard_normal((ROWS, 3)), np.array([4.0, 0.25, 1e-3])
    r = rng.standard_normal(ROWS)
    window = elimination.eliminate(r, r[:, None], Z, precision)
    whole = np.eye(ROWS) + Z @ np.diag(1.0 / precision) @ Z.T
    expected = -2.0 * stats.multivariate_normal(cov=whole).logpdf(r) - ROWS * np.log(2.0 * np.pi)
    assert window.chi2 + window.confined == pytest.approx(expected, rel=1e-6)


def test_a_window_of_which_the_data_tell_nothing_is_confined_by_nothing():
    nothing = np.zeros((ROWS, 2))
    one = np.ones(ROWS)
    window = elimination.eliminate(one, one[:, None], nothing, np.array([4.0, 0.25]))
    assert window.confined == pytest.approx(0.0, abs=1e-12)
