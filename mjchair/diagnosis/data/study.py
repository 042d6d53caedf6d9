"""A study: measured runs, the chair they are to be explained by, and what is known beforehand.

In: runs in memory (study_file.py reads them from a folder) and a chair. Out: a `Study`, checked;
what cannot be right is refused in one line.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import mujoco

from mjchair.diagnosis.data import (
    mass_checks,
    motion_checks,
    one_torque,
    sign_checks,
    standstill,
    trial_checks,
    unit_checks,
)
from mjchair.diagnosis.data.trial_checks import driven_sides, tells_turning
from mjchair.errors import MjchairError
from mjchair.measurement.lost_samples import without_lost
from mjchair.measurement.trial import Trial, check_columns
from mjchair.model.load import Load
from mjchair.model.rolling import RearAxle, chair_body, rear_axle
from mjchair.model.wheels import WHEELS
from mjchair.simulation.initial import Initial

PLACE = {"position.x", "position.y"}  # channels that tell where a run is


@dataclass(frozen=True)
class Run:
    """One measured run of a study.

    Attributes:
      trial: the samples, SI. manoeuvre: word that groups runs.
      hold_out: kept for the final check. initial: what is known of the first sample; fields that
        were not given are estimated. given: names of the fields that were given.
      load: that was strapped to the chair for this run; None: none.
      torque_estimated: whether its torques were made from its motion. torque_assumed: whether the
        torque of one wheel was measured, and by a measured turn stands for both.
    """

    trial: Trial
    manoeuvre: str
    hold_out: bool
    initial: Initial
    given: frozenset[str]
    load: Load | None = None
    torque_estimated: bool = False
    torque_assumed: bool = False

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
      process: name (as in study.toml) -> standard deviation of what shakes the chair, where it is
        known: drive, side, wheel_turn, caster_turn (N), yaw (N m); person: share of a moving
        person's force that is in no model.
      indoors: whether no wind blows. material: force (N) below which nothing matters to the person
        who asks; None: not told.
      torque_measured: whether the torques were measured at push rims; False: they are commands.
      copied: channels of a wheel that was not measured, taken to be like the other's.
      nuisance: name -> standard deviation, where it differs from the defaults.
      axle: the rear wheels of the chair.
      notes: what was noticed while reading, one line each.
      source: the folder.
    """

    spec: mujoco.MjSpec
    runs: tuple[Run, ...]
    noise: Mapping[str, float]
    nuisance: Mapping[str, float]
    axle: RearAxle
    notes: tuple[str, ...] = ()
    source: str = "study"
    process: Mapping[str, float] = field(default_factory=dict)
    indoors: bool = False
    material: float | None = None
    torque_measured: bool = False
    copied: frozenset[str] = frozenset()

    @property
    def channels(self) -> tuple[str, ...]:
        """Scalar channels that some run measured, in a fixed order."""
        measured = {c for run in self.runs for c in run.trial.channels}
        return tuple(sorted(measured))

    def noise_given(self, channel: str) -> float | None:
        """Noise (SI) that is known of a channel, or of the sensor that it belongs to."""
        return self.noise.get(channel, self.noise.get(channel.rsplit(".", 1)[0]))

    @property
    def driven_as_measured(self) -> bool:
        """Whether the torques of rear wheels were measured, and drive a run."""
        driven = [run.trial.inputs.controls for run in self.runs if run.trial.inputs is not None]
        return self.torque_measured and any(set(WHEELS[:2]) & set(names) for names in driven)

    @property
    def unplaced(self) -> tuple[str, ...]:
        """Runs of which nothing tells where they start beside the others; a lone run needs none."""
        if len(self.runs) == 1:
            return ()
        return tuple(
            run.trial.name
            for run in self.runs
            if "position" not in run.given and not set(run.trial.channels) >= PLACE
        )

    @property
    def straight(self) -> bool:
        """Whether one wheel stands for both in every run, so that none is taken to turn."""
        return all(trial_checks.with_copied_wheel(r.trial) is not r.trial for r in self.runs)

    @property
    def fitted(self) -> tuple[int, ...]:
        """Indices of the runs that are not held out."""
        return tuple(i for i, run in enumerate(self.runs) if not run.hold_out)


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
      MjchairError: no run, every run held out, a run too short, or a column that the chair has no
        sensor or actuator for.
    """
    if not runs:
        raise MjchairError(f"{source}: no trial; a study needs at least one [[trial]]")
    if all(run.hold_out for run in runs):
        raise MjchairError(f"{source}: every trial is held out; leave at least one to fit to")
    model = spec.copy().compile()
    axle, mass = rear_axle(model), float(model.body_subtreemass[chair_body(model)])
    checked, said = [], list(notes or [])
    for run in runs:
        check_columns(run.trial, model)
        trial, noticed = _checked(run.trial, axle, mass)
        if "speed" in run.given:
            unit_checks.check_first_speed(trial, axle, run.initial.speed)
        more = len(driven_sides(trial)) > len(driven_sides(run.trial))
        assumed = more and tells_turning(trial.channels)
        checked.append(replace(run, trial=trial, torque_assumed=assumed))
        said += noticed
    said += _weighed(checked, axle, mass)
    said += _without_heading(checked) + _coming_to_rest(checked)
    return Study(
        spec=spec,
        runs=tuple(checked),
        noise=dict(noise or {}),
        nuisance=dict(nuisance or {}),
        axle=axle,
        notes=tuple(said),
        source=source,
    )


def without_estimated_torques(study: Study) -> Study:
    """The study without the runs whose torques were made from their motion, and a note on them.

    Such a torque explains its run whatever the chair lacks, and with a rolling resistance that was
    assumed: its run speaks for effects that are not there.

    Raises:
      MjchairError: no run is left to fit to.
    """
    return without_runs(
        study,
        [run for run in study.runs if run.torque_estimated],
        'torque = "estimated": the motion of {} made its torque, and cannot contradict it',
        ": add a coast, or a run with its torque measured",
    )


def without_runs(study: Study, out: Sequence[Run], why: str, advice: str = "") -> Study:
    """The study without some of its runs, and a note on them.

    Args:
      why: they are left out, a sentence with {} for their names. advice: where none is left.

    Raises:
      MjchairError: no run is left to fit to.
    """
    if not out:
        return study
    left = tuple(run for run in study.runs if not any(run is o for o in out))
    said = why.format(", ".join(run.trial.name for run in out))
    if all(run.hold_out for run in left):
        raise MjchairError(f"{study.source}: {said}; no other trial is left to fit to{advice}")
    return replace(study, runs=left, notes=(*study.notes, f"{said}; left out"))


def other_wheel(channel: str) -> str:
    """The same channel of the other side; of what has no side, a name that no channel has."""
    left, right = "left", "right"
    if channel.startswith(left):
        return right + channel.removeprefix(left)
    return left + channel.removeprefix(right)


def with_copied_wheels(study: Study) -> Study:
    """The study with one measured wheel standing for both in runs that tell nothing of a turn."""
    runs = [replace(run, trial=trial_checks.with_copied_wheel(run.trial)) for run in study.runs]
    copied = {
        c
        for run, before in zip(runs, study.runs, strict=True)
        for c in set(run.trial.channels) - set(before.trial.channels)
    }
    return replace(study, runs=tuple(runs), copied=frozenset(copied))


def _weighed(runs: list[Run], axle: RearAxle, mass: float) -> list[str]:
    """A note where torques and speeds tell another mass than the chair's, kg, with its loads."""
    loaded = ((run.trial, mass + (run.load.mass if run.load else 0.0)) for run in runs)
    return mass_checks.check(loaded, axle)


def _without_heading(runs: list[Run]) -> list[str]:
    """A note on the runs of which nothing tells where in the world they head."""
    tells = ({"heading"}, PLACE)
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


def _coming_to_rest(runs: list[Run]) -> list[str]:
    """Notes on what is left out where runs come to rest, or dither before they roll."""
    stops, starts = [], []
    for run in runs:
        for first, onward in standstill.rests(run.trial):
            if first == run.trial.time[0]:
                starts.append(f"{run.trial.name} until {onward:.1f} s")
            else:
                stops.append(f"{run.trial.name} at {(first + standstill.BEFORE):.1f} s")
    notes = []
    if stops:
        notes.append(
            f"comes to rest: {', '.join(stops)}; how a chair rocks on its tires then is not known, "
            f"and {standstill.ROCKS:g} s are left out from there, or what there is until it moves "
            "again"
        )
    if starts:
        notes.append(
            f"moves to and fro at rest: {', '.join(starts)}; how a chair rocks on its tires then "
            "is not known, and the time until it rolls on is left out"
        )
    return notes


def _checked(trial: Trial, axle: RearAxle, mass: float) -> tuple[Trial, list[str]]:
    """The trial as it is used, and what was noticed."""
    trial_checks.check_length(trial)  # before what needs several samples; of what is left below
    trial, said = without_lost(trial, axle)
    stages = (
        trial_checks.measured_part,
        trial_checks.without_dead,
        trial_checks.with_angles_counted_on,
        trial_checks.other_side,
        motion_checks.jumps,
    )
    for stage in stages:
        trial, noticed = stage(trial)
        said += noticed
    trial_checks.check(trial)
    unit_checks.check(trial, axle)
    trial, noticed = one_torque.shared(trial, axle, mass)
    return trial, said + noticed + sign_checks.check(trial, axle, mass)
