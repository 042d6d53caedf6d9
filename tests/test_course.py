"""Clocks by the whole course of a run, and clocks that several recordings share."""

from pathlib import Path

import numpy as np
import pytest

from mjchair.measurement.clocks import Alignment, Signal
from mjchair.measurement.course import by_course
from mjchair.measurement.gather.instruments import Instrument
from mjchair.measurement.gather.join import GatheredTrial
from mjchair.measurement.gather.sources import Source
from mjchair.measurement.gather.together import started_together

TICK = 2.0 * np.pi / 4096
LATE = 0.37  # s
NEAR = Alignment(LATE + 0.006, 0.01)  # what a correlation tells of a coast


def coast(seed, seconds, turned=lambda way, time: way):
    """Two encoders of a chair that slows, one LATE; `turned` is what the other's wheel does."""
    rng = np.random.default_rng(seed)
    fast, slows = 4.7 + 0.3 * rng.normal(), 0.53
    fine = np.arange(0.0, seconds, 1e-3)
    way = np.cumsum(np.maximum(fast - slows * fine, 0.0)) * 1e-3
    times = np.arange(0.0, seconds, 1 / 240), np.arange(LATE, seconds, 1 / 240)
    zero = rng.uniform(0.0, TICK, 2)
    one = np.interp(times[0], fine, way)
    two = np.interp(times[1], fine, turned(way, fine))
    read = [TICK * np.floor((w + z) / TICK) for w, z in zip((one, two), zero, strict=True)]
    return Signal(times[0], read[0]), Signal(times[1] - LATE, read[1])


def test_a_coast_that_stops_tells_its_clock_as_well_as_it_says():
    found = [by_course(*coast(seed, 11.0), NEAR, 0.01, 0.01) for seed in range(40)]
    off = np.array([one.offset - LATE for one in found])
    stated = np.array([one.offset_std for one in found])
    assert np.sqrt(np.mean(off**2)) < 3e-4  # s; by correlation it is 2e-3
    assert 0.7 < np.sqrt(np.mean((off / stated) ** 2)) < 1.4


def test_a_bend_that_changes_leaves_the_clock_of_a_coast_that_stops():
    def other(way, time):
        share = 1.0 + 0.008 * (time / time[-1] - 0.3)
        return np.r_[0.0, np.cumsum(share[1:] * np.diff(way))]

    for seed in range(10):
        found = by_course(*coast(seed, 11.0, other), NEAR, 0.01, 0.01)
        assert abs(found.offset - LATE) < 4.0 * found.offset_std < 2e-3


def test_a_coast_that_never_stops_is_less_sure():
    stops, goes = (by_course(*coast(3, s), NEAR, 0.01, 0.01) for s in (11.0, 7.0))
    assert goes.offset_std > 4.0 * stops.offset_std
    assert abs(goes.offset - LATE) < 4.0 * goes.offset_std


def test_what_has_nothing_in_common_gives_no_clock():
    one, two = coast(0, 11.0)
    assert by_course(one, Signal(two.time + 50.0, two.values), NEAR, 0.01, 0.01) is None
    # another motion: it would lie elsewhere
    late = Signal(two.time, np.interp(two.time, two.time + 0.4, two.values))
    assert by_course(one, late, NEAR, 0.01, 0.01) is None


def trials(offsets, spread=1e-4, **changes):
    """A trial for each offset, of two rims."""
    out = []
    for k, offset in enumerate(offsets):
        rims = [
            Instrument(f"t{k}_{side}.csv", Source(Path("a"), "smartwheel", f"t{k}", side),
                       np.zeros(2), side=side)
            for side in ("left", "right")
        ]  # fmt: skip
        found = Alignment(offset, spread, how="course of the run")
        given = {f"t{k}_right.csv": Alignment(**{**found.__dict__, **changes})}
        out.append(GatheredTrial(f"t{k}", np.zeros(2), {}, "coast", given, tuple(rims)))
    return out


def test_clocks_that_agree_are_one():
    agreed, (line,) = started_together(trials([0.15, 0.1502, 0.1501, 0.1499]))
    assert "clock of right rim on that of left rim: one for all 4 recordings" in line
    for k in range(4):
        found = agreed[f"t{k}"][f"t{k}_right.csv"]
        assert found.offset == pytest.approx(0.15005)
        assert found.offset_std == pytest.approx(0.5e-4)
        assert "started together; alone +0.1" in found.how


def test_clocks_that_do_not_agree_stay_apart():
    agreed, (line,) = started_together(trials([0.15, 0.16, 2.3]))
    assert not agreed and "each keeps its own" in line
    assert started_together(trials([0.15])) == ({}, ())
    assert started_together(trials([0.15, 0.15], how="given")) == ({}, ())
    assert started_together(trials([0.15, 0.15], drift=1e-4)) == ({}, ())
