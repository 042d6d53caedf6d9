"""`mjchair sweep`: many chairs over parameters, inputs and seeds."""

from __future__ import annotations

import argparse
import sys

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
    parser.add_argument("--threads", type=int, default=0, help="default: all processors")
    parser.add_argument(
        "--scheduler", metavar="ADDRESS", help="of a Dask scheduler, such as tcp://host:8786"
    )
    options.add_output(parser, "out/sweep")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the study and say where its results are."""
    from mjchair.sweep import read_study
    from mjchair.sweep import run as sweep

    study = read_study(args.study)
    table = sweep(
        study,
        args.out,
        threads=args.threads,
        scheduler=args.scheduler,
        progress=True,
        force=args.force,
    )
    broken = table["status"].to_pylist().count("unstable")
    print(f"{len(table)} chairs in {args.out}/results" + (f", {broken} unstable" if broken else ""))
    if broken:
        print(f"mjchair: {broken} simulations were unstable; see `status`", file=sys.stderr)
    return 0
