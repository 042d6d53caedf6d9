"""Effects that act in one run alone, on linear problems whose sizes are known."""

from types import SimpleNamespace

import numpy as np
import pytest

from mjchair.diagnosis import decide, notes, rules
from mjchair.diagnosis.explain import event, one_run, screening, search_rules
from mjchair.diagnosis.explain.candidates import Start
from mjchair.diagnosis.explain.column_ids import EffectColumn, EffectGroup
from mjchair.diagnosis.explain.hypotheses import weigh
from mjchair.diagnosis.explain.in_each_run import best_run
from mjchair.diagnosis.explain.probability import ONE_RUN, with_one_run
from mjchair.diagnosis.fit import bounded
from mjchair.diagnosis.fit.column_ids import RoughlyKnown
from mjchair.diagnosis.fit.system import System
from mjchair.effects.effect import Effect, Parameter
from mjchair.effects.sensors import sensor_effects

RUNS, WINDOWS, ROWS = ("east", "west", "slalom"), 4, 80
STEP = 2.0  # N, of which a column is the answer


def start(name):
    """An effect of one force (N), and how a fit of it begins."""
    group = EffectGroup(name, 0)
    return Start(
        effect=Effect(
            name=name,
            parameters=(Parameter("force", "N", STEP, -90.0, 90.0),),
            signature="",
            source="",
            edit=lambda spec, force: None,
        ),
        group=group,
        columns=(EffectColumn(group, 0),),
        combine=lambda coefficients: {"force": STEP * float(coefficients[0])},
        free=("force",),
    )


def problem(forces, shows=(1.0, 1.0, 1.0), runs=RUNS, seed=4):
    """A base, and the choice of a drag of one size in all runs.

    Args:
      forces: N, drag in each run. shows: share of the drag that each run shows.
    """
    rng = np.random.default_rng(seed)
    run = np.repeat(np.arange(len(runs)), WINDOWS)
    G, b, c = np.zeros((run.size, 3, 3)), np.zeros((run.size, 3)), np.zeros(run.size)
    for i, k in enumerate(run):
        J = rng.standard_normal((ROWS, 3))  # of a mass, a drag and a wind
        J[:, 1] *= shows[k]
        r = 0.3 * J[:, 0] + forces[k] / STEP * J[:, 1] + rng.standard_normal(ROWS)
        G[i], b[i], c[i] = J.T @ J, J.T @ r, r @ r
    starts = [start("drag"), start("wind")]
    system = System(
        columns=[RoughlyKnown("mass"), *(column for s in starts for column in s.columns)],
        nuisance=1,
        G=G,
        b=b,
        c=c,
        run=run,
        back=np.zeros(1),
    )
    windows = np.arange(run.size)
    reduced = bounded.reduce(system, windows)
    study = SimpleNamespace(runs=[SimpleNamespace(trial=SimpleNamespace(name=n)) for n in runs])
    base = SimpleNamespace(
        bench=SimpleNamespace(windows=windows, simulator=SimpleNamespace(study=study)),
        plain=SimpleNamespace(total=reduced.total),
        starts=starts,
        system=system,
        reduced=reduced,
        acting_alone=best_run(system, windows, starts),
    )
    drag = weigh(reduced, starts[:1])
    fitted = SimpleNamespace(total=reduced.total - drag.gain)
    return base, SimpleNamespace(hypothesis=drag, fitted=fitted)


@pytest.fixture(autouse=True)
def pushes(monkeypatch):
    """What an event brings, in chi2."""
    brings = [0.0]
    monkeypatch.setattr(event, "largest", lambda base: event.Event(gain=brings[0]))
    return brings


def found_in(base, choice, excess=1e9):
    """What acts in one run alone, where the gap has this chi2."""
    return one_run.in_one_run(base, SimpleNamespace(excess=excess), choice)


def test_a_brake_that_rubs_in_one_run_is_found_with_its_size():
    found = found_in(*problem((0.0, 1.5, 0.0)))
    assert found.trial == "west" and [h.name for h in found.options] == ["drag"]
    term, errors = found.term(found.options[0])
    assert errors["force"] == pytest.approx(STEP / np.sqrt(WINDOWS * ROWS), rel=0.1)
    assert abs(term.values["force"] - 1.5) < 4.0 * errors["force"]
    assert found.gain > 2.0 * found.others


def test_noise_brings_as_much_as_rarely_as_is_said():
    problems = [problem((0.0, 0.0, 0.0), seed=k)[0] for k in range(400)]
    chances = [one_run._by_chance(base, base.acting_alone) for base in problems]
    assert 0.05 < np.mean(np.array(chances) < 0.1) < 0.15
    assert found_in(*problem((0.0, 1.5, 0.0))).p < 1e-10


def test_it_is_found_where_no_effect_explains_all_runs():
    base, _ = problem((1.5, 0.0, 0.0))
    found = found_in(base, None)
    assert found.trial == "east" and found.others == 0.0


@pytest.mark.parametrize("shows", [(1.0, 1.0, 1.0), (0.0, 1.0, 0.02)])
def test_what_acts_in_all_runs_is_not_of_one_run_though_one_alone_shows_it(shows):
    assert found_in(*problem((1.5, 1.5, 1.5), shows)) is None


def test_what_the_other_runs_only_do_not_show_is_not_of_one_run_whatever_else_was_chosen():
    """Two numbers were chosen of a motor, and one of them "in the slalom alone" had 96 %."""
    base, drag = problem((1.5, 1.5, 1.5), (0.02, 1.0, 0.0))
    dearer = SimpleNamespace(keys=("drag",), free=2, penalty=20.0, name="drag")
    choice = SimpleNamespace(hypothesis=dearer, fitted=drag.fitted)
    assert found_in(base, choice, excess=1.0) is None
    base, drag = problem((0.0, 1.5, 0.0), (1.0, 1.0, 1.0))
    assert found_in(base, SimpleNamespace(hypothesis=dearer, fitted=drag.fitted)) is not None


def test_one_run_has_no_others_to_differ_from():
    assert found_in(*problem((1.5,), (1.0,), ("east",))) is None


def test_little_more_is_no_finding_nor_what_linear_algebra_may_be_wrong_by():
    assert search_rules.is_of_one_run(by=16.0, gain=100.0)
    assert not search_rules.is_of_one_run(by=14.0, gain=100.0)
    assert not search_rules.is_of_one_run(by=90.0, gain=1000.0)


def test_in_the_place_of_what_is_no_answer_it_need_only_fit_better_and_close_the_gap():
    assert search_rules.may_be_of_one_run(by=4.0, gain=860.0, excess=910.0)
    assert not search_rules.may_be_of_one_run(by=-1.0, gain=860.0, excess=910.0)
    assert not search_rules.may_be_of_one_run(by=4.0, gain=600.0, excess=910.0)
    base, drag = problem((0.6, 1.5, 0.7))
    assert found_in(base, drag) is None
    base, drag = problem((0.0, 1.5, 0.0))
    near = SimpleNamespace(hypothesis=drag.hypothesis, fitted=SimpleNamespace(total=0.0))
    west = base.acting_alone
    near.fitted.total = base.reduced.total - west.options[0].gain + 4.0
    found = found_in(base, near, excess=1.0)
    assert found.trial == "west" and not found.sure


@pytest.mark.parametrize(("share", "clear"), [(0.0, True), (0.5, False)])
def test_what_roughly_known_numbers_bring_is_no_part_of_what_one_run_explains(share, clear):
    """A wheel 2 mm larger, of 1900 sigma, was `unknown` with one run, and nothing was fitted.

    Args:
      share: of what the effect in one run brings, that the chair without effects brings by its fit.
    """
    base, _ = problem((0.0, 1.5, 0.0))
    brings = base.acting_alone.options[0].gain
    base.plain.total = base.reduced.total - share * brings
    assert one_run.is_clear(base, SimpleNamespace(excess=brings)) is clear


def test_what_happens_in_two_seconds_does_not_act_all_along(pushes):
    base, choice = problem((0.0, 1.5, 0.0))
    pushes[0] = found_in(base, choice).gain + 1.0
    assert found_in(base, choice) is None


def test_with_fewer_numbers_one_run_is_a_rival_and_nothing_is_named():
    assert search_rules.fits_alike_in_one_run(by=-1.0, fewer=True)
    assert not search_rules.fits_alike_in_one_run(by=-9.0, fewer=True)
    assert not search_rules.fits_alike_in_one_run(by=0.0, fewer=False)
    stands = {"closure": 1.0, "gap_left": False, "gain_by_run": 99.0, "gain_by_manoeuvre": 9.0}
    choice = rules.Standing(**stands, sigmas=(9.0,), at_bound=False, one_alike=True)
    assert rules.verdict(gap=True, choice=choice) == rules.Verdict.AMBIGUOUS


@pytest.mark.parametrize("alike", [False, True])
def test_beside_a_name_no_run_alone_is_said(alike):
    said = [v for v in rules.Verdict if rules.says_one_run(v, alike=alike)]
    assert said == [rules.Verdict.AMBIGUOUS] * alike + [rules.Verdict.UNKNOWN]


def test_nothing_is_an_answer_beside_what_explains_more_in_one_run():
    stands = {"closure": 1.0, "gap_left": False, "gain_by_run": 99.0, "gain_by_manoeuvre": 9.0}
    for one, said in ((False, rules.Verdict.NAMED), (True, rules.Verdict.UNKNOWN)):
        choice = rules.Standing(**stands, sigmas=(9.0,), at_bound=False, one_run=one)
        assert rules.verdict(gap=True, choice=choice) == said


def test_what_explains_more_in_one_run_is_as_much_more_probable():
    known = with_one_run({"drag": 0.8, "wind": 0.2}, by=2.0 * np.log(49.0 * 20.0), sure=True)
    assert known == pytest.approx({ONE_RUN: 0.98, "drag": 0.016, "wind": 0.004})
    assert list(known) == [ONE_RUN, "drag", "wind"]
    assert with_one_run({"drag": 1.0}, by=1e6, sure=True)[ONE_RUN] == 1.0


def test_a_rival_in_one_run_is_weighed_as_other_rivals_are():
    """A number fewer made it 96 %, beside a sentence that put the effect in all runs first."""
    known = with_one_run({"drag": 1.0}, by=12.0, sure=False)
    assert 0.05 < known[ONE_RUN] < 0.15
    assert with_one_run({"drag": 1.0}, by=12.0, sure=True)[ONE_RUN] > 0.9


def test_the_report_says_which_run_differs_and_by_what():
    base, choice = problem((0.0, 1.5, 0.0))
    found = found_in(base, choice)
    answer = decide._in_one_run(found, SimpleNamespace(excess=1.0))
    assert answer.trial == "west"
    assert answer.effects[0].parameters["force"].unit == "N"
    assert answer.effects[0].closure == 1.0
    assert notes.of_one_run(found, choice).startswith(
        f"west differs from the other runs: drag in it alone lowers chi2 by {found.gain:.0f} with "
        f"1 number, drag in all runs by {found.others:.0f}"
    )


def test_the_gain_of_a_sensor_is_no_rival_in_one_run(monkeypatch):
    """It took the place of a smaller wheel where a caster had turned over to the other side."""
    looked = []
    monkeypatch.setattr(
        screening, "best_run", lambda system, windows, starts: looked.extend(starts)
    )
    starts = [SimpleNamespace(effect=e) for e in sensor_effects("left_caster_angle")]
    bench = SimpleNamespace(windows=None)
    base = SimpleNamespace(system=None, bench=bench, starts=starts)
    screening.Base.acting_alone.func(base)
    assert [s.effect.name for s in looked] == ["sensor_bias", "sensor_delay"]
