"""What an effect is: an edit of an MjSpec with parameters, and what is known about it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import mujoco

from mjchair.errors import MjchairError, nearest

Values = dict[str, float]
Edit = Callable[..., None]


@dataclass(frozen=True)
class Parameter:
    """A number of an effect. `neutral` is the value at which the effect is not there.

    Attributes:
      name: of the parameter. unit: SI, "1" where it has none.
      typical: size worth finding, used as step of finite differences and to state detectability.
      low, high: physical bounds. neutral: no effect.
      fitted: False for a number that data do not determine; it keeps `typical`.
      probe: share of the typical change at which the response is taken. A rear wheel 3 mm smaller
        lifts a caster in a turn, one 0.75 mm smaller does not; but a tenth less friction is not
        felt where a half is.
    """

    name: str
    unit: str
    typical: float
    low: float
    high: float
    neutral: float = 0.0
    fitted: bool = True
    probe: float = 0.25


@dataclass(frozen=True)
class Seed:
    """Where a fit of an effect begins: points whose responses are combined linearly.

    Attributes:
      points: parameter values, one mapping a column. factors: what each response is multiplied
        by; None: 1.
      combine: coefficients of the columns (1: the point itself) to parameter values.
    """

    points: tuple[Values, ...]
    combine: Callable[[Any], Values]
    factors: tuple[float, ...] | None = None


@dataclass(frozen=True)
class Effect:
    """A named physical effect.

    Attributes:
      name: as in diagnosis.json. parameters: in order.
      signature: one line, what it looks like. source: where form and sizes come from.
      edit: ``edit(spec, **values)`` changes the specification in place.
      channel: for effects of a sensor, the scalar channel; None for the others.
      seeds: starts of a fit where one typical step a parameter will not do; None: those steps.
      measured: the effect follows the table column of this name.
    """

    name: str
    parameters: tuple[Parameter, ...]
    signature: str
    source: str
    edit: Edit
    channel: str | None = None
    seeds: tuple[Seed, ...] | None = None
    measured: str | None = None
    tags: Mapping[str, str] = field(default_factory=dict)

    @property
    def key(self) -> str:
        """Name, with the channel where there is one."""
        return f"{self.name}:{self.channel}" if self.channel else self.name

    @property
    def fitted(self) -> tuple[Parameter, ...]:
        """Parameters that a fit may move."""
        return tuple(p for p in self.parameters if p.fitted)

    def parameter(self, name: str) -> Parameter:
        """The parameter of that name."""
        return next(p for p in self.parameters if p.name == name)

    def neutral(self) -> Values:
        """Values at which the effect is not there; numbers that are not fitted at their own."""
        return {p.name: p.neutral if p.fitted else p.typical for p in self.parameters}

    def starts(self) -> tuple[Seed, ...]:
        """The seeds, or one typical step a parameter."""
        if self.seeds is not None:
            return self.seeds
        neutral = self.neutral()
        points = tuple({**neutral, p.name: p.neutral + p.probe * step(p)} for p in self.fitted)

        def combine(coefficients: Any) -> Values:
            values = dict(neutral)
            for p, c in zip(self.fitted, coefficients, strict=True):
                values[p.name] = clip(p, p.neutral + float(c) * step(p))
            return values

        return (Seed(points, combine, tuple(1.0 / p.probe for p in self.fitted)),)

    def apply(self, spec: mujoco.MjSpec, values: Mapping[str, float]) -> None:
        """Edit the specification in place.

        Raises:
          MjchairError: an unknown parameter, or a value outside its bounds.
        """
        for name, value in values.items():
            if name not in {p.name for p in self.parameters}:
                raise MjchairError(
                    f"{self.name} has no parameter {name!r}"
                    + nearest(name, (p.name for p in self.parameters))
                )
            p = self.parameter(name)
            if not math.isfinite(value) or not p.low <= value <= p.high:
                raise MjchairError(
                    f"{self.name}: {name} is {value:g} {p.unit}; "
                    f"it must be within {p.low:g} to {p.high:g}"
                )
        self.edit(spec, **{**self.neutral(), **values})


def step(p: Parameter) -> float:
    """The typical change of a parameter from neutral, inside its bounds."""
    change = p.typical - p.neutral
    return change if p.low <= p.neutral + change <= p.high else -change


def clip(p: Parameter, value: float) -> float:
    """The value inside the parameter's bounds."""
    return min(max(value, p.low), p.high)
