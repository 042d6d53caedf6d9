"""The command line: `mjchair <command>`; exit code 0, or 2 with one line on standard error."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from typing import NoReturn

from mjchair.commands import diagnose, fit_tire, hide, models, render, rig, simulate, sweep, view
from mjchair.errors import MjchairError

COMMANDS = (simulate, render, view, models, rig, fit_tire, sweep, diagnose, hide)
BAD_INPUT = 2
INTERRUPTED = 130  # as shells have it: 128 + SIGINT


class _Parser(argparse.ArgumentParser):
    """A parser whose errors are one line, without the usage."""

    def error(self, message: str) -> NoReturn:
        self.exit(BAD_INPUT, f"{self.prog}: {message}; see {self.prog} --help\n")


def parser() -> argparse.ArgumentParser:
    """The parser with every subcommand."""
    top = _Parser(
        prog="mjchair",
        description="A wheelchair simulator on MuJoCo with Magic Formula tires.",
    )
    top.add_argument("--traceback", action="store_true", help="show where an error comes from")
    subparsers = top.add_subparsers(dest="command", metavar="command", required=True)
    for command in COMMANDS:
        command.add(subparsers)
    return top


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; returns the exit code."""
    args = parser().parse_args(arguments)
    try:
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


def _line(error: Exception) -> str:
    """What went wrong, on one line."""
    text = " ".join(str(error).split())
    if isinstance(error, MjchairError):
        return text
    if isinstance(error, OSError):
        return f"{error.filename}: {error.strerror}" if error.filename else text
    return f"{type(error).__name__}: {text}; this is a fault of mjchair, see it with --traceback"
