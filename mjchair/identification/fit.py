"""Fit of a tire family to rig data: bounded, weighted least squares with priors.

In: a rig table and the name of a family. Out: a `Fit`: parameters with their covariance, residuals,
published coefficients and the tire; and from `identify` also the verdict on hidden causes.

The residuals are force errors over the standard deviation of a force, and differences from the
prior means over the standard deviations of the priors. Their least squares are the most probable
parameters, given the data and the priors. The search starts from several points. Standard errors
come from the curvature at the optimum (Laplace's approximation). Where the standard error of a
parameter is not much smaller than the standard deviation of its prior, the data did not determine
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
from mjchair.units import per_cent

Array = NDArray[np.float64]

STARTS = 8
FIRST_NOISE = 0.02  # over the largest force; first estimate, replaced by the noise of the residuals
LEAST_NOISE = 1e-4  # over the largest force: rounding, and errors of the formula
NOISE_UPDATES = 6  # how often the noise is estimated anew, at most
UNDETERMINED = 0.5  # standard error over prior spread; a parameter above it is undetermined
MOST_RESIDUAL = 0.5  # rms residual over rms force, from which there is no tire: see Fit.tire
LARGE_RESIDUAL = 0.2  # from which it is said; rigs reach 0.02 to 0.05
FAR = 6.0  # robust standard deviations from which a row's residual is far off; normal noise: 2e-9
FAR_OF_FORCE = 0.05  # and the least part of the rms force that it then is
FAR_OF_FARTHEST = 0.5  # and of the farthest, which pulls the fit and so pushes good rows off
WRONG_SIGN = 0.75  # share of the runs whose force has the sign of the slip angle: toe makes some
STIFFEST = 100.0  # 1/rad, force over load and slip angle: racing tires reach 50; an assumption
STRONG_CORRELATION = 0.95  # correlations of two parameters above this value are reported


@dataclass(frozen=True)
class Estimate:
    """One parameter after the fit.

    Attributes:
      parameter: what was fitted. value: its fitted value. error: its standard error.
      determined: whether the value comes from the data rather than from the prior.
    """

    parameter: Parameter
    value: float
    error: float
    determined: bool


@dataclass(frozen=True)
class Fit:
    """A family fitted to a table.

    Attributes:
      curve: the family and its parameters. causes: hidden causes that were fitted with it.
      theta: (k,) parameters of the curve, then those of the causes.
      covariance: (k, k), of theta after the fit.
      table: the data. noise: median of `weights`, N.
      weights: (m,), standard deviation of each residual, N.
      residuals: (m,), measured less fitted force, N: the lateral force of every row, then the
        longitudinal force of the driven rows.
      effective: number of parameters that the data determined; need not be whole.
      degrees: degrees of freedom: m minus `effective`, at least 1.
      reached: share of the starting points from which the search ended in this optimum.
      objective: sum of the squared residuals, each divided by its noise or prior spread.
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
        """The parameters of the curve, then those of the causes; the order of theta."""
        return _parameters(self.curve, self.causes, self.table)

    def estimates(self) -> list[Estimate]:
        """Every parameter with its value and standard error, and whether the data determined it."""
        errors = np.sqrt(np.diag(self.covariance))
        return [
            Estimate(p, float(value), float(error), bool(error < UNDETERMINED * p.spread))
            for p, value, error in zip(self.parameters, self.theta, errors, strict=True)
        ]

    def correlations(self) -> Array:
        """Correlation matrix (k, k) of theta."""
        errors = np.sqrt(np.diag(self.covariance))
        return np.asarray(self.covariance / np.outer(errors, errors))

    def coefficients(self) -> dict[str, tuple[float, float]]:
        """The family's published coefficients: name -> value, standard error (delta method)."""
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
          angle: slip angle, deg. load: N. Their shapes broadcast, and the results have that shape.
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

    def far_rows(self) -> list[tuple[int, float, float]]:
        """Runs far outside the scale of the residuals, the farthest first.

        Returns:
          For each its index in the table, its residual (N), and that over the robust standard
          deviation of all lateral residuals (1.48 of the median of their sizes).
        """
        residual = self.residuals[: len(self.table)]
        size = np.abs(residual)
        scale = max(1.4826 * float(np.median(size)), LEAST_NOISE * _rms(self.table.fy))
        far = np.flatnonzero(
            (size > FAR * scale) & (size > FAR_OF_FORCE * _rms(self.table.fy)) & ~_stated(self)
        )
        far = far[np.argsort(-size[far])]
        far = far[size[far] > FAR_OF_FARTHEST * np.max(size[far], initial=0.0)]
        return [(int(i), float(residual[i]), float(size[i] / scale)) for i in far]

    @property
    def unexplained(self) -> float:
        """Rms lateral residual over rms lateral force of the runs that are not far off, 1.

        It is 1 where the fit says nothing of the force, whatever its size, and the relative noise
        where it says all. It is taken about 0 and not about the mean force, since a table of a
        tire that slides may have nearly the same force in every run.
        """
        kept = np.ones(len(self.table), bool)
        kept[[i for i, _, _ in self.far_rows()]] = False
        force = _rms(self.table.fy[kept])
        return _rms(self.residuals[: len(self.table)][kept]) / force if force > 0.0 else 1.0

    def criteria(self) -> tuple[float, float]:
        """AIC and BIC of the residuals, with the effective number of parameters."""
        m = self.residuals.size
        scaled = self.residuals / self.weights * self.noise
        misfit = m * np.log(np.mean(scaled**2))
        return float(misfit + 2.0 * self.effective), float(misfit + np.log(m) * self.effective)

    def tire(self, name: str, like: Tire, source: str) -> Tire:
        """The fitted tire.

        Args:
          name: of the new tire. source: text for the tire file on where the numbers come from.
          like: tire from which everything is taken that a steady rig does not measure: relaxation
            lengths, damping, rolling resistance, pneumatic trail and radius.

        Raises:
          MjchairError: the residual is as large as the force (`unexplained`): there is no tire in
            such data.
        """
        if self.unexplained > MOST_RESIDUAL:
            raise MjchairError(
                f"{self.table.source}: the residual of the fit is {per_cent(self.unexplained)} "
                f"of the force, and of a tire it must be below {per_cent(MOST_RESIDUAL)}; are "
                "slip angle, load and force of one run in each row, and in their units?"
            )
        not_measured = {
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
        causes_fitted = dict(
            zip(self.causes, self.theta[len(self.curve.parameters) :], strict=True)
        )
        if self.curve.family == "pac89" and "conicity" in causes_fitted:
            # conicity belongs to the tire; PAC89 counts its lateral force with the other sign
            coefficients["a12"] = -round(float(causes_fitted["conicity"]), 6)
        return Tire(
            name=name,
            family=self.curve.family,
            coefficients=coefficients,
            source=source,
            nominal_load=float(self.table.load.max()),
            **not_measured,
        )


def identify(
    table: RigTable, family: str = "pac89", seed: int = 0, starts: int = STARTS
) -> tuple[Fit, Verdict]:
    """Fit a family to a table, with the hidden causes that the data support.

    Args:
      table: the rig runs. family: pac89, quadratic, linear or mf61.
      seed: of the random starting points. starts: how many starting points.

    Raises:
      MjchairError: too few runs, angles or loads, forces of the other sign, slip angles that are
        most likely in another unit, or an unknown family.
    """
    _check(table)
    model = curve(family, table)
    plain = fit(table, model, (), seed=seed, starts=starts)
    full = fit(table, model, ("toe", "camber", "offset"), start=_with_zeros(plain, 3), starts=1)
    # all sets of causes are compared with the same noise: the least that the data allow
    weights = np.minimum(full.weights, plain.weights)
    fits = {
        group: fit(
            table, model, group, start=_with_zeros(plain, len(group)), starts=1, weights=weights
        )
        for group in causes.candidates()
    }
    # every cause counts as one whole parameter here. By the effective number of parameters, a
    # second cause that the data cannot tell from the first would count as none
    count = table.fy.size
    bic = {group: one.objective + len(group) * float(np.log(count)) for group, one in fits.items()}
    verdict = causes.decide(bic)
    start = fits[verdict.best].theta
    return fit(table, model, verdict.best, seed=seed, starts=starts, start=start), verdict


def compare(table: RigTable, fits: Sequence[Fit]) -> list[tuple[str, float, float, float, float]]:
    """Compare fits of several families to the same table.

    Returns:
      A row for each fit, least BIC first: family, effective number of parameters, rms residual (N),
      AIC, BIC.
    """
    rows = []
    for fitted in fits:
        aic, bic = fitted.criteria()
        rms = float(np.sqrt(np.mean(fitted.residuals**2)))
        rows.append((fitted.curve.family, fitted.effective, rms, aic, bic))
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
      table: the rig runs. model: the curve. group: names of the causes to fit with it.
      seed: of the random starting points.
      starts: how many starting points. The first is `start`, or the parameters' own start values.
      start: (k,), or None.
      weights: (m,), fixed standard deviations of the residuals, N; None: they are estimated from
        the residuals, or taken from the table where it states them.
    """
    parameters = _parameters(model, group, table)
    lows = np.array([p.low for p in parameters])
    highs = np.array([p.high for p in parameters])
    first = np.array([p.start for p in parameters]) if start is None else np.asarray(start)
    scale = np.array([p.scale for p in parameters])
    stated = _stated_noise(table)
    largest = float(np.max(np.abs(table.fy)))
    noise = np.full(stated.size, FIRST_NOISE * largest) if weights is None else weights
    noise = np.where(np.isnan(stated), noise, stated)
    rng = np.random.default_rng(seed)

    def solve(theta0: Array) -> optimize.OptimizeResult:
        return optimize.least_squares(
            lambda theta: _residuals(theta, table, model, group, parameters, noise),
            np.clip(theta0, lows + 1e-9 * scale, highs - 1e-9 * scale),
            bounds=(lows, highs),
            x_scale=scale,
            method="trf",
            xtol=1e-10,
            ftol=1e-10,
            max_nfev=200,
        )

    starting_points = [first] + [
        first + rng.uniform(-1.0, 1.0, first.size) * np.minimum(scale, 0.5 * (highs - lows))
        for _ in range(starts - 1)
    ]
    solutions = [solve(point) for point in starting_points]
    best = min(solutions, key=lambda one: one.cost)
    reached = float(np.mean([one.cost < best.cost * 1.001 + 1e-6 for one in solutions]))
    # estimate the noise from the residuals and fit again with it, until it does not change
    for _ in range(0 if weights is not None else NOISE_UPDATES):
        effective = _effective(best.jac, parameters)
        rows = stated.size
        misfit = best.fun[:rows] * noise
        deviation = np.sqrt(np.sum(misfit**2) / max(rows - effective, 1.0))
        updated = np.where(np.isnan(stated), max(deviation, LEAST_NOISE * largest), stated)
        converged = np.allclose(updated, noise, rtol=1e-3)
        noise = updated
        best = solve(best.x)
        if converged:
            break
    information = best.jac.T @ best.jac
    covariance = np.linalg.pinv(information, hermitian=True)
    effective = _effective(best.jac, parameters)
    return Fit(
        curve=model,
        causes=group,
        theta=best.x,
        covariance=covariance,
        table=table,
        noise=float(np.median(noise)),
        weights=noise,
        residuals=-best.fun[: stated.size] * noise,
        effective=effective,
        degrees=max(stated.size - effective, 1.0),
        reached=reached,
        objective=float(2.0 * best.cost),
    )


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else 0.0


def _stated(fitted: Fit) -> NDArray[np.bool_]:
    """Whether the table states the noise of a row (n,) itself; such a row may be as far as that."""
    return np.asarray(np.isfinite(fitted.table.sigma))


def _rounded(value: float, error: float) -> float:
    """The value rounded to about a thousandth of its standard error."""
    if not (np.isfinite(error) and error > 0.0):
        return value
    return round(value, 3 - int(np.floor(np.log10(error))))


def _parameters(model: Curve, group: tuple[str, ...], table: RigTable) -> tuple[Parameter, ...]:
    return (*model.parameters, *(causes.parameter(name, table) for name in group))


def _with_zeros(plain: Fit, count: int) -> Array:
    """The parameters of a fit without causes, and 0 for each of `count` causes."""
    return np.concatenate([plain.theta, np.zeros(count)])


def _stated_noise(table: RigTable) -> Array:
    """Standard deviations (m,) of the residuals that the table states, N; NaN where it does not."""
    return np.concatenate([table.sigma, table.sigma[driven(table)]])


def _residuals(
    theta: Array,
    table: RigTable,
    model: Curve,
    group: tuple[str, ...],
    parameters: tuple[Parameter, ...],
    noise: Array,
) -> Array:
    """Fitted less measured forces over noise, then parameters less prior means over spreads."""
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
    """Number of parameters that the data determined: the trace of the data's share of information.

    A parameter that only the data determine counts as 1, one that only its prior determines as 0.
    """
    rows = jacobian.shape[0] - sum(p.prior is not None for p in parameters)
    data = jacobian[:rows].T @ jacobian[:rows]
    data_and_priors = jacobian.T @ jacobian
    return float(np.trace(np.linalg.pinv(data_and_priors, hermitian=True) @ data))


def _check(table: RigTable) -> None:
    """Refuse a table with too few runs for any fit."""
    angles, loads = np.unique(table.angle).size, np.unique(table.load).size
    if len(table) < 4 or angles < 2:
        raise MjchairError(
            f"{table.source}: {len(table)} runs at {angles} slip angles and {loads} loads; a fit "
            "needs at least 4 runs at 2 slip angles (recommended: 12 runs, 4 angles, 3 loads)"
        )
    _check_angles(table)


def _check_angles(table: RigTable) -> None:
    """Refuse forces of the other sign, and slip angles that are most likely in radians."""
    free = (table.kappa == 0.0) & (table.angle != 0.0) & (table.fy != 0.0)
    angle, force, load = table.angle[free], table.fy[free], table.load[free]
    if not angle.size:
        return
    same = int(np.sum(angle * force > 0.0))
    if same > WRONG_SIGN * angle.size:
        change = "leave out --paper-sign" if table.paper_sign else "give --paper-sign"
        raise MjchairError(
            f"{table.source}: the force has the sign of the slip angle in {same} of {angle.size} "
            f"runs, and in ISO-W it has the other; {change}"
        )
    slope = float(np.median(np.abs(force / (load * np.radians(angle)))))
    largest = float(np.max(np.abs(angle)))
    if slope > STIFFEST and largest < 0.5 * np.pi:
        raise MjchairError(
            f"{table.source}: slip_angle_deg goes to {largest:g} deg only, which makes a stiffness "
            f"of {slope:.0f} times the load, and tires have less than {STIFFEST:g}; in radians? "
            "then name the column 'slip_angle [rad]'"
        )
