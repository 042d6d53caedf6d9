"""The rules of the verdict, one by one, on plain numbers: what each allows and what it stops."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from mjchair.diagnosis import notes, rules
from mjchair.diagnosis.explain import search_rules
from mjchair.diagnosis.result import Estimate, GapSummary
from mjchair.diagnosis.rules import HeldOut, Standing, Verdict
from mjchair.report.diagnosis_words.first_screen import nothing_missing, turn_words

# an effect that closes all and is sure
CLEAR = Standing(
    closure=0.99,
    gap_left=False,
    gain_by_run=500.0,
    gain_by_manoeuvre=300.0,
    sigmas=(20.0,),
    at_bound=False,
)


def said(**changes):
    return rules.verdict(True, replace(CLEAR, **changes))


def test_a_clear_effect_is_named():
    assert said() == Verdict.NAMED == "named"


def test_without_a_gap_nothing_is_said_whatever_fits():
    assert rules.verdict(False, CLEAR) == Verdict.NONE
    assert rules.verdict(False, None) == Verdict.NONE


def test_a_gap_that_nothing_gains_on_is_unknown():
    assert rules.verdict(True, None) == Verdict.UNKNOWN


@pytest.mark.parametrize(("after", "two"), [(120.0, Verdict.NAMED), (350.0, Verdict.AMBIGUOUS)])
def test_one_of_two_effects_may_stand_in_for_what_they_leave_held_out(after, two):
    """A rider who moves beside a shimmy left 1.9 times the noise: a motor braked besides."""
    held = HeldOut(before=1600.0, after=after, dof=100.0, changed=1500.0)
    assert said(held_out=held) == Verdict.NAMED
    assert said(held_out=held, sigmas=(20.0, 9.0)) == two


@pytest.mark.parametrize(
    "reason",
    [
        {"closure": rules.PARTLY - 0.01},
        {"gain_by_run": rules.HELD - 0.1},
        {"held_out": HeldOut(before=1000.0, after=1001.0, dof=100.0, changed=900.0)},
        {"at_bound": True},
    ],
)
def test_each_of_these_alone_makes_it_unknown(reason):
    assert said(**reason) == Verdict.UNKNOWN


def test_what_closes_little_of_a_held_out_gap_is_an_answer_beside_which_more_is_missing():
    """A drag of the air that closed 97 % of a gap, and 36 % held out, was no answer at all."""
    held = HeldOut(before=264.0, after=216.0, dof=130.0, changed=317.0)
    assert said(held_out=held) == Verdict.AMBIGUOUS
    assert rules.more_missing(replace(CLEAR, held_out=held))
    assert said(held_out=replace(held, after=196.0)) == Verdict.NAMED
    # half its size, by which nothing is foretold better or worse, is not proved wrong
    assert said(held_out=replace(held, after=265.0)) == Verdict.AMBIGUOUS
    assert said(held_out=replace(held, after=315.0)) == Verdict.UNKNOWN


def test_a_corrected_chair_that_is_worse_on_held_out_runs_is_not_named():
    """Its effects carry over, but not with all else that the fit moved to explain what is left."""
    held = HeldOut(before=6714.0, after=1809.0, dof=178.0, changed=9221.0)
    assert rules.carries_over(held)
    assert said(held_out=replace(held, farther=held.scatter)) == Verdict.NAMED
    worse = replace(held, farther=1.1 * held.scatter)
    assert said(held_out=worse) == Verdict.AMBIGUOUS
    assert rules.believed(0.98, replace(CLEAR, held_out=worse)) == 0.98
    alone = replace(CLEAR, held_out=replace(held, after=held.dof, farther=held.scatter))
    assert not rules.more_missing(alone)
    grown = replace(alone.held_out, farther=1.1 * held.scatter)
    assert rules.more_missing(replace(alone, held_out=grown))


@pytest.mark.parametrize(
    "allowed",
    [
        {"closure": rules.CLOSES},
        {"gain_by_run": rules.HELD},
        {"gap_left": True},
        {"unfinished": True},
        {"probability": rules.PROBABLE},
        {"held_out": HeldOut(before=1000.0, after=120.0, dof=100.0, changed=900.0)},
    ],
)
def test_just_inside_each_limit_it_is_still_named(allowed):
    assert said(**allowed) == Verdict.NAMED


@pytest.mark.parametrize(
    "doubt",
    [
        {"sigmas": (20.0, rules.SIGMAS)},
        {"gain_by_manoeuvre": 0.0},
        {"closure": rules.CLOSES - 0.01},
        {"closure": rules.PARTLY},
        {"probability": rules.PROBABLE - 0.01},
        {"rivals": True},
        {"once": True},
        {"gap_left": True, "runs": 1},
        {"gap_left": True, "unfinished": True},
    ],
)
def test_each_of_these_alone_makes_it_ambiguous(doubt):
    assert said(**doubt) == Verdict.AMBIGUOUS


def test_a_gap_needs_the_family_and_one_large_test():
    assert rules.gap_exists(0.001, 6.0)
    assert not rules.gap_exists(0.02, 6.0)
    assert not rules.gap_exists(0.001, rules.LEAST)
    # beside effects that bring very much, the rounding of their columns is no gap
    assert rules.gap_exists(0.001, 6.0, gain=1e5)
    assert not rules.gap_exists(0.001, 6.0, gain=331_000.0)
    assert rules.gap_exists(0.001, 10.0, gain=331_000.0)


@pytest.mark.parametrize(
    ("before", "after", "changed", "holds"),
    [
        (1000.0, 540.0, 900.0, True),  # an excess of 900 of which less than half is left
        (1000.0, 560.0, 900.0, False),
        (1000.0, 540.0, 2000.0, True),  # and no more is asked of what goes too far
        (1000.0, 890.0, 200.0, True),  # of what changes 200 a hundred is asked
        (1000.0, 910.0, 200.0, False),
        (1000.0, 990.0, 50.0, True),  # 50 less three times its noise, 14, leave 8
        (1000.0, 995.0, 50.0, False),
        (1000.0, 1030.0, 40.0, True),  # what changes nothing has no part in a gap,
        (1000.0, 1050.0, 40.0, False),  # but opens none beyond scatter, 42
        (147.0, 128.0, 67.0, True),  # where no more than noise is left, what is foretold counts
        (147.0, 131.6, 67.0, False),  # a slope in the place of a wind: 15 of 67, noise 16
    ],
)
def test_what_held_out_trials_say(before, after, changed, holds):
    held = HeldOut(before=before, after=after, dof=100.0, changed=changed)
    assert rules.carries_over(held) == holds


@pytest.mark.parametrize(("cost", "gain", "may"), [(1221.0, 1.2e6, False), (20.0, 500.0, True)])
def test_a_wall_counts_where_what_pushes_there_may_be_all_that_is_missing(cost, gain, may):
    """Tires that slid, 0.270 of 0.263, were not named for a wall that brought 0.1 % of them."""
    assert rules.may_be_all(cost=cost, gain=gain) == may


def test_what_held_out_trials_speak_against_is_not_believed():
    held = HeldOut(before=141.0, after=197.0, dof=160.0, changed=90.0)
    against, fine = (replace(CLEAR, held_out=replace(held, after=a)) for a in (197.0, 130.0))
    assert rules.believed(0.55, against) == 0.0
    assert rules.believed(0.55, fine) == 0.55
    assert rules.believed(0.55, replace(fine, gain_by_run=-67.0)) == 0.0
    assert rules.believed(0.55, replace(CLEAR, held_out=None)) == 0.55
    assert rules.believed(0.55, None) == 0.0


@pytest.mark.parametrize(("foretold", "once"), [(397.0, False), (100.0, True), (-500.0, True)])
def test_what_other_runs_foretell_of_a_run_did_not_happen_once(foretold, once):
    """Tires that slid in two swerves stood beside an event in one of them: 388 of chi2 to 296."""
    assert rules.happened_once(event=388.0, gain=296.0, foretold=foretold) == once


@pytest.mark.parametrize(
    ("before", "after", "changed", "again"),
    [
        (1000.0, 120.0, 900.0, True),  # held-out trials show what the effects explain
        (1000.0, 600.0, 900.0, False),
        (1000.0, 980.0, 30.0, False),  # another cause's gap
        (130.0, 110.0, 900.0, False),  # they show nothing
    ],
)
def test_what_held_out_trials_show_again_did_not_happen_once(before, after, changed, again):
    """A patch that one run and a held-out one pass over was called an event, and no answer."""
    held = HeldOut(before=before, after=after, dof=100.0, changed=changed)
    assert rules.happened_once(event=990.0, gain=1000.0)
    assert rules.happened_once(event=990.0, gain=1000.0, held=held) != again
    one_run = replace(CLEAR, gain_by_run=7.0, held_out=held)
    assert rules.explains(one_run) == again


@pytest.mark.parametrize(
    ("after", "changed", "answer"),
    [
        (989.0, 214.0, True),  # of a gap of 900 that another cause makes, what brings anything
        # what changes more than there is brings a fifth of it, but for noise: 720 + 150 of 900
        (960.0, 1400.0, True),
        (975.0, 1400.0, False),
        (990.0, 1400.0, False),  # and a floor in waves is no slope
    ],
)
def test_what_changes_held_out_trials_a_lot_brings_something_there(after, changed, answer):
    held = HeldOut(before=1000.0, after=after, dof=100.0, changed=changed)
    assert rules.explains(replace(CLEAR, held_out=held)) == answer


def test_held_out_runs_that_contradict_an_answer_are_named_beside_what_it_closes():
    effect = SimpleNamespace(effect=SimpleNamespace(key="air_drag"))
    choice = SimpleNamespace(fitted=SimpleNamespace(variant=SimpleNamespace(terms=[effect])))
    held = HeldOut(before=400.0, after=900.0, dof=100.0, changed=600.0)
    note = notes.no_answer(choice, replace(CLEAR, closure=1.0, held_out=held))
    assert "air_drag, closes 100 % of it on the runs" in note
    assert note.endswith("2.00 of the noise without it and 3.00 with it")
    kept = replace(held, after=150.0)
    assert "contradict" not in notes.no_answer(choice, replace(CLEAR, held_out=kept))


def test_a_held_out_gap_that_the_effects_hardly_change_does_not_speak_against_them():
    """A gyroscope's bias whose runs were explained whole was `unknown` for a gap of 62 in 192."""
    held = HeldOut(before=251.0, after=243.4, dof=192.0, changed=10.4)
    assert not held.shown and rules.carries_over(held)
    assert said(held_out=held) == Verdict.NAMED


@pytest.mark.parametrize(("chi2", "wrong"), [(190.0, True), (180.0, False)])
def test_a_chair_that_foretells_wrongly_is_no_answer(chi2, wrong):
    """Twice three standard deviations of 100 degrees of freedom are 85."""
    assert rules.foretells_wrongly(chi2, 100.0) == wrong
    held = HeldOut(before=190.0, after=chi2, dof=100.0, changed=20.0)
    assert rules.more_missing(replace(CLEAR, held_out=held)) == wrong


def share(**changes):
    known = {
        "gained": 900.0,
        "left": 0.0,
        "excess": 1000.0,
        "excess_std": 20.0,
        "excess_after": 0.0,
        "excess_after_std": 20.0,
    }
    return rules.closure(**{**known, **changes})


def test_closure_is_the_share_of_the_excess_that_is_gone():
    assert share() == 1.0
    assert share(excess_after=420.0) == pytest.approx(0.6)  # 420 less its scatter of 20
    assert share(excess_after=15.0) == 1.0  # below its scatter nothing is left


def test_what_a_further_test_shows_counts_as_left():
    assert share(left=100.0) == pytest.approx(0.9)
    assert share(left=-50.0) == 1.0


def test_a_small_excess_has_no_say_of_its_own():
    assert share(excess=100.0, excess_after=90.0) == 1.0
    assert share(excess=121.0, excess_after=90.0) == pytest.approx(1.0 - 70.0 / 121.0)


def test_closure_stays_between_nothing_and_all():
    assert share(excess_after=5000.0) == 0.0
    assert share(gained=-10.0) == 0.0


def test_a_further_effect_pays_for_its_parameters():
    enough = search_rules.needed(2)
    assert enough == 2.0 * search_rules.PENALTY + search_rules.WORTH
    held = {"held": rules.HELD, "parameters": 2, "gain": 1000.0}
    assert search_rules.worth_adding(gained=enough, **held)
    assert not search_rules.worth_adding(gained=enough - 0.1, **held)


def test_a_further_effect_holds_on_runs_that_it_was_not_fitted_to():
    assert not search_rules.worth_adding(gained=1e4, parameters=1, held=rules.HELD - 0.1, gain=2e4)
    assert search_rules.worth_adding(gained=1e4, parameters=1, held=rules.HELD, gain=2e4)


def test_what_an_answer_leaves_is_said():
    assert not rules.more_missing(CLEAR)
    assert rules.more_missing(replace(CLEAR, walls=1))
    assert rules.more_missing(replace(CLEAR, gap_left=True))
    assert rules.more_missing(replace(CLEAR, closure=rules.CLOSES - 0.01))


@pytest.mark.parametrize(
    ("changes", "matters"),
    [
        ({}, False),
        ({"force": 1.2}, True),
        ({"gap": rules.SMALL_GAP}, True),  # it shows, though no force goes with anything
        ({"said": Verdict.NAMED}, False),
        (
            {"said": Verdict.NAMED, "sigmas": rules.CERTAIN + 0.1},
            True,
        ),  # certain
        (
            {"said": Verdict.NAMED, "sigmas": 99.0, "told": True},
            False,
        ),  # unless the limit was given
        ({"said": Verdict.AMBIGUOUS}, False),
        # that something is there is certain, though not which of a set
        ({"said": Verdict.AMBIGUOUS, "sigmas": rules.CERTAIN + 0.1}, True),
        ({"said": Verdict.UNKNOWN, "sigmas": rules.CERTAIN + 0.1}, False),
        # what nothing explains and does not make the residual larger than noise
        ({"force": 4.0, "excess": 1.9, "probability": 0.49}, False),
        # but what is rather there matters, though it explains too little to be an answer
        ({"force": 4.0, "excess": 1.9}, True),
        ({"force": 4.0, "excess": 1.9, "gap": rules.SMALL_GAP}, True),
        # a wind of 3 m/s on another chair, with a probability of 0.22
        ({"force": 6.8, "excess": 1.9, "p": 1.5e-15}, True),
        ({"force": 0.4, "excess": 1.9, "p": 1.5e-15}, False),
        ({"force": 4.0, "excess": 1.9, "told": True}, True),
        ({"force": 4.0, "excess": 1.9, "said": Verdict.NAMED}, True),
        # an answer that is rather not there is none, unless something shows
        ({"force": 4.0, "excess": 1.9, "said": Verdict.AMBIGUOUS, "probability": 0.49}, False),
        ({"force": 4.0, "excess": 2.1, "said": Verdict.AMBIGUOUS, "probability": 0.49}, True),
        # unless it takes back what stands on a wall and hides the gap
        (
            {
                "force": 4.0,
                "excess": 1.9,
                "said": Verdict.AMBIGUOUS,
                "probability": 0.49,
                "freed": True,
            },
            True,
        ),
        ({"force": 4.0, "excess": 1.9, "freed": True, "probability": 0.49}, False),
        # where nothing is the most probable, the residual must show as clearly as a gap does
        ({"force": 4.0, "excess": 4.9, "nothing": True, "probability": 0.1}, False),
        ({"force": 4.0, "excess": 5.1, "nothing": True, "probability": 0.1}, True),
        ({"force": 4.0, "excess": 4.9, "nothing": True, "said": Verdict.NAMED}, True),
    ],
)
def test_what_is_below_the_limit_does_not_matter(changes, matters):
    known = {
        "force": 0.4,
        "limit": 1.2,
        "gap": 1.1,
        "excess": 9.0,
        "p": 1e-8,
        "told": False,
        "said": Verdict.UNKNOWN,
        "sigmas": rules.CERTAIN,
        "probability": 0.9,
    }
    assert rules.matters(**{**known, **changes}) == matters


def test_the_words_of_none_that_matters_fit_the_force():
    """A force above the limit is not said to be below it."""
    gap = GapSummary(before=1.5, after=None, scope="", p_value=1e-6, p_value_after=None)
    small, large = (SimpleNamespace(value=v, limit=1.2) for v in (0.4, 3.7))
    below, above = (
        nothing_missing(SimpleNamespace(gap=gap, material=m, next_experiment=""))
        for m in (small, large)
    )
    assert "below 1.2 N" in below
    assert "N" not in above.removeprefix("N")


@pytest.mark.parametrize(
    ("wheel", "drive", "said"),
    [(3.0, 4.3, "3 N comes once a turn of the rear wheels"), (3.0, 7.0, ""), (1.0, 1.0, "")],
)
def test_a_force_once_a_turn_that_counts_as_noise_is_told(wheel, drive, said):
    sizes = {"drive": drive, "wheel_turn": wheel}
    process = {name: Estimate(value=v, std=None, unit="N") for name, v in sizes.items()}
    found = turn_words(SimpleNamespace(process=process, material=SimpleNamespace(limit=1.2)))
    assert said in found and bool(said) == bool(found)
    assert not turn_words(SimpleNamespace(process={}, material=None))


def test_nothing_is_missing_only_if_the_chair_is_where_the_fit_moved_it():
    gap = GapSummary(before=1.0, after=None, scope="", p_value=0.9, p_value_after=None)
    plain, far = (
        SimpleNamespace(gap=gap, material=None, next_experiment=n)
        for n in ("", "Measure the mass.")
    )
    assert nothing_missing(plain).startswith("Nothing: ")
    assert nothing_missing(far).startswith("Nothing, if chair and sensors are as far ")
    far.gap, far.material = replace(gap, p_value=1e-6), SimpleNamespace(value=0.4, limit=1.2)
    assert nothing_missing(far).startswith("Nothing that matters, if chair and sensors are as far ")


def test_an_event_stands_beside_an_effect_that_brings_little_more():
    assert rules.happened_once(event=85.0, gain=100.0)
    assert not rules.happened_once(event=75.0, gain=100.0)


def test_what_is_needed_of_a_further_run_decides():
    more = rules.to_show_again(event=900.0, gain=908.0)
    for share, once in ((0.99, True), (1.01, False)):
        assert rules.happened_once(event=900.0, gain=908.0 + share * more) == once
    behind, gain = 20.0, 5000.0
    more = search_rules.to_rule_out(behind=behind, gain=gain)
    for share, stays in ((0.99, True), (1.01, False)):
        far = behind + share * more
        assert stays == search_rules.stays_a_rival(
            behind=far, gain=gain, errors=9.0, beyond_bound=False
        )


def test_what_is_probable_is_shown_as_a_rival():
    assert rules.is_shown(0.10, before=0.95)
    assert not rules.is_shown(0.09, before=0.95)
    assert rules.is_shown(0.02, before=0.94)  # without it less than 95 % are shown
    assert not rules.is_shown(0.01, before=0.94)


@pytest.mark.parametrize(
    ("linear", "fitted", "brings"),
    [
        (1000.0, 1300.0, 1000.0),  # a patch finds its place
        (-1247.0, 2059.0, 2059.0),  # casters turn over, which linear algebra does not see
        (400.0, 900.0, 900.0),
    ],
)
def test_an_event_is_held_against_what_its_own_algebra_says_of_effects(linear, fitted, brings):
    """An event of 122 stood beside a trail and a friction that bring 2059."""
    assert rules.beside_event(linear=linear, fitted=fitted) == brings


def test_what_was_moved_far_is_measured_to_either_side():
    assert rules.is_far(-2.6)
    assert rules.is_far(2.5)
    assert not rules.is_far(2.4)


def test_what_leaves_a_number_on_its_wall_is_not_named_alone():
    """What pushes the number there may be all that is missing."""
    assert rules.verdict(True, CLEAR) == Verdict.NAMED
    assert rules.verdict(True, replace(CLEAR, walls=1)) == Verdict.AMBIGUOUS
