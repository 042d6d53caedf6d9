"""The columns of every effect that the data could show, and what their coefficients mean.

In: effects, and a track of the chair around which they are screened. Out: columns, and starts that
turn coefficients of columns into values of an effect. An effect that this chair cannot have is
dropped, with a note.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis.explain import missing_force, search_rules
from mjchair.diagnosis.explain.column_ids import EffectColumn, EffectGroup
from mjchair.diagnosis.fit import bounded
from mjchair.diagnosis.fit.bench import Bench
from mjchair.diagnosis.fit.column_ids import ColumnId
from mjchair.diagnosis.fit.parameter_columns import sensor_column
from mjchair.diagnosis.fit.variant import Term, Variant
from mjchair.diagnosis.replay import derivatives
from mjchair.diagnosis.replay.derivatives import Column
from mjchair.diagnosis.replay.pulses import Force, Pulse
from mjchair.diagnosis.replay.window_states import Track
from mjchair.effects.effect import (
    Effect,
    Parameter,
    Place,
    SensorError,
    Values,
    Wave,
    clip,
    step,
)
from mjchair.errors import MjchairError

Array = NDArray[np.float64]
WAVE = 10.0  # N, amplitude of a wave's columns
BEYOND = 2.0  # times its bounds: no effect is as large
DELAYS = (0.05, 0.1, 0.2, 0.4)  # s, late or early, besides the usual one
ITSELF = 0.5  # of a delay, within which its column asks for that delay
ROLLS = 0.05  # m/s, above which a brake acts in full


@dataclass(frozen=True, kw_only=True)
class Start:
    """Columns of one effect from which a fit may begin.

    Attributes:
      effect: which. group: of columns. columns: those of the group that it uses.
      combine: coefficients to values. free: parameters that a fit moves.
      least: coefficients below this are of no such effect.
    """

    effect: Effect
    group: EffectGroup
    columns: tuple[EffectColumn, ...]
    combine: Callable[[Array], Values]
    free: tuple[str, ...]
    least: float = -np.inf

    def term(self, coefficients: Array) -> Term:
        """The effect with values from the coefficients of the columns."""
        return Term(self.effect, self.combine(coefficients), self.free)

    @property
    def sizes(self) -> tuple[Parameter, ...]:
        """The free parameters that say how large the effect is: one a column, without seeds."""
        return tuple(p for p in self.effect.sizes if p.name in self.free)

    def allows(self, coefficients: Array) -> bool:
        """Whether coefficients lie on the allowed side of every parameter."""
        if self.effect.seeds is None and len(coefficients) == len(self.sizes):
            for c, p in zip(coefficients, self.sizes, strict=True):
                if c < 0.0 and p.neutral in (p.low, p.high):
                    return False
        return not (coefficients < self.least).any()

    def can_be(self, coefficients: Array) -> bool:
        """Whether the sizes that coefficients ask for lie within BEYOND times the bounds.

        Where they do not, what linear algebra promises is far from what the effect can bring.
        """
        if self.effect.seeds is not None or len(coefficients) != len(self.sizes):
            return True
        for c, p in zip(coefficients, self.sizes, strict=True):
            by = float(c) * step(p)
            room = p.high - p.neutral if by > 0.0 else p.neutral - p.low
            if abs(by) > BEYOND * room:
                return False
        return True


@dataclass
class Candidates:
    """Columns and starts of all effects; `dropped`: a line for each that this chair cannot have."""

    columns: dict[ColumnId, Column] = field(default_factory=dict)
    starts: list[Start] = field(default_factory=list)
    dropped: list[str] = field(default_factory=list)

    def add(self, columns: Sequence[Column], starts: Sequence[Start]) -> None:
        """Add the columns of one group, and its starts; the last of these has all columns."""
        self.columns.update(zip(starts[-1].columns, columns, strict=True))
        self.starts += starts


@dataclass(frozen=True, kw_only=True)
class Around:
    """Where effects are screened: the chair, its track, and its answers to pulses of force."""

    bench: Bench
    track: Track
    variant: Variant
    pulses: Sequence[Pulse]
    answers: Sequence[Array]


def collect(
    around: Around, effects: Sequence[Effect], progress: Callable[[str], None]
) -> Candidates:
    """Columns and starts of all effects."""
    out = Candidates()
    for effect in effects:
        progress(effect.key)
        try:
            _add(out, around, effect)
        except MjchairError as error:
            out.dropped.append(f"{effect.key} was not tried: {error}")
    return out


def _add(out: Candidates, around: Around, effect: Effect) -> None:
    if effect.wave is not None:
        _add_waves(out, around, effect, effect.wave)
    elif effect.place is not None:
        _add_places(out, around, effect, effect.place)
    elif effect.sensor is not None:
        _add_sensor(out, around, effect)
    else:
        _add_points(out, around, effect)


def _ids(group: EffectGroup, count: int) -> tuple[EffectColumn, ...]:
    return tuple(EffectColumn(group, k) for k in range(count))


def _add_points(out: Candidates, around: Around, effect: Effect) -> None:
    """One rollout a point of each seed; of plain effects every choice of parameters is a start."""
    simulator = around.bench.simulator
    errors = around.variant.sensor_errors(simulator.channels)
    # two forms of one effect, such as two motions of a rider, are one hypothesis
    first = len({start.group for start in out.starts if start.effect.key == effect.key})
    made = []
    for k, seed in enumerate(effect.starts()):
        points = derivatives.effect_points(simulator, effect, seed)
        columns = derivatives.differences(
            simulator, around.track, points, around.variant.edit, errors
        )
        if not all(np.isfinite(window).all() for column in columns for window in column):
            raise MjchairError("its simulation fails")
        group = EffectGroup(effect.key, first + k)
        ids = _ids(group, len(columns))
        if effect.seeds is None:
            starts = _choices(effect, group, ids)
        else:
            free = tuple(p.name for p in effect.fitted)
            starts = [
                Start(
                    effect=effect,
                    group=group,
                    columns=ids,
                    combine=seed.combine,
                    free=free,
                    least=seed.least,
                )
            ]
        made.append((columns, starts))
    for columns, starts in made:
        out.add(columns, starts)


def _choices(effect: Effect, group: EffectGroup, ids: tuple[EffectColumn, ...]) -> list[Start]:
    """A start for every choice of sizes, all of them last; what only shapes them is always free."""
    shapes = tuple(p.name for p in effect.fitted if not p.sized)
    return [
        Start(
            effect=effect,
            group=group,
            columns=tuple(ids[j] for j in chosen),
            combine=_some(effect, chosen),
            free=(*(effect.sizes[j].name for j in chosen), *shapes),
        )
        for count in range(1, len(ids) + 1)
        for chosen in combinations(range(len(ids)), count)
    ]


def _some(effect: Effect, chosen: Sequence[int]) -> Callable[[Array], Values]:
    def combine(coefficients: Array) -> Values:
        values = effect.neutral()
        for j, c in zip(chosen, coefficients, strict=True):
            p = effect.sizes[j]
            values[p.name] = clip(p, p.neutral + float(c) * step(p))
        return values

    return combine


def _add_sensor(out: Candidates, around: Around, effect: Effect) -> None:
    assert effect.sensor is not None
    p = effect.parameter(effect.sensor)
    group = EffectGroup(effect.key, 0)
    size = _best_delay(around, effect, p) if effect.sensor == SensorError.DELAY else p.change
    column = [p.change / size * y for y in _of_sensor(around, effect, size)]

    def combine(coefficients: Array) -> Values:
        return {p.name: clip(p, float(coefficients[0]) * p.change)}

    start = Start(
        effect=effect, group=group, columns=_ids(group, 1), combine=combine, free=(p.name,)
    )
    out.add([column], [start])


def _of_sensor(around: Around, effect: Effect, size: float) -> Column:
    assert effect.sensor is not None
    return sensor_column(around.bench, around.track, effect.sensor, str(effect.channel), size)


def _best_delay(around: Around, effect: Effect, p: Parameter) -> float:
    """The delay (s) whose column tells most; the usual one where no other tells clearly more.

    A delay that is no small part of a stroke is no multiple of a small delay: an accelerometer
    0.2 s late promised 25 of chi2, where it brings 197, and passed for one that shows nothing.
    Columns that ask for another delay than their own are of something else that is missing.
    """
    sizes = [p.change, *(d for late in DELAYS for d in (late, -late) if p.low <= d <= p.high)]
    ids = _ids(EffectGroup(effect.key, 0), len(sizes))
    columns: dict[ColumnId, Column] = {
        name: _of_sensor(around, effect, size) for name, size in zip(ids, sizes, strict=True)
    }
    bench = around.bench
    system = bench.system(around.track, columns, 0, around.variant, only=bench.windows)
    reduced = bounded.reduce(system, bench.windows)
    asked = [float(reduced.solve([k])[0]) for k in range(len(sizes))]
    gains = [
        reduced.gain([k]) if k == 0 or abs(share - 1.0) <= ITSELF else 0.0
        for k, share in enumerate(asked)
    ]
    best = int(np.argmax(gains))
    return sizes[best] if gains[best] - gains[0] > search_rules.WORTH else p.change


def _add_waves(out: Candidates, around: Around, effect: Effect, wave: Wave) -> None:
    """A sine and a cosine of force forward at every frequency."""
    time = np.array([p.time for p in around.pulses])
    forward = np.array([float(p.force == Force.FORWARD) for p in around.pulses])
    for k, frequency in enumerate(wave.frequencies):
        rate = 2.0 * np.pi * frequency
        columns = [
            _shaped(around, WAVE * forward * course)
            for course in (np.sin(rate * time), np.cos(rate * time))
        ]

        def combine(coefficients: Array, frequency: float = frequency) -> Values:
            sine, cosine = (WAVE * float(c) for c in coefficients)
            return wave.values(sine, cosine, frequency)

        group = EffectGroup(effect.key, k)
        start = Start(
            effect=effect, group=group, columns=_ids(group, 2), combine=combine, free=wave.free
        )
        out.add(columns, [start])


def _add_places(out: Candidates, around: Around, effect: Effect, place: Place) -> None:
    """A brake in every place along the ways, of the coefficient 1."""
    known = missing_force.drivers(around.bench, around.track)
    at = []
    for p in around.pulses:
        d = known[p.window]
        row = int(np.clip(np.searchsorted(d["time"], p.time), 0, len(d["time"]) - 1))
        at.append((d["x"][row], d["y"][row], np.tanh(d["speed"][row] / ROLLS)))
    where = np.array(at)
    forward = np.array([float(p.force == Force.FORWARD) for p in around.pulses])
    passed = np.round(where[forward > 0.0][:, :2] / place.radius).astype(int)
    brake = place.share * _weight(around.bench)
    for k, cell in enumerate(sorted({tuple(c) for c in passed.tolist()})):
        centre = place.radius * np.array(cell)
        near = np.clip(1.5 - np.hypot(*(where[:, :2] - centre).T) / place.radius, 0.0, 1.0)

        def combine(coefficients: Array, centre: Array = centre) -> Values:
            return place.values(float(centre[0]), float(centre[1]), float(coefficients[0]))

        group = EffectGroup(effect.key, k)
        start = Start(
            effect=effect,
            group=group,
            columns=_ids(group, 1),
            combine=combine,
            free=place.free,
            least=0.0,
        )
        out.add([_shaped(around, -brake * forward * near * where[:, 2])], [start])


def _weight(bench: Bench) -> float:
    """Of the chair with all that it carries, N."""
    model = bench.simulator.base
    return float(model.body_mass.sum() * np.linalg.norm(model.opt.gravity))


def _shaped(around: Around, sizes: Array) -> Column:
    return missing_force.shaped_column(around.bench, around.pulses, around.answers, sizes)
