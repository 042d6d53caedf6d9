"""Whether an effect is of one size in all runs: a brake may rub in some of them, or floors differ.

In: the linear system around a fit. Out: for each effect, by how much chi2 falls where its size is
free in every run, and these sizes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis.explain import search_rules
from mjchair.diagnosis.fit.bench import Bench
from mjchair.diagnosis.fit.column_ids import ParameterId
from mjchair.diagnosis.fit.nonlinear import Fitted
from mjchair.diagnosis.fit.system import System
from mjchair.diagnosis.fit.variant import Term
from mjchair.effects.effect import Parameter

Array = NDArray[np.float64]
LOOSE = 10.0  # typical changes, by which a run's size may differ from the others'


@dataclass(frozen=True)
class RunSize:
    """The size of an effect in one run: name of the run, value and standard deviation, SI."""

    run: str
    value: float
    std: float


@dataclass(frozen=True)
class Uneven:
    """An effect that is not of one size.

    Attributes:
      effect: its name. parameter: of it, that differs most. least, most: where.
    """

    effect: str
    parameter: str
    least: RunSize
    most: RunSize


def uneven(bench: Bench, fitted: Fitted, brought: dict[str, float]) -> list[Uneven]:
    """The effects of a fit that differ from run to run by more than noise.

    Args:
      brought: key of every effect -> the chi2 that it brings.
    """
    out = []
    for term in fitted.variant.terms:
        sized = [(key, p) for key, p in term.parameters if p.sized and not p.each_run]
        if not sized:
            continue
        gained, free, sizes = _freed(bench, fitted.system, term, sized)
        if search_rules.differs_by_run(
            gained=gained, free=free, brought=brought.get(term.effect.key, 0.0)
        ):
            name, runs = max(sizes.items(), key=lambda item: _spread(item[1]))
            least, *_, most = sorted(runs, key=lambda size: size.value)
            out.append(Uneven(term.effect.name, name, least, most))
    return out


def _spread(sizes: Sequence[RunSize]) -> float:
    """Chi2 of sizes about their weighted mean."""
    values, weights = np.array([s.value for s in sizes]), np.array([s.std**-2 for s in sizes])
    return float(weights @ (values - weights @ values / weights.sum()) ** 2)


def _freed(
    bench: Bench, system: System, term: Term, sized: Sequence[tuple[ParameterId, Parameter]]
) -> tuple[float, int, dict[str, list[RunSize]]]:
    """Chi2 gained by sizes of their own in every run, how many these free, and the sizes."""
    runs = sorted({int(system.run[i]) for i in bench.windows})
    of_run = [[i for i in bench.windows if system.run[i] == run] for run in runs]
    G = [system.G[windows].sum(axis=0) for windows in of_run]
    b = [system.b[windows].sum(axis=0) for windows in of_run]
    p, places = len(b[0]), [system.places[key] for key, _ in sized]
    own = [(k, r) for k in places for r in range(len(runs))]
    whole = np.zeros((p + len(own),) * 2)
    whole[:p, :p] = sum(G)
    aim = np.r_[sum(b), [b[r][k] for k, r in own]]
    for j, (k, r) in enumerate(own):
        whole[:p, p + j] = whole[p + j, :p] = G[r][:, k]
        for other, (m, theirs) in enumerate(own):
            if theirs == r:
                whole[p + j, p + other] = G[r][k, m]
    known = system.nuisance - system.free
    precision = np.r_[np.ones(known), np.full(p - known, 1e-9), np.full(len(own), LOOSE**-2)]
    aim[: system.nuisance] -= precision[: system.nuisance] * system.back
    whole += np.diag(precision)
    covariance = np.linalg.inv(whole)
    best = covariance @ aim
    alike = aim[:p] @ np.linalg.solve(whole[:p, :p], aim[:p])
    sizes: dict[str, list[RunSize]] = {}
    for n, (key, parameter) in enumerate(sized):
        for r, run in enumerate(runs):
            at = [places[n], p + n * len(runs) + r]
            value = term.values[parameter.name] + parameter.change * float(best[at].sum())
            std = parameter.change * float(np.sqrt(covariance[np.ix_(at, at)].sum()))
            name = bench.simulator.study.runs[run].trial.name
            sizes.setdefault(key.parameter, []).append(RunSize(name, value, std))
    return float(aim @ best - alike), len(sized) * (len(runs) - 1), sizes
