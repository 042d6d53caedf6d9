"""The explanations of a diagnosis as a person reads them: how probable, and what is alike.

In: a diagnosis. Out: its explanations with their probabilities, and clauses on which is more
probable and which cannot be told apart.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from mjchair.diagnosis.explain.calibration import NONE, OUTSIDE
from mjchair.diagnosis.explain.probability import ONE_RUN, of_effects
from mjchair.diagnosis.result import Diagnosis, NamedEffect
from mjchair.diagnosis.rules import LIKELY
from mjchair.report.diagnosis_words.names import hypothesis_words, one_of, share, together


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


def settled(diagnosis: Diagnosis) -> list[NamedEffect]:
    """Effects that are in most explanations, and for which no other can stand."""
    open_ones = {n for s in diagnosis.alternatives for names in s for n in names.split("+")}
    return [
        e
        for e in diagnosis.effects
        if e.key not in open_ones and of_effects(diagnosis.probability, [e.key]) >= LIKELY
    ]


def more_probable(diagnosis: Diagnosis) -> tuple[Explanation, Explanation] | None:
    """The explanation that is more probable than the correction, and this; None: none is."""
    first, *others = explanations(diagnosis)
    own = next((e for e in others if e.named), None)
    if own is None or first.name in (NONE, OUTSIDE, ONE_RUN):
        return None
    if share(first.alone + first.more) == share(own.alone + own.more):
        return None
    return first, own


def is_more_probable(explanation: Explanation) -> str:
    """That an explanation is more probable, as a clause."""
    verb = "are" if "+" in explanation.name else "is"
    return f"{hypothesis_words(explanation.name)} {verb} more probable"


def in_place_of(alternatives: Sequence[Sequence[str]]) -> dict[str, list[str]]:
    """An effect, or several together -> what could stand in its place; single effects first."""
    out: dict[str, list[str]] = {}
    for own, *others in sorted(alternatives, key=lambda names: "+" in names[0]):
        known = out.setdefault(own, [])
        known += [n for n in others if n not in known]
    return out


def one_from_another(sets: Mapping[str, Sequence[str]]) -> str:
    """What cannot be told from what, as a clause."""
    return "; nor ".join(f"{together(own)} from {one_of(*rest)}" for own, rest in sets.items())
