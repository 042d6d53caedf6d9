"""`mjchair outcomes`: push time, cadence, moment, power and the like, a row a stroke.

In: a SmartWheel file, a study table or a recording. Out: a table on standard output, and as CSV.
"""

from __future__ import annotations

import argparse


def add(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand."""
    parser = subparsers.add_parser(
        "outcomes",
        help="what each push did: time, moment, power, work, contact angle",
        description="Outcomes of wheelchair propulsion, stroke by stroke, of a SmartWheel file, a "
        "table of a study or a simulated recording. Prints means over the strokes; --out writes "
        "a row a stroke.",
    )
    parser.add_argument("file", metavar="FILE", help="SmartWheel CSV, study table or recording.npz")
    parser.add_argument(
        "--baseline", metavar="FILE", help="SmartWheel recording of the same rim untouched"
    )
    parser.add_argument(
        "--wheel",
        default="left_wheel",
        choices=("left_wheel", "right_wheel"),
        help="of a table or recording; default: %(default)s",
    )
    parser.add_argument("--out", metavar="FILE", help="write the table here, as CSV")
    parser.add_argument("--force", action="store_true", help="overwrite --out")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Print the outcomes and write their table."""
    from mjchair.measurement.outcomes import outcomes, read_rim
    from mjchair.storage import check_new, make_place

    out = check_new(args.out, args.force) if args.out else None
    found = outcomes(read_rim(args.file, args.baseline, args.wheel))
    if out is not None:
        make_place(out)
        found.to_csv(out)
    print(found.text())
    return 0
