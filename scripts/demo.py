"""A measured push rim drives both rear wheels of the manual chair; everything is drawn and filmed.

Writes into --out (default out/demo): recording.npz, recording.csv, wheel_speed.png,
trajectory.png and video.mp4. Nothing here is tuned to the measurement.
"""

from __future__ import annotations

import argparse
import sys
import time

import numpy as np

import mjchair
from mjchair.measurement import samples
from mjchair.measurement.smartwheel import push_inputs, read_smartwheel, without_baseline
from mjchair.report import plots
from mjchair.report.gl import NoGraphicsError
from mjchair.report.render import write_film
from mjchair.storage import output_folder

NOTE = (
    "Both rear wheels get the measured moment of one push rim; nothing is fitted. Mass and floor "
    "of the measured chair are not known, and its rider's trunk and arms move, which this rigid "
    "chair leaves out: the measured chair speeds up while the hands are off the rim."
)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", default="out/demo", metavar="DIR")
    parser.add_argument("--no-video", action="store_true")
    args = parser.parse_args()
    began = time.perf_counter()
    folder = output_folder(args.out, force=True)

    measured = without_baseline(
        read_smartwheel(samples.propulsion()), read_smartwheel(samples.baseline())
    )
    recording = mjchair.simulate(mjchair.load_spec("manual"), push_inputs(measured), progress=True)
    recording.save(folder / "recording.npz")
    recording.to_csv(folder / "recording.csv")

    speed = plots.wheel_speed(
        recording, (measured.time, measured.speed), "A measured push rim drives the chair", NOTE
    )
    plots.save(speed, folder / "wheel_speed.png")
    path = plots.trajectory(recording, "The same run from above, with the tires' forces", arrows=12)
    plots.save(path, folder / "trajectory.png")
    report(recording, measured)

    if not args.no_video:
        try:
            write_film(recording, folder / "video.mp4", fps=12, progress=True)
        except NoGraphicsError as error:
            print(f"no video: {error}", file=sys.stderr)
    names = ", ".join(sorted(path.name for path in folder.iterdir()))
    print(f"{folder}: {names} ({time.perf_counter() - began:.0f} s)")
    return 0


def report(recording: mjchair.Recording, measured) -> None:  # type: ignore[no-untyped-def]
    """Print what the comparison shows, plainly."""
    simulated = np.interp(measured.time, recording.time, recording["left_wheel_speed"])
    difference = simulated - measured.speed
    print(recording.describe())
    print(
        f"wheel speed at {measured.time[-1]:.1f} s: measured {measured.speed[-1]:.2f}, simulated "
        f"{simulated[-1]:.2f} rad/s; rms difference {np.sqrt(np.mean(difference**2)):.2f} rad/s"
    )


if __name__ == "__main__":
    raise SystemExit(main())
