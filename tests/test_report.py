"""The report of a diagnosis: what it says, that it escapes, and that every figure can be read."""

from __future__ import annotations

import dataclasses
import re
from types import SimpleNamespace

import numpy as np
import pytest
from figure_layout import assert_legible

from mjchair.diagnosis import notes
from mjchair.diagnosis.data.roughly_known import Nuisance
from mjchair.diagnosis.evidence import _edges
from mjchair.diagnosis.explain.column_ids import Driver, Quantity
from mjchair.diagnosis.explain.missing_force import Products, mean_forces
from mjchair.diagnosis.fit.column_ids import ParameterId
from mjchair.diagnosis.fit.variant import Term, Variant
from mjchair.diagnosis.next_experiment import wording
from mjchair.diagnosis.replay.pulses import Force, Pulse
from mjchair.diagnosis.result import (
    Candidate,
    Diagnosis,
    Disagreement,
    Estimate,
    Evidence,
    ForceLevels,
    ForceSamples,
    GapSummary,
    Material,
    MissingForce,
    Moment,
    Moved,
    NamedEffect,
    Nearest,
    OneRun,
    Shaken,
    TrialGap,
    WholeRun,
    WindowGaps,
)
from mjchair.diagnosis.rules import Verdict
from mjchair.effects.effect import SensorError
from mjchair.effects.library import find
from mjchair.report.diagnosis_figures import (
    candidates,
    gap,
    missing_force,
    probability,
    summary,
    where,
    whole_runs,
)
from mjchair.report.diagnosis_page import figures, page
from mjchair.report.diagnosis_words import explanations, first_screen, sections

ROLLING = NamedEffect(
    name="rolling_resistance",
    parameters={"coefficient": Estimate(value=0.0146, std=0.0004, unit="1")},
    closure=0.97,
)
BIAS = NamedEffect(
    name="sensor_bias",
    parameters={"bias": Estimate(value=0.1, std=None, unit="<m/s>")},
    closure=0.9,
    channel="imu_gyro.z",
)
SHOWN = (Quantity.SPEED, Quantity.YAW_RATE, Quantity.HEADING, Quantity.TORQUE)
CHANNELS = (
    "left_wheel_speed",
    "right_wheel_speed",
    "left_wheel_angle",
    "right_wheel_angle",
    "imu_gyro.x",
    "imu_gyro.y",
    "imu_gyro.z",
    "imu_accelerometer.x",
    "imu_accelerometer.y",
    "imu_accelerometer.z",
    "position.x",
    "position.y",
)


def evidence(trials=3, windows=5, channels=12, largest=250.0, name="trial", corrected=True, seed=0):
    """Something to draw, of any size."""
    random = np.random.default_rng(seed)
    names = CHANNELS[:channels]
    count = trials * windows
    starts = np.tile(2.0 * np.arange(windows), trials)
    before = np.exp(random.uniform(np.log(0.8), np.log(largest), (channels, count)))
    trial_gaps = tuple(
        TrialGap(
            trial=f"{name}_{k}",
            held_out=k == 0,
            before=float(np.sqrt((before[:, k * windows : (k + 1) * windows] ** 2).mean())),
            after=1.1 if corrected else None,
        )
        for k in range(trials)
    )
    time = np.linspace(0.0, 2.0 * windows, 60 * windows)
    measured = np.column_stack(
        [
            time * (20.0 if "position" in c else 1.0) + 0.01 * random.normal(size=time.size)
            for c in names
        ]
    )
    drift = 0.05 * time[:, None] * np.ones(channels)
    run = WholeRun(
        trial=f"{name}_0",
        held_out=True,
        time=time,
        channels=names,
        units=("rad/s",) * channels,
        noise=np.full(channels, 0.01),
        measured=measured,
        before=measured + drift,
        after=measured + 0.1 * drift if corrected else None,
    )
    levels = ForceLevels(
        middle=np.linspace(-1.0, 1.0, 8), value=random.normal(size=8), std=np.full(8, 0.3)
    )
    force = {
        kind: ForceSamples(
            unit=unit,
            trials=np.zeros(3, np.int64),
            time=np.arange(3.0),
            value=np.ones(3),
            std=np.ones(3),
            against={},
            levels=dict.fromkeys(SHOWN, levels),
        )
        for kind, unit in ((Force.FORWARD, "N"), (Force.YAW, "N m"))
    }
    return Evidence(
        windows=WindowGaps(
            channels=names,
            trials=np.repeat(np.arange(trials), windows),
            times=np.column_stack([starts, starts + 2.0]),
            before=before,
            after=np.ones_like(before) if corrected else None,
            highest=2.0,
        ),
        trials=trial_gaps,
        forces=force,
        runs=(run,),
        moved=(Moved(name="mass", std=0.05, unit="1", by=0.4),),
    )


def diagnosis(verdict=Verdict.NAMED, **options):
    """A whole diagnosis that nobody made."""
    named = verdict in (Verdict.NAMED, Verdict.AMBIGUOUS)
    many = [
        Candidate(
            name=f"effect_{k}",
            held_out_gain=1e6 / (k + 1) - 3e5,
            closure=0.9 / (k + 1),
            detectability=1300.0 / (k + 1),
            p_value=0.0,
            collinear=0.5,
            channel="imu_accelerometer.x" if k == 3 else None,
        )
        for k in range(20)
    ]
    return Diagnosis(
        verdict=verdict,
        effects=[ROLLING] if named else [],
        alternatives=[["rolling_resistance", "toe"]] if verdict == Verdict.AMBIGUOUS else [],
        candidates=many,
        gap=GapSummary(
            before=58.96,
            after=1.1 if named else 9.4,
            scope="held-out trials: rms of the whitened residual below 2 Hz",
            p_value=0.0 if verdict != Verdict.NONE else 0.4,
            p_value_after=0.3,
        ),
        where=[
            Disagreement(
                trial="trial_0",
                channel="left_wheel_speed",
                window=(0.0, 2.0),
                regime={"speed": "0.5-1.0 m/s"},
                statistic=250.0**2,
            )
        ],
        next_experiment="Push the chair again. Then coast." if verdict != Verdict.NAMED else "",
        notes=["No run is held out (`hold_out = true`)", "No run is held out (`hold_out = true`)"],
        drivers=[MissingForce(force=Force.FORWARD, goes_with=Driver(Quantity.STROKE), sigmas=40.0)],
        nearest=Nearest(effects=("wind", "toe"), closure=0.94, remainder=9.4)
        if verdict == Verdict.UNKNOWN
        else None,
        evidence=evidence(corrected=named, **options),
    )


def test_no_share_of_a_gap_is_shown_where_there_is_none():
    found = diagnosis(Verdict.NONE)
    without = [dataclasses.replace(c, closure=0.0) for c in found.candidates]
    none = dataclasses.replace(found, candidates=without)
    assert ">closes<" in page(diagnosis(Verdict.UNKNOWN), {})
    assert ">closes<" not in page(none, {}) and "|cos|" not in page(none, {})
    assert ">|cos|<" in page(diagnosis(), {})
    assert "closes" not in str(candidates.figure(none).axes[-1].get_xlabel())


def test_it_is_said_why_what_fits_is_not_named():
    open_sets = dataclasses.replace(diagnosis(Verdict.AMBIGUOUS), alternatives=[["toe", "wind"]])
    assert sections.choice_words(open_sets).endswith("Another of its set fits about as well.")
    (effect, *_) = open_sets.effects
    rare = dataclasses.replace(
        open_sets, alternatives=[], effects=[effect], probability={effect.key: 0.21}
    )
    assert sections.choice_words(rare).endswith("Its probability is 21 %, below 95 %.")
    left = dataclasses.replace(rare, probability={effect.key: 0.97})
    assert "not enough to name it" in sections.choice_words(left)


def test_noise_that_is_larger_than_the_study_says_is_told(monkeypatch):
    of = {"a": 0.0046, "b": 0.004, "c": 0.2}
    noise = {c: SimpleNamespace(total=v, source="study.toml") for c, v in of.items()}
    given = {"a": 0.0005, "b": 0.0041}
    study = SimpleNamespace(notes=[], unplaced=(), copied=(), noise_given=given.get)
    bench = SimpleNamespace(
        simulator=SimpleNamespace(study=study), noise=noise, tipped={}, process=None
    )
    gains = [
        Nuisance(f"scale:{c}", 0.01, "1", None, c, SensorError.SCALE) for c in ("fine", "faulty")
    ]
    plain = SimpleNamespace(moved=list(zip(gains, (1.0, -2.8), strict=True)))
    base = SimpleNamespace(bench=bench, dropped=[], plain=plain)
    said = notes.notes_on(base, None, None, None, said=Verdict.NONE, left=[], alone=None)
    assert [line.split(":")[0] for line in said[:2]] == ["noise of a", "noise of c"]
    assert "0.0046 (SI) is left by the best fit, and not the 0.0005" in said[0]
    assert said[2].startswith("faulty shows 2.8 % too little by these runs")
    assert len(said) == 3
    # a brake in one run had both encoders 4 % wrong: what is missing moves gains as well
    monkeypatch.setattr(notes, "of_one_run", lambda *_: "b differs from the other runs")
    said = notes.notes_on(base, None, None, None, said=Verdict.UNKNOWN, left=[], alone="b")
    assert not any("by these runs" in line for line in said)


def test_what_acts_in_one_run_alone_is_said_with_the_run_and_the_sizes():
    rubs = Estimate(value=0.58, std=0.04, unit="N m")
    brake = NamedEffect(name="bearing_friction", parameters={"left": rubs}, closure=1.0)
    one = OneRun(trial="coast_2", effects=(brake,), gain=189.0, others=184.0)
    found = dataclasses.replace(diagnosis(Verdict.UNKNOWN), one_run=one)
    said = first_screen.missing(found)
    assert said.startswith("coast_2 differs from the other runs")  # a name keeps its letters
    assert "left 0.580 ± 0.040 N m" in said and said.endswith("so nothing is named.")
    assert "coast_2" in sections.choice_words(found) and "nearest" not in sections.choice_words(
        found
    )
    html = page(found, {})
    assert html.count("coast_2 differs from the other runs: <b>bearing friction</b>") == 2


def test_what_the_corrected_chair_has_besides_is_to_be_measured_first():
    found = diagnosis()
    assert (
        first_screen.next_step(found) == "These data decide; use the corrected chair (model.xml)."
    )
    heavier = (Moved(name="mass", std=0.3, unit="1", by=1.27),)
    much = dataclasses.replace(
        found, evidence=dataclasses.replace(found.evidence, moved=heavier), next_experiment=""
    )
    assert "the mass of chair and person together by +38 % besides" in first_screen.next_step(much)


@pytest.mark.parametrize("verdict", [Verdict.NAMED, Verdict.AMBIGUOUS, Verdict.NONE])
def test_what_the_data_ask_is_to_be_answered_first(verdict):
    """A mass of 180 "kg", which was in lb, came as torques that show 93 % too little: use it."""
    found = diagnosis(verdict)
    plain = first_screen.next_step(found)
    asked = "push_1: its torques go with a mass of 90 kg: are the masses in lb?"
    doubtful = dataclasses.replace(found, notes=[asked, *found.notes, asked])
    assert first_screen.next_step(doubtful) == f"Answer first: {asked} {plain}"


def test_one_run_is_not_called_several():
    found = diagnosis()
    one = dataclasses.replace(found.evidence, trials=found.evidence.trials[1:2])
    alone = dataclasses.replace(found, evidence=one)
    assert "parts of the run that it was not fitted to" in sections.choice_words(alone)
    assert "holds on runs that it was not fitted to" in sections.choice_words(found)


def test_a_named_effect_comes_with_value_and_uncertainty():
    said = first_screen.missing(Diagnosis(verdict=Verdict.NAMED, effects=[ROLLING]))
    assert (
        said
        == "The model of the chair lacks **rolling resistance** (coefficient 0.01460 ± 0.00040)."
    )


def test_what_a_correction_leaves_is_told_apart_from_what_is_only_roughly_known():
    def said(after, unforeseen):
        gap = GapSummary(before=9.0, after=after, scope="held-out trials", p_value=0.0,
                         p_value_after=0.3, unforeseen=unforeseen)  # fmt: skip
        found = Diagnosis(verdict=Verdict.NAMED, effects=[ROLLING], gap=gap)
        return first_screen.unforeseen_words(found)

    assert "Of the 2.7 times the noise" in said(2.7, 1.1) and "all but 1.1" in said(2.7, 1.1)
    assert said(2.7, 2.6) == said(1.2, 0.9) == said(2.7, None) == ""


@pytest.mark.parametrize(
    ("name", "parameter", "value", "unit", "said"),
    [
        ("sensor_scale", "scale", 0.0025, "1", "shows 0.25 % too much (**sensor scale**: scale"),
        ("sensor_bias", "bias", -0.02, "rad", "shows 0.02 rad too little (**sensor bias**: bias"),
        ("sensor_delay", "delay", 0.03, "s", "comes 0.03 s late (**sensor delay**: delay"),
        ("sensor_delay", "delay", -0.03, "s", "comes 0.03 s early (**sensor delay**: delay"),
    ],
)
def test_a_sensor_at_fault_is_no_lack_of_the_chair(name, parameter, value, unit, said):
    fault = NamedEffect(
        name=name,
        parameters={parameter: Estimate(value=value, std=0.1 * abs(value), unit=unit)},
        closure=1.0,
        channel="heading",
    )
    alone = Diagnosis(verdict=Verdict.NAMED, effects=[fault])
    assert first_screen.missing(alone).startswith(f"The sensor of heading {said}")
    assert first_screen.next_step(alone).endswith("the chair lacks nothing.")
    left = dataclasses.replace(alone, more_missing=True)
    assert first_screen.next_step(left).endswith("correct what the sensor shows.")
    late = NamedEffect(
        name="torque_delay",
        parameters={},
        closure=1.0,
        remark="the torques came late",
        recording=True,
    )
    alone = Diagnosis(verdict=Verdict.NAMED, effects=[late])
    assert first_screen.missing(alone) == "The torques came late (**torque delay**)."
    assert first_screen.next_step(alone).endswith(
        "correct what was recorded; the chair lacks nothing."
    )
    both = Diagnosis(verdict=Verdict.NAMED, effects=[fault, ROLLING])
    assert "The model of the chair lacks **rolling resistance** (" in first_screen.missing(both)
    assert f"), and the sensor of heading {said}" in first_screen.missing(both)
    assert "model.xml" in first_screen.next_step(both)


def test_what_is_named_beside_more_that_is_missing_is_no_last_word():
    found = Diagnosis(
        verdict=Verdict.NAMED,
        effects=[ROLLING],
        gap=GapSummary(before=3.0, after=0.9, scope="", p_value=0.0, p_value_after=0.5),
        more_missing=True,
    )
    assert "look for what is left" in first_screen.next_step(found)
    assert "of the gap. The model of the chair lacks" in first_screen.missing(found)
    found.gap = dataclasses.replace(found.gap, scope="held-out trials")
    falls = "of the gap in the runs of the fit; in those held out it falls from 3.00 to 0.90 times"
    assert falls in first_screen.missing(found)
    found.gap = dataclasses.replace(found.gap, after=2.95)
    assert "of the fit; those held out stay at 3.0 times the" in first_screen.missing(found)
    found.gap = dataclasses.replace(found.gap, after=3.2)
    assert "in those held out it grows from 3.00 to 3.20 times" in first_screen.missing(found)
    found.gap = dataclasses.replace(found.gap, scope="", after=0.9)
    found.correction = Variant((), {"mass": -3.0, "centre_x": 2.0})
    said = "only with a chair at the end of what the study allows (the mass of chair and person "
    assert f"{said}together). The model" in first_screen.missing(found)


def test_a_steady_force_that_may_hide_is_said_before_a_name():
    """Some 3.5 N were missing of a rolling chair, which was shaken as much as is believed."""
    found = Diagnosis(
        verdict=Verdict.NAMED,
        effects=[ROLLING],
        process={"drive": Estimate(value=4.42, std=None, unit="N")},
        probability={"rolling_resistance": 0.97, "rolling_resistance+toe": 0.03},
    )
    assert "97 % with nothing more" in first_screen.sure(found)
    assert "look for what is left" not in first_screen.next_step(found)
    found.loud = ("drive",)
    said = "More may be missing than what is named here. What shakes the chair stands at 4.4 N, "
    assert first_screen.missing(found).startswith(said)
    assert "nothing more" not in first_screen.sure(found)
    assert "look for what is left" in first_screen.next_step(found)
    found.more_missing = True
    assert first_screen.missing(found).startswith("More is missing than what is named here, which")
    assert found.to_dict()["loud"] == ["drive"]


def test_what_is_left_goes_with_words_and_no_name_of_the_code():
    found = Diagnosis(verdict=Verdict.NAMED, effects=[ROLLING], more_missing=True)
    yaw = Driver(Quantity.YAW_RATE)
    found.drivers = [MissingForce(force=Force.YAW, goes_with=yaw, sigmas=9.0)]
    assert "What is left goes with yaw rate. " in first_screen.missing(found)


def test_what_tests_say_of_what_is_left_agrees_with_what_is_named_of_it():
    gap = GapSummary(before=3.0, after=0.9, scope="", p_value=0.0, p_value_after=0.002)
    found = Diagnosis(verdict=Verdict.NAMED, effects=[ROLLING], gap=gap)
    assert sections.left_words(found).endswith("no single test stands out far enough to tell what.")
    found.gap = dataclasses.replace(gap, shows_after=True)
    assert sections.left_words(found).endswith("something is left.")
    found.gap = dataclasses.replace(gap, p_value_after=0.3)
    assert sections.left_words(found).endswith("so it is noise.")


def test_how_probable_a_lone_effect_is_stands_in_the_first_sentence():
    found = Diagnosis(
        verdict=Verdict.AMBIGUOUS,
        effects=[ROLLING],
        probability={"rolling_resistance": 0.8, "rolling_resistance+toe": 0.07, "none": 0.13},
    )
    said = first_screen.missing(found)
    assert said.startswith("Probably (87 %), the model of the chair lacks **rolling resistance** (")
    assert said.endswith("; these runs are not enough to name it.")
    found.probability = {"rolling_resistance": 0.4, "outside": 0.6}
    assert "the evidence is thin" in first_screen.missing(found)


def test_the_page_says_the_verdict_and_what_its_sizes_are():
    for verdict, sizes in ((Verdict.NAMED, True), (Verdict.UNKNOWN, False)):
        html = page(diagnosis(verdict), {})
        assert f"Verdict: {verdict}." in html
        assert ("± is one standard error" in html) == sizes


def test_rivals_are_in_the_first_sentence():
    sets = [["floor_slope", "rolling_resistance"]]
    said = first_screen.missing(
        Diagnosis(verdict=Verdict.AMBIGUOUS, effects=[ROLLING], alternatives=sets)
    )
    assert said == (
        "It is **floor slope** or **rolling resistance**, and these runs cannot tell "
        "which. The corrected chair has **rolling resistance** (coefficient 0.01460 ± 0.00040)."
    )


def test_a_rival_beside_a_clear_favourite_is_said_not_to_be_ruled_out():
    """ "These runs cannot tell which", of 98 and 1 %, contradicted itself."""
    sets = [["rolling_resistance", "toe"]]
    found = Diagnosis(verdict=Verdict.AMBIGUOUS, effects=[ROLLING], alternatives=sets)
    found.probability = {"rolling_resistance": 0.98, "toe": 0.01}
    assert first_screen.missing(found).startswith(
        "It is probably **rolling resistance** (98 %), but these runs do not rule out **toe**. The"
    )
    found.probability = {"rolling_resistance": 0.8, "toe": 0.2}
    assert "cannot tell which" in first_screen.missing(found)


def test_a_correction_that_is_less_probable_than_a_rival_says_why():
    sets = [["rolling_resistance", "toe"]]
    found = Diagnosis(verdict=Verdict.AMBIGUOUS, effects=[ROLLING], alternatives=sets)
    found.probability = {"toe": 0.41, "rolling_resistance": 0.16, "rolling_resistance+wind": 0.02}
    said = first_screen.missing(found)
    assert said.endswith("), with which it fits best, though toe is more probable.")
    assert "Toe is more probable (41 % against 18 %) though it" in sections.choice_words(found)
    found.probability["sensor_bias:heading+wind"] = 0.5
    said = first_screen.missing(found)
    assert said.endswith(", though sensor bias of heading and wind are more probable.")
    del found.probability["sensor_bias:heading+wind"]
    found.probability = {"rolling_resistance": 0.41, "toe": 0.18, "outside": 0.1}
    assert "more probable" not in first_screen.missing(found)
    found.probability = {"outside": 0.41, "rolling_resistance": 0.18}
    assert "more probable" not in first_screen.missing(found)


def test_alternatives_that_go_together_are_said_to():
    sets = [["rolling_resistance", "toe+air_drag", "none"]]
    found = Diagnosis(verdict=Verdict.AMBIGUOUS, effects=[ROLLING], alternatives=sets)
    said = first_screen.missing(found)
    assert "is **rolling resistance**, **toe** with **air drag** or nothing, and these" in said
    assert (
        explanations.settled(dataclasses.replace(found, probability={"rolling_resistance": 1.0}))
        == []
    )


def test_several_effects_that_have_rivals_are_each_told_from_theirs():
    """The first sentence was a chain of effects that nobody could take apart."""
    found = Diagnosis(
        verdict=Verdict.AMBIGUOUS,
        effects=[ROLLING, BIAS],
        alternatives=[
            ["rolling_resistance+sensor_bias", "wind"],
            ["rolling_resistance", "toe"],
            ["sensor_bias", "none"],
            ["rolling_resistance", "toe", "event"],
        ],
    )
    chair, cannot = first_screen.missing(found).split(". But these runs cannot tell ")
    assert (
        chair.startswith("The corrected chair has **rolling resistance** (")
        and BIAS.channel in chair
    )
    assert cannot == (
        "**rolling resistance** from **toe** or something that happened once; nor **sensor bias** "
        "from nothing; nor **rolling resistance** with **sensor bias** from **wind**."
    )
    assert sections.alike_words(found) == f"These data cannot tell {cannot}"


def test_what_is_in_every_explanation_is_said_before_what_is_open():
    rivals = ["rolling_resistance", "toe"]
    found = Diagnosis(
        verdict=Verdict.AMBIGUOUS,
        effects=[ROLLING, BIAS],
        alternatives=[rivals],
        probability={f"{name}+{BIAS.key}": 0.48 for name in rivals} | {"outside": 0.04},
    )
    assert explanations.settled(found) == [BIAS]
    said = first_screen.missing(found)
    assert said.startswith("The sensor of imu_gyro.z shows 0.1")
    assert ". Besides, it is **rolling resistance** or **toe**, and these" in said
    assert said.endswith(
        "The corrected chair has **rolling resistance** (coefficient 0.01460 ± 0.00040)."
    )
    thin = dataclasses.replace(found, effects=[BIAS], alternatives=[])
    assert first_screen.missing(thin).startswith(
        "Probably (96 %), the sensor of imu_gyro.z shows 0.1"
    )
    likely = {f"{name}+{BIAS.key}": 0.47 for name in rivals} | {"outside": 0.06}
    said = first_screen.missing(dataclasses.replace(found, probability=likely))
    assert said.startswith("Probably (94 %), the sensor of imu_gyro.z") and "Besides" in said
    doubted = dataclasses.replace(found, probability={"outside": 0.6, f"toe+{BIAS.key}": 0.4})
    assert explanations.settled(doubted) == []


@pytest.mark.parametrize("verdict", [Verdict.NONE, Verdict.UNKNOWN])
def test_no_name_where_none_is_named(verdict):
    assert "resistance" not in first_screen.missing(Diagnosis(verdict=verdict))


@pytest.mark.parametrize("verdict", list(Verdict))
def test_a_picture_of_missing_force_says_where_nothing_is_missing(verdict):
    """Curves of force under the verdict that nothing is missing were not explained."""
    said = missing_force.caption(diagnosis(verdict))
    assert ("Nothing is missing that matters" in said) == (verdict == Verdict.NONE)


def test_words_from_outside_are_escaped():
    html = page(Diagnosis(verdict=Verdict.NAMED, effects=[BIAS]), {}, "<i>title</i> & more")
    assert "&lt;m/s&gt;" in html and "sensor of imu_gyro.z shows" in html
    assert "<m/s>" not in html and "<i>" not in html
    assert "&lt;i&gt;title&lt;/i&gt; &amp; more" in html


@pytest.mark.parametrize("verdict", list(Verdict))
def test_the_first_screen_says_three_things_and_folds_the_rest(verdict):
    html = page(diagnosis(verdict), {})
    first, _, rest = html.partition("<details>")
    assert [re.sub("<.*?>", "", x) for x in re.findall("<dt>.*?</dt>", first)] == [
        "What is missing",
        "How sure",
        "What to do next",
    ]
    assert all(len(x) > 20 for x in re.findall("<dd>(.*?)</dd>", first))
    assert rest.count("<details>") == 7 and rest.count("</details>") == 8
    assert "`" not in html and "**" not in html
    assert "e-300" not in html
    assert html.count("<li>") == len(set(re.findall("<li>.*?</li>", html)))


def test_where_nothing_was_corrected_there_is_no_after():
    html = page(diagnosis(Verdict.UNKNOWN), {})
    assert "corrected" not in html.replace("corrected chair (model.xml)", "")
    assert "after" not in re.findall("<summary><h2>6.*?</h2>", html)[0]
    assert "wind with toe, closes 94 % of the gap on the runs that it was fitted to" in html
    assert "and leaves 9.4 times the noise" in html


def test_the_section_of_the_choice_does_not_contradict_the_notes():
    html = page(diagnosis(Verdict.UNKNOWN), {})
    section = html[html.index("4. Which one") : html.index("5. Whole")]
    assert "94 %" in section and html.count("94 %") == 1
    assert "What is only roughly known" in html  # the table of what was moved is there


def test_probabilities_have_a_sentence_and_bars():
    found = diagnosis()
    assert probability.figure(found) is None
    found.probability = {"rolling_resistance": 0.97, "outside": 0.02, "none": 0.01}
    assert first_screen.sure(found).startswith(
        "Probability: 97 % rolling resistance, 2 % something"
    )
    figure = probability.figure(found)
    assert [bar.get_width() for bar in figure.axes[0].patches] == pytest.approx([1.0, 2.0, 97.0])
    assert_legible(figure)


def test_the_named_effects_with_more_beside_them_count_for_them():
    """A named motion of the rider stood at 90 %, which is less than `named` asks for."""
    found = diagnosis()
    found.probability = {
        "rolling_resistance": 0.90,
        "rolling_resistance+toe": 0.04,
        "air_drag+rolling_resistance": 0.02,
        "outside": 0.03,
        "toe": 0.01,
    }
    said = first_screen.sure(found)
    assert said.startswith(
        "Probability: 96 % rolling resistance (90 % with nothing more), 3 % something"
    )
    figure = probability.figure(found)
    assert [bar.get_width() for bar in figure.axes[0].patches] == pytest.approx(
        [1.0, 3.0, 6.0, 90.0]
    )
    assert_legible(figure)


def test_a_replay_has_its_place_and_is_shown_as_it_is():
    assert '<section id="replay"><p>here</p></section>' in page(
        diagnosis(), {}, replay="<p>here</p>"
    )
    assert "replay" not in page(diagnosis(), {})


# the figures whose layout hangs on how much there is to draw
WORST = {
    "one window of one channel": {"trials": 1, "windows": 1, "channels": 1},
    "a run of a minute": {"trials": 1, "windows": 30, "channels": 4},
    "forty trials": {"trials": 40, "windows": 4, "channels": 2},
    "long names, twelve channels, huge": {
        "trials": 9,
        "name": "coast_east_on_the_old_linoleum_floor_of_the_laboratory",
        "largest": 1e5,
    },
}


@pytest.mark.parametrize("case", list(WORST))
def test_figures_of_much_and_of_little_can_be_read(case):
    found = diagnosis(Verdict.UNKNOWN, **WORST[case])
    for module in (where, gap):
        assert_legible(module.figure(found))


@pytest.mark.parametrize(
    "module", [where, missing_force, candidates, whole_runs, gap, summary], ids=lambda m: m.__name__
)
def test_every_figure_of_a_correction_can_be_read(module):
    assert_legible(module.figure(diagnosis(largest=1.5)))


def test_a_large_gap_does_not_make_one_solid_bar():
    """Data at 40 to 250 times the noise have as many colours as windows."""
    found = diagnosis(largest=250.0)
    mesh = where.figure(found).axes[0].collections[0]
    drawn = np.unique(np.round(mesh.to_rgba(mesh.get_array()).reshape(-1, 4), 3), axis=0)
    assert len(drawn) > 0.8 * mesh.get_array().size


def test_time_stands_below_the_map():
    found = diagnosis(Verdict.UNKNOWN, trials=2, windows=5)
    axes = where.figure(found).axes[0]
    labels = {t.get_text(): t.get_position()[0] for t in axes.get_xticklabels()}
    assert labels["0"] >= 0.0 and len(labels) >= 3
    begins = [m.get_coordinates()[0, 0, 0] for m in axes.collections]
    assert begins == [0.0, 10.0]  # s: the second trial follows the first


def test_values_that_nearly_agree_are_one_level():
    """Four points of a coast stood above one another, at torques of zero but for noise."""
    rng = np.random.default_rng(1)
    torque = np.r_[rng.normal(0.0, 0.05, 60), rng.uniform(2.0, 10.0, 40)]
    edges = _edges(torque)
    assert np.diff(edges).min() > 0.04 * np.ptp(torque)
    assert edges[[0, -1]].tolist() == [torque.min(), torque.max()]
    assert _edges(np.linspace(0.0, 1.0, 81)) == pytest.approx(np.linspace(0.0, 1.0, 9))


def test_a_channel_is_drawn_once():
    run = evidence(channels=1).runs[0]
    assert whole_runs.telling(run, 2) == [0]
    both = evidence(channels=2).runs[0]
    assert whole_runs.telling(both, 2) in ([0], [1])  # left and right of one kind


def test_places_are_drawn_as_differences_and_after_speeds():
    run = evidence().runs[0]
    shown = [run.channels[k] for k in whole_runs.telling(run, 9)]
    assert shown.index("position.x") > shown.index("imu_gyro.x")
    (first,) = whole_runs.telling(run, 1, ["position.x"])  # its sensor is at fault
    assert run.channels[first] == "position.x"
    alone = dataclasses.replace(
        run,
        channels=("position.x",),
        units=("m",),
        noise=run.noise[10:11],
        measured=run.measured[:, 10:11],
        before=run.before[:, 10:11],
        after=run.after[:, 10:11],
    )
    found = diagnosis()
    found.evidence = dataclasses.replace(found.evidence, runs=(alone,))
    (axes,) = whole_runs.figure(found).axes
    assert "simulated less measured" in axes.get_ylabel()
    lines = {line.get_label(): np.asarray(line.get_ydata()) for line in axes.lines}
    np.testing.assert_allclose(lines["chair as it was"], 0.05 * alone.time, atol=1e-9)


def test_figures_without_anything_to_show_are_left_out():
    assert figures(Diagnosis(verdict=Verdict.NONE)) == {}


def test_figures_are_pictures():
    drawn = figures(diagnosis(trials=1, windows=1, channels=1))
    assert set(drawn) == {"summary", "where", "force", "candidates", "compared", "gap"}
    assert all(image.startswith(b"\x89PNG") for image in drawn.values())


def test_without_a_turn_measured_nothing_is_said_of_turning():
    found = diagnosis(Verdict.UNKNOWN)
    cell = dataclasses.replace(found.where[0], regime={"speed": "1 m/s", "yaw_rate": "2 rad/s"})
    found.where, yaw = (
        [cell],
        MissingForce(force=Force.YAW, goes_with=Driver(Quantity.YAW_RATE), sigmas=9.0),
    )
    found.drivers = [*found.drivers, yaw]
    assert "yaw rate" in page(found, {}) and len(missing_force.figure(found).axes) == 8
    found.evidence = dataclasses.replace(found.evidence, turns=False)
    html = page(found, {})
    assert "yaw" not in html and "stroke" in html
    figure = missing_force.figure(found)
    assert [a.get_xlabel() for a in figure.axes if a.axison] == [
        "speed (m/s)",
        "torque, both wheels (N m)",
    ]


def test_what_a_force_goes_with_is_said_beside_a_moment_that_may_be_all():
    """A strap that held in left turns came as a moment of one run, and no more was said."""
    found = Diagnosis(verdict=Verdict.UNKNOWN, moment=Moment(trial="run2", begin=0, end=2))

    def driver(quantity, sigmas, trial=""):
        return MissingForce(force=Force.YAW, goes_with=Driver(quantity, trial), sigmas=sigmas)

    found.drivers = [driver(Quantity.TIME, 24.0, "run2"), driver(Quantity.YAW_RATE, 5.6)]
    assert first_screen.missing(found).endswith(
        "so nothing is named. The yaw moment that is missing goes with yaw rate."
    )
    found.drivers[1] = driver(Quantity.YAW_RATE, 4.9)
    assert first_screen.missing(found).endswith("so nothing is named.")


def test_a_number_at_the_end_of_what_is_believed_is_why_nothing_is_named():
    """Of a pushed chair taken to coast, a rolling resistance of -0.01 stood in an answer."""
    found = Diagnosis(
        verdict=Verdict.UNKNOWN, probability={"floor_slope+rolling_resistance": 0.8, "none": 0.2}
    )
    ends = (("rolling_resistance", "coefficient"),)
    near = Nearest(
        effects=("rolling_resistance", "floor_slope"), closure=0.9, remainder=1.5, ends=ends
    )
    found.nearest = near
    said = first_screen.missing(found)
    assert "but only with the coefficient of rolling resistance at the end of what is" in said
    assert "has no number at the end of what is believed of it" in sections.choice_words(found)
    found.nearest = dataclasses.replace(near, ends=())
    assert "it explains too little" in first_screen.missing(found)
    found.nearest = dataclasses.replace(near, effects=("floor_slope",))
    assert "it explains too little" in first_screen.missing(found)


def test_what_is_left_goes_with_what_was_measured():
    """Of a chair whose turns nothing tells, the first screen said that it goes with heading."""
    found = diagnosis(Verdict.AMBIGUOUS)
    found.more_missing = True
    heading = MissingForce(force=Force.YAW, goes_with=Driver(Quantity.HEADING), sigmas=99.0)
    found.drivers = [heading, *found.drivers]
    assert "goes with heading" in first_screen.remainder_words(found)
    found.evidence = dataclasses.replace(found.evidence, turns=False)
    assert "goes with stroke" in first_screen.remainder_words(found)


@pytest.mark.parametrize(
    ("probability", "said"),
    [
        ({"outside": 0.9, "none": 0.1}, "no effect of the library explains"),
        ({"toe": 0.8, "outside": 0.2}, "Of the library toe is the most probable"),
    ],
)
def test_what_nothing_explains_names_what_is_most_probable(probability, said):
    """82 % stood on an effect, of which the first sentence said that no effect explains it."""
    assert said in first_screen.missing(Diagnosis(verdict=Verdict.UNKNOWN, probability=probability))


def test_what_happened_in_one_run_is_said_first():
    """A knock that the next step told stood under a force that no effect explains."""
    found = Diagnosis(verdict=Verdict.UNKNOWN, moment=Moment(trial="run2", begin=2, end=4))
    assert first_screen.missing(found).startswith(
        "Something may have happened once in run2, between 2 and 4 s"
    )
    held = Diagnosis(verdict=Verdict.UNKNOWN, moment=Moment(trial="run5"))
    assert first_screen.missing(held).startswith("Something happened in run5, which is held out")
    assert held.to_dict()["moment"] == {"trial": "run5", "begin": None, "end": None}


@pytest.mark.parametrize(
    ("held", "before", "said"), [(True, 1.42, True), (True, 0.9, False), (False, 1.42, False)]
)
def test_none_says_what_held_out_runs_leave(held, before, said):
    scope = "held-out trials" if held else "trials"
    gap = GapSummary(before=before, after=None, scope=scope, p_value=1e-6, p_value_after=None)
    found = Diagnosis(verdict=Verdict.NONE, gap=gap, material=Material(3.0, 1.2))
    assert ("1.4 times the noise in those held out" in first_screen.missing(found)) == said


def test_mean_forces_are_not_drawn_towards_zero():
    """A truth of 3.8 N comes back where the smoothed force, with its prior, says far less."""
    pulses = [
        Pulse(window=w, force=Force.FORWARD, time=0.2 * k, width=0.2)
        for w in range(3)
        for k in range(6)
    ]
    level = np.array([k % 2 for _ in range(3) for k in range(6)])
    truth = np.array([3.8, -1.0])
    random = np.random.default_rng(0)
    products = []
    for w in range(3):
        J = 0.01 * random.normal(size=(20, 6))  # little is told: the prior of 10 N would win
        G = J.T @ J
        mine = list(range(6 * w, 6 * w + 6))
        products.append(Products(mine, G, G @ truth[level[mine]]))
    value, std = mean_forces(products, pulses, Force.FORWARD, level)
    np.testing.assert_allclose(value, truth, rtol=1e-3)
    assert (std > 1.0).all()


def test_what_harmonics_say_together_stands_in_place_of_six_numbers():
    found = diagnosis(Verdict.NAMED)
    said = "its mass times its displacement goes 1.10 kg m to both sides"
    harmonics = {f"sine_{k}": Estimate(value=-0.069, std=0.091, unit="kg m") for k in (1, 2, 3)}
    moves = NamedEffect(name="rider_motion", parameters=harmonics, closure=0.8, remark=said)
    found.effects = [moves]
    html = page(found, {})
    first = html[: html.index("What to do next")]
    assert said in first and "-0.069" not in first


def test_what_a_person_does_that_nothing_shows_is_told_where_it_counts():
    levels = {"drive": Estimate(value=2.0, std=None, unit="N")}
    for left, told in ((0.004, False), (0.2, True)):
        levels["person"] = Estimate(value=left, std=None, unit="1")
        said = sections.process_words(Diagnosis(verdict=Verdict.NONE, process=levels))
        assert ("20 % of the force by which the person moves" in said) == told


def test_what_is_roughly_known_of_a_sensor_is_in_words():
    names = ("centre_x", "bias:imu_gyro.z", "scale:left_wheel_speed")
    said = ["centre x", "bias of imu_gyro.z", "gain of left_wheel_speed"]
    assert [wording.roughly_known(name) for name in names] == said


def test_a_model_that_tips_where_nothing_shows_it_is_said_first():
    """It was a payload of -30 kg, and then a force outside the library."""
    tips = dataclasses.replace(diagnosis(Verdict.UNKNOWN), tipped=["sprint"])
    assert first_screen.missing(tips).startswith("In sprint the chair of the model tips, ")
    assert tips.to_dict()["tipped"] == ["sprint"]


@pytest.mark.parametrize(
    ("mass", "height", "std", "said"),
    [
        (-30.0, 0.6, 0.2, ["mass ends at -30 kg"]),
        (25.0, 0.6, 0.2, []),
        (25.0, 1.6, 0.2, ["height ends at 1.6 m"]),
        (25.0, 1.6, 0.8, []),  # straight coasts hardly tell how high a load is
    ],
)
def test_a_number_at_the_end_of_what_is_believed_is_told(mass, height, std, said):
    term = Term(find("payload"), {"mass": mass, "height": height}, ("mass", "height"))
    told = list(notes._at_ends(term, {ParameterId("payload", "height"): std}))
    rest = ", the end of what is believed of it; something else may act like it"
    assert told == [f"payload: {ends}{rest}" for ends in said]


def test_a_gap_that_roughly_known_numbers_make_is_told_where_nothing_is_missing():
    """It was "as well as the noise allows" beside a gap of 3.16 times the noise."""
    gap = GapSummary(before=3.16, after=None, scope="held-out trials: rms", p_value=0.9,
                     p_value_after=None, unforeseen=1.05)  # fmt: skip
    found = dataclasses.replace(diagnosis(Verdict.NONE), gap=gap)
    said = first_screen.missing(found)
    assert "3.2 times the noise that the chair leaves on held-out runs, all but 1.1 can" in said
    found.gap = dataclasses.replace(gap, unforeseen=3.0)
    assert "times the noise that" not in first_screen.missing(found)


def test_a_gap_that_only_held_out_runs_show_is_no_gap_of_the_others():
    """p = 0.4 was "more than noise", and beside 1.6 times the noise held out nothing was left."""
    gap = GapSummary(before=1.6, after=None, scope="held-out trials: rms", p_value=0.4,
                     p_value_after=None, only_held_out=True)  # fmt: skip
    found = dataclasses.replace(diagnosis(Verdict.NONE), gap=gap, material=Material(0.5, 1.2))
    told = {word: sections.gap_words(dataclasses.replace(found, verdict=word)) for word in Verdict}
    assert all("foretells the held-out runs worse" in words for words in told.values())
    assert "more than noise is left in the runs held out, but" in first_screen.missing(found)
    assert "does not matter" in sections.choice_words(found)
    found.gap = dataclasses.replace(gap, only_held_out=False)
    assert sections.gap_words(found).endswith("Nothing shows.")
    assert "no gap to explain" in sections.choice_words(found)


def test_an_answer_without_a_plan_does_not_decide():
    """ "Probably (90 %)" was followed by "These data decide; use the corrected chair"."""
    found = dataclasses.replace(diagnosis(Verdict.AMBIGUOUS), next_experiment="")
    assert first_screen.next_step(found).startswith("These data do not decide")
    found = dataclasses.replace(found, verdict=Verdict.NAMED, alternatives=[])
    assert first_screen.next_step(found).startswith("These data decide; use")


def test_that_nothing_stands_there_is_said_as_such():
    """It was "these runs do not rule out nothing", and 99.8 % was 100 %."""
    found = diagnosis(Verdict.AMBIGUOUS)
    found.alternatives = [["rolling_resistance", "none"]]
    found.probability = {"rolling_resistance": 0.998, "none": 0.002}
    said = first_screen.missing(found)
    assert "(more than 99 %), but these runs do not rule out that nothing stands there." in said


def test_one_encoder_or_the_other_is_said_with_both():
    """The report ended in a ValueError: the set held one name."""
    found = diagnosis(Verdict.AMBIGUOUS)
    channels = [f"sensor_scale:{side}_wheel_speed" for side in ("left", "right")]
    found.alternatives = [channels]
    assert sections.alike_words(found) == (
        "These data cannot tell **sensor scale of left_wheel_speed** from "
        "**sensor scale of right_wheel_speed**."
    )


def test_a_run_that_is_shaken_far_harder_is_said_where_nothing_is_missing():
    """A brake of 4 N that rubbed for 2 s in one coast was "nothing; use the chair as it is"."""
    found = dataclasses.replace(
        diagnosis(Verdict.NONE), next_experiment="", shaken=Shaken("first", 2.85, "second", 1.27)
    )
    said = first_screen.missing(found)
    assert said.startswith("Nothing")
    assert "But first is shaken far harder than second, by 2.9 N against 1.3 N, which" in said
    assert first_screen.next_step(found) == "Look at what was different in first, and repeat it."
    assert found.to_dict()["shaken"]["other"] == "second"


def test_it_is_told_where_a_chair_is_shaken_as_much_as_is_believed(monkeypatch):
    shares = {"drive": 0.99, "yaw": 0.5, "side": 1.2, "wheel_turn": 0.5, "caster_turn": 0.5}
    monkeypatch.setattr(notes.noise_shown, "shares", lambda _: shares)
    side = {notes.process.Part.SIDE: 3.0}  # as the study says
    monkeypatch.setattr(notes.noise_shown.noise_levels, "known_parts", lambda _: side)
    levels = {part: np.array([2.0]) for part in notes.process.Part}
    simulator = SimpleNamespace(study=None)
    bench = SimpleNamespace(process=SimpleNamespace(levels=levels), simulator=simulator)
    (line,) = notes._as_loud_as_believed(bench)
    assert line.startswith("what shakes the chair (drive) stands at 2.8 N, the most")
