"""A drive's file: TOML with the parts of a drive and the profiles of its controller.

    [motor]
    resistance = { value = 0.25, unit = "ohm", source = "assumption: ..." }
    ...
    [profile.indoor]
    forward_speed = { value = [0.4, 1.0], unit = "m/s", source = "..." }

In: the path of a file and the name of a profile. Out: a `Drive`. Every number says its unit and its
source; a number or a source that is missing, another unit, an unknown name is refused.
"""

from __future__ import annotations

import json
import os
from dataclasses import fields
from pathlib import Path
from typing import Any

import msgspec

from mjchair.drive.quantities import PARTS, Drive, Part, Profile
from mjchair.errors import MjchairError, nearest
from mjchair.toml_file import read_toml

USUAL = "normal"  # the profile where none is asked for


class Stated(msgspec.Struct, forbid_unknown_fields=True):
    """A number, or several, with unit and source."""

    value: float | list[float]
    unit: str
    source: str


class DriveFile(msgspec.Struct, forbid_unknown_fields=True):
    """What stands in a drive's file: the parts, and the profiles by name."""

    motor: dict[str, Stated]
    gear: dict[str, Stated]
    brake: dict[str, Stated]
    battery: dict[str, Stated]
    controller: dict[str, Stated]
    profile: dict[str, dict[str, Stated]]


def read_drive(path: str | os.PathLike[str], profile: str | None = None) -> Drive:
    """The drive in a file, with one of its profiles.

    Args:
      path: of the TOML. profile: its name; None: `normal`, or the only one.

    Raises:
      MjchairError: no such file, no TOML, an unknown or missing name, a number out of its range,
        an unknown profile.
    """
    path = Path(path)
    document = _read(path)
    try:
        return _drive(document, profile)
    except MjchairError as error:
        raise MjchairError(f"{path}: {error}") from None


def profiles(path: str | os.PathLike[str]) -> tuple[str, ...]:
    """Names of the profiles in a drive's file.

    Raises:
      MjchairError: no such file, or none of a drive.
    """
    return tuple(_read(Path(path)).profile)


def _read(path: Path) -> DriveFile:
    if not path.is_file():
        raise MjchairError(f"no drive file {path}; a chair's own is models/<chair>/drive.toml")
    return read_toml(path, DriveFile)


def _drive(document: DriveFile, profile: str | None) -> Drive:
    made = {part.name(): _part(part, getattr(document, part.name())) for part in PARTS}
    read = {name: _part(Profile, given, name) for name, given in document.profile.items()}
    name = next(iter(read)) if profile is None and len(read) == 1 else profile or USUAL
    if name not in read:
        raise MjchairError(f"no profile {name!r}" + nearest(name, read))
    return Drive(**made, profile=read[name], profile_name=name)


def _part(part: type[Part], given: dict[str, Stated], profile: str = "") -> Any:
    where = f"[profile.{profile}]" if profile else f"[{part.name()}]"
    known = {item.name: item for item in fields(part)}  # type: ignore[arg-type]
    for key in given:
        if key not in known:
            raise MjchairError(f"{where}: unknown {key!r}" + nearest(key, known))
    missing = [name for name in known if name not in given]
    if missing:
        unit = known[missing[0]].metadata["unit"]
        raise MjchairError(
            f"{where} has no {' and no '.join(map(repr, missing))}; give it as "
            f'{missing[0]} = {{ value = ..., unit = {json.dumps(unit)}, source = "..." }}'
        )
    return part(**{key: _number(f"{where} {key}", given[key], known[key]) for key in known})


def _number(where: str, stated: Stated, item: Any) -> float | tuple[float, ...]:
    if stated.unit != item.metadata["unit"]:
        raise MjchairError(
            f"{where}: unit is {stated.unit!r}; it must be {item.metadata['unit']!r}"
        )
    if not stated.source.strip():
        raise MjchairError(f"{where}: source is empty; name it, or write assumption")
    value = stated.value
    several = "tuple" in str(item.type)
    if several != isinstance(value, list):
        raise MjchairError(
            f"{where}: value is {value}; it must be {'several numbers' if several else 'one'}"
        )
    return tuple(value) if isinstance(value, list) else value
