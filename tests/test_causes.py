"""The paper's riddle: which hidden cause moves the curve off the origin, and which stay open."""

from pathlib import Path

import numpy as np
import pytest
from rig_data import made

from mjchair.identification.causes import added_force, decide
from mjchair.identification.fit import identify
from mjchair.tire import read

TIRE = read(Path(__file__).parents[1] / "models" / "tires" / "wheelchair.toml")
SIGNED = {"angles": (-15, -10, -5, 0, 5, 10, 15)}
HIDDEN = {"toe": 1.0, "camber": 4.0, "offset": 6.0, "conicity": 0.04}


def verdict(seed=0, **given):
    return identify(made(TIRE, seed, **given)[0], starts=1)[1]


@pytest.mark.parametrize("cause", HIDDEN)
@pytest.mark.parametrize("seed", [0, 1])
def test_signed_angles_and_a_turned_wheel_name_each_cause(cause, seed):
    found = verdict(seed, turned=True, **SIGNED, **{cause: HIDDEN[cause]})
    assert found.named == (cause,)
    assert found.undecided == ()


def test_two_causes_are_named_together():
    assert verdict(turned=True, toe=1.0, offset=6.0, **SIGNED).named == ("toe", "offset")


def test_without_a_cause_none_is_named():
    for seed in range(3):
        found = verdict(seed)
        assert found.named == found.undecided == ()
        assert "no hidden" in found.sentences()[0]


def test_camber_and_conicity_cannot_be_told_without_turning_the_wheel():
    found = verdict(camber=4.0, **SIGNED)
    assert set(found.undecided) == {"camber", "conicity"}
    assert found.named == ()
    assert any("turned round" in sentence for sentence in found.sentences())


def test_the_papers_own_angles_cannot_tell_toe_from_camber():
    """0 to 15 deg of one sign: at least camber and conicity stay open, and never a wrong name."""
    for seed in range(3):
        found = verdict(seed, camber=4.0)
        assert {"camber", "conicity"} <= set(found.undecided)
        assert "toe" not in found.named


def test_the_size_of_a_named_cause_is_right():
    table, _ = made(TIRE, 3, turned=True, toe=1.5, **SIGNED)
    fit, _ = identify(table, starts=1)
    toe = fit.estimates()[-1]
    assert toe.parameter.name == "toe"
    assert abs(toe.value - 1.5) < 3.0 * toe.error
    assert toe.error < 0.15


def test_conicity_goes_into_the_tire_and_rig_faults_do_not():
    table, _ = made(TIRE, 3, turned=True, conicity=0.04, **SIGNED)
    fit, _ = identify(table, starts=1)
    cone = fit.tire("t", TIRE, "")
    assert cone.forces(200.0, 0.0, 0.0).Fy == pytest.approx(8.0, rel=0.1)
    table, _ = made(TIRE, 3, turned=True, offset=6.0, **SIGNED)
    straight = identify(table, starts=1)[0].tire("t", TIRE, "")
    assert straight.forces(200.0, 0.0, 0.0).Fy == pytest.approx(0.0, abs=1e-9)


def test_what_the_causes_add():
    table, _ = made(TIRE, noise=0.0, turned=True)
    cone = added_force({"conicity": 0.1}, table)
    assert np.allclose(np.abs(cone), 0.1 * table.load)
    assert np.allclose(cone[table.turned == 1.0], -0.1 * table.load[table.turned == 1.0])
    assert np.allclose(added_force({"camber": 2.0, "offset": 3.0}, table), 3.0 - 0.02 * table.load)


def test_a_larger_set_needs_strong_evidence():
    sets = {(): 20.0, ("toe",): 3.0, ("offset",): 12.0, ("toe", "offset"): 0.0}
    assert decide(sets).named == ("toe",)
    sets["toe", "offset"] = -9.0
    assert decide(sets).named == ("toe", "offset")
    assert decide({(): 4.0, ("toe",): 0.0}).named == ()
    both = decide({(): 20.0, ("toe",): 0.0, ("camber",): 2.0, ("toe", "camber"): 1.0})
    assert both.named == ()
    assert both.undecided == ("toe", "camber")
