"""Errors between a simulation and its table: what a sensor shows late or early."""

import numpy as np
import pytest

from mjchair.diagnosis.replay.sensor_errors import delayed

TIME = np.arange(0.0, 2.0, 0.01)


@pytest.mark.parametrize("delay", [0.03, -0.03, 0.004, -0.004])
def test_values_come_late_or_early_and_go_on_along_their_slope_at_the_ends(delay):
    ramp = 2.0 * TIME - 1.0
    assert delayed(TIME, ramp, delay) == pytest.approx(2.0 * (TIME - delay) - 1.0, abs=1e-12)
    swing, shown = np.sin(5.0 * TIME), delayed(TIME, np.sin(5.0 * TIME), delay)
    off = np.abs(shown - np.sin(5.0 * (TIME - delay)))
    assert off.max() < 0.1 * np.abs(shown - swing).max()


def test_late_and_early_undo_one_another():
    swing = np.sin(5.0 * TIME)
    back = delayed(TIME, delayed(TIME, swing, 0.02), -0.02)
    assert np.abs(back - swing)[10:-10].max() < 1e-12
