"""All steps from motion capture to a table of the rider's joints.

In: a file of markers, perhaps a static trial, a marker set, and whose body it is. Out: a `Motion`,
and its table as text: `time`, the joints that markers tell (rad), `rider_motion` (m),
`chair_speed` (m/s, over the floor, by which other clocks find this one), and `chair_heading` (rad,
in the laboratory).
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from mjchair.errors import MjchairError
from mjchair.measurement.markers import Markers, read_markers
from mjchair.motion.chair_frame import bridged, in_chair
from mjchair.motion.inverse_kinematics import Build, Motion, fit, lengths_of
from mjchair.motion.marker_set import LEAST, MarkerSet, find_marker_set, read_marker_set

ALIKE = 0.12  # share by which arms of one person may differ between two trials

Path = str | os.PathLike[str]


def captured(
    path: Path,
    marker_set: Path | None = None,
    static: Path | None = None,
    build: Build | None = None,
    say: Callable[[str], None] = lambda _: None,
) -> Motion:
    """The motion in a file of markers.

    Args:
      path: C3D or TRC. marker_set: a name that comes along or a TOML file; None: the one that
        knows most of the markers. static: a trial at rest of the same person. build: whose body.
      say: called with what is under way.

    Raises:
      MjchairError: as the readers and the fit do; two files of different people.
    """
    with warnings.catch_warnings():  # a marker that is never seen has no mean: NaN, as wanted
        warnings.simplefilter("ignore", RuntimeWarning)
        return _captured(path, marker_set, static, build or Build(), say)


def _captured(
    path: Path,
    marker_set: Path | None,
    static: Path | None,
    build: Build,
    say: Callable[[str], None],
) -> Motion:
    markers = read_markers(path)
    found = find_marker_set(markers.names) if marker_set is None else read_marker_set(marker_set)
    chosen = found.of(markers.names)
    if len(chosen.body) < 3:
        raise MjchairError(
            f"{markers.source}: the marker set {chosen.name} knows {len(chosen.body)} of its "
            f"markers ({', '.join(markers.names[:6])} ...); at least 3 of the person are needed"
        )
    placed = in_chair(markers, chosen, bridged(markers.time, markers.positions))
    rest = None if static is None else _static(read_markers(static), markers, found)
    if rest is not None:
        _check_person(placed.positions, rest, markers, chosen, str(static))
    motion = fit(markers.time, placed.positions, markers.names, chosen, build, rest, say)
    notes = (*placed.notes, *motion.notes)
    return replace(motion, notes=notes, speed=placed.speed, heading=placed.heading)


def _static(still: Markers, run: Markers, chosen: MarkerSet) -> np.ndarray:
    """The static trial in the chair's axes, its markers in the order of the run's."""
    _check_names(still, run, chosen.of(run.names).body)
    placed = in_chair(still, chosen.of(still.names)).positions
    out = np.full((len(placed), len(run.names), 3), np.nan)
    for k, name in enumerate(run.names):
        if name in still.names:
            out[:, k] = placed[:, still.names.index(name)]
    return out


def _check_names(still: Markers, run: Markers, wanted: Sequence[str]) -> None:
    """Refuse a static trial that lacks nearly all markers of the person in the run."""
    there = [name for name in wanted if name in still.names]
    if len(there) < LEAST:
        lacks = ", ".join([name for name in wanted if name not in there][:4])
        raise MjchairError(
            f"{still.source}: the static trial has {len(there)} of the {len(wanted)} markers of "
            f"the person in {run.source} (it lacks {lacks} ...): its markers have other names, "
            "or it is of another person"
        )


def _check_person(
    run: np.ndarray, rest: np.ndarray, markers: Markers, chosen: MarkerSet, still: str
) -> None:
    """Refuse a static trial of somebody else: arms of other lengths."""
    one = lengths_of(run, markers.names, chosen)
    other = lengths_of(rest, markers.names, chosen)
    segment = unlike(one, other)
    if segment:
        raise MjchairError(
            f"{still}: the static trial is of another person: its {segment} is "
            f"{other[segment] / one[segment]:.2f} times that of {markers.source}"
        )


def unlike(one: Mapping[str, float], other: Mapping[str, float]) -> str:
    """The first segment whose lengths no single person has; "" where there is none."""
    both = [segment for segment in one if segment in other]
    return next((s for s in both if abs(one[s] / other[s] - 1.0) > ALIKE), "")


def table_columns(motion: Motion) -> dict[str, np.ndarray]:
    """The columns of a motion's table besides `time`; those that are told."""
    columns = {**motion.angles, "rider_motion": motion.center}
    if motion.speed is not None:
        columns["chair_speed"] = motion.speed
    if motion.heading is not None:
        columns["chair_heading"] = motion.heading
    return {n: v for n, v in columns.items() if np.isfinite(v).any()}


def table_text(motion: Motion) -> str:
    """The motion as CSV: rad and m, an empty cell where no marker tells it."""
    columns = table_columns(motion)
    header = ",".join(["time", *columns])
    rows = np.column_stack([motion.time, *columns.values()]).tolist()
    lines = [",".join("" if x != x else f"{x:.6g}" for x in row) for row in rows]
    return "\n".join([header, *lines]) + "\n"
