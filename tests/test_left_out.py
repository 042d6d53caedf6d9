"""What effects bring on runs that no fit saw: consistent ones bring it, others nothing."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from noisy_run import NOISE, noisy_run

import mjchair
from mjchair.diagnosis.data.study import make_study
from mjchair.diagnosis.explain import left_out
from mjchair.diagnosis.explain.left_out import held_out
from mjchair.diagnosis.explain.screening import prepare, screen_columns
from mjchair.diagnosis.fit import bounded
from mjchair.diagnosis.fit.bench import Bench
from mjchair.diagnosis.fit.column_ids import RoughlyKnown
from mjchair.diagnosis.fit.system import System
from mjchair.diagnosis.next_experiment import wording
from mjchair.simulation.initial import Initial

ROWS = 40
DRAWS = 20


def system(columns, y):
    """Two runs of two windows each: columns (rows, effects) and data (rows,) of every window."""
    count = columns[0].shape[1]
    return System(
        columns=[RoughlyKnown(f"c{k}") for k in range(count)],
        nuisance=0,
        G=np.array([J.T @ J for J in columns]),
        b=np.array([J.T @ r for J, r in zip(columns, y, strict=True)]),
        c=np.array([r @ r for r in y]),
        run=np.array([0, 0, 1, 1]),
        back=np.zeros(0),
    )


BENCH = SimpleNamespace(
    windows=np.arange(4),
    simulator=SimpleNamespace(
        study=SimpleNamespace(runs=[SimpleNamespace(manoeuvre=m) for m in ("push", "slalom")])
    ),
)


def gains(columns, sizes, seed=0):
    """Of the columns, over draws of the noise; `sizes`: true coefficients of every window."""
    rng = np.random.default_rng(seed)
    out = []
    for _ in range(DRAWS):
        y = [J @ s + rng.standard_normal(ROWS) for J, s in zip(columns, sizes, strict=True)]
        made = system(columns, y)
        out.append(held_out(BENCH, (made, []), (made, list(range(columns[0].shape[1])))))
    return np.array(out)


def unit(rng, count):
    return np.linalg.qr(rng.standard_normal((ROWS, count)))[0]


def test_an_effect_that_is_the_same_in_both_runs_brings_about_what_it_gains():
    J = 10.0 * unit(np.random.default_rng(1), 1)
    assert gains([J] * 4, [[1.0]] * 4).mean() == pytest.approx(400.0, rel=0.05)


def test_an_effect_that_turns_round_from_run_to_run_brings_nothing():
    J = 10.0 * unit(np.random.default_rng(1), 1)
    assert gains([J] * 4, [[1.0], [1.0], [-1.0], [-1.0]]).max() < -100.0


def test_an_effect_where_nothing_is_brings_nothing():
    J = 10.0 * unit(np.random.default_rng(1), 1)
    assert gains([J] * 4, [[0.0]] * 4).mean() < 0.0


@pytest.mark.parametrize(("second", "foretells"), [(30.0, True), (0.0, False)])
def test_another_run_foretells_what_an_effect_does_and_no_event(monkeypatch, second, foretells):
    """What an effect brings on a run, of what it does in the other (`second`)."""
    rng = np.random.default_rng(3)
    J = [unit(rng, 1) for _ in range(4)]
    sizes = [0.0, 30.0, 0.0, second]  # of the runs' windows
    made = system(J, [c[:, 0] * s for c, s in zip(J, sizes, strict=True)])
    monkeypatch.setattr(left_out, "with_terms", lambda *_: (made, [0]))
    runs = [SimpleNamespace(trial=SimpleNamespace(name=name)) for name in ("a", "b")]
    bench = SimpleNamespace(
        windows=np.arange(4),
        windows_of=lambda mine: np.flatnonzero(np.isin(made.run, list(mine))),
        simulator=SimpleNamespace(study=SimpleNamespace(runs=runs)),
    )
    base = SimpleNamespace(bench=bench, plain=SimpleNamespace(system=made))
    brings = left_out.foretold_of(base, None, "a")
    assert (brings > 0.5 * 30.0**2 / 2) == foretells
    base.bench = SimpleNamespace(**{**vars(bench), "windows": np.arange(2)})
    assert left_out.foretold_of(base, None, "a") == 0.0  # there is no other run


def test_what_a_run_cannot_tell_it_does_not_foretell():
    """A push tells the sum of two numbers, a slalom their difference: together they tell both."""
    a, b = unit(np.random.default_rng(2), 2).T
    push = np.column_stack([20.0 * a + 0.1 * b, 20.0 * a - 0.1 * b])
    slalom = np.column_stack([20.0 * b + 0.1 * a, -20.0 * b + 0.1 * a])
    found = gains([push, push, slalom, slalom], [[1.0, 0.0]] * 4)
    assert found.min() > 500.0  # of 1600; a point estimate from one run foretells the other wrongly


@pytest.fixture(scope="module")
def base():
    """A coast, and one held out."""
    rng = np.random.default_rng(5)
    start = Initial((0.0, 0.0), 0.3, 1.5)
    spec = mjchair.load_spec()
    kept, other = (noisy_run(rng, spec, name, start, 4.0) for name in ("coast 0", "coast 1"))
    study = make_study(spec, [kept, replace(other, hold_out=True)], NOISE)
    bench, first = prepare(study, threads=1)
    return screen_columns(bench, first, [])


def test_how_a_held_out_run_begins_costs_a_fit_nothing(base):
    plain, held = base.plain, left_out.held_windows(base)
    assert (plain.system.confined > 1.0).all()
    rest = plain.system.confined.sum() - plain.system.confined[held].sum()
    assert plain.confined == pytest.approx(rest)


def told_otherwise(base, by):
    """Chi2 of held-out windows where every speed is foretold otherwise by `by` (samples,)."""
    before = base.plain.track.predicted
    predicted = [p + by[: len(p), None] for p in before]
    fitted = replace(base.plain, track=SimpleNamespace(predicted=predicted))
    return left_out.on_held_out(base, fitted).changed


def test_what_is_foretold_otherwise_counts_by_its_square(base):
    wave = 0.01 * np.sin(np.arange(1000) / 20.0)
    assert told_otherwise(base, 0.0 * wave) == 0.0
    once = told_otherwise(base, wave)
    assert once > 10.0
    assert told_otherwise(base, 2.0 * wave) == pytest.approx(4.0 * once, rel=1e-9)


def test_what_is_only_roughly_known_changes_no_more_than_the_fit_leaves_open(base):
    """Five runs held out see a rolling radius that is one deviation off; one was fitted to."""
    plain, held = base.plain, np.repeat(left_out.held_windows(base), 5)
    name = RoughlyKnown("rolling_radius")
    moved = [p + c for p, c in zip(plain.track.predicted, plain.columns[name], strict=True)]
    fitted = replace(plain, track=SimpleNamespace(predicted=moved))
    at = plain.system.places[name]
    known = np.linalg.inv(bounded.covariance(plain.system, base.bench.windows))
    assert left_out._changed(base, plain, fitted, held) <= known[at, at] * (1.0 + 1e-6)


def test_what_a_fit_moved_of_a_sensor_is_no_change_where_its_effect_takes_it_over(base):
    """The scale of an encoder, 40 of its deviations off, changed chi2 by 553 000 of a gap of -30:
    without the effect, the fit had it in a number that stands in no prediction."""
    plain = base.plain
    name = RoughlyKnown("rolling_radius")
    at = plain.system.places[name]
    moved = [p + 3.0 * c for p, c in zip(plain.track.predicted, plain.columns[name], strict=True)]
    before = plain.step.copy()
    before[at] += 3.0
    lacking = replace(base, plain=replace(plain, step=before))
    fitted = replace(plain, track=SimpleNamespace(predicted=moved))
    assert left_out.on_held_out(lacking, fitted).changed == pytest.approx(0.0, abs=1e-6)
    assert left_out.on_held_out(base, fitted).changed > 1.0


def test_a_corrected_chair_is_as_far_from_held_out_runs_as_it_leaves_them(base):
    plain, held = base.plain, left_out.held_windows(base)
    assert left_out.on_held_out(base, plain).farther == 0.0
    cells = [replace(c, total=c.total + 30.0) for c in plain.system.cells]
    worse = replace(plain, system=replace(plain.system, cells=cells))
    by = left_out.on_held_out(base, worse).farther
    assert by == pytest.approx(30.0 * held.size)
    assert left_out.on_held_out(base, plain, fewer=worse).farther == pytest.approx(-by)


def foretold(rng, sizes, missing=0.0):
    """Chi2 over its dof of two held-out runs, foretold by two that were fitted to, and as they are.

    Args:
      missing: what the held-out runs show that no number makes.
      sizes: (2, numbers) by which numbers that are roughly known show in the runs that were fitted
        to, and in those that were held out.
    """
    kinds = np.repeat(np.asarray(sizes, float), 2, axis=0)
    columns = [rng.standard_normal((ROWS, kinds.shape[1])) * size for size in kinds]
    truth = rng.standard_normal(kinds.shape[1])
    data = [J @ truth + rng.standard_normal(ROWS) for J in columns]
    data[2:] = [r + missing * rng.standard_normal(ROWS) for r in data[2:]]
    whole = replace(
        system(columns, data),
        nuisance=len(truth),
        back=np.zeros(len(truth)),
        slow=[[np.column_stack([r, J])] for r, J in zip(data, columns, strict=True)],
    )
    fitted_to, held = np.array([0, 1]), np.array([2, 3])
    step = bounded.solve(whole, fitted_to, [])[0]
    base = SimpleNamespace(bench=SimpleNamespace(windows=fitted_to))
    chi2, dof = left_out._foretold(base, SimpleNamespace(system=whole, step=step), held)
    left = np.concatenate([data[i] - columns[i] @ step for i in held])
    return chi2 / dof, left @ left / left.size


def test_what_no_run_tells_is_no_gap_in_one_that_was_held_out():
    """Nothing was hidden: a centre of mass a little aside, which turns alone show, was a gap."""
    rng = np.random.default_rng(11)
    found = np.array([foretold(rng, [[1.0, 0.0], [1.0, 3.0]]) for _ in range(200)])
    assert found[:, 0].mean() == pytest.approx(1.0, abs=0.05)
    assert found[:, 1].mean() > 4.0


@pytest.mark.parametrize("size", [0.0, 3.0])
def test_what_no_number_makes_stays_a_gap(size):
    rng = np.random.default_rng(11)
    told, _ = foretold(rng, [[1.0, size], [1.0, 3.0]], missing=3.0)
    assert told > 5.0


def test_a_held_out_run_that_alone_shows_what_is_missing_is_told(monkeypatch):
    names = ["coast", "turn"]
    runs = [SimpleNamespace(hold_out=n == "turn", trial=SimpleNamespace(name=n)) for n in names]
    simulator = SimpleNamespace(
        windows=[SimpleNamespace(run=k) for k in (0, 0, 1)], study=SimpleNamespace(runs=runs)
    )
    base = SimpleNamespace(bench=Bench(simulator, {}, ()))
    cells = [SimpleNamespace(total=40.0, total_dof=10.0)] * 3
    fitted = SimpleNamespace(system=SimpleNamespace(cells=cells))
    for left, said in ((7.0, ("turn", 7.0, 2.0)), (5.0, None)):
        monkeypatch.setattr(left_out, "_foretold", lambda *_, left=left: (10.0 * left**2, 10.0))
        found = left_out.lone_run(base, fitted)
        assert found == said
    assert "Hold out another run than turn" in wording.letting_in("turn", 7.0, 2.0)
