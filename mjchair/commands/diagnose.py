"""`mjchair diagnose`: measured runs in, a verdict, a report and a corrected chair out.

In: a study folder (study.toml and its tables), and effects of the user's own. Out, in --out:
diagnosis.json, report.html, figures, and model.xml, the corrected chair.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mjchair.commands import options
from mjchair.errors import MjchairError, note

if TYPE_CHECKING:
    from mjchair.diagnosis.data.study import Study
    from mjchair.diagnosis.result import Diagnosis

LOG_EVERY = 20.0  # s between lines of progress in a log
CACHE = "unfinished"  # simulations of a diagnosis that was interrupted
GAP = ("before", "after", "noise_floor", "scope")
CANDIDATE = ("name", "channel", "held_out_gain", "closure", "detectability", "p_value")


def add(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand."""
    parser = subparsers.add_parser(
        "diagnose",
        help="find the effect that a model misses in measured runs",
        description="Find where a model and measured runs disagree, name the missing effect, add "
        "it. Writes diagnosis.json, report.html, model.xml and figures into --out. The same "
        "command goes on with an interrupted diagnosis.",
    )
    parser.add_argument("study", metavar="STUDY", help="folder with study.toml and its tables")
    parser.add_argument(
        "--effect",
        metavar="FILE",
        action="append",
        default=[],
        help="an effect of your own, see docs/diagnosis.md",
    )
    parser.add_argument(
        "--threads", type=options.processors, default=0, help="default: all processors"
    )
    parser.add_argument(
        "--patience",
        type=options.positive,
        metavar="TIMES",
        default=1.0,
        help="times as many simulations as usual before the search for further effects ends; a "
        "diagnosis whose search ended so says it; default: 1",
    )
    options.add_output(parser, "out/diagnose")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Diagnose, write everything, and print the verdict and the first sentences of the report."""
    from mjchair.diagnosis.data.study import without_estimated_torques
    from mjchair.diagnosis.data.study_file import read_study
    from mjchair.diagnosis.diagnose import diagnose
    from mjchair.diagnosis.replay.cache import Store
    from mjchair.effects import user_file
    from mjchair.report.diagnosis_words.first_screen import first_screen
    from mjchair.storage import check_vacant, only_writer, output_folder

    kept = Path(args.out) / CACHE
    force = args.force or _interrupted(kept)
    check_vacant(args.out, force)
    study = without_estimated_torques(read_study(args.study))
    effects = [user_file.from_file(path) for path in args.effect]
    for effect in effects:
        user_file.check(effect, study.spec)
    for line in study.notes:  # some ask for a change, which minutes should not be waited for
        note(line)
    folder = output_folder(args.out, force)
    with only_writer(kept):
        try:
            with _progress() as say:
                found = diagnose(
                    study, effects=effects, say=say, store=Store(kept), threads=args.threads
                )
                say("report")
                _write(folder, kept, study, found)
        except MjchairError:
            _clear(folder, kept)
            raise
        except KeyboardInterrupt:
            said = f"what was computed is in {kept}, and the same command goes on from it"
            print(f"mjchair: interrupted; {said}", file=sys.stderr)
            return 130
        shutil.rmtree(kept, ignore_errors=True)
    print(f"{_line(found)}; see {folder}/report.html")
    for head, said in first_screen(found).items():
        print(f"  {head}: {said.replace('**', '')}")
    return 0


@contextmanager
def _progress() -> Iterator[Callable[[str], None]]:
    """What to call as a stage begins: a bar on a terminal, elsewhere a line now and then."""
    from tqdm import tqdm

    layout = "{elapsed} {n_fmt} stages{postfix}"
    with tqdm(unit="stage", disable=None, bar_format=layout) as bar:
        begun = told = time.monotonic()

        def say(stage: str) -> None:
            nonlocal told
            bar.set_postfix_str(stage)
            bar.update()
            now = time.monotonic()
            if bar.disable and now - told > LOG_EVERY:
                told = now
                print(f"mjchair: {now - begun:.0f} s, {stage}", file=sys.stderr, flush=True)

        yield say


def _write(folder: Path, kept: Path, study: Study, found: Diagnosis) -> None:
    """Make everything first, then write it beside the simulations, then move it, verdict last."""
    from mjchair.diagnosis.diagnose import corrected
    from mjchair.model.spec import compile_spec, exact_xml
    from mjchair.report.diagnosis_page import figures, page
    from mjchair.storage import write_whole

    exact_xml()
    spec = corrected(study, found)
    compile_spec(spec)
    drawn = figures(found)
    files: dict[str, str | bytes] = {f"{name}.png": image for name, image in drawn.items()}
    files["model.xml"] = spec.to_xml()
    title = f"Diagnosis of {Path(study.source).resolve().name}"
    files["report.html"] = page(found, drawn, title, _replay(study, found))
    files["diagnosis.json"] = json.dumps(contract(found), indent=1, allow_nan=False) + "\n"
    for name, content in files.items():
        write_whole(kept / name, content)
    for name in files:
        (kept / name).replace(folder / name)


def _replay(study: Study, found: Diagnosis) -> str:
    """HTML of a run of the study with both chairs; one sentence where no chair can be driven."""
    from mjchair.diagnosis.driven_run import drive_run
    from mjchair.report import diagnosis_replay

    try:
        return diagnosis_replay.section(drive_run(study, found))
    except MjchairError as error:
        return diagnosis_replay.no_replay(str(error))


def contract(found: Diagnosis) -> dict[str, Any]:
    """What diagnosis.json holds; a sensor's effect has its channel besides."""
    out = found.to_dict()
    out["gap"] = {key: out["gap"][key] for key in GAP}
    out["candidates"] = [{k: c[k] for k in CANDIDATE if k in c} for c in out["candidates"]]
    return out


def _clear(folder: Path, kept: Path) -> None:
    """Leave nothing of a study that could not be diagnosed."""
    shutil.rmtree(kept, ignore_errors=True)
    if not any(folder.iterdir()):
        folder.rmdir()


def _interrupted(kept: Path) -> bool:
    """Whether the output folder holds an interrupted diagnosis, whose verdict comes last."""
    return kept.is_dir() and not (kept.parent / "diagnosis.json").exists()


def _line(found: Diagnosis) -> str:
    """Verdict, effects with what could stand in their places, and gap, on one line."""
    from mjchair.report.diagnosis_words.explanations import in_place_of

    rivals = {own: " or ".join(others) for own, others in in_place_of(found.alternatives).items()}
    alone = {own: f" (or {others})" for own, others in rivals.items()}
    together = [f", or {others} for {own}" for own, others in rivals.items() if "+" in own]
    names = ", ".join(e.key + alone.get(e.key, "") for e in found.effects) or "no effect"
    said = f"{found.verdict}: {names}{''.join(together)}"
    gap = found.gap
    assert gap is not None
    after = "" if gap.after is None else f" -> {gap.after:.2f}"
    return f"{said}; gap {gap.before:.2f}{after} (noise {gap.noise_floor:.2f})"
