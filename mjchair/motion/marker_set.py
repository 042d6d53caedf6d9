"""Which marker is where: on a landmark of the rider, somewhere on a segment, or on the chair.

In: a TOML file, or the name of one that comes along. Out: a `MarkerSet`. A name in the file fits a
marker's whole name, or the part behind a colon, whatever the case.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from msgspec import Struct

from mjchair.errors import MjchairError, nearest
from mjchair.rider.anatomy import LANDMARKS, SEGMENTS
from mjchair.toml_file import read_toml

SETS = Path(__file__).with_name("marker_sets")
AXES = ("x", "-x", "y", "-y", "z", "-z")
LANDMARK_NAMES = tuple(mark.name for mark in LANDMARKS)
SEGMENT_NAMES = tuple(segment.name for segment in SEGMENTS)
LEAST = 3  # markers of a person, fewer of which tell no motion


class _Chair(Struct, frozen=True, forbid_unknown_fields=True):
    """[chair]: markers on it."""

    markers: tuple[str, ...] = ()
    front: tuple[str, ...] = ()
    rear: tuple[str, ...] = ()


class _Entry(Struct, forbid_unknown_fields=True):
    """All that may stand in the file of a marker set; see `MarkerSet`."""

    landmarks: dict[str, str] = {}
    clusters: dict[str, list[str]] = {}
    chair: _Chair = _Chair()
    up: str = ""
    forward: str = ""
    landmarks_by_name: bool = False


@dataclass(frozen=True)
class MarkerSet:
    """Where markers are.

    Attributes:
      name: of the set. landmarks: marker -> landmark. clusters: marker -> segment. chair: markers
        on the chair or on the pelvis that sits on it. front, rear: of those, at its front and rear.
      up, forward: axes of the laboratory such as "y" or "-x"; "": to be found out.
    """

    name: str
    landmarks: Mapping[str, str]
    clusters: Mapping[str, str]
    chair: tuple[str, ...]
    front: tuple[str, ...] = ()
    rear: tuple[str, ...] = ()
    up: str = ""
    forward: str = ""

    def of(self, names: Sequence[str]) -> MarkerSet:
        """The set with the names that the file of markers uses, without those it has not."""
        full: dict[str, str] = {}
        for name in names:
            full.setdefault(name.lower(), name)
            full.setdefault(name.split(":")[-1].lower(), name)

        def there(wanted: Sequence[str]) -> tuple[str, ...]:
            return tuple(full[w.lower()] for w in wanted if w.lower() in full)

        return MarkerSet(
            self.name,
            {full[m.lower()]: mark for m, mark in self.landmarks.items() if m.lower() in full},
            {full[m.lower()]: part for m, part in self.clusters.items() if m.lower() in full},
            there(self.chair),
            there(self.front),
            there(self.rear),
            self.up,
            self.forward,
        )

    @property
    def body(self) -> tuple[str, ...]:
        """The markers on the person."""
        return (*self.landmarks, *self.clusters)


def read_marker_set(path: str | os.PathLike[str]) -> MarkerSet:
    """A marker set from a TOML file, or of a name that comes along.

    Raises:
      MjchairError: no such file or name, a key, landmark or segment that is not known.
    """
    known = {p.stem: p for p in SETS.glob("*.toml")}
    place = known.get(str(path), Path(path))
    if not place.is_file():
        raise MjchairError(f"no marker set {path}" + nearest(str(path), known))
    entry = read_toml(place, _Entry)
    landmarks = dict(entry.landmarks)
    if entry.landmarks_by_name:
        landmarks |= {name: name for name in LANDMARK_NAMES}
    for mark in landmarks.values():
        if mark not in LANDMARK_NAMES:
            raise MjchairError(f"{place}: no landmark {mark!r}" + nearest(mark, LANDMARK_NAMES))
    for segment in entry.clusters:
        if segment not in SEGMENT_NAMES:
            raise MjchairError(f"{place}: no segment {segment!r}" + nearest(segment, SEGMENT_NAMES))
    for axis in (entry.up, entry.forward):
        if axis and axis not in AXES:
            raise MjchairError(f"{place}: axis {axis!r}; known: {', '.join(AXES)}")
    clusters = {m: part for part, markers in entry.clusters.items() for m in markers}
    return MarkerSet(
        place.stem,
        landmarks,
        clusters,
        entry.chair.markers,
        entry.chair.front,
        entry.chair.rear,
        entry.up,
        entry.forward,
    )


def find_marker_set(names: Sequence[str]) -> MarkerSet:
    """The set that comes along and knows most of the markers.

    Raises:
      MjchairError: none knows three markers of the person.
    """
    sets = [read_marker_set(path.stem) for path in sorted(SETS.glob("*.toml"))]
    found = [one.of(names) for one in sets]
    best = max(found, key=lambda one: len(one.body) + len(one.chair))
    if len(best.body) < LEAST:
        raise MjchairError(
            f"no marker set knows these markers ({', '.join(list(names)[:6])} ...); say what they "
            f"are with --markers FILE.toml, as in {SETS.name}/{sets[0].name}.toml"
        )
    return best
