"""The noise of a study, after all that is smooth is explained, by a known effect or not.

In: a bench with first guesses of its sensors' noise, and answers to pulses of force. Out: the bench
with the sensors' powers and the levels of what shakes the chair as the study shows them. Forces
that go with speed, yaw rate, heading, a wheel's turn, a swivel, torque or strokes, and errors of
one sensor, are fitted along, so that none of them passes for noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis.data.own_resistance import own_resistance
from mjchair.diagnosis.data.study import other_wheel
from mjchair.diagnosis.explain import missing_force
from mjchair.diagnosis.explain.column_ids import EffectColumn, EffectGroup, ForceColumn, Quantity
from mjchair.diagnosis.fit import noise_levels, process
from mjchair.diagnosis.fit.bench import Bench
from mjchair.diagnosis.fit.column_ids import ColumnId
from mjchair.diagnosis.fit.noise_levels import Levels
from mjchair.diagnosis.fit.parameter_columns import sensor_column
from mjchair.diagnosis.fit.process import NAMED, Part, Process
from mjchair.diagnosis.replay.derivatives import Column
from mjchair.diagnosis.replay.measured_motion import motions
from mjchair.diagnosis.replay.pulses import Force, Pulse
from mjchair.diagnosis.replay.simulator import WindowSimulator
from mjchair.diagnosis.replay.window_states import Track
from mjchair.effects.effect import SensorError
from mjchair.measurement.sensors import sensor
from mjchair.model.rolling import rear_axle

Array = NDArray[np.float64]
SPREAD = {Force.FORWARD: 10.0, Force.YAW: 3.0}  # N, N m: prior of a force that goes with something
SCALE = 0.1  # prior of a sensor's scale, 1
SHAKES = 0.3  # of the chair's own rolling resistance: what shakes it harder has a cause
# of a moving person's force, that is in no model (assumptions): markers on skin tell a centre of
# mass to some per cent; without them strokes, of which no two are alike, have one course
UNLIKE, STROKES_UNLIKE = 0.1, 0.2
SHAKING = tuple(name for name in NAMED if name != "person")  # what shakes a chair
STEADY = ("drive", "side", "yaw")  # of that, where a steady force may hide
NEARLY = 0.98  # of the most that is believed of what shakes a chair: a word is said from there on
HUSH = 0.05  # of a level: nearly nothing
SIZES = 5.0  # sizes worth finding: prior of the best hypothesis


def with_shown_noise(
    bench: Bench,
    first: Track,
    nuisances: dict[ColumnId, Column],
    pulses: Sequence[Pulse],
    answers: Sequence[Array],
) -> Bench:
    """The bench with the least noise: what is left once everything smooth is explained."""
    shaking = process.first(bench.simulator, first, pulses, answers)
    given = noise_levels.known_parts(bench.simulator.study)
    parts = {
        part: np.full(level.size, given[part]) if part in given else level
        for part, level in shaking.levels.items()
    }
    shaking = replace(shaking, levels=parts)
    shaken = replace(bench, process=shaking)
    columns = {**nuisances, **_smooth(bench, first, pulses, answers), **_sensors(shaken, first)}
    return _estimated(bench, first, shaking, columns)[0]


def left_by(
    bench: Bench,
    here: Track,
    nuisances: dict[ColumnId, Column],
    best: dict[ColumnId, Column],
    given: bool = False,
    apart: bool = False,
) -> tuple[Bench, float]:
    """The bench with the noise that a hypothesis leaves, and its deviance.

    The deviance (`noise_levels.deviance`) compares hypotheses that were looked at with one bench.

    Where few windows tell a smooth force, it takes a part of the noise for itself; what the best
    effects do not explain, and what no force explains alike in all windows, is noise as well.

    Args:
      best: columns of the hypothesis, in sizes worth finding. given: see
        `noise_levels.least_powers`. apart: whether what it leaves of a shimmy is the noise of those
        windows alone.
    """
    assert bench.process is not None
    broad = {key: [SIZES * window for window in column] for key, column in best.items()}
    return _estimated(bench, here, bench.process, {**nuisances, **broad}, given, apart)


def loudness(bench: Bench) -> float:
    """Power of what shakes the chair, over the most that is believed of it; its loudest force."""
    return max(shares(bench).values()) ** 2


def shares(bench: Bench) -> dict[str, float]:
    """Level of each thing that shakes the chair, over the most that is believed of it."""
    assert bench.process is not None
    most, levels = _most(bench.simulator), bench.process.levels
    return {n: process.level(levels, n) / float(most[NAMED[n][0][0]].max()) for n in SHAKING}


def at_most(bench: Bench, names: Sequence[str] = STEADY) -> tuple[str, ...]:
    """What shakes the chair as much as is believed of it, where study.toml does not give it."""
    if bench.process is None:
        return ()
    given, known = noise_levels.known_parts(bench.simulator.study), shares(bench)
    return tuple(n for n in names if known[n] > NEARLY and NAMED[n][0][0] not in given)


def forward_levels(bench: Bench) -> list[dict[str, float]]:
    """How hard what shakes the chair pushes it forward: run of the fit -> N, kind by kind.

    Runs of a kind have one manoeuvre, with torques or without. No kind is listed where study.toml
    gives the level.
    """
    study, shaking = bench.simulator.study, bench.process
    if shaking is None or study.process.get("drive") is not None:
        return []
    levels = process.run_levels(shaking.levels, "drive")
    kinds: dict[tuple[str, bool], dict[str, float]] = {}
    for k in study.fitted:
        run = study.runs[k]
        kind = kinds.setdefault((run.manoeuvre, run.trial.inputs is None), {})
        kind[run.trial.name] = float(levels[k])
    return list(kinds.values())


def hushed(bench: Bench) -> Bench:
    """The bench with nearly nothing that shakes the chair, but for what study.toml gives."""
    assert bench.process is not None
    given = noise_levels.known_parts(bench.simulator.study)
    levels = {
        part: level if part in given or part == Part.PERSON else HUSH * level
        for part, level in bench.process.levels.items()
    }
    return replace(bench, process=replace(bench.process, levels=levels))


def _estimated(
    bench: Bench,
    here: Track,
    shaking: Process,
    columns: dict[ColumnId, Column],
    given: bool = False,
    apart: bool = False,
) -> tuple[Bench, float]:
    """The bench with the most probable levels, with the columns fitted along; the deviance."""
    simulator = bench.simulator
    windows = noise_levels.windows_of(
        simulator, here, bench.whitener, shaking, columns, bench.windows, apart
    )
    kinds = [bench.noise]
    if apart:
        kinds.append({c: known.where(True) for c, known in bench.noise.items()})
    least = np.vstack([noise_levels.least_powers(k, simulator.channels, given) for k in kinds])
    begin = Levels(parts=shaking.levels, wobbles=shaking.wobbles, bands=np.ones(least.shape))
    fixed = frozenset(noise_levels.known_parts(simulator.study))
    most = _most(simulator)
    shown = noise_levels.estimate(windows, begin, least, fixed, most=most)
    how_far = noise_levels.deviance(windows, shown)
    shown = replace(shown, bands=shown.bands * np.tile(_doubled(bench), len(kinds))[:, None])
    noise = noise_levels.with_levels(bench.noise, simulator.channels, _steps(bench), shown)
    process = replace(shaking, levels=shown.parts, wobbles=shown.wobbles)
    return replace(bench, noise=noise, process=process), how_far


def _most(simulator: WindowSimulator) -> dict[Part, Array]:
    """The largest levels (runs,) of what shakes a chair: shares of its own rolling resistance.

    N or N m. Of what a moving person does besides, a share of that person's force.
    """
    own = own_resistance(simulator.study.spec)
    half = 0.5 * rear_axle(simulator.base).track
    drive = SHAKES * own
    runs = simulator.study.runs
    most = {name: np.full(len(runs), drive) for name in NAMED}
    most["side"], most["yaw"] = np.full(len(runs), own), most["yaw"] * half
    most["person"] = np.array([UNLIKE if motions(run) else STROKES_UNLIKE for run in runs])
    return {part: most[name] for name, (parts, _) in NAMED.items() for part in parts}


def _smooth(
    bench: Bench, first: Track, pulses: Sequence[Pulse], answers: Sequence[Array]
) -> dict[ColumnId, Column]:
    """Forces that go with something other than the time, of one standard deviation."""
    columns = missing_force.driver_columns(bench, first, pulses, answers)
    return {
        key: [SPREAD[key.group.force] * window for window in column]
        for key, column in columns.items()
        if isinstance(key, ForceColumn) and key.group.driver.quantity != Quantity.TIME
    }


def _sensors(bench: Bench, first: Track) -> dict[ColumnId, Column]:
    """Bias and scale of every channel, of one standard deviation."""
    out: dict[ColumnId, Column] = {}
    for channel in bench.simulator.channels:
        for kind, size in ((SensorError.BIAS, sensor(channel).fault), (SensorError.SCALE, SCALE)):
            key = EffectColumn(EffectGroup(f"sensor_{kind}:{channel}", 0), 0)
            out[key] = sensor_column(bench, first, kind, channel, size)
    return out


def _doubled(bench: Bench) -> Array:
    """2 for both channels of a copied pair, which tell together what one tells, (channels,)."""
    study = bench.simulator.study
    pairs = {*study.copied, *(other_wheel(c) for c in study.copied)}
    return np.array([2.0 if c in pairs else 1.0 for c in bench.simulator.channels])


def _steps(bench: Bench) -> Array:
    """Median time between samples of every channel, s."""
    out = []
    for channel in bench.simulator.channels:
        pieces = [
            np.diff(run.trial.samples(channel)[0])
            for run in bench.simulator.study.runs
            if channel in run.trial.channels
        ]
        out.append(float(np.median(np.concatenate(pieces))))
    return np.array(out)
