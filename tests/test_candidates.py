"""Starts of an effect: every choice of its sizes; what only shapes them is no column."""

import numpy as np
import pytest

from mjchair.diagnosis.explain import candidates
from mjchair.diagnosis.explain.column_ids import EffectGroup
from mjchair.effects import caster_friction
from mjchair.errors import MjchairError

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
