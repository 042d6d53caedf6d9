"""How well a moving rider foretells the speed within the strokes of a person who was measured.

What it does: gathers the SmartWheel recording that ships, cuts it between two strokes, fits the
chair to one part and foretells the other, once with a rigid rider and once with what the diagnosis
adds. Out: on the held-out strokes, the rms of the measured less the foretold speed, its mean in
each window taken away (m/s), and how far the peak of the speed is off (share of each stroke).

    python benchmarks/person_strokes.py out/person --hold second
"""

from __future__ import annotations

import argparse
import os
from itertools import pairwise
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

import mjchair
from mjchair.cli import main as mjchair_command
from mjchair.diagnosis.fit.nonlinear import Fitted
from mjchair.diagnosis.replay import strokes
from mjchair.diagnosis.replay.sampling import residual
from mjchair.diagnosis.replay.simulator import WindowSimulator

Array = NDArray[np.float64]
RAW = Path(__file__).parents[1] / "data" / "smartwheel"
CUT = 6.95  # s, after five strokes and before four
TOTAL = 92.0  # kg, person and chair: assumed, and left free within 30 %
RADIUS = 0.298  # m, that the wheel was set to
RATE = 240.0  # Hz, of the recording
COVERED = 0.8  # of a stroke
SMOOTH = 41  # samples over which a speed is taken: a cut at about 6 Hz
EDGE = 10  # samples at each end of a window that the smoothing spoils
CHANNEL = "left_wheel_angle"


def cut_in_two(folder: Path, hold: str) -> None:
    """Write the study: `first.csv` and `second.csv`, one of them (`hold`) held out."""
    gathered = folder / "gathered"
    told = ["--mass", f"{TOTAL:g}", "--floor", "overground", "--force"]
    if mjchair_command(["gather", str(RAW), "--out", str(gathered), *told]):
        raise SystemExit("gather failed")
    lines = (gathered / "propulsion.csv").read_text(encoding="utf-8").splitlines()
    times = [float(line.split(",")[0]) for line in lines[1:]]
    head = (gathered / "study.toml").read_text(encoding="utf-8").split("[[trial]]")[0]
    text = head + "[nuisance]\nmass = 0.3\n"
    for name, inside in (("first", lambda t: t < CUT), ("second", lambda t: t >= CUT)):
        mine = [lines[0], *(x for x, t in zip(lines[1:], times, strict=True) if inside(t))]
        (folder / f"{name}.csv").write_text("\n".join(mine) + "\n", encoding="utf-8")
        text += f'\n[[trial]]\nfile = "{name}.csv"\nmanoeuvre = "push"\n'
        text += "hold_out = true\n" if name == hold else ""
    (folder / "study.toml").write_text(text, encoding="utf-8")


def speeds(simulator: WindowSimulator, fitted: Fitted) -> list[tuple[Array, Array, Array]]:
    """Of each held-out window: times (n,), s, measured and foretold speed (n,), m/s."""
    column = list(simulator.channels).index(CHANNEL)
    out = []
    for i, w in enumerate(simulator.windows):
        run = simulator.study.runs[w.run]
        if not run.hold_out:
            continue
        measured = simulator.measured(w)
        off = residual(measured, fitted.track.predicted[i], simulator.channels)[:, column]
        there = ~np.isnan(off)
        if there.sum() < SMOOTH + 2 * EDGE:
            continue
        time = run.trial.time[w.rows][there]
        known, missed = (_speed(time, v[there]) for v in (measured[:, column], off))
        out.append((time[EDGE:-EDGE], known, known - missed))
    return out


def _speed(time: Array, angle: Array) -> Array:
    every = float(np.median(np.diff(time)))
    return RADIUS * savgol_filter(angle, SMOOTH, 2, deriv=1, delta=every)[EDGE:-EDGE]


def rms_within(told: list[tuple[Array, Array, Array]]) -> float:
    """Of measured less foretold speed, the mean of each window taken away, m/s."""
    off = [(a - b) - np.mean(a - b) for _, a, b in told]
    return float(np.sqrt(np.mean(np.concatenate(off) ** 2)))


def peaks_off(told: list[tuple[Array, Array, Array]], begins: Array) -> Array:
    """How far the peak of the foretold speed is off in each stroke, as a share of it; (strokes,).

    Strokes that windows cover by less than COVERED are left out.
    """
    time, known, foretold = (np.concatenate(part) for part in zip(*told, strict=True))
    out = []
    for begin, end in pairwise(begins):
        inside = (time >= begin) & (time < end)
        if inside.sum() > COVERED * RATE * (end - begin):
            peaks = [time[inside][np.argmax(v[inside])] for v in (known, foretold)]
            out.append(abs(peaks[1] - peaks[0]) / (end - begin))
    return np.array(out)


def main() -> None:
    """Cut, diagnose, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("out", type=Path)
    parser.add_argument("--hold", choices=("first", "second"), default="second")
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    cut_in_two(args.out, args.hold)
    diagnosis = mjchair.diagnose(args.out)
    names = [(e.name, {n: round(p.value, 3) for n, p in e.parameters.items()})
             for e in diagnosis.effects]  # fmt: skip
    print(diagnosis.verdict, names)
    base, choice = diagnosis.stages.base, diagnosis.stages.choice
    simulator = base.bench.simulator
    begins = strokes.beginnings(next(r for r in simulator.study.runs if r.hold_out))
    fits = [("rigid", base.plain)] + ([("moving", choice.fitted)] if choice else [])
    for name, fitted in fits:
        told = speeds(simulator, fitted)
        off = ", ".join(f"{share:.1%}" for share in peaks_off(told, begins))
        print(f"{name:7} {rms_within(told):.4f} m/s; peak off by {off} of the stroke")


if __name__ == "__main__":
    main()
