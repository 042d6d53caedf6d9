"""docs/study_file.md: every example is read as a study, and the table has every key and default."""

import re
from fnmatch import fnmatch
from itertools import count
from pathlib import Path

import msgspec
import numpy as np
import pytest

import mjchair
from mjchair.diagnosis.data.study_file import ProcessEntry, StudyEntry
from mjchair.measurement import samples
from mjchair.toml_file import read_toml
from mjchair.units import factor, split_header

PAGE = (Path(__file__).parents[1] / "docs" / "study_file.md").read_text()
EXAMPLES = re.findall(r"^```toml\n(.*?)^```", PAGE, re.M | re.S)
TIME = np.arange(0.0, 2.0, 0.02)
SIZES = {"left_wheel": 4.0, "right_wheel": 4.0, "joystick_x": 0.5}  # SI


def test_every_usual_case_has_an_example():
    assert len(EXAMPLES) == 8


def values(name, k):
    """What a sensor or an input of the name could show in the file k, SI."""
    if name.endswith("_wheel_speed"):
        return (3.0 + 0.1 * k) - 0.3 * TIME
    if name == "position.x":
        return 0.9 * TIME - 0.045 * TIME**2
    return SIZES.get(name, 0.05) * np.sin(3.0 * TIME + k)


def write_table(path, columns, k):
    """A table with columns such as "imu_gyro.z [deg/s]"."""
    sizes = [(name, factor(unit)) for name, unit in map(split_header, columns)]
    table = [TIME / sizes[0][1], *(values(name, k) / size for name, size in sizes[1:])]
    np.savetxt(path, np.column_stack(table), "%.9g", ",", header=",".join(columns), comments="")


def write_smartwheel(path, k):
    """The recording that ships; a later one lacks its first k seconds."""
    source = samples.baseline() if "baseline" in path.name else samples.propulsion()
    path.write_text("".join(source.read_text().splitlines(keepends=True)[240 * k :]))


@pytest.mark.parametrize("text", EXAMPLES, ids=lambda text: text.splitlines()[0])
def test_an_example_is_read_with_every_column_that_it_tells_of(text, tmp_path, capsys):
    (tmp_path / "study.toml").write_text(text)
    columns = {p: c.split(", ") for p, c in re.findall(r"^# (\*\S*): (.*)$", text, re.M)}
    number = count()
    entry = read_toml(tmp_path / "study.toml", StudyEntry)
    for trial in entry.trial:
        if trial.smartwheel is not None:
            write_smartwheel(tmp_path / trial.file, next(number))
            write_smartwheel(tmp_path / trial.baseline, 0)
            continue
        for name in [trial.file] if isinstance(trial.file, str) else trial.file:
            (mine,) = [c for pattern, c in columns.items() if fnmatch(name, pattern)]
            write_table(tmp_path / name, mine, next(number))
    study = mjchair.read_study(tmp_path)
    assert len(study.runs) == len(entry.trial) > 0
    trials = [run.trial for run in study.runs]
    used = {c for t in trials for c in t.channels}
    used |= {c for t in trials if t.inputs is not None for c in t.inputs.controls}
    assert {split_header(c)[0] for told in columns.values() for c in told} <= used | {"time"}
    assert "left out" not in capsys.readouterr().err


def keys(schema, before=""):
    """Path and default of every key of a schema; of a [[trial]] there is one."""
    for f in msgspec.structs.fields(schema):
        path, inner = before + f.encode_name, list(schemas(f.type))
        if not inner or inner == [ProcessEntry]:
            yield path, "" if f.default in (None, msgspec.NODEFAULT) else f.default
        for one in inner:
            yield from keys(one, f"{path}.process." if one is ProcessEntry else f"{path}.")


def schemas(kind):
    """The schemas in an annotation such as ``list[TrialEntry]``."""
    if isinstance(kind, type) and issubclass(kind, msgspec.Struct):
        yield kind
    for part in getattr(kind, "__args__", ()):
        yield from schemas(part)


def test_the_table_has_every_key_with_its_default():
    rows = re.findall(r"^\| `(\S+)` \| [^|]+ \| ([^|]*)\|", PAGE, re.M)
    told = {key: default.strip().replace("needed", "") for key, default in rows}
    known = {path: str(default).replace("False", "false") for path, default in keys(StudyEntry)}
    assert told == known | {"trial.load.forward": "0"}
    assert len(rows) == len(known)
