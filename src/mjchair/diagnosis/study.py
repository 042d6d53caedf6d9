"""A study: measured runs, the chair they are to be explained by, and what is known beforehand."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from mjchair.diagnosis import plausible
from mjchair.errors import MjchairError, nearest
from mjchair.measurement.trial import Trial, read_trial
from mjchair.model.spec import load_spec
from mjchair.simulation.initial import Initial, as_initial

FILE = "study.toml"
KEYS = ("model", "scene", "grade", "noise", "nuisance", "trial", "kind")
TRIAL_KEYS = ("file", "manoeuvre", "hold_out", "initial")
SHORTEST = 1.0  # s, of a trial: less holds no window


@dataclass(frozen=True)
class Run:
    """One measured run of a study.

    Attributes:
      trial: the samples, SI. manoeuvre: word that groups runs.
      hold_out: kept for the final check. initial: what is known of the first sample; fields that
        were not given are estimated. given: names of the fields that were given.
    """

    trial: Trial
    manoeuvre: str
    hold_out: bool
    initial: Initial
    given: frozenset[str]

    @property
    def duration(self) -> float:
        """From the first to the last sample, s."""
        return float(self.trial.time[-1] - self.trial.time[0])


@dataclass(frozen=True)
class Study:
    """Measured runs and the specification that is to explain them.

    Attributes:
      spec: the chair in its scene. runs: in order.
      noise: channel -> standard deviation (SI), where it is known.
      nuisance: name -> standard deviation, where it differs from the defaults.
      notes: what was noticed while reading, one line each.
      source: the folder.
    """

    spec: mujoco.MjSpec
    runs: tuple[Run, ...]
    noise: Mapping[str, float]
    nuisance: Mapping[str, float]
    notes: tuple[str, ...] = ()
    source: str = "study"

    @property
    def channels(self) -> tuple[str, ...]:
        """Scalar channels that some run measured, in a fixed order."""
        found = {c for run in self.runs for c in run.trial.channels}
        return tuple(sorted(found))

    @property
    def fitted(self) -> tuple[int, ...]:
        """Indices of the runs that are not held out."""
        return tuple(i for i, run in enumerate(self.runs) if not run.hold_out)


def read_study(folder: str | os.PathLike[str]) -> Study:
    """Read a study folder.

    Raises:
      MjchairError: no study.toml, a key or table that is not known or not there, no trial, a trial
        too short, every trial held out, or as the readers of models and tables do.
    """
    path = Path(folder)
    path = path / FILE if path.is_dir() else path
    if not path.is_file():
        raise MjchairError(f"no study {path}; a study is a folder with a {FILE}")
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise MjchairError(f"{path}: {error}") from None
    _known(table, KEYS, path)
    if table.get("kind") == "rig":
        raise MjchairError(f"{path} is a rig study; fit its tire with `mjchair fit-tire`")
    spec = _spec(table, path)
    runs, notes = _runs(table, path, spec.copy().compile())
    noise = _positive(table.get("noise", {}), "noise", path)
    for channel in noise:
        if not any(channel in run.trial.channels for run in runs):
            notes.append(f"noise of {channel} is given, and no run measures it")
    nuisance = _positive(table.get("nuisance", {}), "nuisance", path)
    return make_study(spec, runs, noise, nuisance, notes, str(path.parent))


def make_study(
    spec: mujoco.MjSpec,
    runs: list[Run],
    noise: Mapping[str, float] | None = None,
    nuisance: Mapping[str, float] | None = None,
    notes: list[str] | None = None,
    source: str = "study",
) -> Study:
    """A study of runs in memory, checked.

    Raises:
      MjchairError: no run, every run held out, a run too short.
    """
    if not runs:
        raise MjchairError(f"{source}: no trial; a study needs at least one [[trial]]")
    for run in runs:
        if run.duration < SHORTEST:
            raise MjchairError(
                f"{source}: trial {run.trial.name} lasts {run.duration:.2g} s; "
                f"it must last at least {SHORTEST:g} s, which is one window"
            )
    if all(run.hold_out for run in runs):
        raise MjchairError(f"{source}: every trial is held out; leave at least one to fit to")
    said = list(notes or [])
    for run in runs:
        said += plausible.check(run.trial)
    return Study(spec, tuple(runs), dict(noise or {}), dict(nuisance or {}), tuple(said), source)


def _spec(table: Mapping[str, Any], path: Path) -> mujoco.MjSpec:
    model = str(table.get("model", "manual"))
    near = path.parent / model
    grade = float(table["grade"]) if "grade" in table else None
    found = near if near.is_file() else model
    return load_spec(found, table.get("scene", "flat"), grade=grade)


def _runs(
    table: Mapping[str, Any], path: Path, model: mujoco.MjModel
) -> tuple[list[Run], list[str]]:
    runs: list[Run] = []
    notes: list[str] = []
    for entry in table.get("trial", []):
        _known(entry, TRIAL_KEYS, path)
        if "file" not in entry:
            raise MjchairError(f"{path}: a [[trial]] has no file; name its table")
        trial = read_trial(path.parent / str(entry["file"]), model)
        trial, said = plausible.without_dead(trial)
        notes += said
        given = dict(entry.get("initial", {}))
        runs.append(
            Run(
                trial,
                str(entry.get("manoeuvre", "run")),
                bool(entry.get("hold_out", False)),
                as_initial(given),
                frozenset(given),
            )
        )
    return runs, notes


def _known(table: Mapping[str, Any], known: tuple[str, ...], path: Path) -> None:
    for key in table:
        if key not in known:
            raise MjchairError(f"{path}: unknown key {key!r}" + nearest(key, known))


def _positive(table: Mapping[str, Any], what: str, path: Path) -> dict[str, float]:
    out = {}
    for name, value in table.items():
        if not isinstance(value, int | float) or not np.isfinite(value) or value <= 0.0:
            raise MjchairError(f"{path}: {what} of {name} is {value!r}; it must be positive")
        out[name] = float(value)
    return out
