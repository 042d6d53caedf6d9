"""Practice studies: what hides in them is there as the diagnosis knows it, and shows."""

import csv
import io

import numpy as np
import pytest

import mjchair
from mjchair import practice
from mjchair.effects.library import find

SHOWS = 100.0  # of chi2 against the sensors' noise, clear of what a run's first state takes


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


def test_tires_slide_on_a_floor_half_as_rough(without):
    differs = _differs(_tables(practice.hide(find("tire_friction"))), without)
    shown = {name for name, by in differs.items() if by > SHOWS}
    assert shown >= {"swerve_7.csv", "swerve_8.csv"}  # one alone is no answer


def test_a_swerve_slides_and_all_wheels_stay_on_the_floor():
    for made in practice.manoeuvres():
        if made.word == "swerve":
            run = practice._run(mjchair.load_spec(), made)
            assert np.abs(run.channels["imu_accelerometer.y"]).max() > 1.9
            loads = [np.min(v) for c, v in run.channels.items() if c.endswith("_tire.Fz")]
            assert len(loads) == 4 and min(loads) > 0.0
