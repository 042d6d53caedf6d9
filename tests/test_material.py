"""What is missing, as a force: what counts as larger than any limit."""

import math
from types import SimpleNamespace

import pytest

from mjchair.diagnosis import material
from mjchair.diagnosis.fit.variant import Term
from mjchair.effects.library import find


@pytest.mark.parametrize(
    ("effects", "size"),
    [
        ([("sensor_scale", "imu_gyro.z")], math.inf),
        ([("turning_scrub", None)], math.inf),  # a wheel that slides or not is no small change
        ([("rolling_resistance", None)], 0.4),
        ([("sensor_scale", "imu_gyro.z"), ("rolling_resistance", None)], 0.4),
    ],
)
def test_errors_of_sensors_alone_are_no_small_force(effects, size, monkeypatch):
    """A gyroscope that told 0.7 of the turn was none: a moment of 0.4 N at the wheels does so."""
    monkeypatch.setattr(material, "_explaining", lambda *_: [0])
    monkeypatch.setattr(material, "largest", lambda *_: 0.4)
    monkeypatch.setattr(material, "limit", lambda _: 1.2)
    terms = [Term(find(*which), {}, ()) for which in effects]
    choice = SimpleNamespace(fitted=SimpleNamespace(variant=SimpleNamespace(terms=terms)))
    terms[:] = [Term(t.effect, {}, tuple(p.name for p in t.effect.fitted)) for t in terms]
    base = SimpleNamespace(bench=SimpleNamespace(simulator=SimpleNamespace(study=None)))
    assert material.material(base, None, choice, None).value == size
