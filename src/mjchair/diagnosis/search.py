"""Which effects: grown from one to as many as the data ask for, and held against rivals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis import linear, selection
from mjchair.diagnosis.candidates import Start
from mjchair.diagnosis.fitting import Bench, Fitted, refit
from mjchair.diagnosis.gap import Gap
from mjchair.diagnosis.linear import System
from mjchair.diagnosis.screening import Base, Say, gap_after
from mjchair.diagnosis.selection import PENALTY, Hypothesis
from mjchair.diagnosis.verdict import RIVAL_CHI2, RIVAL_ERRORS

Array = NDArray[np.float64]
MOST = 3  # effects that are added
WORTH = 15.0  # chi2 that a further effect must bring besides the penalty of its parameters
ENOUGH = 0.93  # closure beyond which a further effect must bring more than
SHARE = 0.02  # of what is already gained: an effect's own form is no better known
TIE = 6.0  # chi2 within which hypotheses fit alike
SURE = 6.0  # standard errors beyond which an effect is not tried without
TRIED = 3  # hypotheses of one size, where the first leaves a gap
REFITTED = 5  # rivals of one effect
SHORT = 0.1  # of what the linear fit promised: a fit that misses more starts again elsewhere
ALONE = 0.05  # share of a column that the other parts must show, for a part to be held out


@dataclass(frozen=True)
class Rival:
    """A hypothesis that the data do not rule out, and its fit."""

    hypothesis: Hypothesis
    fitted: Fitted


@dataclass
class Choice:
    """What was chosen.

    Attributes:
      hypothesis: effects. fitted: their fit, everything made anew around it.
      after: the gap that is left with one effect, with two, and so on; the last is the choice's.
      rivals: for every effect, what could stand in its place, best first.
    """

    hypothesis: Hypothesis
    fitted: Fitted
    after: list[Gap]
    rivals: list[list[Rival]]


def choose(base: Base, gap: Gap, say: Say) -> Choice | None:
    """Grow from one effect to as many as the data ask for; None: no effect brings anything."""
    options = [selection.singles(base.reduced, base.starts)]
    if not options[0] or options[0][0].score <= 0.0:
        return None
    options.append(selection.pairs(base.reduced, base.starts))
    best: tuple[Hypothesis, Fitted] | None = None
    after: list[Gap] = []
    for size in range(1, MOST + 1):
        if size == MOST:
            bases = [h.starts for h in options[1][:3]]
            options.append(selection.grown(base.reduced, base.starts, bases))
        if not options[size - 1] or options[size - 1][0].score <= 0.0:
            break
        top, fitted, left = _best_of(base, options[size - 1], say)
        if best is not None and not _worth(gap, base, best, after[-1], (top, fitted)):
            break
        best = (top, fitted)
        after.append(left)
        if not after[-1].exists:
            break
    assert best is not None
    hypothesis, fitted = _dropped(base, *best, say)
    rivals = _rivals(base, hypothesis, fitted, say)
    say("the last fit, with everything made anew around it")
    fitted = refit(base.bench, fitted.fit, fitted.track)
    after[-1] = gap_after(base, fitted)[0]
    return Choice(hypothesis, fitted, after, rivals)


def _best_of(base: Base, options: Sequence[Hypothesis], say: Say) -> tuple[Hypothesis, Fitted, Gap]:
    """The best hypothesis, its fit, and the gap that it leaves.

    Where the first leaves a gap, the linear order may be wrong, and the next are fitted as well.
    """
    top = _commonest(base, options)
    fitted = _refit(base, top, say)
    left = gap_after(base, fitted)[0]
    if not left.exists:
        return top, fitted, left
    first = top
    for other in [h for h in options if h.keys != first.keys][: TRIED - 1]:
        found = _refit(base, other, say)
        if found.total + PENALTY * other.free < fitted.total + PENALTY * top.free:
            top, fitted = other, found
    return top, fitted, left if top is first else gap_after(base, fitted)[0]


def _worth(
    gap: Gap,
    base: Base,
    best: tuple[Hypothesis, Fitted],
    left: Gap,
    more: tuple[Hypothesis, Fitted],
) -> bool:
    """Whether a larger hypothesis brings enough."""
    gained = best[1].total - more[1].total
    if gained < PENALTY * (more[0].free - best[0].free) + WORTH:
        return False
    share = gained / max(gain(base, best[1]), 1.0)
    return closure(gap, base, best[1], left) < ENOUGH or share > SHARE


def _dropped(
    base: Base, hypothesis: Hypothesis, fitted: Fitted, say: Say
) -> tuple[Hypothesis, Fitted]:
    """The hypothesis without the effects that it can do without."""
    for start in hypothesis.starts if len(hypothesis.starts) > 1 else ():
        fewer = selection.weigh(base.reduced, [s for s in hypothesis.starts if s is not start])
        needed = PENALTY * (hypothesis.free - fewer.free) + WORTH
        sure = fitted.sigmas[start.effect.key] > SURE
        if sure and hypothesis.gain - fewer.gain > 3.0 * needed:
            continue  # far from it already by linear algebra
        other = _refit(base, fewer, say)
        if other.total - fitted.total < needed:
            return _dropped(base, fewer, other, say)
    return hypothesis, fitted


def _commonest(base: Base, options: Sequence[Hypothesis]) -> Hypothesis:
    """Of the hypotheses that fit alike, the one whose effects stand first in the library."""
    order = {s.effect.key: k for k, s in reversed(list(enumerate(base.starts)))}
    alike = [h for h in options if h.score > options[0].score - TIE]
    best = min(alike, key=lambda h: sorted(order[k] for k in h.keys))
    for start in best.starts:
        best = _freed(base, best, start)
    return best


def _freed(base: Base, hypothesis: Hypothesis, start: Start) -> Hypothesis:
    """The hypothesis with more of an effect's parameters free, where others of them fit alike.

    A left drive 3 % weak and a right one 3 % strong differ by what the mass may be: then neither
    number alone has the uncertainty that it shows.
    """
    others = tuple(s for s in hypothesis.starts if s is not start)
    same = [s for s in base.starts if s.group == start.group and s.effect.seeds is None]
    weighed = {s.columns: selection.weigh(base.reduced, (*others, s)) for s in same}
    alike = {
        column
        for columns, h in weighed.items()
        if len(columns) <= len(start.columns) and h.score > hypothesis.score - TIE
        for column in columns
    }
    richer = [c for c in weighed if alike <= set(c)]
    return weighed[min(richer, key=len)] if len(alike) > len(start.columns) else hypothesis


def _refit(base: Base, hypothesis: Hypothesis, say: Say) -> Fitted:
    """The nonlinear fit; from a second start where the first misses what was promised."""
    say("fit of " + " and ".join(hypothesis.keys))
    first = _from(base, hypothesis, 1.0)
    promised = base.reduced.total - hypothesis.gain
    if first.total - promised < max(SHORT * hypothesis.gain, WORTH):
        return first
    second = _from(base, hypothesis, 0.5)
    return min(first, second, key=lambda f: f.total)


def _from(base: Base, hypothesis: Hypothesis, share: float) -> Fitted:
    terms = selection.terms(base.reduced, hypothesis, share)
    return refit(base.bench, replace(base.fit, terms=terms), base.track, base.nuisances)


def gain(base: Base, fitted: Fitted) -> float:
    """Drop of chi2 that the effects bring."""
    return base.plain.total - fitted.total


def closure(gap: Gap, base: Base, fitted: Fitted, after: Gap) -> float:
    """Share of the excess that a fit closes.

    The excess is the slow part of the residual above what noise gives, where that is known well
    enough; a small gap is below its scatter, and then what the fit gains is held against the most
    that any further test finds.
    """
    brought = gain(base, fitted)
    left = max(
        (t.statistic - t.dof for t in after.tests if t.kind != "cell" and t.sigmas > 3.5),
        default=0.0,
    )
    share = brought / max(brought + max(left, 0.0), 1e-9)
    if gap.excess > 6.0 * gap.excess_std:
        share = min(share, 1.0 - max(after.excess - after.excess_std, 0.0) / gap.excess)
    return float(np.clip(share, 0.0, 1.0))


def _rivals(base: Base, chosen: Hypothesis, fitted: Fitted, say: Say) -> list[list[Rival]]:
    """For every effect of the choice: what could stand in its place, best first."""
    out = []
    for start in chosen.starts:
        others = tuple(s for s in chosen.starts if s is not start)
        near = [h for h in _replacements(base, start, others) if _close(chosen, h)]
        kept = []
        for h in near[:REFITTED]:
            other = _refit(base, h, say)
            if other.at_bound and not fitted.at_bound:
                continue  # it would have to be larger than it can be
            behind = other.total - fitted.total + PENALTY * (h.free - chosen.free)
            if behind < RIVAL_CHI2 or _paired(other.chi2, fitted.chi2) < RIVAL_ERRORS:
                kept.append(Rival(h, other))
        out.append(kept)
    return out


def _replacements(base: Base, start: Start, others: tuple[Start, ...]) -> list[Hypothesis]:
    """The others with another effect instead of `start`, best first."""
    taken = {start.effect.key, *(s.effect.key for s in others)}
    pool: dict[str, Hypothesis] = {}
    for other in base.starts:
        key = other.effect.key
        if key in taken:
            continue
        found = selection.weigh(base.reduced, (*others, other))
        if not np.isfinite(found.score) or not selection.physical(base.reduced, found):
            continue
        if key not in pool or found.score > pool[key].score:
            pool[key] = found
    return sorted(pool.values(), key=lambda h: -h.score)


def _paired(theirs: Array, ours: Array) -> float:
    """How many standard errors, over windows, theirs is worse."""
    difference = theirs - ours
    spread = (
        float(difference.std(ddof=1)) * np.sqrt(difference.size) if difference.size > 1 else 1.0
    )
    return float(difference.sum() / max(spread, 1e-9))


def _close(chosen: Hypothesis, other: Hypothesis) -> bool:
    behind = chosen.score - other.score
    if behind < RIVAL_CHI2:
        return True
    return behind < 3.0 * RIVAL_ERRORS * np.sqrt(max(chosen.gain - other.gain, 0.0)) and (
        other.gain > 0.8 * chosen.gain
    )


def held_out(
    bench: Bench,
    plain: tuple[System, Sequence[int]],
    full: tuple[System, Sequence[int]],
    by: str = "run",
) -> Array:
    """Drop of chi2 on windows that a fit did not see: each run (or manoeuvre) in turn.

    Args:
      plain, full: a system, and its columns that are fitted besides its nuisances.
      by: "run" or "manoeuvre". A part that alone shows a column is not held out; it counts 0.

    Returns:
      (windows,) of those that are fitted to.
    """
    runs, windows = bench.shooter.study.runs, bench.windows
    label = [int(full[0].run[i]) for i in windows]
    parts = np.array([str(r) if by == "run" else runs[r].manoeuvre for r in label])
    if np.unique(parts).size < 2:  # a single part: every other window
        parts = np.array([str(k % 2) for k in range(len(windows))])
    size = np.array([np.diag(full[0].G[i])[list(full[1])] for i in windows])
    gains = np.zeros(len(windows))
    for part in np.unique(parts):
        inside = parts == part
        if (size[~inside].sum(axis=0) < ALONE * size.sum(axis=0)).any():
            continue
        before, after = (linear.fit(s, windows[~inside], c)[0] for s, c in (plain, full))
        for k in np.flatnonzero(inside):
            i = int(windows[k])
            gains[k] = linear.chi2(plain[0], i, before) - linear.chi2(full[0], i, after)
    return gains


def held_out_gain(base: Base, fitted: Fitted, by: str = "run") -> float:
    """Drop of chi2 that a fit brings on the parts that it did not see."""
    n = fitted.system.nuisance
    terms = range(n, len(fitted.system.names))
    return float(
        held_out(base.bench, (base.plain.system, []), (fitted.system, list(terms)), by).sum()
    )
