"""The reference pages of the documentation, made from the code whenever the site is made.

In: the package. Out: pages of the site, which exist nowhere else and so are never older than the
code: every public name, every option of the command line, every effect, every channel of every
shipped chair. mkdocs calls `on_files` (mkdocs.yml, hooks).
"""

from __future__ import annotations

import argparse
import inspect
import re
from collections.abc import Iterable
from pathlib import Path
from types import ModuleType
from typing import Any

import mjchair
from mjchair import cli
from mjchair.commands import completion
from mjchair.effects.effect import Effect
from mjchair.effects.library import MECHANICAL, SENSORS, find
from mjchair.model import assets
from mjchair.model.spec import drive_file
from mjchair.simulation.channels import channels, control_unit
from mjchair.simulation.inputs import drivable

ROOT = Path(__file__).parents[1]
EXAMPLE = "imu_gyro.z"  # a channel, for the effects of sensors
# public modules beyond the names of `mjchair` itself
MODULES = (
    "mjchair.report.film",
    "mjchair.report.replay.page",
    "mjchair.simulation.from_states",
    "mjchair.measurement.trial",
    "mjchair.measurement.smartwheel",
    "mjchair.measurement.outcomes",
    "mjchair.motion.capture",
    "mjchair.rider.stroke",
)


def pages() -> dict[str, str]:
    """Path below docs -> Markdown."""
    return {
        "reference/names.md": names_page(),
        "reference/commands.md": commands_page(),
        "reference/effects.md": effects_page(),
        "reference/channels.md": channels_page(),
    }


def names_page() -> str:
    """Every name that `mjchair` exports, and those of its public modules."""
    told = ["# Public names\n", "Units are SI; shapes and errors stand with each name.\n"]
    for name in mjchair.__all__:
        value = getattr(mjchair, name)
        if name.startswith("__"):
            continue
        if isinstance(value, ModuleType):
            told += [f"## mjchair.{name}\n", _whole(value, f"mjchair.{name}")]
        elif not value.__module__.startswith("mjchair"):  # another name for a type
            told += [f"## mjchair.{name}\n", f"The type `{value}`.\n"]
        else:
            told += [f"::: {value.__module__}.{value.__qualname__}", _shown_as(name)]
    for module in MODULES:
        told += [f"## {module}\n", f"::: {module}\n    options:\n      show_root_heading: false\n"]
    return "\n".join(told)


def _shown_as(name: str) -> str:
    named = f"      heading: mjchair.{name}\n      toc_label: mjchair.{name}\n"
    return f"    options:\n      heading_level: 2\n{named}"


def _whole(module: ModuleType, path: str) -> str:
    """What a module says of itself, and its public names."""
    told = [inspect.cleandoc(module.__doc__ or "") + "\n"]
    for name in getattr(module, "__all__", None) or _own(module):
        value = getattr(module, name)
        known = inspect.isclass(value) or inspect.isfunction(value)
        if known and value.__module__.startswith("mjchair"):
            told.append(
                f"::: {value.__module__}.{value.__qualname__}\n"
                "    options:\n      heading_level: 3\n"
                f"      heading: {path}.{name}\n      toc_label: {path}.{name}\n"
            )
    return "\n".join(told)


def _own(module: ModuleType) -> list[str]:
    """Public functions and classes that a module shows, its package's own."""
    return [
        name
        for name, value in vars(module).items()
        if not name.startswith("_")
        and (inspect.isclass(value) or inspect.isfunction(value))
        and value.__module__.startswith(module.__name__)
    ]


def commands_page() -> str:
    """Every command with every option."""
    told = ["# Command line\n"]
    told.append(
        "Exit code 0 on success, 2 on bad input with one line on standard error. `--traceback` "
        "before the command shows where an error comes from, `--version` the version. "
        '`eval "$(register-python-argcomplete mjchair)"` completes commands and names in bash '
        "and zsh.\n"
    )
    for name, parser in completion.commands(cli.parser()).items():
        told += [f"## mjchair {name}\n", f"{_text(parser.description)}\n"]
        told += ["| option | value | what it does |", "|---|---|---|"]
        told += [_option(a) for a in parser._actions if a.dest != "help"]
        told.append("")
    return "\n".join(told)


def _option(action: argparse.Action) -> str:
    flags = ", ".join(f"`{flag}`" for flag in action.option_strings) or f"`{action.dest}`"
    value = action.metavar or ("" if action.nargs == 0 else action.dest.upper())
    if action.choices:
        value = " or ".join(map(str, action.choices))
    told = (action.help or "") % {"default": action.default, "prog": "mjchair"}
    return f"| {flags} | {_cell(str(value))} | {_cell(told)} |"


def effects_page() -> str:
    """Every effect: what it looks like, its parameters, its source."""
    told = [
        "# Effects\n",
        "`mjchair hide NAME` puts one into a chair, `mjchair diagnose` looks for all. An effect of "
        "a sensor is named with its channel, as `sensor_bias:imu_gyro.z`. "
        "The numbers of the sensors' effects are those for `imu_gyro.z`. The second form of "
        "`wheel_radius` is that of a frame that twists, so that all wheels keep their loads. "
        "`weak_motor`, `low_battery` and `dragging_brake` are of chairs with a drive.\n",
    ]
    for effect in (*MECHANICAL, *(find(name, EXAMPLE) for name in SENSORS)):
        known = f"## {effect.name}\n" in told
        told.append(_form(effect) if known else f"## {effect.name}\n")
        told.append(f"{_text(effect.signature)}.\n")
        told += [
            "| parameter | unit | usual size | from | to | none at |",
            "|---|---|---|---|---|---|",
        ]
        told += [
            f"| `{p.name}` | {p.unit} | {p.typical:g} | {p.low:g} | {p.high:g} | {p.neutral:g} |"
            for p in effect.parameters
        ]
        told.append(f"\nSource: {_text(effect.source)}.\n")
    return "\n".join(told)


def _form(effect: Effect) -> str:
    """Heading of another form of an effect."""
    if effect.measured is None:
        return "### Another form of the same effect\n"
    if effect.measured.startswith("stroke_"):
        return "### In step with the strokes, where nobody measured the motion\n"
    return f"### Where `{effect.measured}` is a column of the tables\n"


def channels_page() -> str:
    """Every channel and every input of every shipped chair."""
    told = [
        "# Channels\n",
        "Columns of tables, and names of a recording. SI throughout. A tire's `Fx`, `Fy`, `Fz` "
        "and `Mz` act on the wheel, forward, to the left, upward and about the ground's normal; "
        "`kappa` is its slip along, `tan_alpha` across, `gamma` its camber.\n",
    ]
    for chair, file in assets.chairs().items():
        options = [("rider rigid", {}), ("rider moving", {"rider": "moving"})]
        if drive_file(file).is_file():
            options.append(("with its drive", {"drive": "normal"}))
        for words, chosen in options:
            model = mjchair.load_spec(chair, **chosen).compile()
            sensed = [(c.name, c.unit) for c in channels(model)]
            driven = [(n, control_unit(model, model.actuator(n).id)) for n in drivable(model)]
            told += [
                f"## {chair}, {words}\n",
                *_table("input", driven),
                *_table("channel", sensed),
            ]
    return "\n".join(told)


def _table(head: str, rows: Iterable[tuple[str, str]]) -> list[str]:
    return [f"| {head} | unit |", "|---|---|", *(f"| `{n}` | {u} |" for n, u in rows), ""]


def _text(text: str | None) -> str:
    """A sentence of the code as Markdown: nothing in it is a tag or an emphasis."""
    plain = re.sub(r"\s+", " ", text or "").strip().rstrip(".")
    return plain.replace("<", "&lt;").replace("*", r"\*")


def _cell(text: str) -> str:
    return _text(text).replace("|", r"\|")


def on_files(files: Any, config: Any) -> Any:
    """Put the pages among the files of the site."""
    from mkdocs.structure.files import File

    for path, content in pages().items():
        files.append(File.generated(config, path, content=content))
    return files


def on_page_markdown(markdown: str, page: Any, config: Any, files: Any) -> str:
    """Links to files of the repository outside docs are shown as their paths."""
    return re.sub(r"\[([^\]]+)\]\(\.\./(?!\w+\.md)([^)]+)\)", r"\1 (`\2`)", markdown)
