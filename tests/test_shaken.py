"""What the other channels tell of what shakes a chair, on numbers alone."""

import numpy as np
import pytest

from mjchair.diagnosis.fit.elimination import eliminate
from mjchair.diagnosis.fit.shaken import foretold

ROWS, FORCES = 60, 12
OWN = np.arange(3 * ROWS) < ROWS  # the first of three channels


@pytest.fixture(scope="module")
def columns():
    """How three channels answer to forces of one standard deviation, white."""
    return 3.0 * np.random.default_rng(5).normal(size=(3 * ROWS, FORCES)) / np.sqrt(FORCES)


def gain_of(columns, gain, random, asked=OWN):
    """The gain that a fit finds in a chair that moves by what shakes it alone, and its error."""
    shown = columns @ random.normal(size=FORCES)
    shown[OWN] *= 1.0 + gain
    r = shown + random.normal(size=shown.size)
    column = np.where(OWN, foretold(r, columns, np.ones(FORCES), asked), 0.0)
    known = eliminate(r, column[:, None], columns, np.ones(FORCES))
    return known.b[0] / known.G[0, 0], known.G[0, 0] ** -0.5


def test_a_channel_does_not_tell_its_own_motion(columns):
    random = np.random.default_rng(1)
    r = random.normal(size=3 * ROWS)
    other = np.where(OWN, random.normal(size=r.size), r)
    one, two = (foretold(x, columns, np.ones(FORCES), OWN) for x in (r, other))
    np.testing.assert_array_equal(one, two)


def test_a_right_gain_is_found_right_and_its_error_is_honest(columns):
    random = np.random.default_rng(2)
    found = np.array([gain_of(columns, 0.0, random) for _ in range(400)])
    in_errors = found[:, 0] / found[:, 1]
    assert abs(in_errors.mean()) < 3.0 / np.sqrt(len(found))
    assert in_errors.std() == pytest.approx(1.0, abs=3.0 / np.sqrt(2 * len(found)))


def test_asked_of_its_own_motion_too_a_right_channel_seems_to_have_a_gain(columns):
    random = np.random.default_rng(2)
    found = [gain_of(columns, 0.0, random, asked=np.zeros_like(OWN)) for _ in range(400)]
    in_errors = np.array([gain / error for gain, error in found])
    assert in_errors.mean() > 3.0 / np.sqrt(len(found))


@pytest.mark.parametrize("gain", [-0.5, 0.3])
def test_a_gain_is_found_of_what_only_shakes_the_chair(columns, gain):
    """With the gain in, the samples are those of the chair without it, and their rest is noise."""
    random = np.random.default_rng(3)
    found = np.array([gain_of(columns, gain, random) for _ in range(400)])
    assert found[:, 0].mean() == pytest.approx(gain, abs=3.0 * found[:, 0].std() / 20.0)
