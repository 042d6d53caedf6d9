"""The next experiment: what is proposed separates, by about as much as was promised."""

import math
from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest
from noisy_run import NOISE, noisy_run

import mjchair
from mjchair.diagnosis import decide, diagnose
from mjchair.diagnosis.data.roughly_known import MECHANICAL, Nuisance
from mjchair.diagnosis.data.study import Run, make_study
from mjchair.diagnosis.explain.candidates import Around, collect
from mjchair.diagnosis.explain.column_ids import Driver, Quantity
from mjchair.diagnosis.fit import process
from mjchair.diagnosis.fit.nonlinear import refit
from mjchair.diagnosis.fit.variant import Term, Variant
from mjchair.diagnosis.next_experiment import design, ranking, wording
from mjchair.diagnosis.next_experiment.comparison import Evidence, Experiment
from mjchair.diagnosis.next_experiment.design import Plan, telling
from mjchair.diagnosis.next_experiment.manoeuvres import LIBRARY, Setting, possible, setting
from mjchair.diagnosis.next_experiment.rehearsal import Rehearsal, Version
from mjchair.diagnosis.replay.pulses import pulse_answers, pulses
from mjchair.diagnosis.replay.simulator import WindowSimulator
from mjchair.diagnosis.replay.window_states import track
from mjchair.effects.effect import Effect, Parameter, SensorError
from mjchair.effects.library import find
from mjchair.errors import MjchairError
from mjchair.measurement.trial import Trial
from mjchair.model import inertials
from mjchair.report import diagnosis_page
from mjchair.simulation.initial import Initial, start
from mjchair.simulation.inputs import Inputs

TRUTH = {"coefficient": 0.002}
ONE_WAY = (Initial((0.0, 0.0), 0.3, 1.5), Initial((0.0, 0.5), 0.3, 1.2))
BY_NAME = {m.name: m for m in LIBRARY}


def measured(rng, name, start, seconds):
    """A run of a chair with more rolling resistance than its model has."""
    spec = mjchair.load_spec()
    find("rolling_resistance").apply(spec, TRUTH)
    return noisy_run(rng, spec, name, start, seconds)


def fitted(bench, found, name, free):
    effect = find(name)
    start = {**effect.neutral(), free[0]: 0.001}
    variant = Variant(bench.nuisances, {}, (Term(effect, start, free),))
    return refit(bench, variant, found, rounds=1)


@pytest.fixture(scope="module")
def one_way():
    """Coasts in one heading, and three explanations of them."""
    rng = np.random.default_rng(3)
    runs = [measured(rng, f"coast {k}", start, 4.0) for k, start in enumerate(ONE_WAY)]
    bench, found = diagnose.prepare(make_study(mjchair.load_spec(), runs, NOISE))
    rolling = fitted(bench, found, "rolling_resistance", ("coefficient",))
    slope = fitted(bench, found, "floor_slope", ("x", "y"))
    bearing = fitted(bench, found, "bearing_friction", ("coulomb",))
    return rng, runs, bench, (rolling, slope, bearing)


@pytest.fixture(scope="module")
def against_slope(one_way):
    _, _, bench, (rolling, slope, _) = one_way
    return design.plan(bench, rolling, [slope], doubts=())


def test_a_slope_is_told_from_rolling_by_another_heading(against_slope):
    assert against_slope.best.manoeuvre.name in ("coast reversed", "coast across", "stand")
    least = {e.manoeuvre.name: e.least for e in against_slope.experiments}
    assert least["coast"] < 0.1 * least["coast reversed"]
    assert against_slope.best.least > 9.0


def test_a_wind_is_told_from_drag_by_a_fast_coast_the_other_way(one_way):
    """A coast back from 1.8 m/s would have had to be repeated 19 times."""
    _, _, bench, (rolling, _, _) = one_way
    air = fitted(bench, rolling.track, "air_drag", ("drag_area",))
    term = Term(find("wind"), {"x": -0.5, "y": 0.0, "drag_area": 0.9}, ("x", "y"))
    wind = refit(bench, Variant(bench.nuisances, {}, (term,)), rolling.track, rounds=3)
    few = [BY_NAME["coast reversed"], BY_NAME["fast coast reversed"]]
    found = design.plan(bench, air, [wind], few, doubts=())
    least = {e.manoeuvre.name: e.least for e in found.experiments}
    assert least["fast coast reversed"] > 2.0 * least["coast reversed"]


@pytest.mark.parametrize(
    ("controls", "torque", "run"),
    [
        ({}, 0.0, "first"),
        ({"joystick_x": 1.0}, 0.0, "first"),  # shares are no N m
        ({"left_wheel": 6.0, "right_wheel": 12.0, "rider_lean": 40.0}, 12.0, "coast"),
        ({"chair/left_wheel": 6.0}, 6.0, "coast"),
    ],
)
def test_the_largest_torque_is_that_of_wheels(controls, torque, run):
    """A joystick at its end asked for runs "with up to 1 N m a wheel"."""
    time = np.arange(0.0, 3.0, 0.05)
    seen = {"left_wheel_speed": 3.0 - 0.1 * time, "right_wheel_speed": 3.0 - 0.1 * time}
    given = {name: np.full(time.size, size) for name, size in controls.items()}
    inputs = Inputs(time, given, "first") if given else None
    runs = [
        Run(Trial(name, time, seen, by, {}), "", False, Initial(), frozenset())
        for name, by in (("first", inputs), ("coast", None))
    ]
    here = setting(replace(make_study(mjchair.load_spec(), runs[1:]), runs=tuple(runs)))
    assert (here.torque, here.run) == (torque, run)


def test_two_sensors_together_are_worded_as_two():
    keys = "sensor_scale:left_wheel_speed+wheel_radius"
    words = "sensor scale of left_wheel_speed and wheel radius"
    assert wording.plain_together(keys) == words


def test_what_is_promised_is_what_the_experiment_gives(one_way, against_slope):
    rng, runs, bench, (rolling, slope, _) = one_way
    best = against_slope.best
    here = setting(bench.simulator.study)
    start = here.initial(best.manoeuvre)
    further = measured(rng, "new", start, best.manoeuvre.seconds)
    study = make_study(mjchair.load_spec(), [*runs, further], NOISE)
    simulator = WindowSimulator(study)
    again = replace(bench, simulator=simulator)
    totals = []
    for before in (rolling, slope):
        model = simulator.compile(before.variant.edit)
        found = track(simulator, model, bench.noise)
        totals.append(refit(again, before.variant, found, rounds=1).total)
    grown = (totals[1] - totals[0]) - (slope.total - rolling.total)
    t = best.least
    assert abs(grown - t) < 3.0 * 2.0 * math.sqrt(t) + 0.1 * t


def test_a_load_tells_rolling_from_bearings(one_way):
    _, _, bench, (rolling, _, bearing) = one_way
    found = design.plan(bench, rolling, [bearing])
    order = [e.manoeuvre.name for e in found.experiments]
    assert "loaded coast" in order[:3]
    assert order.index("loaded coast") < order.index("coast")
    assert found.chosen == ("rolling_resistance",) and found.rivals == ("bearing_friction",)


def test_without_rivals_a_force_of_any_course_is_the_rival(one_way):
    _, _, bench, (rolling, _, _) = one_way
    few = [BY_NAME["coast"], BY_NAME["free spin"]]
    found = design.plan(bench, rolling, [], few)
    along = next(i for i, name in enumerate(found.rivals) if "along the way" in name)
    t = {e.manoeuvre.name: e.separations for e in found.experiments}
    # a force along the way does in a coast what rolling resistance does, and cannot stop a spin
    assert t["coast"][along] < 0.05 * t["coast"][1 - along]
    assert t["free spin"][along] > 2.0 * t["coast"][along]
    assert "from a force along the way from outside" in wording.deciding(found, bench.simulator)


def test_what_must_be_large_is_not_the_simplest(one_way):
    _, _, bench, (rolling, slope, _) = one_way
    few = [BY_NAME["coast across"], BY_NAME["coast reversed"]]
    either = [replace(m, seconds=s) for m, s in zip(few, (4.0, 6.0), strict=True)]
    found = design.plan(bench, rolling, [slope], either, doubts=(), needed=[1e6])
    assert found.best.manoeuvre.name == "coast reversed"
    assert found.best.least == max(e.least for e in found.experiments)
    assert "repetitions" in wording.deciding(found, bench.simulator)
    simple = design.plan(bench, rolling, [slope], either, doubts=(), needed=[9.0])
    assert simple.best.least > ranking.PLENTY and simple.best.manoeuvre.name == "coast across"


def test_no_torque_and_no_load_is_asked_for_where_a_coast_decides(one_way):
    _, _, bench, (rolling, slope, _) = one_way
    few = [BY_NAME["loaded coast"], BY_NAME["coast reversed"], BY_NAME["coast"]]
    decided = design.plan(bench, rolling, [slope], few, doubts=())
    assert [e.manoeuvre.name for e in decided.experiments] == ["coast reversed", "coast"]
    assert decided.best.least > ranking.PLENTY
    open_still = design.plan(bench, rolling, [slope], few, doubts=(), needed=[1e6])
    assert {e.manoeuvre.name for e in open_still.experiments} == {m.name for m in few}
    both = {e.manoeuvre.name: e.separations for e in open_still.experiments}
    assert all(both[e.manoeuvre.name] == e.separations for e in decided.experiments)


def test_t_is_no_more_than_a_rival_differs_that_is_not_fitted_again(one_way, monkeypatch):
    """So it is enough to compare in full what may be first or second by it."""
    _, _, bench, (rolling, _, bearing) = one_way
    some = [m for m in LIBRARY if m.torque is None and not m.stands]
    few = design.plan(bench, rolling, [bearing], some)
    bound = ranking.at_most
    monkeypatch.setattr(ranking, "at_most", lambda *a: bound(*a) + 1e9)
    all_of_them = design.plan(bench, rolling, [bearing], some)
    assert not any(e.at_most for e in all_of_them.experiments)
    compared = [e for e in few.experiments if not e.at_most]
    assert ranking.TOGETHER <= len(compared) < len(some) == len(all_of_them.experiments)
    for one, other in zip(compared[:2], all_of_them.experiments[:2], strict=True):
        assert one.manoeuvre == other.manoeuvre
        assert one.separations == pytest.approx(other.separations, rel=1e-6)
    least = {e.manoeuvre.name: e.least for e in all_of_them.experiments}
    most = {e.manoeuvre.name: e.least for e in few.experiments if e.at_most}
    assert most and all(t >= least[name] > 0.0 for name, t in most.items())


def test_nothing_separates_a_chair_from_itself(one_way):
    _, _, bench, (rolling, _, _) = one_way
    few = [BY_NAME["coast reversed"], BY_NAME["loaded coast"]]
    found = design.plan(bench, rolling, [rolling], few)
    assert max(e.least for e in found.experiments) < 1e-3


def test_where_a_fit_ends_early_promises_nothing(one_way):
    """What a fit still promises itself was laid on a doubt beside it: 120 of chi2 for 0.6."""
    _, _, bench, (rolling, _, _) = one_way
    ((key, parameter),) = rolling.variant.terms[0].parameters
    aside = np.zeros_like(rolling.step)
    aside[rolling.system.places[key]] = 0.1 * rolling.std[key] / parameter.change
    early = replace(rolling, step=rolling.step + aside)
    few = [BY_NAME["coast reversed"], BY_NAME["loaded coast"]]
    found = design.plan(bench, rolling, [early], few, doubts=[find("bearing_friction")])
    assert max(e.least for e in found.experiments) < 0.1


def _too_thin(spec, size):
    """Make an inertia that no body has, where size is not 0."""
    if size:
        chair = inertials.explicit(spec, "chair")
        chair.inertia = [1.0, 1.0, 1.0 + 10.0 * size]


IMPOSSIBLE = Effect(
    name="impossible",
    parameters=(Parameter("size", "1", 1.0, 0.0, 2.0),),
    signature="none",
    source="a test",
    edit=_too_thin,
)


def test_a_candidate_that_cannot_be_is_dropped_and_noted(one_way):
    _, _, bench, (rolling, _, _) = one_way
    around = Around(
        bench=bench, track=rolling.track, variant=Variant(bench.nuisances), pulses=(), answers=()
    )
    tried = collect(around, [IMPOSSIBLE, find("sensor_bias", "heading")], lambda key: None)
    assert {s.effect.name for s in tried.starts} == {"sensor_bias"}
    assert len(tried.columns) == 1
    (line,) = tried.dropped
    assert line.startswith("impossible was not tried: ") and "inertia" in line


def test_a_rival_that_cannot_be_is_left_out_of_the_plan_and_noted(one_way):
    _, _, bench, (rolling, slope, _) = one_way
    broken = Variant(bench.nuisances, {}, (Term(IMPOSSIBLE, {"size": 1.0}, ()),))
    rivals = [replace(slope, variant=broken), slope]
    few = [BY_NAME["coast reversed"]]
    doubt = replace(IMPOSSIBLE, name="doubted")
    planned = design.plan(bench, rolling, rivals, few, doubts=[doubt])
    assert planned.rivals == ("floor_slope",)
    assert [line.split(" was ")[0] for line in planned.dropped] == ["doubted", "impossible"]
    with pytest.raises(MjchairError, match="no experiment can be planned"):
        design.plan(bench, rolling, rivals[:1], few, doubts=())


def test_a_fit_that_begins_where_no_chair_is_raises_one_line(one_way):
    _, _, bench, (rolling, _, _) = one_way
    broken = Variant(bench.nuisances, {}, (Term(IMPOSSIBLE, {"size": 1.0}, ("size",)),))
    with pytest.raises(MjchairError, match="no body can have") as error:
        refit(bench, broken, rolling.track, rounds=1)
    assert "\n" not in str(error.value)


def test_longer_runs_and_less_noise_separate_more(one_way):
    _, _, bench, (rolling, slope, _) = one_way
    lengths = [replace(BY_NAME["coast reversed"], seconds=s) for s in (2.0, 4.0, 6.0)]

    def separations(bench):
        found = design.plan(bench, rolling, [slope], lengths).experiments
        return [e.least for e in sorted(found, key=lambda e: e.manoeuvre.seconds)]

    loud = separations(bench)
    assert loud[0] < loud[1] < loud[2]
    finer = {c: replace(n, white=0.5 * n.white, slow=0.5 * n.slow) for c, n in bench.noise.items()}
    for quiet, before in zip(separations(replace(bench, noise=finer)), loud, strict=True):
        assert before < quiet <= 4.0 * before * (1.0 + 1e-9)


def test_a_rehearsed_spin_ends_like_one_of_smaller_steps(one_way):
    bench = one_way[2]
    spin, here = BY_NAME["free spin"], setting(bench.simulator.study)
    heavier = Term(find("payload"), {"mass": 43.0, "height": 1.2}, ())
    variant = Variant(bench.nuisances, {}, (heavier,))
    chair = Version(variant)
    made = Rehearsal(bench, here, [spin], chair)
    casters = made.simulator.chair.swivel_q
    model = made.simulator.compile(variant.edit)
    model.opt.timestep = 0.001
    with mjchair.installed():
        data = start(model, here.initial(spin))
        for _ in range(6000):
            mujoco.mj_step(model, data)
    (trace,) = (o.trace for o in made._open_loop(chair, made.first))
    assert trace["qpos"][-1][casters] == pytest.approx(data.qpos[casters], abs=0.03)


def test_a_rehearsal_counts_the_turns_of_a_heading_over_its_windows(one_way):
    bench = one_way[2]
    turn = replace(BY_NAME["coast in a left turn"], turned=2.6)  # from 2.9 rad on, over pi
    made = Rehearsal(bench, setting(bench.simulator.study), [turn], Version(Variant(())))
    heading = list(made.simulator.channels).index("heading")
    ends = [predicted[[0, -1], heading] for predicted in made.track.predicted]
    assert len(ends) > 2 and ends[0][0] < np.pi < ends[-1][1]
    for (_, before), (after, _) in pairwise(ends):
        assert after == pytest.approx(before, abs=0.2)


def test_what_a_chair_does_as_it_comes_to_rest_promises_nothing(one_way):
    """A diagnosis leaves it out: a slow coast promised 25 sigmas there, and brought none."""
    _, _, bench, (rolling, slope, _) = one_way
    here, stopping = setting(bench.simulator.study), replace(BY_NAME["slow coast"], speed=0.25)
    made = Rehearsal(bench, here, [stopping], Version(rolling.variant))
    speed = made.whole(made.chair, 0)[:, list(made.simulator.channels).index("left_wheel_speed")]
    time, used = made.simulator.study.runs[0].trial.time, made.used(0)
    rests = float(time[np.argmax(np.abs(speed) < 0.05)])
    assert 1.0 < rests < stopping.seconds - 0.5
    assert used[(time > 0.3) & (time < rests - 0.3)].all()
    assert not used[(time > rests) & (time < rests + 1.0)].any()
    (seen,) = design.plan(bench, rolling, [slope], [stopping], doubts=()).evidence
    assert used[np.argmin(np.abs(time - seen.time))]


def test_a_chair_that_is_shaken_promises_less(one_way, against_slope):
    _, _, bench, (rolling, slope, _) = one_way
    asked = pulses(bench.simulator)
    answers = pulse_answers(bench.simulator, rolling.track, asked)
    shaken = replace(bench, process=process.first(bench.simulator, rolling.track, asked, answers))
    few = [BY_NAME["coast reversed"]]
    found = design.plan(shaken, rolling, [slope], few, doubts=())
    quiet = next(e for e in against_slope.experiments if e.manoeuvre.name == few[0].name)
    assert 0.5 < found.best.least < 0.5 * quiet.least


def test_a_lab_without_torque_gets_none():
    assert all(m.torque is None for m in possible(Setting((0.0, 0.0), 0.0, 0.0)))
    assert len(possible(Setting((0.0, 0.0), 0.0, 10.0))) == len(LIBRARY)


@pytest.mark.parametrize("sensor", [None, SensorError.BIAS])
def test_standing_still_tells_of_sensors_only(sensor):
    """How a model settles drew a rolling resistance to a bearing's friction."""
    asked = SimpleNamespace(effect=SimpleNamespace(sensor=sensor))
    rolls = SimpleNamespace(effect=SimpleNamespace(sensor=None))
    chairs = [Variant((), terms=(rolls,)), Variant((), terms=(rolls, asked))]
    told = [m.name for m in telling(LIBRARY, chairs)]
    left_out = {m.name for m in LIBRARY} - set(told)
    assert left_out == (set() if sensor else {"stand"})


def test_hands_are_not_asked_to_hold_a_torque_for_seconds():
    by_hand = {m.name for m in possible(Setting((0.0, 0.0), 0.0, 10.0, by_hand=True))}
    held = {"long steps", "circle", "driven spin", "reverse, then forward"}
    assert set(BY_NAME) - by_hand == held


def test_with_one_wheel_measured_nothing_that_turns_is_asked_for():
    """The other wheel is taken to roll alike, which a spin on the spot does not."""
    asked = {m.name for m in possible(Setting((0.0, 0.0), 0.0, 10.0, straight=True))}
    assert asked == {
        "stand", "coast", "coast reversed", "coast across", "fast coast", "fast coast reversed",
        "slow coast", "coast backwards", "coast a metre aside", "pushes", "short steps",
        "long steps", "loaded coast",
    }  # fmt: skip
    assert len({m.name for m in LIBRARY}) == len(LIBRARY)


@pytest.mark.parametrize("manoeuvre", LIBRARY, ids=lambda m: m.name)
def test_the_words_of_a_manoeuvre_hold_its_numbers(manoeuvre):
    words = manoeuvre.words
    assert not manoeuvre.speed or f"{abs(manoeuvre.speed):g} m/s" in words
    assert ("backwards" in words) == (manoeuvre.speed < 0.0)
    if manoeuvre.yaw_rate:
        assert f"{abs(manoeuvre.yaw_rate):g} rad/s" in words
        assert "to the left" in words if manoeuvre.yaw_rate > 0.0 else "to the right" in words
    if manoeuvre.turned:
        assert f"{math.degrees(manoeuvre.turned):.0f} degrees" in words
    assert all(f"{m:g} m " in f"{words} " for m in manoeuvre.shift if m)
    if manoeuvre.load is not None:
        assert f"{manoeuvre.load.mass:g} kg" in words and f"{manoeuvre.load.height:g} m" in words


def plan_of(*least):
    ordered = tuple(Experiment(m, (t,)) for m, t in zip(LIBRARY, least, strict=False))
    evidence = Evidence("left_wheel_speed", 5.7, 3.0, 2.8, 9.0)
    names = ("rolling_resistance",), ("sensor_bias:imu_gyro.z",)
    return Plan(*names, ordered, (evidence,), run="coast_1")


def test_the_words_say_what_to_do_and_what_to_see(one_way):
    simulator = one_way[2].simulator
    said = wording.deciding(plan_of(25.0, 1.0), simulator)
    assert LIBRARY[0].words in said and "about 5 sigmas" in said
    assert "Start where coast_1 starts, with its heading." in said and "torque" not in said
    assert "0.2 rad/s lower if it is sensor bias of imu_gyro.z" in said
    assert " Or " not in said and "repeat" not in said
    assert " Or " in wording.deciding(plan_of(25.0, 24.0), simulator)
    best, other = plan_of(25.0, 24.0).experiments
    bound = replace(plan_of(25.0), experiments=(best, replace(other, at_most=True)))
    assert " Or " not in wording.deciding(bound, simulator)
    table = diagnosis_page._experiments(SimpleNamespace(evidence=SimpleNamespace(plan=bound)))
    assert [row.cells[1] for row in table.rows] == ["5.0", "at most 4.9"]
    assert "repeat it 3 times" in wording.deciding(plan_of(3.5), simulator)
    assert "No manoeuvre of the library decides" in wording.deciding(plan_of(0.0), simulator)
    few = (BY_NAME["loaded slalom"], BY_NAME["coast reversed"])
    loaded, aside = (replace(plan_of(25.0), experiments=(Experiment(m, (25.0,)),)) for m in few)
    said = wording.deciding(replace(loaded, torque=9.0), simulator)
    assert "with up to 9 N m a wheel; record 6 s and the torque of each" in said
    assert "[trial.load] with mass = 15 and height = 0.55" in said
    assert "but for what is said here" in wording.deciding(aside, simulator)


@pytest.mark.parametrize(
    ("tied", "word"),
    [
        (Driver(Quantity.LEFT_TURN), "left wheel"),
        (Driver(Quantity.TIME, "coast_0"), "exactly"),
        (Driver(Quantity.HEADING), "180"),
    ],
)
def test_an_unknown_force_is_looked_for_where_it_goes(tied, word):
    assert word in wording.searching([(tied, 9.0)])
    assert wording.searching([]) == wording.OTHERWISE


def test_a_run_in_which_somebody_may_have_pushed_is_left_out_first():
    drivers = [(Driver(Quantity.TIME, "coast"), 9.0), (Driver(Quantity.HEADING), 5.0)]
    assert "without coast" in wording.searching(drivers, {"coast"})
    assert "without coast" not in wording.searching(drivers, {"push"})
    assert "without coast" not in wording.searching(drivers[1:], {"coast"})


def test_a_number_on_its_wall_is_to_be_measured_beside_the_next_run():
    """Torques 15 % too small stood for a load of 20 kg, of which the next run told nothing."""
    known = tuple(n for n in MECHANICAL if n.name in ("mass", "inertia"))
    fitted = SimpleNamespace(variant=Variant(known, {"mass": 3.0, "inertia": -2.9}))
    (said,) = decide._to_measure(fitted)
    assert "mass" in said and "3.0 sigmas" in said and "2.9" not in said
    assert decide._to_measure(SimpleNamespace(variant=Variant(known, {"mass": 2.9}))) == []


def test_what_was_moved_far_is_to_be_measured():
    """A scrub of 2 N m in one turn passes for a centre of mass 27 mm further forward."""
    known = {n.name: n for n in MECHANICAL}
    said = wording.measuring([(known["centre_x"], 2.7), (known["inertia"], -2.5)])
    assert "weigh the casters): +0.027 m, 2.7 sigmas" in said
    assert "-25 %, 2.5 sigmas" in said
    assert wording.measuring([]) == ""
    gain = Nuisance("scale:imu_gyro.z", 0.01, "1", channel="imu_gyro.z", error=SensorError.SCALE)
    assert "the gain of imu_gyro.z: +5 %, 4.9 sigmas" in wording.measuring([(gain, 4.9)])
