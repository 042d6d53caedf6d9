"""Probabilities of hypotheses follow evidence and priors, and come true as often as they say."""

import math
import re
from dataclasses import replace
from types import SimpleNamespace

import linear_system
import numpy as np
import pytest
from linear_system import start

from mjchair.diagnosis import rules
from mjchair.diagnosis.explain import calibration, hypotheses, probability
from mjchair.diagnosis.explain.calibration import Chosen, Weight
from mjchair.diagnosis.explain.choice import Choice, Tried
from mjchair.diagnosis.explain.column_ids import (
    Driver,
    ForceColumn,
    ForceGroup,
    Quantity,
)
from mjchair.diagnosis.explain.probability import NONE, OUTSIDE, of_any, of_effects, probabilities
from mjchair.diagnosis.fit import bounded
from mjchair.diagnosis.fit.column_ids import RoughlyKnown
from mjchair.diagnosis.fit.process import KINDS
from mjchair.diagnosis.fit.variant import Variant
from mjchair.diagnosis.replay.pulses import Force
from mjchair.errors import MjchairError

COUNT = 120  # drawn studies
NAMES = ("rolling_resistance", "caster_trail", "caster_friction")


def base(size, alike=0.0, force=0.0):
    """Three effects and a force; the first has a size, the second looks like it by |cos| alike."""
    rng = np.random.default_rng(4)
    J = np.linalg.qr(rng.standard_normal((60, 4)))[0] * 10.0
    J[:, 1] = alike * J[:, 0] + np.sqrt(1.0 - alike**2) * J[:, 1]
    r = size * J[:, 0] + force * J[:, 3]
    starts = [start(name) for name in NAMES]
    columns = [s.columns[0] for s in starts]
    columns.append(ForceColumn(ForceGroup(Force.FORWARD, Driver(Quantity.SPEED)), 0))
    reduced = bounded.reduce(linear_system.system(columns, J, r), [0])
    plain = SimpleNamespace(total=reduced.total, confined=0.0)
    return SimpleNamespace(reduced=reduced, starts=starts, plain=plain)


def fit(known, *effects):
    """Effects with their fit."""
    hypothesis = hypotheses.weigh(known.reduced, effects)
    fitted = SimpleNamespace(
        total=known.plain.total - hypothesis.gain,
        confined=0.0,
        sigmas={s.effect.name: math.sqrt(max(hypothesis.gain, 0.0)) for s in effects},
        variant=Variant(()),
    )
    return Tried(hypothesis, fitted)


def chosen(known, name, rivals=(), gap_left=False):
    """The choice of one effect; every effect was fitted."""
    fits = {s.effect.name: fit(known, s) for s in known.starts}
    return Choice(
        hypothesis=fits[name].hypothesis,
        fitted=fits[name].fitted,
        tried=list(fits.values()),
        after=SimpleNamespace(exists=gap_left),
        rivals=[[fits[r] for r in rivals]],
        own_gains=[fits[name].hypothesis.gain],
    )


def test_a_choice_is_as_sure_as_its_least_certain_effect():
    def both_there(second):
        known = {"a": 100.0, "b": 4.0, "a+b": 100.0 + second, NONE: 0.0, OUTSIDE: 1.0}
        told = {name: Weight(math.log(0.2), value, True) for name, value in known.items()}
        return calibration.shipped().probabilities(told, Chosen("a+b"))["a+b"]

    assert both_there(80.0) > both_there(3.0) + 0.005


def test_nothing_in_the_place_of_an_effect_is_no_rival_of_a_choice():
    """A patch of 142 of chi2 beside a torque's gain of 347: that gain alone was a rival tried."""
    said = {"a": 170.0, "b": 60.0, "a+b": 240.0, "c": 30.0, NONE: 0.0, OUTSIDE: 1.0}
    told = {name: Weight(math.log(0.2), value, True) for name, value in said.items()}
    known = calibration.clues(told, "a+b")
    without = {name: weight for name, weight in told.items() if name not in ("a", "b")}
    for clue in ("over_tried", "over_untried", "share_tried", "share_untried"):
        assert known[clue] == calibration.clues(without, "a+b")[clue]
    assert known["each_gained"] < calibration.clues(without, "a+b")["each_gained"]


@pytest.mark.parametrize("size", [0.0, 0.3, 2.0])
def test_they_sum_to_one(size):
    assert sum(probabilities(base(size), None).values()) == pytest.approx(1.0)


def test_without_a_gap_nothing_is_missing():
    assert max(probabilities(base(0.0), None).items(), key=lambda item: item[1])[0] == NONE


def test_a_clear_effect_is_nearly_certain():
    made = base(2.0)
    known = probabilities(made, chosen(made, "rolling_resistance"))
    assert sum(known.values()) == pytest.approx(1.0)
    assert of_effects(known, ["rolling_resistance"]) > rules.PROBABLE


@pytest.mark.parametrize("first", [True, False])
def test_a_choice_counts_though_another_fit_of_it_ended_where_it_is_not_there(first, monkeypatch):
    """A pair was fitted twice, once to where its wind was still: there was no probability of it."""
    made = base(2.0)
    choice = chosen(made, "rolling_resistance")
    still = fit(made, made.starts[0])
    still.fitted.total = made.plain.total - 1.0
    choice.tried.insert(0 if first else len(choice.tried), still)
    sure = probabilities(made, chosen(made, "rolling_resistance"))
    monkeypatch.setattr(probability, "is_there", lambda fitted: fitted is not still.fitted)
    assert probabilities(made, choice) == pytest.approx(sure)


def test_a_fit_for_few_beginnings_of_its_windows_has_less_evidence():
    """As much less as it costs beyond the chair without effects, in chi2."""
    known = base(6.0)
    choice = chosen(known, "rolling_resistance")
    before = probability._kept(known, choice)
    known.plain.confined, choice.fitted.confined = 5.0, 45.0
    after = probability._kept(known, choice)
    name = "rolling_resistance"
    assert before[name] - after[name] == pytest.approx(40.0)
    assert after["caster_trail"] - before["caster_trail"] == pytest.approx(5.0)


def test_a_hypothesis_whose_only_fit_ended_where_it_is_not_there_has_no_part(monkeypatch):
    made = base(2.0, alike=0.9)
    choice = chosen(made, "rolling_resistance")
    assert "caster_trail" in probability.weights(made, choice)
    monkeypatch.setattr(probability, "is_there", lambda fitted: fitted is choice.fitted)
    assert "caster_trail" not in probability.weights(made, choice)
    assert "rolling_resistance" in probability.weights(made, choice)


@pytest.mark.parametrize(("rival", "part"), [("caster_trail", False), ("rolling_resistance", True)])
def test_a_rival_that_pushes_a_number_to_its_wall_has_no_part(rival, part):
    """A turning scrub with the centre of mass at its wall took 6 % from a centre of mass aside.

    What some of the chosen effects leave without the others still tells what these bring.
    """
    made = base(2.0, alike=0.9)
    both = fit(made, *made.starts[:2]) if part else fit(made, made.starts[0])
    choice = Choice(
        hypothesis=both.hypothesis,
        fitted=both.fitted,
        tried=[both, *(fit(made, s) for s in made.starts)],
        after=SimpleNamespace(exists=False),
        rivals=[],
        own_gains=[both.hypothesis.gain] * len(both.hypothesis.starts),
    )
    assert rival in probability.weights(made, choice)
    pushed = next(t for t in choice.tried[1:] if t.hypothesis.name == rival)
    pushed.fitted.variant = Variant((), offsets={"centre_x": 3.0})
    pushed.fitted.total += 50.0
    assert (rival in probability.weights(made, choice)) == part


def test_what_was_fitted_beside_a_choice_takes_part_though_linear_algebra_did_not_ask_for_it(
    monkeypatch,
):
    """Rivals of three effects at once are among no first pairs: the three were stated too high."""
    monkeypatch.setattr(hypotheses, "pairs", lambda *_: [])
    made = base(2.0, alike=0.9999)
    one, alike, other = made.starts
    choice = chosen(made, "rolling_resistance", ["caster_trail"])
    fits = [fit(made, one, other), fit(made, alike, other)]
    choice.hypothesis, choice.fitted, choice.tried = fits[0].hypothesis, fits[0].fitted, fits
    choice.own_gains = [200.0, 200.0]
    known = probability.weights(made, choice)
    assert known["caster_friction+caster_trail"].fitted
    of_rival = known["caster_friction+caster_trail"].evidence
    assert of_rival == pytest.approx(known["caster_friction+rolling_resistance"].evidence, abs=1.0)


def test_a_force_of_any_form_speaks_against_effects_only_where_they_leave_a_gap():
    made = base(2.0, force=2.0)
    whole, rest = (
        of_effects(
            probabilities(made, chosen(made, "rolling_resistance", gap_left=left)),
            ["rolling_resistance"],
        )
        for left in (False, True)
    )
    assert whole > rules.PROBABLE > 0.9 > rest


def test_a_linear_gain_that_the_fitted_chair_has_already_speaks_for_nothing(monkeypatch):
    """A force gains 400 by linear algebra, of which the chair without effects takes 390."""
    ends = np.linspace(-9.0, 9.0, 50)
    line = calibration.Line(values=tuple(ends), right=tuple(1.0 / (1.0 + np.exp(-ends))))
    even = calibration.Calibration("", "", 0, 10.0, *[line] * len(calibration.LINES))
    monkeypatch.setattr(calibration, "shipped", lambda: even)  # lines of the real one have steps
    made = base(2.0, force=2.0)

    def there():
        choice = chosen(made, "rolling_resistance", gap_left=True)
        return of_effects(probabilities(made, choice), ["rolling_resistance"])

    before = there()
    made.plain.total -= 390.0
    assert there() > before + 0.05


def test_effects_that_look_alike_share_it_the_common_one_first():
    made = base(2.0, alike=0.9999)
    known = probabilities(made, chosen(made, "rolling_resistance", ["caster_trail"]))
    there = of_effects(known, ["rolling_resistance"])
    assert 0.95 > there > 2.0 * known["caster_trail"] > 0.02


def test_a_force_that_no_effect_makes_is_outside_the_library():
    # of drawn studies with such a force and no effect, half were outside the library
    known = probabilities(base(0.0, force=10.0), None)
    assert max(known, key=lambda name: known[name]) == OUTSIDE
    assert known[OUTSIDE] > 0.45


def test_pairs_that_hold_an_effect_count_for_it():
    known = {"a": 0.5, "a+b": 0.3, "b": 0.1, "none": 0.1}
    assert of_effects(known, ["a"]) == pytest.approx(0.8)
    assert of_effects(known, ["a", "b"]) == pytest.approx(0.3)
    assert of_any(known, ["a", "b"]) == pytest.approx(0.9)


def weights(evidence):
    """Two effects, their pair, nothing, and a force outside the library."""
    known = {"a": evidence, "b": 4.0, "a+b": evidence - 2.0, NONE: 0.0, OUTSIDE: 1.0}
    return {name: Weight(math.log(0.2), value, True) for name, value in known.items()}


@pytest.mark.parametrize(("gap_left", "rivals"), [(False, False), (False, True), (True, False)])
def test_more_evidence_never_makes_an_effect_less_probable(gap_left, rivals):
    known = [
        calibration.shipped().probabilities(weights(e), Chosen("a", gap_left, rivals))
        for e in np.linspace(-20.0, 4000.0, 400)
    ]
    assert all(sum(k.values()) == pytest.approx(1.0) for k in known)
    there = [of_effects(k, ["a"]) for k in known]
    assert np.all(np.diff(there) > -1e-9)
    assert there[-1] - there[0] > 0.5


def test_an_effect_that_leaves_a_gap_is_less_sure():
    shipped = calibration.shipped()
    whole, rest = (
        shipped.probabilities(weights(80.0), Chosen("a", left)) for left in (False, True)
    )
    assert of_effects(whole, ["a"]) > 0.95
    assert of_effects(whole, ["a"]) > of_effects(rest, ["a"])
    only = [known["a"] / of_effects(known, ["a"]) for known in (whole, rest)]
    assert only[0] > 0.9 > only[1]  # where a gap is left, more may be there


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("temper = ", "temper = -", "must be at least 1"),
        ("temper = ", "tempre = ", "temper"),
        ("right = [", "right = [2.0, ", "as many values as shares"),
        ("values = [", "values = [nan, ", "as many values as shares"),
        ("[effects]", "[effects", "not TOML"),
        ("gained = ", "gaind = ", "must be one of gained, each_gained"),
        ("gained = ", "gained = -", "at least 0"),
    ],
)
def test_a_damaged_file_is_one_line(tmp_path, old, new, said):
    text = calibration.FILE.read_text(encoding="utf-8")
    assert old in text
    damaged = tmp_path / "calibration.toml"
    damaged.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(MjchairError) as error:
        calibration.read(damaged)
    line = str(error.value)
    assert said in line and str(damaged) in line and "\n" not in line
    assert "install mjchair anew" in line


def test_a_line_that_falls_is_refused(tmp_path):
    text = calibration.FILE.read_text(encoding="utf-8")
    damaged = tmp_path / "calibration.toml"
    damaged.write_text(re.sub(r"right = \[0\.\d+", "right = [0.9999", text), encoding="utf-8")
    with pytest.raises(MjchairError, match="each list rising"):
        calibration.read(damaged)


@pytest.mark.parametrize("of", calibration.LINES)
def test_the_stored_lines_rise_and_promise_no_certainty(of):
    line = getattr(calibration.shipped(), of)
    assert np.all(np.diff(line.values) > 0.0) and np.all(np.diff(line.right) >= 0.0)
    assert line.at(-1e3) > 0.0 and line.at(1e3) < 1.0


SHAPES = ("rolling_resistance", "air_drag", "toe", "caster_trail", "turning_scrub", "drive_lag")


def made_up_bed():
    """A base study of smooth random columns, of which two are much alike; none was fitted to."""
    from calibration_draws import Bed
    from calibration_studies import FORCES, SHAPED, Block, Kept

    rng = np.random.default_rng(3)
    starts = [start(name) for name in SHAPES]
    blocks = []
    for k in range(6):
        time = np.linspace(0.0, 2.0, 40)
        smooth = np.exp(-0.5 * ((time[:, None] - time[None, :]) / 0.3) ** 2)
        smooth = np.linalg.cholesky(smooth + 1e-8 * np.eye(time.size))
        J = np.vstack([smooth @ rng.standard_normal((40, 2 + len(SHAPES) + 3)) for _ in range(2)])
        J[:, 3] = 0.97 * J[:, 2] + 0.25 * J[:, 3]  # beside two nuisances
        strange = np.vstack([smooth @ rng.standard_normal((40, 3)) for _ in range(2)])
        J[:, -3:] = 0.8 * strange + 0.6 * J[:, -3:]  # forces with a driver, near the strange ones
        at = np.linspace(0.2, 1.8, 6)
        blocks.append(
            Block(
                J=J,
                Z=J @ rng.standard_normal((J.shape[1], 2)) * 0.1 + rng.standard_normal((80, 2)),
                precision=np.full(2, 1e-4),
                states=2,
                strange=strange,
                pulses={f: (at, rng.standard_normal((80, 6)) / 5.0) for f in FORCES},
                shaped={p: rng.standard_normal((80, 2)) / 5.0 for p in SHAPED},
                channel=np.repeat([0, 1], 40),
                frequency=np.tile(np.arange(40) / 4.0, 2),
                run=k // 2,
            )
        )
    drivers = (Quantity.SPEED, Quantity.YAW_RATE, Quantity.TORQUE)
    columns = [*(RoughlyKnown(n) for n in ("one", "two")), *(s.columns[0] for s in starts)]
    columns += [ForceColumn(ForceGroup(Force.FORWARD, Driver(q)), 0) for q in drivers]
    return Bed(
        Kept(
            name="made up",
            columns=columns,
            nuisance=2,
            hidden=np.zeros(len(columns), bool),
            starts=starts,
            blocks=blocks,
            fitted=np.arange(6),
            manoeuvres=["coast", "push", "turn"],
            levels={str(p): np.full(3, 0.3) for p in KINDS},
        )
    )


def test_no_part_of_the_noise_is_drawn_by_a_time_that_it_does_not_have():
    """A force once a turn, of no correlation time, was drawn as one that holds for a window."""
    from calibration_studies import SHAPED

    assert {p for p, kind in KINDS.items() if not math.isfinite(kind.time)} < set(SHAPED)


def test_probabilities_of_chosen_effects_come_true_as_often_as_they_say():
    from calibration_draws import diagnosed, draw, linear

    bed, told, right = made_up_bed(), [], []
    for number in range(COUNT):
        truth, y = draw(bed, np.random.default_rng(number))
        with linear():
            said = diagnosed(bed, y)
        if said["chosen"]:
            known = calibration.shipped().probabilities(
                {n: Weight(*w) for n, w in said["weights"].items()},
                Chosen(said["chosen"], said["gap_left"], said["rivals"] > 0),
            )
            told.append(of_effects(known, said["chosen"].split("+")))
            right.append(calibration.holds(truth.name, said["chosen"]))
    p = np.array(told)
    assert len(p) > COUNT // 4
    spread = math.sqrt(float((p * (1.0 - p)).sum()))
    assert abs(sum(right) - p.sum()) < 3.0 * spread


def test_what_a_choice_does_not_get_hardly_goes_to_nothing_where_the_gap_is_clear():
    """An air drag of 38 sigma, of which three effects were made: nothing missing had 40 %."""
    weights = {
        "none": Weight(-1.2, 0.0, True),
        "a+b+c": Weight(-13.0, 120.0, True),
        "drag": Weight(-5.1, 80.0, True),
        "slope": Weight(-5.1, 60.0, True),
    }
    known = calibration.shipped().probabilities(weights, Chosen("a+b+c", rivals=True))
    assert known["none"] < 0.01 < known["drag"]
    faint = {n: replace(w, evidence=0.1 * w.evidence) for n, w in weights.items()}
    known = calibration.shipped().probabilities(faint, Chosen("a+b+c", rivals=True))
    assert known["none"] > 0.1  # 12 may be what a chair is a little other in


def test_a_gap_that_nothing_explains_is_not_nothing():
    """A scrub of 15 N m that no effect explained was `unknown`, with nothing missing at 96 %."""
    known = {"none": 0.96, "outside": 0.01, "rolling_resistance": 0.03}
    said = probability.with_gap(known, 1e-6)
    assert next(iter(said)) == "outside"
    assert said["none"] == 1e-6
    assert sum(said.values()) == pytest.approx(1.0)
    assert probability.with_gap({"outside": 1.0}, 1e-6) == {"outside": 1.0, "none": 0.0}
