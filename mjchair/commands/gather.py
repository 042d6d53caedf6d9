"""`mjchair gather`: a folder of instruments' files in, a study folder out.

In: a folder of files of SmartWheel, inertial sensors and others. Out: a study folder for
`mjchair diagnose`, and a figure of what was found.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from mjchair.commands import options
from mjchair.errors import MjchairError

if TYPE_CHECKING:
    from mjchair.measurement.gather.gather import Gathered
    from mjchair.measurement.gather.instruments import ReadsMarkers
    from mjchair.measurement.gather.known import Known
    from mjchair.simulation.table import Table

PICTURE = "gathered.png"
DOUBTED = 0.03  # m rms, beyond which a marker is not where the set has it


def add(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand."""
    parser = subparsers.add_parser(
        "gather",
        help="make a study of SmartWheel, IMU and other files",
        description="Make a study of the files that instruments left in a folder: sides, signs, "
        "clocks, offsets and noise are found out, printed and drawn. See docs/your_data.md.",
    )
    parser.add_argument("folder", metavar="FOLDER", help="with the instruments' files")
    parser.add_argument("--rider-mass", metavar="KG", type=options.number, help="the person")
    parser.add_argument("--chair-mass", metavar="KG", type=options.number, help="the empty chair")
    parser.add_argument("--mass", metavar="KG", type=options.number, help="both together")
    parser.add_argument("--wheel-radius", metavar="M", type=options.number, help="rear wheels")
    parser.add_argument("--floor", metavar="FLOOR", help="overground, treadmill or rollers")
    parser.add_argument("--grade", type=options.grade, help="of the way: 0.02, 2%% or 1:50")
    parser.add_argument(
        "--mapping",
        metavar="FILE",
        action="append",
        default=[],
        help="TOML that says what the columns of an instrument are; may be given again",
    )
    parser.add_argument(
        "--offset",
        metavar="FILE=SECONDS",
        action="append",
        default=[],
        help="s, added to a file's clock, where it cannot be found out; may be given again. The "
        "clock of an IMU's file is 0 at its first sample, a table's is its own",
    )
    options.add_output(parser, "out/study")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Gather, check that the study can be read, write it whole, and print what was found out."""
    from mjchair.measurement.gather.gather import gather
    from mjchair.measurement.gather.known import Known
    from mjchair.measurement.gather.sources import LOG
    from mjchair.measurement.notes import Detail, once
    from mjchair.storage import check_vacant

    if Path(args.out).resolve() == Path(args.folder).resolve():
        raise MjchairError(f"--out {args.out} is the folder of the files; give another folder")
    check_vacant(args.out, args.force)
    known = Known(
        args.rider_mass, args.chair_mass, args.mass, args.wheel_radius, args.floor, args.grade
    )
    mappings = [Path(file) for file in args.mapping]
    offsets = dict(map(_offset, args.offset))
    gathered = gather(Path(args.folder), known, mappings, offsets, _of_markers(known))
    _write(gathered, Path(args.out), args.force)
    remarks = (note for note in gathered.notes if not isinstance(note, Detail))
    for line in (*gathered.summary, *once(remarks), *gathered.unused):
        print(line)
    for question in gathered.asked:
        print(f"not known: {question}", file=sys.stderr)
    print(
        f"wrote {args.out}/study.toml, {len(gathered.trials)} trials; look at "
        f"{args.out}/{PICTURE}, details are in {args.out}/{LOG}"
    )
    first = "add a coast, then " if all(t.torque_estimated for t in gathered.trials) else ""
    print(f"next: {first}mjchair diagnose {args.out}")
    return 0


def _of_markers(known: Known) -> ReadsMarkers:
    """What makes the motion of a rider of markers, as `mjchair rider` does.

    All files must be of one person, whose mass is that of the study.
    """
    first: list[tuple[Path, Mapping[str, float]]] = []

    def read(path: Path, still: Path | None) -> tuple[Table, list[str]]:
        from mjchair.measurement.notes import Detail
        from mjchair.motion.capture import captured, table_columns, unlike
        from mjchair.motion.inverse_kinematics import Build
        from mjchair.simulation.table import Table

        motion = captured(path, None, still, Build("manual", None, known.rider_mass))
        lengths = motion.rider.lengths
        first.append((path, lengths))
        before, theirs = first[0]
        segment = unlike(theirs, lengths)
        if segment:
            raise MjchairError(
                f"{path.name} is of another person than {before.name}: its {segment} is "
                f"{lengths[segment] / theirs[segment]:.2f} times as long; gather one person at a "
                "time"
            )
        off = {name: f"{1e3 * value:.0f}" for name, value in motion.residuals.items()}
        worst = max(motion.residuals, key=lambda name: motion.residuals[name])
        said = f"marker residuals up to {off[worst]} mm rms ({worst})"
        notes = [*motion.notes, said if motion.residuals[worst] > DOUBTED else Detail(said)]
        return Table(motion.time, table_columns(motion), str(path)), notes

    return read


def _offset(text: str) -> tuple[str, float]:
    name, equals, seconds = text.rpartition("=")
    if not equals:
        raise MjchairError(f"--offset {text!r} is not FILE=SECONDS, such as imu.csv=0.25")
    return name, options.part_of(seconds, f"--offset {text}")


def _earlier(folder: Path) -> list[Path]:
    """The tables of an earlier gather: those that both its log and its study.toml name."""
    from mjchair.measurement.gather.sources import LOG

    log, study = folder / LOG, folder / "study.toml"
    if not (log.is_file() and study.is_file()):
        return []
    lines = log.read_text(encoding="utf-8", errors="replace").splitlines()
    names = [f"{line.partition('  ')[0]}.csv" for line in lines]
    text = study.read_text(encoding="utf-8", errors="replace")
    named = [name for name in names if f'file = "{name}"' in text and "/" not in name]
    return [folder / name for name in dict.fromkeys(named) if (folder / name).is_file()]


def _write(gathered: Gathered, out: Path, force: bool) -> None:
    """Everything into a folder beside, read as a study, then moved; nothing half-written."""
    from mjchair.diagnosis.data.study_file import read_study
    from mjchair.report.figure_file import save
    from mjchair.report.gathered import gathered_figure
    from mjchair.storage import output_folder, write_whole

    out.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=out.parent, prefix=f".{out.name}-") as beside:
        for name, text in gathered.files.items():
            write_whole(Path(beside) / name, text)
        try:
            read_study(beside)
        except MjchairError as error:
            raise MjchairError(str(error).replace(beside, str(out))) from None
        save(gathered_figure(gathered.trials), Path(beside) / PICTURE)
        folder = output_folder(out, force)
        for file in _earlier(folder):
            file.unlink()
        for file in sorted(Path(beside).iterdir()):
            shutil.move(file, folder / file.name)
