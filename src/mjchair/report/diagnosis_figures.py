"""Figures of a diagnosis: where the gap is, what closes it, what could make it, what is left."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from mjchair.diagnosis import force
from mjchair.diagnosis.fitting import Fit
from mjchair.diagnosis.linear import BAND, System
from mjchair.diagnosis.observe import Observer
from mjchair.diagnosis.sensitivity import UNITS, Pulse
from mjchair.diagnosis.shooting import Job, Shooter, residual
from mjchair.diagnosis.tracking import Track
from mjchair.diagnosis.verdict import AMBIGUOUS, NAMED, Diagnosis, Ranked
from mjchair.diagnosis.windows import Window
from mjchair.simulation.channels import channels

Array = NDArray[np.float64]

MEASURED, OLD, NEW = "#222222", "#b03060", "#1f4e9c"
FAINT = "#9aa7b5"
MOST = 12  # candidates that are drawn
BINS = 8
DRIVERS = {  # what a force is drawn against: label with unit
    "speed": "speed (m/s)",
    "yaw_rate": "yaw rate (rad/s)",
    "heading": "heading (rad)",
    "torque": "torque, both wheels (N m)",
    "swivel": "swivel of the casters (rad)",
    "left wheel's turn": "angle of the left wheel (rad)",
    "right wheel's turn": "angle of the right wheel (rad)",
}


def fitted_fit(diagnosis: Diagnosis) -> Any:
    """The fit that is in the corrected chair, or None where nothing was put in."""
    applied = diagnosis.verdict in (NAMED, AMBIGUOUS)
    return diagnosis.stages.get("fitted") if applied else None


def where(diagnosis: Diagnosis) -> Figure:
    """Residual over noise, channel by window, before and after."""
    base, fitted = diagnosis.stages["base"], fitted_fit(diagnosis)
    systems = [("as it was", base.plain.system)]
    if fitted is not None:
        systems.append(("corrected", fitted.system))
    shooter = base.bench.shooter
    height = 0.27 * len(shooter.channels) + 1.9
    figure = Figure(figsize=(9.4, height), layout="constrained")
    axes = figure.subplots(1, len(systems), sharey=True, squeeze=False)[0]
    for ax, (name, system) in zip(axes, systems, strict=True):
        image = ax.imshow(_ratios(system), aspect="auto", cmap="magma_r", vmin=0.7, vmax=4.0)
        ax.set_title(f"the chair {name}", loc="left", fontsize=10)
        ax.set_yticks(range(len(shooter.channels)), shooter.channels, fontsize=8)
        _trial_ticks(ax, shooter)
    figure.colorbar(image, ax=list(axes), label=f"rms below {BAND:g} Hz / noise (1)", extend="both")
    return figure


def _ratios(system: System) -> Array:
    """Rms over noise, (channels, windows); NaN where a channel has nothing."""
    rows = [np.where(c.dof >= 1.0, c.chi2 / np.maximum(c.dof, 1.0), np.nan) for c in system.cells]
    return np.asarray(np.sqrt(np.array(rows).T))


def _trial_ticks(ax: Axes, shooter: Shooter) -> None:
    """A label a trial under its windows, and a line between trials."""
    runs = np.array([w.run for w in shooter.windows])
    ticks, labels = [], []
    for run in sorted(set(runs.tolist())):
        at = np.flatnonzero(runs == run)
        known = shooter.study.runs[run]
        ticks.append(float(at.mean()))
        labels.append(known.trial.name + (" (held out)" if known.hold_out else ""))
        ax.axvline(at[-1] + 0.5, color="white", lw=2.0)
    ax.set_xticks(ticks, labels, rotation=40, ha="right", fontsize=8)
    ax.set_xlabel("trial, a column a window of about 2 s")


def missing_force(diagnosis: Diagnosis) -> Figure:
    """The force that would close the gap, against what it may go with."""
    base = diagnosis.stages["base"]
    found = force.residual_force(base.bench, base.track, base.pulses, base.answers)
    known = force.drivers(base.bench, base.track)
    figure = Figure(figsize=(9.4, 5.2), layout="constrained")
    axes = figure.subplots(2, 4, sharey="row")
    for row, name in zip(axes, ("Fx", "Mz"), strict=True):
        mine = [k for k, p in enumerate(found.pulses) if p.force == name]
        pulses = [found.pulses[k] for k in mine]
        for ax, driver in zip(row, _shown(diagnosis, name), strict=True):
            at = np.array([_driver(known, p, driver) for p in pulses])
            _scatter(ax, at, found.value[mine], found.std[mine])
            ax.set_xlabel(DRIVERS[driver], fontsize=9)
        what = "missing force forward" if name == "Fx" else "missing yaw moment"
        row[0].set_ylabel(f"{what} ({UNITS[name]})")
    return figure


def _shown(diagnosis: Diagnosis, name: str) -> list[str]:
    """Speed, yaw rate, heading, and the strongest other driver of this force."""
    shown = ["speed", "yaw_rate", "heading"]
    others = [d["goes_with"] for d in diagnosis.drivers if d["force"] == name]
    others = [d for d in others if d in DRIVERS and d not in shown]
    return [*shown, (others or ["torque"])[0]]


def _driver(known: Sequence[dict[str, Array]], pulse: Pulse, driver: str) -> float:
    """Value of a driver at a pulse."""
    along = known[pulse.window]
    at = min(int(np.searchsorted(along["time"], pulse.time)), along["time"].size - 1)
    if driver == "torque":
        return float(along["left_torque"][at] + along["right_torque"][at])
    if driver.endswith("turn"):
        return float(np.remainder(along[f"{driver.split()[0]}_angle"][at], 2 * np.pi))
    if driver == "heading":
        return float(np.remainder(along["heading"][at] + np.pi, 2 * np.pi) - np.pi)
    return float(along[driver][at])


def _scatter(ax: Axes, at: Array, value: Array, std: Array) -> None:
    """Every pulse, faint, and weighted means of bins with their standard errors."""
    ax.plot(at, value, ".", ms=3, color=FAINT, alpha=0.6)
    ax.axhline(0.0, color="0.6", lw=0.8)
    edges = np.unique(np.quantile(at, np.linspace(0.0, 1.0, BINS + 1)))
    for low, high in itertools.pairwise(edges):
        inside = (at >= low) & (at <= high)
        if inside.sum() < 2:
            continue
        weight = 1.0 / std[inside] ** 2
        mean = float(np.average(value[inside], weights=weight))
        error = float(np.sqrt(1.0 / weight.sum()))
        ax.errorbar(
            float(np.average(at[inside], weights=weight)), mean, error, fmt="o", ms=4.5, color=OLD
        )
    ax.grid(alpha=0.3)


def leading(diagnosis: Diagnosis, most: int) -> list[Ranked]:
    """Candidates: those that were chosen first, then the largest in these data."""
    chosen = {(e.name, e.channel) for e in diagnosis.effects}
    order = sorted(
        diagnosis.candidates, key=lambda c: ((c.name, c.channel) not in chosen, -c.detectability)
    )
    return order[:most]


def candidates(diagnosis: Diagnosis) -> Figure:
    """What every effect alone could do: size against noise, and gain where it was not fitted."""
    top = leading(diagnosis, MOST)[::-1]
    chosen = {(e.name, e.channel) for e in diagnosis.effects}
    names = [c.name + (f" ({c.channel})" if c.channel else "") for c in top]
    colours = [NEW if (c.name, c.channel) in chosen else FAINT for c in top]
    figure = Figure(figsize=(9.4, 0.28 * max(len(top), 3) + 1.0), layout="constrained")
    axes = figure.subplots(1, 3, sharey=True)
    columns = (
        ("size in these data (sigma)", [c.detectability for c in top]),
        ("gain on runs left out (chi²)", _cut([c.held_out_gain for c in top])),
        ("likeness to the chosen, |cos|", [c.collinear for c in top]),
    )
    for ax, (label, values) in zip(axes, columns, strict=True):
        ax.barh(names, values, color=colours)
        ax.set_xlabel(label, fontsize=9)
        ax.grid(axis="x", alpha=0.3)
    axes[0].tick_params(axis="y", labelsize=8.5)
    axes[2].set_xlim(0.0, 1.0)
    return figure


def _cut(gains: list[float]) -> list[float]:
    """Gains, with losses cut at half of the largest gain: how bad is of no interest."""
    least = -0.5 * max([*gains, 1.0])
    return [max(g, least) for g in gains]


def gap(diagnosis: Diagnosis) -> Figure:
    """Rms of the whitened residual of each trial, before and after, with the noise floor."""
    base, fitted = diagnosis.stages["base"], fitted_fit(diagnosis)
    runs = base.bench.shooter.study.runs
    figure = Figure(figsize=(9.4, 0.3 * len(runs) + 1.2), layout="constrained")
    ax = figure.subplots()
    names = [r.trial.name + (" (held out)" if r.hold_out else "") for r in runs]
    before = _by_run(base.plain.system, len(runs))
    at = np.arange(len(runs))
    ax.axvline(1.0, color="0.4", ls=":", lw=1.2, label="noise floor")
    if fitted is not None:
        after = _by_run(fitted.system, len(runs))
        ax.hlines(at, after, before, color="0.75", lw=1.5, zorder=1)
        ax.plot(after, at, "o", color=NEW, label="corrected chair")
    ax.plot(before, at, "o", color=OLD, label="chair as it was")
    ax.set_yticks(at, names, fontsize=9)
    ax.invert_yaxis()
    ax.set_xlim(left=0.0)
    ax.set_xlabel(f"rms of the whitened residual below {BAND:g} Hz (1)")
    ax.legend(frameon=False, fontsize=9, loc="center left", bbox_to_anchor=(1.0, 0.5))
    ax.grid(axis="x", alpha=0.3)
    return figure


def _by_run(system: System, count: int) -> Array:
    out = np.full(count, np.nan)
    for run in range(count):
        cells = [c for c, r in zip(system.cells, system.run, strict=True) if r == run]
        dof = sum(c.total_dof for c in cells)
        if dof > 0.0:
            out[run] = np.sqrt(max(sum(c.total for c in cells), 0.0) / dof)
    return out


def compared(diagnosis: Diagnosis) -> Figure:
    """Whole runs in one go from their first state: measured, old chair, corrected chair.

    Held-out runs, or the longest others where none is held out; of each the two channels that the
    two chairs, or chair and measurement, differ most in.
    """
    base, fitted = diagnosis.stages["base"], fitted_fit(diagnosis)
    shooter = base.bench.shooter
    chosen = _runs_shown(shooter)
    whole = Shooter(shooter.study, [_whole(shooter, i) for i in chosen])
    plain = Fit(base.plain.fit.nuisances)
    old = _rolled(whole, shooter, plain, base.track)
    new: list[Array | None] = [None] * len(chosen)
    if fitted is not None:
        fit = Fit(base.plain.fit.nuisances, {}, fitted.fit.terms)
        new = [*_rolled(whole, shooter, fit, fitted.track)]
    figure = Figure(figsize=(9.4, 2.3 * len(chosen) + 0.6), layout="constrained")
    axes = figure.subplots(len(chosen), 2, squeeze=False)
    units = {c.name: c.unit for c in channels(shooter.base)}
    noise = np.array([base.bench.noise[c].total for c in whole.channels])
    for row, (k, w) in zip(axes, enumerate(whole.windows), strict=True):
        for ax, channel in zip(row, _telling(whole, w, old[k], new[k], noise), strict=True):
            _one_run(ax, whole, w, channel, old[k], new[k])
            name = whole.channels[channel]
            ax.set_ylabel(f"{name} ({units.get(name, 'SI')})", fontsize=8.5)
    for ax in axes[-1]:
        ax.set_xlabel("time (s)")
    axes[0, 0].legend(frameon=False, fontsize=8.5)
    return figure


def _runs_shown(shooter: Shooter) -> list[int]:
    runs = shooter.study.runs
    held = [i for i, r in enumerate(runs) if r.hold_out]
    return sorted(held or sorted(range(len(runs)), key=lambda i: -runs[i].duration))[:3]


def _whole(shooter: Shooter, run: int) -> Window:
    """One window over all of a run."""
    time = shooter.study.runs[run].trial.time
    begin, end = float(time[0]), float(time[-1])
    return Window(run, 0, begin, begin, end + shooter.step, np.arange(time.size))


def _rolled(whole: Shooter, shooter: Shooter, fit: Fit, track: Track) -> list[Array]:
    """Predictions (rows, channels) of each whole run, from its first window's state."""
    first = {w.run: i for i, w in reversed(list(enumerate(shooter.windows)))}
    model = whole.compile(fit.edit)
    jobs = [Job(model, w, track.states[first[w.run]]) for w in whole.windows]
    observer: Observer = fit.observer(whole.channels)
    return [
        observer.observe(whole, w, out.predicted)
        for w, out in zip(whole.windows, whole.run(jobs), strict=True)
    ]


def _telling(
    shooter: Shooter, window: Window, old: Array, new: Array | None, noise: Array
) -> list[int]:
    """The two channels with the largest difference, against noise."""
    against = shooter.measured(window) if new is None else new
    miss = residual(against, old, shooter.channels) / noise
    there = [bool(np.isfinite(column).any()) for column in shooter.measured(window).T]
    size = np.array(
        [float(np.nanmean(m**2)) if ok else -1.0 for m, ok in zip(miss.T, there, strict=True)]
    )
    order = [int(k) for k in np.argsort(-size)]
    return (order * 2)[:2]


def _one_run(
    ax: Axes, shooter: Shooter, window: Window, k: int, old: Array, new: Array | None
) -> None:
    run = shooter.study.runs[window.run]
    measured, time = shooter.measured(window), run.trial.time[window.rows]

    def near(values: Array) -> Array:  # angles that wrap are drawn beside the measurement
        return np.asarray(measured - residual(measured, values, shooter.channels))[:, k]

    there = ~np.isnan(measured[:, k])
    ax.plot(time[there], measured[there, k], ".", ms=2, color=MEASURED, label="measured")
    ax.plot(time[there], near(old)[there], color=OLD, lw=1.5, label="chair as it was")
    if new is not None:
        ax.plot(time[there], near(new)[there], color=NEW, lw=1.5, label="corrected chair")
    held = ", held out" if run.hold_out else ""
    ax.set_title(f"{run.trial.name}{held}", loc="left", fontsize=9)
    ax.grid(alpha=0.3)
