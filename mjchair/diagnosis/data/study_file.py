"""study.toml: what may stand in it, and how a study is read from its folder.

In: a folder with a study.toml and tables. Out: a `Study`. What is wrong is one line.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal

import mujoco
import numpy as np
from msgspec import Meta, Struct, structs

from mjchair.diagnosis.data import saturation, unit_checks
from mjchair.diagnosis.data.roughly_known import nuisances
from mjchair.diagnosis.data.study import Run, Study, make_study, with_copied_wheels
from mjchair.errors import MjchairError, nearest
from mjchair.measurement import baseline as baselines
from mjchair.measurement import smartwheel
from mjchair.measurement.trial import Trial, read_trial
from mjchair.model.load import Load
from mjchair.model.parameters import ChairParameters
from mjchair.model.spec import load_spec
from mjchair.rider.rider import RIDERS
from mjchair.simulation.channels import channel_units
from mjchair.simulation.initial import Initial
from mjchair.toml_file import read_toml
from mjchair.units import quantity

FILE = "study.toml"
BETWEEN = ("straight", "hold")  # of two samples of an input
SIDES = ("left", "right")
HEAVIEST = 250.0  # kg, of a load
INITIAL_UNITS = {"heading": "rad", "speed": "m/s", "yaw_rate": "rad/s"}
Positive = Annotated[float, Meta(gt=0)]


class InitialEntry(Struct, forbid_unknown_fields=True):
    """[trial.initial]: what is known of the first sample, as in `Initial`."""

    position: tuple[float, float] | None = None
    heading: float | str | None = None
    speed: float | str | None = None
    yaw_rate: float | str | None = None

    def given(self, trial: str) -> dict[str, Any]:
        """The fields that were given, in SI.

        Raises:
          MjchairError: a text that is no number with a unit, such as "180 deg".
        """
        told = {f: v for f in self.__struct_fields__ if (v := getattr(self, f)) is not None}
        return {
            f: quantity(v, INITIAL_UNITS[f], f"{trial}: the initial {f.replace('_', ' ')}")
            if isinstance(v, str)
            else v
            for f, v in told.items()
        }


class LoadEntry(Struct, forbid_unknown_fields=True):
    """[trial.load]: what was strapped to the chair for this run, as in `Load`."""

    mass: Annotated[float, Meta(gt=0, le=HEAVIEST)]
    height: Annotated[float, Meta(ge=0, le=2)]
    forward: Annotated[float, Meta(ge=-1, le=1)] = 0.0


class TrialEntry(Struct, forbid_unknown_fields=True):
    """One [[trial]]: its table or tables, its manoeuvre, and what is known of its start."""

    file: str | list[str] = ""
    manoeuvre: str = "run"
    hold_out: bool = False
    initial: InitialEntry | None = None
    smartwheel: str | None = None
    baseline: str | None = None
    inputs: str | None = None
    load: LoadEntry | None = None
    torque: Literal["estimated"] | None = None


class ProcessEntry(Struct, forbid_unknown_fields=True):
    """[noise.process]: standard deviation of what shakes the chair, N (yaw: N m).

    Of `person`, a share of a moving person's force.
    """

    drive: Positive | None = None
    side: Positive | None = None
    yaw: Positive | None = None
    person: Positive | None = None
    wheel_turn: Positive | None = None
    caster_turn: Positive | None = None

    def given(self) -> dict[str, float]:
        """The fields that were given."""
        return {f: v for f in self.__struct_fields__ if (v := getattr(self, f)) is not None}


class MaterialEntry(Struct, forbid_unknown_fields=True):
    """[material]: the force (N) below which nothing matters."""

    force: Positive


class StudyEntry(Struct, forbid_unknown_fields=True):
    """All of study.toml."""

    model: str = "manual"
    rider: str = RIDERS[0]
    drive: str | None = None
    scene: str = "flat"
    grade: float | str | None = None
    step: float | None = None
    heights: str | None = None
    tire: str | dict[str, str] | None = None
    chair: dict[str, Any] = {}
    inputs: str = BETWEEN[0]
    torque: Literal["commanded", "measured"] | None = None
    noise: dict[str, Positive | ProcessEntry] = {}
    indoors: bool = False
    material: MaterialEntry | None = None
    nuisance: dict[str, Positive] = {}
    trial: list[TrialEntry] = []
    kind: Literal["runs", "rig"] = "runs"


def read_study(folder: str | os.PathLike[str]) -> Study:
    """Read a study folder.

    Raises:
      MjchairError: no study.toml, a key, nuisance or table that is not known or not there, no
        trial, a trial too short, every trial held out, or as the readers of models and tables do.
    """
    path = Path(folder)
    path = path / FILE if path.is_dir() else path
    if not path.is_file() or path.suffix != Path(FILE).suffix:
        raise MjchairError(f"no study {path}; a study is a folder with a {FILE}")
    entry = read_toml(path, StudyEntry)
    if entry.kind == "rig":
        raise MjchairError(f"{path} is a rig study; fit its tire with `mjchair fit-tire`")
    noise, process = _noise(entry, path)
    for name, values in (("noise", noise), ("process", process), ("nuisance", entry.nuisance)):
        _check_finite(values, name, path)
    _check_choice("rider is", entry.rider, RIDERS, path)
    spec = _spec(entry, path)
    model = spec.copy().compile()
    runs, renamed = _runs(entry, path, model)
    notes = _unmeasured(noise, runs, model, path) + renamed
    study = make_study(spec, runs, noise, entry.nuisance, notes, str(path.parent))
    known = replace(
        study,
        process=process,
        indoors=entry.indoors,
        torque_measured=_measured(entry),
        material=entry.material.force if entry.material is not None else None,
    )
    channels = with_copied_wheels(known).channels
    nuisances(channels, known.nuisance, known.driven_as_measured)  # an unknown one is refused
    return replace(known, notes=(*known.notes, *saturation.notes(known)))


def _measured(entry: StudyEntry) -> bool:
    """Whether the torques were measured at push rims: as told, or with a SmartWheel."""
    if entry.torque is not None:
        return entry.torque == "measured"
    return bool(entry.trial) and all(trial.smartwheel is not None for trial in entry.trial)


def _noise(entry: StudyEntry, path: Path) -> tuple[dict[str, float], dict[str, float]]:
    """Noise of the channels, and of what shakes the chair.

    Raises:
      MjchairError: a table that is not [noise.process], or a number in its place.
    """
    channels, process = {}, ProcessEntry()
    for name, value in entry.noise.items():
        if isinstance(value, ProcessEntry) != (name == "process"):
            rule = "[noise.process] is a table (drive, side, yaw, ...); a channel has one number"
            raise MjchairError(f"{path}: noise of {name} cannot be read: {rule}")
        if isinstance(value, ProcessEntry):
            process = value
        else:
            channels[name] = value
    return channels, process.given()


def _unmeasured(
    noise: Mapping[str, float], runs: Sequence[Run], model: mujoco.MjModel, path: Path
) -> list[str]:
    """A note on each noise that is given of a channel which no run measures.

    Raises:
      MjchairError: the noise of what is no channel.
    """
    measured = _with_sensors({c for run in runs for c in run.trial.channels})
    known = measured | _with_sensors(channel_units(model))
    for channel in noise:
        if channel not in known:
            raise MjchairError(
                f"{path}: [noise] has {channel!r}, which is no channel" + nearest(channel, known)
            )
    return [
        f"noise of {channel} is given, and no run measures it"
        for channel in noise
        if channel not in measured
    ]


def _with_sensors(channels: Iterable[str]) -> set[str]:
    """Channels, and the sensors with several of them: imu_gyro beside imu_gyro.z."""
    return {name for c in channels for name in (c, c.rsplit(".", 1)[0])}


def _check_finite(values: dict[str, float], what: str, path: Path) -> None:
    for name, value in values.items():
        if not np.isfinite(value):
            raise MjchairError(f"{path}: {what} of {name} is {value!r}; it must be finite")


def _near(path: Path, name: str) -> str:
    """The file of that name beside the study, or the name, of something that ships."""
    near = path.parent / name
    return str(near) if near.is_file() else name


def _spec(entry: StudyEntry, path: Path) -> mujoco.MjSpec:
    tire: str | dict[str, str] | None = None
    if isinstance(entry.tire, str):
        tire = _near(path, entry.tire)
    elif entry.tire is not None:
        tire = {group: _near(path, name) for group, name in entry.tire.items()}
    try:
        parameters = ChairParameters.of(entry.chair)
    except MjchairError as error:
        raise MjchairError(f"{path}: [chair]: {error}") from None
    return load_spec(
        _near(path, entry.model),
        _near(path, entry.scene),
        tire,
        grade=entry.grade,
        step=entry.step,
        heights=None if entry.heights is None else _near(path, entry.heights),
        parameters=parameters,
        rider=entry.rider,
        drive=None if entry.drive is None else _near(path, entry.drive),
    )


def _runs(entry: StudyEntry, path: Path, model: mujoco.MjModel) -> tuple[list[Run], list[str]]:
    """The runs, and a note on each that got a number after its name."""
    runs, renamed = list[Run](), list[str]()
    for told in entry.trial:
        trial = _trial(told, entry, path, model)
        twin = next((r.trial.name for r in runs if _same(trial, r.trial)), None)
        if twin is not None:
            raise MjchairError(
                f"{path}: trial {trial.name} holds the samples of {twin} again; keep one"
            )
        own = _own_name(trial.name, [run.trial.name for run in runs])
        if own != trial.name:
            renamed.append(f"trial {len(runs) + 1} is called {own}, since another is {trial.name}")
        trial = replace(trial, name=own)
        given = told.initial.given(trial.name) if told.initial is not None else {}
        unit_checks.check_initial(given, trial.name)
        load = None if told.load is None else Load(**structs.asdict(told.load))
        run = Run(trial, told.manoeuvre, told.hold_out, Initial(**given), frozenset(given), load)
        runs.append(replace(run, torque_estimated=told.torque is not None))
    return runs, renamed


def _trial(told: TrialEntry, entry: StudyEntry, path: Path, model: mujoco.MjModel) -> Trial:
    """The table or tables of one [[trial]], or the recording of an instrumented wheel."""
    if not told.file:
        raise MjchairError(f"{path}: a [[trial]] has no file; name its table")
    names = [told.file] if isinstance(told.file, str) else told.file
    files = [path.parent / name for name in names]
    if told.smartwheel is None:
        if told.baseline is not None:
            raise MjchairError(f'{path}: baseline goes with smartwheel = "left" or "right"')
        between = entry.inputs if told.inputs is None else told.inputs
        _check_choice("inputs is", between, BETWEEN, path)
        return read_trial(files, model, between == BETWEEN[1])
    _check_choice("smartwheel", told.smartwheel, SIDES, path)
    if len(files) > 1:
        raise MjchairError(
            f"{path}: smartwheel goes with one file, and {names[0]} is not alone; "
            "`mjchair gather` puts a SmartWheel and other instruments on one clock"
        )
    run = smartwheel.read_smartwheel(files[0])
    still = smartwheel.read_smartwheel(path.parent / told.baseline) if told.baseline else None
    clean = smartwheel.oriented(baselines.without_baseline(run, still))
    return smartwheel.as_trial(clean, told.smartwheel, files[0].stem)


def _check_choice(what: str, value: str, known: tuple[str, ...], path: Path) -> None:
    if value not in known:
        raise MjchairError(f"{path}: {what} {value!r}" + nearest(value, known))


def _own_name(name: str, others: Sequence[str]) -> str:
    """A name, with a number after it where another run has it: one folder a day is usual."""
    own, number = name, 1
    while own in others:
        number += 1
        own = f"{name}_{number}"
    return own


def _same(one: Trial, two: Trial) -> bool:
    return (
        np.array_equal(one.time, two.time)
        and set(one.channels) == set(two.channels)
        and all(np.array_equal(v, two.channels[n], equal_nan=True) for n, v in one.channels.items())
    )
