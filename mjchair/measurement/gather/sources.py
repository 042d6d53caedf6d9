"""Which files a folder holds, what each is, and which belong to one trial.

In: a folder of files as instruments leave them, and an optional gather.toml that names them. Out:
a list of `Source`, each with its kind, side, place and trial. Names are read as words:
`push2_left.csv` and `push2_imu/sensors.csv` are one trial, `push2`; a word such as `baseline`
makes a recording of an untouched rim. What the names do not tell, gather.toml does:

    [files."run7.csv"]
    trial = "push2"
    side = "right"            # of a wheel
    place = "frame"           # of an IMU: frame, left_wheel, right_wheel, body
    baseline = true
    still = true              # markers of the person at rest, from which lengths are taken
    offset = 0.25             # s, added to its clock
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from msgspec import Struct

from mjchair.errors import MjchairError, nearest
from mjchair.measurement.delimited import Delimited, read_delimited
from mjchair.measurement.exports import Format, matching, read_formats
from mjchair.measurement.table_wheels import FEWEST, few_rows
from mjchair.toml_file import read_toml

PLAN = "gather.toml"
LOG = "gather.log"  # stands in every study that was gathered
DEEPEST = 4  # folders below the one that is given
SUFFIXES = (".csv", ".txt", ".tsv", ".c3d", ".trc", ".parquet")
# that hold recordings as well, and are not read
EXPORTED = (".zip", ".mat", ".xlsx", ".xls", ".h5", ".hdf5", ".mvnx", ".mot", ".sto", ".bin")
GENERIC = {"sensors", "inertial", "imu", "calinertialandmag", "data", "export", "stats"}
SIDES = {
    **dict.fromkeys(("left", "l", "lhs", "swl", "lw", "leftwheel", "gauche", "links"), "left"),
    **dict.fromkeys(("right", "r", "rhs", "swr", "rw", "rightwheel", "droite", "rechts"), "right"),
}
PLACES = {
    **dict.fromkeys(("frame", "chair", "seat", "base", "wheelchair"), "frame"),
    **dict.fromkeys(
        ("trunk", "torso", "sternum", "chest", "arm", "wrist", "hand", "head", "upperarm"), "body"
    ),
}
STILL = {"static", "calibration", "neutral", "statisch", "statique"}
BASELINE = {"baseline", "unloaded", "nohand", "nohands", "untouched", "bare", "norider"}
INSTRUMENTS = {
    *("smartwheel", "sw", "wheel", "wheels", "enc", "encoder", "encoders", "kinetics"),
    *("imu", "ngimu", "ximu", "ximu3", "xsens", "dot"),
    *(
        "mocap",
        "markers",
        "rider",
        "vicon",
        "optitrack",
        "qtm",
        "c3d",
        "trc",
        "kinematics",
        "pushrim",
    ),
    *("calinertialandmag", "inertial", "sensors", "csv", "data", "export"),
}
PAPERS = {"license", "licence", "notice", "readme", "copying"}
# what sensors of Xsens add to a name: MT_0120034-001, MT_012005D6-000_00B4C3A2, D422CD006044
TAG = re.compile(
    r"(?<![A-Za-z0-9])(?:MT_[0-9A-F]{6,8}(?:-\d{3})*(?:_[0-9A-F]{8})?"
    r"|(?=[0-9]*[A-F])(?=[A-F]*[0-9])(?:[0-9A-F]{8}|[0-9A-F]{12}))(?![A-Za-z0-9])"
)
WHOLE = "run"  # the trial of files whose names tell none


@dataclass(frozen=True)
class Source:
    """A file and what it is.

    Attributes:
      path: the file. kind: "smartwheel", "imu", "table" or "markers". trial: its trial.
      side: "left", "right" or "". side_word: the word of its name that tells it, or "".
      place: of an IMU, "frame", "body", a wheel, or "".
      baseline: of an untouched rim. still: markers of a person at rest. offset: s, given by hand,
        None otherwise. format: of an export.
      file: what was read of a delimited file.
    """

    path: Path
    kind: str
    trial: str
    side: str = ""
    side_word: str = ""
    place: str = ""
    baseline: bool = False
    still: bool = False
    offset: float | None = None
    format: Format | None = None
    file: Delimited | None = None


@dataclass(frozen=True)
class Found:
    """What a folder holds: sources, and a line for each file that is not used and why."""

    sources: tuple[Source, ...]
    unused: tuple[str, ...]


def find_sources(folder: Path, mappings: Sequence[Path] = ()) -> Found:
    """The instruments' files in a folder; see the module's docstring.

    Raises:
      MjchairError: no folder, no file of a known kind, a bad gather.toml, or a recording of an
        untouched rim without one of the rim in use.
    """
    if not folder.is_dir():
        raise MjchairError(f"no folder {folder}; give the folder with the instruments' files")
    plan = _plan(folder)
    formats = read_formats(mappings)
    sources, unused = [], []
    for path in sorted(folder.rglob("*")):
        inside = path.relative_to(folder)
        if not path.is_file() or path.name == PLAN or len(inside.parts) > DEEPEST:
            continue
        if path.suffix.lower() not in (*SUFFIXES, *EXPORTED) or path.name.startswith("."):
            continue
        if (path.parent / LOG).is_file():  # a study that was gathered before, no raw files
            continue
        if path.stem.lower() in PAPERS:
            continue
        if path.suffix.lower() in EXPORTED:
            unused.append(f"{inside} is not used: export it as CSV, Parquet, C3D or TRC")
            continue
        kind, form, file, why = _kind(path, formats)
        if not kind:
            unused.append(f"{inside} is not used: {why}")
            continue
        side, word = _side(inside)
        found = Source(path, kind, _trial(inside), side, word, _place(inside, kind))
        words = set(_words(inside))
        found = replace(
            found,
            baseline=bool(BASELINE & words),
            still=kind == "markers" and bool(STILL & words),
            format=form,
            file=file,
        )
        given = plan.get(str(inside), {})
        found = replace(found, side_word="" if "side" in given else word)
        sources.append(replace(found, **given))
    _check_plan(plan, folder)
    if not sources:
        lines = "; ".join(unused[:3]) or f"there is none that ends in {', '.join(SUFFIXES)}"
        raise MjchairError(f"{folder}: no file of a known kind that can be used: {lines}")
    _check_baselines(sources, unused, folder)
    sources = _without_tags(sources, plan, folder)
    return Found(tuple(_one_trial(sources, plan)), tuple(unused))


def _check_baselines(sources: Sequence[Source], unused: Sequence[str], folder: Path) -> None:
    """Refuse a folder whose rims are all untouched.

    Raises:
      MjchairError: naming the word that makes a file such a recording, and the files not used.
    """
    rims = [source for source in sources if source.kind == "smartwheel"]
    if not rims or not all(source.baseline for source in rims):
        return
    inside = rims[0].path.relative_to(folder)
    word = next((word for word in _words(inside) if word in BASELINE), "")
    rename = f"; take {word!r} out of its name if it is one" if word else ""
    lines = "".join(f"; {line}" for line in unused[:3])
    raise MjchairError(
        f"{rims[0].path}: a recording of an untouched rim, and none of the rim in use"
        f"{rename}{lines}"
    )


class _File(Struct, forbid_unknown_fields=True):
    """What gather.toml says of a file; None: nothing."""

    trial: str | None = None
    side: Literal["left", "right"] | None = None
    place: Literal["frame", "left_wheel", "right_wheel", "body"] | None = None
    baseline: bool | None = None
    still: bool | None = None
    offset: float | None = None

    def given(self) -> dict[str, Any]:
        """The fields that are said."""
        return {f: v for f in self.__struct_fields__ if (v := getattr(self, f)) is not None}


class _Plan(Struct, forbid_unknown_fields=True):
    """All that may stand in gather.toml."""

    files: dict[str, _File] = {}


def _plan(folder: Path) -> dict[str, dict[str, Any]]:
    """What gather.toml says, by file; nothing where there is none."""
    path = folder / PLAN
    if not path.is_file():
        return {}
    return {name: entry.given() for name, entry in read_toml(path, _Plan).files.items()}


def _check_plan(plan: Mapping[str, Any], folder: Path) -> None:
    known = [str(p.relative_to(folder)) for p in folder.rglob("*") if p.is_file()]
    for name in plan:
        if name not in known:
            raise MjchairError(f"{folder / PLAN}: no file {name!r}" + nearest(name, known))


def _kind(
    path: Path, formats: Sequence[Format]
) -> tuple[str, Format | None, Delimited | None, str]:
    """Kind, mapping and numbers of a file; an empty kind and why, for one that is of none."""
    if path.suffix.lower() in (".c3d", ".trc"):
        return "markers", None, None, ""
    if path.suffix.lower() == ".parquet":
        return "table", None, None, ""
    try:
        file = read_delimited(path)
    except MjchairError as error:
        if _looks_like_smartwheel(path):
            raise
        return "", None, None, str(error).partition(": ")[2]
    form = matching(file, formats)
    if form is not None:
        return str(form.mapping.kind), form, file, ""
    if file.header and file.header[0].lower().split("[")[0].strip() == "time":
        if len(file.values) < FEWEST:
            return "", None, None, few_rows(len(file.values))
        return "table", None, file, ""
    if file.values.shape[1] in (24, 25):
        return "smartwheel", None, file, ""
    columns = ", ".join(file.header[:4]) or f"{file.values.shape[1]} columns without names"
    if file.header and file.header[0].lower().split("(")[0].strip() == "time":
        why = f"its first column is {file.header[0]!r}; a table has its units in [ ], as in "
        return "", None, None, f"{why}'time [ms]', or write a mapping, see docs/your_data.md"
    return (
        "",
        None,
        None,
        f"no mapping knows its columns ({columns}); write one, see docs/your_data.md",
    )


def _looks_like_smartwheel(path: Path) -> bool:
    """Whether the first line of numbers of a file that cannot be read has 24 or 25 of them."""
    try:
        with path.open(encoding="latin-1") as file:
            lines = [next(file, "") for _ in range(5)]
    except OSError:
        return False
    return any(len(re.split(r"[;,\t]", line.strip().rstrip(",;"))) in (24, 25) for line in lines)


def _words(inside: Path) -> list[str]:
    """The words of a file's name, and of its folders."""
    text = "/".join((*inside.parts[:-1], inside.stem))
    text = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", text)
    return [word for word in re.split(r"[^A-Za-z0-9]+", text.lower()) if word]


def _side(inside: Path) -> tuple[str, str]:
    """The side that a file's name tells, and the word that tells it; both empty: none does."""
    words = [word for word in _words(inside) if word in SIDES]
    sides = {SIDES[word] for word in words}
    return (sides.pop(), words[-1]) if len(sides) == 1 else ("", "")


def _place(inside: Path, kind: str) -> str:
    if kind != "imu":
        return ""
    words = _words(inside)
    side, _ = _side(inside)
    if side and ({"wheel", "leftwheel", "rightwheel"} & set(words)):
        return f"{side}_wheel"
    return next((PLACES[word] for word in words if word in PLACES), "")


def _trial(inside: Path) -> str:
    """What is left of a file's name without words of sides, places and instruments."""
    dropped = {*SIDES, *PLACES, *BASELINE, *STILL, *INSTRUMENTS, *GENERIC}
    return "_".join(word for word in _words(inside) if word not in dropped) or WHOLE


def _without_tags(sources: Sequence[Source], plan: Mapping[str, Any], folder: Path) -> list[Source]:
    """The sources, those of a sensor in the trial that its name tells without the sensor's tag.

    Not where a name is a tag alone, or where one sensor left two files of that trial, so that only
    the number in the tag tells them apart.
    """
    short: dict[int, tuple[str, str]] = {}
    for k, source in enumerate(sources):
        inside = source.path.relative_to(folder)
        tag = TAG.search(inside.stem)
        if source.kind != "imu" or tag is None or "trial" in plan.get(str(inside), {}):
            continue
        name = _trial(inside.with_name(TAG.sub("", inside.stem) + inside.suffix))
        if name != WHOLE:
            short[k] = name, re.sub(r"-\d{3}", "", tag[0])
    times = Counter(short.values())
    return [
        replace(source, trial=short[k][0]) if times[short.get(k, ("", ""))] == 1 else source
        for k, source in enumerate(sources)
    ]


def _one_trial(sources: list[Source], plan: Mapping[str, Any]) -> list[Source]:
    """One trial of all files, where no instrument has been used twice."""
    runs = [s for s in sources if not (s.baseline or s.still)]
    if any("trial" in entry for entry in plan.values()) or len({s.trial for s in runs}) < 2:
        return sources
    used = Counter((s.kind, s.side, s.place) for s in runs)
    if max(used.values()) > 1:
        return sources
    name = runs[0].trial
    return [s if s.baseline or s.still else replace(s, trial=name) for s in sources]
