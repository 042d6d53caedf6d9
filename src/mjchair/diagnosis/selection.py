"""Which effects, out of all: every single one, every pair, and triples that grow from the best."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis.candidates import Start
from mjchair.diagnosis.fitting import Term
from mjchair.diagnosis.linear import Reduced

Array = NDArray[np.float64]
PENALTY = 10.0  # chi2 that a parameter must bring: log of the number of samples
SHORTLIST = 60
# a wind along an axis has nothing across it, give or take: the sign of that is no matter
AGAINST = -0.2


@dataclass(frozen=True)
class Hypothesis:
    """Effects together, as columns of the linear system.

    Attributes:
      starts: of the effects. gain: drop of chi2. score: gain less the penalty of the parameters.
    """

    starts: tuple[Start, ...]
    gain: float
    score: float

    @property
    def keys(self) -> tuple[str, ...]:
        """Keys of the effects, sorted."""
        return tuple(sorted(s.effect.key for s in self.starts))

    @property
    def columns(self) -> list[str]:
        """Names of the columns of all effects."""
        return [c for s in self.starts for c in s.columns]

    @property
    def free(self) -> int:
        """Number of free parameters."""
        return sum(len(s.free) for s in self.starts)


def weigh(reduced: Reduced, starts: Sequence[Start]) -> Hypothesis:
    """The hypothesis that these effects are there."""
    which = reduced.index([c for s in starts for c in s.columns])
    block = reduced.G[np.ix_(which, which)]
    if (np.diag(block) < 1e-8).any():
        return Hypothesis(tuple(starts), 0.0, -np.inf)
    gain = reduced.gain(which)
    free = sum(len(s.free) for s in starts)
    return Hypothesis(tuple(starts), gain, gain - PENALTY * free)


def physical(reduced: Reduced, hypothesis: Hypothesis) -> bool:
    """Whether the linear coefficients lie on the allowed side of every parameter."""
    coefficients = reduced.solve(reduced.index(hypothesis.columns))
    for start, mine in _split(hypothesis, coefficients):
        if start.effect.seeds is None and len(mine) == len(start.free):
            for c, name in zip(mine, start.free, strict=True):
                p = start.effect.parameter(name)
                if c < 0.0 and p.neutral in (p.low, p.high):
                    return False
        if start.effect.tags.get("place") and mine[0] < 0.0:
            return False
        if start.effect.name == "wind" and (mine < AGAINST).any():
            return False
    return True


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


def singles(reduced: Reduced, starts: Sequence[Start]) -> list[Hypothesis]:
    """The best hypothesis of every effect, best first."""
    best: dict[str, Hypothesis] = {}
    for start in starts:
        found = weigh(reduced, [start])
        if not np.isfinite(found.score) or not physical(reduced, found):
            continue
        key = start.effect.key
        if key not in best or found.score > best[key].score:
            best[key] = found
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
            found = weigh(reduced, chosen)
            if not np.isfinite(found.score):
                continue
            if found.keys not in best or found.score > best[found.keys].score:
                best[found.keys] = found
    ordered = sorted(best.values(), key=lambda h: -h.score)[:SHORTLIST]
    return [h for h in ordered if physical(reduced, h)]


def _options(reduced: Reduced, starts: Sequence[Start]) -> list[Start]:
    by_effect: dict[str, list[tuple[float, Start]]] = {}
    for start in starts:
        found = weigh(reduced, [start])
        if np.isfinite(found.score):
            by_effect.setdefault(start.effect.key, []).append((found.score, start))
    out = []
    for found_starts in by_effect.values():
        ranked = sorted(found_starts, key=lambda pair: -pair[0])
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
