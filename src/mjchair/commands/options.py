"""Options that several subcommands share, and the types of their values."""

from __future__ import annotations

import argparse
import math

from mjchair.errors import MjchairError


def add_output(parser: argparse.ArgumentParser, default: str) -> None:
    """Where a command writes: `--out DIR`, and `--force` to overwrite."""
    parser.add_argument("--out", metavar="DIR", default=default, help="default: %(default)s")
    parser.add_argument("--force", action="store_true", help="write into a folder that has files")


def add_model(parser: argparse.ArgumentParser) -> None:
    """Which chair, where, on what: `--model`, `--scene`, `--grade`, `--tilt`, `--tire`."""
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


def number(text: str) -> float:
    """A finite number."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"{text!r} is not a finite number")
    return value


def pair(text: str) -> tuple[float, float]:
    """Two numbers with a comma between them."""
    parts = text.split(",")
    if len(parts) != 2:
        raise argparse.ArgumentTypeError(f"{text!r} is not two numbers such as 8,6")
    return number(parts[0]), number(parts[1])


def grade(text: str) -> float:
    """A grade, rise over run, from 0.08, 8% or 1:12."""
    if text.endswith("%"):
        return number(text[:-1]) / 100.0
    if ":" in text:
        rise, run = (number(part) for part in text.split(":", 1))
        if run == 0.0:
            raise argparse.ArgumentTypeError(f"{text!r} has no run")
        return rise / run
    return number(text)


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
