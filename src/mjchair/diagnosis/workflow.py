"""From a study to a verdict: the stages one after another, each usable alone."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy import stats
from threadpoolctl import threadpool_limits

from mjchair.diagnosis import (
    advice,
    begin,
    candidates,
    experiments,
    force,
    linear,
    noise,
    nuisance,
    selection,
    sensitivity,
)
from mjchair.diagnosis import gap as gaps
from mjchair.diagnosis.candidates import Start
from mjchair.diagnosis.fitting import Bench, Fit, Fitted, nuisance_columns, refit
from mjchair.diagnosis.gap import Gap
from mjchair.diagnosis.linear import Reduced, System, Whitener
from mjchair.diagnosis.selection import Hypothesis
from mjchair.diagnosis.sensitivity import Column, Pulse
from mjchair.diagnosis.shooting import Shooter
from mjchair.diagnosis.store import Store
from mjchair.diagnosis.study import Study, read_study
from mjchair.diagnosis.tracking import Track, track
from mjchair.diagnosis.verdict import (
    AMBIGUOUS,
    CLOSES,
    NAMED,
    NONE,
    RIVAL_CHI2,
    RIVAL_ERRORS,
    SIGMAS,
    UNKNOWN,
    Diagnosis,
    Named,
    Ranked,
)
from mjchair.effects import rider_sway
from mjchair.effects.effect import Effect
from mjchair.effects.library import library

Array = NDArray[np.float64]
Say = Callable[[str], None]
MOST = 3  # effects that are added
FAR = 1.5  # prior standard deviations: a nuisance there is not what moved
ENOUGH = 0.93  # closure beyond which a further effect must be large to be added
AT_REST = 0.01  # m/s^2, bias of an accelerometer that was seen at rest
TIE = 6.0  # chi2 within which hypotheses fit alike
RIVALS = 3  # of one effect, that are refitted


@dataclass
class Base:
    """The study's chair with every column around it.

    Attributes:
      bench: with what. track: of the chair as given; the columns are differences from it.
      nuisances: their columns, by name. columns: of effects and forces. starts: what the effects'
        columns mean. pulses, answers: forces in time and what they change.
      plain: the best chair without any effect.
      fit: where the effects are screened from, with its system and reduced sums.
    """

    bench: Bench
    track: Track
    nuisances: dict[str, Column]
    columns: dict[str, Column]
    starts: list[Start]
    pulses: list[Pulse]
    answers: list[Array]
    plain: Fitted
    fit: Fit
    system: System
    reduced: Reduced


def silent(_: str) -> None:
    """Say nothing."""


def prepare(study: Study, say: Say = silent, store: Store | None = None) -> tuple[Bench, Track]:
    """Windows, their states, the noise, and what is only roughly known."""
    shooter = Shooter(study, store=store)
    found = noise.estimate(study)
    say("states along the runs")
    first = track(shooter, shooter.base, found)
    found = noise.refined(shooter, first, found)
    given = dict(study.nuisance)
    if any(begin.stops(run) for run in study.runs):  # at rest the accelerometer showed its bias
        given.setdefault("bias:imu_accelerometer.x", AT_REST)
    nuisances = nuisance.nuisances(study.channels, given)
    return Bench(shooter, found, nuisances, Whitener(shooter, found)), first


def screen_columns(
    bench: Bench, found: Track, effects: Sequence[Effect], say: Say = silent
) -> Base:
    """Every column around the chair as given, and the linear algebra of them all."""
    shooter, given = bench.shooter, Fit(bench.nuisances)
    say("what is only roughly known")
    nuisances = nuisance_columns(bench, found, given)
    plain = refit(bench, given, found, nuisances)
    say("answers to forces")
    pulses = sensitivity.pulses(shooter)
    answers = sensitivity.pulse_columns(shooter, found, pulses)
    columns, starts = candidates.collect(
        bench, found, given, effects, pulses, answers, lambda key: say(f"effect {key}")
    )
    columns.update(force.driver_columns(bench, found, pulses, answers))
    # a nuisance far from its prior stands in for something else: then the chair as given is nearer
    far = max((abs(v) for v in plain.fit.offsets.values()), default=0.0) > FAR
    fit, here = (given, found) if far else (plain.fit, plain.track)
    system = bench.system(here, {**nuisances, **columns}, len(nuisances), fit)
    reduced = linear.reduce(system, bench.windows)
    return Base(
        bench, found, nuisances, columns, starts, pulses, answers, plain, fit, system, reduced
    )


def gap_after(base: Base, fitted: Fitted) -> tuple[Gap, System, Reduced]:
    """Test what a fit leaves, with its own parameters free."""
    bench = base.bench
    count = len(fitted.columns)
    terms = count - len(base.nuisances)
    system = bench.system(
        fitted.track, {**fitted.columns, **base.columns}, count, fitted.fit, free=terms
    )
    reduced = linear.reduce(system, bench.windows)
    keys = [t.effect.key for t in fitted.fit.terms]
    return gaps.test_gap(bench, system, reduced, keys), system, reduced


def study_effects(study: Study, more: Sequence[Effect] = ()) -> list[Effect]:
    """The effects that this study could show."""
    motion = any(rider_sway.MOTION in run.trial.other for run in study.runs)
    driven = any(run.trial.inputs is not None for run in study.runs)
    return [*library(study.channels, motion, driven), *more]


def diagnose(
    study: Study | str | os.PathLike[str],
    *,
    effects: Sequence[Effect] = (),
    say: Say = silent,
    store: Store | None = None,
) -> Diagnosis:
    """Find where model and measurement disagree, and name the effect that is missing.

    Args:
      study: a study, or its folder.
      effects: of your own, besides the library's.
      say: is called with the name of every stage as it begins.
      store: keeps simulations, so that a second start goes on from an interrupted one.

    Raises:
      MjchairError: a study that cannot be read or simulated, as one line.
    """
    known = study if isinstance(study, Study) else read_study(study)
    # threads cost the linear algebra more than they bring on matrices this small
    with threadpool_limits(1, user_api="blas"):
        return _diagnose(known, effects, say, store)


def _diagnose(known: Study, effects: Sequence[Effect], say: Say, store: Store | None) -> Diagnosis:
    bench, found = prepare(known, say, store)
    base = screen_columns(bench, found, study_effects(known, effects), say)
    say("the gap")
    gap, _, _ = gap_after(base, base.plain)
    if not gap.exists:
        return _finish(base, gap, None, [], [], say)
    say("effects, one and two at a time")
    chosen, fitted, after = _choose(base, gap, say)
    rivals = _rivals(base, chosen, fitted, say) if chosen is not None else []
    return _finish(base, gap, fitted, after, rivals, say, chosen)


def _choose(base: Base, gap: Gap, say: Say) -> tuple[Hypothesis | None, Fitted | None, list[Gap]]:
    """Grow from one effect to as many as the data ask for."""
    reduced, starts = base.reduced, base.starts
    ranked = selection.singles(reduced, starts)
    if not ranked or ranked[0].score <= 0.0:
        return None, None, []
    options = [ranked]
    options.append(selection.pairs(reduced, starts))
    best: tuple[Hypothesis, Fitted] | None = None
    after: list[Gap] = []
    for size in range(1, MOST + 1):
        if size == MOST:
            options.append(selection.grown(reduced, starts, [h.starts for h in options[1][:3]]))
        if not options[size - 1] or options[size - 1][0].score <= 0.0:
            break
        top = _commonest(base, options[size - 1])
        fitted = _refit(base, top, say)
        if best is not None:
            gained = best[1].total - fitted.total
            share = gained / max(_gain(base, best[1]), 1.0)
            needed = selection.PENALTY * (top.free - best[0].free) + 15.0
            if gained < needed or (
                closure(gap, base, best[1], after[-1]) > ENOUGH and share < 0.05
            ):
                break
        left, _, _ = gap_after(base, fitted)
        best = (top, fitted)
        after.append(left)
        if not left.exists:
            break
    assert best is not None
    say("the last fit, with everything made anew around it")
    fitted = refit(base.bench, best[1].fit, best[1].track, rounds=1)
    after[-1], _, _ = gap_after(base, fitted)
    return best[0], fitted, after


def _commonest(base: Base, options: Sequence[Hypothesis]) -> Hypothesis:
    """Of the hypotheses that fit alike, the one whose effects stand first in the library."""
    order = {s.effect.key: k for k, s in reversed(list(enumerate(base.starts)))}
    alike = [h for h in options if h.score > options[0].score - TIE]
    return min(alike, key=lambda h: sorted(order[k] for k in h.keys))


def _refit(base: Base, hypothesis: Hypothesis, say: Say) -> Fitted:
    say("fit of " + " and ".join(hypothesis.keys))
    terms = selection.terms(base.reduced, hypothesis)
    start = replace(base.fit, terms=terms)
    return refit(base.bench, start, base.track, base.nuisances)


def _gain(base: Base, fitted: Fitted) -> float:
    """Drop of chi2 that the effects bring."""
    return base.plain.total - fitted.total


def closure(gap: Gap, base: Base, fitted: Fitted, after: Gap) -> float:
    """Share of the excess that a fit closes.

    The excess is the slow part of the residual above what noise gives, where that is known well
    enough; a small gap is below its scatter, and then what the fit gains is held against the most
    that any further test finds.
    """
    gain = _gain(base, fitted)
    left = max(
        (t.statistic - t.dof for t in after.tests if t.kind != "cell" and t.sigmas > 3.5),
        default=0.0,
    )
    share = gain / max(gain + max(left, 0.0), 1e-9)
    if gap.excess > 6.0 * gap.excess_std:
        share = min(share, 1.0 - max(after.excess - after.excess_std, 0.0) / gap.excess)
    return float(np.clip(share, 0.0, 1.0))


def _rivals(
    base: Base, chosen: Hypothesis, fitted: Fitted | None, say: Say
) -> list[list[Hypothesis]]:
    """For every effect of the choice: what could stand in its place, best first."""
    if fitted is None:
        return []
    reduced = base.reduced
    out = []
    for k, start in enumerate(chosen.starts):
        others = tuple(s for j, s in enumerate(chosen.starts) if j != k)
        keys = {s.effect.key for s in others}
        pool: dict[str, Hypothesis] = {}
        for other in base.starts:
            if other.effect.key in keys or other.effect.key == start.effect.key:
                continue
            found = selection.weigh(reduced, (*others, other))
            if not np.isfinite(found.score) or not selection.physical(reduced, found):
                continue
            key = other.effect.key
            if key not in pool or found.score > pool[key].score:
                pool[key] = found
        near = [h for h in sorted(pool.values(), key=lambda h: -h.score) if _close(base, chosen, h)]
        kept = []
        for n, h in enumerate(near):
            if n < RIVALS:
                other_fit = _refit(base, h, say)
                behind = other_fit.total - fitted.total + selection.PENALTY * (h.free - chosen.free)
                errors = _paired(other_fit.chi2, fitted.chi2)
                if behind > RIVAL_CHI2 and errors > RIVAL_ERRORS:
                    continue
            kept.append(h)
        out.append(kept)
    return out


def _paired(theirs: Array, ours: Array) -> float:
    """How many standard errors, over windows, theirs is worse."""
    difference = theirs - ours
    spread = (
        float(difference.std(ddof=1)) * np.sqrt(difference.size) if difference.size > 1 else 1.0
    )
    return float(difference.sum() / max(spread, 1e-9))


def _close(base: Base, chosen: Hypothesis, other: Hypothesis) -> bool:
    behind = chosen.score - other.score
    if behind < RIVAL_CHI2:
        return True
    return behind < 3.0 * RIVAL_ERRORS * np.sqrt(max(chosen.gain - other.gain, 0.0)) and (
        other.gain > 0.8 * chosen.gain
    )


def _finish(
    base: Base,
    gap: Gap,
    fitted: Fitted | None,
    after: list[Gap],
    rivals: list[list[Hypothesis]],
    say: Say,
    chosen: Hypothesis | None = None,
) -> Diagnosis:
    closed = closure(gap, base, fitted, after[-1]) if fitted is not None and after else 0.0
    ranked = _ranked(base, gap, chosen)
    sure = fitted is not None and all(s > SIGMAS for s in _sigmas(fitted))
    held = _held_out_gain(base, chosen) if chosen is not None else 0.0
    if not gap.exists:
        verdict = NONE
    elif chosen is None or fitted is None or closed < CLOSES or held <= 0.0:
        verdict = UNKNOWN
    elif any(rivals) or not sure or fitted.at_bound:
        verdict = AMBIGUOUS
    else:
        verdict = NAMED
    effects = _named(fitted, closed) if fitted is not None and verdict != NONE else []
    alternatives = []
    if verdict == AMBIGUOUS and chosen is not None:
        for start, others in zip(chosen.starts, rivals, strict=True):
            new = [k for h in others for k in h.keys if k not in chosen.keys]
            names = dict.fromkeys([start.effect.name, *(k.split(":")[0] for k in new)])
            if len(names) > 1:
                alternatives.append(list(names))
    planned = None
    following = ""
    if verdict == AMBIGUOUS and fitted is not None:
        say("the next experiment")
        planned = experiments.plan(base.bench, fitted, _others(base, rivals, say))
        following = advice.deciding(planned, base.bench.shooter)
    elif verdict == UNKNOWN:
        following = advice.searching(_drivers(after[-1] if after else gap))
    stages = {"base": base, "gap": gap, "fitted": fitted, "after": after, "chosen": chosen,
              "rivals": rivals, "experiments": planned}  # fmt: skip
    return Diagnosis(
        verdict,
        effects if verdict != UNKNOWN else [],
        alternatives,
        ranked,
        _summary(base, gap, fitted, after),
        _where(base, gap),
        following,
        _notes(base, gap, fitted, closed, verdict),
        _drivers(after[-1] if after else gap),
        stages,
    )


def _others(base: Base, rivals: list[list[Hypothesis]], say: Say) -> list[Fitted]:
    """What the next experiment is to rule out: the rivals, or else that there is no effect."""
    near = [h for group in rivals for h in group[:RIVALS]]
    return [_refit(base, h, say) for h in near] or [base.plain]


def _sigmas(fitted: Fitted) -> list[float]:
    """The largest significance among each effect's parameters."""
    out = []
    for term in fitted.fit.terms:
        values = []
        for name in term.free:
            p = term.effect.parameter(name)
            std = fitted.std[f"{term.effect.key}.{name}"]
            if term.effect.tags and name in ("phase", "frequency", "x", "y", "radius"):
                continue
            values.append(abs(term.values[name] - p.neutral) / max(std, 1e-12))
        out.append(max(values, default=0.0))
    return out


def _named(fitted: Fitted, closed: float) -> list[Named]:
    out = []
    for term in fitted.fit.terms:
        parameters: dict[str, dict[str, Any]] = {}
        for p in term.effect.parameters:
            free = p.name in term.free
            parameters[p.name] = {
                "value": float(term.values[p.name]),
                "std": float(fitted.std[f"{term.effect.key}.{p.name}"]) if free else None,
                "unit": p.unit,
            }
        out.append(Named(term.effect.name, parameters, closed, term.effect.channel))
    return out


def _held_out_gain(base: Base, chosen: Hypothesis) -> float:
    gains, _ = selection.held_out(base.bench, base.system, chosen.columns)
    return float(gains.sum())


def _ranked(base: Base, gap: Gap, chosen: Hypothesis | None) -> list[Ranked]:
    out = []
    total = max(gap.excess, 1.0)
    for h in selection.singles(base.reduced, base.starts):
        gains, _ = selection.held_out(base.bench, base.system, h.columns)
        cosine = selection.collinearity(base.reduced, h, chosen) if chosen is not None else 0.0
        p = float(stats.chi2.sf(h.gain, len(h.columns)))
        effect = h.starts[0].effect
        out.append(
            Ranked(
                effect.name,
                float(gains.sum()),
                float(np.clip(h.gain / total, 0.0, 1.0)),
                float(np.sqrt(max(h.gain, 0.0))),
                p,
                cosine,
                effect.channel,
            )
        )
    return sorted(out, key=lambda r: -r.held_out_gain)


def _rms(chi2: float, dof: float) -> float:
    return float(np.sqrt(max(chi2, 0.0) / max(dof, 1.0)))


def _slow(system: System, windows: NDArray[np.int64]) -> tuple[float, float]:
    cells = [system.cells[int(i)] for i in windows]
    return sum(c.total for c in cells), sum(c.total_dof for c in cells)


def _held_windows(base: Base) -> NDArray[np.int64]:
    held = {i for i, r in enumerate(base.bench.shooter.study.runs) if r.hold_out}
    return np.array([i for i, w in enumerate(base.bench.shooter.windows) if w.run in held], int)


def _summary(base: Base, gap: Gap, fitted: Fitted | None, after: list[Gap]) -> dict[str, Any]:
    held = _held_windows(base)
    windows = held if held.size else base.bench.windows
    before, dof = _slow(base.plain.system, windows)
    left = _slow(fitted.system, windows)[0] if fitted is not None else before
    who = "held-out trials" if held.size else "all trials, since none is held out"
    return {
        "before": _rms(before, dof),
        "after": _rms(left, dof),
        "noise_floor": 1.0,
        "scope": f"{who}: rms of the whitened residual below {linear.BAND:g} Hz",
        "p_value": gap.p,
        "p_value_after": after[-1].p if after else gap.p,
    }


def _where(base: Base, gap: Gap) -> list[dict[str, Any]]:
    shooter = base.bench.shooter
    known = force.drivers(base.bench, base.track)
    out = []
    for i in base.bench.windows:
        w, cells = shooter.windows[int(i)], base.system.cells[int(i)]
        for k, channel in enumerate(shooter.channels):
            if cells.dof[k] < 1.0:
                continue
            d = known[int(i)]
            speed, yaw = np.abs(d["speed"]), np.abs(d["yaw_rate"])
            out.append(
                {
                    "trial": shooter.study.runs[w.run].trial.name,
                    "channel": channel,
                    "window": [round(w.first, 3), round(w.last, 3)],
                    "regime": {
                        "speed": f"{speed.min():.1f}-{speed.max():.1f} m/s",
                        "yaw_rate": f"{yaw.min():.1f}-{yaw.max():.1f} rad/s",
                    },
                    "statistic": float(cells.chi2[k] / cells.dof[k]),
                }
            )
    return sorted(out, key=lambda entry: -float(str(entry["statistic"])))[:12]


def _drivers(gap: Gap) -> list[dict[str, Any]]:
    """What a force that is not in the model goes with, strongest first."""
    return [
        {"force": t.name.split("|")[0], "goes_with": t.name.split("|")[1], "sigmas": t.sigmas}
        for t in gap.tests
        if t.kind == "force" and t.sigmas > 3.0
    ][:8]


def _notes(base: Base, gap: Gap, fitted: Fitted | None, closed: float, verdict: str) -> list[str]:
    said = list(base.bench.shooter.study.notes)
    for channel, found in base.bench.noise.items():
        if found.source != "study.toml":
            said.append(f"noise of {channel}: {found.total:.3g} (SI), from {found.source}")
    if verdict == UNKNOWN and fitted is not None:
        names = " and ".join(t.effect.key for t in fitted.fit.terms)
        said.append(
            f"nothing in the library explains the gap; the nearest, {names}, closes {closed:.0%}"
        )
    return said


def corrected(study: Study, diagnosis: Diagnosis) -> mujoco.MjSpec:
    """The study's chair with the effects of the diagnosis in it; nuisances stay as they were."""
    spec = study.spec.copy()
    fitted: Fitted | None = diagnosis.stages.get("fitted")
    if fitted is not None and diagnosis.verdict in (NAMED, AMBIGUOUS):
        for term in fitted.fit.terms:
            term.effect.apply(spec, term.values)
    return spec
