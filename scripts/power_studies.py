"""Three faults of a power chair, hidden in joystick-driven runs and diagnosed.

    python scripts/power_studies.py --out out/power_studies [--only low_battery]

A chair drives on a slope of 10 % with its joystick: up and down at full speed, across, in a
slalom and on the spot. One chair has a weak motor, one a low battery, one a dragging brake; the
study says that it has none of them. Each is written as a study folder and diagnosed as
`mjchair diagnose` does; a line of a table says what was hidden and what was found.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import numpy as np
import tomli_w

import mjchair
from mjchair import cli
from mjchair.effects.library import find
from mjchair.storage import write_whole

FAULTS = {
    "weak_motor": {"left": 0.12, "right": 0.0},
    "low_battery": {"used": 0.85},
    "dragging_brake": {"left": 0.0, "right": 8.0},
}
GRADE, SECONDS, RATE = 0.1, 6.0, 100.0
NOISE = {  # SI; sizes of encoders, a small IMU and motion capture; assumed
    "left_wheel_speed": 0.05,
    "right_wheel_speed": 0.05,
    "imu_gyro.z": 0.02,
    "position.x": 0.01,
    "position.y": 0.01,
    "heading": 0.01,
}


def manoeuvres():
    """Name, heading at the start (rad), joystick forward and to the left (n,)."""
    time = np.arange(0.0, SECONDS + 0.005, 0.01)
    go = np.clip(2.0 * (time - 0.3), 0.0, 1.0) * (time < 4.5)
    swing = 0.9 * np.sin(2.0 * np.pi * 0.4 * time) * (time < 4.5)
    return time, [
        ("up", 0.0, go, 0.0 * time),
        ("down", np.pi, go, 0.0 * time),
        ("across", 0.5 * np.pi, 0.8 * go, 0.0 * time),
        ("slalom", 0.3, 0.7 * go, swing),
        ("spin", -1.2, 0.0 * time, np.where(time < 2.5, 0.8, -0.8) * go),
    ]


def write_study(folder, fault, values, seed=0):
    """Write the study of a chair with a fault."""
    rng = np.random.default_rng(seed)
    spec = mjchair.load_spec("power", "ramp", grade=GRADE, drive="normal")
    find(fault).apply(spec, values)
    folder.mkdir(parents=True, exist_ok=True)
    trials = []
    time, listed = manoeuvres()
    for name, heading, x, y in listed:
        inputs = mjchair.Inputs(time, {"joystick_x": x, "joystick_y": y})
        start = {"position": (0.0, 0.0), "heading": heading}
        run = mjchair.simulate(
            spec, inputs, SECONDS, initial=start, timestep=0.001, sample_rate=RATE
        )
        columns = {n: run[n] + s * rng.standard_normal(run.time.size) for n, s in NOISE.items()}
        columns |= {n: inputs.at(n, run.time) for n in inputs.controls}
        rows = np.column_stack([run.time, *columns.values()])
        lines = [",".join(["time", *columns]), *(",".join(f"{v:.7g}" for v in r) for r in rows)]
        write_whole(folder / f"{name}.csv", "\n".join(lines) + "\n")
        trials.append({"file": f"{name}.csv", "manoeuvre": name})
    study = {"model": "power", "drive": "normal", "scene": "ramp", "grade": GRADE}
    study |= {"noise": NOISE, "trial": trials}
    write_whole(folder / "study.toml", tomli_w.dumps(study))


def line_of(folder, fault, values):
    """What was hidden and what was found, as a line of a table."""
    found = json.loads((folder / "diagnosis" / "diagnosis.json").read_text())
    effects = [
        f"{effect['name']}: "
        + ", ".join(
            f"{name} {number['value']:.3f} +- {number['std'] or 0.0:.3f} {number['unit']}"
            for name, number in effect["parameters"].items()
        )
        for effect in found["effects"]
    ]
    hidden = ", ".join(f"{name} {value:g}" for name, value in values.items())
    gap = found["gap"]
    left = "" if gap["after"] is None else f" to {gap['after']:.2f}"
    told = "; ".join(effects) or "-"
    return f"| {fault}: {hidden} | {found['verdict']} | {told} | {gap['before']:.2f}{left} |"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", default="out/power_studies", help="default: %(default)s")
    parser.add_argument("--only", choices=FAULTS, help="one of the three")
    args = parser.parse_args()
    lines = []
    for fault in [args.only] if args.only else FAULTS:
        folder = Path(args.out) / fault
        write_study(folder, fault, FAULTS[fault])
        print(f"{fault}: hidden {FAULTS[fault]}", flush=True)
        code = cli.main(["diagnose", str(folder), "--out", str(folder / "diagnosis"), "--force"])
        if code:
            return code
        lines.append(line_of(folder, fault, FAULTS[fault]))
    print("\n".join(lines))
    return 0


if __name__ == "__main__":
    sys.exit(main())
