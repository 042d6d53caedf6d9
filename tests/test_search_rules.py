"""The rules of the search, one by one, on plain numbers: what each allows and what it stops."""

import numpy as np
import pytest

from mjchair.diagnosis.explain import search_rules


@pytest.mark.parametrize(("own", "worth"), [(650.0, False), (670.0, True)])
def test_a_further_effect_brings_more_than_the_form_of_a_large_one_leaves(own, worth):
    """A rider's motion brings 330 000, of which forms that are 4.5 % wrong leave 0.2 %."""
    gain = 330_000.0
    assert search_rules.beyond_form(own=own, gain=gain) == worth
    assert search_rules.worth_adding(gained=own, parameters=2, held=500.0, gain=gain) == worth


def test_a_hypothesis_near_the_best_is_fitted_too():
    assert search_rules.worth_trying(score=901.0, best=1000.0, gain=1000.0)
    assert not search_rules.worth_trying(score=899.0, best=1000.0, gain=1000.0)
    assert search_rules.worth_trying(score=11.0, best=20.0, gain=20.0)  # within what keeps a rival
    assert search_rules.worth_trying(score=801.0, best=1000.0, gain=1000.0, coarse=True)
    assert not search_rules.worth_trying(score=799.0, best=1000.0, gain=1000.0, coarse=True)


def test_a_number_is_believed_that_data_tell_better_than_its_bounds():
    assert search_rules.believable(std=0.9, change=0.2, width=10.0)
    assert not search_rules.believable(std=1.0, change=0.2, width=10.0)  # five sizes worth finding
    assert not search_rules.believable(
        std=0.3, change=0.2, width=1.0
    )  # as wide as the bounds allow


def test_a_fit_ends_elsewhere_where_it_misses_more_than_linear_algebra_may():
    """Of a gain of 600, linear algebra may be wrong by a tenth; of a small one by 30."""
    assert search_rules.ends_elsewhere(behind=734.0, promised=11.0, gain=590.0)
    assert not search_rules.ends_elsewhere(behind=70.0, promised=11.0, gain=600.0)
    assert not search_rules.ends_elsewhere(behind=734.0, promised=700.0, gain=590.0)
    assert not search_rules.ends_elsewhere(behind=29.0, promised=0.0, gain=50.0)
    assert search_rules.ends_elsewhere(behind=31.0, promised=0.0, gain=50.0)


def test_two_starts_that_end_apart_are_told():
    assert not search_rules.starts_disagree(100.0, 100.0 + search_rules.WORTH)
    assert search_rules.starts_disagree(100.0, 101.0 + search_rules.WORTH)


def test_an_effect_without_promise_is_not_fitted():
    enough = search_rules.HOPELESS * search_rules.needed(2)
    assert search_rules.may_be_worth_adding(promised=enough, parameters=2, gain=100.0)
    assert not search_rules.may_be_worth_adding(promised=0.99 * enough, parameters=2, gain=100.0)
    # forms that are a little wrong leave more than this beside a chi2 of 90 000
    assert not search_rules.may_be_worth_adding(promised=enough, parameters=2, gain=90_000.0)
    assert search_rules.worth_adding(gained=180.0, parameters=2, held=20.0, gain=90_000.0)


def test_an_effect_is_dropped_where_the_others_lose_little():
    enough = search_rules.needed(1)
    assert search_rules.can_be_dropped(lost=enough - 0.1, parameters=1)
    assert not search_rules.can_be_dropped(lost=enough, parameters=1)
    assert not search_rules.can_be_dropped(lost=enough, parameters=0)


def test_trying_without_is_saved_only_where_both_signs_are_clear():
    lost = 3.1 * search_rules.needed(1)
    assert search_rules.surely_needed(sigmas=search_rules.SURE + 0.1, lost=lost, parameters=1)
    assert not search_rules.surely_needed(sigmas=search_rules.SURE, lost=lost, parameters=1)
    assert not search_rules.surely_needed(sigmas=20.0, lost=0.9 * lost, parameters=1)


def test_ties_are_told_by_scores():
    assert search_rules.alike(100.0 - search_rules.TIE + 0.1, 100.0)
    assert not search_rules.alike(100.0 - search_rules.TIE, 100.0)


def test_a_fit_starts_again_where_it_misses_the_promise():
    assert not search_rules.fell_short(total=1040.0, promised=1000.0, gain=50.0)  # a small effect
    assert not search_rules.fell_short(total=1019.0, promised=1000.0, gain=200.0)
    assert search_rules.fell_short(total=1021.0, promised=1000.0, gain=200.0)
    assert not search_rules.fell_short(total=1099.0, promised=1000.0, gain=1000.0)
    assert search_rules.fell_short(total=1101.0, promised=1000.0, gain=1000.0)
    # and from the same chi2 on a fit of the noise is not followed
    assert search_rules.short_of(promised=1000.0, gain=1000.0) == pytest.approx(1100.0)
    assert search_rules.short_of(promised=1000.0, gain=50.0) == float("inf")


def test_a_rival_is_fitted_where_linear_algebra_leaves_it_near():
    assert search_rules.worth_refitting(behind=9.9, gain=1000.0, rival_gain=0.0)
    # 30 behind of a gain of 100: three times two paired errors of 5.5 are 33
    assert search_rules.worth_refitting(behind=30.0, gain=150.0, rival_gain=121.0)
    assert not search_rules.worth_refitting(behind=34.0, gain=150.0, rival_gain=121.0)
    assert not search_rules.worth_refitting(
        behind=30.0, gain=150.0, rival_gain=119.0
    )  # 80 % of the gain
    # what linear algebra gets wrong of a large gain is larger than what decides
    assert search_rules.worth_refitting(behind=990.0, gain=10_000.0, rival_gain=0.0)
    assert not search_rules.worth_refitting(behind=1010.0, gain=10_000.0, rival_gain=0.0)


def test_a_fit_is_stuck_where_its_own_step_promises_what_decides():
    assert not search_rules.is_stuck(total=1009.0, promised=1000.0)
    assert search_rules.is_stuck(total=1011.0, promised=1000.0)


@pytest.mark.parametrize(
    ("behind", "gain", "errors", "beyond", "stays"),
    [
        (9.9, 100.0, 9.0, False, True),
        (100.0, 1000.0, 1.9, False, True),
        (501.0, 1000.0, 0.9, False, False),  # no scatter makes a rival of half an explanation
        (10.0, 400.0, 2.0, False, False),
        (199.0, 10_000.0, 9.0, False, True),  # 2 % of the gain is a matter of form
        (201.0, 10_000.0, 9.0, False, False),
        (0.0, 100.0, 0.0, True, False),
    ],
)
def test_what_keeps_a_rival(behind, gain, errors, beyond, stays):
    kept = search_rules.stays_a_rival(behind=behind, gain=gain, errors=errors, beyond_bound=beyond)
    assert kept == stays


def test_paired_errors_count_windows_not_samples():
    difference = np.random.default_rng(0).normal(1.0, 2.0, 40)
    expected = difference.mean() / (difference.std(ddof=1) / np.sqrt(40))
    assert search_rules.paired_errors(difference.sum(), difference) == pytest.approx(expected)
    assert search_rules.paired_errors(7.0, np.array([7.0])) == 7.0


def test_the_price_of_parameters_counts_beside_the_scatter_of_windows():
    """Six numbers of a moving rider fitted a drive's lag 19 of chi2 worse, 11 in one window."""
    difference = np.array([10.9, 1.2, 1.2, 0.6, -0.6, 0.4, 0.1, 0.0])
    assert search_rules.paired_errors(difference.sum(), difference) < search_rules.RIVAL_ERRORS
    assert (
        search_rules.paired_errors(difference.sum() + 45.0, difference) > search_rules.RIVAL_ERRORS
    )
    # one number in the place of six does not excuse what it misses
    fewer = search_rules.paired_errors(difference.sum() - 10.0, difference)
    assert fewer == search_rules.paired_errors(difference.sum(), difference)


def test_a_whole_size_is_followed_as_far_as_it_may_be_the_best_beside_another():
    assert search_rules.reach_of_whole(best=1000.0, gain=100.0) == search_rules.reach(
        best=1000.0, gain=100.0
    )
    reach = search_rules.reach_of_whole(best=1000.0, gain=5000.0)
    brings = 6000.0 - reach
    assert search_rules.is_just_behind(gain=brings + 1.0, best=5000.0)
    assert not search_rules.is_just_behind(gain=brings - 1.0, best=5000.0)
