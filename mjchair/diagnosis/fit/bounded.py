"""The bounded linear fit: coefficients of a system, its nuisances between their walls.

In: a `System` and the windows that count. Out: coefficients, chi2, and `Reduced`, from which the
gain of any choice of effects follows.

Nuisances are eliminated from the sums over windows; those that would pass their wall are held on
it. What is left (`Reduced`) weighs effects by small linear algebra alone.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve, solve_triangular
from scipy.optimize import lsq_linear

from mjchair.diagnosis.fit.column_ids import ColumnId
from mjchair.diagnosis.fit.system import System

Array = NDArray[np.float64]
Windows = Sequence[int] | NDArray[np.int64]
Active = tuple[tuple[int, float], ...]
# prior standard deviations beyond which no nuisance is believed: without a wall a centre of mass
# 22 mm aside passes for a nuisance of 2 mm, at the price of a chi2 that no rival must pay
WALL = 3.0
AT_CENTRE = 1e-6  # standard deviations: a wall as near holds a nuisance where the study has it
SETTLE = 12  # rounds of finding which nuisances stand on their walls


@dataclass(kw_only=True)
class Reduced:
    """Sums over windows with the nuisances eliminated: what effects are judged by.

    Attributes:
      columns: q of them. G: (q, q). b: (q,). total: chi2 with its priors, no column put in.
      sums: what it was made of, for columns that move a nuisance onto its wall or off it.
      active: nuisances that stand on a wall, (index, side). rest: those that do not.
      centre, lean: (rest,), (rest, q): the nuisances are centre - lean @ coefficients.
    """

    columns: list[ColumnId]
    G: Array
    b: Array
    total: float
    sums: Sums
    active: Active
    rest: list[int]
    centre: Array
    lean: Array

    def index(self, columns: Sequence[ColumnId]) -> list[int]:
        """Places of columns."""
        return [self.sums.places[c] for c in columns]

    def gain(self, which: Sequence[int]) -> float:
        """Drop of chi2 that the columns bring."""
        settled, coefficients = self._settled(which)
        return self.total - settled.total + float(settled.b[list(which)] @ coefficients)

    def solve(self, which: Sequence[int]) -> Array:
        """Their coefficients."""
        return self._settled(which)[1]

    def step(self, which: Sequence[int]) -> tuple[Array, float]:
        """Coefficients (p,) of nuisances and of these columns, zero elsewhere; chi2 with priors."""
        settled, coefficients = self._settled(which)
        sums, w = self.sums, list(which)
        out = np.zeros(len(sums.b))
        out[settled.rest] = settled.centre - settled.lean[:, w] @ coefficients
        for i, side in settled.active:
            out[i] = side * sums.wall[i] - sums.back[i]
        out[sums.count + np.array(w, int)] = coefficients
        return out, settled.total - float(settled.b[w] @ coefficients)

    def narrowed(self, wall: float) -> Reduced:
        """The same with a nearer wall (standard deviations) for every nuisance."""
        walls = np.minimum(self.sums.wall, np.where(np.isfinite(self.sums.wall), wall, np.inf))
        return replace(self.sums, wall=walls, known={}).plain()

    def _settled(self, which: Sequence[int]) -> tuple[Reduced, Array]:
        """The elimination whose walls are right for these columns, and their coefficients."""
        here = self
        w = list(which)
        for _ in range(SETTLE):
            active = here._walls(w, here._alone(w))
            if active == here.active:
                return here, here._alone(w)
            here = here.sums.eliminated(active)
        here = here.sums.eliminated(here.sums.walls(w))  # rounds that go in a circle end here
        return here, here._alone(w)

    def _alone(self, w: list[int]) -> Array:
        return scaled_solve(self.G[np.ix_(w, w)], self.b[w])

    def _walls(self, w: list[int], coefficients: Array) -> Active:
        """Which nuisances stand on a wall with these columns put in."""
        sums = self.sums
        free = self.centre - self.lean[:, w] @ coefficients
        place = free + sums.back[self.rest]
        beyond = np.abs(place) > sums.wall[self.rest] + 1e-9
        if not self.active and not beyond.any():
            return ()
        held = [(self.rest[k], float(np.sign(place[k]))) for k in np.flatnonzero(beyond)]
        full = np.zeros(len(sums.b))
        full[self.rest] = free
        full[sums.count + np.array(w, int)] = coefficients
        for i, side in self.active:
            full[i] = side * sums.wall[i] - sums.back[i]
        for i, side in self.active:  # let go what would rather come back
            pull = sums.b[i] - sums.G[i] @ full - sums.precision[i] * (full[i] + sums.back[i])
            if pull * side > 0.0:
                held.append((i, side))
        return tuple(sorted(held))


@dataclass(kw_only=True)
class Sums:
    """A system summed over windows.

    Attributes:
      columns: all. count: how many are nuisances. G: (p, p). b: (p,). c: chi2.
      back: (count,) where the model stands from the centre of the priors, in standard deviations.
      precision: (count,) of the priors. wall: (count,) beyond which no nuisance is believed.
      known: eliminations that were made.
    """

    columns: list[ColumnId]
    count: int
    G: Array
    b: Array
    c: float
    back: Array
    precision: Array
    wall: Array
    known: dict[Active, Reduced] = field(default_factory=dict)

    @cached_property
    def places(self) -> dict[ColumnId, int]:
        """Places of the columns that are no nuisances, among themselves."""
        return {c: i for i, c in enumerate(self.columns[self.count :])}

    def eliminated(self, active: Active) -> Reduced:
        """The sums without nuisances; those of `active` stand on their walls."""
        if active not in self.known:
            self.known[active] = self._eliminate(active)
        return self.known[active]

    def _eliminate(self, active: Active) -> Reduced:
        n = self.count
        held = [i for i, _ in active]
        rest = [i for i in range(n) if i not in held]
        at = np.array([side * self.wall[i] for i, side in active])
        moved = at - self.back[held]
        b = self.b - self.G[:, held] @ moved
        total = self.c - 2.0 * self.b[held] @ moved + moved @ self.G[np.ix_(held, held)] @ moved
        total += self.precision[held] @ at**2 + self.precision[rest] @ self.back[rest] ** 2
        inner = self.G[np.ix_(rest, rest)] + np.diag(self.precision[rest] + 1e-12)
        known = b[rest] - self.precision[rest] * self.back[rest]
        cross = self.G[np.ix_(rest, range(n, len(b)))]
        if rest:
            factor = cho_factor(inner)
            centre, lean = cho_solve(factor, known), cho_solve(factor, cross)
        else:
            centre, lean = known, cross
        return Reduced(
            columns=self.columns[n:],
            G=self.G[n:, n:] - cross.T @ lean,
            b=b[n:] - cross.T @ centre,
            total=float(total - known @ centre),
            sums=self,
            active=active,
            rest=rest,
            centre=centre,
            lean=lean,
        )

    def walls(self, which: Sequence[int]) -> Active:
        """Which nuisances stand on a wall with columns (places among the others) put in.

        By bounded least squares, which takes longer and always ends at the least chi2.
        """
        n = self.count
        use = [*range(n), *(n + i for i in which)]
        inner = self.G[np.ix_(use, use)].copy()
        inner[range(n), range(n)] += self.precision
        aim = self.b[use]
        aim[:n] -= self.precision * self.back
        scale = np.sqrt(np.maximum(np.diag(inner), 1e-300))
        root = np.linalg.cholesky(inner / np.outer(scale, scale) + 1e-8 * np.eye(len(use)))
        low, high = np.full(len(use), -np.inf), np.full(len(use), np.inf)
        low[:n], high[:n] = -self.wall - self.back, self.wall - self.back
        found = lsq_linear(
            root.T,
            solve_triangular(root, aim / scale, lower=True),
            (low * scale, high * scale),
            method="bvls",
        )
        return tuple((i, float(side)) for i, side in enumerate(found.active_mask[:n]) if side)

    def plain(self) -> Reduced:
        """The elimination that is right where no column is put in."""
        return self.eliminated(())._settled([])[0]


def at_walls(offsets: Mapping[str, float]) -> list[str]:
    """Names of what is only roughly known and stands on its wall, pushed there by what is missing.

    Args:
      offsets: name -> by how many standard deviations it was moved.
    """
    return [name for name, by in offsets.items() if abs(by) > WALL - 1e-6]


def cost_of_holding(
    system: System, windows: Windows, which: Sequence[int], known: Collection[ColumnId]
) -> float:
    """Chi2 that is lost where nuisances stand where the study has them, all else fitted anew.

    Args:
      which: places among all columns, none of a nuisance. known: the nuisances.
    """
    places = [i - system.nuisance for i in which]
    free = reduce(system, windows)
    held = np.array([c in known for c in system.columns[: system.nuisance]])
    wall = np.where(held, AT_CENTRE, free.sums.wall)
    kept = replace(free.sums, wall=wall, known={}).plain()
    return kept.step(places)[1] - free.step(places)[1]


def scaled_solve(G: Array, b: Array) -> Array:
    """Coefficients (q,) of columns with products G (q, q) and b (q,), which may be much alike."""
    scale = np.sqrt(np.maximum(np.diag(G), 1e-300))
    unit = G / np.outer(scale, scale) + 1e-8 * np.eye(len(b))
    return np.asarray(np.linalg.solve(unit, b / scale) / scale)


_KNOWN: WeakKeyDictionary[System, dict[tuple[int, ...], Reduced]] = WeakKeyDictionary()


def reduce(system: System, windows: Windows) -> Reduced:
    """Sum over the windows and eliminate the nuisances; once for each choice of windows."""
    known = _KNOWN.setdefault(system, {})
    key = tuple(int(i) for i in windows)
    if key not in known:
        known[key] = _reduce(system, list(key))
    return known[key]


def _reduce(system: System, w: list[int]) -> Reduced:
    n, free = system.nuisance, system.free
    G, b = system.G[w].sum(axis=0), system.b[w].sum(axis=0)
    precision, wall = np.ones(n), np.full(n, WALL)
    precision[n - free :] = 1e-8 * np.maximum(np.diag(G)[n - free : n], 1e-12)
    wall[n - free :] = np.inf
    sums = Sums(
        columns=system.columns,
        count=n,
        G=G,
        b=b,
        c=float(system.c[w].sum()),
        back=system.back,
        precision=precision,
        wall=wall,
    )
    return sums.plain()


def solve(system: System, windows: Windows, which: Sequence[int]) -> tuple[Array, float]:
    """Coefficients (p,) of nuisances and of the columns `which`, zero elsewhere; chi2 with priors.

    Args:
      which: places among all columns, none of a nuisance.
    """
    return reduce(system, windows).step([i - system.nuisance for i in which])


def solve_nuisances(system: System, windows: Windows, which: Sequence[int]) -> tuple[Array, float]:
    """Coefficients (p,) of the nuisances `which` alone, all else as it is; chi2 with priors."""
    w, use = list(windows), list(which)
    G, b = system.G[w].sum(axis=0), system.b[w].sum(axis=0)
    aim = b[use] - system.back[use]
    out = np.zeros(len(system.columns))
    out[use] = np.linalg.solve(G[np.ix_(use, use)] + np.eye(len(use)), aim)
    priced = system.back[: system.nuisance - system.free]
    return out, float(system.c[w].sum() + priced @ priced - aim @ out[use])


def information(
    system: System, windows: NDArray[np.int64], use: Sequence[int] | None = None
) -> Array:
    """What data and priors say of coefficients together: their precision (p, p).

    Args:
      use: places of the columns that are asked about; None: all.
    """
    at = np.arange(len(system.columns)) if use is None else np.array(use, np.int64)
    G = system.G[np.ix_(windows, at, at)].sum(axis=0)
    size = np.maximum(np.diag(G), 1e-12)
    prior = np.where(at < system.nuisance, 1.0, 1e-8 * size)
    return np.asarray(G + np.diag(prior))


def covariance(system: System, windows: NDArray[np.int64]) -> Array:
    """Covariance (p, p) of all coefficients together."""
    full = information(system, windows)
    scale = np.sqrt(np.diag(full))
    inverse = np.linalg.inv(full / np.outer(scale, scale))
    return np.asarray(inverse / np.outer(scale, scale))


def chi2(system: System, window: int, coefficients: Array) -> float:
    """Chi2 of one window with the coefficients (p,) put in."""
    return float(
        system.c[window]
        - 2.0 * system.b[window] @ coefficients
        + coefficients @ system.G[window] @ coefficients
    )
