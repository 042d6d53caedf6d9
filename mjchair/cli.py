"""The command line: `mjchair <command>`.

In: arguments. Out: an exit code, 0, or 2 with one line on standard error. What is only worth
knowing is a line there as well, and no error.
"""

from __future__ import annotations

import argparse
import os
import re
import sys
import warnings
from collections.abc import Callable, Sequence
from importlib.metadata import version
from typing import Any, NoReturn

from mjchair.commands import (
    completion,
    diagnose,
    fit_tire,
    gather,
    hide,
    models,
    outcomes,
    render,
    replay,
    rider,
    rig,
    simulate,
    sweep,
    test,
    view,
)
from mjchair.errors import MjchairError, MjchairNote
from mjchair.model import assets

COMMANDS = (
    simulate,
    render,
    replay,
    view,
    models,
    rig,
    fit_tire,
    sweep,
    test,
    gather,
    rider,
    outcomes,
    diagnose,
    hide,
)
FIRST_STEPS = f"""mjchair: a wheelchair simulator on MuJoCo with Magic Formula tires.

Drive a chair and look at it:
  mjchair simulate --push 12,8 --duration 6 --out out/turn
  mjchair replay out/turn --out out/turn.html      open this file in a browser

Then:
  mjchair models                the chairs, scenes and tires that ship, with their sources
  mjchair outcomes FILE         push-rim recordings, stroke by stroke
  mjchair gather FOLDER         make a study of your SmartWheel, IMU and other files
  mjchair diagnose STUDY        what your measurements show that the model does not
  mjchair hide toe              make a practice study with an effect hidden in it
  mjchair test static-stability the tests that wheelchairs are sold by (ISO 7176)
  mjchair sweep STUDY.toml      compare wheels, casters, axle positions

All commands: mjchair --help; options of one: mjchair simulate --help.
Completion in bash and zsh: {completion.SWITCH}"""
BAD_INPUT = 2
INTERRUPTED = 130  # as shells have it: 128 + SIGINT


class _Parser(argparse.ArgumentParser):
    """A parser whose errors are one line, without the usage; -6,-6 is a value and no option."""

    def __init__(self, *args: Any, **named: Any) -> None:
        """Make it; `named` as for ArgumentParser."""
        super().__init__(*args, **named)
        # argparse takes -6 for a value and -6,-6 for an option; it has no public switch for that
        self._negative_number_matcher = re.compile(r"^-(\d|\.\d)")

    def error(self, message: str) -> NoReturn:
        stray = re.match(r"unrecognized arguments: (?!-)(\S+)", message)
        if stray is not None and stray[1] in assets.chairs():
            message += f"; a chair stands behind its option, --model {stray[1]}"
        self.exit(BAD_INPUT, f"{self.prog}: {message}; see {self.prog} --help\n")


def parser() -> argparse.ArgumentParser:
    """The parser with every subcommand."""
    top = _Parser(
        prog="mjchair",
        description="A wheelchair simulator on MuJoCo with Magic Formula tires.",
    )
    top.add_argument("--version", action="version", version=f"mjchair {version('mjchair')}")
    top.add_argument("--traceback", action="store_true", help="show where an error comes from")
    subparsers = top.add_subparsers(dest="command", metavar="command")
    for command in COMMANDS:
        command.add(subparsers)
    return top


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; returns the exit code."""
    top = parser()
    completion.answer(top)
    args = top.parse_args(arguments)
    if args.command is None:
        print(FIRST_STEPS)
        return 0
    try:
        with warnings.catch_warnings():
            warnings.showwarning = _show(warnings.showwarning)
            warnings.simplefilter("always", MjchairNote)
            code = int(args.run(args))
        sys.stdout.flush()
        return code
    except KeyboardInterrupt:
        print("mjchair: interrupted", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:  # the reader of standard output has gone, as `| head` does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except Exception as error:
        if args.traceback:
            raise
        print(f"mjchair: {_line(error)}", file=sys.stderr)
        return BAD_INPUT


def _show(other: Callable[..., None]) -> Callable[..., None]:
    """What shows a warning: a note as one line of the command, the rest as ever."""

    def show(message: Warning | str, category: type[Warning], *place: Any, **more: Any) -> None:
        if issubclass(category, MjchairNote):
            print(f"mjchair: note: {message}", file=sys.stderr)
        else:
            other(message, category, *place, **more)

    return show


def _line(error: Exception) -> str:
    """What went wrong, on one line."""
    text = " ".join(str(error).split())
    if isinstance(error, MjchairError):
        return text
    if isinstance(error, OSError):
        return f"{error.filename}: {error.strerror}" if error.filename else text
    fault = "this is a fault of mjchair, see it with mjchair --traceback ..."
    return f"{type(error).__name__}: {text}; {fault}"
