"""Elimination of the free first state of a window, and of the disturbances in it.

In: the white residual and columns of a window. Out: `Eliminated`, the products that later
fits need.

A window's residual r, the columns J that are asked for, and the columns Z of its own state and of
its disturbances are white. Z is fitted away under its prior; left are the products of J with itself
and with r, which are all that later fits need.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from mjchair.diagnosis.data import roughly_known
from mjchair.diagnosis.fit.process import Process
from mjchair.diagnosis.fit.whitening import Whitener
from mjchair.diagnosis.replay.chair_state import SLOW, STEPS
from mjchair.diagnosis.replay.simulator import WindowSimulator
from mjchair.diagnosis.replay.window_search import prior, zero_columns
from mjchair.diagnosis.replay.window_states import Track

Array = NDArray[np.float64]
RIDGE = 1e-9
ANY_ZERO = 1e4  # rad, prior of the zero of a wheel's angle


@dataclass(frozen=True, kw_only=True)
class Eliminated:
    """One window, its own state eliminated.

    Attributes:
      G: (p, p) products of the columns. b: (p,) with the residual. chi2: of the residual.
      r: (samples,) white residual. J: (samples, p). Z: (samples, k), the state's columns first,
        with prior precision (k,). factor: of Z's own block.
      states: how many columns of Z are the state's.
    """

    G: Array
    b: Array
    chi2: float
    r: Array
    J: Array
    Z: Array
    factor: tuple[Array, bool]
    precision: Array
    states: int

    @property
    def confined(self) -> float:
        """Twice the logarithm of how much narrower the data make what is eliminated than its prior.

        The determinant of Laplace's evidence. Casters that shimmy hang on how each window begins:
        what fits of that is a small part of what may be.
        """
        return float(2.0 * np.log(np.diag(self.factor[0])).sum() - np.log(self.precision).sum())

    def without_state(self, values: Array) -> Array:
        """White samples (samples, k), what the window's own state can show of them taken off."""
        return np.asarray(values - self.Z @ cho_solve(self.factor, self.Z.T @ values))


def eliminate(
    r: Array, J: Array, Z: Array, precision: Array, states: int | None = None
) -> Eliminated:
    """Eliminate the columns Z.

    Args:
      r: (samples,) residual. J: (samples, p) columns. Z: (samples, k) of the window's state, with
        prior precisions (k,). All are white. states: how many of Z are the state's; None: all.
    """
    factor = cho_factor(Z.T @ Z + np.diag(precision + RIDGE))
    Zr, ZJ = Z.T @ r, Z.T @ J
    return Eliminated(
        G=J.T @ J - ZJ.T @ cho_solve(factor, ZJ),
        b=J.T @ r - ZJ.T @ cho_solve(factor, Zr),
        chi2=float(r @ r - Zr @ cho_solve(factor, Zr)),
        r=r,
        J=J,
        Z=Z,
        factor=factor,
        precision=precision + RIDGE,
        states=Z.shape[1] if states is None else states,
    )


def eliminate_window(
    simulator: WindowSimulator,
    track: Track,
    whitener: Whitener,
    window: int,
    miss: Array,
    columns: Array,
    process: Process | None = None,
) -> Eliminated:
    """Whiten one window and eliminate its state, and its disturbances.

    Args:
      miss: (rows, channels) measured minus predicted, NaN where nothing was measured.
      columns: (rows, channels, p). process: what shakes the chair; None: nothing.
    """
    stacked = np.concatenate([miss[:, :, None], columns], axis=2)
    # what was not measured, or what a chair that falls over shows, tells nothing
    white = whitener(window, np.nan_to_num(stacked, copy=False, posinf=0.0, neginf=0.0))
    Z, precision, states = own_columns(simulator, track, whitener, window, process)
    return eliminate(white[:, 0], white[:, 1:], Z, precision, states)


def own_columns(
    simulator: WindowSimulator,
    track: Track,
    whitener: Whitener,
    window: int,
    process: Process | None = None,
) -> tuple[Array, Array, int]:
    """White columns (samples, k) of a window's state, and of its disturbances.

    Returns:
      The columns, their prior precisions (k,), and how many, at the start, are the state's.
    """
    free, precision = state_columns(simulator, track, window)
    Z = whitener(window, np.nan_to_num(free, posinf=0.0, neginf=0.0))
    states = Z.shape[1]
    if process is not None:
        shaken = process.white_columns(window, whitener)
        Z = np.hstack([Z, shaken])
        precision = np.r_[precision, np.ones(shaken.shape[1])]
    return Z, precision, states


def state_columns(simulator: WindowSimulator, track: Track, window: int) -> tuple[Array, Array]:
    """Columns (rows, channels, k) of what a window frees, and their prior precisions (k,).

    These are its slow state, the zeros of the wheels' angles, and what the biases of its sensors
    differ by from those of the study. A bias stays for a run, and windows are eliminated one by
    one, so each has its own, as many times larger in variance as the run has windows: the mean over
    the run is then known as well as it is.
    """
    dynamic = track.slow[window]
    assert dynamic.shape[2] == len(SLOW)
    zeros, given = zero_columns(simulator), simulator.study.nuisance
    drift = np.array([roughly_known.drift(c, given) for c in simulator.channels])
    drifting = np.eye(len(drift))[:, drift > 0.0]
    fixed = np.hstack([zeros, drifting])
    free = np.broadcast_to(fixed, (dynamic.shape[0], *fixed.shape))
    alike = sum(w.run == simulator.windows[window].run for w in simulator.windows)
    spread = np.r_[
        prior(simulator, window, track.states[window]) / STEPS,
        np.full(zeros.shape[1], ANY_ZERO),
        np.sqrt(alike) * drift[drift > 0.0],
    ]
    return np.concatenate([dynamic, free], axis=2), 1.0 / spread**2
