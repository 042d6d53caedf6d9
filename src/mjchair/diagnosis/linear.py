"""Windows as linear algebra: residuals and columns whitened, each window's slow state eliminated.

What is left of a window is small: the products of its columns with one another and with the
residual. Every test, fit and score after that is made of sums of those.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve, solve_triangular

from mjchair.diagnosis.chair import SLOW, STEPS
from mjchair.diagnosis.noise import Noise
from mjchair.diagnosis.shooting import Shooter, residual
from mjchair.diagnosis.tracking import Track, prior

Array = NDArray[np.float64]
BAND = 2.0  # Hz, below which a residual is looked at in cells
RIDGE = 1e-9
SEEN = 1e-4  # share of a column that must survive the elimination


@dataclass
class Cells:
    """Slow part of one window's residual, channel by channel.

    Attributes:
      chi2: (channels,), of the slow components. dof: (channels,). total: chi2 of all together.
      total_dof: its degrees of freedom. everything: chi2 and count of all samples.
    """

    chi2: Array
    dof: Array
    total: float
    total_dof: float
    everything: tuple[float, int]


@dataclass
class System:
    """Products of whitened columns, window by window.

    Attributes:
      names: of the columns. nuisance: how many of them, at the start, are nuisances with unit
        prior. G: (windows, p, p). b: (windows, p). c: (windows,) chi2 of the residual.
      cells: slow parts. run: (windows,) index of the run. back: (nuisance,) where the model
        already stands from the centre of its priors, in standard deviations.
    """

    names: list[str]
    nuisance: int
    G: Array
    b: Array
    c: Array
    cells: list[Cells]
    run: NDArray[np.int64]
    back: Array

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
    noise: dict[str, Noise],
    columns: dict[str, list[Array]],
    nuisance: int,
    whitener: Whitener | None = None,
    offsets: dict[str, float] | None = None,
) -> System:
    """Eliminate every window's slow state and form the products.

    Args:
      columns: name -> (rows, channels) a window; nuisances first, scaled by their priors.
    """
    white = whitener or Whitener(shooter, noise)
    names = list(columns)
    p = len(names)
    count = len(shooter.windows)
    G, b, c = np.zeros((count, p, p)), np.zeros((count, p)), np.zeros(count)
    cells = []
    raw = np.zeros(p)
    for i, w in enumerate(shooter.windows):
        miss = residual(shooter.measured(w), track.predicted[i], shooter.channels)
        r = white(i, np.nan_to_num(miss)[:, :, None])[:, 0]
        J = white(i, np.stack([columns[n][i] for n in names], axis=2))
        slow, precision = slow_columns(shooter, track, i)
        Z = white(i, slow)
        factor = cho_factor(Z.T @ Z + np.diag(precision + RIDGE))
        Zr, ZJ = Z.T @ r, Z.T @ J
        G[i] = J.T @ J - ZJ.T @ cho_solve(factor, ZJ)
        b[i] = J.T @ r - ZJ.T @ cho_solve(factor, Zr)
        raw += (J * J).sum(axis=0)
        c[i] = r @ r - Zr @ cho_solve(factor, Zr)
        cells.append(_cells(white.sizes(i), w.last - w.first, r, Z, factor))
    # what a free initial state takes away whole is nothing but rounding afterwards
    hidden = G.sum(axis=0).diagonal() < SEEN * raw
    hidden[:nuisance] = False
    G[:, hidden, :], G[:, :, hidden], b[:, hidden] = 0.0, 0.0, 0.0
    run = np.array([w.run for w in shooter.windows])
    back = np.array([(offsets or {}).get(n, 0.0) for n in names[:nuisance]])
    return System(names, nuisance, G, b, c, cells, run, back)


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


def _cells(
    sizes: Sequence[int], span: float, r: Array, Z: Array, factor: tuple[Array, bool]
) -> Cells:
    left = r - Z @ cho_solve(factor, Z.T @ r)
    edges = np.r_[0, np.cumsum(sizes)]
    waves = basis(sizes, span)
    u = [w.T @ left[edges[k] : edges[k + 1]] for k, w in enumerate(waves)]
    BZ = [w.T @ Z[edges[k] : edges[k + 1]] for k, w in enumerate(waves)]
    chi2, dof = np.zeros(len(sizes)), np.zeros(len(sizes))
    for k in range(len(sizes)):
        spread = np.eye(len(u[k])) - BZ[k] @ cho_solve(factor, BZ[k].T)
        chi2[k], dof[k] = _quadratic(u[k], spread)
    all_u, all_BZ = np.concatenate(u), np.vstack(BZ)
    spread = np.eye(all_u.size) - all_BZ @ cho_solve(factor, all_BZ.T)
    total, total_dof = _quadratic(all_u, spread)
    return Cells(chi2, dof, total, total_dof, (float(left @ left), int(edges[-1])))


def _quadratic(u: Array, spread: Array) -> tuple[float, float]:
    """u' spread^+ u over the directions that the elimination left, and how many there are."""
    if not u.size:
        return 0.0, 0.0
    values, vectors = np.linalg.eigh(spread)
    keep = values > 0.2
    along = vectors[:, keep].T @ u
    return float((along**2 / values[keep]).sum()), float(keep.sum())


@dataclass
class Reduced:
    """Sums over windows with the nuisances eliminated: what single effects are judged by.

    Attributes:
      G: (q, q). b: (q,). names: of the q columns.
    """

    names: list[str]
    G: Array
    b: Array

    def gain(self, which: Sequence[int]) -> float:
        """Drop of chi2 that the columns bring."""
        return float(self.b[list(which)] @ self.solve(which))

    def solve(self, which: Sequence[int]) -> Array:
        """Their coefficients."""
        w = list(which)
        block = self.G[np.ix_(w, w)]
        scale = np.sqrt(np.maximum(np.diag(block), 1e-300))
        unit = block / np.outer(scale, scale) + 1e-8 * np.eye(len(w))
        return np.asarray(np.linalg.solve(unit, self.b[w] / scale) / scale)

    def std(self, which: Sequence[int]) -> Array:
        """Standard deviations of their coefficients."""
        w = list(which)
        block = self.G[np.ix_(w, w)]
        scale = np.sqrt(np.maximum(np.diag(block), 1e-300))
        unit = block / np.outer(scale, scale) + 1e-8 * np.eye(len(w))
        return np.asarray(np.sqrt(np.diag(np.linalg.inv(unit))) / scale)


def reduce(system: System, windows: Sequence[int] | NDArray[np.int64], free: int = 0) -> Reduced:
    """Sum over the windows and eliminate the nuisances (unit prior).

    Args:
      free: how many of the nuisances, the last ones, have no prior: effects already accepted.
    """
    w = list(windows)
    n = system.nuisance
    G, b = system.G[w].sum(axis=0), system.b[w].sum(axis=0)
    b[:n] -= system.back
    precision = np.ones(n)
    if free:
        precision[n - free :] = 1e-8 * np.diag(G)[n - free : n]
    inner = cho_factor(G[:n, :n] + np.diag(precision + 1e-12))
    cross = G[:n, n:]
    return Reduced(
        system.names[n:],
        G[n:, n:] - cross.T @ cho_solve(inner, cross),
        b[n:] - cross.T @ cho_solve(inner, b[:n]),
    )


def fit(system: System, windows: Sequence[int] | NDArray[np.int64], which: Sequence[int]) -> Array:
    """Coefficients (p,) of the nuisances and of the columns `which`; zero elsewhere."""
    w, n = list(windows), system.nuisance
    use = [*range(n), *which]
    G = system.G[w].sum(axis=0)[np.ix_(use, use)]
    size = np.maximum(np.diag(G), 1e-12)
    precision = np.r_[np.ones(n), 1e-8 * size[n:]]
    b = system.b[w].sum(axis=0)[use]
    b[:n] -= system.back
    out = np.zeros(len(system.names))
    out[use] = np.linalg.solve(G + np.diag(precision), b)
    return out


def chi2(system: System, window: int, coefficients: Array) -> float:
    """Chi2 of one window with the coefficients (p,) put in."""
    return float(
        system.c[window]
        - 2.0 * system.b[window] @ coefficients
        + coefficients @ system.G[window] @ coefficients
    )
