"""What a scale, a ruler or a level tells apart, where no run is needed.

In: the choice of effects, with its rivals. Out: sentences. Two things can be measured so: the size
of an effect, and a number of the chair or of a sensor that is only roughly known, where two
hypotheses need it to be different.
"""

from __future__ import annotations

from collections.abc import Sequence

from mjchair.diagnosis.explain.candidates import Start
from mjchair.diagnosis.explain.choice import Choice
from mjchair.diagnosis.explain.rivals import exchanged
from mjchair.diagnosis.fit.column_ids import ParameterId
from mjchair.diagnosis.fit.nonlinear import Fitted
from mjchair.diagnosis.next_experiment.wording import changed, measured, plain

APART = 1.5  # standard deviations between two hypotheses, from which a number is worth measuring
MOST = 3  # effects whose measurement is told
CLEAR = 2.0  # standard errors from neutral of a size that is told


def sentences(choice: Choice) -> list[str]:
    """What a person may measure without a run, and what each hypothesis says of it."""
    ways, apart = _effects(choice), _most_apart(choice)
    said = [f"Without a run: {'; or '.join(ways)}."] if ways else []
    return [*said, apart] if apart else said


def _effects(choice: Choice) -> list[str]:
    """How to measure each effect that has a rival, or else its rival, with its size."""
    ways: dict[str, str] = {}
    for without, instead, rival in exchanged(choice):
        for starts, fitted in ((without, choice.fitted), (instead, rival.fitted)):
            told = [s.effect.key for s in starts if s.effect.by_hand]
            for key in told:
                ways.setdefault(key, _way(fitted, key))
            if told:
                break  # what tells the one effect tells whether it is the other
    return [way for way in ways.values() if way][:MOST]


def _way(fitted: Fitted, key: str) -> str:
    """How to measure an effect, and what its fit says of it; empty where that is not clear."""
    (term,) = (t for t in fitted.variant.terms if t.effect.key == key)
    sizes = []
    for p in term.effect.parameters:
        std = fitted.std.get(ParameterId(key, p.name), 0.0)
        value = term.values[p.name]
        if p.sized and std and abs(value - p.neutral) > CLEAR * std:
            unit = "" if p.unit == "1" else f" {p.unit}"
            sizes.append(f"{p.name} {value:.3g} ± {std:.1g}{unit}")
    return f"{term.effect.by_hand} ({plain(key)}: {', '.join(sizes)})" if sizes else ""


def _most_apart(choice: Choice) -> str:
    """The roughly known number of which the choice and a rival say most different things.

    What an effect moves as well is no such number: the cornering stiffness that a person measures
    has the effect in it.
    """
    own = {n.name: by for n, by in choice.fitted.moved}
    far, said = APART, ""
    for without, instead, rival in exchanged(choice):
        by_effect = _moved_by_effects(choice.fitted) | _moved_by_effects(rival.fitted)
        for n, by in rival.fitted.moved:
            if n.linear or n.name in by_effect or abs(by - own.get(n.name, by)) < far:
                continue
            far = abs(by - own[n.name])
            said = (
                f"Measure {measured(n.name)}: {changed(n, own[n.name], 1)} from the chair of the "
                f"study if it is {_names(without)}, {changed(n, by, 1)} if it is {_names(instead)}."
            )
    return said


def _moved_by_effects(fitted: Fitted) -> set[str]:
    """Names of what is only roughly known and a fit's effects move as well."""
    return {name for term in fitted.variant.terms for name in term.effect.shared}


def _names(starts: Sequence[Start]) -> str:
    return " and ".join(plain(s.effect.key) for s in starts) or "nothing more"
