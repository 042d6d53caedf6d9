"""What the report of a diagnosis says, in plain sentences.

In: a diagnosis. Out: text. **Two stars** stand about what is to be bold and `backticks` about what
is typed, for the page to show; nothing here is HTML.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from mjchair.diagnosis.explain.calibration import NONE, OUTSIDE
from mjchair.diagnosis.explain.column_ids import Quantity
from mjchair.diagnosis.explain.event import EVENT
from mjchair.diagnosis.explain.probability import ONE_RUN, of_effects
from mjchair.diagnosis.fit import bounded
from mjchair.diagnosis.fit.process import Part
from mjchair.diagnosis.next_experiment.wording import MEASURED, measured, plain
from mjchair.diagnosis.replay.pulses import Force
from mjchair.diagnosis.result import (
    Diagnosis,
    Disagreement,
    Estimate,
    GapSummary,
    MissingForce,
    Moment,
    NamedEffect,
    OneRun,
)
from mjchair.diagnosis.rules import LEVEL, LIKELY, PARTLY, PROBABLE, Verdict
from mjchair.units import per_cent, probable, with_error, with_unit

LEAST = 1e-6  # a chance below this is said to be below it
# what a force may go with that is not known where nothing tells how the chair turns
TURNING = (Quantity.YAW_RATE, Quantity.HEADING, Quantity.SWIVEL, Quantity.RIGHT_TURN)
TURNS = {"wheel_turn": str(Part.WHEEL_TURN), "caster_turn": str(Part.CASTER_TURN)}
CLEAR = 0.5  # of what shakes the chair forward: a force once a turn of this size is told
NOTABLE = 1.5  # times the noise: where a correction leaves more, what can explain it is said
NOTED = 1.2  # times the noise: where held-out runs leave more, and nothing is missing, it is said
A_GAP = 0.8  # of what a correction leaves: where no more than this is a gap, the rest is explained
STAYS = 0.95  # of a gap on held-out runs: a correction that leaves more does not change it
ALL = 0.995  # of a gap: more is not told as 100 %
LITTLE = 0.01  # of a person's force: less is not told
FAINT = 1e-3  # of the loudest: less of what shakes a chair is nothing
MUCH = 0.15  # share by which a fit moved what a person can measure, worth a word beside a name
ALIKE = 3  # effects in one run alone that a sentence names
UNSURE = 0.005  # probabilities below this are not named


def first_screen(diagnosis: Diagnosis) -> dict[str, str]:
    """What a person reads first: a heading -> what stands under it."""
    return {
        "What is missing": missing(diagnosis),
        "How sure": sure(diagnosis),
        "What to do next": next_step(diagnosis),
    }


def missing(diagnosis: Diagnosis) -> str:
    """What is missing, in a sentence or a few."""
    if diagnosis.verdict == Verdict.NONE:
        more = (unforeseen_words, turn_words, shaken_words)
        return nothing_missing(diagnosis) + "".join(words(diagnosis) for words in more)
    if diagnosis.verdict == Verdict.NAMED:
        return remainder_words(diagnosis) + _capital(found_words(diagnosis.effects)) + "."
    if diagnosis.verdict == Verdict.AMBIGUOUS:
        return remainder_words(diagnosis) + _undecided(diagnosis)
    if diagnosis.one_run is not None:
        return one_run_words(diagnosis.one_run)
    if diagnosis.tipped:
        return (
            f"In {' and '.join(diagnosis.tipped)} the chair of the model tips, and no channel "
            "shows that the real one did: what keeps it down is in no model, such as a person who "
            "leans forward."
        )
    return _unexplained(diagnosis)


def _unexplained(diagnosis: Diagnosis) -> str:
    """That nothing is named: where it happened, or what is the most probable if that is known."""
    if diagnosis.moment is not None:
        return _moment_words(diagnosis.moment)
    first = next(iter(explanations(diagnosis)), None)
    if first is None or first.name in (NONE, OUTSIDE, ONE_RUN):
        return "A force is missing that no effect of the library explains, so none is named."
    return (
        f"Something is missing. Of the library {hypothesis_words(first.name)} is the most "
        "probable, but it explains too little of these runs, or not all of them, so nothing is "
        "named."
    )


def _moment_words(moment: Moment) -> str:
    """What happened in one run that no other shows, as one sentence."""
    if moment.begin is None:
        return (
            f"Something happened in {moment.trial}, which is held out, that no run of the fit "
            "shows, so nothing is named."
        )
    return (
        f"Something happened in {moment.trial} between {moment.begin} and {moment.end} s: a force "
        "that acts there alone explains these runs about as well as any effect, so nothing is "
        "named."
    )


def one_run_words(one: OneRun) -> str:
    """What acts in one run alone, and that it is no answer for all runs, as one sentence."""
    any_of = " or ".join(map(effect_words, one.effects[:ALIKE]))
    return (
        f"{one.trial} differs from the other runs: {any_of} in {one.trial} alone explains "
        "these runs better than what acts in all of them, so nothing is named."
    )


def _undecided(diagnosis: Diagnosis) -> str:
    """What is missing whichever it is, and what these runs cannot tell apart."""
    every = diagnosis.effects
    likely = of_effects(diagnosis.probability, [e.key for e in every])
    if not diagnosis.alternatives:
        if likely >= LIKELY:
            what = found_words(every)
            return f"Probably ({probable(likely)}), {what}; these runs are not enough to name it."
        return f"Perhaps {found_words(every)}, but the evidence is thin."
    known = settled(diagnosis)
    others = [e for e in every if e not in known]
    if not known or not others:
        return _capital(_open(diagnosis, others or known))
    there = of_effects(diagnosis.probability, [e.key for e in known])
    surely = "" if there >= PROBABLE else f"probably ({share(there)}), "
    first = _capital(f"{surely}{found_words(known)}")
    return f"{first}. Besides, {_open(diagnosis, others)}"


def _open(diagnosis: Diagnosis, effects: Sequence[NamedEffect]) -> str:
    """Effects of the correction in whose place others could stand, and these, as sentences."""
    sets = _instead(diagnosis.alternatives)
    has = " and ".join(map(effect_words, effects))
    chair = f"the corrected chair has {has}{_though(diagnosis)}."
    if len(sets) > 1 or len(effects) > 1:
        return f"{chair} But these runs cannot tell {_from(sets)}."
    ((own, others),) = sets.items()
    any_of = _one_of(own, *others)
    return f"it is {any_of}, and these runs cannot tell which. {_capital(chair)}"


def _from(sets: Mapping[str, Sequence[str]]) -> str:
    """What cannot be told from what, as a clause."""
    return "; nor ".join(f"{together(own)} from {_one_of(*rest)}" for own, rest in sets.items())


def _though(diagnosis: Diagnosis) -> str:
    """That the correction has effects than which others are more probable; empty: none are."""
    found = _more_probable(diagnosis)
    if found is None:
        return ""
    return f", with which it fits best, though {_is_more_probable(found[0])}"


def _why_less_probable(diagnosis: Diagnosis) -> str:
    """Why the correction has effects than which others are more probable; empty: none are."""
    found = _more_probable(diagnosis)
    if found is None:
        return ""
    likely, less = (share(e.alone + e.more) for e in found)
    return (
        f" {_capital(_is_more_probable(found[0]))} ({likely} against {less}) though it fits less "
        "well: probability counts as well how common an effect is and how many numbers it has."
    )


def _is_more_probable(explanation: Explanation) -> str:
    """That an explanation is more probable, as a clause."""
    verb = "are" if "+" in explanation.name else "is"
    return f"{hypothesis_words(explanation.name)} {verb} more probable"


def _more_probable(diagnosis: Diagnosis) -> tuple[Explanation, Explanation] | None:
    """The explanation that is more probable than the correction, and this; None: none is."""
    first, *others = explanations(diagnosis)
    own = next((e for e in others if e.named), None)
    if own is None or first.name in (NONE, OUTSIDE, ONE_RUN):
        return None
    if share(first.alone + first.more) == share(own.alone + own.more):
        return None
    return first, own


def _instead(alternatives: Sequence[Sequence[str]]) -> dict[str, list[str]]:
    """An effect, or several together -> what could stand in its place; single effects first."""
    out: dict[str, list[str]] = {}
    for own, *others in sorted(alternatives, key=lambda names: "+" in names[0]):
        known = out.setdefault(own, [])
        known += [n for n in others if n not in known]
    return out


def _one_of(*names: str) -> str:
    """Alternatives as words: a, b or c."""
    *others, last = map(together, names)
    return f"{', '.join(others)} or {last}" if others else last


def found_words(effects: Sequence[NamedEffect]) -> str:
    """What is missing on the chair, and what was recorded wrongly, as one clause."""
    lacks = " and ".join(effect_words(e) for e in effects if e.of_chair)
    chair = [f"the model of the chair lacks {lacks}"] if lacks else []
    return ", and ".join(chair + [recording_words(e) for e in effects if not e.of_chair])


def recording_words(effect: NamedEffect) -> str:
    """What was recorded wrongly, as a clause: by a sensor, or of all columns of a kind."""
    if effect.channel is not None:
        return sensor_words(effect)
    return f"{effect.remark} ({bold(effect.name)})"


def sensor_words(effect: NamedEffect) -> str:
    """What a sensor at fault shows, as a clause."""
    number = next(iter(effect.parameters.values()))
    if effect.name == "sensor_delay":
        late = number.value >= 0.0
        shows = f"comes {size(abs(number.value))} s {'late' if late else 'early'}"
    else:
        much = "much" if number.value > 0.0 else "little"
        by = (
            f"{size(100.0 * abs(number.value))} %"
            if effect.name == "sensor_scale"
            else with_unit(size(abs(number.value)), number.unit)
        )
        shows = f"shows {by} too {much}"
    what = ", ".join(_parameters(effect))
    return f"the sensor of {effect.channel} {shows} ({bold(effect.name)}: {what})"


def _capital(text: str) -> str:
    """The text as the beginning of a sentence."""
    return text[:1].upper() + text[1:]


def settled(diagnosis: Diagnosis) -> list[NamedEffect]:
    """Effects that are in most explanations, and for which no other can stand."""
    open_ones = {n for s in diagnosis.alternatives for names in s for n in names.split("+")}
    return [
        e
        for e in diagnosis.effects
        if e.key not in open_ones and of_effects(diagnosis.probability, [e.key]) >= LIKELY
    ]


def nothing_missing(diagnosis: Diagnosis) -> str:
    """That nothing is missing, or nothing that matters, with the number."""
    gap, material = diagnosis.gap, diagnosis.material
    far = ", if chair and sensors are as far from what the study says as these runs put them"
    far = far if diagnosis.next_experiment else ""
    if gap is None or gap.p_value >= LEVEL or material is None:
        return f"Nothing{far}: the chair explains these runs as well as the noise in them allows."
    if material.value >= material.limit:
        return (
            f"Nothing that matters{far}: single tests stand out that no effect explains, but all "
            f"that is left together is no more than noise{_held_out_left(gap)}."
        )
    return (
        f"Nothing that matters{far}: more than noise is left, but no missing force is larger than "
        f"{material.value:.2g} N, and below {material.limit:.2g} N none matters, whatever makes it."
    )


def _held_out_left(gap: GapSummary) -> str:
    """What the chair leaves on held-out runs, where that is more than in those of the fit."""
    if not gap.held_out or gap.before < NOTED:
        return ""
    return f" in the runs of the fit ({size(gap.before)} times the noise in those held out)"


def turn_words(diagnosis: Diagnosis) -> str:
    """What comes once a turn of a wheel and counts as noise; nothing where it is small."""
    limit = diagnosis.material.limit if diagnosis.material else 0.0
    return "".join(
        f" A force of about {size(force.value)} {force.unit} comes {when} and counts as noise: "
        "a bent rim, a wheel out of round or an encoder's error makes one."
        for when, force in _clear_turns(diagnosis).values()
        if force.value > limit
    )


def shaken_words(diagnosis: Diagnosis) -> str:
    """That a run is shaken far harder than another of its kind; nothing where none is."""
    shaken = diagnosis.shaken
    if shaken is None:
        return ""
    return (
        f" But {shaken.trial} is shaken far harder than {shaken.other}, by {size(shaken.force)} N "
        f"against {size(shaken.least)} N, which counts as noise: what comes and goes, such as a "
        "brake that rubs, may hide there."
    )


def remainder_words(diagnosis: Diagnosis) -> str:
    """What a name leaves, before the name; nothing where nothing is left."""
    if not diagnosis.more_missing:
        return ""
    closed = max((e.closure for e in diagnosis.effects), default=0.0)
    share_closed = per_cent(closed) if closed < ALL else "nearly all"
    ends = _at_their_ends(diagnosis)
    only = f", and only with a chair at the end of what the study allows ({ends})" if ends else ""
    after = diagnosis.gap.after if diagnosis.gap else None
    left = ""
    if not ends or after is None or after > 1.0:
        known = known_drivers(diagnosis)
        goes = str(known[0].goes_with) if known else ""
        left = f"; what is left goes with {goes}" if goes else "; a remainder is left"
    return (
        f"More is missing than what is named here, which explains {share_closed} of the gap"
        f"{_held_out(diagnosis)}{only}{left}. "
    )


def _held_out(diagnosis: Diagnosis) -> str:
    """How the gap falls on runs that no fit saw; empty: there are none."""
    gap = diagnosis.gap
    if gap is None or gap.after is None or not gap.held_out:
        return ""
    if gap.before <= 1.0:
        return " in the runs of the fit (those held out show none)"
    if gap.after > STAYS * gap.before:
        return f" in the runs of the fit (those held out stay at {gap.after:.1f} times the noise)"
    fell = f"from {gap.before:.1f} to {gap.after:.1f} times the noise"
    return f" in the runs of the fit ({fell} in those held out)"


def _at_their_ends(diagnosis: Diagnosis) -> str:
    """What is only roughly known and was moved as far as is believed; empty: nothing was."""
    if diagnosis.correction is None:
        return ""
    names = bounded.at_walls(diagnosis.correction.offsets)
    return " and ".join(map(measured, names))


def process_words(diagnosis: Diagnosis) -> str:
    """What shakes the chair: the line between the gap and the noise of the sensors."""
    process = diagnosis.process
    if not process:
        return ""
    names = {"drive": "forward", "side": "sideways", "yaw": "about the vertical"}
    names |= {name: when for name, (when, _) in _clear_turns(diagnosis).items()}
    loudest = max(e.value for name, e in process.items() if name in names)
    levels = ", ".join(
        f"{with_unit(size(e.value) if e.value > FAINT * loudest else '0', e.unit)} {names[name]}"
        for name, e in process.items()
        if name in names
    )
    return (
        "Between the gap and the noise of the sensors stands what shakes the chair and repeats in "
        f"no run (joints of the floor, spokes, breathing): {levels}, as these runs show it. "
        f"{_person_words(diagnosis)}A gap is what stands out of both."
    )


def _clear_turns(diagnosis: Diagnosis) -> dict[str, tuple[str, Estimate]]:
    """When and how large a force once a turn is that stands out of what shakes the chair."""
    process = diagnosis.process
    return {
        name: (when, process[name])
        for name, when in TURNS.items()
        if name in process and process[name].value > CLEAR * process["drive"].value
    }


def _person_words(diagnosis: Diagnosis) -> str:
    """How much of a moving person's force is in no model; nothing where that is too little."""
    left = diagnosis.process.get("person")
    if left is None or left.value < LITTLE:
        return ""
    return (
        f"To that comes {share(left.value)} of the force by which the person moves: no sensor "
        "shows this part, and it differs from stroke to stroke. "
    )


def sure(diagnosis: Diagnosis) -> str:
    """How sure that is, in one sentence."""
    if diagnosis.probability:
        return _probabilities(diagnosis)
    gap = diagnosis.gap
    if gap is None:
        return "Nothing was tested."
    where = "On held-out runs" if gap.held_out else "On the runs of the fit"
    before = f"what the chair leaves is {size(gap.before)} times the noise"
    if diagnosis.verdict == Verdict.NONE:
        return (
            f"{where} {before}, and noise alone leaves as much in {share(gap.p_value)} of studies."
        )
    if diagnosis.verdict == Verdict.UNKNOWN:
        return (
            f"That something is missing is certain: {before}, and chance alone would show such a "
            f"gap with {chance(gap.p_value)}."
        )
    after = f", and {size(gap.after)} times the noise when corrected" if gap.after else ""
    return f"{where} {before} as it was{after}."


def _probabilities(diagnosis: Diagnosis) -> str:
    every = explanations(diagnosis)
    said = ", ".join(_stated(e) for e in every[:3] if e.alone + e.more >= UNSURE)
    if diagnosis.verdict == Verdict.NONE and every[0].name != NONE:
        return f"What makes the rest, which does not matter, is open: {said}."
    return f"Probability: {said}."


def _stated(explanation: Explanation) -> str:
    alone, more = explanation.alone, explanation.more
    words = hypothesis_words(explanation.name)
    if explanation.more < UNSURE:
        return f"{probable(alone)} {words}"
    return f"{probable(alone + more)} {words} ({probable(alone)} with nothing more)"


class Explanation(NamedTuple):
    """An explanation of a study: keys joined by "+", none, or outside.

    Attributes:
      alone: its probability. more: of those that hold it and more, where it is named.
      named: whether it is what the diagnosis names.
    """

    name: str
    alone: float
    more: float
    named: bool


def explanations(diagnosis: Diagnosis) -> list[Explanation]:
    """What may explain a study, most probable first.

    Explanations that hold the named effects and more count as one with the named effects.
    """
    keys = {e.key for e in diagnosis.effects}
    named, more, out = "+".join(sorted(keys)), 0.0, []
    for name, p in diagnosis.probability.items():
        if keys and keys < set(name.split("+")):
            more += p
        elif name != named:
            out.append(Explanation(name, p, 0.0, named=False))
    if keys:
        alone = diagnosis.probability.get(named, 0.0)
        out.append(Explanation(named, alone, more, named=True))
    return sorted(out, key=lambda e: -(e.alone + e.more))


def hypothesis_words(name: str) -> str:
    """A hypothesis of `probability` in words."""
    known = {
        NONE: "nothing missing",
        OUTSIDE: "something outside the library",
        ONE_RUN: "an effect in one run alone",
    }
    return known.get(name, " and ".join(plain(n) for n in name.split("+")))


def next_step(diagnosis: Diagnosis) -> str:
    """What to do next, in one sentence."""
    if not diagnosis.next_experiment:
        if diagnosis.verdict == Verdict.NONE:
            if diagnosis.shaken is not None:
                return f"Look at what was different in {diagnosis.shaken.trial}, and repeat it."
            return "Nothing is needed; use the chair as it is."
        if diagnosis.effects and not any(e.of_chair for e in diagnosis.effects):
            chair = "" if diagnosis.more_missing else "; the chair lacks nothing"
            sensor = all(e.channel is not None for e in diagnosis.effects)
            wrong = "the sensor shows" if sensor else "was recorded"
            return f"These data decide: correct what {wrong}{chair}."
        if diagnosis.more_missing:
            below = "; what goes with it is listed below" if known_drivers(diagnosis) else ""
            return (
                "These data decide what is named. Use the corrected chair (model.xml), but look "
                f"for what is left{below}."
            )
        return f"These data decide; use the corrected chair (model.xml).{_moved_much(diagnosis)}"
    return first_sentence(diagnosis.next_experiment)


def _moved_much(diagnosis: Diagnosis) -> str:
    """A sentence on what the corrected chair has besides that a person should measure first."""
    moved = diagnosis.evidence.moved if diagnosis.evidence is not None else ()
    much = [m for m in moved if m.unit == "1" and m.name in MEASURED and abs(m.by * m.std) >= MUCH]
    if not much:
        return ""
    said = " and ".join(f"{measured(m.name)} by {100.0 * m.by * m.std:+.0f} %" for m in much)
    return f" These runs moved {said} besides, which they tell only roughly: measure it first."


def other_runs(diagnosis: Diagnosis) -> str:
    """On what an effect is tried that was not fitted: other runs, or parts of the only one."""
    trials = diagnosis.evidence.trials if diagnosis.evidence is not None else ()
    if sum(not t.held_out for t in trials) == 1:
        return "parts of the run that it was not fitted to"
    return "runs that it was not fitted to"


def known_drivers(diagnosis: Diagnosis) -> list[MissingForce]:
    """What the force goes with; without what turns where nothing tells how the chair turns."""
    if diagnosis.evidence is None or diagnosis.evidence.turns:
        return diagnosis.drivers
    return [
        d
        for d in diagnosis.drivers
        if d.force == Force.FORWARD and d.goes_with.quantity not in TURNING
    ]


def regime(diagnosis: Diagnosis, cell: Disagreement) -> str:
    """How the chair moved where it disagrees, as far as that is known."""
    turns = diagnosis.evidence is None or diagnosis.evidence.turns
    known = {k: v for k, v in cell.regime.items() if turns or k != "yaw_rate"}
    return "; ".join(f"{plain(k)} {v}" for k, v in known.items())


def first_sentence(text: str) -> str:
    """The text up to its first full stop that ends a sentence."""
    head, stop, _ = text.partition(". ")
    return head + "." if stop else text


def gap_words(diagnosis: Diagnosis) -> str:
    """Whether there is a gap, with the test's result."""
    p = diagnosis.gap.p_value if diagnosis.gap else 1.0
    exists = "It is more than noise."
    if diagnosis.verdict == Verdict.NONE:
        small = diagnosis.material is None or diagnosis.material.value < diagnosis.material.limit
        matters = "and too small to matter" if small else "but all that is left together is not"
        exists = "Nothing shows." if p >= LEVEL else f"It is more than noise, {matters}."
    return (
        f"All tests together: noise alone makes such a gap with {chance(p)}, at a level of "
        f"{LEVEL:g}. {exists}"
    )


def driver_words(diagnosis: Diagnosis) -> str:
    """What introduces the table of what the force goes with."""
    if known_drivers(diagnosis):
        return "What is left goes with:" if diagnosis.effects else "It goes with:"
    if diagnosis.effects:
        return "After the correction no force is left that goes with anything tested."
    return "No force that goes with anything tested stands out."


def alike_words(diagnosis: Diagnosis) -> str:
    """Which effects these data cannot tell apart."""
    if diagnosis.alternatives:
        return f"These data cannot tell {_from(_instead(diagnosis.alternatives))}."
    if diagnosis.verdict == Verdict.NAMED:
        return "All other explanations together have a probability of 5 % at most."
    return ""


def choice_words(diagnosis: Diagnosis) -> str:
    """Why this effect, or why none."""
    if diagnosis.verdict == Verdict.NONE:
        gap = diagnosis.gap
        if gap is None or gap.p_value >= LEVEL:
            return "None is named, since there is no gap to explain."
        return "None is named, since what is left does not matter (section 1)."
    if diagnosis.verdict == Verdict.NAMED:
        return (
            f"It is significant, it holds on {other_runs(diagnosis)}, it closes most of the "
            "gap, and its probability is 95 % or more."
        )
    if diagnosis.verdict == Verdict.AMBIGUOUS:
        return _open_words(diagnosis)
    rules = (
        f"None is named. An answer closes at least {per_cent(PARTLY)} of the gap and holds on "
        f"{other_runs(diagnosis)}; no effect, nor two or three together, does both. "
    )
    if diagnosis.one_run is not None:
        return f"{one_run_words(diagnosis.one_run)} Section 2 is what is known of it."
    return rules + nearest_words(diagnosis) + "Section 2 is what is known of the force."


def _open_words(diagnosis: Diagnosis) -> str:
    """Why an effect that fits is not named."""
    if diagnosis.alternatives:
        about = "It is one explanation that fits. Another of its set fits about as well."
        return about + _why_less_probable(diagnosis)
    likely = of_effects(diagnosis.probability, [e.key for e in diagnosis.effects])
    if likely < PROBABLE:
        told = min(likely, PROBABLE - 0.01)  # 94.6 % is no 95 %
        return f"It is one explanation that fits. Its probability is {probable(told)}, below 95 %."
    return (
        "It is one explanation that fits. What it leaves, or how well its numbers are known, is "
        "not enough to name it."
    )


def nearest_words(diagnosis: Diagnosis) -> str:
    """The explanation that comes nearest where none is named."""
    near = diagnosis.nearest
    if near is None:
        return ""
    names = " with ".join(plain(key) for key in near.effects)
    gap = diagnosis.gap
    held = " on the held-out ones" if gap is not None and gap.held_out else ""
    return (
        f"The nearest, {names}, closes {per_cent(near.closure)} of the gap on the runs that it "
        f"was fitted to and leaves {size(near.remainder)} times the noise{held}. "
    )


def left_words(diagnosis: Diagnosis) -> str:
    """What the tests say of what a correction leaves; nothing without one."""
    gap = diagnosis.gap
    if gap is None or gap.p_value_after is None or not diagnosis.effects:
        return ""
    by_chance = chance(gap.p_value_after)
    said = f"All tests again on what is left: noise alone makes as much with {by_chance}"
    small = gap.p_value_after < LEVEL
    return said + (", below the level: something is left." if small else ", so it is noise.")


def runs_words(diagnosis: Diagnosis) -> str:
    """Which runs are shown whole."""
    held = diagnosis.evidence and any(run.held_out for run in diagnosis.evidence.runs)
    if held:
        return "Runs that were held out of every fit."
    return "No run is held out in this study (`hold_out = true`), so these are runs of the fit."


def unforeseen_words(diagnosis: Diagnosis) -> str:
    """How much of what the chair leaves on held-out runs is a gap, the corrected one if it is.

    Nothing where it is nearly all of it, or where little is left.
    """
    gap = diagnosis.gap
    if gap is None or gap.unforeseen is None or diagnosis.verdict == Verdict.UNKNOWN:
        return ""
    left, chair = (gap.before, "chair") if gap.after is None else (gap.after, "corrected chair")
    if left < NOTABLE or gap.unforeseen > A_GAP * left:
        return ""
    return (
        f" Of the {size(left)} times the noise that the {chair} leaves on held-out runs, all but "
        f"{size(gap.unforeseen)} can come from numbers that the study knows only roughly, and that "
        "the runs of the fit hardly show."
    )


def notes(diagnosis: Diagnosis) -> list[str]:
    """What was assumed or noticed, each once."""
    said = list(dict.fromkeys(n for n in diagnosis.notes if not n.startswith("nothing in the lib")))
    if diagnosis.effects:
        said.append(
            "The corrected chair (model.xml) has the effects of section 4 in it, and what is only "
            "roughly known where the fit moved it, as the table below says."
        )
    return said


def effect_words(effect: NamedEffect) -> str:
    """Name of an effect, and its parameters or what they say together."""
    on = f" on {effect.channel}" if effect.channel else ""
    return f"{bold(effect.name)}{on} ({effect.remark or ', '.join(_parameters(effect))})"


def _parameters(effect: NamedEffect) -> Iterable[str]:
    for name, p in effect.parameters.items():
        unit = "" if p.unit == "1" else f" {p.unit}"
        size = open_upwards(p) or with_error(p.value, p.std)
        held = " (held)" if p.std is None else ""
        yield f"{plain(name)} {size}{unit}{held}"


def open_upwards(p: Estimate) -> str:
    """The least size of a number that may be far larger; empty: it is no such number."""
    return "" if p.at_least is None else f"at least {p.at_least:.2g}"


def bold(name: str) -> str:
    """A name as words, to be shown bold."""
    return f"**{plain(name)}**"


def together(names: str) -> str:
    """One of the alternatives as words, bold: an effect, several that go together, or nothing."""
    known = {ONE_RUN: "something in one run alone", EVENT: "something that happened once"}
    if names in known:
        return known[names]
    return "nothing" if names == NONE else " with ".join(map(bold, names.split("+")))


def chance(p: float) -> str:
    """A probability; below LEAST its size says nothing more."""
    return f"p = {p:.2g}" if p >= LEAST else "p < 0.000001"


def share(p: float) -> str:
    """A probability as a share of cases."""
    return per_cent(p) if p >= 0.01 else f"{100 * p:.1g} %"


def size(ratio: float) -> str:
    """A ratio with two digits."""
    return f"{ratio:.0f}" if ratio >= 10 else f"{ratio:.2g}"
