"""The own bounded Gauss-Newton against mujoco.minimize.least_squares, on fits of a diagnosis.

    python benchmarks/minimizers.py

Two coasts and a turn of a chair with one hidden effect are fitted with this effect, from the start
of its linear fit and from a distant one. Both minimizers use the same residual: whitened, with the
state of each window eliminated, and with the priors of the roughly known numbers. The script prints
the final chi2 of each minimizer and the number of windows that it simulated.
"""

from __future__ import annotations

import os
from dataclasses import replace

os.environ.setdefault("OMP_NUM_THREADS", "1")

import mujoco.minimize
import numpy as np
from noisy_run import NOISE, noisy_run
from scipy.linalg import cho_solve

import mjchair
from mjchair.diagnosis.data.study import Run, make_study
from mjchair.diagnosis.explain.screening import prepare
from mjchair.diagnosis.fit import nonlinear
from mjchair.diagnosis.fit.bounded import WALL
from mjchair.diagnosis.fit.column_ids import RoughlyKnown
from mjchair.diagnosis.fit.elimination import eliminate_window
from mjchair.diagnosis.fit.parameter_columns import nuisance_columns, term_columns
from mjchair.diagnosis.fit.variant import Term, Variant
from mjchair.diagnosis.replay.sampling import residual
from mjchair.diagnosis.replay.window_states import track
from mjchair.effects.library import find
from mjchair.simulation.initial import Initial
from mjchair.simulation.inputs import Inputs

# hidden effect and values -> starts of the fit
CASES = (
    ("rolling_resistance", {"coefficient": 0.004}, ({"coefficient": 0.003}, {"coefficient": 0.03})),
    ("toe", {"symmetric": 0.02}, ({"symmetric": 0.015}, {"symmetric": 0.1})),
    (
        "surface_patch",
        {"x": 2.0, "y": 0.0, "radius": 0.6, "coefficient": 0.03},
        (
            {"x": 1.8, "y": 0.0, "radius": 0.5, "coefficient": 0.02},
            {"x": 1.0, "y": 0.3, "radius": 0.5, "coefficient": 0.1},
        ),
    ),
    (
        "wheel_radius",
        {"left": -0.004, "right": 0.0},
        ({"left": -0.003, "right": 0.0}, {"left": 0.02, "right": 0.02}),
    ),
)


def measured(name: str, values: dict[str, float]) -> list[Run]:
    """Two coasts one each way and a driven turn, with noise."""
    rng = np.random.default_rng(1)
    spec = mjchair.load_spec()
    find(name).apply(spec, values)
    time = np.arange(0.0, 4.0, 0.01)
    turn = Inputs(time, {"left_wheel": -3.0 + 0 * time, "right_wheel": 6.5 + 0 * time}, "turn")
    return [
        noisy_run(rng, spec, word, start, 3.9, inputs)
        for word, start, inputs in (
            ("east", Initial((0.0, 0.0), 0.0, 1.5), None),
            ("west", Initial((4.0, 0.0), np.pi, 1.2), None),
            ("turn", Initial((0.0, 0.0), 0.5, 1.0, 0.6), turn),
        )
    ]


class Counted:
    """Counts the windows that a simulator simulates."""

    def __init__(self, simulator):
        """Count from now on."""
        self.windows = 0
        simulate = simulator._simulate

        def counted(jobs, trace):
            self.windows += len(jobs)
            return simulate(jobs, trace)

        simulator._simulate = counted


class Problem:
    """The fit as a vector of residuals.

    Nuisances are in prior standard deviations, parameters over their typical change.
    """

    def __init__(self, bench, variant, first, nuisances):
        """Of a variant, around the track `first`."""
        self.bench, self.variant, self.nuisances = bench, variant, nuisances
        self.before = first
        self.names = [c for c in nuisances]
        self.inside = {RoughlyKnown(n.name) for n in bench.nuisances if n.edit is not None}
        self.keys = [(t, key, p) for t in variant.terms for key, p in t.parameters]
        self.cached = None

    def bounds(self):
        """Walls of nuisances and bounds of parameters."""
        n = len(self.names)
        low = [(p.low - p.neutral) / p.change for _, _, p in self.keys]
        high = [(p.high - p.neutral) / p.change for _, _, p in self.keys]
        return np.r_[np.full(n, -WALL), low], np.r_[np.full(n, WALL), high]

    def x0(self):
        """The start: the values of the variant."""
        start = [(t.values[p.name] - p.neutral) / p.change for t, _, p in self.keys]
        return np.r_[np.zeros(len(self.names)), start]

    def at(self, x):
        """The variant, and the coefficients that do not belong to a variant."""
        n = len(self.names)
        offsets = {
            c.name: float(v) for c, v in zip(self.names, x[:n], strict=True) if c in self.inside
        }
        values = {}
        for (term, _, p), v in zip(self.keys, x[n:], strict=True):
            value = float(np.clip(p.neutral + v * p.change, p.low, p.high))
            values.setdefault(term.effect.key, dict(term.values))[p.name] = value
        terms = tuple(replace(t, values=values[t.effect.key]) for t in self.variant.terms)
        outside = np.array(
            [0.0 if c in self.inside else v for c, v in zip(self.names, x[:n], strict=True)]
        )
        return replace(self.variant, offsets=offsets, terms=terms), outside

    def look(self, x):
        """Track and window algebra at x; the last is kept, since the Jacobian asks for it again."""
        if self.cached is not None and np.array_equal(self.cached[0], x):
            return self.cached[1:]
        variant, outside = self.at(x)
        bench, simulator = self.bench, self.bench.simulator
        model = simulator.compile(variant.edit)
        errors = variant.sensor_errors(simulator.channels)
        here = track(simulator, model, bench.noise, errors, self.before)
        self.before = here
        self.cached = (x.copy(), variant, outside, here)
        return self.cached[1:]

    def windows(self, x, columns):
        """Every window with its state eliminated."""
        variant, outside, here = self.look(x)
        bench, simulator = self.bench, self.bench.simulator
        for i, w in enumerate(simulator.windows):
            miss = residual(simulator.measured(w), here.predicted[i], simulator.channels)
            linear = np.stack([self.nuisances[c][i] for c in self.names], axis=2)
            miss = miss - linear @ outside
            J = np.stack([column[i] for column in columns(here, variant)], axis=2)
            yield eliminate_window(simulator, here, bench.whitener, i, miss, J)

    def residual_one(self, x):
        """Residuals at one point, whose squares add up to chi2 with its priors."""
        out = []
        for w in self.windows(x, lambda *_: [c for c in list(self.nuisances.values())[:1]]):
            z = cho_solve(w.factor, w.Z.T @ w.r)
            root = np.sqrt(np.maximum(w.precision, 0.0))
            out += [w.r - w.Z @ z, -root * z]
        return np.concatenate([*out, x[: len(self.names)]])

    def residual(self, x):
        """Residuals at many points, a column each."""
        return np.stack([self.residual_one(column) for column in x.T], axis=1)

    def jacobian(self, x, _):
        """Derivatives of the residuals."""
        x = x[:, 0]
        variant, _, here = self.look(x)
        columns = [*self.nuisances.values(), *term_columns(self.bench, here, variant).values()]
        out = []
        for w in self.windows(x, lambda *_: columns):
            lean = cho_solve(w.factor, w.Z.T @ w.J)
            root = np.sqrt(np.maximum(w.precision, 0.0))
            out += [-(w.J - w.Z @ lean), root[:, None] * lean]
        n = len(self.names)
        out.append(np.hstack([np.eye(n), np.zeros((n, len(self.keys)))]))
        return np.vstack(out)


def main() -> None:
    print("effect, start: own chi2 (windows) | mujoco.minimize chi2 (windows)")
    for name, truth, starts in CASES:
        bench, first = prepare(make_study(mjchair.load_spec(), measured(name, truth), NOISE))
        counted = Counted(bench.simulator)
        plain = Variant(bench.nuisances)
        nuisances = nuisance_columns(bench, first, plain)
        effect = find(name)
        for start in starts:
            values = {**effect.neutral(), **start}
            variant = replace(plain, terms=(Term(effect, values, tuple(start)),))
            counted.windows = 0
            own = nonlinear.refit(bench, variant, first, nuisances)
            own_cost = counted.windows
            counted.windows = 0
            problem = Problem(bench, variant, first, nuisances)
            x, trace = mujoco.minimize.least_squares(
                problem.x0(),
                problem.residual,
                problem.bounds(),
                problem.jacobian,
                xtol=1e-3,
                gtol=1e-3,
                max_iter=10,
                verbose=0,
            )
            theirs = 2.0 * min(float(t.objective) for t in trace)
            at = {
                p.name: p.neutral + v * p.change
                for (_, _, p), v in zip(problem.keys, x[-len(problem.keys) :].ravel(), strict=True)
            }
            mine = {k: v for k, v in own.variant.terms[0].values.items() if k in start}
            print(f"{name} {start}: {own.total:.2f} ({own_cost}) {_said(mine)} | "
                  f"{theirs:.2f} ({counted.windows}, {len(trace)} iterations) {_said(at)}",
                  flush=True)  # fmt: skip


def _said(values: dict[str, float]) -> str:
    return ", ".join(f"{k} {v:.4g}" for k, v in values.items())


if __name__ == "__main__":
    main()
