"""`mjchair diagnose`: measured runs in, a verdict, a report and a corrected chair out."""

from __future__ import annotations

import argparse
import json
import shutil
import sys
from pathlib import Path

from mjchair.commands import options


def add(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand."""
    parser = subparsers.add_parser(
        "diagnose",
        help="find the effect that a model misses in measured runs",
        description="Find where a model and measured runs disagree, name the missing effect, add "
        "it. Writes diagnosis.json, report.html, model.xml and figures into --out.",
    )
    parser.add_argument("study", metavar="STUDY", help="folder with study.toml and its tables")
    parser.add_argument(
        "--effect", metavar="FILE", action="append", default=[], help="an effect of your own"
    )
    options.add_output(parser, "out/diagnose")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the command; returns the exit code."""
    from tqdm import tqdm

    from mjchair.diagnosis.store import Store
    from mjchair.diagnosis.study import read_study
    from mjchair.diagnosis.workflow import corrected, diagnose
    from mjchair.effects.library import from_file
    from mjchair.model.spec import exact_xml
    from mjchair.report.diagnosis_page import figures, page
    from mjchair.storage import output_folder, write_whole

    study = read_study(args.study)
    effects = [from_file(path) for path in args.effect]
    kept = Path(args.out) / CACHE
    folder = output_folder(args.out, args.force or (kept.is_dir() and _only(kept)))
    with tqdm(unit="stage", disable=None, desc="diagnose") as bar:

        def say(stage: str) -> None:
            bar.set_postfix_str(stage)
            bar.update()

        diagnosis = diagnose(study, effects=effects, say=say, store=Store(kept))
    exact_xml()
    drawn = figures(diagnosis)
    for name, image in drawn.items():
        write_whole(folder / f"{name}.png", image)
    spec = corrected(study, diagnosis)
    spec.compile()
    write_whole(folder / "model.xml", spec.to_xml())
    write_whole(folder / "report.html", page(diagnosis, drawn))
    write_whole(folder / "diagnosis.json", json.dumps(diagnosis.to_dict(), indent=1) + "\n")
    shutil.rmtree(kept, ignore_errors=True)
    print(_line(diagnosis.to_dict()))
    print(f"wrote {folder}/report.html, diagnosis.json, model.xml", file=sys.stderr)
    return 0


CACHE = "unfinished"  # simulations of a diagnosis that was interrupted


def _only(kept: Path) -> bool:
    return [p.name for p in kept.parent.iterdir()] == [CACHE]


def _line(found: dict) -> str:  # type: ignore[type-arg]
    names = ", ".join(e["name"] for e in found["effects"]) or "no effect"
    sets = "; cannot be told apart: " + " / ".join(
        ", ".join(group) for group in found["alternatives"]
    )
    gap = found["gap"]
    return (
        f"{found['verdict']}: {names}{sets if found['alternatives'] else ''}; "
        f"gap {gap['before']:.2f} -> {gap['after']:.2f} (noise {gap['noise_floor']:.2f})"
    )
