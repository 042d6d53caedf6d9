"""`mjchair hide`: a practice study with an effect hidden in it, the answer sealed beside it."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from mjchair.commands import options
from mjchair.errors import MjchairError


def add(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand."""
    parser = subparsers.add_parser(
        "hide",
        help="make a practice study with an effect hidden in it",
        description="Simulate runs with an effect hidden in them and write them as a study, the "
        "answer sealed beside it. `mjchair hide --reveal STUDY` opens the seal.",
    )
    parser.add_argument(
        "effect", metavar="EFFECT", nargs="?", help="such as toe, or sensor_bias:imu_gyro.z"
    )
    parser.add_argument("--reveal", metavar="STUDY", help="print a sealed answer instead")
    parser.add_argument("--set", metavar="NAME=VALUE", action="append", default=[])
    parser.add_argument("--seed", type=int, default=0, help="default: %(default)s")
    options.add_output(parser, "out/study")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the command; returns the exit code."""
    from mjchair.diagnosis.practice import hide, reveal
    from mjchair.effects.library import find
    from mjchair.storage import output_folder

    if args.reveal:
        print(json.dumps(reveal(Path(args.reveal))))
        return 0
    if not args.effect:
        raise MjchairError("no effect to hide; name one, such as rolling_resistance")
    name, _, channel = args.effect.partition(":")
    effect = find(name, channel or None)
    values = dict(_value(text) for text in args.set)
    folder = output_folder(args.out, args.force)
    try:
        hide(effect, folder, values or None, args.seed)
    except MjchairError:
        if not any(folder.iterdir()):
            folder.rmdir()
        raise
    print(f"wrote {folder}/study.toml and its tables", file=sys.stderr)
    return 0


def _value(text: str) -> tuple[str, float]:
    name, equals, value = text.partition("=")
    try:
        return name, float(value) if equals else float("nan")
    except ValueError:
        raise MjchairError(f"--set {text!r} is not NAME=VALUE, such as coefficient=0.004") from None
