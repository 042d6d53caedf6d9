"""Windows as linear algebra: residuals and columns whitened, each window's slow state eliminated.

What is left of a window is small: the products of its columns with one another and with the
residual. Every test, fit and score after that is made of sums of those.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve, solve_triangular

from mjchair.diagnosis.chair import SLOW, STEPS
from mjchair.diagnosis.noise import Noise
from mjchair.diagnosis.shooting import Shooter, residual
from mjchair.diagnosis.tracking import Track, prior

Array = NDArray[np.float64]
Active = tuple[tuple[int, float], ...]
BAND = 2.0  # Hz, below which a residual is looked at in cells
RIDGE = 1e-9
# prior standard deviations beyond which no nuisance is believed: without a wall a centre of mass
# 22 mm aside passes for a nuisance of 2 mm, at the price of a chi2 that no rival must pay
WALL = 3.0
SETTLE = 12  # rounds of finding which nuisances stand on their walls
SEEN = 1e-4  # share of a column that must survive the elimination


@dataclass
class Cells:
    """Slow part of one window's residual, channel by channel.

    Attributes:
      chi2: (channels,), of the slow components. dof: (channels,). total: chi2 of all together.
      total_dof: its degrees of freedom.
    """

    chi2: Array
    dof: Array
    total: float
    total_dof: float


@dataclass
class System:
    """Products of whitened columns, window by window.

    Attributes:
      names: of the columns. nuisance: how many of them, at the start, are nuisances with unit
        prior. free: how many of those, the last, are effects that are in, without prior.
      G: (windows, p, p). b: (windows, p). c: (windows,) chi2 of the residual.
      run: (windows,) index of the run. back: (nuisance,) where the model already stands from the
        centre of its priors, in standard deviations.
      cells: slow parts, with the best nuisances put in. known: sums over windows that were made.
    """

    names: list[str]
    nuisance: int
    free: int
    G: Array
    b: Array
    c: Array
    run: NDArray[np.int64]
    back: Array
    cells: list[Cells] = field(default_factory=list)
    known: dict[tuple[int, ...], Reduced] = field(default_factory=dict, init=False, repr=False)

    def index(self, names: Sequence[str]) -> list[int]:
        """Places of columns."""
        where = {n: i for i, n in enumerate(self.names)}
        return [where[n] for n in names]


class Whitener:
    """Whitens the samples of windows; factors are kept."""

    def __init__(self, shooter: Shooter, noise: dict[str, Noise]) -> None:
        """Factor the noise of every channel in every window."""
        self.shooter = shooter
        self.there: list[NDArray[np.bool_]] = []
        self.factors: list[list[Array | float]] = []
        for w in shooter.windows:
            there = ~np.isnan(shooter.measured(w))
            self.there.append(there)
            time = shooter.study.runs[w.run].trial.time[w.rows]
            self.factors.append(
                [self._factor(noise[c], time[there[:, i]]) for i, c in enumerate(shooter.channels)]
            )

    @staticmethod
    def _factor(noise: Noise, time: Array) -> Array | float:
        if noise.slow <= 0.05 * noise.white or time.size == 0:
            return noise.white
        return np.asarray(np.linalg.cholesky(noise.covariance(time)))

    def __call__(self, window: int, values: Array) -> Array:
        """Whitened samples, stacked channel by channel.

        Args:
          values: (rows, channels, k).

        Returns:
          (samples, k).
        """
        out = []
        for i, factor in enumerate(self.factors[window]):
            block = values[self.there[window][:, i], i]
            if isinstance(factor, float):
                out.append(block / factor)
            elif block.size:
                out.append(solve_triangular(factor, block, lower=True))
        return np.vstack(out)

    def sizes(self, window: int) -> list[int]:
        """Number of samples of each channel."""
        return [int(n) for n in self.there[window].sum(axis=0)]


def slow_columns(shooter: Shooter, track: Track, window: int) -> tuple[Array, Array]:
    """Columns (rows, channels, k) of what a window frees, and their prior precisions (k,)."""
    dynamic = track.slow[window]
    rows = dynamic.shape[0]
    angles = [i for i, c in enumerate(shooter.channels) if c.endswith("wheel_angle")]
    free = np.zeros((rows, len(shooter.channels), len(angles)))
    for k, i in enumerate(angles):
        free[:, i, k] = 1.0
    spread = np.r_[prior(shooter, window, track.states[window]) / STEPS, np.full(len(angles), 1e4)]
    assert dynamic.shape[2] == len(SLOW)
    return np.concatenate([dynamic, free], axis=2), 1.0 / spread**2


def build(
    shooter: Shooter,
    track: Track,
    columns: dict[str, list[Array]],
    nuisance: int,
    white: Whitener,
    windows: NDArray[np.int64],
    offsets: dict[str, float],
    free: int = 0,
) -> System:
    """Eliminate every window's slow state and form the products.

    Args:
      columns: name -> (rows, channels) a window; nuisances first, scaled by their priors.
      nuisance: how many are. windows: that are fitted to. offsets: where nuisances already are.
      free: how many of the nuisances, the last, are effects that are in.
    """
    names = list(columns)
    p = len(names)
    count = len(shooter.windows)
    G, b, c = np.zeros((count, p, p)), np.zeros((count, p)), np.zeros(count)
    bands = []
    raw = np.zeros(p)
    for i, w in enumerate(shooter.windows):
        miss = residual(shooter.measured(w), track.predicted[i], shooter.channels)
        r = white(i, np.nan_to_num(miss)[:, :, None])[:, 0]
        J = white(i, np.stack([columns[n][i] for n in names], axis=2))
        slow, precision = slow_columns(shooter, track, i)
        Z = white(i, slow)
        G[i], b[i], c[i], factor = eliminated(r, J, Z, precision)
        raw += (J * J).sum(axis=0)
        known = np.column_stack([r, J[:, :nuisance]])
        bands.append(_bands(white.sizes(i), w.last - w.first, known, Z, factor))
    # what a free initial state takes away whole is nothing but rounding afterwards
    hidden = G.sum(axis=0).diagonal() < SEEN * raw
    hidden[:nuisance] = False
    G[:, hidden, :], G[:, :, hidden], b[:, hidden] = 0.0, 0.0, 0.0
    run = np.array([w.run for w in shooter.windows])
    back = np.array([offsets.get(n, 0.0) for n in names[:nuisance]])
    system = System(names, nuisance, free, G, b, c, run, back)
    step = fit(system, windows, [])[0][:nuisance]
    system.cells = [_cells(band, step) for band in bands]
    return system


def eliminated(
    r: Array, J: Array, Z: Array, precision: Array
) -> tuple[Array, Array, float, tuple[Array, bool]]:
    """Products of one window's white columns, its slow state eliminated.

    Args:
      r: (samples,) residual. J: (samples, p) columns. Z: (samples, k) of the slow state, with
        prior precisions (k,).

    Returns:
      G (p, p), b (p,), chi2 of the residual, and the factor of the slow state's own block.
    """
    factor = cho_factor(Z.T @ Z + np.diag(precision + RIDGE))
    Zr, ZJ = Z.T @ r, Z.T @ J
    G = J.T @ J - ZJ.T @ cho_solve(factor, ZJ)
    b = J.T @ r - ZJ.T @ cho_solve(factor, Zr)
    return G, b, float(r @ r - Zr @ cho_solve(factor, Zr)), factor


def basis(sizes: Sequence[int], span: float) -> list[Array]:
    """Orthonormal cosines below BAND of each channel's samples, (n, k) each."""
    out = []
    for n in sizes:
        k = min(n, max(2, round(2.0 * span * BAND)))
        phase = np.pi * (np.arange(n)[:, None] + 0.5) * np.arange(k)[None, :] / max(n, 1)
        waves = np.cos(phase) * np.sqrt(2.0 / max(n, 1))
        if n:
            waves[:, 0] = 1.0 / np.sqrt(n)
        out.append(waves)
    return out


def _bands(
    sizes: Sequence[int], span: float, known: Array, Z: Array, factor: tuple[Array, bool]
) -> list[Array]:
    """Slow components of residual and nuisances, white: each channel's, then all together's.

    Args:
      known: (samples, 1 + nuisances), the residual first.

    Returns:
      (components, 1 + nuisances) each.
    """
    left = known - Z @ cho_solve(factor, Z.T @ known)
    edges = np.r_[0, np.cumsum(sizes)]
    waves = basis(sizes, span)
    u = [w.T @ left[edges[k] : edges[k + 1]] for k, w in enumerate(waves)]
    BZ = [w.T @ Z[edges[k] : edges[k + 1]] for k, w in enumerate(waves)]
    out = []
    for mine, theirs in [*zip(u, BZ, strict=True), (np.vstack(u), np.vstack(BZ))]:
        # over the directions that the elimination left
        values, vectors = np.linalg.eigh(np.eye(len(mine)) - theirs @ cho_solve(factor, theirs.T))
        keep = values > 0.2
        out.append(vectors[:, keep].T @ mine / np.sqrt(values[keep])[:, None])
    return out


def _cells(bands: list[Array], step: Array) -> Cells:
    left = [band[:, 0] - band[:, 1:] @ step for band in bands]
    chi2 = np.array([float(u @ u) for u in left])
    dof = np.array([float(u.size) for u in left])
    return Cells(chi2[:-1], dof[:-1], float(chi2[-1]), float(dof[-1]))


@dataclass
class Reduced:
    """Sums over windows with the nuisances eliminated: what effects are judged by.

    Attributes:
      names: of the q columns. G: (q, q). b: (q,). total: chi2 with its priors, no column put in.
      sums: what it was made of, for columns that move a nuisance onto its wall or off it.
      active: nuisances that stand on a wall, (index, side). rest: those that do not.
      centre, lean: (rest,), (rest, q): the nuisances are centre - lean @ coefficients.
    """

    names: list[str]
    G: Array
    b: Array
    total: float
    sums: Sums
    active: Active
    rest: list[int]
    centre: Array
    lean: Array

    def index(self, names: Sequence[str]) -> list[int]:
        """Places of columns."""
        return [self.sums.where[n] for n in names]

    def gain(self, which: Sequence[int]) -> float:
        """Drop of chi2 that the columns bring."""
        found, coefficients = self._settled(which)
        return self.total - found.total + float(found.b[list(which)] @ coefficients)

    def solve(self, which: Sequence[int]) -> Array:
        """Their coefficients."""
        return self._settled(which)[1]

    def _settled(self, which: Sequence[int]) -> tuple[Reduced, Array]:
        """The elimination whose walls are right for these columns, and their coefficients."""
        found = self
        w = list(which)
        for _ in range(SETTLE):
            coefficients = found._alone(w)
            active = found._walls(w, coefficients)
            if active == found.active:
                break
            found = found.sums.eliminated(active)
        return found, found._alone(w)

    def _alone(self, w: list[int]) -> Array:
        block = self.G[np.ix_(w, w)]
        scale = np.sqrt(np.maximum(np.diag(block), 1e-300))
        unit = block / np.outer(scale, scale) + 1e-8 * np.eye(len(w))
        return np.asarray(np.linalg.solve(unit, self.b[w] / scale) / scale)

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


@dataclass
class Sums:
    """A system summed over windows.

    Attributes:
      names: of all columns. count: how many are nuisances. G: (p, p). b: (p,). c: chi2.
      back: (count,) where the model stands from the centre of the priors, in standard deviations.
      precision: (count,) of the priors. wall: (count,) beyond which no nuisance is believed.
      known: eliminations that were made.
    """

    names: list[str]
    count: int
    G: Array
    b: Array
    c: float
    back: Array
    precision: Array
    wall: Array
    known: dict[Active, Reduced] = field(default_factory=dict)

    @cached_property
    def where(self) -> dict[str, int]:
        """Places of the columns that are no nuisances, among themselves."""
        return {n: i for i, n in enumerate(self.names[self.count :])}

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
            self.names[n:],
            self.G[n:, n:] - cross.T @ lean,
            b[n:] - cross.T @ centre,
            float(total - known @ centre),
            self,
            active,
            rest,
            centre,
            lean,
        )

    def plain(self) -> Reduced:
        """The elimination that is right where no column is put in."""
        return self.eliminated(())._settled([])[0]


def reduce(system: System, windows: Sequence[int] | NDArray[np.int64]) -> Reduced:
    """Sum over the windows and eliminate the nuisances; once for each choice of windows."""
    key = tuple(int(i) for i in windows)
    if key not in system.known:
        system.known[key] = _reduce(system, list(key))
    return system.known[key]


def _reduce(system: System, w: list[int]) -> Reduced:
    n, free = system.nuisance, system.free
    G, b = system.G[w].sum(axis=0), system.b[w].sum(axis=0)
    precision, wall = np.ones(n), np.full(n, WALL)
    precision[n - free :] = 1e-8 * np.maximum(np.diag(G)[n - free : n], 1e-12)
    wall[n - free :] = np.inf
    sums = Sums(system.names, n, G, b, float(system.c[w].sum()), system.back, precision, wall)
    return sums.plain()


def fit(
    system: System, windows: Sequence[int] | NDArray[np.int64], which: Sequence[int]
) -> tuple[Array, float]:
    """Coefficients (p,) of nuisances and of the columns `which`, zero elsewhere; chi2 with priors.

    Args:
      which: places among all columns, none of a nuisance.
    """
    n = system.nuisance
    plain = reduce(system, windows)
    columns = [i - n for i in which]
    found, coefficients = plain._settled(columns)
    out = np.zeros(len(system.names))
    out[found.rest] = found.centre - found.lean[:, columns] @ coefficients
    for i, side in found.active:
        out[i] = side * found.sums.wall[i] - system.back[i]
    out[list(which)] = coefficients
    return out, found.total - float(found.b[columns] @ coefficients)


def stay(
    system: System, windows: Sequence[int] | NDArray[np.int64], which: Sequence[int]
) -> tuple[Array, float]:
    """Coefficients (p,) of the nuisances `which` alone, all else as it is; chi2 with priors."""
    w, use = list(windows), list(which)
    G, b = system.G[w].sum(axis=0), system.b[w].sum(axis=0)
    aim = b[use] - system.back[use]
    out = np.zeros(len(system.names))
    out[use] = np.linalg.solve(G[np.ix_(use, use)] + np.eye(len(use)), aim)
    priced = system.back[: system.nuisance - system.free]
    return out, float(system.c[w].sum() + priced @ priced - aim @ out[use])


def information(system: System, windows: NDArray[np.int64]) -> Array:
    """What data and priors say of all coefficients together: their precision (p, p)."""
    n = system.nuisance
    G = system.G[windows].sum(axis=0)
    size = np.maximum(np.diag(G), 1e-12)
    return np.asarray(G + np.diag(np.r_[np.ones(n), 1e-8 * size[n:]]))


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
