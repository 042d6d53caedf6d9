"""`mjchair rider`: markers of a person in a chair in, angles of the rider's joints out.

In: a C3D or TRC file of markers. Out: a CSV table of joint angles for `mjchair simulate --input`,
and a film with the markers.
"""

from __future__ import annotations

import argparse
import sys

from mjchair.commands import options


def add(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand."""
    parser = subparsers.add_parser(
        "rider",
        help="make the motion of a rider from markers (C3D, TRC)",
        description="Joint angles of the moving rider from markers of motion capture, as a table "
        "that `simulate --rider moving --input` and a study take.",
    )
    parser.add_argument("markers", metavar="FILE", help="C3D or TRC")
    parser.add_argument("--chair", default="manual", help="default: %(default)s")
    parser.add_argument("--static", metavar="FILE", help="a trial at rest of the same person")
    parser.add_argument("--markers", dest="chosen", metavar="SET", help="a marker set, or its TOML")
    parser.add_argument("--stature", metavar="M", type=options.number, help="of the person")
    parser.add_argument("--mass", metavar="KG", type=options.number, help="of the person")
    parser.add_argument("--out", metavar="FILE", default="rider.csv", help="default: %(default)s")
    parser.add_argument("--video", metavar="FILE", help="a film with the markers on the rider")
    parser.add_argument("--force", action="store_true", help="overwrite --out and --video")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Fit, print lengths and residuals, write the table and the film."""
    from mjchair.motion.capture import captured, table_text
    from mjchair.motion.inverse_kinematics import WORST, Build
    from mjchair.storage import check_new, make_place, write_whole

    out = check_new(args.out, args.force)
    film = check_new(args.video, args.force) if args.video else None
    build = Build(args.chair, args.stature, args.mass)
    motion = captured(args.markers, args.chosen, args.static, build, _say)
    if film is not None:
        from mjchair.report.marker_film import write_marker_film

        make_place(film)
        write_marker_film(motion, film)
    make_place(out)
    write_whole(out, table_text(motion))
    for note in motion.notes:
        print(note)
    print("marker residuals, rms in mm:")
    print(", ".join(f"{name} {1e3 * value:.0f}" for name, value in motion.residuals.items()))
    far = [name for name, value in motion.residuals.items() if value > WORST]
    if far:
        static = "" if args.static else "give the static trial of the person, or "
        print(
            f"more than {1e3 * WORST:.0f} mm off: {', '.join(far)}; they are not where the set has "
            f"them: {static}do not trust the joints beside them"
        )
    print(f"wrote {out}: {motion.time.size} samples, {motion.time[-1]:.1f} s")
    return 0


def _say(stage: str) -> None:
    if sys.stderr.isatty():
        print(f"\r{stage:<50}", end="", file=sys.stderr)
