"""From the stages to what is said: verdict, effects, alternatives, where, and what next."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from mjchair.diagnosis import advice, experiments, force, linear, selection
from mjchair.diagnosis.fitting import Fitted
from mjchair.diagnosis.gap import Gap
from mjchair.diagnosis.linear import System
from mjchair.diagnosis.screening import Base
from mjchair.diagnosis.search import MOST, Choice, closure, gain, held_out, held_out_gain
from mjchair.diagnosis.verdict import (
    AMBIGUOUS,
    CARRIED,
    CLOSES,
    HELD,
    NAMED,
    NEARLY_ALL,
    NONE,
    REMAINDER,
    SIGMAS,
    UNKNOWN,
    Diagnosis,
    Named,
    Ranked,
)

Array = NDArray[np.float64]
TOP = 3  # drivers of a missing force that are worth a word


def conclude(base: Base, gap: Gap, choice: Choice | None) -> Diagnosis:
    """What the stages say together."""
    closed = closure(gap, base, choice.fitted, choice.after[-1]) if choice else 0.0
    verdict = _verdict(base, gap, choice, closed)
    alternatives = _alternatives(choice) if choice and verdict == AMBIGUOUS else []
    left = _drivers(choice.after[-1] if choice else gap)
    planned, following = None, ""
    if verdict == AMBIGUOUS and choice:
        near = [r.fitted for group in choice.rivals for r in group] or [base.plain]
        planned = experiments.plan(base.bench, choice.fitted, near)
        following = advice.deciding(planned, base.bench.shooter)
    elif verdict == UNKNOWN:
        following = advice.searching(left)
    named = verdict in (NAMED, AMBIGUOUS) and choice is not None
    return Diagnosis(
        verdict,
        _named(choice.fitted, closed) if named and choice else [],
        alternatives,
        _ranked(base, gap, choice),
        _summary(base, gap, choice),
        _where(base),
        following,
        _notes(base, choice, closed, verdict, left),
        left,
        {
            "base": base,
            "gap": gap,
            "choice": choice,
            "fitted": choice.fitted if choice else None,
            "experiments": planned,
        },
    )


def _verdict(base: Base, gap: Gap, choice: Choice | None, closed: float) -> str:
    if not gap.exists:
        return NONE
    if choice is None or closed < CLOSES or held_out_gain(base, choice.fitted) < HELD:
        return UNKNOWN
    if closed < NEARLY_ALL and _left(base, choice) > REMAINDER:
        return UNKNOWN
    if choice.after[-1].exists and len(choice.hypothesis.starts) == MOST:
        return UNKNOWN
    if not _carries_over(base, choice):
        return UNKNOWN
    sure = (
        all(s > SIGMAS for s in choice.fitted.sigmas.values())
        and not choice.fitted.at_bound
        and held_out_gain(base, choice.fitted, "manoeuvre") > 0.0
    )
    return NAMED if sure and not any(choice.rivals) else AMBIGUOUS


def _carries_over(base: Base, choice: Choice) -> bool:
    """Whether the held-out trials, which no fit has seen, do not speak against the choice.

    A gap that shows in them must close by CARRIED; none must open.
    """
    held = _held_windows(base)
    if not held.size:
        return True
    before, dof = _slow(base.plain.system, held)
    after, _ = _slow(choice.fitted.system, held)
    scatter = 3.0 * float(np.sqrt(2.0 * dof))
    gap, left = before - dof, after - dof
    return left < max((1.0 - CARRIED) * gap, scatter) if gap > scatter else left < gap + scatter


def _left(base: Base, choice: Choice) -> float:
    """Rms of the whitened residual that a fit leaves where it was fitted."""
    return _rms(*_slow(choice.fitted.system, base.bench.windows))


def _alternatives(choice: Choice) -> list[list[str]]:
    """For every effect, the names that could stand in its place, itself first."""
    out = []
    for start, rivals in zip(choice.hypothesis.starts, choice.rivals, strict=True):
        keys = {s.effect.key for s in choice.hypothesis.starts}
        new = [
            s.effect.name for r in rivals for s in r.hypothesis.starts if s.effect.key not in keys
        ]
        names = list(dict.fromkeys([start.effect.name, *new]))
        if len(names) > 1:
            out.append(names)
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


def _ranked(base: Base, gap: Gap, choice: Choice | None) -> list[Ranked]:
    """Every effect alone, as it was screened."""
    out = []
    total = gain(base, choice.fitted) if choice else max(gap.excess, 1.0)
    for h in selection.singles(base.reduced, base.starts):
        columns = base.system.index(h.columns)
        gains = held_out(base.bench, (base.system, []), (base.system, columns))
        cosine = selection.collinearity(base.reduced, h, choice.hypothesis) if choice else 0.0
        effect = h.starts[0].effect
        out.append(
            Ranked(
                effect.name,
                float(gains.sum()),
                float(np.clip(h.gain / max(total, h.gain, 1e-9), 0.0, 1.0)),
                float(np.sqrt(max(h.gain, 0.0))),
                float(stats.chi2.sf(h.gain, len(h.columns))),
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


def _summary(base: Base, gap: Gap, choice: Choice | None) -> dict[str, Any]:
    held = _held_windows(base)
    windows = held if held.size else base.bench.windows
    before, dof = _slow(base.plain.system, windows)
    left = _slow(choice.fitted.system, windows)[0] if choice else before
    who = "held-out trials" if held.size else "all trials, since none is held out"
    return {
        "before": _rms(before, dof),
        "after": _rms(left, dof),
        "noise_floor": 1.0,
        "scope": f"{who}: rms of the whitened residual below {linear.BAND:g} Hz",
        "p_value": gap.p,
        "p_value_after": choice.after[-1].p if choice else gap.p,
    }


def _where(base: Base) -> list[dict[str, Any]]:
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


def _notes(
    base: Base,
    choice: Choice | None,
    closed: float,
    verdict: str,
    drivers: list[dict[str, Any]],
) -> list[str]:
    said = list(base.bench.shooter.study.notes)
    for channel, found in base.bench.noise.items():
        if found.source != "study.toml":
            said.append(f"noise of {channel}: {found.total:.3g} (SI), from {found.source}")
    if verdict == UNKNOWN and choice is not None:
        names = " and ".join(t.effect.key for t in choice.fitted.fit.terms)
        said.append(
            f"nothing in the library explains the gap; the nearest, {names}, closes {closed:.0%}"
        )
    if verdict == UNKNOWN and any(d["goes_with"] == "stroke" for d in drivers[:TOP]):
        said.append(
            "the missing force comes back with every stroke: chair and rider are not one rigid "
            "body, and what of the rider moves, and how heavy it is, these channels do not tell"
        )
    return said
