"""What effects bring on data that they were not fitted to: each run, or manoeuvre, in turn.

In: linear systems with and without the effects. Out: how much better they foretell what was left
out, in chi2.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis import rules
from mjchair.diagnosis.explain.gap import Gap
from mjchair.diagnosis.explain.null_ensemble import confirmed
from mjchair.diagnosis.explain.screening import Base, gap_after, reaches
from mjchair.diagnosis.fit import bounded
from mjchair.diagnosis.fit.bench import Bench
from mjchair.diagnosis.fit.elimination import eliminate_window
from mjchair.diagnosis.fit.nonlinear import Fitted
from mjchair.diagnosis.fit.slow_part import BAND, slow_components
from mjchair.diagnosis.fit.system import System
from mjchair.diagnosis.replay.sampling import residual

Array = NDArray[np.float64]
ALONE = 0.05  # share of a column that the other parts must show, for a part to be held out


class Lone(NamedTuple):
    """A held-out run that disagrees far more than the runs of the fit.

    Attributes:
      run: its name. left: rms that it leaves, over the noise. others: the most that a run of the
        fit leaves.
    """

    run: str
    left: float
    others: float


def held_out(
    bench: Bench,
    plain: tuple[System, Sequence[int]],
    full: tuple[System, Sequence[int]],
    by: str = "run",
) -> float:
    """How much better windows are foretold that a fit did not see: each run (or manoeuvre) in turn.

    Twice the logarithm of their predictive density, which knows how well the other windows tell
    what it rests on: a push hardly tells a weak drive from a centre of mass aside, and the best fit
    to it alone foretells a slalom wrongly.

    Args:
      plain, full: a system, and its columns that are fitted besides its nuisances.
      by: "run" or "manoeuvre". Of a part that alone shows a column every other window is left out
        in turn; where these alone show it they count 0.

    Returns:
      By how much `full` is better, in chi2.
    """
    runs, windows = bench.simulator.study.runs, bench.windows
    label = [int(full[0].run[i]) for i in windows]
    parts = np.array([str(r) if by == "run" else runs[r].manoeuvre for r in label])
    if np.unique(parts).size < 2:  # a single part: every other window
        parts = np.array([str(k % 2) for k in range(len(windows))])
    size = np.array([np.diag(full[0].G[i])[list(full[1])] for i in windows])

    # the density of all over that of the others is what the others predict of the left out
    whole = _gained(plain, full, windows)
    return sum(whole - _gained(plain, full, windows[~inside]) for inside in _left_out(parts, size))


def _gained(
    plain: tuple[System, Sequence[int]],
    full: tuple[System, Sequence[int]],
    windows: NDArray[np.int64],
) -> float:
    """By how much windows are more probable with more columns, in chi2."""
    return _evidence(*plain, windows) - _evidence(*full, windows)


def _evidence(system: System, which: Sequence[int], windows: NDArray[np.int64]) -> float:
    """Minus twice the logarithm of the evidence of windows, up to a constant."""
    use = [*range(system.nuisance), *which]
    told = bounded.information(system, windows, use)
    return bounded.solve(system, windows, which)[1] + float(np.linalg.slogdet(told)[1])


def _left_out(parts: NDArray[np.str_], size: Array) -> Iterator[NDArray[np.bool_]]:
    """Which windows (windows,) are left out together, so that the others show every column.

    Args:
      parts: (windows,). size: (windows, columns), of each column in each window.
    """
    odd = np.arange(len(parts)) % 2 == 1
    for part in np.unique(parts):
        mine = parts == part
        for inside in (mine,) if _shown(size, ~mine) else (mine & odd, mine & ~odd):
            if inside.any() and _shown(size, ~inside):
                yield inside


def _shown(size: Array, there: NDArray[np.bool_]) -> bool:
    """Whether the windows that are there show every column."""
    return bool((size[there].sum(axis=0) >= ALONE * size.sum(axis=0)).all())


def with_terms(base: Base, fitted: Fitted) -> tuple[System, list[int]]:
    """The system of a fit, and the columns of its effects; none where these are stuck."""
    if not reaches(base, fitted):
        return fitted.system, []
    return fitted.system, list(range(fitted.system.nuisance, len(fitted.system.columns)))


def held_out_gain(base: Base, fitted: Fitted, by: str = "run") -> float:
    """What a fit brings on the parts that it did not see, in chi2."""
    return held_out(base.bench, (base.plain.system, []), with_terms(base, fitted), by)


def foretold_of(base: Base, fitted: Fitted, trial: str) -> float:
    """What the effects bring on one run when they are fitted to the others, in chi2.

    Where there are no others, 0.

    Args:
      trial: name of the run.
    """
    bench = base.bench
    mine = {k for k, run in enumerate(bench.simulator.study.runs) if run.trial.name == trial}
    others = np.setdiff1d(bench.windows, bench.windows_of(mine))
    if not others.size:
        return 0.0
    full = with_terms(base, fitted)
    whole, rest = (_gained((base.plain.system, []), full, w) for w in (bench.windows, others))
    return whole - rest


def on_held_out(base: Base, fitted: Fitted, fewer: Fitted | None = None) -> rules.HeldOut | None:
    """The held-out trials before and after a fit, which has not seen them; None: there are none.

    Args:
      fewer: a fit of some of its effects, which stands for before; None: that of none of them.
    """
    held = held_windows(base)
    if not held.size:
        return None
    plain = fewer or base.plain
    before, dof = _foretold(base, plain, held)
    stands, corrected = (slow_part(f.system, held)[0] for f in (plain, fitted))
    return rules.HeldOut(
        before=before,
        after=_foretold(base, fitted, held)[0],
        dof=dof,
        changed=_changed(base, plain, fitted, held),
        farther=corrected - stands,
    )


def speaks_against(base: Base, fitted: Fitted, fewer: Fitted) -> bool:
    """Whether held-out trials, if there are any, speak against what a fit has beyond another."""
    held = on_held_out(base, fitted, fewer)
    return held is not None and not rules.carries_over(held)


def lone_run(base: Base, fitted: Fitted) -> Lone | None:
    """The held-out run that disagrees far more than every run of the fit; None: there is none."""
    held, others = [], 0.0
    for k, run in enumerate(base.bench.simulator.study.runs):
        mine = base.bench.windows_of({k})
        if not mine.size:
            continue
        if run.hold_out:
            held.append((over_noise(*_foretold(base, fitted, mine)), run.trial.name))
        else:
            others = max(others, over_noise(*slow_part(fitted.system, mine)))
    most, name = max(held, default=(0.0, ""))
    return Lone(name, most, others) if rules.shows_alone(held=most, others=others) else None


def gap_foretold(base: Base) -> float:
    """Rms over the noise of the slow residual that the chair without effects leaves.

    Of the held-out trials, as far as the others tell what is only roughly known; of all trials
    where none is held out.
    """
    held = held_windows(base)
    if held.size:
        return over_noise(*_foretold(base, base.plain, held))
    return over_noise(*slow_part(base.plain.system, base.bench.windows))


def _foretold(base: Base, fitted: Fitted, windows: NDArray[np.int64]) -> tuple[float, float]:
    """Chi2 of the slow residual of windows by what others foretell of them, and its dof.

    What is only roughly known, and the windows that were fitted to do not tell, is no gap in these:
    a centre of mass that is 10 mm aside shows in a turn, and in no coast.
    """
    count = fitted.system.nuisance
    slow = np.concatenate([fitted.system.slow[int(i)][-1] for i in windows])
    left = slow[:, 0] - slow[:, 1:] @ fitted.step[:count]
    return _beside_known(base, fitted, left, slow[:, 1:]), float(left.size)


def _changed(base: Base, plain: Fitted, fitted: Fitted, windows: NDArray[np.int64]) -> float:
    """Chi2 by which a fit foretells the slow part of windows otherwise than one of fewer effects.

    As far as the windows that were fitted to tell what is only roughly known: what a fit moved of
    it without a reason is no change by its effects.
    """
    bench = base.bench
    simulator, count = bench.simulator, plain.system.nuisance
    known = plain.system.columns[:count]
    columns = [plain.columns[c] for c in known]
    moved = fitted.step[fitted.system.index(known)] - plain.step[:count]
    parts = []
    for i in (int(w) for w in windows):
        by = residual(fitted.track.predicted[i], plain.track.predicted[i], simulator.channels)
        by[np.isnan(simulator.measured(simulator.windows[i]))] = np.nan
        stacked = np.stack([column[i] for column in columns], axis=2)
        left = eliminate_window(
            simulator, plain.track, bench.whitener, i, by, stacked, bench.process
        )
        parts.append(slow_components(left, count, bench.whitener.slow(i, BAND))[-1])
    slow = np.concatenate(parts)
    return _beside_known(base, plain, slow[:, 0] + slow[:, 1:] @ moved, slow[:, 1:])


def _beside_known(base: Base, fitted: Fitted, data: Array, columns: Array) -> float:
    """Chi2 of data (samples,) beside roughly known numbers, as far as a fit leaves these open.

    Args:
      columns: (samples, n) of the n numbers that are only roughly known.
    """
    shown, told = columns.T @ data, columns.T @ columns
    spread = bounded.covariance(fitted.system, base.bench.windows)[: shown.size, : shown.size]
    taken = shown @ np.linalg.solve(np.linalg.inv(spread) + told, shown)
    return float(data @ data - taken)


def slow_part(system: System, windows: NDArray[np.int64]) -> tuple[float, float]:
    """Chi2 of the slow residual of the windows, and its degrees of freedom."""
    cells = [system.cells[int(i)] for i in windows]
    return sum(c.total for c in cells), sum(c.total_dof for c in cells)


def over_noise(chi2: float, dof: float) -> float:
    """Rms over the noise of what has this chi2 and these degrees of freedom."""
    return float(np.sqrt(max(chi2, 0.0) / max(dof, 1.0)))


def held_windows(base: Base) -> NDArray[np.int64]:
    """The windows of the trials that are held out of every fit."""
    runs = base.bench.simulator.study.runs
    return base.bench.windows_of({i for i, r in enumerate(runs) if r.hold_out})


def plain_gap(base: Base) -> Gap:
    """Test what the chair without effects leaves, also on trials that it was not fitted to.

    What is only roughly known may take an effect for itself, and then foretells wrongly.
    """
    gap = confirmed(base, base.plain, gap_after(base, base.plain))
    if gap.exists or not held_out_shows(base):
        return gap
    return replace(gap, exists=True, only_held_out=True)


def held_out_shows(base: Base) -> bool:
    """Whether the chair without effects is far off on held-out trials, if there are any."""
    held = held_windows(base)
    return bool(held.size) and rules.foretells_wrongly(*_foretold(base, base.plain, held))
