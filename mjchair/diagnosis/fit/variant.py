"""A variant of the study's chair: what is only roughly known at given values, effects added.

In: nuisances, their offsets, and effects with values. Out: an edit of the chair's specification,
and the errors of its sensors.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import mujoco

from mjchair.diagnosis.data.roughly_known import Nuisance
from mjchair.diagnosis.fit.column_ids import ParameterId
from mjchair.diagnosis.replay.sensor_errors import SensorErrors
from mjchair.effects.effect import Effect, Parameter, SensorError, Values

NUDGE = 0.25  # of a parameter's typical change, by which a derivative is taken at most
ERRORS = 3.0  # standard errors by which it is taken, where they are known
LEAST = 0.003  # of a typical change, by which it is taken at least: less is the rounding of a run


@dataclass(frozen=True)
class Term:
    """An effect with its values; `free` are the parameters that a fit moves."""

    effect: Effect
    values: Values
    free: tuple[str, ...]

    @property
    def parameters(self) -> Iterator[tuple[ParameterId, Parameter]]:
        """The free parameters with their identifiers."""
        for name in self.free:
            yield ParameterId(self.effect.key, name), self.effect.parameter(name)


@dataclass(frozen=True)
class Variant:
    """A variant of the chair.

    Attributes:
      nuisances: all of the study. offsets: name -> standard deviations, mechanical ones only.
      terms: the effects that are in it.
    """

    nuisances: tuple[Nuisance, ...]
    offsets: dict[str, float] = field(default_factory=dict)
    terms: tuple[Term, ...] = ()

    @property
    def known_roughly(self) -> list[tuple[Nuisance, float]]:
        """What is only roughly known of the chair, and by how many deviations it is moved."""
        return [(n, self.offsets[n.name]) for n in self.nuisances if n.name in self.offsets]

    def edit(self, spec: mujoco.MjSpec) -> None:
        """Make the variant of the study's chair."""
        self.edit_chair(spec)
        for term in self.terms:
            if term.effect.sensor is None:
                term.effect.apply(spec, term.values)

    def edit_chair(self, spec: mujoco.MjSpec) -> None:
        """Move what is only roughly known, and nothing else."""
        for n in self.nuisances:
            if n.edit is not None and self.offsets.get(n.name):
                n.edit(spec, self.offsets[n.name] * n.std)

    def sensor_errors(self, channels: Sequence[str]) -> SensorErrors:
        """What its sensors do to the channels."""
        errors: dict[SensorError, dict[str, float]] = {kind: {} for kind in SensorError}
        for term in self.terms:
            effect = term.effect
            if effect.sensor is not None and effect.channel:
                errors[effect.sensor][effect.channel] = term.values[effect.sensor]
        return SensorErrors(
            channels,
            bias=errors[SensorError.BIAS],
            scale=errors[SensorError.SCALE],
            delay=errors[SensorError.DELAY],
        )


def nudged(
    variant: Variant,
    term: Term,
    parameter: Parameter,
    std: float | None = None,
    side: float = 1.0,
) -> tuple[Variant, float]:
    """A variant with one parameter a little aside, and its typical change over that little.

    A rear wheel may be known to 0.05 mm, and half a millimetre further a caster lifts off in a
    turn: a derivative over more than the standard error is that of another motion.

    Args:
      std: standard error of the parameter; None: not known yet.
      side: 1 to larger values, -1 to smaller ones; to the other side where a bound is in the way.
    """
    by = NUDGE * parameter.change
    if std is not None:
        by = min(by, max(ERRORS * std, LEAST * parameter.change))
    by *= side
    value = term.values[parameter.name]
    if not parameter.low <= value + by <= parameter.high:
        by = -by
    moved = replace(term, values={**term.values, parameter.name: value + by})
    terms = tuple(moved if t is term else t for t in variant.terms)
    return replace(variant, terms=terms), parameter.change / by
