"""Whether anything is left that the noise does not explain.

In: a linear system and its elimination. Out: a `Gap`, with every test. Three kinds of test, each
sharp for another kind of gap: cells (slow part of one channel in one window), effects (does any
effect of the library fit), and forces (does a force that depends on anything fit, named or not).
The largest of them is held against its distribution under no gap, drawn with the correlations that
the tests have (max-T), at 1 % for the family.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from mjchair.diagnosis import rules
from mjchair.diagnosis.explain.column_ids import (
    EffectColumn,
    EffectGroup,
    ForceColumn,
    ForceGroup,
    Group,
)
from mjchair.diagnosis.fit import bounded
from mjchair.diagnosis.fit.bench import Bench
from mjchair.diagnosis.fit.bounded import Reduced
from mjchair.diagnosis.fit.column_ids import ColumnId
from mjchair.diagnosis.fit.system import System

Array = NDArray[np.float64]
DRAWS = 2000


@dataclass(frozen=True)
class Cell:
    """One channel in one window (s) of a trial."""

    channel: str
    trial: str
    first: float
    last: float


Subject = Cell | Group


@dataclass(frozen=True)
class Test:
    """One test of whether anything is left.

    Attributes:
      subject: a channel in a window, an effect, or a force with what it goes with.
      statistic: chi2, with `dof` degrees of freedom. p: of this test alone. sigmas: p as a normal
        deviate.
    """

    subject: Subject
    statistic: float
    dof: float
    p: float
    sigmas: float


@dataclass
class Gap:
    """The tests, and what they say together.

    Attributes:
      tests: largest first. p: of the family. exists: whether there is a gap worth naming.
      excess: chi2 of the slow part above what noise gives. excess_std: its standard deviation.
    """

    tests: list[Test]
    p: float
    exists: bool
    excess: float
    excess_std: float


def groups(columns: Sequence[ColumnId]) -> dict[Group, list[int]]:
    """Columns that are tested together: an effect's start, or a force with its driver."""
    out: dict[Group, list[int]] = {}
    for i, column in enumerate(columns):
        if isinstance(column, EffectColumn | ForceColumn):
            out.setdefault(column.group, []).append(i)
    return out


def whole(reduced: Reduced, which: Sequence[int]) -> tuple[float, float]:
    """Statistic and rank of columns that may depend on one another."""
    w = list(which)
    block = reduced.G[np.ix_(w, w)]
    scale = np.sqrt(np.maximum(np.diag(block), 1e-12))
    values, vectors = np.linalg.eigh(block / np.outer(scale, scale))
    keep = values > 1e-4
    along = vectors[:, keep].T @ (reduced.b[w] / scale)
    return float((along**2 / values[keep]).sum()), float(keep.sum())


def test_gap(
    bench: Bench,
    system: System,
    windows: Sequence[int],
    skip: Sequence[str] = (),
    gain: float = 0.0,
    null: Mapping[Subject, float] | None = None,
    seed: int = 0,
) -> Gap:
    """Test what is left.

    Args:
      system: with everything that is accepted eliminated. windows: that are tested.
      skip: effects that are in already.
      gain: chi2 that these bring.
      null: statistics that a chair shows which lacks nothing, by their subjects; None: only noise.
    """
    null = null or {}
    reduced = bounded.reduce(system, windows)
    tested = {
        group: which
        for group, which in groups(reduced.columns).items()
        if not (isinstance(group, EffectGroup) and group.effect in skip)
        and _visible(reduced, which)
    }
    tests = [_test(group, *whole(reduced, which), null) for group, which in tested.items()]
    family = _family(reduced, list(tested.values()), tests, seed) if tests else 1.0
    cells = _cell_tests(bench, system, windows, null)
    worst = min((t.p for t in cells), default=1.0)
    p = min(1.0, 2.0 * min(family, 1.0 - (1.0 - worst) ** max(len(cells), 1)))
    sigmas = max((t.sigmas for t in (*tests, *cells)), default=0.0)
    mine = set(windows)
    total = sum(c.total for i, c in enumerate(system.cells) if i in mine)
    dof = sum(c.total_dof for i, c in enumerate(system.cells) if i in mine)
    ordered = sorted([*tests, *cells], key=lambda t: -t.sigmas)
    exists = rules.gap_exists(p, sigmas, gain)
    return Gap(
        tests=ordered,
        p=p,
        exists=exists,
        excess=total - dof,
        excess_std=float(np.sqrt(2.0 * dof)),
    )


def forces_left(gap: Gap) -> list[tuple[ForceGroup, float]]:
    """Forces with what they go with that would close a gap, and their sigmas, strongest first."""
    return [(t.subject, t.sigmas) for t in gap.tests if isinstance(t.subject, ForceGroup)]


def _visible(reduced: Reduced, which: Sequence[int]) -> bool:
    return bool((np.diag(reduced.G)[list(which)] > 1e-6).any())


def _test(subject: Subject, statistic: float, dof: float, null: Mapping[Subject, float]) -> Test:
    """A test, once what its null shows is taken off: at most the roots of both add up."""
    if subject in null:
        both = np.sqrt(np.maximum([statistic, null[subject]], 0.0))
        statistic = max(float(both[0] - both[1]), 0.0) ** 2
    p = float(stats.chi2.sf(statistic, max(dof, 1.0)))
    sigmas = float(stats.norm.isf(max(p, 1e-300) / 2.0)) if p < 1.0 else 0.0
    if p < 1e-290:
        sigmas = float(np.sqrt(max(statistic - dof, 0.0)))
    return Test(subject, statistic, dof, p, sigmas)


def _family(
    reduced: Reduced, tested: Sequence[list[int]], tests: Sequence[Test], seed: int
) -> float:
    """p of the smallest p among the effect and force tests, from draws with their correlations."""
    rng = np.random.default_rng(seed)
    scale = np.sqrt(np.maximum(np.diag(reduced.G), 1e-12))
    values, vectors = np.linalg.eigh(reduced.G / np.outer(scale, scale))
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    draws = root @ rng.standard_normal((len(scale), DRAWS))
    least = np.ones(DRAWS)
    for which in tested:
        block = reduced.G[np.ix_(which, which)] / np.outer(scale[which], scale[which])
        w, v = np.linalg.eigh(block)
        keep = w > 1e-4
        along = v[:, keep].T @ draws[which]
        drawn = (along**2 / w[keep][:, None]).sum(axis=0)
        least = np.minimum(least, stats.chi2.sf(drawn, max(keep.sum(), 1)))
    smallest = min(t.p for t in tests)
    below = float((least <= smallest).mean())
    if below > 0.0:
        return below
    effective = np.log(0.5) / np.log1p(-float(np.median(least)))  # tests that act like this many
    return float(min(1.0 / DRAWS, effective * smallest))


def _cell_tests(
    bench: Bench, system: System, windows: Sequence[int], null: Mapping[Subject, float]
) -> list[Test]:
    out = []
    channels = bench.simulator.channels
    for i in windows:
        w = bench.simulator.windows[i]
        name = bench.simulator.study.runs[w.run].trial.name
        for k, channel in enumerate(channels):
            dof = system.cells[i].dof[k]
            if dof >= 1.0:
                cell = Cell(channel, name, w.first, w.last)
                out.append(_test(cell, system.cells[i].chi2[k], dof, null))
    return out
