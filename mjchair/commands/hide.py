"""`mjchair hide`: a practice study with an effect hidden in it, the answer sealed beside it.

In: an effect, its values, and a chair. Out: a study folder of simulated runs, with the sealed
answer; or, with --reveal, the answer of such a folder on standard output.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from mjchair.commands import options
from mjchair.errors import MjchairError, nearest

if TYPE_CHECKING:
    from mjchair.effects.effect import Effect


def add(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand."""
    parser = subparsers.add_parser(
        "hide",
        help="make a practice study with an effect hidden in it",
        description="Simulate runs with an effect hidden in them and write them as a study, the "
        "answer sealed beside it. `mjchair hide --reveal STUDY` opens the seal.",
    )
    parser.add_argument(
        "effect",
        metavar="EFFECT",
        nargs="?",
        help="such as toe, sensor_bias:imu_gyro.z, or a file of your own",
    )
    parser.add_argument("--reveal", metavar="STUDY", help="print a sealed answer instead")
    parser.add_argument(
        "--model", default="manual", help="a shipped chair or an MJCF file; default: %(default)s"
    )
    parser.add_argument(
        "--set",
        metavar="NAME=VALUE",
        action="append",
        default=[],
        help="a parameter of the effect, as coefficient=0.004, or of the chair, as "
        "occupant_mass=82; may be given again",
    )
    parser.add_argument("--seed", type=int, default=0, help="default: %(default)s")
    options.add_output(parser, "out/study")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the command; returns the exit code."""
    from mjchair.practice import hide, reveal
    from mjchair.storage import check_vacant, output_folder, write_whole

    if args.reveal:
        print(json.dumps(reveal(Path(args.reveal))))
        return 0
    if not args.effect:
        raise MjchairError("no effect to hide; name one, such as rolling_resistance")
    effect = _effect(args.effect)
    values, chair = _values(effect, options.assignments(args.set))
    check_vacant(args.out, args.force)
    files = hide(effect, values or None, args.seed, args.model, chair)
    folder = output_folder(args.out, args.force)
    for file, content in files.items():
        write_whole(folder / file, content)
    print(f"wrote {folder}/study.toml and its tables", file=sys.stderr)
    return 0


def _effect(text: str) -> Effect:
    """The effect of a name, with its channel behind a colon, or of a Python file."""
    from mjchair.effects import user_file
    from mjchair.effects.library import find

    if text.endswith(".py"):
        return user_file.from_file(text)
    name, _, channel = text.partition(":")
    return find(name, channel or None)


def _values(effect: Effect, given: dict[str, str]) -> tuple[dict[str, float], dict[str, str]]:
    """What `--set` gives the effect, in SI, and what it gives the chair.

    Raises:
      MjchairError: a name that neither has, or a value that is no number.
    """
    from mjchair.model.parameters import NAMES
    from mjchair.units import quantity

    units = {p.name: p.unit for p in effect.parameters}
    values: dict[str, float] = {}
    chair: dict[str, str] = {}
    for name, text in given.items():
        if name in units:
            values[name] = quantity(text, units[name], name)
        elif name in NAMES:
            chair[name] = text
        else:
            raise MjchairError(
                f"neither {effect.name} nor the chair has a parameter {name!r}"
                + nearest(name, (*units, *NAMES))
            )
    return values, chair
