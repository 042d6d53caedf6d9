"""Completion of commands and names in the shell, by argcomplete: for bash and zsh.

In: the parser of the command line. Out: where a shell asks for completions, and only there, they
are answered: commands, options, shipped chairs, scenes and tires, effects, tests, chair parameters,
and files. A user switches it on with `eval "$(register-python-argcomplete mjchair)"`.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable, Iterable, Mapping
from typing import Any

ASKED = "_ARGCOMPLETE"  # the variable by which argcomplete is called
SWITCH = 'eval "$(register-python-argcomplete mjchair)"'

Names = Callable[[], Iterable[str]]


def answer(parser: argparse.ArgumentParser) -> None:
    """Answer a shell that asks, and leave; else do nothing."""
    if ASKED not in os.environ:
        return
    import argcomplete

    for command, sub in commands(parser).items():
        for action in sub._actions:
            names = NAMES.get((command, action.dest)) or NAMES.get(("", action.dest))
            if names is not None:
                action.completer = _completer(names)  # type: ignore[attr-defined]
    argcomplete.autocomplete(parser, always_complete_options=False)


def commands(parser: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    """The parsers of the subcommands, by name."""
    actions = [a for a in parser._actions if isinstance(a, argparse._SubParsersAction)]
    return dict(actions[0].choices) if actions else {}


def _completer(names: Names) -> Callable[..., list[str]]:
    """Names that begin so, and files where there are none."""

    def complete(prefix: str, **_: Any) -> list[str]:
        from argcomplete.completers import FilesCompleter

        fitting = [name for name in names() if name.startswith(prefix)]
        return fitting or list(FilesCompleter()(prefix))

    return complete


def _chairs() -> Iterable[str]:
    from mjchair.model import assets

    return assets.chairs()


def _scenes() -> Iterable[str]:
    from mjchair.model import assets

    return assets.scenes()


def _tires() -> Iterable[str]:
    from mjchair.model import assets

    return assets.tires()


def _shipped() -> Iterable[str]:
    return [*_chairs(), *_scenes(), *_tires(), "parameters"]


def _views() -> Iterable[str]:
    from mjchair.report.camera import VIEWS

    return VIEWS


def _effects() -> Iterable[str]:
    from mjchair.effects.library import names

    return names()


def _tests() -> Iterable[str]:
    from mjchair.testlab.laboratory import TESTS

    return TESTS


def _parameters() -> Iterable[str]:
    from dataclasses import fields

    from mjchair.model.parameters import ChairParameters

    return [f"{field.name}=" for field in fields(ChairParameters)]


# (command, or "" for all; name of the argument) -> what it may be called
NAMES: Mapping[tuple[str, str], Names] = {
    ("", "model"): _chairs,
    ("rider", "chair"): _chairs,
    ("", "scene"): _scenes,
    ("", "tire"): _tires,
    ("rig", "against"): _tires,
    ("", "set"): _parameters,
    ("", "view"): _views,
    ("", "rider"): lambda: ("rigid", "moving"),
    ("", "tilt"): lambda: ("floor", "gravity"),
    ("models", "name"): _shipped,
    ("hide", "effect"): _effects,
    ("test", "tests"): _tests,
}
