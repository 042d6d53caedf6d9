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
    own = window.Z[:, : window.states]
    start = cho_factor(own.T @ own + np.diag(window.precision[: window.states]))
    out = []
    for mine in [*rows, np.concatenate(rows)]:
        if not mine.size:
            out.append(np.zeros((0, 1 + nuisances)))
            continue
        # over the directions that a free start leaves, each against the whole noise in it
        free = np.eye(mine.size) - own[mine] @ cho_solve(start, own[mine].T)
        values, vectors = np.linalg.eigh(free)
        along = vectors[:, values > LEFT]
        Z = window.Z[mine]
        inner = np.eye(mine.size) - Z @ cho_solve(window.factor, Z.T)
        power, axes = np.linalg.eigh(along.T @ inner @ along)
        root = axes / np.sqrt(np.maximum(power, 1e-9))
        out.append(root.T @ (along.T @ left[mine]))
    return out


def cells(components: Sequence[Array], step: Array) -> Cells:
    """The cells of a window with the nuisances at `step` (nuisances,)."""
    left = [band[:, 0] - band[:, 1:] @ step for band in components]
    chi2 = np.array([float(u @ u) for u in left])
    dof = np.array([float(u.size) for u in left])
    return Cells(chi2=chi2[:-1], dof=dof[:-1], total=float(chi2[-1]), total_dof=float(dof[-1]))
