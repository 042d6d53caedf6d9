"""What a report of a diagnosis draws, made once: arrays, and a few simulations of whole runs.

In: the chair as it was, and the fit that is put into the corrected chair. Out: `Evidence`.
"""

from __future__ import annotations

import contextlib
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis.data.trial_checks import tells_turning
from mjchair.diagnosis.data.windows import Window
from mjchair.diagnosis.explain import missing_force
from mjchair.diagnosis.explain.column_ids import Quantity
from mjchair.diagnosis.explain.screening import Base
from mjchair.diagnosis.fit.nonlinear import Fitted
from mjchair.diagnosis.fit.slow_part import BAND
from mjchair.diagnosis.fit.system import System
from mjchair.diagnosis.fit.variant import Variant
from mjchair.diagnosis.next_experiment.design import Plan
from mjchair.diagnosis.replay.pulses import KINDS, Force, Pulse
from mjchair.diagnosis.replay.sampling import residual
from mjchair.diagnosis.replay.simulator import Job, WindowSimulator
from mjchair.diagnosis.replay.window_states import Track
from mjchair.diagnosis.result import (
    Evidence,
    ForceLevels,
    ForceSamples,
    Moved,
    TrialGap,
    WholeRun,
    WindowGaps,
)
from mjchair.errors import MjchairError
from mjchair.simulation.channels import channels

Array = NDArray[np.float64]
SHOWN = 3  # whole runs
NARROW = 0.04  # of the range: levels that are no wider lie on one another in a figure
LEVELS = 8  # of what a force may go with


def evidence(
    base: Base, fitted: Fitted | None, plan: Plan | None, forces: dict[Force, ForceSamples]
) -> Evidence:
    """What there is to draw.

    Args:
      fitted: the fit in the corrected chair; None without one. forces: as `missing_forces` gives.
    """
    study = base.bench.simulator.study
    return Evidence(
        windows=_window_gaps(base, fitted),
        trials=_trial_gaps(base, fitted),
        forces=forces,
        runs=_whole_runs(base, fitted),
        moved=_moved(base, fitted),
        turns=tells_turning(set(study.channels) - study.copied),
        plan=plan,
    )


def _measured(simulator: WindowSimulator) -> list[int]:
    """Places of the channels that were measured, and not copied from the other wheel."""
    copied = simulator.study.copied
    return [k for k, channel in enumerate(simulator.channels) if channel not in copied]


def _window_gaps(base: Base, fitted: Fitted | None) -> WindowGaps:
    simulator = base.bench.simulator
    seen = _measured(simulator)
    return WindowGaps(
        channels=tuple(simulator.channels[k] for k in seen),
        trials=np.array([w.run for w in simulator.windows]),
        times=np.array([(w.first, w.last) for w in simulator.windows]),
        before=_ratios(base.plain.system)[seen],
        after=None if fitted is None else _ratios(fitted.system)[seen],
        highest=BAND,
    )


def _ratios(system: System) -> Array:
    """Rms over noise, (channels, windows); NaN where a channel has nothing."""
    rows = [np.where(c.dof >= 1.0, c.chi2 / np.maximum(c.dof, 1.0), np.nan) for c in system.cells]
    return np.asarray(np.sqrt(np.array(rows).T))


def _trial_gaps(base: Base, fitted: Fitted | None) -> tuple[TrialGap, ...]:
    return tuple(
        TrialGap(
            trial=run.trial.name,
            held_out=run.hold_out,
            before=_of_run(base.plain.system, i),
            after=None if fitted is None else _of_run(fitted.system, i),
        )
        for i, run in enumerate(base.bench.simulator.study.runs)
    )


def _of_run(system: System, run: int) -> float | None:
    cells = [c for c, r in zip(system.cells, system.run, strict=True) if r == run]
    dof = sum(c.total_dof for c in cells)
    return float(np.sqrt(max(sum(c.total for c in cells), 0.0) / dof)) if dof > 0.0 else None


def missing_forces(base: Base) -> dict[Force, ForceSamples]:
    """The force forward and the yaw moment that would close the gap of the chair as it was."""
    missing = missing_force.residual_force(
        base.bench, base.around.track, base.around.pulses, base.around.answers
    )
    along = missing_force.drivers(base.bench, base.around.track)
    windows = base.bench.simulator.windows
    products = missing_force.pulse_products(
        base.bench,
        base.around.track,
        base.around.pulses,
        base.around.answers,
        base.bench.process,
    )
    out = {}
    for name in (Force.FORWARD, Force.YAW):
        mine = [k for k, p in enumerate(missing.pulses) if p.force == name]
        pulses = [missing.pulses[k] for k in mine]
        against = _against([_at(along[p.window], p) for p in pulses])
        out[name] = ForceSamples(
            unit=KINDS[name].unit,
            trials=np.array([windows[p.window].run for p in pulses]),
            time=np.array([p.time for p in pulses]),
            value=missing.value[mine],
            std=missing.std[mine],
            against=against,
            levels={
                driver: levels
                for driver, values in against.items()
                if (levels := _levels(products, base.around.pulses, name, np.array(mine), values))
            },
        )
    return out


def _levels(
    products: Sequence[missing_force.Products],
    pulses: Sequence[Pulse],
    force: Force,
    mine: NDArray[np.int64],
    values: Array,
) -> ForceLevels | None:
    """Mean forces at levels with about equally many pulses; None where there are not two levels.

    Args:
      mine: (n,), which of the pulses are of this kind. values: (n,), of what it may go with.
    """
    known = np.isfinite(values)
    if not known.any():
        return None
    edges = _edges(values[known])
    if edges.size < 3 or np.ptp(edges) < 1e-6:
        return None
    place = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, edges.size - 2)
    kept = {int(p): k for k, p in enumerate(np.unique(place[known]))}
    level = np.full(len(pulses), -1)
    level[mine[known]] = [kept[int(p)] for p in place[known]]
    value, std = missing_force.mean_forces(products, pulses, force, level)
    middle = np.array([values[known][place[known] == p].mean() for p in kept])
    return ForceLevels(middle=middle, value=value, std=std)


def _edges(values: Array) -> Array:
    """Edges of levels with equally many values (n,); values that nearly agree are one level.

    Half of all torques are those of a coast, zero but for noise.
    """
    edges = np.quantile(values, np.linspace(0.0, 1.0, LEVELS + 1))
    least = NARROW * np.ptp(edges)
    kept = [edges[0]]
    for edge in edges[1:-1]:
        if edge - kept[-1] > least and edges[-1] - edge > least:
            kept.append(edge)
    return np.array([*kept, edges[-1]])


def _at(along: dict[str, Array], pulse: Pulse) -> dict[str, float]:
    """Values at a pulse's peak."""
    row = min(int(np.searchsorted(along["time"], pulse.time)), along["time"].size - 1)
    return {name: float(values[row]) for name, values in along.items()}


def _against(at: Sequence[dict[str, float]]) -> dict[Quantity, Array]:
    """What a force may go with, one value a pulse."""
    known = {name: np.array([a[name] for a in at]) for name in (at[0] if at else ())}
    if not known:
        return {}
    turn = 2.0 * np.pi
    return {
        Quantity.SPEED: known["speed"],
        Quantity.YAW_RATE: known["yaw_rate"],
        Quantity.HEADING: np.remainder(known["heading"] + np.pi, turn) - np.pi,
        Quantity.SWIVEL: known["swivel"],
        Quantity.TORQUE: known["left_torque"] + known["right_torque"],
        Quantity.LEFT_TURN: np.remainder(known["left_angle"], turn),
        Quantity.RIGHT_TURN: np.remainder(known["right_angle"], turn),
        Quantity.STROKE: np.remainder(known["stroke"], turn),
    }


def _whole_runs(base: Base, fitted: Fitted | None) -> tuple[WholeRun, ...]:
    """Whole runs in one go from their first state, with the old and the corrected chair."""
    simulator = base.bench.simulator
    shown = _runs_shown(simulator)
    whole = WindowSimulator(
        simulator.study, [_whole(simulator, i) for i in shown], threads=simulator.threads
    )
    # both begin alike: the old chair's own first state makes up for what it lacks in that window
    begin = base.around.track if fitted is None else fitted.track
    old = _rolled(whole, simulator, Variant(base.bench.nuisances), begin)
    new: list[Array] | None = None
    if fitted is not None:
        # a chair that no rest is found for has no picture; its windows have been simulated
        with contextlib.suppress(MjchairError):
            new = _rolled(whole, simulator, fitted.variant, fitted.track)
    units = {c.name: c.unit for c in channels(simulator.base)}
    out, seen = [], _measured(simulator)
    names = [whole.channels[k] for k in seen]
    for k, w in enumerate(whole.windows):
        run, measured = simulator.study.runs[w.run], whole.measured(w)[:, seen]
        beside = [
            None if values is None else _beside(measured, values[k][:, seen], names)
            for values in (old, new)
        ]
        assert beside[0] is not None
        out.append(
            WholeRun(
                trial=run.trial.name,
                held_out=run.hold_out,
                time=run.trial.time[w.rows],
                channels=tuple(names),
                units=tuple(units.get(c, "SI") for c in names),
                noise=np.array([base.bench.noise[c].total for c in names]),
                measured=measured,
                before=beside[0],
                after=beside[1],
            )
        )
    return tuple(out)


def _beside(measured: Array, predicted: Array, names: Sequence[str]) -> Array:
    """Predictions, with angles that wrap beside the measured ones."""
    near = measured - residual(measured, predicted, names)
    return np.where(np.isnan(near), predicted, near)


def _runs_shown(simulator: WindowSimulator) -> list[int]:
    runs = simulator.study.runs
    held = [i for i, r in enumerate(runs) if r.hold_out]
    return sorted((held or sorted(range(len(runs)), key=lambda i: -runs[i].duration))[:SHOWN])


def _whole(simulator: WindowSimulator, run: int) -> Window:
    """One window over all of a run."""
    time = simulator.study.runs[run].trial.time
    begin, end = float(time[0]), float(time[-1])
    return Window(run, 0, begin, begin, end + simulator.step, np.arange(time.size))


def _rolled(
    whole: WindowSimulator, simulator: WindowSimulator, variant: Variant, track: Track
) -> list[Array]:
    """Predictions (rows, channels) of each whole run, from its first window's state."""
    first = {w.run: i for i, w in reversed(list(enumerate(simulator.windows)))}
    model = whole.compile(variant.edit)
    jobs = [Job(model, w, track.states[first[w.run]]) for w in whole.windows]
    errors = variant.sensor_errors(whole.channels)
    return [
        errors.applied(whole, w, out.predicted)
        for w, out in zip(whole.windows, whole.run(jobs), strict=True)
    ]


def _moved(base: Base, fitted: Fitted | None) -> tuple[Moved, ...]:
    here = base.plain if fitted is None else fitted
    return tuple(Moved(name=n.name, std=n.std, unit=n.unit, by=by) for n, by in here.moved)
