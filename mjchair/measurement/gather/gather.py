"""All steps from people's own files to a study.

In: a folder of instruments' files, and what a person knows of chair, rider and floor. Out: the
files of a study folder as text, the trials for a picture, and a line for everything found out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

from mjchair.errors import MjchairError, nearest, note
from mjchair.measurement.gather.coasts import coasts, pushes
from mjchair.measurement.gather.instruments import (
    RIDER_COLUMNS,
    Instrument,
    ReadsMarkers,
    idle_baselines,
    read_instruments,
)
from mjchair.measurement.gather.join import GatheredTrial, heading_at, join
from mjchair.measurement.gather.known import Known
from mjchair.measurement.gather.sources import LOG, Source, find_sources
from mjchair.measurement.gather.study_file import study_text
from mjchair.measurement.gather.together import Agreed, label_of, started_together
from mjchair.measurement.gather.without_torque import estimated
from mjchair.measurement.sensors import rolls
from mjchair.measurement.stretches import stretches
from mjchair.simulation.inputs import HAND_FORCES

Array = NDArray[np.float64]

QUIET = 0.5  # s at rest, the least from which noise is read
RESTS = 0.05  # rad/s of a wheel, below which the chair stands
STEP = 2.0 * np.pi / 4096  # rad, of the encoders in use
EVEN, FEW = 0.2, 6.4  # of a step, within which readings come in whole steps, of so many at most
MANY = 3  # pushes that make a run a pushed one; one or two set a coast going
TRAVELS = 0.5  # m, below which a chair on a floor rocks and goes nowhere; assumption
RUNS_OFF_FLOOR = ("rollers",)  # floors on which the chair itself does not move


@dataclass(frozen=True)
class Gathered:
    """A study made of people's own files.

    Attributes:
      files: name -> text, of the study folder. trials: as they stand in it. noise: channel ->
        standard deviation at rest, SI. notes: what was found out, of which a `Detail` stands in
        the file gather.log alone. unused: files, and why. asked: what cannot be known from the
        files, with its flag. summary: a line or two for each trial.
    """

    files: Mapping[str, str]
    trials: tuple[GatheredTrial, ...]
    noise: Mapping[str, float]
    notes: tuple[str, ...]
    unused: tuple[str, ...]
    asked: tuple[str, ...]
    summary: tuple[str, ...] = ()


def gather(
    folder: Path,
    known: Known | None = None,
    mappings: Sequence[Path] = (),
    offsets: Mapping[str, float] | None = None,
    of_markers: ReadsMarkers | None = None,
) -> Gathered:
    """Make a study of the files in a folder.

    Args:
      folder: with the files. known: of chair, rider and floor. mappings: TOML files of one's own,
        see mjchair.measurement.exports. offsets: file -> s, added to its clock. of_markers: makes
        the table of a rider's motion of a file of markers and the static trial beside it; None:
        files of markers are named and left out.

    Raises:
      MjchairError: no file that can be used, one that is broken, clocks that cannot be aligned.
    """
    known = known or Known()
    found = find_sources(folder, mappings)
    sources = _with_offsets(found.sources, offsets or {})
    instruments = read_instruments(sources, of_markers)
    unused = (*found.unused, *idle_baselines(sources, instruments))
    names = list(dict.fromkeys(one.source.trial for one in instruments))
    if not names:
        raise MjchairError(
            f"{folder}: no wheel, no sensor on the frame and no markers among its files"
            + "".join(f"; {line}" for line in unused[:3])
        )
    mine = {name: [one for one in instruments if one.source.trial == name] for name in names}
    joined = [join(name, mine[name]) for name in names]
    agreed, shared = started_together(joined)
    trials: list[GatheredTrial] = []
    left_out: list[str] = []
    for name, trial in zip(names, joined, strict=True):
        same = join(name, mine[name], agreed[name]) if name in agreed else trial
        same = _for_floor(same, known)
        why = _goes_nowhere(same, known) or _pushed_unseen(same)
        if why:
            left_out.append(why)
        else:
            trials += _usable(same, known)
    if not trials:
        raise MjchairError("; ".join(left_out))
    _ask_sides(trials)
    if known.floor not in RUNS_OFF_FLOOR:
        trials = _headed(trials)
    noise = _noise(trials)
    notes = [*dict.fromkeys(note for trial in trials for note in trial.notes)]
    notes += [f"left out: {why}" for why in left_out]
    notes += [
        f"{s.path.name}: on the person's body; not used here" for s in sources if s.place == "body"
    ]
    if of_markers is None:
        notes += [_about_markers(s) for s in sources if s.kind == "markers"]
    radius = next((one.radius for one in instruments if one.radius is not None), None)
    notes += shared
    text = study_text(trials, noise, known, radius, shared)
    files = {"study.toml": text} | {f"{t.name}.csv": table_text(t) for t in trials}
    summary = _summary(trials, agreed)
    files[LOG] = "\n".join((*summary, *notes, *unused)) + "\n"
    asked = known.missing(radius)
    return Gathered(files, tuple(trials), noise, tuple(notes), unused, asked, summary)


def _summary(trials: Sequence[GatheredTrial], agreed: Agreed) -> tuple[str, ...]:
    """A line for each trial, and one more on clocks that it does not share with others."""
    wide = max(len(trial.name) for trial in trials)
    out = []
    for trial in trials:
        what = ", ".join(label_of(one) for one in trial.instruments)
        lasts = trial.time[-1] - trial.time[0]
        faces = ""
        if trial.heading is not None:
            faces = f"; faces {round(np.degrees(trial.heading))} deg"
        out.append(f"{trial.name:<{wide}}  {trial.manoeuvre}, {lasts:.1f} s: {what}{faces}")
        same = agreed.get(trial.name, {})
        own = [f"{n} {a.short()}" for n, a in trial.alignments.items() if n not in same]
        if own:
            out.append(f"{'':<{wide}}  clocks: {', '.join(own)}")
    return tuple(out)


def _ask_sides(trials: Sequence[GatheredTrial]) -> None:
    """Ask where names tell one side and signs the other; a gyroscope that turns tells itself."""
    seen = [one for t in trials if "imu_gyro.z" not in t.columns for one in t.instruments]
    names = sorted({one.name for one in seen if one.doubted})
    if names:
        note(
            f"{', '.join(names)}: by name of one side and by signs of the other; are left and "
            "right swapped, or did it roll backwards? The names are believed: rename the files, "
            "or say it in gather.toml"
        )


def _about_markers(source: Source) -> str:
    name = source.path.name
    return f"{name}: markers; `mjchair rider {name}` makes the rider's motion of them"


def _with_offsets(sources: Sequence[Source], offsets: Mapping[str, float]) -> list[Source]:
    names = [s.path.name for s in sources]
    for name in offsets:
        if name not in names:
            raise MjchairError(f"--offset {name}: no such file" + nearest(name, names))
    return [replace(s, offset=offsets.get(s.path.name, s.offset)) for s in sources]


def _for_floor(trial: GatheredTrial, known: Known) -> GatheredTrial:
    """Without the channels that a chair which stays in place does not have."""
    if known.floor not in RUNS_OFF_FLOOR:
        return trial
    gone = [n for n in trial.columns if n.startswith(("imu_", "position", "velocity", "heading"))]
    if not gone:
        return trial
    said = f"{trial.name}: on rollers the chair stays in place; {', '.join(gone)} left out"
    left = {n: v for n, v in trial.columns.items() if n not in gone}
    return replace(trial, columns=left, notes=(*trial.notes, said))


def _usable(trial: GatheredTrial, known: Known) -> list[GatheredTrial]:
    """The trial, or without torque its free rolling; else the trial with a torque estimated."""
    if trial.driven:
        return [trial]
    motion = next((one for one in trial.instruments if one.speed is not None), None)
    if motion is None or motion.speed is None:
        said = f"{trial.name}: no wheel's motion; it is taken as a coast throughout"
        return [replace(trial, notes=(*trial.notes, said))]
    parts = coasts(motion.time[motion.seen], motion.speed[motion.seen])
    rolling = float(np.mean(np.abs(motion.speed) > 0.5)) * float(np.ptp(motion.time))
    total = sum(end - begin for begin, end in parts)
    if any(one.free is not None for one in trial.instruments) or total > 0.9 * rolling:
        return [trial]  # an instrumented rim without a hand on it, or a coast from end to end
    if not parts:
        return [estimated(trial, motion, known)]
    said = (
        f"{trial.name}: no torque was measured, and it is pushed; its {len(parts)} free-rolling "
        f"parts ({total:.1f} s) are used alone, each as a coast"
    )
    return [
        _cut(trial, f"{trial.name}_coast{k}", (a - trial.begin, b - trial.begin), said)
        for k, (a, b) in enumerate(parts, start=1)
    ]


def _goes_nowhere(trial: GatheredTrial, known: Known) -> str:
    """Why a trial cannot be used in which nothing shows how far the chair goes; or ""."""
    names = ", ".join(one.name for one in trial.instruments)
    if known.floor in RUNS_OFF_FLOOR and not any(rolls(name) for name in trial.columns):
        return (
            f"trial {trial.name!r}: on rollers the chair stays in place, and {names} does not tell "
            "how a wheel turns; add a wheel's file"
        )
    seen = [one for one in trial.instruments if one.ground is not None]
    if trial.driven or not seen or any(rolls(name) for name in trial.columns):
        return ""
    way = max(_way(one) for one in seen)
    if way >= TRAVELS:
        return ""
    return (
        f"trial {trial.name!r}: the markers of the chair in {names} stay within {way:.2f} m, so it "
        "goes nowhere; on rollers markers show no travel: add a wheel's file"
    )


def _way(one: Instrument) -> float:
    """How far apart two places of a chair are along its way, by its markers, m."""
    assert one.ground is not None
    time, speed = one.time[one.seen], one.ground[one.seen]
    return float(np.ptp(cumulative_trapezoid(speed, time, initial=0.0)))


def _pushed_unseen(trial: GatheredTrial) -> str:
    """Why a trial cannot be used that is pushed, where no wheel is seen and no torque; or ""."""
    pull = trial.columns.get("imu_accelerometer.x")
    if trial.driven or pull is None or any(one.speed is not None for one in trial.instruments):
        return ""
    seen = np.isfinite(pull)
    count = pushes(trial.time[seen], pull[seen])
    if count < MANY:
        return ""
    names = ", ".join(one.name for one in trial.instruments)
    return (
        f"trial {trial.name!r}: {names} shows {count} pushes, and no file tells how a wheel turns "
        "or what drives it; add a wheel's file, or cut this one to where it rolls freely"
    )


def _cut(trial: GatheredTrial, name: str, span: tuple[float, float], said: str) -> GatheredTrial:
    inside = (trial.time >= span[0]) & (trial.time <= span[1])
    columns = {n: v[inside] for n, v in trial.columns.items() if np.isfinite(v[inside]).any()}
    time = trial.time[inside]
    return replace(
        trial, name=name, time=time, columns=columns, manoeuvre="coast", notes=(*trial.notes, said)
    )


def _headed(trials: Sequence[GatheredTrial]) -> list[GatheredTrial]:
    """The trials with the heading at which they begin, where markers show it.

    x is the axis of the laboratory that is nearest to where the chair faces as the first trial
    begins, z is up; headings are from a quarter turn to the right to three quarters to the left.
    """
    told = [heading_at(trial.instruments, trial.begin + trial.time[0]) for trial in trials]
    first = next((angle for angle in told if angle is not None), None)
    if first is None:
        return list(trials)
    quarter = 0.5 * np.pi
    zero = quarter * round(first / quarter)
    return [
        trial
        if angle is None
        else replace(trial, heading=float((angle - zero + quarter) % (4.0 * quarter) - quarter))
        for trial, angle in zip(trials, told, strict=True)
    ]


def _noise(trials: Sequence[GatheredTrial]) -> dict[str, float]:
    """Standard deviation of each channel where the chair stands, the median over trials."""
    seen: dict[str, list[float]] = {}
    least: dict[str, float] = {}
    for trial in trials:
        rests = _rests(trial)
        for name, values in trial.columns.items() if rests else ():
            least[name] = max(least.get(name, 0.0), _tick(name, values) / np.sqrt(12.0))
        for begin, end in rests:
            for name, values in trial.columns.items():
                if name in ("left_wheel", "right_wheel", *HAND_FORCES, *RIDER_COLUMNS):
                    continue
                inside = (trial.time >= begin) & (trial.time <= end) & np.isfinite(values)
                if inside.sum() > 10:
                    seen.setdefault(name, []).append(_scatter(values[inside]))
    out = {}
    for name, sizes in seen.items():
        size = max(float(np.median(sizes)), least[name])
        if size > 0.0:
            size = float(f"{size:.2g}")
            out[name] = size if size >= least[name] else float(f"{1.05 * least[name]:.2g}")
    return out


def _tick(name: str, values: Array) -> float:
    """The step in which a channel's readings come; of an angle at least that of encoders in use.

    A channel at rest may repeat one reading; it is known to no better than that. 0: readings come
    in no step.
    """
    usual = STEP if name.endswith("_angle") else 0.0
    steps = np.abs(np.diff(values[np.isfinite(values)]))
    steps = steps[steps > 1e-9]
    if not steps.size:
        return usual
    tick = float(steps.min())
    few = steps[steps < FEW * tick] / tick
    return max(usual, tick) if np.all(np.abs(few - np.round(few)) < EVEN) else usual


def _scatter(values: Array) -> float:
    """Standard deviation of what is left of a straight line."""
    line = np.linspace(-1.0, 1.0, values.size)
    terms = np.column_stack([np.ones_like(line), line])
    return float(np.std(values - terms @ np.linalg.lstsq(terms, values, rcond=None)[0]))


def _rests(trial: GatheredTrial) -> list[tuple[float, float]]:
    """Begin and end (s) of the parts in which every wheel stands."""
    motions = [one for one in trial.instruments if one.speed is not None]
    motions = [one for one in motions if one.ground is None] or motions
    if not motions:
        return []
    still = np.ones(trial.time.size, bool)
    for one in motions:
        assert one.speed is not None
        still &= np.abs(np.interp(trial.time, one.time - trial.begin, one.speed)) < RESTS
    spans = [(trial.time[a], trial.time[b - 1]) for a, b in stretches(still)]
    return [(float(a), float(b)) for a, b in spans if b - a >= QUIET]


def table_text(trial: GatheredTrial) -> str:
    """A trial's table as CSV, SI, an empty cell where a sample is missing."""
    lines = [",".join(["time", *trial.columns])]
    rows = np.column_stack(list(trial.columns.values())).tolist()
    for time, row in zip(trial.time.tolist(), rows, strict=True):  # times may be 1e-5 s apart
        cells = ("" if x != x else f"{x:.7g}" for x in row)
        lines.append(",".join([f"{round(time, 6):.12g}", *cells]))
    return "\n".join(lines) + "\n"
