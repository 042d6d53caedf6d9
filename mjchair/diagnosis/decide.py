"""From the stages to a `Diagnosis`: verdict, effects, rivals, and what to do next.

In: the chair as it was with its gap, and the choice of effects. Out: a `Diagnosis`. The rules
themselves stand in rules.py; here their numbers are gathered.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from mjchair.diagnosis import notes, rules
from mjchair.diagnosis.evidence import evidence, missing_forces
from mjchair.diagnosis.explain import event, hypotheses, missing_force, noise_shown, search_rules
from mjchair.diagnosis.explain.calibration import NONE
from mjchair.diagnosis.explain.candidates import Start
from mjchair.diagnosis.explain.choice import Choice, closure
from mjchair.diagnosis.explain.gap import Gap, forces_left
from mjchair.diagnosis.explain.left_out import (
    foretold_of,
    gap_foretold,
    held_out,
    held_out_gain,
    held_windows,
    lone_run,
    on_held_out,
    over_noise,
    slow_part,
    with_terms,
)
from mjchair.diagnosis.explain.one_run import InOneRun, in_one_run
from mjchair.diagnosis.explain.probability import (
    ONE_RUN,
    of_any,
    of_effects,
    probabilities,
    with_gap,
    with_one_run,
)
from mjchair.diagnosis.explain.rivals import exchanged, with_probable, with_spoken_against
from mjchair.diagnosis.explain.run_by_run import uneven
from mjchair.diagnosis.explain.screening import Base, gain
from mjchair.diagnosis.fit import bounded
from mjchair.diagnosis.fit.column_ids import ParameterId, RoughlyKnown
from mjchair.diagnosis.fit.nonlinear import Fitted, held_by_bounds, open_upwards
from mjchair.diagnosis.fit.process import NAMED, level
from mjchair.diagnosis.fit.slow_part import BAND
from mjchair.diagnosis.material import material
from mjchair.diagnosis.next_experiment import by_hand, design, wording
from mjchair.diagnosis.next_experiment.design import Plan
from mjchair.diagnosis.result import (
    Candidate,
    Diagnosis,
    Disagreement,
    Estimate,
    GapSummary,
    MissingForce,
    Moment,
    NamedEffect,
    Nearest,
    OneRun,
    Shaken,
    Stages,
)
from mjchair.diagnosis.rules import Verdict
from mjchair.effects.effect import Effect, Parameter
from mjchair.errors import MjchairError

Array = NDArray[np.float64]
SHOWN = 12  # windows and channels that are listed
LEFT = 3.0  # sigmas of a missing force that is listed
FORCES = 8  # of them


def conclude(base: Base, gap: Gap, choice: Choice | None) -> Diagnosis:
    """What the stages say together."""
    closed = closure(gap, base, choice.fitted, choice.after) if choice else 0.0
    probability = probabilities(base, choice)
    choice = with_spoken_against(base, with_probable(choice, probability)) if choice else None
    differing = uneven(base.bench, choice.fitted, choice.brought) if choice else []
    stands = standing(base, choice, closed, probability) if choice else None
    alone = in_one_run(base, gap, choice) if gap.exists else None
    sure_alone = alone if alone and alone.sure else None
    chance = min(gap.p, sure_alone.p) if sure_alone else gap.p
    chance = min(chance, rules.LEVEL) if gap.only_held_out else chance
    if stands:
        stands = replace(
            stands,
            uneven=bool(differing),
            one_run=sure_alone is not None,
            one_alike=bool(alone and alone.alike),
        )
    said = rules.verdict(gap.exists, stands)
    forces = missing_forces(base)
    likely = rules.believed(of_any(probability, _standing_keys(choice)) if choice else 0.0, stands)
    answer = choice if said != Verdict.UNKNOWN or rules.is_likely(likely) else None
    size = material(base, gap, answer, sure_alone)
    foretold = gap_foretold(base)
    if not rules.matters(
        force=size.value,
        limit=size.limit,
        gap=foretold,
        excess=gap.excess_sigmas,
        p=chance,
        told=base.bench.simulator.study.material is not None,
        said=said,
        sigmas=min(stands.sigmas, default=0.0) if stands else 0.0,
        probability=likely,
        nothing=max(probability, key=probability.__getitem__) == NONE,
        freed=bool(choice and _walls(base.plain) and not _walls(choice.fitted)),
    ):
        said = Verdict.NONE
    if said == Verdict.NONE and base.bench.tipped:  # what keeps the person's chair down is missing
        said = Verdict.UNKNOWN
    if (said == Verdict.UNKNOWN and choice is None) or rules.surely(chance):
        probability = with_gap(probability, chance)
    if alone is not None and not rules.says_one_run(said, alike=alone.alike):
        alone = None
    if alone is not None:
        probability = with_one_run(probability, alone.by, alone.sure)
    named = choice if said in (Verdict.NAMED, Verdict.AMBIGUOUS) else None
    held = stands.held_out if named and stands else None
    left = missing(named.after if named else gap)
    undecided = named if said == Verdict.AMBIGUOUS else None
    once = bool(stands and stands.once)
    sets = _alternatives(undecided, once, alone) if undecided else []
    pushed = bool(stands and stands.walls and not sets)  # to be measured, and not separated
    unexplained = said == Verdict.UNKNOWN and alone is None and not base.bench.tipped
    moment, look = _moment(base, gap, choice) if unexplained else (None, "")
    plan, unplanned = _plan(base, undecided, once) if undecided and not pushed else (None, [])
    return Diagnosis(
        verdict=said,
        effects=_named(named.fitted, closed) if named else [],
        alternatives=sets,
        candidates=_candidates(base, gap, choice),
        gap=_summary(base, gap, named, over_noise(held.after, held.dof) if held else foretold),
        where=_where(base),
        next_experiment=look or _following(base, gap, choice, said, plan, left, alone),
        notes=[
            *notes.notes_on(base, gap, choice, stands, said=said, left=left, alone=alone),
            *(notes.of_uneven(d) for d in differing if named),
            *unplanned,
        ],
        drivers=left,
        nearest=_nearest(base, choice, closed) if choice and said == Verdict.UNKNOWN else None,
        one_run=_in_one_run(alone, gap) if alone else None,
        moment=moment,
        tipped=_tipped(base),
        probability=probability,
        more_missing=bool(named and stands and rules.more_missing(stands)),
        material=size,
        process=_process(base),
        loud=noise_shown.at_most(base.bench) if named else (),
        shaken=_shaken(noise_shown.forward_levels(base.bench), size.limit),
        terms=named.fitted.variant.terms if named else (),
        correction=named.fitted.variant if named else None,
        evidence=evidence(base, named.fitted if named else None, plan, forces),
        stages=Stages(base=base, gap=gap, choice=choice),
    )


def _tipped(base: Base) -> list[str]:
    """The runs in which the chair of the model tips, and no channel shows that the real one did."""
    simulator = base.bench.simulator
    runs = {simulator.windows[i].run for i in base.bench.tipped}
    return [simulator.study.runs[k].trial.name for k in sorted(runs)]


def _in_one_run(found: InOneRun, gap: Gap) -> OneRun:
    """What acts in one run alone, with the sizes that linear algebra gives it."""
    effects = []
    for option in found.options:
        term, std = found.term(option)
        parameters = {
            name: Estimate(
                value=float(term.values[name]),
                std=std.get(name),
                unit=term.effect.parameter(name).unit,
            )
            for name in term.free
        }
        closed = min(option.gain / max(gap.excess, option.gain), 1.0)
        effects.append(_found_effect(term.effect, parameters, closed))
    return OneRun(trial=found.trial, effects=tuple(effects), gain=found.gain, others=found.others)


def _walls(fitted: Fitted) -> int:
    """How many numbers that are only roughly known stand on their walls."""
    return len(bounded.at_walls(fitted.variant.offsets))


def _walls_that_count(base: Base, choice: Choice) -> int:
    """How many of them stand where what pushes them may be all that is missing."""
    fitted, least = choice.fitted, min(choice.own_gains, default=0.0)
    system, which = with_terms(base, fitted)
    return sum(
        rules.may_be_all(
            cost=bounded.cost_of_holding(system, base.bench.windows, which, {RoughlyKnown(name)}),
            gain=least,
        )
        for name in bounded.at_walls(fitted.variant.offsets)
    )


def _nearest(base: Base, choice: Choice, closed: float) -> Nearest:
    """The explanation that is not named, with what it leaves."""
    return Nearest(
        effects=tuple(t.effect.key for t in choice.fitted.variant.terms),
        closure=closed,
        remainder=over_noise(*slow_part(choice.fitted.system, _shown_windows(base))),
        ends=tuple((key.effect, key.parameter) for key in held_by_bounds(choice.fitted)),
    )


def standing(
    base: Base, choice: Choice, closed: float, probability: Mapping[str, float]
) -> rules.Standing:
    """The numbers that the verdict on a choice follows from."""
    fitted = choice.fitted
    held = on_held_out(base, fitted)
    return rules.Standing(
        closure=closed,
        gap_left=choice.after.exists,
        gain_by_run=held_out_gain(base, fitted),
        gain_by_manoeuvre=held_out_gain(base, fitted, "manoeuvre"),
        sigmas=_sigmas(choice),
        at_bound=bool(held_by_bounds(fitted)),
        probability=of_effects(probability, choice.hypothesis.keys),
        rivals=bool(exchanged(choice)),
        once=_once(base, choice, held),
        runs=len(base.bench.simulator.study.fitted),
        held_out=held,
        walls=_walls_that_count(base, choice),
        unfinished=choice.unfinished,
    )


def _sigmas(choice: Choice) -> tuple[float, ...]:
    """Of every effect, how far it is from neutral in standard errors.

    Where far larger sizes fit as well, no standard error tells; what the effect brings does.
    """
    fitted, own = choice.fitted, choice.brought
    endless = open_upwards(fitted)
    return tuple(
        math.sqrt(max(own[key], 0.0)) if key in endless else sigmas
        for key, sigmas in fitted.sigmas.items()
    )


def _standing_keys(choice: Choice) -> set[str]:
    """Keys of the chosen effects and of all that could stand in their places."""
    instead = {s.effect.key for _, starts, _ in exchanged(choice) for s in starts}
    return {*choice.hypothesis.keys, *instead}


def _once(base: Base, choice: Choice, held: rules.HeldOut | None) -> bool:
    """Whether something that happened once, in one run, fits about as well as the effects do."""
    once = event.largest(base)
    return rules.happened_once(
        event=once.gain,
        gain=_beside_event(base, choice),
        held=held,
        foretold=foretold_of(base, choice.fitted, once.trial),
    )


def _beside_event(base: Base, choice: Choice) -> float:
    """Chi2 that the effects bring, as it is held against what an event does."""
    fitted = gain(base, choice.fitted)
    return rules.beside_event(linear=choice.hypothesis.gain, fitted=fitted)


def _process(base: Base) -> dict[str, Estimate]:
    """Standard deviation of what shakes the chair, by the names of [noise.process].

    Of a person, the share of the force that is in no model; only where a person moves. Sideways
    only where a channel looks there, or where as much is found as is believed: casters turn and
    wheels are slowed by such a force as well.
    """
    process = base.bench.process
    if process is None:
        return {}
    aside = any(channel.endswith(".y") for channel in base.bench.simulator.channels)
    loud = "side" in noise_shown.at_most(base.bench)
    unseen = {"person": not process.person.any(), "side": not aside and not loud}
    return {
        name: Estimate(value=level(process.levels, name), std=None, unit=unit)
        for name, (_, unit) in NAMED.items()
        if not unseen.get(name, False)
    }


def _shaken(kinds: Sequence[Mapping[str, float]], limit: float) -> Shaken | None:
    """The run that is shaken hardest, over another of its kind; None: none is far harder.

    Args:
      kinds: of each kind of run: run -> N. limit: N, below which no force matters.
    """
    found = []
    for runs in kinds:
        trial, other = max(runs, key=runs.__getitem__), min(runs, key=runs.__getitem__)
        if runs[trial] > limit and rules.shakes_far_harder(runs[trial], runs[other]):
            found.append(Shaken(trial, runs[trial], other, runs[other]))
    return max(found, key=lambda shaken: shaken.force, default=None)


def _plan(base: Base, choice: Choice, once: bool) -> tuple[Plan | None, list[str]]:
    """The experiments that would decide, and lines on what could not be planned.

    Args:
      once: whether something that happened once fits about as well.
    """
    chosen = choice.fitted
    rivals = [rival for *_, rival in exchanged(choice)]
    near = [rival.fitted for rival in rivals]
    needed = [
        search_rules.to_rule_out(
            behind=rival.fitted.total - chosen.total,
            gain=choice.brought_beyond(rival.hypothesis),
        )
        for rival in rivals
    ]
    if once:
        near.append(base.plain)
        needed.append(
            rules.to_show_again(event=event.largest(base).gain, gain=_beside_event(base, choice))
        )
    try:
        plan = design.plan(base.bench, chosen, near, needed=needed)
    except MjchairError as error:
        return None, [str(error)]
    return plan, list(plan.dropped)


def _following(
    base: Base,
    gap: Gap,
    choice: Choice | None,
    said: Verdict,
    plan: Plan | None,
    left: list[MissingForce],
    alone: InOneRun | None,
) -> str:
    """The next experiment in words; empty where none is needed."""
    if said == Verdict.AMBIGUOUS and alone is not None:
        return wording.repeating(alone.trial)
    if said == Verdict.AMBIGUOUS and choice is not None:
        run = [wording.deciding(plan, base.bench.simulator)] if plan is not None else []
        told = [*run, *by_hand.sentences(choice), *_to_measure(choice.fitted)]
        if told:
            return " ".join(told)
    if said == Verdict.UNKNOWN and alone is not None:
        return wording.leaving_out(alone.trial)
    if said == Verdict.UNKNOWN and base.bench.tipped:
        return wording.keeping_down()
    if said == Verdict.UNKNOWN:
        drivers = [(force.goes_with, force.sigmas) for force in left]
        return wording.searching(drivers, event.pushed(base.bench.simulator))
    if said == Verdict.NAMED:
        return ""
    answered = choice if said == Verdict.AMBIGUOUS else None
    fitted = answered.fitted if answered else base.plain
    known = [(n, by) for n, by in fitted.variant.known_roughly if rules.is_far(by)]
    known += [(n, by) for n, by in notes.far_gains(fitted) if rules.is_far(by)]
    return wording.measuring(known)


def _to_measure(fitted: Fitted) -> list[str]:
    """What to measure that a fit pushed to its wall, where more may be missing; empty: nothing."""
    walls = set(bounded.at_walls(fitted.variant.offsets))
    said = wording.measuring([(n, by) for n, by in fitted.variant.known_roughly if n.name in walls])
    return [said] if said else []


def _moment(base: Base, gap: Gap, choice: Choice | None) -> tuple[Moment | None, str]:
    """Where something happened that no other run shows, if so, and what to do about it."""
    lone = lone_run(base, choice.fitted if choice else base.plain)
    if lone is not None:
        return Moment(trial=lone.run), wording.letting_in(*lone)
    once = event.explaining(base, gap)
    if once is None or once.whole:
        return None, ""
    said = wording.looking_at(once.trial, once.begin, once.end)
    return Moment(trial=once.trial, begin=once.begin, end=once.end), said


def _alternatives(choice: Choice, once: bool, alone: InOneRun | None) -> list[list[str]]:
    """For every effect, the keys that could stand in its place, itself first.

    Effects that only go together, on either side, are one key.

    Args:
      once: whether something that happened once fits about as well.
      alone: what fits about as well in one run alone.
    """
    sets: dict[str, list[str]] = {}
    for without, instead, _ in exchanged(choice):
        own, other = _joined(without), _joined(instead)
        names = sets.setdefault(own, [own])
        if other not in names:
            names.append(other)
    out = list(sets.values())
    if once:
        out.append([_joined(choice.hypothesis.starts), event.EVENT])
    if alone is not None:
        out.append([_joined(choice.hypothesis.starts), ONE_RUN])
    return out


def _joined(starts: Sequence[Start]) -> str:
    """Keys of effects as in `Diagnosis.alternatives`: several joined by "+", or none."""
    return "+".join(s.effect.key for s in starts) or NONE


def _shown(parameter: Parameter, value: float) -> float:
    """The value as it is reported: a phase (rad), which a fit may carry on, within half a turn."""
    is_phase = parameter.each_run and parameter.unit == "rad"
    return math.remainder(value, 2.0 * math.pi) if is_phase else value


def _named(fitted: Fitted, closed: float) -> list[NamedEffect]:
    out = []
    for term in fitted.variant.terms:
        parameters = {
            p.name: Estimate(
                value=_shown(p, float(term.values[p.name])),
                std=fitted.std.get(ParameterId(term.effect.key, p.name)),
                unit=p.unit,
                at_least=fitted.at_least.get(ParameterId(term.effect.key, p.name)),
            )
            for p in term.effect.parameters
        }
        out.append(_found_effect(term.effect, parameters, closed, notes.remark(fitted, term)))
    return out


def _found_effect(
    effect: Effect, parameters: Mapping[str, Estimate], closed: float, remark: str = ""
) -> NamedEffect:
    """An effect of the library with the sizes that were found."""
    return NamedEffect(
        name=effect.name,
        parameters=parameters,
        closure=closed,
        channel=effect.channel,
        remark=remark,
        recording=effect.recording,
    )


def _candidates(base: Base, gap: Gap, choice: Choice | None) -> list[Candidate]:
    """Every effect alone, as it was screened."""
    out = []
    shown = max([gap.excess, 1.0, *(t.statistic - t.dof for t in gap.tests)])
    excess = shown if gap.exists else math.inf  # nothing closes what is not there
    total = max(gain(base, choice.fitted), excess) if choice else excess
    for h in hypotheses.singles(base.reduced, base.starts):
        columns = base.system.index(h.columns)
        gained = held_out(base.bench, (base.system, []), (base.system, columns))
        effect = h.starts[0].effect
        out.append(
            Candidate(
                name=effect.name,
                held_out_gain=gained,
                closure=float(np.clip(h.gain / max(total, h.gain, 1e-9), 0.0, 1.0)),
                detectability=float(np.sqrt(max(h.gain, 0.0))),
                p_value=float(stats.chi2.sf(h.gain, len(h.columns))),
                collinear=(
                    hypotheses.collinearity(base.reduced, h, choice.hypothesis) if choice else 0.0
                ),
                channel=effect.channel,
            )
        )
    return sorted(out, key=lambda c: -c.held_out_gain)


def _shown_windows(base: Base) -> NDArray[np.int64]:
    """Held-out windows, or all that were fitted to where none is held out."""
    held = held_windows(base)
    return held if held.size else base.bench.windows


def _summary(base: Base, gap: Gap, choice: Choice | None, unforeseen: float) -> GapSummary:
    """The gap as it was, and as the corrected chair leaves it; without one there is no after.

    Args:
      unforeseen: of it, as `GapSummary` has it, where a trial is held out.
    """
    windows = _shown_windows(base)
    before, dof = slow_part(base.plain.system, windows)
    is_held = bool(held_windows(base).size)
    who = "held-out trials" if is_held else "all trials, since none is held out"
    return GapSummary(
        before=over_noise(before, dof),
        after=over_noise(slow_part(choice.fitted.system, windows)[0], dof) if choice else None,
        scope=f"{who}: rms of the whitened residual below {BAND:g} Hz",
        p_value=gap.p,
        only_held_out=gap.only_held_out,
        p_value_after=choice.after.p if choice else None,
        unforeseen=unforeseen if is_held else None,
        shows_after=choice is not None and choice.after.exists,
    )


def _where(base: Base) -> list[Disagreement]:
    """The channels and windows that disagree most."""
    simulator = base.bench.simulator
    known = missing_force.drivers(base.bench, base.around.track)
    out = []
    for i in base.bench.windows:
        w, cells = simulator.windows[int(i)], base.system.cells[int(i)]
        speed, yaw = (np.abs(known[int(i)][name]) for name in ("speed", "yaw_rate"))
        regime = {
            "speed": f"{speed.min():.1f}-{speed.max():.1f} m/s",
            "yaw_rate": f"{yaw.min():.1f}-{yaw.max():.1f} rad/s",
        }
        out += [
            Disagreement(
                trial=simulator.study.runs[w.run].trial.name,
                channel=channel,
                window=(round(w.first, 3), round(w.last, 3)),
                regime=regime,
                statistic=float(cells.chi2[k] / cells.dof[k]),
            )
            for k, channel in enumerate(simulator.channels)
            if cells.dof[k] >= 1.0 and channel not in simulator.study.copied
        ]
    return sorted(out, key=lambda entry: -entry.statistic)[:SHOWN]


def missing(gap: Gap) -> list[MissingForce]:
    """The forces that would close a gap and what they go with, strongest first."""
    return [
        MissingForce(force=group.force, goes_with=group.driver, sigmas=sigmas)
        for group, sigmas in forces_left(gap)
        if sigmas > LEFT
    ][:FORCES]
