"""TOML files checked against a schema: what is wrong is one line, with the nearest name.

In: a file, and a `msgspec.Struct` that says what may stand in it. Out: that struct, filled. Structs
are made with ``forbid_unknown_fields=True``, so that a misspelt key is refused.
"""

from __future__ import annotations

import re
import tomllib
import typing
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from mjchair.errors import MjchairError, nearest

Schema = TypeVar("Schema", bound=msgspec.Struct)
WORDS = {
    "str": "text",
    "float": "a number",
    "int": "a whole number",
    "bool": "true or false",
    "array": "a list",
    "object": "a table",
}
LIMITS = {" of length": " of {} numbers", " >=": " of at least {}", " <=": " of at most {}"}
_LIMIT = re.compile(rf"({'|'.join(LIMITS)}) (-?\d+(?:\.[1-9]\d*)?)")
_PLACE = re.compile(r" - at `\$(?P<path>.*)`$")
_STEP = re.compile(r"\.(?P<field>\w+)|\[(?P<index>\d+|\.\.\.)\]")
_EXPECTED = re.compile(r"^Expected `(?P<types>[^`]*)`(?P<rest>.*)")
_MISSING = re.compile(r"^Object missing required field `(?P<name>[^`]*)`")
_UNKNOWN = re.compile(r"^Object contains unknown field `(?P<name>[^`]*)`")


def read_toml(path: Path, schema: type[Schema]) -> Schema:
    """The contents of a TOML file.

    Raises:
      MjchairError: the file cannot be read, is no TOML, or not of the schema; one line with the
        value, the rule and the nearest name.
    """
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise MjchairError(f"cannot read {path}: {error.strerror}; give a TOML file") from None
    except UnicodeDecodeError:
        raise MjchairError(f"{path}: not TOML: it is not UTF-8 text") from None
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise MjchairError(f"{path}: not TOML: {str(error).splitlines()[0]}") from None
    return checked(table, schema, str(path))


def checked(table: Mapping[str, Any], schema: type[Schema], source: str = "") -> Schema:
    """A table as a struct of the schema; a message begins with the source, if there is one.

    Raises:
      MjchairError: it is not of the schema; see `read_toml`.
    """
    try:
        return msgspec.convert(table, schema)
    except msgspec.ValidationError as error:
        said = str(error)
    place = _PLACE.search(said)
    steps = list(_steps(place["path"])) if place else []
    unknown, missing = _UNKNOWN.match(said), _MISSING.match(said)
    if missing:
        line = f"{_name(steps) or 'the file'} has no {missing['name']!r}"
    elif unknown:
        line = _unknown(unknown["name"], schema, steps)
    else:
        line = _wrong_value(table, schema, steps, said)
    raise MjchairError(f"{source}: {line}" if source else line)


def _steps(path: str) -> Iterator[str | int | None]:
    """Fields, indices, and None for a key that msgspec does not tell."""
    for step in _STEP.finditer(path):
        if step["field"] is not None:
            yield step["field"]
        else:
            yield None if step["index"] == "..." else int(step["index"])


def _unknown(key: str, schema: type[Schema], steps: list[str | int | None]) -> str:
    """A line on a key that may not stand where it does."""
    inside = ""
    if steps:
        inside = f" in {steps[-1]}" if isinstance(steps[-1], str) else f" in a [[{steps[-2]}]]"
    if steps and key in _fields(schema, []):
        return f"key {key!r}{inside} stands at the top of the file, before the first table"
    return f"unknown key {key!r}{inside}" + nearest(key, _fields(schema, steps))


def _wrong_value(
    table: Mapping[str, Any], schema: type[Schema], steps: list[str | int | None], said: str
) -> str:
    """A line on a value: its name, what it is, and what it must be."""
    value: Any = table
    keys: list[str | int] = []
    for k, step in enumerate(steps):
        keys.append(_culprit(table, schema, steps[:k], value) if step is None else step)
        value = value[keys[-1]]
    name = _name(steps) + (f" of {keys[steps.index(None)]}" if None in steps else "")
    choice = _choice(schema, steps)
    if choice and isinstance(value, str):
        return f"{name} is {value!r}" + nearest(value, choice)
    return f"{name} is {value!r}; it must be {_rule(said, name)}"


def _name(steps: list[str | int | None]) -> str:
    """A place as a person calls it: its fields from the last list on, "a trial" for an entry."""
    indices = [k for k, step in enumerate(steps) if isinstance(step, int)]
    after = steps[indices[-1] + 1 :] if indices else steps
    if indices and not after:
        return f"a {steps[indices[-1] - 1]}"
    return " ".join(step for step in after if isinstance(step, str))


def _rule(said: str, name: str) -> str:
    """What msgspec expected, in words."""
    expected = _EXPECTED.match(said)
    if expected is None:
        return said
    rest = expected["rest"].split(" - at ")[0]
    if rest.startswith(" > 0"):
        return "positive"
    if expected["types"] == "array" and "got `object`" in rest:
        return f"[[{name}]], with two brackets"
    words = [WORDS.get(t, t) for t in expected["types"].split(" | ") if t != "null"]
    limit = _LIMIT.match(rest)
    return " or ".join(words) + (LIMITS[limit[1]].format(limit[2]) if limit else "")


def _culprit(
    table: Mapping[str, Any], schema: type[Schema], steps: list[str | int | None], inside: Any
) -> str:
    """The key of a table of free keys whose value is refused."""
    for key, value in inside.items():
        try:
            msgspec.convert(_replaced(table, steps, {key: value}), schema)
        except msgspec.ValidationError:
            return str(key)
    return str(next(iter(inside)))


def _replaced(table: Any, steps: list[str | int | None], value: Any) -> Any:
    """The table with what stands at the steps replaced."""
    if not steps:
        return value
    copied: Any = dict(table) if isinstance(table, Mapping) else list(table)
    copied[steps[0]] = _replaced(table[steps[0]], steps[1:], value)
    return copied


def _fields(schema: type[msgspec.Struct], steps: list[str | int | None]) -> list[str]:
    """The keys that may stand at a place."""
    here = _struct(_annotation(schema, steps)) or schema
    return [f.encode_name for f in msgspec.structs.fields(here)]


def _choice(schema: type[msgspec.Struct], steps: list[str | int | None]) -> list[str]:
    """The values of a Literal at a place; none where any value may stand."""
    kind = _annotation(schema, steps)
    parts = (kind, *typing.get_args(kind))
    return [
        str(value)
        for part in parts
        if typing.get_origin(part) is typing.Literal
        for value in typing.get_args(part)
    ]


def _annotation(schema: type[msgspec.Struct], steps: list[str | int | None]) -> Any:
    """The type that the schema gives a place."""
    kind: Any = schema
    for step in steps:
        here = _struct(kind)
        if isinstance(step, str) and here is not None:
            kind = {f.encode_name: f.type for f in msgspec.structs.fields(here)}[step]
    return kind


def _struct(kind: Any) -> type[msgspec.Struct] | None:
    """The struct in an annotation such as ``list[Trial]`` or ``Trial | None``."""
    if isinstance(kind, type) and issubclass(kind, msgspec.Struct):
        return kind
    inner = (_struct(part) for part in typing.get_args(kind))
    return next((s for s in inner if s is not None), None)
