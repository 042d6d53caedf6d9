"""Fits that begin at whole sizes, with chi2 that is told instead of simulated.

In: chi2 of an effect's sizes. Out: the size at which a fit begins, and its standard error.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import numpy as np
import pytest

from mjchair.diagnosis.explain import search_rules, whole_beside, whole_sizes
from mjchair.diagnosis.explain.whole_sizes import Seen
from mjchair.diagnosis.fit.column_ids import ParameterId
from mjchair.diagnosis.fit.variant import Term, Variant
from mjchair.diagnosis.replay.window_states import Track
from mjchair.effects.library import MECHANICAL, find
from mjchair.errors import MjchairError


def begun(effect, chi2, other=None):
    """The best size at which a fit of the effect begins; None: none is better than no effect."""
    return next(iter(all_begun(effect, chi2, other)), None)


def all_begun(effect, chi2, other=None):
    """The sizes at which fits of the effect begin, best first.

    other: chi2 of a fit of other effects.
    """
    (parameter,) = [p for p in effect.fitted if p.whole]

    def look(term):
        return Seen(chi2(term.values[parameter.name]), Variant((), terms=(term,)))

    start = SimpleNamespace(effect=effect, free=(parameter.name,))
    nothing = chi2(parameter.neutral)
    most = 0.0 if other is None else nothing - other
    begins = [s.variant for s in whole_sizes.best_sizes(start, look, nothing, most)]
    return [begin.terms[0].values[parameter.name] for begin in begins]


@pytest.mark.parametrize("truth", [0.055, 0.083, 0.12])
def test_a_fit_begins_next_to_the_size_that_is_there(truth):
    """A valley of a shimmy is narrow: nothing at half of the size tells of it."""
    effect = find("relaxation_length")
    size = begun(effect, lambda v: 2000.0 - 1500.0 * math.exp(-(((v - truth) / 0.01) ** 2)))
    assert size == pytest.approx(truth, abs=0.008)


@pytest.mark.parametrize("truth", [-0.05, -0.028])
def test_a_fit_of_wheels_nearer_to_their_stems_begins_next_to_how_near_they_are(truth):
    """No small change of a trail leads to casters that shimmy; 0 of it is left at -0.05 m."""
    size = begun(
        find("caster_trail"), lambda v: 2000.0 - 1500.0 * math.exp(-(((v - truth) / 0.01) ** 2))
    )
    assert size == pytest.approx(truth, abs=0.005)


def test_a_fit_begins_in_each_of_two_valleys():
    """Casters shimmied as well at 0.13 m as at 0.08, where 0.09 was hidden, and not at 0.1."""

    def chi2(size):
        return 2000.0 - sum(
            deep * math.exp(-(((size - at) / 0.012) ** 2))
            for at, deep in ((0.087, 1400.0), (0.13, 1300.0))
        )

    sizes = all_begun(find("relaxation_length"), chi2)
    assert sorted(sizes) == pytest.approx([0.087, 0.13], abs=0.006)


@pytest.mark.parametrize(("other", "begins"), [(1400.0, True), (200.0, False)])
def test_a_size_that_misses_half_of_what_others_bring_begins_no_fit(other, begins):
    def chi2(size):
        return 2000.0 - 500.0 * math.exp(-(((size - 0.08) / 0.01) ** 2))

    size = begun(find("relaxation_length"), chi2, other)
    assert (size is not None) == begins


@pytest.mark.parametrize("beside", [False, True])
def test_a_fit_from_a_size_ends_where_it_falls_too_far_behind(monkeypatch, beside):
    """Only a fit of other effects tells how far that is."""
    reaches = []
    seen = Seen(500.0, Variant(()))

    def made_anew(bench, begin, track, reach):
        reaches.append(reach)
        return "the fit"

    monkeypatch.setattr(whole_sizes, "made_anew", made_anew)
    monkeypatch.setattr(whole_sizes, "chi2", lambda *_: 2000.0)
    monkeypatch.setattr(whole_sizes, "best_sizes", lambda *_: [seen])
    monkeypatch.setattr(whole_beside, "_with_best", lambda *_: seen)
    scrub = SimpleNamespace(effect=find("turning_scrub"))
    monkeypatch.setattr(whole_sizes, "starts", lambda _: [scrub])
    told = SimpleNamespace(chi2=np.ones(1), variant=None, track=None)
    # the second window is held out
    windows = [SimpleNamespace(shimmies=False), SimpleNamespace(shimmies=True)]
    base = SimpleNamespace(
        bench=SimpleNamespace(
            windows=np.arange(1), simulator=SimpleNamespace(windows=windows, channels=())
        ),
        plain=SimpleNamespace(total=6000.0, **vars(told)),
        around=SimpleNamespace(variant=None, track=Track([], [], [], [])),
        starts=[],
    )
    other = SimpleNamespace(total=1000.0, **vars(told))
    if beside:
        assert list(whole_beside.fits(base, other, other)) == [((scrub,), "the fit")]
        assert reaches == [search_rules.reach_of_whole(best=1000.0, gain=5000.0)]
        return
    assert list(whole_sizes.fits(base, other)) == list(whole_sizes.fits(base))
    assert reaches == [search_rules.reach_of_whole(best=1000.0, gain=5000.0), math.inf]


@pytest.mark.parametrize(("swing", "as_measured"), [(0.3, True), (0.1, False)])
def test_a_chair_that_does_not_shimmy_as_measured_is_no_measure_of_one_that_may(
    monkeypatch, swing, as_measured
):
    """A patch of the floor that slowed the wheels as a shimmy did kept one from being followed."""
    phase = np.linspace(0.0, 12.0 * np.pi, 60)
    measured = np.column_stack([phase, 0.4 * np.sin(phase)])
    measured[20:25, 1] = np.nan
    simulator = SimpleNamespace(
        channels=("heading", "left_caster_angle"),
        windows=[SimpleNamespace(shimmies=True)],
        measured=lambda window: measured,
    )
    shown = np.column_stack([phase, swing * np.sin(phase + 1.0)])
    reaches = []
    monkeypatch.setattr(whole_sizes, "chi2", lambda *_: 2000.0)
    monkeypatch.setattr(whole_sizes, "best_sizes", lambda *_: [Seen(500.0, Variant(()))])
    monkeypatch.setattr(whole_sizes, "starts", lambda _: ["a start"])
    monkeypatch.setattr(whole_sizes, "fit_from", lambda *args: reaches.append(args[-1]) or "a fit")
    told = {"chi2": np.ones(1), "variant": None}
    base = SimpleNamespace(
        bench=SimpleNamespace(windows=np.arange(1), simulator=simulator),
        plain=SimpleNamespace(total=6000.0, track=None, **told),
    )
    other = SimpleNamespace(total=1000.0, track=SimpleNamespace(predicted=[shown]), **told)
    assert list(whole_sizes.fits(base, other)) == [("a start", "a fit")]
    near = search_rules.reach_of_whole(best=1000.0, gain=5000.0)
    assert reaches == [near if as_measured else math.inf]


def test_sizes_are_looked_at_once_and_each_fit_begins_as_often_as_it_is_asked_for(monkeypatch):
    """The noise and the search both ask for them."""
    looks, begins = [], []

    def looked_at(base, windows, weigh, term):
        looks.append(term.values["moment"])
        return Seen(500.0 + term.values["moment"], Variant(()))

    monkeypatch.setattr(whole_sizes, "looked_at", looked_at)
    monkeypatch.setattr(whole_sizes, "chi2", lambda *_: 2000.0)
    monkeypatch.setattr(whole_sizes, "fit_from", lambda *_: begins.append("a fit") or "a fit")
    scrub = find("turning_scrub")
    plain = SimpleNamespace(variant=None, track=None, chi2=np.ones(1))
    base = SimpleNamespace(
        bench=SimpleNamespace(windows=np.arange(1)),
        plain=plain,
        starts=[SimpleNamespace(effect=scrub, free=("moment",))],
        looked={},
    )
    assert list(whole_sizes.fits(base)) == list(whole_sizes.fits(base)) != []
    assert sorted(looks) == sorted(set(looks)) and len(begins) == 2


def test_a_size_that_brings_nothing_begins_no_fit():
    assert begun(find("tire_friction"), lambda v: 1000.0 + 50.0 * abs(v - 1.0)) is None


def test_the_windows_that_disagree_most_are_looked_at():
    fitted = SimpleNamespace(chi2=np.array([5.0, 90.0, 20.0, 70.0, 60.0, 1.0]))
    base = SimpleNamespace(bench=SimpleNamespace(windows=np.array([0, 1, 3, 4, 7, 8])))
    assert whole_sizes.worst_windows(base, fitted) == [1, 4, 7, 3]


def test_a_size_that_no_chair_can_have_fits_nothing():
    def refused(edit):
        raise MjchairError("no chair")

    simulator = SimpleNamespace(compile=refused, channels=())
    base = SimpleNamespace(
        bench=SimpleNamespace(simulator=simulator, noise={}), around=SimpleNamespace(track=None)
    )
    assert whole_sizes.track_of(base, Variant(()), [0]) is None


def test_a_size_whose_linear_algebra_fails_fits_nothing(monkeypatch):
    def fails(*_):
        raise np.linalg.LinAlgError

    monkeypatch.setattr(whole_sizes, "track_of", lambda *_: "a track")
    base = SimpleNamespace(around=SimpleNamespace(variant=Variant(())))
    term = Term(find("turning_scrub"), {"moment": 4.0}, ("moment",))
    assert whole_sizes.looked_at(base, [0], fails, term).chi2 == math.inf


def test_whole_sizes_are_sizes_that_can_be():
    for effect in MECHANICAL:
        for p in effect.parameters:
            assert all(p.low < size < p.high and size != p.neutral for size in p.whole)


SHIMMY = ParameterId("relaxation_length", "length")


@dataclass
class End:
    """What a fit that ended at a size says."""

    variant: Variant
    total: float
    track: object = None
    std: dict = field(default_factory=lambda: {SHIMMY: 1e-4})
    sigmas: dict = field(default_factory=lambda: {"relaxation_length": 900.0})


def ended(size, total):
    """A fit of a relaxation length (m)."""
    term = Term(find("relaxation_length"), {"length": size}, ("length",))
    return End(Variant((), terms=(term,)), total)


@pytest.mark.parametrize(
    ("ends", "size", "std"),
    [
        (((0.100, 3020.0), (0.100, 3020.0)), 0.100, 1e-4),  # all starts agree
        (((0.095, 3030.0), (0.108, 3015.0)), 0.108, 0.013),  # three valleys as deep as each other
        (((0.080, 3600.0), (0.104, 3100.0)), 0.100, 0.004),  # one is ruled out, as a rival would be
    ],
)
def test_a_size_is_known_no_better_than_fits_that_began_beside_it_say(monkeypatch, ends, size, std):
    """Shimmies end in the valley in which they began, and each is 0.1 mm wide."""
    chosen = ended(0.100, 3020.0)
    begun_at = []

    def made_anew(bench, begin, track):
        begun_at.append(begin.terms[0].values["length"])
        return ended(*ends[len(begun_at) - 1])

    monkeypatch.setattr(whole_sizes, "made_anew", made_anew)
    base = SimpleNamespace(bench=None, plain=SimpleNamespace(total=13_000.0))
    found = whole_sizes.compared(base, chosen)
    assert begun_at == pytest.approx([0.09, 0.11])
    assert found.variant.terms[0].values["length"] == size
    assert found.std[SHIMMY] == pytest.approx(std)
    assert found.sigmas["relaxation_length"] == pytest.approx(min(900.0, size / std))


def test_fits_without_whole_sizes_are_not_made_again(monkeypatch):
    monkeypatch.setattr(whole_sizes, "made_anew", None)
    term = Term(find("toe"), {"symmetric": 0.01, "asymmetric": 0.0}, ("symmetric",))
    one = replace(ended(0.1, 10.0), variant=Variant((), terms=(term,)))
    found = whole_sizes.compared(SimpleNamespace(plain=SimpleNamespace(total=90.0)), one)
    assert found == one


@pytest.mark.parametrize(
    ("second", "begun"), [(1400.0, ["slides", "scrubs"]), (1600.0, ["slides"])]
)
def test_what_misses_half_of_what_another_size_brings_begins_no_fit(monkeypatch, second, begun):
    """Of casters that shimmy a tire that slides tells a little, and its fit is a long one."""
    sizes = {"slides": Seen(1000.0, "slides"), "scrubs": Seen(second, "scrubs")}
    monkeypatch.setattr(whole_sizes, "chi2", lambda *_: 2000.0)
    monkeypatch.setattr(whole_sizes, "starts", lambda _: list(sizes))
    monkeypatch.setattr(whole_sizes, "best_sizes", lambda start, *_: [sizes[start]])
    monkeypatch.setattr(whole_sizes, "fit_from", lambda _base, begin, *_: f"fit of {begin}")
    plain = SimpleNamespace(variant=None, track=None, chi2=np.ones(1))
    base = SimpleNamespace(bench=SimpleNamespace(windows=np.arange(1)), plain=plain)
    assert list(whole_sizes.fits(base)) == [(s, f"fit of {s}") for s in begun]
