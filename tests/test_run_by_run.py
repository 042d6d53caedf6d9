"""Effects that are not of one size in all runs, on a linear problem whose sizes are known."""

from types import SimpleNamespace

import numpy as np
import pytest

from mjchair.diagnosis.explain import search_rules
from mjchair.diagnosis.explain.run_by_run import uneven
from mjchair.diagnosis.fit.column_ids import ParameterId, RoughlyKnown
from mjchair.diagnosis.fit.variant import Term
from mjchair.effects.effect import Effect, Parameter

RUNS, WINDOWS, ROWS = ("east", "west", "slalom"), 4, 80
DRAG = Effect(
    name="drag",
    parameters=(Parameter("left", "N", 2.0, -9.0, 9.0), Parameter("right", "N", 2.0, -9.0, 9.0)),
    signature="",
    source="",
    edit=lambda spec, left, right: None,
)
FITTED = {"left": 1.0, "right": 0.5}


def problem(left):
    """A fit, and a bench of a drag whose left part is `left` (N) in each run, right 0.5 N."""
    rng = np.random.default_rng(4)
    keys = [ParameterId("drag", name) for name in FITTED]
    run = np.repeat(np.arange(len(RUNS)), WINDOWS)
    G, b = np.zeros((run.size, 3, 3)), np.zeros((run.size, 3))
    for i, k in enumerate(run):
        J = rng.standard_normal((ROWS, 3))  # of a mass, and of both sides by 2 N
        r = 0.3 * J[:, 0] + (left[k] - FITTED["left"]) / 2.0 * J[:, 1] + rng.standard_normal(ROWS)
        G[i], b[i] = J.T @ J, J.T @ r
    columns = [RoughlyKnown("mass"), *keys]
    system = SimpleNamespace(
        columns=columns,
        places={c: i for i, c in enumerate(columns)},
        nuisance=1,
        free=0,
        back=np.zeros(1),
        G=G,
        b=b,
        run=run,
    )
    fitted = SimpleNamespace(
        system=system, variant=SimpleNamespace(terms=(Term(DRAG, FITTED, tuple(FITTED)),))
    )
    runs = [SimpleNamespace(trial=SimpleNamespace(name=name)) for name in RUNS]
    study = SimpleNamespace(runs=runs)
    bench = SimpleNamespace(windows=np.arange(run.size), simulator=SimpleNamespace(study=study))
    return bench, fitted


def test_a_brake_that_rubs_in_one_run_only_is_seen_with_its_sizes():
    bench, fitted = problem((0.0, 2.4, 0.0))
    (found,) = uneven(bench, fitted, {"drag": 100.0})
    assert (found.effect, found.parameter) == ("drag", "left")
    assert found.most.run == "west" and found.least.run != "west"
    assert abs(found.most.value - 2.4) < 4.0 * found.most.std
    assert abs(found.least.value) < 4.0 * found.least.std
    assert found.most.std == pytest.approx(2.0 / np.sqrt(WINDOWS * ROWS), rel=0.2)


def test_a_drag_that_stays_is_of_one_size():
    assert uneven(*problem((1.0, 1.0, 1.0)), {"drag": 100.0}) == []


def test_what_is_small_beside_the_effect_or_may_be_chance_does_not_differ():
    gained = {"gained": 40.0, "free": 4}
    assert search_rules.differs_by_run(**gained, brought=300.0)
    assert not search_rules.differs_by_run(**gained, brought=500.0)
    assert not search_rules.differs_by_run(gained=20.0, free=4, brought=100.0)
    assert not search_rules.differs_by_run(gained=40.0, free=0, brought=100.0)
