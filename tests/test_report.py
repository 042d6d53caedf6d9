"""The first sentence of a diagnosis' report: what it says for every verdict."""

import re

import pytest

from mjchair.diagnosis.verdict import AMBIGUOUS, NAMED, NONE, UNKNOWN, Diagnosis, Named
from mjchair.report.diagnosis_page import sentence

ROLLING = Named(
    "rolling_resistance", {"coefficient": {"value": 0.0146, "std": 0.0004, "unit": "1"}}, 0.97
)
BIAS = Named(
    "sensor_bias", {"bias": {"value": 0.1, "std": None, "unit": "<m/s>"}}, 0.9, "imu_gyro.z"
)


def text(diagnosis: Diagnosis) -> str:
    return re.sub("<[^>]+>", "", sentence(diagnosis))


def test_a_named_effect_comes_with_value_and_uncertainty():
    assert text(Diagnosis(NAMED, [ROLLING])) == (
        "The chair lacks rolling resistance (coefficient 0.0146 ± 0.0004)."
    )


def test_rivals_are_in_the_sentence():
    found = Diagnosis(AMBIGUOUS, [ROLLING], [["floor_slope", "rolling_resistance"]])
    assert "floor slope or rolling resistance" in text(found)


@pytest.mark.parametrize("verdict", [NONE, UNKNOWN])
def test_no_name_where_none_is_named(verdict):
    assert "resistance" not in text(Diagnosis(verdict))


def test_words_from_outside_are_escaped():
    said = sentence(Diagnosis(NAMED, [BIAS]))
    assert "&lt;m/s&gt;" in said and "on imu_gyro.z" in said
