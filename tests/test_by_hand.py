"""What a person may measure without a run to tell hypotheses apart, by fits that are told."""

from types import SimpleNamespace

import pytest

from mjchair.diagnosis.data.roughly_known import MECHANICAL
from mjchair.diagnosis.explain import rivals
from mjchair.diagnosis.fit.column_ids import ParameterId
from mjchair.diagnosis.fit.variant import Term
from mjchair.diagnosis.next_experiment import by_hand
from mjchair.effects.library import find

MASS, STIFFNESS = (
    next(n for n in MECHANICAL if n.name == name) for name in ("mass", "rear_stiffness")
)


def start(name):
    return SimpleNamespace(effect=find(name))


def fit(name, sizes, std, by, number=MASS):
    """A fit of one effect; `by`: how many standard deviations it moved a number."""
    effect = find(name)
    return SimpleNamespace(
        variant=SimpleNamespace(terms=(Term(effect, {**effect.neutral(), **sizes}, tuple(sizes)),)),
        std={ParameterId(name, key): std for key in sizes},
        moved=[(number, by)],
    )


PAYLOAD = fit("payload", {"mass": 24.0}, 2.0, 0.1)
GAIN = fit("torque_gain", {"left": -0.2, "right": -0.01}, 0.02, 3.0)
DRAG = fit("rolling_resistance", {"coefficient": 0.004}, 0.0004, 0.0)
BEARING = fit("bearing_friction", {"coulomb": 0.3}, 0.02, 0.5)


@pytest.fixture
def said(monkeypatch):
    """The sentences on a choice and its rivals: (names without, names instead, fit)."""

    def sentences(chosen, *exchanged):
        pairs = [
            ([start(a)] if a else [], [start(b)] if b else [], SimpleNamespace(fitted=rival))
            for a, b, rival in exchanged
        ]
        monkeypatch.setattr(by_hand, "exchanged", lambda _: pairs)
        return " ".join(by_hand.sentences(SimpleNamespace(fitted=chosen)))

    assert by_hand.exchanged is rivals.exchanged
    return sentences


def test_a_payload_is_weighed_and_the_mass_that_each_hypothesis_needs_is_told(said):
    words = said(PAYLOAD, ("payload", "torque_gain", GAIN))
    assert "weigh the chair with all that was on it (payload: mass 24 ± 2 kg)" in words
    assert "push rim" not in words  # the scale tells both
    std = 100.0 * MASS.std
    assert f"{0.1 * std:+.1f} % from the chair of the study if it is payload" in words
    assert f"{3.0 * std:+.1f} % if it is torque gain" in words


def test_a_rival_is_measured_where_only_runs_show_what_was_chosen(said):
    words = said(DRAG, ("rolling_resistance", "bearing_friction", BEARING))
    assert "spin it by hand" in words and "(bearing friction: coulomb 0.3 ± 0.02 N m)" in words
    assert "mass" not in words  # half a standard deviation apart tells nothing


def test_what_is_not_clearly_there_is_not_told(said):
    words = said(GAIN, ("torque_gain", "rolling_resistance", DRAG))
    assert "(torque gain: left -0.2 ± 0.02)" in words


def test_what_only_runs_tell_apart_has_no_other_way(said):
    drag = fit("air_drag", {"drag_area": 0.5}, 0.05, 0.0)
    assert said(DRAG, ("rolling_resistance", "air_drag", drag)) == ""


def test_a_number_that_an_effect_moves_as_well_is_not_told_without_it(said):
    """It was "+0.0 % if it is cornering stiffness", where the tires were 124 % stiffer."""
    stiff = fit("cornering_stiffness", {"rear": 1.24}, 0.1, 0.0, STIFFNESS)
    plain = fit("rolling_resistance", {"coefficient": 0.004}, 0.0004, 3.0, STIFFNESS)
    words = said(stiff, ("cornering_stiffness", "rolling_resistance", plain))
    assert "stiffness of the rear tires" not in words
    toe = fit("toe", {"symmetric": 0.02}, 0.002, 0.0, STIFFNESS)
    words = said(toe, ("toe", "rolling_resistance", plain))
    assert "Measure the cornering stiffness of the rear tires: +0.0 %" in words


def test_every_effect_says_it_as_an_order_or_not_at_all():
    names = ("payload", "toe", "camber", "floor_slope", "wheel_radius", "caster_trail")
    for name in names:
        assert find(name).by_hand[0].islower() and not find(name).by_hand.endswith(".")
    assert "at rest" in find("sensor_bias", "imu_gyro.z").by_hand
    assert "known turn" in find("sensor_scale", "heading").by_hand
    assert find("sensor_bias", "heading").by_hand == ""
