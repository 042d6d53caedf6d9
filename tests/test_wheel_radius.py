"""Rear wheels of two sizes, on a frame that is rigid and on one that twists."""

import numpy as np
import pytest

import mjchair
from mjchair.effects import wheel_radius
from mjchair.effects.library import MECHANICAL, find

FORMS = (wheel_radius.EFFECT, wheel_radius.TWISTING)
WHEELS = ("left_wheel", "right_wheel", "left_caster", "right_caster")
ONE = {"left": 0.001, "right": 0.0}


def loads(effect, values):
    """Loads (4,) of a chair that stands, N."""
    spec = mjchair.load_spec()
    effect.apply(spec, values)
    recording = mjchair.simulate(spec, duration=0.5)
    return np.array([recording[f"{wheel}_tire.Fz"][-1] for wheel in WHEELS])


def test_a_rigid_frame_stands_on_a_diagonal_and_one_that_twists_does_not():
    """A chair that is as high behind, with both wheels larger by half, is what it is held to."""
    level = loads(FORMS[0], {"left": 0.0005, "right": 0.0005})
    rigid, twisting = (loads(form, ONE) - level for form in FORMS)
    assert rigid[0] > 10.0 and rigid[3] > 10.0  # the larger wheel and the caster across
    assert rigid[1] < -10.0 and rigid[2] < -10.0
    assert np.abs(twisting).max() < 0.01 * np.abs(rigid).max()


@pytest.mark.parametrize("effect", FORMS, ids=["rigid", "twisting"])
def test_wheels_roll_by_their_own_radii(effect):
    """What one wheel rolls further than the other is what the chair turns, over its track.

    With radii alike it would be 3.3 mm off; a load changes a rolling radius by a tenth of that.
    """
    spec = mjchair.load_spec()
    effect.apply(spec, ONE)
    recording = mjchair.simulate(spec, duration=1.0, initial={"speed": 1.0})
    turned = [recording[f"{side}_wheel_angle"][-1] for side in ("left", "right")]
    rolled = 0.301 * turned[0] - 0.300 * turned[1]
    assert rolled == pytest.approx(-0.56 * recording["heading"][-1], abs=1e-3)


def test_wheels_that_are_larger_alike_are_one_form():
    both = {"left": 0.002, "right": 0.002}
    np.testing.assert_allclose(*(loads(form, both) for form in FORMS), rtol=1e-9)


def test_both_are_tried_under_one_name_and_the_rigid_one_is_found():
    assert [e for e in MECHANICAL if e.name == "wheel_radius"] == list(FORMS)
    assert find("wheel_radius") is wheel_radius.EFFECT


def test_what_is_said_of_two_radii_is_their_difference_too():
    said = wheel_radius.TWISTING.remark(
        {"left": 0.0013, "right": 0.0004},
        {"left": 0.0015, "right": 0.0015, "left less right": 1e-5},
    )
    assert "left +1.30 ± 1.5 mm, right +0.40 ± 1.5 mm, left less right +0.90 ± 0.01 mm" in said
    assert "twists" in said
    assert wheel_radius.EFFECT.remark({"left": -0.002, "right": 0.0}, {"left": 1e-4}) == (
        "left -2.00 ± 0.1 mm"
    )
