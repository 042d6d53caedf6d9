"""Which effects, out of all: every single one, every pair, and triples that grow from the best.

In: the linear system of all columns, its nuisances eliminated, and starts of effects. Out:
hypotheses with the chi2 that they gain, best first. Nothing is simulated here.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis.explain.candidates import Start
from mjchair.diagnosis.explain.column_ids import EffectColumn
from mjchair.diagnosis.explain.search_rules import MOST, PENALTY
from mjchair.diagnosis.fit.bounded import Reduced
from mjchair.diagnosis.fit.variant import Term

Array = NDArray[np.float64]
SHORTLIST = 60
GROWN = 3  # hypotheses of one size from which those of the next are grown


@dataclass(frozen=True)
class Hypothesis:
    """Effects together, as columns of the linear system.

    Attributes:
      starts: of the effects. gain: drop of chi2. score: gain less the penalty of the parameters,
        and more for effects that are common.
    """

    starts: tuple[Start, ...]
    gain: float
    score: float

    @property
    def keys(self) -> tuple[str, ...]:
        """Keys of the effects, sorted."""
        return tuple(sorted(s.effect.key for s in self.starts))

    @property
    def name(self) -> str:
        """As probabilities name it: keys joined by "+"."""
        return "+".join(self.keys)

    @property
    def label(self) -> str:
        """Its effects, as a line for a reader names them."""
        return " and ".join(self.keys)

    @property
    def columns(self) -> list[EffectColumn]:
        """The columns of all effects."""
        return [c for s in self.starts for c in s.columns]

    @property
    def prior(self) -> float:
        """What is added to the score for effects that are common, in chi2."""
        return 2.0 * sum(math.log(s.effect.common) for s in self.starts)

    @property
    def cost(self) -> float:
        """Chi2 that the parameters cost."""
        return PENALTY * self.free

    @property
    def penalty(self) -> float:
        """Chi2 that the parameters cost, less for effects that are common."""
        return self.cost - self.prior

    @property
    def free(self) -> int:
        """Number of free parameters that must bring something; see `_counted`."""
        return sum(map(_counted, self.starts))


def weigh(reduced: Reduced, starts: Sequence[Start]) -> Hypothesis:
    """The hypothesis that these effects are there."""
    which = reduced.index([c for s in starts for c in s.columns])
    block = reduced.G[np.ix_(which, which)]
    if (np.diag(block) < 1e-8).any():
        return Hypothesis(tuple(starts), 0.0, -np.inf)
    return priced(starts, reduced.gain(which))


def priced(starts: Sequence[Start], gain: float) -> Hypothesis:
    """The hypothesis with this gain (chi2), its score less what its parameters must bring."""
    weighed = Hypothesis(tuple(starts), gain, gain)
    return replace(weighed, score=gain - weighed.cost + weighed.prior)


def _counted(start: Start) -> int:
    """Number of free parameters, but for those that only shape an effect of a usual shape.

    Where data do not tell such a number, it brings nothing and costs nothing, and where they do, it
    is told beside the size. At the price of a further number, a scrub that a single turn shows came
    behind two unequal wheels. A place or a time is looked for everywhere, and counts.
    """
    effect = start.effect
    shapes = [p for p in effect.fitted if not p.sized and p.name in start.free]
    if not shapes or effect.seeds or effect.place or effect.wave:
        return len(start.free)
    return len(start.free) - len(shapes)


def physical(reduced: Reduced, hypothesis: Hypothesis) -> bool:
    """Whether the linear coefficients lie on the allowed side of every parameter."""
    coefficients = reduced.solve(reduced.index(hypothesis.columns))
    return all(start.allows(mine) for start, mine in _split(hypothesis, coefficients))


def can_be(reduced: Reduced, hypothesis: Hypothesis) -> bool:
    """Whether no linear coefficient asks for an effect far beyond its bounds."""
    coefficients = reduced.solve(reduced.index(hypothesis.columns))
    return all(start.can_be(mine) for start, mine in _split(hypothesis, coefficients))


def _split(hypothesis: Hypothesis, coefficients: Array) -> list[tuple[Start, Array]]:
    out, at = [], 0
    for start in hypothesis.starts:
        out.append((start, coefficients[at : at + len(start.columns)]))
        at += len(start.columns)
    return out


def terms(reduced: Reduced, hypothesis: Hypothesis, share: float = 1.0) -> tuple[Term, ...]:
    """The effects with values from a share of the linear fit's coefficients."""
    coefficients = share * reduced.solve(reduced.index(hypothesis.columns))
    return tuple(start.term(mine) for start, mine in _split(hypothesis, coefficients))


def by_size(reduced: Reduced, starts: Sequence[Start]) -> Iterator[list[Hypothesis]]:
    """Hypotheses of one effect, of two, and of more that grow from these; each list best first."""
    yield singles(reduced, starts)
    here = pairs(reduced, starts)
    yield here
    for _ in range(2, MOST):
        here = grown(reduced, starts, [h.starts for h in here[:GROWN]])
        yield here


def singles(reduced: Reduced, starts: Sequence[Start]) -> list[Hypothesis]:
    """The best hypothesis of every effect, best first."""
    best: dict[str, Hypothesis] = {}
    for start in starts:
        weighed = weigh(reduced, [start])
        if not np.isfinite(weighed.score) or not physical(reduced, weighed):
            continue
        key = start.effect.key
        if key not in best or weighed.score > best[key].score:
            best[key] = weighed
    return sorted(best.values(), key=lambda h: -h.score)


def pairs(reduced: Reduced, starts: Sequence[Start]) -> list[Hypothesis]:
    """The best hypotheses of two effects, best first.

    Every effect enters with its best start alone and with its richest.
    """
    return grown(reduced, starts, [()])


def grown(
    reduced: Reduced, starts: Sequence[Start], bases: Sequence[tuple[Start, ...]]
) -> list[Hypothesis]:
    """Hypotheses with two effects (from an empty base), or one effect more than each base."""
    options = _options(reduced, starts)
    best: dict[tuple[str, ...], Hypothesis] = {}
    for base in bases:
        sets = (
            [(*base, a) for a in options]
            if base
            else [(a, b) for i, a in enumerate(options) for b in options[i + 1 :]]
        )
        for chosen in sets:
            keys = [s.effect.key for s in chosen]
            if len(set(keys)) < len(keys):
                continue
            weighed = weigh(reduced, chosen)
            if not np.isfinite(weighed.score):
                continue
            if weighed.keys not in best or weighed.score > best[weighed.keys].score:
                best[weighed.keys] = weighed
    ordered = sorted(best.values(), key=lambda h: -h.score)[:SHORTLIST]
    return [h for h in ordered if physical(reduced, h) and can_be(reduced, h)]


def _options(reduced: Reduced, starts: Sequence[Start]) -> list[Start]:
    by_effect: dict[str, list[tuple[float, Start]]] = {}
    for start in starts:
        weighed = weigh(reduced, [start])
        if np.isfinite(weighed.score):
            by_effect.setdefault(start.effect.key, []).append((weighed.score, start))
    out = []
    for scored in by_effect.values():
        ranked = sorted(scored, key=lambda pair: -pair[0])
        keep = [s for _, s in ranked[:3]]
        richest = max((s for _, s in ranked), key=lambda s: len(s.columns))
        out += [*keep, *([richest] if richest not in keep else [])]
    return out


def collinearity(reduced: Reduced, a: Hypothesis, b: Hypothesis) -> float:
    """Largest |cos| between what two hypotheses can show, 0 to 1."""
    one, two = (reduced.index(h.columns) for h in (a, b))

    def root(which: list[int]) -> Array:
        values, vectors = np.linalg.eigh(reduced.G[np.ix_(which, which)])
        keep = values > 1e-10 * values.max()
        return np.asarray(vectors[:, keep] / np.sqrt(values[keep]))

    inner = root(one).T @ reduced.G[np.ix_(one, two)] @ root(two)
    return float(min(1.0, np.linalg.svd(inner, compute_uv=False).max(initial=0.0)))
