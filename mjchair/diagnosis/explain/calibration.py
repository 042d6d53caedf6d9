"""Calibrated probabilities from the evidence for each hypothesis.

What it does: reads calibration.toml, which stands beside this file and was fitted to some thousand
cheap studies (benchmarks/calibration.py). What goes in: prior and evidence of every hypothesis, and
which was chosen. What comes out: a probability of each. Two steps. Differences of evidence are
divided by a temper, since no form of an effect is quite that of a real chair. Then the odds that
the chosen effects are there are replaced by how often they were there in the cheap studies at such
odds, a line that never falls (isotonic regression), with one line for choices that leave a gap and
one for those with rivals. Effects that leave no gap and have no rival are read off by the standard
errors of the least certain of them (the root of the chi2 that it brings): there the rivals are
ruled out, and how large an effect is told right from wrong as well as all odds together. What is
left of the probability goes to the other hypotheses.
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
LINES = ("effects", "rivalled", "remainder", "unchosen", NONE, OUTSIDE, "alone", "next")
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
      sigmas: standard errors away from no effect, of the least certain one: the root of the chi2
        that it brings beside the others.
    """

    name: str
    gap_left: bool = False
    rivals: bool = False
    sigmas: float = math.inf


class Line(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """How often a hypothesis was right (1) at what spoke for it.

    That is log-odds (natural logarithm) as computed, or standard errors.
    """

    values: tuple[float, ...]
    right: tuple[float, ...]

    def at(self, value: float) -> float:
        """The share that was right, between and beyond the stored points as at the next."""
        return float(np.interp(value, self.values, self.right))


class Calibration(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """The contents of calibration.toml.

    Attributes:
      made, command: date, and how it is made again. studies: cheap studies that it was fitted to.
      temper: by which differences of evidence are divided.
      effects: line of chosen effects that leave no gap and have no rival, by the standard errors of
        the least certain; all others go by odds. rivalled: of those with rivals.
      remainder: of those that leave a gap. unchosen: of the most probable effects where the search
        chose none.
      none: of nothing. alone: that no other effect is there, where the chosen effects are.
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
        there = line.at(spoken(logs, weights, chosen, about))
        others = self._against_nothing(logs, weights, about) if chosen else logs
        out = self._with(logs, about, there) | self._without(others, about, 1.0 - there)
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

    def _with(self, logs: Mapping[str, float], about: str, whole: float) -> dict[str, float]:
        """Shares of `whole` for a hypothesis alone and for those that hold it and more."""
        more = {n: v for n, v in logs.items() if n != about and holds(n, about)}
        alone = self.alone.at(logs[about] - float(logsumexp(list(more.values())))) if more else 1.0
        rest = {n: (1.0 - alone) * whole * p for n, p in _shares(more).items()}
        return {about: alone * whole} | rest

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
    logs: Mapping[str, float],
    weights: Mapping[str, Weight],
    chosen: Chosen | None,
    about: str,
) -> float:
    """What speaks for a hypothesis on its line: log-odds, or standard errors.

    A choice is held against those that were fitted: how many others a linear promise brings near
    says more of how many there are than of the choice.
    """
    if chosen is None:
        return log_odds(logs, about)
    if kind(about, chosen) == "effects":
        return chosen.sigmas
    return log_odds({n: v for n, v in logs.items() if weights[n].fitted}, about)


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


def log_odds_alone(logs: Mapping[str, float], about: str) -> float:
    """The same of a hypothesis' effects being there alone, over being there with others."""
    more = [v for n, v in logs.items() if n != about and holds(n, about)]
    return logs[about] - float(logsumexp(more)) if more else math.inf


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
