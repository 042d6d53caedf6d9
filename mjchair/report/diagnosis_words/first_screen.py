"""What a person reads first: what is missing, how sure that is, what to do next.

In: a diagnosis. Out: a few plain sentences.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from mjchair.diagnosis.explain.calibration import NONE, OUTSIDE
from mjchair.diagnosis.explain.probability import ONE_RUN, of_effects
from mjchair.diagnosis.fit import bounded
from mjchair.diagnosis.next_experiment.wording import MEASURED, measured, plain
from mjchair.diagnosis.result import Diagnosis, GapSummary, Moment, NamedEffect, Nearest, OneRun
from mjchair.diagnosis.rules import LIKELY, PROBABLE, Verdict
from mjchair.report.diagnosis_words.explanations import (
    Explanation,
    explanations,
    in_place_of,
    is_more_probable,
    more_probable,
    one_from_another,
    settled,
)
from mjchair.report.diagnosis_words.forces import clear_turns, goes_with, known_drivers
from mjchair.report.diagnosis_words.names import (
    capital,
    chance,
    effect_words,
    found_words,
    hypothesis_words,
    one_of,
    share,
    size,
    together,
)
from mjchair.units import per_cent, probable, with_unit

NOTABLE = 1.5  # times the noise: where a correction leaves more, what can explain it is said
NOTED = 1.2  # times the noise: where held-out runs leave more, and nothing is missing, it is said
A_GAP = 0.8  # of what a correction leaves: where no more than this is a gap, the rest is explained
STAYS = 0.95  # of a gap on held-out runs: a correction that leaves more does not change it
WORSE = 1.05  # of a gap on held-out runs: a correction that leaves more opens it
ALL = 0.995  # of a gap: more is not told as 100 %
MUCH = 0.15  # share by which a fit moved what a person can measure, worth a word beside a name
ALIKE = 3  # effects in one run alone that a sentence names
CLEARLY = 0.9  # probability from which rivals are said not to be ruled out, and no more
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
        return remainder_words(diagnosis) + capital(found_words(diagnosis.effects)) + "."
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
    goes = goes_with(diagnosis)
    goes = f" {capital(goes)}." if goes else ""
    if diagnosis.moment is not None:
        return _moment_words(diagnosis.moment) + goes
    first = next(iter(explanations(diagnosis)), None)
    if first is None or first.name in (NONE, OUTSIDE, ONE_RUN):
        return f"A force is missing that no effect of the library explains, so none is named.{goes}"
    return (
        f"Something is missing. Of the library {hypothesis_words(first.name)} is the most "
        f"probable, but {_why_no_answer(diagnosis.nearest, first.name)}, so nothing is named.{goes}"
    )


def _why_no_answer(near: Nearest | None, name: str) -> str:
    """Why a hypothesis is no answer, as a clause."""
    if near is None or not near.ends or "+".join(sorted(near.effects)) != name:
        return "it explains too little of these runs, or not all of them"
    ends = " and ".join(f"the {plain(number)} of {plain(effect)}" for effect, number in near.ends)
    return f"only with {ends} at the end of what is believed of it"


def _moment_words(moment: Moment) -> str:
    """What happened in one run that no other shows, as one sentence."""
    if moment.begin is None:
        return (
            f"Something happened in {moment.trial}, which is held out, that no run of the fit "
            "shows, so nothing is named."
        )
    return (
        f"Something may have happened once in {moment.trial}, between {moment.begin} and "
        f"{moment.end} s: a force that acts there alone explains these runs about as well as any "
        "effect, so nothing is named."
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
        return capital(_open(diagnosis, others or known))
    there = of_effects(diagnosis.probability, [e.key for e in known])
    surely = "" if there >= PROBABLE else f"probably ({share(there)}), "
    first = capital(f"{surely}{found_words(known)}")
    return f"{first}. Besides, {_open(diagnosis, others)}"


def _open(diagnosis: Diagnosis, effects: Sequence[NamedEffect]) -> str:
    """Effects of the correction in whose place others could stand, and these, as sentences."""
    sets = in_place_of(diagnosis.alternatives)
    has = " and ".join(map(effect_words, effects))
    chair = f"the corrected chair has {has}{_though(diagnosis)}."
    if len(sets) > 1 or len(effects) > 1:
        return f"{chair} But these runs cannot tell {one_from_another(sets)}."
    ((own, others),) = sets.items()
    likely = of_effects(diagnosis.probability, [e.key for e in effects])
    if likely >= CLEARLY:
        first = f"it is probably {together(own)} ({probable(likely)})"
        other = "that nothing stands there" if others == [NONE] else one_of(*others)
        return f"{first}, but these runs do not rule out {other}. {capital(chair)}"
    any_of = one_of(own, *others)
    return f"it is {any_of}, and these runs cannot tell which. {capital(chair)}"


def _though(diagnosis: Diagnosis) -> str:
    """That the correction has effects than which others are more probable; empty: none are."""
    found = more_probable(diagnosis)
    if found is None:
        return ""
    return f", with which it fits best, though {is_more_probable(found[0])}"


def nothing_missing(diagnosis: Diagnosis) -> str:
    """That nothing is missing, or nothing that matters, with the number."""
    gap, material = diagnosis.gap, diagnosis.material
    far = ", if chair and sensors are as far from what the study says as these runs put them"
    far = far if diagnosis.next_experiment else ""
    if gap is None or not gap.shows or material is None:
        return f"Nothing{far}: the chair explains these runs as well as the noise in them allows."
    if material.value >= material.limit:
        return (
            f"Nothing that matters{far}: single tests stand out that no effect explains, but all "
            f"that is left together is no more than noise{_held_out_left(gap)}."
        )
    where = " in the runs held out" if gap.only_held_out else ""
    return (
        f"Nothing that matters{far}: more than noise is left{where}, but no missing force is "
        f"larger than {material.value:.2g} N, and below {material.limit:.2g} N none matters, "
        "whatever makes it."
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
        for when, force in clear_turns(diagnosis).values()
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
    """What a name leaves, or what may hide, before the name; nothing where neither is so."""
    said = [*_left(diagnosis)] if diagnosis.more_missing else []
    loud = _loud(diagnosis)
    if loud and not said:
        said = ["More may be missing than what is named here."]
    return "".join(f"{sentence} " for sentence in [*said, *loud])


def _left(diagnosis: Diagnosis) -> Iterator[str]:
    """What a name leaves, as sentences."""
    closed = max((e.closure for e in diagnosis.effects), default=0.0)
    share_closed = per_cent(closed) if closed < ALL else "nearly all"
    yield (
        f"More is missing than what is named here, which explains {share_closed} of the gap"
        f"{_held_out(diagnosis)}."
    )
    ends = _at_their_ends(diagnosis)
    if ends:
        yield f"It does so only with a chair at the end of what the study allows ({ends})."
    known = known_drivers(diagnosis)
    if known:
        yield f"What is left goes with {plain(str(known[0].goes_with))}."


def _loud(diagnosis: Diagnosis) -> list[str]:
    """What shakes the chair as much as is believed of it, as a sentence; empty: nothing does."""
    levels = [diagnosis.process[name] for name in diagnosis.loud]
    if not levels:
        return []
    stands = " and ".join(with_unit(size(e.value), e.unit) for e in levels)
    return [
        f"What shakes the chair stands at {stands}, the most that is believed of it: a steady "
        "force may hide there."
    ]


def _held_out(diagnosis: Diagnosis) -> str:
    """How the gap falls on runs that no fit saw; empty: there are none."""
    gap = diagnosis.gap
    if gap is None or gap.after is None or not gap.held_out:
        return ""
    if gap.before <= 1.0:
        return " in the runs of the fit; those held out show none"
    went = f"from {gap.before:.2f} to {gap.after:.2f} times the noise"
    if gap.after > WORSE * gap.before:
        return f" in the runs of the fit; in those held out it grows {went}"
    if gap.after > STAYS * gap.before:
        return f" in the runs of the fit; those held out stay at {gap.after:.1f} times the noise"
    return f" in the runs of the fit; in those held out it falls {went}"


def _at_their_ends(diagnosis: Diagnosis) -> str:
    """What is only roughly known and was moved as far as is believed; empty: nothing was."""
    if diagnosis.correction is None:
        return ""
    names = bounded.at_walls(diagnosis.correction.offsets)
    return " and ".join(map(measured, names))


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
    leaves = diagnosis.more_missing or bool(diagnosis.loud)
    said = ", ".join(_stated(e, leaves) for e in every[:3] if e.alone + e.more >= UNSURE)
    if diagnosis.verdict == Verdict.NONE and every[0].name != NONE:
        return f"What makes the rest, which does not matter, is open: {said}."
    return f"Probability: {said}."


def _stated(explanation: Explanation, leaves: bool) -> str:
    """An explanation with its probability, and that of nothing more.

    Args:
      leaves: whether something is left: then nobody is told that there is nothing more.
    """
    alone, more = explanation.alone, explanation.more
    words = hypothesis_words(explanation.name)
    if explanation.more < UNSURE or leaves:
        return f"{probable(alone + more)} {words}"
    return f"{probable(alone + more)} {words} ({probable(alone)} with nothing more)"


def next_step(diagnosis: Diagnosis) -> str:
    """What to do next, in one sentence, after what the data ask: the notes that end with "?"."""
    asked = dict.fromkeys(note for note in diagnosis.notes if note.endswith("?"))
    return "".join(f"Answer first: {note} " for note in asked) + _then(diagnosis)


def _then(diagnosis: Diagnosis) -> str:
    """The experiment to do next, or what to do where none is needed."""
    if not diagnosis.next_experiment:
        if diagnosis.verdict == Verdict.NONE:
            if diagnosis.shaken is not None:
                return f"Look at what was different in {diagnosis.shaken.trial}, and repeat it."
            return "Nothing is needed; use the chair as it is."
        if diagnosis.verdict == Verdict.AMBIGUOUS:
            return (
                "These data do not decide, and no experiment could be planned that does: repeat "
                "the runs in which the gap is largest, and look at the notes."
            )
        if diagnosis.effects and not any(e.of_chair for e in diagnosis.effects):
            chair = "" if diagnosis.more_missing else "; the chair lacks nothing"
            sensor = all(e.channel is not None for e in diagnosis.effects)
            wrong = "the sensor shows" if sensor else "was recorded"
            return f"These data decide: correct what {wrong}{chair}."
        if diagnosis.more_missing or diagnosis.loud:
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


def first_sentence(text: str) -> str:
    """The text up to its first full stop that ends a sentence."""
    head, stop, _ = text.partition(". ")
    return head + "." if stop else text


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
