"""How probable every explanation is: nothing, one effect, two, or something outside the library.

In: the screened columns, the fits that were made, and the gap. Out: a probability for each
hypothesis, which sum to 1. The evidence of a hypothesis is Laplace's: the chi2 that it gains, less
what its parameters could have been fitted to (the logarithm of how much narrower data make them
than they were known to be). The noise in it is the whole one, of sensors and of the process. From
evidence to probabilities it goes by a stored calibration (calibration.py).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from mjchair.diagnosis import rules
from mjchair.diagnosis.explain import calibration, hypotheses
from mjchair.diagnosis.explain.calibration import NONE, OUTSIDE, Chosen, Weight
from mjchair.diagnosis.explain.candidates import Start
from mjchair.diagnosis.explain.choice import Choice, Tried, is_there
from mjchair.diagnosis.explain.column_ids import ForceGroup
from mjchair.diagnosis.explain.gap import groups
from mjchair.diagnosis.explain.hypotheses import Hypothesis
from mjchair.diagnosis.explain.screening import Base, gain, overstated
from mjchair.diagnosis.fit.bounded import Reduced
from mjchair.diagnosis.fit.nonlinear import Fitted
from mjchair.diagnosis.replay.pulses import Force

Array = NDArray[np.float64]
ONE_RUN = "one_run"  # an effect that acts in one run alone
SIZES = 2.0  # sizes worth finding: standard deviation of a parameter before any data
SPREAD = {Force.FORWARD: 5.0, Force.YAW: 1.5}  # N, N m: the same of a force outside the library
# before any data (assumptions); what is left goes to one effect
PRIOR_ONE_RUN = 0.05  # of studies in which one run differs, over those in which none does
LARGE = 500.0  # of a logarithm of odds
PRIOR_NONE, PRIOR_TWO, PRIOR_THREE, PRIOR_OUTSIDE = 0.3, 0.2, 0.05, 0.1


def probabilities(base: Base, choice: Choice | None) -> dict[str, float]:
    """Probability of every hypothesis, largest first: keys of effects joined by "+".

    They sum to 1; tiny ones are left out.

    Raises:
      MjchairError: the stored calibration is damaged.
    """
    known = calibration.shipped().probabilities(weights(base, choice), chosen(choice))
    return dict(sorted(known.items(), key=lambda item: -item[1]))


def chosen(choice: Choice | None) -> Chosen | None:
    """What the calibration asks about a choice."""
    if choice is None:
        return None
    return Chosen(
        name=choice.hypothesis.name,
        gap_left=choice.after.exists,
        rivals=any(choice.rivals),
    )


def with_gap(probability: Mapping[str, float], p: float) -> dict[str, float]:
    """Probabilities where a gap surely shows, or none explains it: chance has no more than `p`.

    The rest of what nothing missing had goes to something outside the library.

    Args:
      probability: of hypotheses. p: of the gap, by chance alone.
    """
    chance = min(probability.get(NONE, 0.0), p)
    outside = probability.get(OUTSIDE, 0.0) + probability.get(NONE, 0.0) - chance
    out = {**probability, NONE: chance, OUTSIDE: outside}
    return dict(sorted(out.items(), key=lambda item: -item[1]))


def with_one_run(probability: Mapping[str, float], by: float, sure: bool) -> dict[str, float]:
    """Probabilities where an effect in one run alone explains more, as another hypothesis, ONE_RUN.

    Args:
      probability: of hypotheses. by: chi2, with penalties, by which it is better than the best.
      sure: whether no choice stands against it. Where one does, it is one more rival, and what
        speaks for it is divided as between all rivals.
    """
    temper = 1.0 if sure else calibration.shipped().temper
    odds = math.exp(min(0.5 * by / temper, LARGE)) * PRIOR_ONE_RUN
    out = {name: p / (1.0 + odds) for name, p in probability.items()}
    out[ONE_RUN] = odds / (1.0 + odds)
    return dict(sorted(out.items(), key=lambda item: -item[1]))


def of_effects(probability: Mapping[str, float], keys: Sequence[str]) -> float:
    """Probability that these effects are there, alone or with others."""
    wanted = set(keys)
    return sum(p for name, p in probability.items() if wanted <= set(name.split("+")))


def of_any(probability: Mapping[str, float], keys: Iterable[str]) -> float:
    """Probability that at least one of these effects is there."""
    wanted = set(keys)
    return sum(p for name, p in probability.items() if wanted & set(name.split("+")))


def shown(probability: Mapping[str, float], chosen: str) -> set[str]:
    """The hypotheses that are probable enough to stand beside the chosen one, by their names.

    Those that hold the chosen effects and more count as the choice.

    Args:
      probability: of hypotheses. chosen: name of the chosen one.
    """
    others = {n: p for n, p in probability.items() if not calibration.holds(n, chosen)}
    before = sum(probability.values()) - sum(others.values())
    out = set()
    for name, p in sorted(others.items(), key=lambda item: -item[1]):
        if rules.is_shown(p, before):
            out.add(name)
        before += p
    return out


def weights(base: Base, choice: Choice | None) -> dict[str, Weight]:
    """What speaks for every hypothesis, by its name."""
    reduced, starts = base.reduced, base.starts
    keys = {s.effect.key: s.effect.common for s in starts}
    everything = sum(keys.values())
    one = 1.0 - PRIOR_NONE - PRIOR_TWO - PRIOR_THREE - PRIOR_OUTSIDE
    out = {
        NONE: Weight(math.log(PRIOR_NONE), 0.0, True),
        OUTSIDE: Weight(math.log(PRIOR_OUTSIDE), _outside(reduced) - 0.5 * overstated(base), True),
    }
    kept, absent = _kept(base, choice), _absent(choice)

    def add(h: Hypothesis, prior: float) -> None:
        name = h.name
        if name in absent:
            return
        share = math.prod(keys[k] / everything for k in h.keys) * math.factorial(len(h.keys))
        gained = kept.get(name, h.gain - overstated(base))
        evidence = _evidence(reduced, h, gained, starts)
        if name not in out or evidence > out[name].evidence:
            out[name] = Weight(math.log(prior * share), evidence, name in kept)

    for h in hypotheses.singles(reduced, starts):
        add(h, one)
    if choice is not None:
        for h in hypotheses.pairs(reduced, starts):
            add(h, PRIOR_TWO)
        # three effects, their rivals, and what was left of them need not be among the first pairs
        for h in (choice.hypothesis, *(t.hypothesis for t in choice.tried)):
            add(h, (one, PRIOR_TWO, PRIOR_THREE)[min(len(h.starts), 3) - 1])
    return out


def _kept(base: Base, choice: Choice | None) -> dict[str, float]:
    """Chi2 that the hypotheses gain which were fitted, each by the best of its fits.

    Less what it costs that windows must begin as each of them needs it.
    """
    if choice is None:
        return {}

    def gained(fitted: Fitted) -> float:
        return gain(base, fitted) - (fitted.confined - base.plain.confined)

    fits: dict[str, float] = {}
    for tried in choice.tried:
        name, own = tried.hypothesis.name, gained(tried.fitted)
        fits[name] = max(fits.get(name, own), own)
    fits[choice.hypothesis.name] = gained(choice.fitted)
    return fits


def _absent(choice: Choice | None) -> set[str]:
    """The hypotheses whose fits all end where an effect of theirs is not there; never the choice.

    A pair may be fitted twice, and end once where its wind is still. Nor is that an explanation
    which pushes a number to its wall; but that some of the chosen effects do tells what the others
    bring.
    """
    if choice is None:
        return set()
    chosen = choice.hypothesis

    def stands(t: Tried) -> bool:
        fewer = set(t.hypothesis.keys) < set(chosen.keys)
        return is_there(t.fitted) and (fewer or not choice.is_pushed(t))

    there = {t.hypothesis.name for t in choice.tried if stands(t)}
    return {t.hypothesis.name for t in choice.tried} - there - {chosen.name}


def _evidence(reduced: Reduced, h: Hypothesis, gained: float, starts: Sequence[Start]) -> float:
    """Logarithm of the evidence over that of nothing; `gained` is chi2."""
    which = reduced.index(h.columns)
    spread = np.concatenate([_spread(s) for s in h.starts])
    inner = np.eye(len(which)) + spread[:, None] * reduced.G[np.ix_(which, which)] * spread
    size = reduced.solve(which) / spread
    looked = sum(math.log(_places(s, starts)) for s in h.starts)
    priced = 0.5 * float(np.linalg.slogdet(inner)[1]) + 0.5 * float(np.minimum(size**2, 9.0).sum())
    return 0.5 * gained - priced - looked


def _places(start: Start, starts: Sequence[Start]) -> int:
    """How many places, times or directions an effect was looked for in."""
    return len({s.group for s in starts if s.effect.key == start.effect.key})


def _spread(start: Start) -> Array:
    """Standard deviation of a start's coefficients before any data, (columns,)."""
    size = 1.0
    if start.effect.place is not None:  # its column is of a coefficient of 1
        size = next(p.change for p in start.effect.parameters if p.name == "coefficient")
    return np.full(len(start.columns), SIZES * size)


def _outside(reduced: Reduced) -> float:
    """Logarithm of the evidence of a force with any driver, over that of nothing."""
    found = []
    for group, which in groups(reduced.columns).items():
        if not isinstance(group, ForceGroup):
            continue
        G, b = reduced.G[np.ix_(which, which)], reduced.b[which]
        spread = SPREAD[group.force]
        inner = np.eye(len(which)) + spread**2 * G
        gained = spread**2 * float(b @ np.linalg.solve(inner, b))
        found.append(0.5 * gained - 0.5 * float(np.linalg.slogdet(inner)[1]))
    return float(logsumexp(found) - math.log(len(found))) if found else 0.0
