"""A study: measured runs, the chair they are to be explained by, and what is known beforehand."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from mjchair.diagnosis import ingest, plausible
from mjchair.errors import MjchairError, nearest
from mjchair.measurement import smartwheel
from mjchair.measurement.trial import Trial, read_trial
from mjchair.model.spec import load_spec
from mjchair.simulation.initial import Initial, as_initial

FILE = "study.toml"
KEYS = ("model", "scene", "grade", "noise", "nuisance", "trial", "kind")
TRIAL_KEYS = ("file", "manoeuvre", "hold_out", "initial", "smartwheel", "baseline")


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
    runs = _runs(table, path, spec.copy().compile())
    notes: list[str] = []
    noise = _positive(table, "noise", path)
    for channel in noise:
        if not any(channel in (c, c.rsplit(".", 1)[0]) for run in runs for c in run.trial.channels):
            notes.append(f"noise of {channel} is given, and no run measures it")
    nuisance = _positive(table, "nuisance", path)
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
    if all(run.hold_out for run in runs):
        raise MjchairError(f"{source}: every trial is held out; leave at least one to fit to")
    checked, said = [], list(notes or [])
    for run in runs:
        trial, noticed = _checked(run.trial)
        checked.append(replace(run, trial=trial))
        said += noticed
    said += _without_heading(checked)
    return Study(spec, tuple(checked), dict(noise or {}), dict(nuisance or {}), tuple(said), source)


def _without_heading(runs: list[Run]) -> list[str]:
    """A note on the runs of which nothing tells where in the world they head."""
    tells = ({"heading"}, {"position.x", "position.y"})
    blind = [
        run.trial.name
        for run in runs
        if "heading" not in run.given and not any(t <= set(run.trial.channels) for t in tells)
    ]
    if not blind:
        return []
    return [
        f"the heading of {', '.join(blind)} is neither measured nor given; each is taken to start "
        "at heading 0, and a slope or a wind is one along or across that"
    ]


def _checked(trial: Trial) -> tuple[Trial, list[str]]:
    """The trial as it is used, and what was noticed."""
    said = []
    for stage in (ingest.measured_part, ingest.without_dead, ingest.other_side):
        trial, noticed = stage(trial)
        said += noticed
    ingest.check(trial)
    plausible.check(trial)
    return trial, said


def _spec(table: Mapping[str, Any], path: Path) -> mujoco.MjSpec:
    model = _typed(table, "model", str, "manual", path)
    grade = _typed(table, "grade", float, None, path)
    near = path.parent / model
    return load_spec(
        near if near.is_file() else model, _typed(table, "scene", str, "flat", path), grade=grade
    )


def _runs(table: Mapping[str, Any], path: Path, model: mujoco.MjModel) -> list[Run]:
    runs: list[Run] = []
    for entry in _typed(table, "trial", list, [], path):
        _known(entry, TRIAL_KEYS, path)
        trial = _trial(entry, path, model)
        twin = next((r.trial.name for r in runs if _same(trial, r.trial)), None)
        if twin is not None:
            raise MjchairError(
                f"{path}: trial {trial.name} holds the samples of {twin} again; keep one"
            )
        given = dict(_typed(entry, "initial", dict, {}, path))
        plausible.check_initial(given, trial.name)
        runs.append(
            Run(
                trial,
                _typed(entry, "manoeuvre", str, "run", path),
                _typed(entry, "hold_out", bool, False, path),
                _initial(given, path),
                frozenset(given),
            )
        )
    return runs


def _trial(entry: Mapping[str, Any], path: Path, model: mujoco.MjModel) -> Trial:
    """The table of one [[trial]], or the recording of an instrumented wheel."""
    file = _typed(entry, "file", str, "", path)
    if not file:
        raise MjchairError(f"{path}: a [[trial]] has no file; name its table")
    side = _typed(entry, "smartwheel", str, None, path)
    baseline = _typed(entry, "baseline", str, None, path)
    if side is None:
        if baseline is not None:
            raise MjchairError(f'{path}: baseline goes with smartwheel = "left" or "right"')
        return read_trial(path.parent / file, model)
    if side not in ("left", "right"):
        raise MjchairError(f"{path}: smartwheel {side!r}" + nearest(side, ("left", "right")))
    run = smartwheel.read_smartwheel(path.parent / file)
    still = smartwheel.read_smartwheel(path.parent / baseline) if baseline else None
    return smartwheel.as_trial(smartwheel.without_baseline(run, still), side, Path(file).stem)


def _same(one: Trial, two: Trial) -> bool:
    return (
        np.array_equal(one.time, two.time)
        and set(one.channels) == set(two.channels)
        and all(np.array_equal(v, two.channels[n], equal_nan=True) for n, v in one.channels.items())
    )


def _initial(given: Mapping[str, Any], path: Path) -> Initial:
    for name, value in given.items():
        numbers = value if isinstance(value, list) else [value]
        if any(isinstance(v, bool) or not isinstance(v, int | float) for v in numbers):
            raise MjchairError(f"{path}: initial {name} is {value!r}; it must be a number")
    return as_initial(given)


KINDS = {str: "text", float: "a number", bool: "true or false", list: "[[trial]]", dict: "a table"}


def _typed(table: Mapping[str, Any], key: str, kind: type, default: Any, path: Path) -> Any:
    """The value of a key, if it is of its kind.

    Raises:
      MjchairError: it is not.
    """
    if key not in table:
        return default
    value = table[key]
    right = isinstance(value, kind) or (kind is float and isinstance(value, int))
    if not right or (isinstance(value, bool) and kind is not bool):
        raise MjchairError(f"{path}: {key} is {value!r}; it must be {KINDS[kind]}")
    return value


def _known(table: Mapping[str, Any], known: tuple[str, ...], path: Path) -> None:
    if not isinstance(table, Mapping):
        raise MjchairError(f"{path}: a trial is {table!r}; it must be a [[trial]] with a file")
    for key in table:
        if key not in known:
            raise MjchairError(f"{path}: unknown key {key!r}" + nearest(key, known))


def _positive(table: Mapping[str, Any], what: str, path: Path) -> dict[str, float]:
    out = {}
    for name, value in _typed(table, what, dict, {}, path).items():
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if not number or not np.isfinite(value) or value <= 0.0:
            raise MjchairError(f"{path}: {what} of {name} is {value!r}; it must be positive")
        out[name] = float(value)
    return out
