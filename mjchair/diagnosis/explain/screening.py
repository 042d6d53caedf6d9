"""The chair as it was given, and every column around it: effects, forces, what is roughly known.

In: a study and effects. Out: a `Base`, on which everything after it rests.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from mjchair.diagnosis import rules
from mjchair.diagnosis.data import first_state, roughly_known
from mjchair.diagnosis.data.standstill import ROCKS
from mjchair.diagnosis.data.study import Study, with_copied_wheels, without_runs
from mjchair.diagnosis.data.windows import calm, shimmying
from mjchair.diagnosis.explain import (
    candidates,
    hypotheses,
    missing_force,
    noise_shown,
    search_rules,
)
from mjchair.diagnosis.explain import gap as gaps
from mjchair.diagnosis.explain.candidates import Around, Start
from mjchair.diagnosis.explain.gap import Gap
from mjchair.diagnosis.explain.hypotheses import Hypothesis
from mjchair.diagnosis.explain.in_each_run import ActingIn, best_run, columns_of
from mjchair.diagnosis.fit import bounded
from mjchair.diagnosis.fit.bench import Bench
from mjchair.diagnosis.fit.bounded import Reduced
from mjchair.diagnosis.fit.column_ids import ColumnId
from mjchair.diagnosis.fit.nonlinear import Fitted, moved, on_bound, refit
from mjchair.diagnosis.fit.parameter_columns import nuisance_columns
from mjchair.diagnosis.fit.system import System
from mjchair.diagnosis.fit.variant import Term, Variant
from mjchair.diagnosis.replay import noise, noise_left, tipping
from mjchair.diagnosis.replay.cache import Store
from mjchair.diagnosis.replay.derivatives import Column
from mjchair.diagnosis.replay.pulses import pulse_answers, pulses
from mjchair.diagnosis.replay.simulator import WindowSimulator
from mjchair.diagnosis.replay.window_states import Track, track
from mjchair.effects.effect import Effect, SensorError
from mjchair.errors import MjchairError

Say = Callable[[str], None]
NEAR = 0.5  # prior standard deviations that columns of nuisances are good for
SEEN = 1.0  # sigmas that one standard deviation of a nuisance changes
LOUD = 0.01  # share of the power that may shake a chair: below it noise hides nothing
QUIETER = 0.25  # of the power of what shakes the chair: an explanation that leaves less is right
PROMISES = 0.5  # of that power: fits are made where linear algebra leaves less than this share
ROUNDS = 4  # of the fit of what may be no noise: where it is right they are enough
TRIED, OF_A_SIZE = 6, 3  # hypotheses, and of one size, that are fitted until one holds
AT_REST = 0.01  # m/s^2, bias of an accelerometer that was seen at rest


@dataclass(frozen=True)
class Found:
    """Effects that were found before the search, with their fit."""

    starts: tuple[Start, ...]
    fitted: Fitted


@dataclass(kw_only=True)
class Base:
    """A chair without any effect, and every column around it.

    Attributes:
      bench: with what. plain: the best such chair.
      around: where effects are screened: that chair, or the chair as given.
      nuisances: their columns. columns: of effects and forces. starts: what the effects' columns
        mean. dropped: a line for each effect that could not be tried.
      system, reduced: the linear algebra of them all.
      found: effects without which they passed for noise; None: noise hides none.
      best: the hypothesis of any size that is best by linear algebra, fitted while the noise was
        sought; None: none brings enough, or this chair cannot have it.
      anew: keys of effects -> the columns of others around their fit (columns_anew.py).
      looked: what was seen at whole sizes (whole_sizes.py), which are looked at twice.
      patience: times the usual number of steps that the search may simulate.
    """

    bench: Bench
    plain: Fitted
    around: Around
    nuisances: dict[ColumnId, Column]
    columns: dict[ColumnId, Column]
    starts: list[Start]
    dropped: list[str]
    system: System
    reduced: Reduced
    found: Found | None = None
    best: Found | None = None
    anew: dict[frozenset[str], dict[ColumnId, Column]] = field(default_factory=dict)
    looked: dict[Hashable, Any] = field(default_factory=dict, init=False)
    patience: float = 1.0

    @cached_property
    def acting_alone(self) -> ActingIn | None:
        """The run in which one effect alone brings most, by linear algebra; None: none does.

        The gain of a sensor is the same in every run. Where a caster turned over to the other side,
        a gain of its angle is as well what linear algebra makes of that.
        """
        lasting = [s for s in self.starts if s.effect.sensor is not SensorError.SCALE]
        return best_run(self.system, self.bench.windows, lasting)

    def columns_around(self, fitted: Fitted) -> dict[ColumnId, Column]:
        """The columns of effects and forces, as near to a fit as they were made."""
        keys = {t.effect.key for t in fitted.variant.terms}
        nearest = max((k for k in self.anew if k <= keys), key=len, default=frozenset())
        return {**self.columns, **self.anew.get(nearest, {})}


def silent(_: str) -> None:
    """Say nothing."""


def prepare(
    study: Study, say: Say = silent, store: Store | None = None, threads: int = 0
) -> tuple[Bench, Track]:
    """Windows, their states, the noise, and what is only roughly known."""
    simulator = _of_windows(with_copied_wheels(study), store, threads)
    study = simulator.study
    known = noise.estimate(study)
    say("states along the runs")
    first = track(simulator, simulator.base, known)
    given = dict(study.nuisance)
    # at rest the accelerometer showed its bias
    stops = any(first_state.stops(run) for run in study.runs)
    if stops and "bias:imu_accelerometer" not in given:
        given.setdefault("bias:imu_accelerometer.x", AT_REST)
    nuisances = roughly_known.nuisances(study.channels, given, study.driven_as_measured)
    noises = noise_left.refined(simulator, first, known)
    tips = tipping.tipped(simulator, first)
    return Bench(simulator, noises, nuisances, tipped=tips), first


def _of_windows(study: Study, store: Store | None, threads: int) -> WindowSimulator:
    """A simulator of the runs that have a window; a note says which have none.

    Raises:
      MjchairError: no run that is fitted to has one.
    """
    simulator = WindowSimulator(study, store=store, threads=threads)
    used = {w.run for w in simulator.windows}
    empty = [run for i, run in enumerate(study.runs) if i not in used]
    why = (
        "{}: too few samples are left once start, stops and end are taken off (of a stand the "
        f"first {ROCKS:g} s do not count)"
    )
    known = without_runs(study, empty, why)
    if known is study:
        return simulator
    return WindowSimulator(known, store=store, threads=threads)


def screen_columns(
    bench: Bench, first: Track, effects: Sequence[Effect], say: Say = silent
) -> Base:
    """Every column around a chair without effects, and the linear algebra of them all.

    Raises:
      MjchairError: the runs have too few samples to tell anything.
    """
    simulator, variant, here = bench.simulator, Variant(bench.nuisances), first
    say("what is only roughly known")
    nuisances = nuisance_columns(bench, first, variant)
    say("answers to forces")
    asked = pulses(simulator)
    answers = pulse_answers(simulator, first, asked, variant.edit)
    say("the noise that the study shows")
    bench = noise_shown.with_shown_noise(bench, first, nuisances, asked, answers)
    plain = refit(bench, variant, first, nuisances)
    if _farthest(plain) > NEAR:
        plain = refit(bench, plain.variant, plain.track)
    _check_told(plain)
    # a nuisance far from its prior stands in for something else: then the chair as given is nearer,
    # as it is where casters shimmy: the stiffness of their tires stood in for a relaxation length
    if not shimmying(simulator.windows) and not rules.is_far(_farthest(plain)):
        variant, here, nuisances = plain.variant, plain.track, plain.columns
    around = Around(bench=bench, track=here, variant=variant, pulses=asked, answers=answers)
    tried = candidates.collect(around, effects, lambda key: say(f"effect {key}"))
    columns = {
        **tried.columns,
        **missing_force.driver_columns(bench, here, around.pulses, around.answers),
    }
    system = bench.system(here, {**nuisances, **columns}, len(nuisances), variant)
    screened = Base(
        bench=bench,
        plain=plain,
        around=around,
        nuisances=nuisances,
        columns=columns,
        starts=tried.starts,
        dropped=tried.dropped,
        system=system,
        reduced=bounded.reduce(system, bench.windows),
    )
    say("the noise that the best effects leave")
    return _with_noise_left(screened)


def _with_noise_left(base: Base) -> Base:
    """The base with the noise that its best hypothesis leaves.

    What comes and goes, as a patch of the floor does, passes for noise at first, and this noise
    then hides what makes it. So where the chair seems to be shaken, the best hypothesis of a chair
    that hardly is stands beside it; it is right where it leaves far less.
    """
    options = best_of_sizes(base.reduced, base.starts)
    bench, best = _noise_left(base, base.bench, base.reduced, options)
    loud = noise_shown.loudness(bench)
    if loud > LOUD:
        hushed = noise_shown.hushed(base.bench)
        quiet = _reduced_anew(_on(base, hushed))
        options = best_of_sizes(quiet.reduced, base.starts)
        if _may_be_quieter(base, options, loud):
            quieter, other = _noise_left(base, hushed, quiet.reduced, options)
            if noise_shown.loudness(quieter) < QUIETER * loud:
                bench, best = quieter, other
        bench = _quieter_but_for_one_run(base, quiet, noise_shown.loudness(bench)) or bench
    return replace(with_noise(base, bench), best=best)


def _quieter_but_for_one_run(base: Base, quiet: Base, loud: float) -> Bench | None:
    """The bench with the noise that an effect in one run alone leaves; None: that is not far less.

    A force that stays for all of a run passes for noise as well: of four runs with a push of 8 N in
    one, all seem to be shaken by 2 N.

    Args:
      quiet: the base in which hardly anything shakes the chair. loud: how much does so far.
    """
    if loud <= LOUD:
        return None
    acting = quiet.acting_alone
    if acting is None or acting.score <= 0.0:
        return None
    own = columns_of(acting, base.system.run, base.columns)
    bench, _ = noise_shown.left_by(base.bench, base.around.track, base.nuisances, own)
    return bench if noise_shown.loudness(bench) < QUIETER * loud else None


def _may_be_quieter(base: Base, options: Sequence[Hypothesis], loud: float) -> bool:
    """Whether any hypothesis may leave far less noise than there is, by linear algebra.

    The fits that tell it for sure take up to a third of a diagnosis, and linear algebra is right
    within a factor of two. It is not where the noise is all that is believed of it: a wheel slides.
    """
    if loud >= 1.0:
        return True
    return any(
        noise_shown.loudness(_left_by_columns(base, h)) < PROMISES * loud for h in options[:TRIED]
    )


def _left_by_columns(base: Base, hypothesis: Hypothesis) -> Bench:
    """The bench with the noise that a hypothesis leaves by linear algebra alone."""
    own: dict[ColumnId, Column] = {c: base.columns[c] for c in hypothesis.columns}
    return noise_shown.left_by(base.bench, base.around.track, base.nuisances, own)[0]


def with_noise(base: Base, bench: Bench) -> Base:
    """The base with the noise of another bench: the best chair without effects, and all columns."""
    plain = refit(bench, base.plain.variant, base.plain.track, base.plain.columns)
    return _reduced_anew(replace(_on(base, bench), plain=plain))


def _on(base: Base, bench: Bench) -> Base:
    """The base with another bench."""
    return replace(base, bench=bench, around=replace(base.around, bench=bench))


def _noise_left(
    base: Base, bench: Bench, reduced: Reduced, options: Sequence[Hypothesis]
) -> tuple[Bench, Found | None]:
    """The bench with the noise that the best hypothesis leaves, and its fit where one was made.

    Where it gains enough to be added to an answer, it is fitted first: what linear algebra gets
    wrong of an effect would pass for noise, and noise hides how large the effect is.

    Args:
      bench, reduced: by which the best is found and fitted. options: the best first.
    """
    here = base.around.track
    found = _first_that_holds(base, bench, reduced, options)
    own: dict[ColumnId, Column] = {c: base.columns[c] for h in options[:1] for c in h.columns}
    if found is not None:
        here, own = found.fitted.track, effects_of(base, found.fitted)
    return noise_shown.left_by(base.bench, here, base.nuisances, own)[0], found


def _first_that_holds(
    base: Base, bench: Bench, reduced: Reduced, options: Sequence[Hypothesis]
) -> Found | None:
    """The fit of the first hypothesis that holds, or the best fit; None: no chair can be so.

    It holds where it brings about what linear algebra promises of it, and pushes nothing to where
    it cannot be. Effects that are nearly alike may come out large and opposed to one another by
    linear algebra, and where one effect of several is missing, others go to their ends for it. So
    what linear algebra puts on a bound waits, and is fitted only where it promises less than what
    holds without it leaves.
    """
    worth = [h for h in options[:TRIED] if h.gain > search_rules.needed(h.free)]
    far = {h.name for h in worth if any(map(on_bound, hypotheses.terms(reduced, h)))}
    made: list[tuple[float, Found]] = []
    inside = _holding(base, bench, reduced, [h for h in worth if h.name not in far], made)
    outside = [h for h in worth if h.name in far and _promises_more(reduced, h, inside)]
    holds = _holding(base, bench, reduced, outside, made) or inside
    if holds is not None or not made:
        return holds
    return min(made, key=lambda m: m[0])[1]


def _promises_more(reduced: Reduced, h: Hypothesis, found: Found | None) -> bool:
    """Whether a hypothesis promises to leave clearly less than what was found leaves."""
    return (
        found is None or reduced.total - h.gain + search_rules.needed(h.free) < found.fitted.total
    )


def _holding(
    base: Base,
    bench: Bench,
    reduced: Reduced,
    options: Sequence[Hypothesis],
    made: list[tuple[float, Found]],
) -> Found | None:
    """The fit of the first hypothesis that holds; None: none does.

    Args:
      made: takes what each other fit leaves, with its penalty, and the fit.
    """
    ended: list[Term] = []
    for h in options:
        start = starting_variant(base, reduced, h)
        start = replace(start, terms=_off_bounds(start.terms, ended))
        reach = search_rules.short_of(promised=reduced.total - h.gain, gain=h.gain)
        try:
            fitted = refit(
                bench,
                start,
                base.around.track,
                base.nuisances,
                ROUNDS,
                reach=reach,
                nothing=reduced.total,
            )
        except (MjchairError, np.linalg.LinAlgError):
            continue  # these effects this chair cannot have
        found = Found(h.starts, fitted)
        settled = search_rules.has_settled(total=fitted.total, promised=fitted.promised)
        pushed = fitted.at_bound or bounded.at_walls(fitted.variant.offsets)
        if settled and fitted.total < reach and not pushed:
            return found
        made.append((fitted.total + h.penalty, found))
        ended += fitted.variant.terms
    return None


def starting_variant(
    base: Base, reduced: Reduced, hypothesis: Hypothesis, share: float = 1.0
) -> Variant:
    """The chair where a fit begins: at a share of what linear algebra makes of the effects.

    What is only roughly known is where linear algebra has it beside them; where it asks for more of
    an effect than there can be, it tells nothing of that.
    """
    around = base.around.variant
    terms = hypotheses.terms(reduced, hypothesis, share)
    if any(map(on_bound, terms)):
        return replace(around, terms=terms)
    beside = moved(around, base.system, reduced.step(reduced.index(hypothesis.columns))[0]).offsets
    known = around.offsets
    offsets = {n: (1.0 - share) * known.get(n, 0.0) + share * by for n, by in beside.items()}
    return replace(around, offsets=offsets, terms=terms)


def _off_bounds(terms: Sequence[Term], ended: Sequence[Term]) -> tuple[Term, ...]:
    """Terms; one that linear algebra puts on a bound is as it ended in the fit before."""
    known = {id(t.effect): t for t in ended}
    return tuple(known.get(id(t.effect), t) if on_bound(t) else t for t in terms)


def _reduced_anew(base: Base) -> Base:
    """The base with the linear algebra of all its columns made anew."""
    around, bench = base.around, base.bench
    every = {**base.nuisances, **base.columns}
    system = bench.system(around.track, every, len(base.nuisances), around.variant)
    return replace(base, system=system, reduced=bounded.reduce(system, bench.windows))


def best_of_sizes(reduced: Reduced, starts: Sequence[Start]) -> list[Hypothesis]:
    """The best hypotheses of each size that bring anything, by linear algebra, best first."""
    firsts = (h for options in hypotheses.by_size(reduced, starts) for h in options[:OF_A_SIZE])
    return sorted((h for h in firsts if h.score > 0.0), key=lambda h: -h.score)


def _check_told(plain: Fitted) -> None:
    """Refuse runs whose samples tell no more than how each window begins."""
    if sum(cells.total_dof for cells in plain.system.cells) <= 0.0:
        raise MjchairError(
            "the runs have too few samples to tell anything: every 2 s of a run frees where it is "
            "and how fast it rolls; measure more often, or add channels"
        )


def _farthest(plain: Fitted) -> float:
    """The largest distance of a nuisance from its prior, of those that the data see."""
    back = plain.system.back
    seen = np.sqrt(np.diag(plain.system.G.sum(axis=0)))[: len(back)] > SEEN
    return float(np.abs(back[seen]).max(initial=0.0))


def nuisances_of(base: Base, fitted: Fitted) -> dict[ColumnId, Column]:
    """Of the columns of a fit, those of what is only roughly known."""
    return {c: fitted.columns[c] for c in base.nuisances}


def effects_of(base: Base, fitted: Fitted) -> dict[ColumnId, Column]:
    """Of the columns of a fit, those of its effects."""
    return {c: column for c, column in fitted.columns.items() if c not in base.nuisances}


def system_around(
    base: Base, bench: Bench, fitted: Fitted, first: Mapping[ColumnId, Column] | None = None
) -> System:
    """All columns around a fit whose effects are free, with the noise of a bench.

    Args:
      first: nuisances that stand before all others.
    """
    before = first or {}
    count = len(before) + len(fitted.columns)
    columns = {**before, **fitted.columns, **base.columns_around(fitted)}
    free = len(fitted.columns) - len(base.nuisances)
    return bench.system(fitted.track, columns, count, fitted.variant, free=free)


def gain(base: Base, fitted: Fitted) -> float:
    """Drop of chi2 that the effects bring."""
    return base.plain.total - fitted.total


def reaches(base: Base, fitted: Fitted) -> bool:
    """Whether a fit gets to what its own step promises; one that does not is judged as it is."""
    gained = gain(base, fitted)
    return search_rules.reaches(total=fitted.total, promised=fitted.promised, gain=gained)


def overstated(base: Base) -> float:
    """Chi2 by which linear algebra begins above the chair without effects, once that is fitted.

    Where what is only roughly known lies far away, columns stand around the chair as given, and
    every linear gain counts what the fit of these numbers alone brings.
    """
    return max(0.0, base.reduced.total - base.plain.total)


def goes_far(fitted: Fitted) -> bool:
    """Whether anything that is only roughly known is far from what it is known to be."""
    return any(rules.is_far(by) for by in fitted.variant.offsets.values())


def gap_after(base: Base, fitted: Fitted) -> Gap:
    """Test what a fit leaves, with its own parameters free where it reaches what it promises."""
    system, windows = tested(base, fitted)
    keys = [t.effect.key for t in fitted.variant.terms]
    return gaps.test_gap(base.bench, system, windows, keys, gain(base, fitted))


def tested(
    base: Base, fitted: Fitted, first: Mapping[ColumnId, Column] | None = None
) -> tuple[System, list[int]]:
    """The system, and its windows, by which what a fit leaves is tested.

    A caster that shimmies hangs on so little that no fit leaves noise alone there. Once an effect
    is in that makes it shimmy, only the other windows tell of what is missing besides. Where a fit
    ended far above what its own step promises, its parameters do not get there, and are held: a
    slope and a toe together were laid to a wind, of a size that no wind can have.

    Args:
      first: nuisances that stand before all others.
    """
    bench, terms = base.bench, fitted.variant.terms
    if reaches(base, fitted):
        system = system_around(base, bench, fitted, first)
    else:
        nuisances = {**(first or {}), **nuisances_of(base, fitted)}
        every = {**nuisances, **base.columns_around(fitted)}
        system = bench.system(fitted.track, every, len(nuisances), fitted.variant)
    made = any(p.whole for term in terms for _, p in term.parameters)
    return system, calm(bench.simulator.windows, bench.windows) if made else bench.windows.tolist()
