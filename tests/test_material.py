"""What is missing, as a force: what counts as larger than any limit."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from mjchair.diagnosis import material
from mjchair.diagnosis.fit.variant import Term
from mjchair.diagnosis.replay.pulses import Force
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


@pytest.mark.parametrize(
    ("acting", "force", "found"),
    [
        (slice(43, 46), Force.FORWARD, 15.0),  # of 20 windows with ten pulses each
        (slice(43, 46), Force.YAW, 60.0),  # at wheels 0.25 m aside
        (slice(43, 44), Force.FORWARD, 0.0),  # a jerk
        (slice(0, 200), Force.FORWARD, 15.0),
    ],
)
def test_a_force_of_one_second_is_as_large_as_one_that_stays(acting, force, found, monkeypatch):
    """Of a foot that dragged for a second with 15 N, no force was larger than 0.3 N."""
    value = np.zeros(400)
    value[(0 if force == Force.FORWARD else 200) + np.arange(200)[acting]] = -15.0
    pulses = [
        SimpleNamespace(force=f, window=k // 10)
        for f in (Force.FORWARD, Force.YAW)
        for k in range(200)
    ]
    monkeypatch.setattr(material.missing_force, "equivalent_force", lambda *_: (value, 1.0))
    monkeypatch.setattr(material, "rear_axle", lambda _: SimpleNamespace(track=0.5))
    around = SimpleNamespace(track=None, pulses=pulses, answers=None)
    bench = SimpleNamespace(simulator=SimpleNamespace(base=None))
    base = SimpleNamespace(around=around, bench=bench)
    assert material._force(base, []) == pytest.approx(found)
