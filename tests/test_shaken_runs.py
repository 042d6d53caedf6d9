"""Runs that are shaken far harder than others of their kind: what rubs for a while is no noise."""

from types import SimpleNamespace

import numpy as np
import pytest

from mjchair.diagnosis import decide
from mjchair.diagnosis.explain import noise_shown
from mjchair.diagnosis.explain.noise_shown import forward_levels
from mjchair.diagnosis.fit.process import NAMED, Part

FAST, SLOW = NAMED["drive"][0]
LIMIT = 1.2  # N


def bench(given=None, **runs):
    """Runs by name: (manoeuvre, whether it is driven, fast and slow level in N)."""
    made = [
        SimpleNamespace(
            manoeuvre=kind, trial=SimpleNamespace(name=name, inputs="torques" if driven else None)
        )
        for name, (kind, driven, *_) in runs.items()
    ]
    study = SimpleNamespace(runs=made, fitted=range(len(made)), process=given or {})
    fast, slow = np.array([levels for *_, levels in runs.values()]).T
    return SimpleNamespace(
        simulator=SimpleNamespace(study=study),
        process=SimpleNamespace(levels={FAST: fast, SLOW: slow}),
    )


RUBBED, QUIET, PUSH = ("coast", False, (0.5, 3.0)), ("coast", False, (0.3, 1.2)), (3.0, 4.0)


@pytest.mark.parametrize(
    ("runs", "given", "said"),
    [
        ({"a": RUBBED, "b": QUIET}, None, ("a", "b")),
        ({"a": QUIET, "b": QUIET}, None, None),
        ({"a": QUIET, "b": ("coast", False, (0.01, 0.01))}, None, ("a", "b")),
        ({"a": ("coast", False, (0.1, 0.9)), "b": ("coast", False, (0.01, 0.1))}, None, None),
        ({"a": ("run", True, PUSH), "b": ("run", False, (0.3, 1.2))}, None, None),
        ({"a": RUBBED, "b": QUIET}, {"drive": 2.0}, None),
        ({"a": RUBBED, "b": QUIET, "c": ("push", True, PUSH)}, None, ("a", "b")),
    ],
)
def test_only_what_shakes_a_run_harder_than_its_like_and_matters_is_found(runs, given, said):
    found = decide._shaken(forward_levels(bench(given, **runs)), LIMIT)
    assert (found and (found.trial, found.other)) == said


def test_the_level_is_that_of_the_fast_and_the_slow_part_together():
    ((runs),) = forward_levels(bench(a=("push", True, PUSH)))
    assert runs == {"a": pytest.approx(5.0)}


@pytest.mark.parametrize(
    ("side", "channels", "shown"),
    [
        (0.5, ("left_wheel_speed",), False),
        (0.5, ("left_wheel_speed", "imu_accelerometer.y"), True),
        (1.0, ("left_wheel_speed",), True),
    ],
)
def test_what_is_said_to_be_loud_has_its_level(monkeypatch, side, channels, shown):
    """Sticking casters in wheel speeds alone: a sideways level was loud, and no level was there."""
    shares = dict.fromkeys(noise_shown.SHAKING, 0.5) | {"side": side}
    monkeypatch.setattr(noise_shown, "shares", lambda _: shares)
    levels = {part: np.array([2.0]) for part in Part}
    shaken = SimpleNamespace(
        process=SimpleNamespace(levels=levels, person=np.zeros(3)),
        simulator=SimpleNamespace(channels=channels, study=SimpleNamespace(process={})),
    )
    found = decide._process(SimpleNamespace(bench=shaken))
    assert ("side" in found) is shown
    assert found.keys() >= set(noise_shown.at_most(shaken))
