"""Whether anything is left that the noise does not explain.

In: a linear system and its elimination. Out: a `Gap`, with every test. Three kinds of test, each
sharp for another kind of gap: cells (slow part of one channel in one window), effects (does any
effect of the library fit), and forces (does a force that depends on anything fit, named or not).
The largest of them is held against its distribution under no gap, drawn with the correlations that
the tests have (max-T), at 1 % for the family.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, ndtri

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
      only_held_out: whether it shows on held-out trials alone, of which `p` knows nothing.
      excess: chi2 of the slow part above what noise gives. excess_std: its standard deviation.
      drawn: (draws,) the least p of the effect and force tests where there is no gap.
    """

    tests: list[Test]
    p: float
    exists: bool
    excess: float
    excess_std: float
    only_held_out: bool = False
    drawn: Array = field(default_factory=lambda: np.ones(DRAWS))

    @property
    def excess_sigmas(self) -> float:
        """The excess in its standard deviations; 0 where no channel has a slow part."""
        return self.excess / self.excess_std if self.excess_std > 0.0 else 0.0


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
    seed: int = 0,
) -> Gap:
    """Test what is left.

    Args:
      system: with everything that is accepted eliminated. windows: that are tested.
      skip: effects that are in already.
      gain: chi2 that these bring.
    """
    reduced = bounded.reduce(system, windows)
    tested = _tested(reduced, skip)
    tests = [_test(group, *whole(reduced, which)) for group, which in tested.items()]
    mine = set(windows)
    total = sum(c.total for i, c in enumerate(system.cells) if i in mine)
    dof = sum(c.total_dof for i, c in enumerate(system.cells) if i in mine)
    drawn = _drawn(reduced, list(tested.values()), seed) if tests else np.ones(DRAWS)
    return _judged(
        Gap(
            tests=[*tests, *_cell_tests(bench, system, windows)],
            p=1.0,
            exists=False,
            excess=total - dof,
            excess_std=float(np.sqrt(2.0 * dof)),
            drawn=drawn,
        ),
        gain,
    )


def above(gap: Gap, null: Mapping[Subject, float], gain: float) -> Gap:
    """The gap once every test is less by what a chair shows that lacks nothing.

    Args:
      null: that chair's statistics. gain: chi2 that the effects bring which are in.
    """
    tests = [_test(t.subject, _less(t.statistic, null.get(t.subject)), t.dof) for t in gap.tests]
    return _judged(replace(gap, tests=tests), gain)


def _less(statistic: float, null: float | None) -> float:
    """A statistic without what its null shows: at most the roots of both add up."""
    if null is None:
        return statistic
    both = np.sqrt(np.maximum([statistic, null], 0.0))
    return max(float(both[0] - both[1]), 0.0) ** 2


def _judged(gap: Gap, gain: float) -> Gap:
    """The gap with what its tests say together."""
    cells = [t.p for t in gap.tests if isinstance(t.subject, Cell)]
    others = [t.p for t in gap.tests if not isinstance(t.subject, Cell)]
    family = _of_family(min(others), gap.drawn) if others else 1.0
    worst = min(cells, default=1.0)
    p = min(1.0, 2.0 * min(family, 1.0 - (1.0 - worst) ** max(len(cells), 1)))
    sigmas = max((t.sigmas for t in gap.tests), default=0.0)
    ordered = sorted(gap.tests, key=lambda t: -t.sigmas)
    return replace(gap, tests=ordered, p=p, exists=rules.gap_exists(p, sigmas, gain))


def statistics(
    bench: Bench, system: System, windows: Sequence[int], skip: Sequence[str] = ()
) -> dict[Subject, float]:
    """What every test of `test_gap` shows, chi2; the arguments are the same."""
    reduced = bounded.reduce(system, windows)
    shown: dict[Subject, float] = {
        group: whole(reduced, which)[0] for group, which in _tested(reduced, skip).items()
    }
    cells = _cell_tests(bench, system, windows)
    return shown | {t.subject: t.statistic for t in cells}


def _tested(reduced: Reduced, skip: Sequence[str]) -> dict[Group, list[int]]:
    """The groups of columns that are tested, of which the data tell anything."""
    return {
        group: which
        for group, which in groups(reduced.columns).items()
        if not (isinstance(group, EffectGroup) and group.effect in skip)
        and _visible(reduced, which)
    }


def forces_left(gap: Gap) -> list[tuple[ForceGroup, float]]:
    """Forces with what they go with that would close a gap, and their sigmas, strongest first."""
    return [(t.subject, t.sigmas) for t in gap.tests if isinstance(t.subject, ForceGroup)]


def _visible(reduced: Reduced, which: Sequence[int]) -> bool:
    return bool((np.diag(reduced.G)[list(which)] > 1e-6).any())


def _test(subject: Subject, statistic: float, dof: float) -> Test:
    p = float(chdtrc(max(dof, 1.0), statistic))
    sigmas = -float(ndtri(max(p, 1e-300) / 2.0)) if p < 1.0 else 0.0
    if p < 1e-290:
        sigmas = float(np.sqrt(max(statistic - dof, 0.0)))
    return Test(subject, statistic, dof, p, sigmas)


def _drawn(reduced: Reduced, tested: Sequence[list[int]], seed: int) -> Array:
    """The least p (draws,) among the effect and force tests, with their correlations."""
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
        least = np.minimum(least, chdtrc(max(keep.sum(), 1), drawn))
    return least


def _of_family(smallest: float, least: Array) -> float:
    """p of the smallest p of a family whose least p without a gap were drawn (draws,)."""
    below = float((least <= smallest).mean())
    if below > 0.0:
        return below
    effective = np.log(0.5) / np.log1p(-float(np.median(least)))  # tests that act like this many
    return float(min(1.0 / DRAWS, effective * smallest))


def _cell_tests(bench: Bench, system: System, windows: Sequence[int]) -> list[Test]:
    out = []
    channels = bench.simulator.channels
    for i in windows:
        w = bench.simulator.windows[i]
        name = bench.simulator.study.runs[w.run].trial.name
        for k, channel in enumerate(channels):
            dof = system.cells[i].dof[k]
            if dof >= 1.0:
                cell = Cell(channel, name, w.first, w.last)
                out.append(_test(cell, system.cells[i].chi2[k], dof))
    return out
