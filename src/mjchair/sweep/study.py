"""What a sweep runs: every combination of the values of its axes."""

from __future__ import annotations

import hashlib
import itertools
import json
import math
import os
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np

from mjchair.effects import library
from mjchair.errors import MjchairError, nearest
from mjchair.model.parameters import ChairParameters
from mjchair.simulation.initial import Initial
from mjchair.simulation.inputs import PUSH_PERIOD, Inputs, constant, push_strokes

Value = float | int | str
Case = Mapping[str, Value]

LOADED = ("model", "scene", "tire", "grade", "step")  # of load_spec
STARTED = ("speed", "yaw_rate")  # of Initial
DRIVEN = ("torque_left", "torque_right", "push_left", "push_right", "push_spread")
DESIGNED = tuple(item.name for item in fields(ChairParameters))
SEED = "seed"
CHUNK = 32  # cases of one task


@dataclass(frozen=True)
class Study:
    """A sweep: the axes, what all cases share, and for how long they run.

    A case is a mapping of names to values:

    - load_spec's `model`, `scene`, `tire`, `grade`, `step`;
    - fields of ChairParameters (SI units);
    - effects, as "surface_patch.coefficient" (see mjchair.effects);
    - the start: `speed` (m/s), `yaw_rate` (rad/s);
    - the drive: `torque_left`, `torque_right` (N m, constant), or `push_left`, `push_right`
      (peak of push strokes, N m) with `push_spread` (relative standard deviation of each
      stroke's peak, 1, drawn with the seed);
    - `seed`.

    Attributes:
      axes: name -> values; every combination is a case, the last axis changing fastest.
      fixed: name -> value of all cases. duration: s.
      inputs: (case, duration) -> Inputs in place of the drive above.
      measures: (Sensed) -> name -> number, in place of mjchair.sweep.measures.standard.
      chunk: cases simulated together; also what is lost when a worker dies.

    Raises:
      MjchairError: an unknown name, an axis without values, a duration that is not positive.
    """

    axes: Mapping[str, Sequence[Value]]
    duration: float
    fixed: Mapping[str, Value] = field(default_factory=dict)
    inputs: Callable[[Case, float], Inputs] | None = None
    measures: Callable[..., Mapping[str, float]] | None = None
    chunk: int = CHUNK

    def __post_init__(self) -> None:
        """Check names, values and duration."""
        if not (math.isfinite(self.duration) and self.duration > 0.0):
            raise MjchairError(f"duration is {self.duration:g} s; it must be positive")
        if self.chunk < 1:
            raise MjchairError(f"chunk is {self.chunk}; it must be at least 1")
        for name in (*self.axes, *self.fixed):
            _check_name(name, free=self.inputs is not None)
        for name, values in self.axes.items():
            if name in self.fixed:
                raise MjchairError(f"{name} is an axis and fixed; leave it out of one")
            if isinstance(values, str) or not len(values):
                raise MjchairError(f"axis {name} has no list of values; give [value, ...]")

    def __len__(self) -> int:
        """How many cases."""
        return math.prod(len(values) for values in self.axes.values())

    def cases(self) -> list[dict[str, Value]]:
        """Every case, in order."""
        combined = itertools.product(*self.axes.values())
        return [{**self.fixed, **dict(zip(self.axes, row, strict=True))} for row in combined]

    def drive(self, case: Case) -> Inputs:
        """What drives a case."""
        if self.inputs is not None:
            return self.inputs(case, self.duration)
        return drive(case, self.duration)

    def digest(self) -> str:
        """A fingerprint of everything that decides the results but the code."""
        told = {
            "axes": {name: list(values) for name, values in self.axes.items()},
            "fixed": dict(self.fixed),
            "duration": self.duration,
            "chunk": self.chunk,
            "inputs": _name(self.inputs),
            "measures": _name(self.measures),
        }
        text = json.dumps(told, sort_keys=True, default=float)
        return hashlib.sha256(text.encode()).hexdigest()


def _name(function: Callable[..., Any] | None) -> str:
    return "" if function is None else f"{function.__module__}.{function.__qualname__}"


def _check_name(name: str, free: bool) -> None:
    known = (*LOADED, *DESIGNED, *STARTED, *DRIVEN, SEED)
    if name in known or free:
        return
    effect, dot, parameter = name.partition(".")
    if dot:
        found = library.find(effect)
        if parameter not in {p.name for p in found.parameters}:
            raise MjchairError(
                f"{effect} has no parameter {parameter!r}"
                + nearest(parameter, (p.name for p in found.parameters))
            )
        return
    raise MjchairError(f"unknown axis {name!r}" + nearest(name, known))


def parameters(case: Case) -> ChairParameters | None:
    """The designer's changes of a case; None where there are none."""
    chosen = {name: float(case[name]) for name in DESIGNED if name in case}
    return ChairParameters.of(chosen) if chosen else None


def effects(case: Case) -> dict[str, dict[str, float]]:
    """The effects of a case: name -> parameter -> value."""
    found: dict[str, dict[str, float]] = {}
    for name, value in case.items():
        effect, dot, parameter = name.partition(".")
        if dot:
            found.setdefault(effect, {})[parameter] = float(value)
    return found


def initial(case: Case) -> Initial:
    """How a case starts."""
    return Initial(speed=float(case.get("speed", 0.0)), yaw_rate=float(case.get("yaw_rate", 0.0)))


def drive(case: Case, duration: float) -> Inputs:
    """Constant torques, or push strokes, as the case says; nothing where it says nothing.

    Raises:
      MjchairError: both at once, or a spread without strokes.
    """
    torque = {f"{s}_wheel": float(case.get(f"torque_{s}", 0.0)) for s in ("left", "right")}
    peak = {f"{s}_wheel": float(case.get(f"push_{s}", 0.0)) for s in ("left", "right")}
    spread = float(case.get("push_spread", 0.0))
    if any(peak.values()) and any(torque.values()):
        raise MjchairError("a case has torque_* and push_*; a chair is driven by one of them")
    if not any(peak.values()):
        return constant(torque, duration)
    pushes = push_strokes(peak, duration)
    if spread == 0.0:
        return pushes
    random = np.random.default_rng(int(case.get(SEED, 0)))
    stroke = (pushes.time / PUSH_PERIOD).astype(int)
    controls = {
        name: values * (1.0 + spread * random.standard_normal(stroke[-1] + 1))[stroke]
        for name, values in pushes.controls.items()
    }
    return Inputs(pushes.time, controls, "push strokes")


def read_study(path: str | os.PathLike[str]) -> Study:
    """A study from TOML: `duration`, a table [axes] of lists, a table [fixed] of values.

    Raises:
      MjchairError: no such file, no TOML, an unknown entry, or as Study does.
    """
    path = Path(path)
    try:
        told = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise MjchairError(f"cannot read {path}: {error.strerror}; give a TOML file") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise MjchairError(f"{path}: no TOML: {error}") from None
    known = ("duration", "axes", "fixed", "chunk")
    for name in told:
        if name not in known:
            raise MjchairError(f"{path}: unknown entry {name!r}" + nearest(name, known))
    if "duration" not in told or not isinstance(told.get("axes"), dict):
        raise MjchairError(f"{path}: a study has a duration (s) and a table [axes]")
    return Study(
        axes=told["axes"],
        duration=float(told["duration"]),
        fixed=told.get("fixed", {}),
        chunk=int(told.get("chunk", CHUNK)),
    )
