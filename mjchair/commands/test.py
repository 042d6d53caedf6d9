"""`mjchair test`: the test laboratory on any chair; numbers, classes and a sheet.

In: a chair, a dummy's mass, names of tests, and parameters to compare. Out, in --out: results.json,
the sheet as HTML and, if asked for, films and replays.
"""

from __future__ import annotations

import argparse
import itertools
import math
from typing import TYPE_CHECKING

from mjchair.commands import options
from mjchair.errors import MjchairError

if TYPE_CHECKING:
    from mjchair.testlab.design import Design

DEGREE = "deg"
DESIGNS = 8  # compared side by side, at most


def add(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand."""
    parser = subparsers.add_parser(
        "test",
        help="the tests that wheelchairs are sold by (ISO 7176, EN 12184), as a disclosure sheet",
        description="Run the tests that wheelchairs are sold by. Writes results.json and "
        "sheet.html, which opens offline, into --out. The same command goes on with an "
        "interrupted run. Tests: see "
        "docs/test_laboratory.md, or give a wrong name.",
    )
    parser.add_argument("tests", nargs="*", metavar="TEST", help="default: all")
    parser.add_argument(
        "--model", default="manual", help="a shipped chair or an MJCF file; default: %(default)s"
    )
    parser.add_argument(
        "--occupant",
        type=options.number,
        metavar="KG",
        help="mass of the dummy; default: the model's",
    )
    options.add_drive(parser)
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="NAME=VALUE[,VALUE]",
        help="a chair parameter, SI or with deg; several values are compared side by side, one "
        "with the chair as it is; may be given again",
    )
    parser.add_argument(
        "--adjust",
        action="append",
        default=[],
        metavar="NAME=LOW:HIGH",
        help="what a user may adjust, for the least and the most stable set-up; may be given again",
    )
    parser.add_argument(
        "--uncertainty",
        type=int,
        default=0,
        metavar="N",
        help="print intervals from N chairs drawn from the ranges of masses and tires",
    )
    parser.add_argument("--films", action="store_true", help="film the runs that tests keep")
    parser.add_argument(
        "--replays",
        action="store_true",
        help="write the runs that tests keep as replays, to which the sheet leads",
    )
    parser.add_argument(
        "--no-stops", action="store_true", help="tilting platform without stops: the tires hold"
    )
    parser.add_argument(
        "--workers", type=options.processors, default=0, help="default: all processors"
    )
    options.add_output(parser, "out/test")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the tests, write the results and the sheet."""
    from mjchair.testlab import sheet
    from mjchair.testlab.laboratory import Request, chosen
    from mjchair.testlab.laboratory import run as perform
    from mjchair.testlab.uncertainty import draws

    designs = _designs(args)
    first = next(iter(designs.values()))
    request = Request(
        designs,
        chosen(args.tests),
        stops=not args.no_stops,
        films=args.films,
        replays=args.replays,
        adjust=dict(map(_range, args.adjust)) or None,
        draws=draws(first, args.uncertainty),
    )
    by_design = perform(request, args.out, workers=args.workers, progress=True, force=args.force)
    sheet.write(f"{args.out}/sheet.html", request, by_design)
    results = next(iter(by_design.values()))
    for test, result in results.items():
        print(f"{test}: {result.missing or f'{len(result.values)} values'}")
    print(f"written to {args.out}: results.json, sheet.html")
    return 0


def _designs(args: argparse.Namespace) -> dict[str, Design]:
    """What is compared: every combination of the values that were given; one alone beside the
    chair as it is.

    Raises:
      MjchairError: a text that is no NAME=VALUE, an unknown parameter, too many designs.
    """
    from mjchair.testlab.design import Design

    given = {name: text.split(",") for name, text in options.assignments(args.set).items()}
    combinations = list(itertools.product(*given.values()))
    if len(combinations) > DESIGNS:
        raise MjchairError(f"--set makes {len(combinations)} designs; at most {DESIGNS} at a time")
    designs, drive = {}, options.drive(args)
    for values in combinations:
        parameters = dict(zip(given, values, strict=True))
        name = ", ".join(f"{k} {v}" for k, v in parameters.items()) or "the chair as it is"
        designs[name] = Design(args.model, args.occupant, parameters, drive=drive)
    if given and len(combinations) == 1:
        designs["the chair as it is"] = Design(args.model, args.occupant, drive=drive)
    return designs


def _range(text: str) -> tuple[str, tuple[float, float]]:
    name, sign, span = text.partition("=")
    low, colon, high = span.partition(":")
    if not sign or not colon:
        raise MjchairError(
            f"--adjust {text} is not NAME=LOW:HIGH, such as axle_position=-0.02:0.04"
        )
    return name, (_quantity(low, f"--adjust {text}"), _quantity(high, f"--adjust {text}"))


def _quantity(text: str, what: str) -> float:
    """A number, in degrees where it ends in deg."""
    scale = math.radians(1.0) if text.endswith(DEGREE) else 1.0
    return scale * options.part_of(text.removesuffix(DEGREE), what)
