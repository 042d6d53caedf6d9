"""Coefficients from rig data: bounded weighted least squares with priors, from several starts.

The residuals are the forces' over their standard deviation and the parameters' over that of their
priors, so the result is the most probable one given both. Standard errors come from the curvature
there (Laplace). Where a posterior is hardly narrower than its prior, the data did not determine
the parameter, and the result says so.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import optimize, stats

from mjchair.errors import MjchairError
from mjchair.identification import causes
from mjchair.identification.causes import Verdict
from mjchair.identification.curves import Curve, Parameter, curve, driven
from mjchair.measurement.rig import RigTable
from mjchair.tire import Tire
from mjchair.tire.tire import block_forces, block_of

Array = NDArray[np.float64]

STARTS = 8
FIRST_NOISE = 0.02  # of the largest force, until the residuals tell
LEAST_NOISE = 1e-4  # of the largest force: rounding, and what the formula leaves out
UNDETERMINED = 0.5  # posterior over prior spread from which on the prior speaks too
STRONGLY = 0.95  # a correlation worth naming


@dataclass(frozen=True)
class Estimate:
    """One parameter after the fit.

    Attributes:
      parameter: what was fitted. value: of it. error: its standard error.
      determined: whether the data, rather than the prior, say so.
    """

    parameter: Parameter
    value: float
    error: float
    determined: bool


@dataclass(frozen=True)
class Fit:
    """A family fitted to a table.

    Attributes:
      curve: the family and its parameters. causes: hidden causes fitted with it.
      theta: (k,) parameters, the causes' last. covariance: (k, k), of the posterior.
      table: the data. noise: standard deviation of a force, N, median of the rows'.
      weights: (m,), standard deviation of each residual, N.
      residuals: (m,), N, measured less fitted; lateral rows first, then driven ones along.
      effective: number of parameters that the data spent. degrees: of freedom left.
      reached: part of the starts that ended in this optimum.
      objective: sum of squares over noise and priors.
    """

    curve: Curve
    causes: tuple[str, ...]
    theta: Array
    covariance: Array
    table: RigTable
    noise: float
    weights: Array
    residuals: Array
    effective: float
    degrees: float
    reached: float
    objective: float

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Those of the curve, then those of the causes."""
        return _parameters(self.curve, self.causes, self.table)

    def estimates(self) -> list[Estimate]:
        """Every parameter with its standard error, and whether the data determined it."""
        errors = np.sqrt(np.diag(self.covariance))
        return [
            Estimate(p, float(value), float(error), bool(error < UNDETERMINED * p.spread))
            for p, value, error in zip(self.parameters, self.theta, errors, strict=True)
        ]

    def correlations(self) -> Array:
        """(k, k), of the parameters."""
        errors = np.sqrt(np.diag(self.covariance))
        return np.asarray(self.covariance / np.outer(errors, errors))

    def coefficients(self) -> dict[str, tuple[float, float]]:
        """Published coefficients, each with its standard error by the delta method."""
        n = len(self.curve.parameters)
        base = self.curve.coefficients(self.theta[:n])
        names = list(base)
        slopes = np.zeros((len(names), n))
        for i, p in enumerate(self.curve.parameters):
            moved = self.theta[:n].copy()
            step = 1e-5 * p.scale
            moved[i] += step
            other = self.curve.coefficients(moved)
            slopes[:, i] = [(other[name] - base[name]) / step for name in names]
        variance = np.einsum("ij,jk,ik->i", slopes, self.covariance[:n, :n], slopes)
        return {
            name: (float(base[name]), float(np.sqrt(v)))
            for name, v in zip(names, variance, strict=True)
        }

    def lateral(self, angle: ArrayLike, load: ArrayLike) -> tuple[Array, Array]:
        """Fy (N) of the tire alone, and the half-width of its 95 % interval.

        Args:
          angle: slip angle, deg. load: N; they broadcast.
        """
        angle, load = np.broadcast_arrays(np.asarray(angle, float), np.asarray(load, float))
        n = len(self.curve.parameters)

        def force(theta: Array) -> Array:
            packed = block_of(self.curve.family, self.curve.coefficients(theta))
            return block_forces(packed, load, 0.0, np.radians(angle)).Fy.ravel()

        base = force(self.theta[:n])
        slopes = np.empty((base.size, n))
        for i, p in enumerate(self.curve.parameters):
            moved = self.theta[:n].copy()
            step = 1e-4 * p.scale
            moved[i] += step if moved[i] + step < p.high else -step
            slopes[:, i] = (force(moved) - base) / (moved[i] - self.theta[i])
        variance = np.einsum("ij,jk,ik->i", slopes, self.covariance[:n, :n], slopes)
        half = stats.t.ppf(0.975, self.degrees) * np.sqrt(variance)
        return base.reshape(angle.shape), half.reshape(angle.shape)

    def criteria(self) -> tuple[float, float]:
        """AIC and BIC of the residuals, with the effective number of parameters."""
        m = self.residuals.size
        scaled = self.residuals / self.weights * self.noise
        fit = m * np.log(np.mean(scaled**2))
        return float(fit + 2.0 * self.effective), float(fit + np.log(m) * self.effective)

    def tire(self, name: str, like: Tire, source: str) -> Tire:
        """The fitted tire; what a steady rig does not measure is taken from `like`."""
        given = {
            item: getattr(like, item)
            for item in (
                "relaxation_x",
                "relaxation_y",
                "damping_time",
                "rolling_resistance",
                "pneumatic_trail",
                "radius",
            )
        }
        coefficients = {
            key: _rounded(value, error) for key, (value, error) in self.coefficients().items()
        }
        found = dict(zip(self.causes, self.theta[len(self.curve.parameters) :], strict=True))
        if self.curve.family == "pac89" and "conicity" in found:
            coefficients["a12"] = -round(float(found["conicity"]), 6)  # the list's sign
        return Tire(
            name=name,
            family=self.curve.family,
            coefficients=coefficients,
            source=source,
            nominal_load=float(self.table.load.max()),
            **given,
        )


def identify(
    table: RigTable, family: str = "pac89", seed: int = 0, starts: int = STARTS
) -> tuple[Fit, Verdict]:
    """Fit a family to a table, with the hidden causes that the data support.

    Args:
      table: of the rig. family: pac89, quadratic, linear or mf61.
      seed: of the starts. starts: how many.

    Raises:
      MjchairError: too few runs, angles or loads, or an unknown family.
    """
    _check(table)
    model = curve(family, table)
    plain = fit(table, model, (), seed=seed, starts=starts)
    full = fit(table, model, ("toe", "camber", "offset"), start=_started(plain, 3), starts=1)
    weights = np.minimum(full.weights, plain.weights)
    tried = {
        group: fit(
            table, model, group, start=_started(plain, len(group)), starts=1, weights=weights
        )
        for group in causes.candidates()
    }
    # a pair that cannot be told apart at all adds nothing: its second cause costs its ln n
    count = table.fy.size
    bic = {
        group: found.objective + len(group) * float(np.log(count)) for group, found in tried.items()
    }
    verdict = causes.decide(bic)
    start = tried[verdict.best].theta
    return fit(table, model, verdict.best, seed=seed, starts=starts, start=start), verdict


def compare(table: RigTable, fits: Sequence[Fit]) -> list[tuple[str, float, float, float, float]]:
    """Family, effective parameters, rms residual (N), AIC and BIC of fits to the same table."""
    rows = []
    for found in fits:
        aic, bic = found.criteria()
        rms = float(np.sqrt(np.mean(found.residuals**2)))
        rows.append((found.curve.family, found.effective, rms, aic, bic))
    return sorted(rows, key=lambda row: row[4])


def fit(
    table: RigTable,
    model: Curve,
    group: tuple[str, ...] = (),
    *,
    seed: int = 0,
    starts: int = STARTS,
    start: Array | None = None,
    weights: Array | None = None,
) -> Fit:
    """Fit a curve and hidden causes by least squares.

    Args:
      table: of the rig. model: the curve. group: names of causes.
      seed: of the starts. starts: how many, the first being `start` or the starting values.
      start: (k,). weights: (m,), N, standard deviations to keep; None: from the residuals.
    """
    parameters = _parameters(model, group, table)
    lows = np.array([p.low for p in parameters])
    highs = np.array([p.high for p in parameters])
    first = np.array([p.start for p in parameters]) if start is None else np.asarray(start)
    scale = np.array([p.scale for p in parameters])
    given = _given_noise(table)
    largest = float(np.max(np.abs(table.fy)))
    noise = np.full(given.size, FIRST_NOISE * largest) if weights is None else weights
    noise = np.where(np.isnan(given), noise, given)
    rng = np.random.default_rng(seed)

    def solve(begin: Array) -> optimize.OptimizeResult:
        return optimize.least_squares(
            lambda theta: _residuals(theta, table, model, group, parameters, noise),
            np.clip(begin, lows + 1e-9 * scale, highs - 1e-9 * scale),
            bounds=(lows, highs),
            x_scale=scale,
            method="trf",
            xtol=1e-10,
            ftol=1e-10,
            max_nfev=200,
        )

    begins = [first] + [
        first + rng.uniform(-1.0, 1.0, first.size) * np.minimum(scale, 0.5 * (highs - lows))
        for _ in range(starts - 1)
    ]
    ends = [solve(begin) for begin in begins]
    best = min(ends, key=lambda end: end.cost)
    reached = float(np.mean([end.cost < best.cost * 1.001 + 1e-6 for end in ends]))
    for _ in range(0 if weights is not None else 6):  # the noise and what it weighs, in turn
        spent = _effective(best.jac, parameters)
        rows = given.size
        misfit = best.fun[:rows] * noise
        size = np.sqrt(np.sum(misfit**2) / max(rows - spent, 1.0))
        updated = np.where(np.isnan(given), max(size, LEAST_NOISE * largest), given)
        settled = np.allclose(updated, noise, rtol=1e-3)
        noise = updated
        best = solve(best.x)
        if settled:
            break
    information = best.jac.T @ best.jac
    covariance = np.linalg.pinv(information, hermitian=True)
    spent = _effective(best.jac, parameters)
    return Fit(
        curve=model,
        causes=group,
        theta=best.x,
        covariance=covariance,
        table=table,
        noise=float(np.median(noise)),
        weights=noise,
        residuals=-best.fun[: given.size] * noise,
        effective=spent,
        degrees=max(given.size - spent, 1.0),
        reached=reached,
        objective=float(2.0 * best.cost),
    )


def _rounded(value: float, error: float) -> float:
    """The value without the digits below a thousandth of its standard error."""
    if not (np.isfinite(error) and error > 0.0):
        return value
    return round(value, 3 - int(np.floor(np.log10(error))))


def _parameters(model: Curve, group: tuple[str, ...], table: RigTable) -> tuple[Parameter, ...]:
    return (*model.parameters, *(causes.parameter(name, table) for name in group))


def _started(plain: Fit, count: int) -> Array:
    return np.concatenate([plain.theta, np.zeros(count)])


def _given_noise(table: RigTable) -> Array:
    """Standard deviation of every residual as the table gives it, NaN where it does not."""
    return np.concatenate([table.sigma, table.sigma[driven(table)]])


def _residuals(
    theta: Array,
    table: RigTable,
    model: Curve,
    group: tuple[str, ...],
    parameters: tuple[Parameter, ...],
    noise: Array,
) -> Array:
    """Fitted less measured over noise, then parameters less priors over their spread."""
    n = len(model.parameters)
    values = {name: float(value) for name, value in zip(group, theta[n:], strict=True)}
    packed = block_of(model.family, model.coefficients(theta[:n]))
    angle = np.radians(table.angle + values.get("toe", 0.0))
    force = block_forces(packed, table.load, table.kappa, angle, np.radians(table.camber))
    rows = driven(table)
    misfit = np.concatenate(
        [
            force.Fy + causes.added_force(values, table) - table.fy,
            (force.Fx - table.fx)[rows],
        ]
    )
    prior = [
        (value - p.prior) / p.spread
        for value, p in zip(theta, parameters, strict=True)
        if p.prior is not None
    ]
    return np.concatenate([misfit / noise, prior])


def _effective(jacobian: Array, parameters: tuple[Parameter, ...]) -> float:
    """Trace of the data's share in the information: parameters that the data determined."""
    rows = jacobian.shape[0] - sum(p.prior is not None for p in parameters)
    data = jacobian[:rows].T @ jacobian[:rows]
    whole = jacobian.T @ jacobian
    return float(np.trace(np.linalg.pinv(whole, hermitian=True) @ data))


def _check(table: RigTable) -> None:
    angles, loads = np.unique(table.angle).size, np.unique(table.load).size
    if len(table) < 4 or angles < 2:
        raise MjchairError(
            f"{table.source}: {len(table)} runs at {angles} slip angles and {loads} loads; a fit "
            "needs at least 4 runs at 2 angles, and better 12 at 4 angles and 3 loads"
        )
