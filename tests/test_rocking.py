"""A chair on tires of another vertical compliance, told by two columns without a fit."""

import numpy as np
import pytest
from five_segments import Hidden
from test_rider_fit import pushed

from mjchair.diagnosis.data.roughly_known import COMPLIANCE
from mjchair.diagnosis.fit.bounded import WALL
from mjchair.diagnosis.fit.column_ids import RoughlyKnown
from mjchair.diagnosis.fit.parameter_columns import nuisance_columns
from mjchair.diagnosis.fit.variant import Variant
from mjchair.diagnosis.replay.derivatives import predictions
from mjchair.diagnosis.replay.sensor_errors import SensorErrors

NAMES = ("rocking", "rocking_softer")


@pytest.fixture(scope="module")
def push():
    bench, first, _ = pushed(Hidden())
    columns = nuisance_columns(bench, first, Variant(bench.nuisances))
    return bench, first, [columns[RoughlyKnown(name)] for name in NAMES]


@pytest.mark.parametrize("more", [-0.75, -0.5, 0.3, 0.67, 0.9])
def test_two_columns_tell_what_stiffer_and_softer_tires_do_to_a_push(push, more):
    """Within the walls; the slow state of each window is free, as in a fit."""
    bench, first, columns = push
    simulator = bench.simulator
    rocks = Variant(bench.nuisances, offsets={"rocking": more / COMPLIANCE})
    model = simulator.compile(rocks.edit)
    there = predictions(simulator, first, model, SensorErrors(simulator.channels))
    speed = list(simulator.channels).index("left_wheel_speed")
    seen = np.concatenate([(a - b)[:, speed] for a, b in zip(there, first.predicted, strict=True)])
    told = np.column_stack([np.concatenate([w[:, speed] for w in c]) for c in columns])
    by, *_ = np.linalg.lstsq(told, seen, rcond=None)
    assert (np.abs(by) < WALL).all()
    left = np.std(seen - told @ by) / np.std(seen)
    assert left < 0.15
    if more > 0.0:  # one straight line from stiff to soft tires does not
        stiff = told[:, :1]
        rest = seen - stiff @ np.linalg.lstsq(stiff, seen, rcond=None)[0]
        assert np.std(rest) / np.std(seen) > 0.3
