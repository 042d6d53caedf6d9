"""Options that several subcommands share, the types of their values, and the chair they ask for.

In: a parser, or the arguments that it read. Out: the parser with the options, or an MjSpec.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from mjchair.errors import MjchairError

if TYPE_CHECKING:
    import mujoco

    from mjchair.drive.quantities import Drive
    from mjchair.model.parameters import ChairParameters


def add_output(parser: argparse.ArgumentParser, default: str) -> None:
    """Where a command writes: `--out DIR`, and `--force` to overwrite."""
    parser.add_argument("--out", metavar="DIR", default=default, help="default: %(default)s")
    parser.add_argument("--force", action="store_true", help="write into a folder that has files")


def add_model(parser: argparse.ArgumentParser) -> None:
    """Which chair, where, on what, with whom: `--model`, `--scene`, ..., `--rider`."""
    parser.add_argument(
        "--model", default="manual", help="a shipped chair or an MJCF file; default: %(default)s"
    )
    parser.add_argument(
        "--scene", default="flat", help="a shipped scene or an MJCF file; default: %(default)s"
    )
    parser.add_argument(
        "--grade", type=grade, help="of ramp or cross_slope, rise over run: 0.08, 8%% or 1:12"
    )
    parser.add_argument(
        "--tilt",
        default="floor",
        help="what makes the grade: floor (default) or gravity",
    )
    parser.add_argument(
        "--tire",
        action="append",
        metavar="TIRE",
        help="a shipped tire or a file for all wheels, or WHEEL=TIRE for a wheel, wheels or "
        "casters; may be given again",
    )
    parser.add_argument(
        "--step", type=length, metavar="M", help="height of scene kerb or threshold, as 20mm"
    )
    parser.add_argument(
        "--heights",
        metavar="FILE",
        help="of scene hfield, m: a .csv or .npy of rows along y, or uneven:rms=5mm,seed=1",
    )
    parser.add_argument(
        "--rider",
        default="rigid",
        help="rigid (default), or moving: trunk, head and arms on joints that inputs drive",
    )
    add_drive(parser)
    add_parameters(parser)


def add_drive(parser: argparse.ArgumentParser) -> None:
    """Which drive a power chair has: `--profile NAME` and `--drive FILE`."""
    parser.add_argument(
        "--profile",
        metavar="NAME",
        help="of a power chair's controller, as indoor or normal: the chair has its drive then, "
        "and takes joystick_x and joystick_y; tests take normal by themselves",
    )
    parser.add_argument(
        "--drive", metavar="FILE", help="a drive's TOML in place of the chair's own"
    )


def add_parameters(parser: argparse.ArgumentParser) -> None:
    """A designer's changes to the chair: `--set NAME=VALUE`, again and again."""
    parser.add_argument(
        "--set",
        metavar="NAME=VALUE",
        action="append",
        default=[],
        help="a chair parameter, as occupant_mass=82 or camber=3deg; may be given again; "
        "`mjchair models parameters` lists them",
    )


def assignments(given: Iterable[str]) -> dict[str, str]:
    """Names and values from the texts of `--set`.

    Raises:
      MjchairError: a text without "=", or a name twice.
    """
    chosen: dict[str, str] = {}
    for text in given:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not equals or not name or not value:
            raise MjchairError(f"--set {text!r} is not NAME=VALUE, such as camber=3deg")
        if name in chosen:
            raise MjchairError(f"--set gives {name} twice, {chosen[name]} and {value}; keep one")
        chosen[name] = value
    return chosen


def parameters(args: argparse.Namespace) -> ChairParameters | None:
    """The chair parameters that `--set` asks for; None where it is not given.

    Raises:
      MjchairError: no NAME=VALUE, an unknown name, or a value out of its range.
    """
    from mjchair.model.parameters import ChairParameters

    chosen = assignments(args.set)
    return ChairParameters.of(chosen) if chosen else None


def drive(args: argparse.Namespace) -> str | Drive | None:
    """The `drive` of load_spec from `--profile` and `--drive`; None where neither is given.

    Raises:
      MjchairError: as mjchair.drive.files.read_drive does.
    """
    from mjchair.drive.files import read_drive

    if args.drive:
        return read_drive(args.drive, args.profile)
    return args.profile  # type: ignore[no-any-return]


def chair(args: argparse.Namespace, **more: Any) -> mujoco.MjSpec:
    """The chair in its scene that the options of `add_model` ask for.

    Args:
      args: with those options. more: further arguments of load_spec.

    Raises:
      MjchairError: as load_spec does.
    """
    from mjchair.model.spec import load_spec

    if "drive" not in more:
        more["drive"] = drive(args)
    return load_spec(
        args.model,
        args.scene,
        tires(args.tire),
        grade=args.grade,
        tilt=args.tilt,
        step=args.step,
        heights=args.heights,
        parameters=parameters(args),
        rider=args.rider,
        **more,
    )


def processors(text: str) -> int:
    """How many threads or processes, as the type of an option; 0: one for each processor."""
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(
            f"{text!r} is no number of processors; give 1 or more, or 0 for all of them"
        )
    return int(text)


def number(text: str) -> float:
    """A finite number, as the type of an option."""
    try:
        return part_of(text, None)
    except MjchairError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def positive(text: str) -> float:
    """A number above 0, as the type of an option."""
    value = number(text)
    if value <= 0.0:
        raise argparse.ArgumentTypeError(f"{text!r} is no number above 0")
    return value


def part_of(text: str, option: str | None) -> float:
    """A finite number that is a part of what an option was given, as 0.25 in imu.csv=0.25.

    Args:
      text: the number. option: what a message begins with, as "--offset imu.csv=abc"; or None.

    Raises:
      MjchairError: no finite number.
    """
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise MjchairError(f"{option + ': ' if option else ''}{text!r} is not a finite number")
    return value


def length(text: str) -> float:
    """A length in m, from 0.02, 20mm or 2 cm."""
    from mjchair.units import quantity

    try:
        return quantity(text, "m", "the value")
    except MjchairError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def pair(text: str) -> tuple[float, float]:
    """Two numbers with a comma between them."""
    parts = text.split(",")
    if len(parts) != 2:
        raise argparse.ArgumentTypeError(f"{text!r} is not two numbers such as 8,6")
    return number(parts[0]), number(parts[1])


def grade(text: str) -> float:
    """A grade, rise over run, from 0.08, 8% or 1:12."""
    from mjchair import units

    try:
        value = units.grade(text)
    except MjchairError as error:
        raise argparse.ArgumentTypeError(str(error)) from None
    return number(str(value))


def size(text: str) -> tuple[int, int]:
    """Width and height in pixels, from 960x540."""
    try:
        width, height = (int(part) for part in text.split("x"))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a size such as 960x540") from None
    return width, height


def tires(given: list[str] | None) -> str | dict[str, str] | None:
    """The `tire` of load_spec from the values of `--tire`.

    Raises:
      MjchairError: a tire for all wheels beside others.
    """
    if not given:
        return None
    if len(given) == 1 and "=" not in given[0]:
        return given[0]
    chosen = {}
    for text in given:
        wheel, sign, name = text.partition("=")
        if not sign:
            raise MjchairError(
                f"--tire {text} is for all wheels; give it alone, or as wheels={text}"
            )
        chosen[wheel] = name
    return chosen
