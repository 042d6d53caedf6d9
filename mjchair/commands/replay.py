"""`mjchair replay`: a saved recording in three dimensions, as one page that opens offline.

In: recording.npz, or its folder, and other runs to compare with. Out: one HTML file.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from mjchair.errors import MjchairError

if TYPE_CHECKING:
    from mjchair.measurement.trial import Trial
    from mjchair.simulation.recording import Recording

MEGABYTE = 1e6


def add(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand."""
    parser = subparsers.add_parser(
        "replay",
        help="show a saved recording in three dimensions, in one page that opens offline",
        description="Write a saved recording as one HTML file that opens in a browser without a "
        "network: the chair in three dimensions with the force arrows of its tires, play, pause, "
        "speed and a bar to scrub, and the signals below.",
    )
    parser.add_argument("recording", help="recording.npz, or the folder that has it")
    parser.add_argument(
        "--ghost",
        metavar="OTHER",
        action="append",
        default=[],
        help="another recording, or a measured run (a table of sensor columns), to draw as a ghost "
        "in the same scene; may be given again",
    )
    parser.add_argument(
        "--out", metavar="FILE", default="run.html", help="the page; default: %(default)s"
    )
    parser.add_argument("--force", action="store_true", help="overwrite the page")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Write the page, and say what it leaves out."""
    from mjchair.report.replay.page import replay

    out = Path(args.out)
    if out.suffix.lower() not in (".html", ".htm"):
        raise MjchairError(f"--out {out}: a replay is one file that ends in .html")
    if out.exists() and not args.force:
        raise MjchairError(f"{out} is there; choose another --out, or overwrite with --force")
    recording = recorded(args.recording)
    ghosts: dict[str, Recording | Trial] = {}
    for given in args.ghost:
        ghosts[_free_name(given, ghosts)] = _ghost(given, recording)
    page = replay(recording, ghosts, title=f"Replay of {Path(args.recording).resolve().name}")
    out.parent.mkdir(parents=True, exist_ok=True)
    page.save(out)
    for note in page.notes:
        print(note)
    print(f"{out}: {out.stat().st_size / MEGABYTE:.1f} MB; open it in a browser")
    return 0


def recorded(given: str) -> Recording:
    """The recording of a file, or of the folder that has it."""
    from mjchair.simulation.recording import load_recording

    path = Path(given)
    return load_recording(path / "recording.npz" if path.is_dir() else path)


def _ghost(given: str, recording: Recording) -> Recording | Trial:
    """Another recording, or a measured run whose columns are those of the recorded chair."""
    from mjchair.measurement.trial import read_trial

    path = Path(given)
    if path.is_dir() or path.suffix == ".npz":
        return recorded(given)
    return read_trial(path, recording.model.load())


def _free_name(given: str, taken: dict[str, Recording | Trial]) -> str:
    """A name for the page: the file's, or its folder's; numbered where it is taken."""
    path = Path(given).resolve()
    name = path.parent.name if path.name == "recording.npz" else path.stem
    names = [name, *(f"{name} {k}" for k in range(2, len(taken) + 3))]
    return next(n for n in names if n not in taken)
