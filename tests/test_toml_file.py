"""What a schema makes of a TOML table: the struct, or one line that names place, value and rule."""

from typing import Annotated

import pytest
from msgspec import Meta, Struct

from mjchair.errors import MjchairError
from mjchair.toml_file import checked, read_toml


class Start(Struct, forbid_unknown_fields=True):
    heading: float | None = None
    position: tuple[float, float] | None = None


class Entry(Struct, forbid_unknown_fields=True):
    file: str
    held: bool = False
    start: Start | None = None


class Whole(Struct, forbid_unknown_fields=True):
    model: str = "manual"
    grade: float | str | None = None
    noise: dict[str, Annotated[float, Meta(gt=0)]] = {}
    trial: list[Entry] = []


def test_a_right_table_is_a_struct_with_its_defaults():
    whole = checked({"grade": 1, "trial": [{"file": "a", "start": {"heading": 2}}]}, Whole, "x")
    assert whole.model == "manual" and whole.grade == 1
    assert whole.trial[0].start.heading == 2.0 and not whole.trial[0].held


@pytest.mark.parametrize(
    ("table", "line"),
    [
        ({"modell": 1}, "unknown key 'modell'; did you mean 'model'"),
        (
            {"trial": [{"file": "a", "hel": 1}]},
            "unknown key 'hel' in a [[trial]]; did you mean 'held'",
        ),
        ({"trial": [{"model": "m"}]}, "key 'model' in a [[trial]] stands at the top of the file"),
        (
            {"trial": [{"file": "a", "start": {"heding": 1}}]},
            "unknown key 'heding' in start; did you mean 'heading'",
        ),
        ({"model": 3}, "model is 3; it must be text"),
        ({"grade": [1]}, "grade is [1]; it must be a number or text"),
        ({"noise": 3}, "noise is 3; it must be a table"),
        ({"noise": {"a": 1.0, "b": 0}}, "noise of b is 0; it must be positive"),
        ({"noise": {"a": 1.0, "b": "x"}}, "noise of b is 'x'; it must be a number"),
        ({"trial": {"file": "a"}}, "trial is {'file': 'a'}; it must be [[trial]]"),
        ({"trial": [{"file": "a"}, "b"]}, "a trial is 'b'; it must be a table"),
        ({"trial": [{"file": "a"}, {"file": 3}]}, "file is 3; it must be text"),
        ({"trial": [{"file": "a", "held": 1}]}, "held is 1; it must be true or false"),
        (
            {"trial": [{"file": "a", "start": {"heading": "east"}}]},
            "start heading is 'east'; it must be a number",
        ),
        (
            {"trial": [{"file": "a", "start": {"position": [1]}}]},
            "start position is [1]; it must be a list of 2 numbers",
        ),
        ({"trial": [{}]}, "a trial has no 'file'"),
    ],
)
def test_what_is_wrong_is_one_line(table, line):
    with pytest.raises(MjchairError) as error:
        checked(table, Whole, "a.toml")
    said = str(error.value)
    assert said.startswith("a.toml: ") and "\n" not in said
    assert line in said


def test_a_file_that_is_no_toml_is_one_line(tmp_path):
    path = tmp_path / "a.toml"
    path.write_text("model = ")
    with pytest.raises(MjchairError, match=r"a\.toml: not TOML: Invalid value") as error:
        read_toml(path, Whole)
    assert "\n" not in str(error.value)
    path.write_bytes(b"\x93NUMPY")
    with pytest.raises(MjchairError, match=r"a\.toml: not TOML: it is not UTF-8 text$"):
        read_toml(path, Whole)
