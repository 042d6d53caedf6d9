"""Practice studies: what hides in them is there as the diagnosis knows it."""

import csv
import io

import numpy as np
import pytest

from mjchair import practice
from mjchair.effects.library import find


def _tables(files):
    """Samples of every run, by file and column."""
    out = {}
    for name, content in files.items():
        if name.endswith(".csv"):
            rows = list(csv.DictReader(io.StringIO(content)))
            out[name] = {c: np.array([float(row[c]) for row in rows]) for c in practice.NOISE}
    return out


def _differs(one, other):
    """Chi2 by which the samples of each run differ, of the same noise."""
    return {
        name: sum(
            float(np.sum(((columns[c] - other[name][c]) / std) ** 2))
            for c, std in practice.NOISE.items()
        )
        for name, columns in one.items()
    }


@pytest.fixture(scope="module")
def without():
    """Tables of a study in which nothing is hidden."""
    return _tables(practice.hide(find("toe"), {"symmetric": 0.0, "asymmetric": 0.0}))


def test_a_motor_that_nothing_drives_does_not_brake(without):
    """The diagnosis has its drive off in a coast: a motor's braking came out as a bearing's."""
    differs = _differs(_tables(practice.hide(find("back_emf"))), without)
    assert all((by == 0.0) == name.startswith("coast") for name, by in differs.items())
