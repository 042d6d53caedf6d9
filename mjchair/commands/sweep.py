"""`mjchair sweep`: many chairs over parameters, inputs and seeds.

In: a TOML file of a sweep. Out, in --out: a Parquet dataset with a row for each chair.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from dataclasses import replace

from mjchair.commands import options


def add(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand."""
    parser = subparsers.add_parser(
        "sweep",
        help="simulate many chairs; writes a Parquet dataset as they finish",
        description="Simulate every combination of a study's axes. The study is TOML: `duration` "
        "in s, a table [axes] of lists, a table [fixed] of values; names are those of load_spec, "
        "ChairParameters, effects (surface_patch.coefficient), speed, yaw_rate, torque_left, "
        "torque_right, push_left, push_right, push_spread, seed. Writes results/*.parquet into "
        "--out as they finish; the same command goes on with an interrupted sweep.",
    )
    parser.add_argument("study", help="TOML file")
    parser.add_argument(
        "--threads", type=options.processors, default=0, help="default: all processors"
    )
    parser.add_argument(
        "--scheduler", metavar="ADDRESS", help="of a Dask scheduler, such as tcp://host:8786"
    )
    options.add_parameters(parser)
    options.add_output(parser, "out/sweep")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the study and say where its results are."""
    from mjchair.sweep import read_study
    from mjchair.sweep import run as sweep

    study = read_study(args.study)
    chosen = options.parameters(args)
    if chosen is not None:
        study = replace(study, fixed={**study.fixed, **chosen.given()})
    table = sweep(
        study,
        args.out,
        threads=args.threads,
        scheduler=args.scheduler,
        progress=True,
        force=args.force,
    )
    counted = Counter(status for status in table["status"].to_pylist() if status != "completed")
    told = "".join(f", {count} {status}" for status, count in counted.most_common())
    print(f"{len(table)} chairs in {args.out}/results{told}")
    if counted:
        total = counted.total()
        print(f"mjchair: {total} simulations did not complete; see `status`", file=sys.stderr)
    return 0
