"""`mjchair fit-tire`: coefficients from a rig table, with what the data cannot determine said.

In: a CSV table of rig runs and the name of a formula family. Out, in --out: the tire as TOML or
.tir, fit.txt, fit.json and fit.png.
"""

from __future__ import annotations

import argparse
import json
from typing import TYPE_CHECKING, Any

from mjchair.commands import options
from mjchair.errors import MjchairError
from mjchair.units import per_cent

if TYPE_CHECKING:
    from mjchair.identification.causes import Verdict
    from mjchair.identification.fit import Estimate, Fit

MOST_NAMED = 5  # rows far off that are named one by one


def add(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand."""
    parser = subparsers.add_parser(
        "fit-tire",
        help="identify a tire from a rig table; writes a tire file, a report and a figure",
        description="Fit a formula family to a table of rig runs, as `mjchair rig` writes it. "
        "Writes the tire (for --tire), fit.txt, fit.json and fit.png. Forces are ISO-W: negative "
        "for a positive slip angle.",
    )
    parser.add_argument(
        "table",
        metavar="CSV",
        help="slip_angle_deg, load_n, fy_n and others; also with a unit: 'slip_angle [rad]'",
    )
    parser.add_argument(
        "--family", default="pac89", help="pac89 (default), quadratic, linear or mf61"
    )
    parser.add_argument("--name", default="fitted", help="of the tire; default: %(default)s")
    parser.add_argument(
        "--like",
        default="wheelchair",
        metavar="TIRE",
        help="where relaxation, damping, rolling resistance and trail come from, which a steady "
        "rig does not measure; default: %(default)s",
    )
    parser.add_argument(
        "--paper-sign", action="store_true", help="forces are positive for positive slip angles"
    )
    parser.add_argument(
        "--format", choices=("toml", "tir"), default="toml", help="of the tire file"
    )
    parser.add_argument("--seed", type=int, default=0, help="of the starts")
    options.add_output(parser, "out/fit")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Fit the family and its rivals, write everything, and print the report."""
    from mjchair.identification.curves import FAMILIES, curve
    from mjchair.identification.fit import fit, identify
    from mjchair.measurement.rig import read_rig
    from mjchair.model.spec import read_tire
    from mjchair.report import tire_fit_figures
    from mjchair.report.figure_file import save
    from mjchair.storage import check_vacant, output_folder, write_whole
    from mjchair.tire import write

    check_vacant(args.out, args.force)
    if args.format == "tir" and args.family in ("linear", "quadratic"):
        raise MjchairError(f".tir files have no family {args.family!r}; leave --format toml")
    table = read_rig(args.table, args.paper_sign)
    like = read_tire(args.like)
    tire_fit, verdict = identify(table, args.family, seed=args.seed)
    others = [
        fit(table, curve(family, table), tire_fit.causes, seed=args.seed, starts=3)
        for family in FAMILIES
        if family != args.family
    ]
    source = (
        f"Fitted to {len(table)} rig runs at loads {table.load.min():g} to {table.load.max():g} N "
        f"and slip angles to {abs(table.angle).max():g} deg; beyond them it is extrapolated"
    )
    tire = tire_fit.tire(args.name, like, source)
    _notes(tire_fit)
    folder = output_folder(args.out, args.force)
    write(tire, folder / f"{args.name}.{args.format}")
    save(tire_fit_figures.fitted(tire_fit), folder / "fit.png")
    text = report(tire_fit, verdict, others)
    write_whole(folder / "fit.txt", text)
    write_whole(folder / "fit.json", json.dumps(_record(tire_fit, verdict), indent=1) + "\n")
    print(text + f"Written to {folder}; use it with --tire {folder / args.name}.{args.format}")
    return 0


def _notes(tire_fit: Fit) -> None:
    """Say what of the data the fit does not follow."""
    from mjchair.errors import note
    from mjchair.identification.fit import LARGE_RESIDUAL

    far = tire_fit.far_rows()
    for index, residual, times in far[:MOST_NAMED]:
        note(
            f"row {index + 2} of {tire_fit.table.source}: its lateral force "
            f"{tire_fit.table.fy[index]:.4g} N is {abs(residual):.4g} N from the fit, "
            f"{times:.0f} times the usual residual; check it, or leave the row out"
        )
    if len(far) > MOST_NAMED:
        note(f"{len(far) - MOST_NAMED} more rows are as far from the fit")
    if tire_fit.unexplained > LARGE_RESIDUAL:
        note(
            f"the residual of the fit is {per_cent(tire_fit.unexplained)} of the force; the "
            "tire follows these data badly"
        )


def report(tire_fit: Fit, verdict: Verdict, others: list[Fit]) -> str:
    """The fit in words and tables."""
    from mjchair.identification.fit import compare

    lines = [
        f"{tire_fit.curve.family} fitted to {len(tire_fit.table)} runs of {tire_fit.table.source}: "
        f"noise {tire_fit.noise:.2g} N, {tire_fit.effective:.1f} parameters' worth of data used, "
        f"{per_cent(tire_fit.reached)} of the starts ended here.",
        "",
        "parameter      value        standard error",
    ]
    estimates = tire_fit.estimates()
    lines += [_line(estimate) for estimate in estimates]
    lines += ["", *_undetermined(tire_fit, estimates)]
    lines += ["Published coefficients (value and standard error):"]
    lines += [
        f"  {name:<20} {_rounded(value, error)} +- {error:.2g}"
        for name, (value, error) in tire_fit.coefficients().items()
        if error > 0.0
    ]
    lines += ["", "Why the curves may miss the origin:"]
    lines += [f"  {sentence}" for sentence in verdict.sentences()]
    lines += ["", "family      parameters   rms (N)      AIC      BIC"]
    for family, effective, rms, aic, bic in compare(tire_fit.table, [tire_fit, *others]):
        lines.append(f"{family:<10} {effective:>10.1f} {rms:>10.3g} {aic:>9.1f} {bic:>8.1f}")
    return "\n".join(lines) + "\n"


def _line(estimate: Estimate) -> str:
    p = estimate.parameter
    held = "" if estimate.determined else f"  held by its prior, {p.prior:g} +- {p.spread:.2g}"
    value = _rounded(estimate.value, estimate.error)
    return f"{p.name:<12} {value:>10} {p.unit:<6} +- {estimate.error:.2g}  {p.text}{held}"


def _rounded(value: float, error: float) -> str:
    """The value with as many digits as its standard error leaves it."""
    from math import floor, isfinite, log10

    if not (isfinite(error) and error > 0.0):
        return f"{value:.4g}"
    digits = max(-floor(log10(error)) + 1, 0)
    return f"{value:.{min(digits, 12)}f}"


def _undetermined(tire_fit: Fit, estimates: list[Estimate]) -> list[str]:
    """What these data do not determine, and which parameters go together."""
    from itertools import combinations

    from mjchair.identification.fit import STRONG_CORRELATION

    lines = []
    held = [estimate.parameter.name for estimate in estimates if not estimate.determined]
    if held:
        loads, angles = set(tire_fit.table.load), set(abs(tire_fit.table.angle))
        lines.append(
            f"Not determined by {len(loads)} loads and angles to {max(angles):g} deg: "
            f"{', '.join(held)}; what is printed for them is mostly the stated prior."
        )
    matrix = tire_fit.correlations()
    names = [estimate.parameter.name for estimate in estimates]
    tied = [
        f"{names[i]} with {names[k]} ({matrix[i, k]:+.2f})"
        for i, k in combinations(range(len(names)), 2)
        if abs(matrix[i, k]) > STRONG_CORRELATION
    ]
    if tied:
        lines.append(f"Nearly one number, not two: {'; '.join(tied)}.")
    return [*lines, ""] if lines else []


def _record(tire_fit: Fit, verdict: Verdict) -> dict[str, Any]:
    """The fit as plain data."""
    return {
        "family": tire_fit.curve.family,
        "noise_n": tire_fit.noise,
        "effective_parameters": tire_fit.effective,
        "degrees_of_freedom": tire_fit.degrees,
        "starts_that_agree": tire_fit.reached,
        "parameters": [
            {
                "name": e.parameter.name,
                "unit": e.parameter.unit,
                "value": e.value,
                "standard_error": e.error,
                "determined_by_data": e.determined,
                "prior": e.parameter.prior,
                "prior_spread": e.parameter.spread if e.parameter.prior is not None else None,
            }
            for e in tire_fit.estimates()
        ],
        "correlations": tire_fit.correlations().tolist(),
        "coefficients": {
            name: {"value": value, "standard_error": error}
            for name, (value, error) in tire_fit.coefficients().items()
        },
        "causes": {
            "named": list(verdict.named),
            "cannot_tell_apart": list(verdict.undecided),
            "bic_over_best": {"+".join(k) or "none": v for k, v in verdict.bic.items()},
        },
    }
