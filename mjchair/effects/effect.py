"""What an effect is: an edit of an MjSpec with parameters, and what is known about it.

In: the functions of one file of this folder. Out: the `Effect` that the file ends with.

An effect says all that the diagnosis has to know of it: whether it belongs to a sensor, to a place
or to a wave in time, which column of a table it follows, and when it can show at all. Nothing in
the diagnosis asks for an effect by name.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Any

import mujoco

from mjchair.errors import MjchairError, nearest
from mjchair.units import with_unit

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
      scale: size of a change worth finding, where `typical` is `neutral`.
      sized: False for a number that says where or when an effect acts, not how large it is.
      cautious: the most that one step of a fit may move it.
      each_run: whether it is new in every run, as a phase is.
      whole: sizes at which a chair does what no small change foretells: a tire slides, a wheel
        shimmies, a turn ends at once. Where small changes explain nothing, fits begin at these too.
    """

    name: str
    unit: str
    typical: float
    low: float
    high: float
    neutral: float = 0.0
    fitted: bool = True
    probe: float = 0.25
    scale: float = 0.1
    sized: bool = True
    cautious: float = math.inf
    each_run: bool = False
    whole: tuple[float, ...] = ()

    @property
    def change(self) -> float:
        """Size of a change worth finding."""
        return abs(self.typical - self.neutral) or self.scale


class SensorError(StrEnum):
    """What an effect does to a channel; also the name of its parameter."""

    BIAS = "bias"
    SCALE = "scale"
    DELAY = "delay"


@dataclass(frozen=True)
class Wave:
    """An effect that is a harmonic force forward, looked for at many frequencies.

    Attributes:
      frequencies: Hz, that are tried. free: the parameters that a fit moves.
      values: parameters of a force with these amplitudes of sine and cosine (N) at a frequency.
    """

    frequencies: tuple[float, ...]
    free: tuple[str, ...]
    values: Callable[[float, float, float], Values]


@dataclass(frozen=True)
class Place:
    """An effect that brakes within a place on the floor, looked for all along the ways.

    Attributes:
      radius: m, of a place that is looked for, and the distance between such places.
      share: of the chair's weight that it brakes with, at coefficient 1.
      free: the parameters that a fit moves. values: parameters of a place at x, y (m) with a
        coefficient.
    """

    radius: float
    share: float
    free: tuple[str, ...]
    values: Callable[[float, float, float], Values]


@dataclass(frozen=True)
class Seed:
    """Where a fit of an effect begins: points whose responses are combined linearly.

    Attributes:
      points: parameter values, one mapping a column. factors: what each response is multiplied
        by; None: 1.
      combine: coefficients of the columns (1: the point itself) to parameter values.
      least: coefficients below this are of no such effect.
    """

    points: tuple[Values, ...]
    combine: Callable[[Any], Values]
    factors: tuple[float, ...] | None = None
    least: float = -math.inf


@dataclass(frozen=True)
class Effect:
    """A named physical effect.

    Attributes:
      name: as in diagnosis.json. parameters: in order.
      signature: one line, what it looks like. source: where form and sizes come from.
      edit: ``edit(spec, **values)`` changes the specification in place.
      channel: for effects of a sensor, the scalar channel; None for the others.
      sensor: what it does to that channel.
      seeds: starts of a fit where one typical step a parameter will not do; None: those steps.
      wave, place: for effects that are looked for in time or along the way.
      measured: the effect follows the column of this name, and is there only with it; then it
        stands in for the others of its name. beside: it does not, and is tried beside them.
      driven: it shows only where something drives the chair.
      drive: True: of a power chair's drive (joystick, motors, battery), and only on a chair that
        has one; False: of torques that are given at the wheels, and on no such chair; None: any.
      commanded: True: it shows only where torques are commands; False: only where they were
        measured at push rims; None: wherever they come from.
      everywhere: every chair has a little of it, and present runs may not show it.
      common: how often it is what is missing, over most other effects (assumption).
      outdoors: it is there outdoors only. turning: it shows only where a chair turns.
      example: values to practise with; None: typical ones.
      most, least: parameter -> upper and lower bound that follow from the chair in hand; None:
        those of the parameters hold on any.
      shared: what is only roughly known of any chair, and the parameters that move the same where
        all of them move as far: of the sum, the data say nothing.
      instead: what is only roughly known of any chair and would be wrong too, were it there.
      covers: what is only roughly known of any study, and changes the same: it is not fitted beside
        the effect.
      recording: whether it is no fault of the chair, but of how its runs were recorded.
      remark: what values and their standard errors say in one sentence, for a verdict that names
        the effect; None: their names and units say it.
      by_hand: how a person measures it without a run, as an order; empty: only runs show it.
    """

    name: str
    parameters: tuple[Parameter, ...]
    signature: str
    source: str
    edit: Edit
    channel: str | None = None
    sensor: SensorError | None = None
    seeds: tuple[Seed, ...] | None = None
    wave: Wave | None = None
    place: Place | None = None
    measured: str | None = None
    beside: bool = False
    driven: bool = False
    drive: bool | None = None
    commanded: bool | None = None
    everywhere: bool = False
    common: float = 1.0
    outdoors: bool = False
    turning: bool = False
    example: Values | None = None
    most: Callable[[mujoco.MjSpec], Values] | None = None
    least: Callable[[mujoco.MjSpec], Values] | None = None
    shared: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    instead: tuple[str, ...] = ()
    covers: tuple[str, ...] = ()
    recording: bool = False
    remark: Callable[[Mapping[str, float], Mapping[str, float]], str] | None = None
    by_hand: str = ""

    @property
    def key(self) -> str:
        """Name, with the channel where there is one."""
        return f"{self.name}:{self.channel}" if self.channel else self.name

    @property
    def doubts(self) -> tuple[str, ...]:
        """What is only roughly known of any chair and its sensors, that this effect says is wrong.

        Whoever measured one of these doubts the effect.
        """
        error = self.sensor in (SensorError.BIAS, SensorError.SCALE)
        own = (f"{self.sensor}:{self.channel}",) if error else ()
        return (*self.shared, *self.instead, *own)

    @property
    def fitted(self) -> tuple[Parameter, ...]:
        """Parameters that a fit may move."""
        return tuple(p for p in self.parameters if p.fitted)

    @property
    def sizes(self) -> tuple[Parameter, ...]:
        """Those of them that say how large it is."""
        return tuple(p for p in self.fitted if p.sized)

    def parameter(self, name: str) -> Parameter:
        """The parameter of that name."""
        return next(p for p in self.parameters if p.name == name)

    def shows(self, columns: Collection[str], driven: bool) -> bool:
        """Whether data with these table columns, driven or not, could show it."""
        return (driven or not self.driven) and (self.measured is None or self.measured in columns)

    def neutral(self) -> Values:
        """Values at which the effect is not there; numbers that are not fitted at their own."""
        return {p.name: p.neutral if p.fitted else p.typical for p in self.parameters}

    def starts(self) -> tuple[Seed, ...]:
        """The seeds, or one typical step of each size."""
        if self.seeds is not None:
            return self.seeds
        neutral = self.neutral()
        points = tuple({**neutral, p.name: p.neutral + p.probe * step(p)} for p in self.sizes)

        def combine(coefficients: Any) -> Values:
            values = dict(neutral)
            for p, c in zip(self.sizes, coefficients, strict=True):
                values[p.name] = clip(p, p.neutral + float(c) * step(p))
            return values

        return (Seed(points, combine, tuple(1.0 / p.probe for p in self.sizes)),)

    def on(self, spec: mujoco.MjSpec) -> Effect:
        """This effect with the bounds that follow from the chair in hand."""
        highs = {} if self.most is None else self.most(spec)
        lows = {} if self.least is None else self.least(spec)
        bounded = tuple(
            replace(p, low=lows.get(p.name, p.low), high=highs.get(p.name, p.high))
            for p in self.parameters
        )
        return replace(self, parameters=bounded)

    def check(self, values: Mapping[str, float]) -> None:
        """Refuse values that `apply` does not take.

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
                    f"{self.name}: {name} is {with_unit(value, p.unit)}; "
                    f"it must be within {p.low:g} to {p.high:g}"
                )

    def apply(self, spec: mujoco.MjSpec, values: Mapping[str, float]) -> None:
        """Edit the specification in place.

        Raises:
          MjchairError: as `check` does, or the specification lacks what the effect is about.
        """
        self.check(values)
        self.edit(spec, **{**self.neutral(), **values})


def step(p: Parameter) -> float:
    """The typical change of a parameter from neutral, inside its bounds."""
    change = p.typical - p.neutral
    return change if p.low <= p.neutral + change <= p.high else -change


def clip(p: Parameter, value: float) -> float:
    """The value inside the parameter's bounds."""
    return min(max(value, p.low), p.high)
