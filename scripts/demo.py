"""Drive the manual chair with a measured push-rim moment; the measured chair is shown as a ghost.

Writes into --out (default out/demo): replay.html, the file to open, in which the measured chair
is a ghost; recording.npz, recording.csv, wheel_speed.png and trajectory.png; with --video also
video.mp4. Nothing here is tuned to the measurement.
"""

from __future__ import annotations

import argparse
import sys
import time

import numpy as np

import mjchair
from mjchair.measurement import samples
from mjchair.measurement.baseline import without_baseline
from mjchair.measurement.smartwheel import PushRim, push_inputs, read_smartwheel
from mjchair.measurement.trial import Trial
from mjchair.report.figure_file import save
from mjchair.report.film import write_film
from mjchair.report.gl import NoGraphicsError
from mjchair.report.trajectory import trajectory
from mjchair.report.wheel_speed import wheel_speed
from mjchair.storage import output_folder

NOTE = (
    "Both rear wheels get the measured moment of one push rim; nothing is fitted. Mass and floor "
    "of the measured chair are not known, and its rider's trunk and arms move, which this rigid "
    "chair leaves out: the measured chair speeds up while the hands are off the rim."
)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", default="out/demo", metavar="DIR")
    parser.add_argument("--video", action="store_true", help="film it as well")
    args = parser.parse_args()
    began = time.perf_counter()
    folder = output_folder(args.out, force=True)

    measured = without_baseline(
        read_smartwheel(samples.propulsion()), read_smartwheel(samples.baseline())
    )
    recording = mjchair.simulate(mjchair.load_spec("manual"), push_inputs(measured), progress=True)
    recording.save(folder / "recording.npz")
    recording.to_csv(folder / "recording.csv")

    speed = wheel_speed(
        recording, (measured.time, measured.speed), "A measured push rim drives the chair", NOTE
    )
    save(speed, folder / "wheel_speed.png")
    path = trajectory(recording, "The same run from above, with the tires' forces", arrows=12)
    save(path, folder / "trajectory.png")
    report(recording, measured)

    if args.video:
        try:
            write_film(recording, folder / "video.mp4", fps=12, progress=True)
        except NoGraphicsError as error:
            print(f"no video: {error}", file=sys.stderr)
    page = recording.replay(
        {"measured chair": measured_run(measured)},
        title="A measured push rim drives the chair; the ghost moves as the measured wheel does",
    )
    page.save(folder / "replay.html")
    names = ", ".join(sorted(p.name for p in folder.iterdir() if p.name != "replay.html"))
    print(f"{folder}: {names} ({time.perf_counter() - began:.0f} s)")
    print(f"Open this file in a browser: {(folder / 'replay.html').resolve()}")
    return 0


def measured_run(measured: PushRim) -> Trial:
    """The measured chair: its left wheel's speed, told from the encoder; its way was straight."""
    speed = {"left_wheel_speed": measured.speed}
    return Trial("measured chair", measured.time, speed, None, {})


def report(recording: mjchair.Recording, measured: PushRim) -> None:
    """Print the difference between measurement and simulation."""
    simulated = np.interp(measured.time, recording.time, recording["left_wheel_speed"])
    difference = simulated - measured.speed
    print(recording.describe())
    print(
        f"wheel speed at {measured.time[-1]:.1f} s: measured {measured.speed[-1]:.2f}, simulated "
        f"{simulated[-1]:.2f} rad/s; rms difference {np.sqrt(np.mean(difference**2)):.2f} rad/s"
    )


if __name__ == "__main__":
    raise SystemExit(main())
