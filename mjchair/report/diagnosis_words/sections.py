"""What the sections below the first screen say: the argument for whoever wants it.

In: a diagnosis. Out: plain sentences.
"""

from __future__ import annotations

from mjchair.diagnosis.explain.probability import of_effects
from mjchair.diagnosis.next_experiment.wording import plain
from mjchair.diagnosis.result import Diagnosis
from mjchair.diagnosis.rules import LEVEL, PARTLY, PROBABLE, Verdict
from mjchair.report.diagnosis_words.explanations import (
    in_place_of,
    is_more_probable,
    more_probable,
    one_from_another,
)
from mjchair.report.diagnosis_words.first_screen import one_run_words
from mjchair.report.diagnosis_words.forces import clear_turns, known_drivers
from mjchair.report.diagnosis_words.names import capital, chance, share, size
from mjchair.units import per_cent, probable, with_unit

LITTLE = 0.01  # of a person's force: less is not told
FAINT = 1e-3  # of the loudest: less of what shakes a chair is nothing


def _why_less_probable(diagnosis: Diagnosis) -> str:
    """Why the correction has effects than which others are more probable; empty: none are."""
    found = more_probable(diagnosis)
    if found is None:
        return ""
    likely, less = (share(e.alone + e.more) for e in found)
    return (
        f" {capital(is_more_probable(found[0]))} ({likely} against {less}) though it fits less "
        "well: probability counts as well how common an effect is and how many numbers it has."
    )


def process_words(diagnosis: Diagnosis) -> str:
    """What shakes the chair: the line between the gap and the noise of the sensors."""
    process = diagnosis.process
    if not process:
        return ""
    names = {"drive": "forward", "side": "sideways", "yaw": "about the vertical"}
    names |= {name: when for name, (when, _) in clear_turns(diagnosis).items()}
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


def _person_words(diagnosis: Diagnosis) -> str:
    """How much of a moving person's force is in no model; nothing where that is too little."""
    left = diagnosis.process.get("person")
    if left is None or left.value < LITTLE:
        return ""
    return (
        f"To that comes {share(left.value)} of the force by which the person moves: no sensor "
        "shows this part, and it differs from stroke to stroke. "
    )


def other_runs(diagnosis: Diagnosis) -> str:
    """On what an effect is tried that was not fitted: other runs, or parts of the only one."""
    trials = diagnosis.evidence.trials if diagnosis.evidence is not None else ()
    if sum(not t.held_out for t in trials) == 1:
        return "parts of the run that it was not fitted to"
    return "runs that it was not fitted to"


def gap_words(diagnosis: Diagnosis) -> str:
    """Whether there is a gap, with the test's result."""
    p = diagnosis.gap.p_value if diagnosis.gap else 1.0
    return (
        f"All tests together: noise alone makes such a gap with {chance(p)}, at a level of "
        f"{LEVEL:g}. {_what_shows(diagnosis)}"
    )


def _what_shows(diagnosis: Diagnosis) -> str:
    """What the tests of a gap come to, as a sentence."""
    gap, material = diagnosis.gap, diagnosis.material
    if gap is not None and gap.only_held_out:
        return (
            "Nothing shows there, but the chair foretells the held-out runs worse than noise does."
        )
    if diagnosis.verdict != Verdict.NONE:
        return "It is more than noise."
    if gap is None or not gap.shows:
        return "Nothing shows."
    small = material is None or material.value < material.limit
    matters = "and too small to matter" if small else "but all that is left together is not"
    return f"It is more than noise, {matters}."


def driver_words(diagnosis: Diagnosis) -> str:
    """What introduces the table of what the force goes with."""
    if known_drivers(diagnosis):
        if diagnosis.verdict == Verdict.NONE:
            return "What is left, which does not matter, goes with:"
        return "What is left goes with:" if diagnosis.effects else "It goes with:"
    if diagnosis.effects:
        return "After the correction no force is left that goes with anything tested."
    return "No force that goes with anything tested stands out."


def alike_words(diagnosis: Diagnosis) -> str:
    """Which effects these data cannot tell apart."""
    if diagnosis.alternatives:
        return f"These data cannot tell {one_from_another(in_place_of(diagnosis.alternatives))}."
    if diagnosis.verdict == Verdict.NAMED:
        return "All other explanations together have a probability of 5 % at most."
    return ""


def choice_words(diagnosis: Diagnosis) -> str:
    """Why this effect, or why none."""
    if diagnosis.verdict == Verdict.NONE:
        if diagnosis.gap is None or not diagnosis.gap.shows:
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
        f"None is named. An answer closes at least {per_cent(PARTLY)} of the gap, holds on "
        f"{other_runs(diagnosis)}, and has no number at the end of what is believed of it; no "
        "effect, nor two or three together, does all of this. "
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
    said = (
        "All tests again on what is left in the runs of the fit: noise alone makes as much with "
        f"{by_chance}"
    )
    if gap.p_value_after >= LEVEL:
        return f"{said}, so it is noise."
    if gap.shows_after:
        return f"{said}, below the level: something is left."
    return f"{said}, below the level, but no single test stands out far enough to tell what."


def runs_words(diagnosis: Diagnosis) -> str:
    """Which runs are shown whole."""
    held = diagnosis.evidence and any(run.held_out for run in diagnosis.evidence.runs)
    if held:
        return "Runs that were held out of every fit."
    return "No run is held out in this study (`hold_out = true`), so these are runs of the fit."


def notes(diagnosis: Diagnosis) -> list[str]:
    """What was assumed or noticed, each once."""
    said = list(dict.fromkeys(n for n in diagnosis.notes if not n.startswith("nothing in the lib")))
    if diagnosis.effects:
        said.append(
            "The corrected chair (model.xml) has the effects of section 4 in it, and what is only "
            "roughly known where the fit moved it, as the table below says."
        )
    return said
