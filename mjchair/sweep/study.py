"""The definition of a sweep: axes with their values, and the values that all cases share.

In: axes, fixed values and a duration, from Python or from a TOML file. Out: a checked `Study`, its
cases (every combination of the axes' values), and for each case the initial state, the designer's
parameters, the effects and the inputs.
"""

from __future__ import annotations

import itertools
import json
import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from msgspec import Struct

from mjchair.effects import library
from mjchair.errors import MjchairError, nearest
from mjchair.model.parameters import ChairParameters
from mjchair.model.spec import load_spec
from mjchair.simulation.initial import Initial
from mjchair.simulation.inputs import PUSH_PERIOD, Inputs, constant, push_strokes
from mjchair.sweep import fingerprint
from mjchair.tire import compiled
from mjchair.toml_file import read_toml
from mjchair.units import quantity

Value = float | int | str
Case = Mapping[str, Value]

# names that a case may have, in groups
LOADED = ("model", "scene", "tire", "grade", "step", "heights")  # options of load_spec
STARTED = ("speed", "yaw_rate")  # fields of Initial
DRIVEN = ("torque_left", "torque_right", "push_left", "push_right", "push_spread")  # the inputs
DESIGNED = tuple(item.name for item in fields(ChairParameters))
SEED = "seed"
KNOWN = (*LOADED, *DESIGNED, *STARTED, *DRIVEN, SEED)
TEXTS = ("model", "scene", "tire")  # names whose values are text
CHUNK = 32  # cases in a chunk


@dataclass(frozen=True)
class Study:
    """A sweep: the axes, what all cases share, and the duration of a run.

    A case is a mapping of names to values. The names are:

    - options of load_spec: `model`, `scene`, `tire`, `grade`, `step`, `heights`;
    - fields of ChairParameters (SI, or text with a unit such as "3 deg", kept in SI);
    - parameters of effects, such as "surface_patch.coefficient" (see mjchair.effects);
    - the initial state: `speed` (m/s), `yaw_rate` (rad/s);
    - the inputs: constant torques `torque_left`, `torque_right` (N m), or push strokes with the
      peak torques `push_left`, `push_right` (N m). `push_spread` is the relative standard deviation
      of the strokes' peaks (unit 1), which are random numbers of the case's seed;
    - `seed`.

    Attributes:
      axes: name -> values; every combination is a case, and the last axis changes fastest.
      fixed: name -> value that all cases share. duration: of a run, s.
      inputs: (case, duration) -> Inputs; replaces the inputs named above.
      measures: (Sensed) -> name -> number; replaces mjchair.sweep.measures.standard.
      chunk: how many cases are simulated together; an interruption loses at most the current chunk.

    Raises:
      MjchairError: an unknown name, a value of a wrong kind or out of its range, an axis without
        values, torques beside push strokes, or a duration that is not positive.
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
                raise MjchairError(f"{name} is both an axis and a fixed value; remove one of them")
            if isinstance(values, (str, bool, int, float)) or not len(values):
                raise MjchairError(f"axis {name} has no list of values; give [value, ...]")
        axes = {k: [_checked(k, value) for value in values] for k, values in self.axes.items()}
        object.__setattr__(self, "axes", axes)
        object.__setattr__(self, "fixed", {k: _checked(k, v) for k, v in self.fixed.items()})
        if self.inputs is None:
            driven = [name for name in self.axes if name in DRIVEN]
            for row in itertools.product(*(self.axes[name] for name in driven)):
                _driven({**self.fixed, **dict(zip(driven, row, strict=True))})

    def __len__(self) -> int:
        """Number of cases."""
        return math.prod(len(values) for values in self.axes.values())

    def cases(self) -> list[dict[str, Value]]:
        """All cases, in order."""
        combinations = itertools.product(*self.axes.values())
        return [{**self.fixed, **dict(zip(self.axes, row, strict=True))} for row in combinations]

    def drive(self, case: Case) -> Inputs:
        """The inputs that drive the chair in a case."""
        if self.inputs is not None:
            return self.inputs(case, self.duration)
        return drive(case, self.duration)

    def loaded(self) -> list[dict[str, Value]]:
        """The different sets of options of load_spec among the cases, in their order."""
        options = [{k: case[k] for k in LOADED if k in case} for case in self.cases()]
        return list({json.dumps(chosen, sort_keys=True): chosen for chosen in options}.values())

    def fingerprint(self) -> dict[str, str]:
        """Digests of everything on which the results depend: name of the part -> digest.

        Raises:
          MjchairError: a model, scene or tire that cannot be loaded.
        """
        values = {
            "axes": {name: list(values) for name, values in self.axes.items()},
            "fixed": dict(self.fixed),
            "duration": self.duration,
            "chunk": self.chunk,
        }
        models = {
            json.dumps(options, sort_keys=True): fingerprint.of_model(load_spec(**options))
            for options in map(dict[str, Any], self.loaded())
        }
        return {
            "axes, fixed values, duration or chunk": fingerprint.of_values(values),
            "models, scenes or tires": fingerprint.of_values(models),
            "the function for the inputs": fingerprint.of_function(self.inputs),
            "the function for the measures": fingerprint.of_function(self.measures),
            "mjchair": f"{compiled.fingerprint('')}, MuJoCo {mujoco.__version__}",
        }


def _checked(name: str, value: Value) -> Value:
    """A value in SI.

    Raises:
      MjchairError: it is of a wrong kind (text for a model, scene or tire, else a finite number),
        or out of the range of a chair parameter or of an effect.
    """
    if not _is_known(name) or name == "heights":  # load_spec checks heights
        return value
    if name in DESIGNED:
        return ChairParameters.of({name: value}).given()[name]
    _check_kind(name, value)
    effect, dot, parameter = name.partition(".")
    if dot:
        library.find(effect).check({parameter: float(value)})
    return value


def _check_kind(name: str, value: Value) -> None:
    """Refuse a value of a wrong kind: text for a model, scene or tire, else a finite number."""
    if name in TEXTS:
        if not isinstance(value, str):
            raise MjchairError(f"{name} is {value!r}; it must be a name or a path in quotes")
    elif isinstance(value, bool) or not isinstance(value, (int, float, np.number)):
        raise MjchairError(f"{name} is {value!r}; it must be a number{_example(value)}")
    elif not math.isfinite(value):
        raise MjchairError(f"{name} is {value!r}; it must be a finite number")


def _example(value: Any) -> str:
    """The end of an error line about a text such as "8%": the number that it stands for."""
    try:
        return f", such as {quantity(value, '1', 'value'):g}"
    except (MjchairError, AttributeError):
        return ""


def _is_known(name: str) -> bool:
    """Whether a name is one of KNOWN or the parameter of an effect."""
    return name in KNOWN or "." in name


def _check_name(name: str, free: bool) -> None:
    """Refuse an unknown name. free: any name may be used, because a function makes the inputs."""
    if name in KNOWN or free:
        return
    effect_name, dot, parameter = name.partition(".")
    if dot:
        effect = library.find(effect_name)
        if parameter not in {p.name for p in effect.parameters}:
            raise MjchairError(
                f"{effect_name} has no parameter {parameter!r}"
                + nearest(parameter, (p.name for p in effect.parameters))
            )
        return
    raise MjchairError(f"unknown axis {name!r}" + nearest(name, KNOWN))


def parameters(case: Case) -> ChairParameters | None:
    """The designer's parameters of a case; None where it has none."""
    chosen = {name: case[name] for name in DESIGNED if name in case}
    return ChairParameters.of(chosen) if chosen else None


def effects(case: Case) -> dict[str, dict[str, float]]:
    """The effects of a case: effect -> parameter -> value."""
    values: dict[str, dict[str, float]] = {}
    for name, value in case.items():
        effect, dot, parameter = name.partition(".")
        if dot:
            values.setdefault(effect, {})[parameter] = float(value)
    return values


def initial(case: Case) -> Initial:
    """The initial speed and yaw rate of a case."""
    return Initial(speed=float(case.get("speed", 0.0)), yaw_rate=float(case.get("yaw_rate", 0.0)))


def drive(case: Case, duration: float) -> Inputs:
    """The inputs of a case: constant torques or push strokes; zero torque where it names neither.

    Args:
      case: its values. duration: of the run, s.

    Raises:
      MjchairError: the case has both torques and push strokes.
    """
    torque, peak = _driven(case)
    spread = float(case.get("push_spread", 0.0))
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


def _driven(case: Case) -> tuple[dict[str, float], dict[str, float]]:
    """The constant torques and the peaks of the push strokes of a case, wheel -> N m.

    Raises:
      MjchairError: the case has both.
    """
    torque = {f"{s}_wheel": float(case.get(f"torque_{s}", 0.0)) for s in ("left", "right")}
    peak = {f"{s}_wheel": float(case.get(f"push_{s}", 0.0)) for s in ("left", "right")}
    if any(peak.values()) and any(torque.values()):
        raise MjchairError("a case has both torque_* and push_*; give only one of them")
    return torque, peak


class _StudyEntry(Struct, forbid_unknown_fields=True):
    """The entries that the file of a study may have; see `Study`."""

    axes: dict[str, Any]
    duration: float
    fixed: dict[str, Any] = {}
    chunk: int = CHUNK


def read_study(path: str | os.PathLike[str]) -> Study:
    """A study from TOML: `duration`, a table [axes] of lists, a table [fixed] of values.

    Raises:
      MjchairError: no such file, a file that is not TOML, an unknown entry, or as Study does.
    """
    entry = read_toml(Path(path), _StudyEntry)
    return Study(entry.axes, entry.duration, fixed=entry.fixed, chunk=entry.chunk)
