"""Notes of a diagnosis: what was assumed or noticed, one sentence each.

In: the chair as it was with its gap, the choice of effects and the verdict. Out: lines of text.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from mjchair.diagnosis import rules
from mjchair.diagnosis.data.roughly_known import Nuisance
from mjchair.diagnosis.explain import event, noise_shown
from mjchair.diagnosis.explain.choice import Choice
from mjchair.diagnosis.explain.column_ids import Quantity
from mjchair.diagnosis.explain.gap import Gap
from mjchair.diagnosis.explain.one_run import InOneRun
from mjchair.diagnosis.explain.run_by_run import Uneven
from mjchair.diagnosis.explain.screening import Base
from mjchair.diagnosis.fit import bounded, process
from mjchair.diagnosis.fit.bench import Bench
from mjchair.diagnosis.fit.column_ids import ParameterId
from mjchair.diagnosis.fit.nonlinear import Fitted, at_end, open_upwards
from mjchair.diagnosis.fit.variant import Term
from mjchair.diagnosis.result import MissingForce
from mjchair.diagnosis.rules import Verdict
from mjchair.effects.effect import SensorError
from mjchair.effects.left_and_right import DIFFERENCE, SIDES
from mjchair.units import per_cent, with_unit

FAR_GAIN = 2.0  # standard deviations of a sensor's gain, from which it is told
NEAR = 1.5  # times the noise that was given: of what is nearer nothing is said
ANSWERS = (Verdict.NAMED, Verdict.AMBIGUOUS)
TOP = 3  # drivers of a missing force that are worth a word


def notes_on(
    base: Base,
    gap: Gap,
    choice: Choice | None,
    stands: rules.Standing | None,
    *,
    said: Verdict,
    left: list[MissingForce],
    alone: InOneRun | None,
) -> list[str]:
    """All notes but those of single answers.

    Args:
      said: the verdict. left: what the missing force goes with, strongest first.
      alone: what explains more in one run alone.
    """
    study = base.bench.simulator.study
    notes = list(study.notes)
    if study.unplaced:
        notes.append(
            f"where {', '.join(study.unplaced)} starts is neither measured nor given; no place on "
            "the floor is looked for, such as a surface_patch ([trial.initial] gives a position)"
        )
    for channel, noise in base.bench.noise.items():
        given = study.noise_given(channel)
        if given is not None and not 1.0 / NEAR < noise.total / given < NEAR:
            notes.append(
                f"noise of {channel}: {noise.total:.3g} (SI) is left by the best fit, and not the "
                f"{given:.3g} that study.toml gives; {noise.total:.3g} is used"
            )
        elif given is None and channel not in study.copied:
            notes.append(f"noise of {channel}: {noise.total:.3g} (SI), from {noise.source}")
    notes += _of_tipping(base.bench)
    notes += base.dropped
    notes += choice.dropped if choice else []
    if choice is not None and choice.unfinished:
        notes.append(
            "the search for further effects ended before all were tried, since it had become long; "
            f"--patience {2.0 * base.patience:g} goes on for longer"
        )
    notes += [
        f"{name} stands at {bounded.WALL:g} standard deviations from what the study says of it: "
        "something is missing there, or the study is wrong about it"
        for name in (bounded.at_walls(choice.fitted.variant.offsets) if choice else [])
    ]
    if said != Verdict.UNKNOWN:  # what is missing may have moved them
        notes += _of_gains(choice.fitted if choice else base.plain)
    if choice is not None and said in ANSWERS:
        terms = choice.fitted.variant.terms
        said_of = [(term.effect.name, remark(choice.fitted, term)) for term in terms]
        notes += [f"{name}: {line}" for name, line in said_of if line]
    if choice is not None and (
        said in ANSWERS or (said == Verdict.UNKNOWN and choice.fitted.at_bound)
    ):
        terms = choice.fitted.variant.terms
        notes += [line for term in terms for line in _at_ends(term, choice.fitted.std)]
    notes += _as_loud_as_believed(base.bench)
    if alone is not None:
        notes.append(of_one_run(alone, choice))
    if said != Verdict.UNKNOWN or alone is not None:
        return notes
    if choice is not None and stands is not None:
        notes.append(no_answer(choice, stands))
    once = event.explaining(base, gap)
    if once is not None:
        most = max(t.statistic for t in gap.tests)
        notes.append(of_event(once, min(once.gain / most, 1.0)))
    elif any(force.goes_with.quantity == Quantity.STROKE for force in left[:TOP]):
        notes.append(
            "the missing force comes back with every stroke: chair and rider are not one rigid "
            "body, and what of the rider moves, and how heavy it is, these channels do not tell"
        )
    return notes


def _at_ends(term: Term, std: Mapping[ParameterId, float]) -> Iterator[str]:
    """The parameters of an effect that ended on the bounds of what is believed.

    A number that says where an effect acts may lie there for want of data, without a word.
    """
    for key in at_end(term):
        p = term.effect.parameter(key.parameter)
        if not p.sized and not rules.is_far(
            (term.values[p.name] - p.neutral) / std.get(key, math.inf)
        ):
            continue
        value = with_unit(term.values[p.name], p.unit)
        yield (
            f"{term.effect.name}: {p.name} ends at {value}, the end of what is believed of it; "
            "something else may act like it"
        )


def _as_loud_as_believed(bench: Bench) -> Iterator[str]:
    """What shakes the chair as much as is believed of it: more may hide there."""
    for name in noise_shown.at_most(bench, noise_shown.SHAKING):
        assert bench.process is not None
        level = f"{process.level(bench.process.levels, name):.2g}"
        yield (
            f"what shakes the chair ({name.replace('_', ' ')}) stands at "
            f"{with_unit(level, process.NAMED[name][1])}, the most that is believed of it: a "
            "steady force may hide there ([noise] in study.toml sets it)"
        )


def _of_tipping(bench: Bench) -> Iterator[str]:
    """What is left out since the chair tips there, where no channel shows that it did."""
    for i, lean in bench.tipped.items():
        w = bench.simulator.windows[i]
        yield (
            f"{bench.simulator.study.runs[w.run].trial.name}: between {w.first:.3g} and "
            f"{w.last:.3g} s the chair of the model tips, by {math.degrees(lean):.2g} degrees, and "
            "nothing of this is fitted to; a person leans forward under a hard push: measure how "
            "they move (docs/rider.md), or see whether [chair] has the axle and the centre of mass "
            "where they are"
        )


def _of_gains(fitted: Fitted) -> list[str]:
    """A note on each sensor whose gain is far from one, for which its prior may stand in doubt."""
    return [
        f"{n.channel} shows {100.0 * n.std * abs(by):.2g} % too {'much' if by > 0.0 else 'little'} "
        f"by these runs, {abs(by):.1f} standard deviations of what its gain is known to: calibrate "
        f'it, or give "{n.name}" in [nuisance] where it is known better'
        for n, by in far_gains(fitted)
    ]


def far_gains(fitted: Fitted) -> list[tuple[Nuisance, float]]:
    """The gains of sensors that are far from one, with the standard deviations by which."""
    moved = [(n, by) for n, by in fitted.moved if n.channel and n.error is SensorError.SCALE]
    return [(n, by) for n, by in moved if abs(by) >= FAR_GAIN]


def no_answer(choice: Choice, stands: rules.Standing) -> str:
    """A note on the nearest effects, which are no answer."""
    names = " and ".join(t.effect.key for t in choice.fitted.variant.terms)
    nearest = (
        f"nothing in the library explains the gap; the nearest, {names}, closes "
        f"{per_cent(stands.closure)} of it on the runs that it was fitted to"
    )
    held = stands.held_out
    if held is None or not rules.opens_a_gap(held):
        return nearest
    before, after = (math.sqrt(chi2 / held.dof) for chi2 in (held.before, held.after))
    return (
        f"{nearest}, but the held-out runs contradict it: their slow residual is {before:.2f} of "
        f"the noise without it and {after:.2f} with it"
    )


def of_one_run(alone: InOneRun, choice: Choice | None) -> str:
    """A note on what explains as much in one run alone as the choice does in all, or more."""
    first, *others = alone.options
    differs = "may differ" if alone.alike and not alone.sure else "differs"
    alike = f" ({' or '.join(h.label for h in others)} fits alike)" if others else ""
    said = (
        f"{alone.trial} {differs} from the other runs: {first.label} in it alone lowers chi2 by "
        f"{alone.gain:.0f} with {_numbers(first.free)}{alike}"
    )
    if choice is None:
        return said
    everywhere = f"{alone.others:.0f} with {_numbers(choice.hypothesis.free)}"
    return f"{said}, {choice.hypothesis.label} in all runs by {everywhere}"


def _numbers(count: int) -> str:
    """How many numbers are free, in words."""
    return "1 number" if count == 1 else f"{count} numbers"


def of_event(once: event.Event, share: float) -> str:
    """A note on an event that alone brings this share of what any test shows."""
    of_all = f"{per_cent(share)} of what any test shows"
    if once.whole:
        return f"it may be pushes that nobody measured: forces in {once.trial} alone bring {of_all}"
    return (
        f"it may have happened once: a force in {once.trial} between {once.begin} and {once.end} s "
        f"alone brings {of_all}; if something touched the chair then, cut the trial there"
    )


def of_uneven(one: Uneven) -> str:
    """That an effect is not of one size."""
    least, most = (
        f"{size.value:.3g} ± {size.std:.1g} in {size.run}" for size in (one.least, one.most)
    )
    return (
        f"{one.effect} is not of one size in these runs: its {one.parameter} is {most} and "
        f"{least}; it may act in some of them only, as a brake that rubs or another floor does"
    )


def remark(fitted: Fitted, term: Term) -> str:
    """What the values of an effect say in a sentence; empty where they say it themselves.

    So do sizes that are open upwards, of which only the least is told.
    """
    if term.effect.remark is None or term.effect.key in open_upwards(fitted):
        return ""
    std = {p.name: fitted.std.get(key, 0.0) for key, p in term.parameters}
    sides = [ParameterId(term.effect.key, side) for side in SIDES]
    std[DIFFERENCE] = fitted.std_of_difference(*sides)
    return term.effect.remark(term.values, std)
