"""How probable every explanation is: nothing, one effect, two, or something outside the library.

In: the screened columns, the fits that were made, and the gap. Out: a probability for each
hypothesis, which sum to 1. The evidence of a hypothesis is Laplace's: the chi2 that it gains, less
what its parameters could have been fitted to (the logarithm of how much narrower data make them
than they were known to be). The noise in it is the whole one, of sensors and of the process.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from mjchair.diagnosis import rules
from mjchair.diagnosis.explain import calibration, hypotheses
from mjchair.diagnosis.explain.candidates import Start
from mjchair.diagnosis.explain.choice import Choice, gain
from mjchair.diagnosis.explain.column_ids import ForceGroup
from mjchair.diagnosis.explain.gap import groups
from mjchair.diagnosis.explain.hypotheses import Hypothesis
from mjchair.diagnosis.explain.screening import Base
from mjchair.diagnosis.fit.bounded import Reduced
from mjchair.diagnosis.replay.pulses import Force

Array = NDArray[np.float64]
NONE, OUTSIDE = "none", "outside"
SIZES = 2.0  # sizes worth finding: standard deviation of a parameter before any data
SPREAD = {Force.FORWARD: 5.0, Force.YAW: 1.5}  # N, N m: the same of a force outside the library
# before any data (assumptions); what is left goes to one effect
PRIOR_NONE, PRIOR_TWO, PRIOR_OUTSIDE = 0.3, 0.2, 0.1
PRIOR_THREE = 0.05
LEAST = 1e-3  # a probability that is listed
UNFITTED = 0.5 * rules.RIVAL_CHI2  # logarithm by which what was not fitted is behind at least


def probabilities(base: Base, choice: Choice | None) -> dict[str, float]:
    """Probability of every hypothesis, largest first: keys of effects joined by "+"."""
    logs = _evidences(base, choice)
    total = logsumexp(list(logs.values()))
    known = {name: math.exp(value - total) for name, value in logs.items()}
    listed = {n: p for n, p in known.items() if p >= LEAST or n in (NONE, OUTSIDE)}
    listed[OUTSIDE] += 1.0 - sum(listed.values())
    return dict(sorted(listed.items(), key=lambda item: -item[1]))


def of_effects(probability: Mapping[str, float], keys: Sequence[str]) -> float:
    """Probability that these effects are there, alone or with others."""
    wanted = set(keys)
    return sum(p for name, p in probability.items() if wanted <= set(name.split("+")))


def _evidences(base: Base, choice: Choice | None) -> dict[str, float]:
    """Logarithm of prior times evidence of every hypothesis."""
    reduced, starts = base.reduced, base.starts
    keys = {s.effect.key: s.effect.common for s in starts}
    everything = sum(keys.values())
    one = 1.0 - PRIOR_NONE - PRIOR_TWO - PRIOR_OUTSIDE
    outside = calibration.worth(_outside(reduced))
    out = {NONE: math.log(PRIOR_NONE), OUTSIDE: math.log(PRIOR_OUTSIDE) + outside}
    kept = _kept(base, choice)

    def add(h: Hypothesis, prior: float) -> None:
        name = "+".join(h.keys)
        share = math.prod(keys[k] / everything for k in h.keys) * math.factorial(len(h.keys))
        worth = calibration.worth(_evidence(reduced, h, kept.get(name), starts))
        value = math.log(prior * share) + worth
        out[name] = max(value, out.get(name, -math.inf))

    for h in hypotheses.singles(reduced, starts):
        add(h, one)
    if choice is not None:
        for h in hypotheses.pairs(reduced, starts):
            add(h, PRIOR_TWO)
        if len(choice.hypothesis.starts) == rules.MOST:
            add(choice.hypothesis, PRIOR_THREE)
        out = _bounded_by_fit(out, choice, kept)
    return out


def _kept(base: Base, choice: Choice | None) -> dict[str, float]:
    """Chi2 that the hypotheses gain which were fitted."""
    if choice is None:
        return {}
    fits = {"+".join(choice.hypothesis.keys): gain(base, choice.fitted)}
    for group in choice.tried:
        fits["+".join(group.hypothesis.keys)] = gain(base, group.fitted)
    fits["+".join(choice.hypothesis.keys)] = gain(base, choice.fitted)
    return fits


def _bounded_by_fit(
    out: dict[str, float], choice: Choice, kept: Mapping[str, float]
) -> dict[str, float]:
    """No hypothesis that was not fitted comes near the choice: large linear promises lie.

    A rival that was near enough to be fitted has been; one that holds the choice and more has not
    brought enough to be taken.
    """
    mine = "+".join(choice.hypothesis.keys)
    roof = out.get(mine, -math.inf)
    return {
        name: value if name in kept or name in (NONE, OUTSIDE) else min(value, roof - UNFITTED)
        for name, value in out.items()
    }


def _evidence(
    reduced: Reduced, h: Hypothesis, fitted: float | None, starts: Sequence[Start]
) -> float:
    """Logarithm of the evidence over that of nothing."""
    which = reduced.index(h.columns)
    spread = np.concatenate([_spread(s) for s in h.starts])
    inner = np.eye(len(which)) + spread[:, None] * reduced.G[np.ix_(which, which)] * spread
    size = reduced.solve(which) / spread
    told = h.gain if fitted is None else fitted
    looked = sum(math.log(_places(s, starts)) for s in h.starts)
    priced = 0.5 * float(np.linalg.slogdet(inner)[1]) + 0.5 * float(np.minimum(size**2, 9.0).sum())
    return 0.5 * told - priced - looked


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
