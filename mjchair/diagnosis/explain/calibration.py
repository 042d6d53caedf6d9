"""Calibrated probabilities from the evidence for each hypothesis.

What it does: reads calibration.toml, which stands beside this file and was fitted to some thousand
cheap studies (benchmarks/calibration.py). What goes in: prior and evidence of every hypothesis, and
which was chosen. What comes out: a probability of each. Two steps. Differences of evidence are
divided by a temper, since no form of an effect is quite that of a real chair. Then the odds that
the chosen effects are there are replaced by how often they were there in the cheap studies at such
odds, a line that never falls (isotonic regression), with one line for choices that leave a gap and
one for those with rivals. Choices that have no rival, or leave a gap, are read off by a sum of
clues instead (logistic regression, with no factor below zero): how much evidence there is, and how
far what was tried, what was not, and a force of any form are behind. What is left of the
probability goes to the other hypotheses.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import msgspec
import numpy as np
from scipy.special import logsumexp

from mjchair.diagnosis import rules
from mjchair.errors import MjchairError
from mjchair.toml_file import read_toml

NONE, OUTSIDE = "none", "outside"
UNFITTED = 0.5 * rules.RIVAL_CHI2  # logarithm by which what was not fitted is behind at least
# By which evidence against nothing is divided (assumption: what a chair is a little other in makes
# evidence for effects too, of 4 at most in the studies of the other chair that hide nothing)
AGAINST_NOTHING = 4.0
LEAST = 1e-3  # a share of what a group of hypotheses has together that is listed
LINES = ("effects", "rivalled", "remainder", "unchosen", NONE, OUTSIDE, "alone", "rest", "next")
CLUES = (
    "gained", "each_gained", "over_tried", "over_untried", "share_tried", "share_untried",
    "share_outside", "few", "prior",
)  # fmt: skip
CLEAR = 2.0  # of the evidence: what is further ahead of a choice makes it no less sure
FILE = Path(__file__).with_name("calibration.toml")


@dataclass(frozen=True)
class Weight:
    """What speaks for a hypothesis.

    Attributes:
      prior: logarithm of its probability before any data. evidence: logarithm of its evidence over
        that of nothing. fitted: whether it was fitted, or its evidence is linear algebra's promise.
    """

    prior: float
    evidence: float
    fitted: bool = False


@dataclass(frozen=True)
class Chosen:
    """The hypothesis that the search chose.

    Attributes:
      name: of it. gap_left: whether it leaves a gap. rivals: whether something could stand in it.
    """

    name: str
    gap_left: bool = False
    rivals: bool = False


class Line(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """How often a hypothesis was right (1) at what spoke for it.

    Attributes:
      values: log-odds (natural logarithm) as computed; or, where `by` is not empty, sums of clues.
      right: the share that was right. by: clue -> its factor.
    """

    values: tuple[float, ...]
    right: tuple[float, ...]
    by: dict[str, float] = {}

    def at(self, value: float) -> float:
        """The share that was right, between and beyond the stored points as at the next."""
        return float(np.interp(value, self.values, self.right))


class Calibration(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """The contents of calibration.toml.

    Attributes:
      made, command: date, and how it is made again. studies: cheap studies that it was fitted to.
      temper: by which differences of evidence are divided.
      effects: line of chosen effects that leave no gap and have no rival. rivalled: of those with
        rivals. remainder: of those that leave a gap. unchosen: of the most probable effects where
        the search chose none.
      none: of nothing. alone: that no other effect is there, where the chosen effects are and leave
        no gap. rest: the same where they leave one.
      outside: of a force outside the library, where they are not. next: of the most probable other
        hypothesis, where neither is there.
    """

    made: str
    command: str
    studies: int
    temper: float
    effects: Line
    rivalled: Line
    remainder: Line
    unchosen: Line
    none: Line
    outside: Line
    alone: Line
    rest: Line
    next: Line

    def probabilities(
        self, weights: Mapping[str, Weight], chosen: Chosen | None = None
    ) -> dict[str, float]:
        """Probability of every hypothesis by its name; they sum to 1, and tiny ones are left out.

        Args:
          weights: hypothesis -> what speaks for it.
          chosen: by the search; None: the most probable stands in for it.
        """
        logs = self.tempered(weights, chosen)
        about = chosen.name if chosen else max(logs, key=lambda n: logs[n])
        line: Line = getattr(self, kind(about, chosen))
        there = line.at(spoken(line, logs, weights, chosen, about))
        others = self._against_nothing(logs, weights, about) if chosen else logs
        more = self.rest if chosen is not None and chosen.gap_left else self.alone
        out = _with(more, logs, about, there) | self._without(others, about, 1.0 - there)
        total = sum(out.values())  # below 1 where nothing else is known
        return {n: p / total for n, p in out.items()}

    def _against_nothing(
        self, logs: Mapping[str, float], weights: Mapping[str, Weight], about: str
    ) -> dict[str, float]:
        """The same logarithms, but what speaks for the choice speaks more against nothing.

        Forms tell how alike effects are, so evidence between them is divided by the temper. That
        nothing is missing claims no form of an effect: it is held against the noise and the chair.
        """
        if NONE not in logs:
            return dict(logs)
        by = max(weights[about].evidence, 0.0) * (1.0 / AGAINST_NOTHING - 1.0 / self.temper)
        return {**logs, NONE: logs[NONE] - max(by, 0.0)}

    def _without(self, logs: Mapping[str, float], about: str, whole: float) -> dict[str, float]:
        """Shares of `whole` for hypotheses that do not hold it: outside, the next, all others."""
        others = {n: v for n, v in logs.items() if not holds(n, about)}
        out = {}
        if OUTSIDE in others:
            out[OUTSIDE] = self.outside.at(log_odds(others, OUTSIDE)) * whole
            whole -= out[OUTSIDE]
            del others[OUTSIDE]
        if len(others) > 1:
            first = max(others, key=lambda n: others[n])
            alone = others.pop(first)
            odds = alone - float(logsumexp(list(others.values())))
            out[first] = self.next.at(odds) * whole
            whole -= out[first]
        return out | {n: whole * p for n, p in _shares(others).items()}

    def tempered(
        self, weights: Mapping[str, Weight], chosen: Chosen | None = None
    ) -> dict[str, float]:
        """Logarithm of prior times tempered evidence of every hypothesis.

        None that was not fitted comes near the chosen one, since large linear promises lie: a rival
        that was near enough to be fitted has been; one that holds the choice and more has not
        brought enough to be taken.
        """
        out = {name: w.prior + w.evidence / self.temper for name, w in weights.items()}
        if chosen is None:
            return out
        roof = out[chosen.name] - UNFITTED
        return {n: v if weights[n].fitted else min(v, roof) for n, v in out.items()}


def kind(about: str, chosen: Chosen | None) -> str:
    """Which of LINES a hypothesis is read off, by its name and what the search chose."""
    if about in (NONE, OUTSIDE):
        return about
    if chosen is None:
        return "unchosen"
    if chosen.gap_left:
        return "remainder"
    return "rivalled" if chosen.rivals else "effects"


def spoken(
    line: Line,
    logs: Mapping[str, float],
    weights: Mapping[str, Weight],
    chosen: Chosen | None,
    about: str,
) -> float:
    """What speaks for a hypothesis on its line: log-odds, or a sum of clues.

    A choice is held against those that were fitted: how many others a linear promise brings near
    says more of how many there are than of the choice.
    """
    if chosen is None:
        return log_odds(logs, about)
    if line.by:
        known = clues(weights, about)
        return sum(factor * known[name] for name, factor in line.by.items())
    return log_odds({n: v for n, v in logs.items() if weights[n].fitted}, about)


def clues(weights: Mapping[str, Weight], about: str) -> dict[str, float]:
    """What tells a right choice from a wrong one; none falls as the evidence for it grows.

    Those over others are logarithms of the evidence by which these are behind, with its sign; the
    shares are of the evidence for the choice. `each_gained`: what its least certain effect brings.
    Some of the chosen effects without the others count in that alone, and not as rivals.
    """
    mine, effects = weights[about].evidence, set(about.split("+"))
    others = {n: w for n, w in weights.items() if n != NONE and not holds(n, about)}
    outside = others.pop(OUTSIDE).evidence if OUTSIDE in others else 0.0
    fewer = {n for n in others if set(n.split("+")) < effects}
    each = max((others[n].evidence for n in fewer), default=0.0)
    rivals = [w for n, w in others.items() if n not in fewer]
    tried = max((w.evidence for w in rivals if w.fitted), default=0.0)
    untried = max((w.evidence for w in rivals if not w.fitted), default=0.0)

    def share(evidence: float) -> float:
        return 1.0 - min(max(evidence, 0.0) / max(mine, 1.0), 1.0 + CLEAR)

    return {
        "gained": _log(max(mine, 0.0)),
        "each_gained": _log(mine - max(each, 0.0)),
        "over_tried": _log(mine - tried),
        "over_untried": _log(mine - untried),
        "share_tried": share(tried),
        "share_untried": share(untried),
        "share_outside": share(outside),
        "few": -float(about.count("+")),
        "prior": weights[about].prior,
    }


def _log(value: float) -> float:
    """Logarithm of 1 plus the size of a number, with its sign."""
    return math.copysign(math.log1p(abs(value)), value)


def _with(line: Line, logs: Mapping[str, float], about: str, whole: float) -> dict[str, float]:
    """Shares of `whole` for a hypothesis alone and for those that hold it and more."""
    more = {n: v for n, v in logs.items() if n != about and holds(n, about)}
    alone = line.at(logs[about] - float(logsumexp(list(more.values())))) if more else 1.0
    rest = {n: (1.0 - alone) * whole * p for n, p in _shares(more).items()}
    return {about: alone * whole} | rest


def holds(name: str, wanted: str) -> bool:
    """Whether all effects of one hypothesis are in another, by their names."""
    return set(wanted.split("+")) <= set(name.split("+"))


def log_odds(logs: Mapping[str, float], about: str) -> float:
    """Natural logarithm of the odds that the effects of a hypothesis are there, with others or not.

    Args:
      logs: hypothesis -> logarithm of its probability, up to a constant.
    """
    inside = [v for n, v in logs.items() if holds(n, about)]
    others = [v for n, v in logs.items() if not holds(n, about)]
    if not others:
        return math.inf
    return float(logsumexp(inside) - logsumexp(others))


def _shares(logs: Mapping[str, float]) -> dict[str, float]:
    """What the logarithms say of each, with a sum of 1; without those that have less than LEAST."""
    if not logs:
        return {}
    values = np.array(list(logs.values()))
    shares = np.exp(values - logsumexp(values))
    shares[shares < min(LEAST, shares.max())] = 0.0
    shares /= shares.sum()
    return {n: float(p) for n, p in zip(logs, shares, strict=True) if p or n in (NONE, OUTSIDE)}


def read(path: Path) -> Calibration:
    """A calibration.

    Raises:
      MjchairError: the file is damaged; one line with the file, the rule and what to do.
    """
    again = "install mjchair anew, or make it with benchmarks/calibration.py"
    try:
        known = read_toml(path, Calibration)
    except MjchairError as error:
        raise MjchairError(f"{error}; {again}") from None
    if not 1.0 <= known.temper < math.inf:
        raise MjchairError(f"{path}: temper {known.temper:g} must be at least 1; {again}")
    for name in LINES:
        line: Line = getattr(known, name)
        if not _monotone(line):
            raise MjchairError(
                f"{path}: {name} must have as many values as shares, each list rising, shares "
                f"between 0 and 1; {again}"
            )
        for clue, factor in line.by.items():
            if clue not in CLUES or not 0.0 <= factor < math.inf:
                raise MjchairError(
                    f"{path}: {name} has the clue {clue} = {factor:g}; it must be one of "
                    f"{', '.join(CLUES)}, at least 0; {again}"
                )
    return known


def _monotone(line: Line) -> bool:
    values, right = np.array(line.values), np.array(line.right)
    if values.size < 2 or values.size != right.size or not np.isfinite(values).all():
        return False
    rises = bool((np.diff(values) > 0.0).all() and (np.diff(right) >= 0.0).all())
    return rises and right[0] > 0.0 and right[-1] < 1.0


@cache
def shipped() -> Calibration:
    """The calibration that comes with the package."""
    return read(FILE)
