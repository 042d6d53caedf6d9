"""`mjchair render`: a film or a frame of a saved recording, without simulating again.

In: recording.npz, or its folder. Out: an MP4 film, or a PNG picture of one moment.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from mjchair.commands import options


def add(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand."""
    parser = subparsers.add_parser(
        "render",
        help="film a saved recording",
        description="Film a saved recording with a force arrow at every wheel, without simulating "
        "again. Writes video.mp4 into --out, or frame.png with --frame.",
    )
    parser.add_argument("recording", help="recording.npz, or the folder that has it")
    parser.add_argument("--frame", type=options.number, metavar="S", help="one picture, at this s")
    parser.add_argument("--view", default="front", help="front, behind, side or top")
    parser.add_argument("--fps", type=options.number, default=25.0, help="Hz; default: %(default)s")
    parser.add_argument(
        "--slow", type=options.number, default=1.0, metavar="N", help="N times slower; default: 1"
    )
    parser.add_argument(
        "--size",
        type=options.size,
        default=(960, 540),
        metavar="WxH",
        help="pixels, 48 to 4096; 960x540",
    )
    options.add_output(parser, "out/render")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Film it."""
    from mjchair.errors import MjchairError
    from mjchair.report.film import check_size, write_film, write_frame
    from mjchair.simulation.recording import load_recording
    from mjchair.storage import check_vacant, output_folder

    check_vacant(args.out, args.force)
    if not args.slow > 0.0:
        raise MjchairError(f"--slow is {args.slow:g}; it must be positive")
    path = Path(args.recording)
    recording = load_recording(path / "recording.npz" if path.is_dir() else path)
    last = float(recording.time[-1])
    if args.frame is not None and not 0.0 <= args.frame <= last:
        raise MjchairError(f"--frame is {args.frame:g} s; the recording goes from 0 to {last:g} s")
    width, height = args.size
    check_size(width, height)
    name = "video.mp4" if args.frame is None else "frame.png"
    made = not Path(args.out).exists()
    folder = output_folder(args.out, args.force)
    picture = {"width": width, "height": height, "view": args.view}
    try:
        if args.frame is None:
            write_film(
                recording,
                folder / name,
                fps=args.fps,
                speed=1.0 / args.slow,
                progress=True,
                **picture,
            )
        else:
            write_frame(recording, folder / name, args.frame, **picture)
    except MjchairError:
        if made:
            folder.rmdir()
        raise
    print(f"{recording.describe()}; written to {folder / name}")
    return 0
