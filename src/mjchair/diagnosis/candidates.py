"""The columns of every effect that the data could show, and what their coefficients mean."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis import force, sensitivity
from mjchair.diagnosis.fitting import SENSOR, Bench, Fit, Term, change
from mjchair.diagnosis.sensitivity import Column, Pulse
from mjchair.diagnosis.tracking import Track
from mjchair.effects.effect import Effect, Values, clip, step

Array = NDArray[np.float64]
FREQUENCIES = np.arange(0.4, 2.01, 0.05)  # Hz, of a sway that is looked for
PATCH = 0.5  # m, radius of a patch that is looked for, and distance between looks
WEIGHT = 880.0  # N, of an occupied chair: a patch's force from its coefficient


@dataclass(frozen=True)
class Start:
    """Columns of one effect from which a fit may begin.

    Attributes:
      effect: which. group: of columns, ``key/seed``. columns: their names.
      combine: coefficients to values. free: parameters that a fit moves.
    """

    effect: Effect
    group: str
    columns: tuple[str, ...]
    combine: Callable[[Array], Values]
    free: tuple[str, ...]

    def term(self, coefficients: Array) -> Term:
        """The effect with values from the coefficients of the columns."""
        return Term(self.effect, self.combine(coefficients), self.free)


def collect(
    bench: Bench,
    track: Track,
    fit: Fit,
    effects: Sequence[Effect],
    found: Sequence[Pulse],
    answers: Sequence[Array],
    progress: Callable[[str], None],
) -> tuple[dict[str, Column], list[Start]]:
    """Columns and starts of all effects."""
    columns: dict[str, Column] = {}
    starts: list[Start] = []
    for effect in effects:
        progress(effect.key)
        if effect.tags.get("wave"):
            _waves(bench, effect, found, answers, columns, starts)
        elif effect.tags.get("place"):
            _places(bench, track, effect, found, answers, columns, starts)
        elif effect.name in SENSOR:
            _sensor(bench, track, effect, columns, starts)
        else:
            _points(bench, track, fit, effect, columns, starts)
    return columns, starts


def _points(
    bench: Bench,
    track: Track,
    fit: Fit,
    effect: Effect,
    columns: dict[str, Column],
    starts: list[Start],
) -> None:
    plain = effect.seeds is None
    for k, seed in enumerate(effect.starts()):
        group = f"{effect.key}/{k}"
        points = sensitivity.effect_points(effect, seed)
        made = sensitivity.differences(
            bench.shooter, track, points, fit.edit, fit.observer(bench.shooter.channels)
        )
        names = [f"{group}/{j}" for j in range(len(made))]
        columns.update(zip(names, made, strict=True))
        free = tuple(p.name for p in effect.fitted)
        if not plain:
            starts.append(Start(effect, group, tuple(names), seed.combine, free))
            continue
        for count in range(1, len(names) + 1):
            for chosen in combinations(range(len(names)), count):
                starts.append(
                    Start(
                        effect,
                        group,
                        tuple(names[j] for j in chosen),
                        _some(effect, chosen),
                        tuple(effect.fitted[j].name for j in chosen),
                    )
                )


def _some(effect: Effect, chosen: Sequence[int]) -> Callable[[Array], Values]:
    def combine(coefficients: Array) -> Values:
        values = effect.neutral()
        for j, c in zip(chosen, coefficients, strict=True):
            p = effect.fitted[j]
            values[p.name] = clip(p, p.neutral + float(c) * step(p))
        return values

    return combine


def _sensor(
    bench: Bench, track: Track, effect: Effect, columns: dict[str, Column], starts: list[Start]
) -> None:
    name = SENSOR[effect.name]
    size = change(effect, name)
    key = f"{effect.key}/0/0"
    columns[key] = sensitivity.sensor_column(
        bench.shooter, track, effect.name, str(effect.channel), size
    )
    p = effect.parameter(name)

    def combine(coefficients: Array) -> Values:
        return {name: clip(p, float(coefficients[0]) * size)}

    starts.append(Start(effect, f"{effect.key}/0", (key,), combine, (name,)))


def _waves(
    bench: Bench,
    effect: Effect,
    found: Sequence[Pulse],
    answers: Sequence[Array],
    columns: dict[str, Column],
    starts: list[Start],
) -> None:
    mass = effect.parameter("mass").typical
    time = np.array([p.time for p in found])
    forward = np.array([float(p.force == "Fx") for p in found])
    for k, frequency in enumerate(FREQUENCIES):
        rate = 2.0 * np.pi * frequency
        names = (f"{effect.key}/{k}/0", f"{effect.key}/{k}/1")
        for name, wave in zip(names, (np.sin(rate * time), np.cos(rate * time)), strict=True):
            columns[name] = force.shaped_column(bench, found, answers, forward * wave * 10.0)

        def combine(coefficients: Array, f: float = frequency, rate: float = rate) -> Values:
            a, b = (10.0 * float(c) for c in coefficients)
            size = float(np.hypot(a, b)) / (mass * rate**2)
            return {
                "mass": mass,
                "amplitude": min(max(size, 1e-4), 0.4),
                "frequency": f,
                "phase": float(np.arctan2(b, a)),
            }

        free = ("amplitude", "frequency", "phase")
        starts.append(Start(effect, f"{effect.key}/{k}", names, combine, free))


def _places(
    bench: Bench,
    track: Track,
    effect: Effect,
    found: Sequence[Pulse],
    answers: Sequence[Array],
    columns: dict[str, Column],
    starts: list[Start],
) -> None:
    known = force.drivers(bench, track)
    at = []
    for p in found:
        d = known[p.window]
        row = int(np.clip(np.searchsorted(d["time"], p.time), 0, len(d["time"]) - 1))
        at.append((d["x"][row], d["y"][row], np.tanh(d["speed"][row] / 0.05)))
    place = np.array(at)
    forward = np.array([float(p.force == "Fx") for p in found])
    cells = {tuple(c) for c in np.round(place[forward > 0.0][:, :2] / PATCH).astype(int).tolist()}
    for k, cell in enumerate(sorted(cells)):
        centre = PATCH * np.array(cell)
        near = np.clip(1.5 - np.hypot(*(place[:, :2] - centre).T) / PATCH, 0.0, 1.0)
        sizes = -forward * near * place[:, 2] * WEIGHT * 0.02
        name = f"{effect.key}/{k}/0"
        columns[name] = force.shaped_column(bench, found, answers, sizes)

        def combine(coefficients: Array, centre: Array = centre) -> Values:
            return {
                "x": float(centre[0]),
                "y": float(centre[1]),
                "radius": PATCH,
                "coefficient": float(np.clip(0.02 * coefficients[0], -0.04, 0.4)),
            }

        free = ("x", "y", "radius", "coefficient")
        starts.append(Start(effect, f"{effect.key}/{k}", (name,), combine, free))
