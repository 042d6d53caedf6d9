"""Chi2 of the slow part of a window's residual, for each channel: chairs move slowly.

In: a window after elimination, and the rows of its slow cosines. Out: `Cells`, chi2 and degrees of
freedom of each channel.

Below BAND a few cosines describe the residual of a channel. Their sum of squares, compared with its
degrees of freedom, shows whether one channel of one window has more than noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from mjchair.diagnosis.fit.elimination import Eliminated

Array = NDArray[np.float64]
BAND = 2.0  # Hz, below which a residual is looked at
LEFT = 0.2  # share of a direction that the elimination must leave


@dataclass(frozen=True, kw_only=True)
class Cells:
    """Slow part of one window's residual.

    Attributes:
      chi2: (channels,), of the slow components. dof: (channels,). total: chi2 of all together.
      total_dof: its degrees of freedom.
    """

    chi2: Array
    dof: Array
    total: float
    total_dof: float


def slow_components(
    window: Eliminated, nuisances: int, rows: Sequence[NDArray[np.int64]]
) -> list[Array]:
    """Slow components of residual and nuisances, white: each channel's, then all together's.

    Args:
      nuisances: how many columns, at the start. rows: of the slow cosines of each channel.

    Returns:
      (components, 1 + nuisances) each, the residual first.
    """
    left = window.without_state(np.column_stack([window.r, window.J[:, :nuisances]]))
    every = np.concatenate(rows)
    own = window.Z[:, : window.states]
    start = cho_factor(own.T @ own + np.diag(window.precision[: window.states]))
    free, inner = _left_by(own[every], start), _left_by(window.Z[every], window.factor)
    together = np.arange(every.size)
    parts = [*np.split(together, np.cumsum([mine.size for mine in rows])[:-1]), together]
    out: list[Array] = [np.empty(0)] * len(parts)
    for size in {part.size for part in parts}:  # parts of one size are one stack of matrices
        alike = [k for k, part in enumerate(parts) if part.size == size]
        at = np.array([parts[k] for k in alike])
        square = at[:, :, None], at[:, None, :]
        shown = _against_noise(free[square], inner[square], left[every[at]])
        for k, components in zip(alike, shown, strict=True):
            out[k] = components
    return out


def _against_noise(free: Array, inner: Array, left: Array) -> list[Array]:
    """Of each of n parts the directions that a free start leaves, over the whole noise in them.

    Args:
      free, inner: (n, m, m) what a free start, and all that is eliminated, leave. left: (n, m, k).
    """
    values, along = np.linalg.eigh(free)
    kept = values > LEFT
    turned = along.transpose(0, 2, 1)
    power = turned @ inner @ along
    power[~(kept[:, :, None] & kept[:, None, :])] = 0.0  # the others stand alone
    power += np.eye(power.shape[1]) * np.where(kept, 1e-9, 1.0)[:, None, :]
    shown = np.linalg.solve(np.linalg.cholesky(power), turned @ left)
    return [part[rows] for part, rows in zip(shown, kept, strict=True)]


def _left_by(columns: Array, factor: tuple[Array, bool]) -> Array:
    """What columns (n, k), eliminated with a factor of their block, leave of n directions."""
    return np.asarray(np.eye(len(columns)) - columns @ cho_solve(factor, columns.T))


def cells(components: Sequence[Array], step: Array) -> Cells:
    """The cells of a window with the nuisances at `step` (nuisances,)."""
    left = [band[:, 0] - band[:, 1:] @ step for band in components]
    chi2 = np.array([float(u @ u) for u in left])
    dof = np.array([float(u.size) for u in left])
    return Cells(chi2=chi2[:-1], dof=dof[:-1], total=float(chi2[-1]), total_dof=float(dof[-1]))
