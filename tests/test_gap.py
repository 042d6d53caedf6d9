"""What a fit leaves: with its own parameters free where it got to what its step promises."""

from dataclasses import replace

import numpy as np
import pytest
from noisy_run import NOISE, noisy_run

import mjchair
from mjchair.diagnosis.data.study import make_study
from mjchair.diagnosis.explain.gap import Gap
from mjchair.diagnosis.explain.left_out import with_terms
from mjchair.diagnosis.explain.screening import gap_after, prepare, screen_columns
from mjchair.diagnosis.fit.nonlinear import refit
from mjchair.diagnosis.fit.variant import Term, Variant
from mjchair.diagnosis.material import largest
from mjchair.effects.library import find
from mjchair.simulation.initial import Initial

STARTS = (Initial((0.0, 0.0), 0.3, 1.5), Initial((0.0, 0.5), -1.2, 1.2))
DRAG = {"coefficient": 0.003}


@pytest.fixture(scope="module")
def fits():
    """A base with drag hidden, the fit of it, and one that was held a fifth of the way there."""
    rng = np.random.default_rng(5)
    spec = mjchair.load_spec()
    effect = find("rolling_resistance")
    effect.apply(spec, DRAG)
    runs = [noisy_run(rng, spec, f"coast {k}", start, 4.0) for k, start in enumerate(STARTS)]
    bench, first = prepare(make_study(mjchair.load_spec(), runs, NOISE), threads=1)
    base = screen_columns(bench, first, [effect])

    def fitted(share, rounds):
        values = {"coefficient": share * DRAG["coefficient"]}
        start = replace(base.around.variant, terms=(Term(effect, values, ("coefficient",)),))
        return refit(base.bench, start, base.around.track, base.nuisances, rounds)

    return base, fitted(1.0, 4), fitted(0.2, 0)


def test_a_fit_that_got_there_leaves_no_gap(fits):
    base, there, _ = fits
    assert gap_after(base, base.plain).exists
    assert not gap_after(base, there).exists


def test_a_fit_that_is_stuck_leaves_the_gap_that_it_did_not_close(fits):
    """A linear step that never came true hid that a wind could not be a slope and a toe."""
    base, there, stuck = fits
    assert stuck.total - stuck.promised > 0.5 * (base.plain.total - there.total)
    assert gap_after(base, stuck).exists
    # were the step believed, nothing would be left
    believed = replace(stuck, promised=stuck.total)
    assert not gap_after(base, believed).exists


def test_what_a_stuck_fit_foretells_is_what_it_is(fits):
    base, there, stuck = fits
    assert with_terms(base, there)[1] == [there.system.nuisance]
    assert with_terms(base, stuck)[1] == []


def test_a_variant_without_effects_has_none(fits):
    base, *_ = fits
    assert base.plain.variant.terms == Variant(()).terms
    assert with_terms(base, base.plain)[1] == []


def test_a_study_whose_channels_have_no_slow_part_shows_no_excess():
    """Marker positions with a gap of 6 s left two windows too short for any."""
    nothing = Gap(tests=[], p=1.0, exists=False, excess=0.0, excess_std=0.0)
    assert nothing.excess_sigmas == 0.0
    assert replace(nothing, excess=12.0, excess_std=4.0).excess_sigmas == 3.0


def test_the_force_of_a_rolling_resistance_is_its_share_of_the_weight(fits):
    """Half of it was laid to torques of the wheels that do the same, until these were left out."""
    base = fits[0]
    which = base.reduced.index(base.starts[0].columns)
    (size,) = base.reduced.solve(which)
    term = base.starts[0].term([size])
    model = base.bench.simulator.base
    weight = 9.81 * float(model.body_subtreemass[1])
    assert largest(base, which) == pytest.approx(abs(term.values["coefficient"]) * weight, rel=0.1)
