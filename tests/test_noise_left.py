"""Which explanation the noise of a study is taken around; levels are told instead of estimated."""

from types import SimpleNamespace

import pytest

from mjchair.diagnosis.explain import screening
from mjchair.diagnosis.explain.screening import LOUD, QUIETER


def taken(monkeypatch, first, other):
    """Power of the noise that is taken, and how many explanations were looked at.

    Args:
      first: power that the best explanation leaves. other: the best of a chair hardly shaken.
    """
    looked = []

    def noise_left(base, bench, reduced):
        looked.append(bench)
        return SimpleNamespace(power=other if bench == "hushed" else first), None

    monkeypatch.setattr(screening, "_noise_left", noise_left)
    monkeypatch.setattr(screening, "_reduced_anew", lambda base: base)
    monkeypatch.setattr(screening, "replace", lambda base, **_: base)
    monkeypatch.setattr(screening, "refit", lambda bench, *_: bench)
    monkeypatch.setattr(screening.noise_shown, "loudness", lambda bench: bench.power)
    monkeypatch.setattr(screening.noise_shown, "hushed", lambda bench: "hushed")
    chosen = []
    monkeypatch.setattr(screening, "_on", lambda base, bench: chosen.append(bench) or base)
    plain = SimpleNamespace(variant=None, track=None, columns=None)
    screening._with_noise_left(SimpleNamespace(bench="as shown", reduced=None, plain=plain))
    return chosen[-1].power, len(looked)


@pytest.mark.parametrize(
    ("first", "other", "power", "looks"),
    [
        (0.5 * LOUD, 0.0, 0.5 * LOUD, 1),  # hardly shaken: nothing can hide
        (0.5, 0.9 * QUIETER * 0.5, 0.9 * QUIETER * 0.5, 2),  # it explains what passed for noise
        (0.5, 1.1 * QUIETER * 0.5, 0.5, 2),  # a little less is left by any further effect
    ],
)
def test_an_explanation_that_leaves_far_less_noise_is_taken(
    monkeypatch, first, other, power, looks
):
    assert taken(monkeypatch, first, other) == (power, looks)
