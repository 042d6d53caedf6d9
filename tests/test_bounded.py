"""The bounded linear fit against bounded least squares of another make."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from mjchair.diagnosis.fit import bounded
from mjchair.diagnosis.fit.column_ids import ParameterId, RoughlyKnown
from mjchair.diagnosis.fit.system import System

NUISANCES, EFFECTS = 12, 2


def made(seed):
    """A system whose columns are much alike and pull hard, and its rows (n, p) and residual."""
    rng = np.random.default_rng(seed)
    p = NUISANCES + EFFECTS
    alike = rng.standard_normal((60, 4)) @ rng.standard_normal((4, p))
    rows = 3.0 * (alike + 0.1 * rng.standard_normal((60, p)))
    residual = 10.0 * rng.standard_normal(60) + rows @ (4.0 * rng.standard_normal(p))
    names = [RoughlyKnown(f"n{k}") for k in range(NUISANCES)]
    names += [ParameterId("effect", f"p{k}") for k in range(EFFECTS)]
    system = System(
        columns=names,
        nuisance=NUISANCES,
        G=(rows.T @ rows)[None],
        b=(rows.T @ residual)[None],
        c=np.array([residual @ residual]),
        run=np.zeros(1, int),
        back=rng.uniform(-2.0, 2.0, NUISANCES),
    )
    return system, rows, residual


def test_nearer_walls_leave_more_to_the_effects():
    for seed in range(10):
        wide = bounded.reduce(made(seed)[0], [0])
        narrow = wide.narrowed(1.0)
        assert narrow.total > wide.total  # the plain chair fits worse
        assert wide.total - wide.gain([0]) <= narrow.total - narrow.gain([0]) + 1e-6
        assert wide.narrowed(bounded.WALL).total == pytest.approx(wide.total, rel=1e-9)


def least_chi2(seed, which, held=None):
    """Of a system with columns `which`, by other means; `held`: a nuisance at its centre."""
    system, rows, residual = made(seed)
    use = [*range(NUISANCES), *which]
    prior = np.eye(NUISANCES, len(use))
    wall = np.full(len(use), np.inf)
    wall[:NUISANCES] = bounded.WALL
    if held is not None:
        wall[held] = 1e-5
    centre = np.r_[system.back, np.zeros(len(which))]
    best = lsq_linear(
        np.vstack([rows[:, use], prior]),
        np.r_[residual, -system.back],
        (-wall - centre, wall - centre),
        method="trf",
        tol=1e-12,
    )
    return 2.0 * best.cost


@pytest.mark.parametrize("which", [[], [NUISANCES], [NUISANCES, NUISANCES + 1]])
def test_walls_end_at_the_least_chi2(which):
    for seed in range(40):
        system, _, _ = made(seed)
        steps, total = bounded.solve(system, [0], which)
        assert total == pytest.approx(least_chi2(seed, which), rel=1e-4)
        assert np.abs(steps[:NUISANCES] + system.back).max() < bounded.WALL + 1e-6


def test_what_is_held_where_the_study_has_it_costs_what_the_rest_cannot_make_up_for():
    which = [NUISANCES]
    for seed in range(10):
        system, _, _ = made(seed)
        cost = bounded.cost_of_holding(system, [0], which, {RoughlyKnown("n3")})
        free, held = least_chi2(seed, which), least_chi2(seed, which, held=3)
        assert cost == pytest.approx(held - free, abs=1e-4 * held)
        assert cost > -1e-6
