"""`mjchair rig`: the paper's experiment, a wheel on a sliding table with load cells.

In: a tire, and slip angles, loads, speeds and cambers. Out, in --out: a CSV table with a row for
each point, traces and figures.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import TYPE_CHECKING

from mjchair.commands import options
from mjchair.errors import MjchairError

if TYPE_CHECKING:
    from pathlib import Path

    from mjchair.simulation.rig import Point, Run
    from mjchair.tire import Tire

HEADER = (
    "slip_angle_deg",
    "camber_deg",
    "load_n",
    "speed_mps",
    "kappa",
    "turned",
    "cell_1_n",
    "cell_2_n",
    "cell_3_n",
    "fx_n",
    "fy_n",
    "mz_nm",
)


def add(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand."""
    parser = subparsers.add_parser(
        "rig",
        help="measure a tire on the paper's sliding table; writes a table and figures",
        description="Hold a wheel at slip angles, camber and loads on a sliding table with three "
        "load cells, in MuJoCo. Writes rig.csv (which fit-tire reads), traces.csv and figures. "
        "Angles, loads and speeds default to the paper's.",
    )
    parser.add_argument("--tire", default="wheelchair_a0_148", help="default: %(default)s")
    parser.add_argument(
        "--against", metavar="TIRE", help="a second tire, for the comparison figure"
    )
    points = parser.add_argument_group("points (every combination is measured)")
    points.add_argument("--angles", type=numbers, metavar="DEG,...", help="slip angles, deg")
    points.add_argument("--loads", type=numbers, metavar="N,...", help="N")
    points.add_argument("--speeds", type=numbers, metavar="M/S,...", help="of the table, m/s")
    points.add_argument("--cambers", type=numbers, metavar="DEG,...", default=[0.0], help="deg")
    points.add_argument(
        "--kappas", type=numbers, metavar="K,...", help="driven or braked spin; default: free"
    )
    points.add_argument(
        "--turned", action="store_true", help="measure with the wheel turned round as well"
    )
    faults = parser.add_argument_group("what is wrong with the rig (hidden from its table)")
    faults.add_argument(
        "--toe", type=options.number, default=0.0, metavar="DEG", help="of the mounting"
    )
    faults.add_argument("--hidden-camber", type=options.number, default=0.0, metavar="DEG")
    faults.add_argument(
        "--cell-offset", type=options.number, default=0.0, metavar="N", help="of both lateral cells"
    )
    faults.add_argument(
        "--noise",
        type=options.number,
        default=0.0,
        metavar="PART",
        help="of the largest force, as 0.02",
    )
    faults.add_argument("--seed", type=int, default=0, help="of the noise")
    parser.add_argument(
        "--travel",
        type=options.number,
        default=9.0,
        help="relaxation lengths; default: %(default)s",
    )
    options.add_output(parser, "out/rig")
    parser.set_defaults(run=run)


def numbers(text: str) -> list[float]:
    """Finite numbers with commas between them."""
    return [options.number(part) for part in text.split(",")]


def run(args: argparse.Namespace) -> int:
    """Measure, write the table, the traces and the figures, and say how well the rig did."""
    from mjchair.measurement.rig import write_rows
    from mjchair.model.spec import read_tire
    from mjchair.report import rig_figures
    from mjchair.report.figure_file import save
    from mjchair.simulation.rig import Faults, measure
    from mjchair.storage import check_vacant, output_folder

    check_vacant(args.out, args.force)
    tire = read_tire(args.tire)
    second = read_tire(args.against) if args.against else None
    points = _points(args)
    offset = (args.cell_offset, args.cell_offset, 0.0)
    faults = Faults(args.toe, args.hidden_camber, offset, args.noise, args.seed)
    runs = measure(tire, points, faults, travel=args.travel, progress=True)
    others = second and measure(second, points, faults, travel=args.travel, progress=True)
    folder = output_folder(args.out, args.force)
    write_rows(folder / "rig.csv", HEADER, [_row(run) for run in runs])
    write_rows(folder / "traces.csv", _TRACE_HEADER, _trace_rows(runs))
    save(rig_figures.traces(runs), folder / "traces.png")
    clean = faults == Faults(noise=args.noise, seed=args.seed) and not any(args.cambers)
    shown = tire if clean and not args.turned else None
    free = [run for run in runs if run.point.kappa is None]
    if free:
        save(rig_figures.lateral(free, shown), folder / "lateral.png")
    if len(free) < len(runs):
        save(rig_figures.longitudinal(runs), folder / "longitudinal.png")
    if second and others:
        figure = rig_figures.compared(runs, others, (tire.name, second.name))
        save(figure, folder / "compared.png")
    if tire.unused:
        print(f"not used of the tire's file: {', '.join(tire.unused)}")
    print(_summary(runs, tire, folder, faults.noise > 0.0 or any(offset)))
    return 0


def _points(args: argparse.Namespace) -> list[Point]:
    from mjchair.simulation.rig import ANGLES, LOADS, SPEEDS, sweep

    points = []
    for turned in (False, True) if args.turned else (False,):
        for camber in args.cambers:
            for kappa in args.kappas or [None]:
                points += sweep(
                    args.angles or ANGLES,
                    args.loads or LOADS,
                    args.speeds or SPEEDS,
                    camber=camber,
                    kappa=kappa,
                    turned=turned,
                )
    if len(points) > 10_000:
        raise MjchairError(f"the sweep has {len(points)} runs; at most 10000")
    return points


def _row(run: Run) -> list[object]:
    point = run.point
    return [
        point.angle,
        point.camber,
        point.load,
        point.speed,
        point.kappa,
        int(point.turned),
        *map(float, run.reading),
        *run.force,
        run.moment,
    ]


_TRACE_HEADER = ("run", "time", "cell_1", "cell_2", "cell_3")


def _trace_rows(runs: Sequence[Run]) -> list[list[object]]:
    return [
        [number, float(time), *map(float, cells)]
        for number, run in enumerate(runs, 1)
        for time, cells in zip(run.time, run.cells, strict=True)
    ]


def _summary(runs: Sequence[Run], tire: Tire, folder: Path, disturbed: bool) -> str:
    peak = max(abs(run.force[1]) for run in runs) or 1.0
    worst = max(abs(run.force[1] - run.formula[1]) for run in runs)
    text = f"{len(runs)} runs of {tire.name}; largest lateral force {peak:.1f} N"
    if not disturbed:
        text += f", within {100.0 * worst / peak:.2g} % of it of the formula"
    return f"{text}; written to {folder}"
