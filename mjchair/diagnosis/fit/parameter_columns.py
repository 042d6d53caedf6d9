"""The columns of a fit: derivatives of predictions by nuisances and parameters of effects.

In: a variant of the chair and its track. Out: columns, in prior standard deviations or typical
changes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from mjchair.diagnosis.data.roughly_known import COMPLIANCE, Nuisance
from mjchair.diagnosis.fit.bench import Bench
from mjchair.diagnosis.fit.column_ids import ColumnId, ParameterId, RoughlyKnown
from mjchair.diagnosis.fit.variant import Variant, nudged
from mjchair.diagnosis.replay import derivatives
from mjchair.diagnosis.replay.derivatives import Column, Point
from mjchair.diagnosis.replay.sensor_errors import SensorErrors
from mjchair.diagnosis.replay.window_states import Track
from mjchair.effects.effect import SensorError

STIFF, SOFT = -0.8, 0.67  # of a compliance, by which columns to its two sides are taken
PART = 0.5  # standard deviations of a nuisance by which its derivative is taken
FINER = 1.5  # difference of two step sizes to that of this step to none, with a margin


def nuisance_columns(bench: Bench, track: Track, variant: Variant) -> dict[ColumnId, Column]:
    """Columns of all nuisances and of the differences to a finer simulation."""
    simulator = bench.simulator
    mechanical = [n for n in bench.nuisances if n.edit is not None]
    plain = [n for n in mechanical if not n.sides]
    points = [
        *(_point(variant, n, _part(n)) for n in plain),
        Point(derivatives.half_step, FINER, fine=True),
        Point(derivatives.other_integrator, FINER, fine=True),
    ]
    errors = variant.sensor_errors(simulator.channels)
    columns = derivatives.differences(simulator, track, points, variant.edit, errors)
    names = [*(n.name for n in plain), "half_step", "integrator"]
    out: dict[ColumnId, Column] = {
        RoughlyKnown(name): column for name, column in zip(names, columns, strict=True)
    }
    for n in mechanical:
        if n.sides:
            out |= _sides(bench, track, variant, n)
    late = simulator.input_step() / np.sqrt(12.0)
    if late > 0.0 and track.coarse is not None:
        # a torque that changes between two samples changes anywhere between them
        model = simulator.compile(variant.edit)
        shifted = derivatives.predictions(simulator, track, model, errors, late, coarse=True)
        out[RoughlyKnown("input_timing")] = [
            a - b for a, b in zip(shifted, track.coarse, strict=True)
        ]
    for n in bench.nuisances:
        if n.edit is None:
            out[RoughlyKnown(n.name)] = sensor_column(bench, track, n.error, n.channel, n.std)
    return out


def sensor_column(
    bench: Bench,
    track: Track,
    kind: SensorError,
    channel: str,
    size: float,
    errors: SensorErrors | None = None,
) -> Column:
    """What a bias (SI), a scale (1) or a delay (s) of one channel changes.

    A scale is also one of what shakes the chair, as far as the other channels tell it.

    Args:
      errors: those of the track's sensors; None: they have none.
    """
    shown = track.predicted
    if kind == SensorError.SCALE:
        bias, gain = (errors.bias, errors.scale) if errors else ({}, {})
        less, by = bias.get(channel, 0.0), 1.0 + gain.get(channel, 0.0)
        shown = [(y - less) / by + s for y, s in zip(shown, bench.shaken(track), strict=True)]
    return derivatives.sensor_column(bench.simulator, shown, kind, channel, size)


def _sides(
    bench: Bench, track: Track, variant: Variant, nuisance: Nuisance
) -> dict[ColumnId, Column]:
    """Columns of a compliance to its two sides, as far as both simulate; the first bears its name.

    A chair on stiff tires rocks not only less than one on soft tires but sooner: no one straight
    line goes from tires that do not give way to those that give way twice as much. Where the chair
    does not simulate with so stiff tires, the first is of tires a little stiffer.
    """
    errors = variant.sensor_errors(bench.simulator.channels)

    def beside(part: float) -> Column:
        point = _point(variant, nuisance, part)
        return derivatives.differences(bench.simulator, track, [point], variant.edit, errors)[0]

    stiff, soft = (beside(side / nuisance.std) for side in (STIFF, SOFT))
    out: dict[ColumnId, Column] = {RoughlyKnown(nuisance.name): stiff}
    if not _simulates(stiff):
        out[RoughlyKnown(nuisance.name)] = beside(_part(nuisance))
    if _simulates(soft):
        out[RoughlyKnown(softer(nuisance))] = soft
    return out


def _simulates(column: Column) -> bool:
    """Whether every prediction of a column is finite."""
    return all(np.isfinite(window).all() for window in column)


def columns_of(nuisance: Nuisance) -> tuple[RoughlyKnown, RoughlyKnown]:
    """The columns of a nuisance, the second there only where more and less of it have their own."""
    return RoughlyKnown(nuisance.name), RoughlyKnown(softer(nuisance))


def softer(nuisance: Nuisance) -> str:
    """Name of the column of more compliance, where more and less have columns of their own."""
    return f"{nuisance.name}_softer"


def _point(variant: Variant, nuisance: Nuisance, part: float) -> Point:
    """The variant with a part more of a nuisance, for a column of one standard deviation."""
    return Point(_beside(variant, nuisance, part).edit, 1.0 / part, whole=True)


def _part(nuisance: Nuisance) -> float:
    """Standard deviations of a nuisance by which its derivative is taken.

    Tires are made stiffer by the same part whatever a study says of them: a time step is for some.
    """
    return -COMPLIANCE / nuisance.std if nuisance.linear else PART


def _beside(variant: Variant, nuisance: Nuisance, part: float) -> Variant:
    """The variant with a part more of a nuisance, which is in the chair before its effects are.

    A chair 2 kg heavier is one whose frame is: of a person who moves on it nothing was added.
    """
    there = variant.offsets.get(nuisance.name, 0.0) + part
    return replace(variant, offsets={**variant.offsets, nuisance.name: there})


def term_columns(
    bench: Bench,
    track: Track,
    variant: Variant,
    known: Mapping[ParameterId, float] | None = None,
    side: float = 1.0,
) -> dict[ColumnId, Column]:
    """One column a free parameter of the variant's effects, in units of its typical change.

    Args:
      known: standard errors of parameters, SI, from a fit near by; None: there is none.
      side: to which a parameter is moved, 1 to larger values, -1 to smaller ones.
    """
    simulator = bench.simulator
    errors = variant.sensor_errors(simulator.channels)
    out: dict[ColumnId, Column] = {}
    points: dict[ParameterId, Point] = {}
    for term in variant.terms:
        for key, parameter in term.parameters:
            effect = term.effect
            if effect.sensor is not None:
                channel, size = str(effect.channel), parameter.change
                out[key] = sensor_column(bench, track, effect.sensor, channel, size, errors)
                continue
            beside, factor = nudged(variant, term, parameter, (known or {}).get(key), side)
            unchanged = simulator.without_motion(effect.measured)
            points[key] = Point(beside.edit, factor, unchanged=unchanged)
    if points:
        # a point here is a whole chair, so nothing comes before its edit
        model = simulator.compile(variant.edit)
        base = derivatives.predictions(simulator, track, model, errors, coarse=True)
        for key, point in points.items():
            model = simulator.compile(point.edit)
            same = {i: base[i] for i in point.unchanged}
            edited = derivatives.predictions(
                simulator, track, model, errors, coarse=True, known=same
            )
            out[key] = [point.factor * (e - y) for e, y in zip(edited, base, strict=True)]
    return {key: out[key] for term in variant.terms for key, _ in term.parameters}


def shared_columns(variant: Variant, columns: Mapping[ColumnId, Column]) -> dict[ColumnId, Column]:
    """Columns of what is roughly known, of parameters that do the same and are free.

    Of one radius that both wheels share, the data cannot tell what is the tires' own and what was
    only roughly known. Two derivatives that differ by rounding would tell it, and wrongly.
    """
    stds = {n.name: n.std for n in variant.nuisances}
    out: dict[ColumnId, Column] = {}
    for term in variant.terms:
        change = {p.name: p.change for _, p in term.parameters}
        for nuisance, names in term.effect.shared.items():
            if set(names) <= set(change) and nuisance in stds:
                parts = [
                    [(stds[nuisance] / change[name]) * window for window in columns[key]]
                    for name, key in ((n, ParameterId(term.effect.key, n)) for n in names)
                ]
                out[RoughlyKnown(nuisance)] = [np.sum(w, axis=0) for w in zip(*parts, strict=True)]
    return out
