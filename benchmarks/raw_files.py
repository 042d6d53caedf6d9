"""From a laboratory's raw files to a verdict, on a person and a chair that are known.

What it does: the planar person of `five_segments.py` pushes a chair along a line, and is written
as the files that a laboratory has: two SmartWheels and a C3D of markers a run, a static trial, both
rims untouched. Then it runs what a person would: `mjchair gather`, `mjchair outcomes`, and, if
asked, `mjchair diagnose`. The files are made without any of mjchair's code.
What goes in: a folder, a seed, the person's mass and what is hidden. What comes out: OUT/raw,
OUT/study, OUT/verdict, the truth in OUT/truth (nothing of it is in the raw folder), and a table of
hidden against found. SI units; x forward, y left, z up.

    python benchmarks/raw_files.py OUT [--diagnose]
"""

from __future__ import annotations

import argparse
import json
import math
import re
import resource
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np
from five_segments import (
    FINE,
    HIP,
    SEGMENTS,
    Body,
    Chair,
    Hidden,
    Person,
    Rolled,
    Start,
    body,
    centre_of_mass,
    rims,
    roll,
    strokes,
)
from lab_formats import RATE, Rim, Style, write_c3d, write_smartwheel
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

Array = NDArray[np.float64]

CAMERAS = 120.0  # Hz
SEEN = 5e-4  # m, standard deviation of a marker
LATE = {"left": 0.0, "right": 0.15, "markers": 0.37}  # s, by which each recording begins after left
# N m, peak on each rim; with more a caster all but lifts, of which planar equations know nothing
TORQUE = 10.0
STARTS = 0.9  # m/s, as pushed runs begin
STANDS = 1.0  # s before the first stroke of a pushed run, and more until the hands move
SPUN = (9.0, 20.0)  # rad/s and s: the wheel off the floor, spun once and left alone
SLOWS = 0.15  # rad/s^2 of that wheel, assumption
PRESSES = 0.4  # of the tangential force of a hand is radial, towards the axle; assumption
GAPS = (("LWRA", 4.0, 0.12), ("RELB", 5.5, 0.5), ("LASI", 7.0, 0.3))  # marker, from s, for s
LATERAL = 0.6  # m, by which the chair's line lies beside the laboratory's origin
# Plug-in Gait markers: (point, along its segment from there, forward of it, to the left), m; the
# right ones mirror the left ones. Sizes of a person of 1.75 m, assumptions.
MIDDLE = {
    "C7": ("shoulder", "trunk", 0.08, -0.06, 0.0),
    "CLAV": ("shoulder", "trunk", 0.01, 0.08, 0.0),
    "STRN": ("shoulder", "trunk", -0.14, 0.10, 0.0),
    "T10": ("shoulder", "trunk", -0.22, -0.12, 0.0),
}
LEFT = {
    "SHO": ("shoulder", "trunk", 0.03, 0.0, 0.19),
    "FHD": ("neck", "head", 0.19, 0.09, 0.07),
    "BHD": ("neck", "head", 0.17, -0.09, 0.06),
    "UPA": ("elbow", "upper_arms", 0.14, 0.0, 0.25),
    "ELB": ("elbow", "upper_arms", 0.0, 0.0, 0.26),
    "FRM": ("wrist", "forearms", 0.11, 0.0, 0.27),
    "WRA": ("wrist", "forearms", 0.0, 0.03, 0.26),
    "WRB": ("wrist", "forearms", 0.0, -0.03, 0.26),
    "FIN": ("knuckle", "hands", 0.0, 0.0, 0.27),
    "ASI": ("hip", "", 0.08, 0.09, 0.12),
    "PSI": ("hip", "", 0.10, -0.10, 0.05),
}
MARKS = (
    MIDDLE
    | {f"L{name}": where for name, where in LEFT.items()}
    | {f"R{name}": (*where[:4], -where[4]) for name, where in LEFT.items()}
)


@dataclass(frozen=True)
class Plan:
    """What is made: the person, what is hidden, and how many runs of how many seconds.

    Attributes:
      start: m/s, at which pushed runs begin.
    """

    person: Person
    hidden: Hidden
    pushes: int = 4
    coasts: int = 4
    seconds: float = 10.0
    start: float = 0.0
    rim: Rim = field(default_factory=Rim)
    style: Style = field(default_factory=Style)


@dataclass(frozen=True)
class Run:
    """What truly happened in a run.

    Attributes:
      torque: of one hand on its rim, N m, at the times 0, FINE ... . way: m, of the rear axle, over
        time. towards: 1 or -1, along the laboratory's axis. begins: s, of the strokes.
    """

    name: str
    rolled: Rolled
    segments: Body
    torque: Array
    way: CubicSpline
    towards: float
    begins: Array

    def hand(self, time: Array) -> Array:
        """Torque of one hand, N m."""
        return np.interp(time, FINE * np.arange(self.torque.size), self.torque)


def runs(plan: Plan, seed: int = 0) -> list[Run]:
    """Every run: pushes begin at rest or rolling, coasts as the hands have left the rims."""
    rng = np.random.default_rng(seed)
    out = []
    for k in range(plan.pushes + plan.coasts):
        pushed = k < plan.pushes
        name = f"push{k + 1}" if pushed else f"coast{k + 1 - plan.pushes}"
        begins, strength = np.zeros(0), np.zeros(0)
        if pushed:
            begins, strength = strokes(plan.person, plan.seconds - STANDS, rng)
            begins = begins + STANDS
        moving = begins if plan.hidden.moves else begins[:0]
        segments = body(plan.person, Chair(), plan.seconds, moving, strength)
        fine = FINE * np.arange(round(plan.seconds / FINE) + 1)
        torque = rims(plan.person, begins, strength, fine)
        towards = 1.0 if k % 2 == 0 else -1.0
        start = Start(plan.start if pushed else 1.4 + 0.05 * rng.standard_normal(), towards)
        rolled = roll(plan.person, Chair(), plan.hidden, segments, torque, start)
        way = CubicSpline(rolled.time, rolled.speed).antiderivative()
        out.append(Run(name, rolled, segments, torque, way, towards, begins))
    return out


def points(person: Person, segments: Body, time: Array) -> dict[str, Array]:
    """Joints in the chair's axes, (n, 2): forward of the rear axle and above the floor, m."""
    length = {name: row[3] * person.stature for name, row in SEGMENTS.items()}
    angle = dict(zip(SEGMENTS, segments.angle(time).T, strict=True))

    def along(name: str, by: float) -> Array:
        return by * np.stack([np.sin(angle[name]), np.cos(angle[name])], axis=1)

    out = {"hip": np.tile(np.array(HIP), (time.size, 1))}
    out["shoulder"] = out["hip"] + along("trunk", length["trunk"])
    out["neck"] = out["hip"] + along("trunk", 1.05 * length["trunk"])
    out["elbow"] = out["shoulder"] + along("upper_arms", -length["upper_arms"])
    out["wrist"] = out["elbow"] + along("forearms", -length["forearms"])
    out["knuckle"] = out["wrist"] + along("hands", -length["hands"])
    return out


def marked(person: Person, segments: Body, time: Array) -> Array:
    """Markers (n, m, 3) in the chair's axes, m, in the order of MARKS."""
    joint = points(person, segments, time)
    angle = dict(zip(SEGMENTS, segments.angle(time).T, strict=True))
    out = np.zeros((time.size, len(MARKS), 3))
    for k, (point, segment, up, ahead, left) in enumerate(MARKS.values()):
        tilt = angle[segment] if segment else np.zeros(time.size)
        out[:, k, 0] = joint[point][:, 0] + up * np.sin(tilt) + ahead * np.cos(tilt)
        out[:, k, 1] = left
        out[:, k, 2] = joint[point][:, 1] + up * np.cos(tilt) - ahead * np.sin(tilt)
    return out


def in_laboratory(run: Run, time: Array, placed: Array) -> Array:
    """Markers in the laboratory's axes, m: y up, the chair going to and fro along z."""
    out = np.zeros_like(placed)
    out[..., 0] = LATERAL + run.towards * placed[..., 1]
    out[..., 1] = placed[..., 2]
    out[..., 2] = run.towards * (placed[..., 0] + run.way(time)[:, None] - 3.0)
    return out


def hand_loads(person: Person, run: Run, time: Array) -> Array:
    """Loads of one hand on its rim, (n, 6): N and N m, Mz > 0 driving forward."""
    from_axle = points(person, run.segments, time)["wrist"] - [0.0, Chair().rear_radius]
    place = np.arctan2(from_axle[:, 0], from_axle[:, 1])  # forward of the rim's top
    moment = run.hand(time)
    pull = moment / Chair().rim_radius
    out = np.zeros((time.size, 6))
    out[:, 0] = pull * (np.cos(place) - PRESSES * np.sin(place))
    out[:, 1] = -pull * (np.sin(place) + PRESSES * np.cos(place))
    out[:, 5] = moment
    return out


def write(plan: Plan, folder: Path, truth: Path, seed: int = 0) -> list[Run]:
    """The raw files into one folder, the truth into another; the runs as they were."""
    folder.mkdir(parents=True)
    truth.mkdir(parents=True)
    rng = np.random.default_rng([seed, 1])
    zero = dict(zip(LATE, rng.uniform(0.0, 2.0 * np.pi, 2), strict=False))  # of each encoder
    every = runs(plan, seed)
    for run in every:
        for side in ("left", "right"):
            _wheel(plan, run, side, folder, zero[side], rng)
        _markers(plan, run, folder, rng)
        _truth(plan, run, truth)
    for side in ("left", "right"):
        _untouched(plan, side, folder, zero[side], rng)
    write_static(plan, folder, rng)
    said = {
        "seed": seed,
        "clocks": {name: late for name, late in LATE.items() if name != "left"},
        "person": asdict(plan.person),
        "hidden": asdict(plan.hidden),
    }
    (truth / "truth.json").write_text(json.dumps(said, indent=1) + "\n", encoding="utf-8")
    return every


def _wheel(
    plan: Plan, run: Run, side: str, folder: Path, zero: float, rng: np.random.Generator
) -> None:
    time = np.arange(LATE[side], plan.seconds, 1.0 / RATE)
    gain = {"left": plan.hidden.gain_left, "right": plan.hidden.gain_right}[side]
    turned = zero + run.way(time) / Chair().rear_radius
    speed = np.interp(time, run.rolled.time, run.rolled.speed) / Chair().rear_radius
    hand = hand_loads(plan.person, run, time) / (1.0 + gain)
    write_smartwheel(
        folder / f"{run.name}_{side}.csv", side, turned, speed, hand, rng,
        radius=Chair().rear_radius, rim=plan.rim, style=plan.style,
    )  # fmt: skip


def _untouched(plan: Plan, side: str, folder: Path, zero: float, rng: np.random.Generator) -> None:
    fast, lasts = SPUN
    time = np.arange(0.0, lasts, 1.0 / RATE)
    turned = zero + fast * time - 0.5 * SLOWS * time**2
    write_smartwheel(
        folder / f"baseline_{side}.csv", side, turned, fast - SLOWS * time,
        np.zeros((time.size, 6)), rng, radius=Chair().rear_radius, rim=plan.rim, style=plan.style,
    )  # fmt: skip


def _markers(plan: Plan, run: Run, folder: Path, rng: np.random.Generator) -> None:
    time = np.arange(LATE["markers"], plan.seconds, 1.0 / CAMERAS)
    placed = in_laboratory(run, time, marked(plan.person, run.segments, time))
    placed += SEEN * rng.standard_normal(placed.shape)
    for name, begin, lasts in GAPS:
        gone = (time >= begin) & (time < begin + lasts)
        placed[gone, list(MARKS).index(name)] = np.nan
    write_c3d(
        folder / f"{run.name}_markers.c3d", list(MARKS), placed, CAMERAS, unit="mm", factor=1e3
    )


def write_static(plan: Plan, folder: Path, rng: np.random.Generator) -> None:
    """Two seconds of the person at rest, hands on the rims."""
    time = np.arange(0.0, 2.0, 1.0 / CAMERAS)
    segments = body(plan.person, Chair(), 2.0, np.zeros(0), np.zeros(0))
    still = Rolled(time, np.zeros(time.size), np.zeros(time.size))
    way = CubicSpline(time, still.speed)
    run = Run("static", still, segments, np.zeros(2), way, 1.0, np.zeros(0))
    placed = in_laboratory(run, time, marked(plan.person, segments, time))
    placed += SEEN * rng.standard_normal(placed.shape)
    write_c3d(folder / "static.c3d", list(MARKS), placed, CAMERAS, unit="mm", factor=1e3)


def _truth(plan: Plan, run: Run, folder: Path) -> None:
    time = run.rolled.time
    np.savez_compressed(
        folder / f"{run.name}.npz", time=time, speed=run.rolled.speed, way=run.way(time),
        torque=run.hand(time), begins=run.begins,
        rider_motion=centre_of_mass(plan.person, run.segments, time),
    )  # fmt: skip


def gather_command(plan: Plan, raw: Path, study: Path) -> list[str]:
    """What a person who has these files types, with what gather asks for."""
    told = ["--rider-mass", f"{plan.person.mass:g}", "--chair-mass", f"{Chair().mass:g}"]
    return ["gather", str(raw), "--out", str(study), *told, "--floor", "overground"]


def _mjchair(*arguments: str) -> tuple[str, float]:
    """What a command printed, and its processor time, s; it ends here if the command fails."""
    print("$ mjchair", " ".join(arguments), flush=True)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(
        [sys.executable, "-m", "mjchair", *arguments], capture_output=True, text=True
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    if done.returncode:
        sys.exit(done.stderr)
    print(done.stdout + done.stderr, flush=True)
    return done.stdout, used


def clocks(said: str) -> dict[str, dict[str, float]]:
    """Offsets (s) of gather.log: instrument of LATE -> trial -> against the left rim."""
    out: dict[str, dict[str, float]] = {"right": {}, "markers": {}}
    for name, offset in re.findall(
        r"clock of (\S+) on that of \S+_left\.csv: offset (\S+) s", said
    ):
        trial, _, instrument = Path(name).stem.rpartition("_")
        out[instrument][trial] = float(offset)
    return out


def _table(path: Path) -> dict[str, Array]:
    """Columns of a gathered table; NaN in an empty cell."""
    lines = path.read_text(encoding="utf-8").splitlines()
    rows = [[float(cell) if cell else math.nan for cell in line.split(",")] for line in lines[1:]]
    return dict(zip(lines[0].split(","), np.array(rows).T, strict=True))


def moved_share(study: Path, truth: Path, every: Sequence[Run]) -> float:
    """Displacement of the person in the gathered tables over the true one, pushed runs, 1."""
    seen, true = [], []
    for run in every:
        if run.begins.size:
            table, told = _table(study / f"{run.name}.csv"), np.load(truth / f"{run.name}.npz")
            there = np.isfinite(table["rider_motion"])
            time = table["time"][there] + LATE["right"]  # a table begins with its last torque
            seen.append(table["rider_motion"][there])
            true.append(np.interp(time, told["time"], told["rider_motion"]))
    return float(np.polyfit(np.concatenate(true), np.concatenate(seen), 1)[0])


def clock_rows(said: str, every: Sequence[Run]) -> list[tuple[str, str, str]]:
    """Rows of the table: true and found beginnings of recordings, pushes and coasts apart."""
    pushed = {run.name for run in every if run.begins.size}
    rows = []
    for instrument, trials in clocks(said).items():
        for word, mine in (("pushes", pushed), ("coasts", trials.keys() - pushed)):
            found = [offset for trial, offset in trials.items() if trial in mine]
            if found:
                span = f"{min(found):.5f} to {max(found):.5f}"
                rows.append((f"clock of {instrument}, {word} (s)", f"{LATE[instrument]:g}", span))
    return rows


def verdict_rows(plan: Plan, folder: Path, share: float) -> list[tuple[str, str, str]]:
    """Rows of the table: sizes, verdict and closure of a diagnosis."""
    found = json.loads((folder / "diagnosis.json").read_text(encoding="utf-8"))
    sizes = {e["name"]: e["parameters"] for e in found["effects"]}

    def size(effect: str, parameter: str) -> str:
        told = sizes.get(effect, {}).get(parameter)
        return "not named" if told is None else f"{told['value']:.4g} +- {told['std'] or 0.0:.2g}"

    moved = sizes.get("rider_motion", {}).get("mass")
    product = "not named" if moved is None else f"{moved['value'] * share:.1f}"
    gap = found["gap"]
    closed = "none" if gap["after"] is None else f"{gap['after']:.2f}"
    rest = [name for name in sizes if name not in ("rider_motion", "rolling_resistance")]
    closures = [
        f"{e['name']} {e['closure']:.2f}" for e in found["effects"] if e["closure"] is not None
    ]
    rivals = ["/".join(names) for names in found["alternatives"]]
    verdict = f"{found['verdict']}{'; more is missing' if found['more_missing'] else ''}"
    return [
        ("mass that moves (kg)", f"{plan.person.mass:g}", size("rider_motion", "mass")),
        ("that times the share (kg)", f"{plan.person.mass:g}", product),
        (
            "rolling resistance added",
            f"{plan.hidden.rolling:g}",
            size("rolling_resistance", "coefficient"),
        ),
        ("verdict", "named", verdict),
        ("other effects", "none", ", ".join(rest) or "none"),
        ("not told apart", "", "; ".join(rivals) or "nothing"),
        ("closure", "1", ", ".join(closures) or "none"),
        ("gap", "", f"{gap['before']:.2f} -> {closed} (noise {gap['noise_floor']:.2f})"),
    ]


def _print(rows: Sequence[tuple[str, str, str]]) -> None:
    every = [("", "hidden", "found"), *rows]
    wide = [max(len(row[k]) for row in every) for k in range(2)]
    for row in every:
        print(f"{row[0]:<{wide[0]}}  {row[1]:<{wide[1]}}  {row[2]}")


def main(given: Sequence[str] | None = None) -> None:
    """Write the files, run the commands, print hidden against found."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("out", type=Path, help="a folder that does not exist yet")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--mass", type=float, default=75.0, help="of the person, kg")
    parser.add_argument("--rolling", type=float, default=0.005, help="rolling resistance added")
    parser.add_argument("--gain-left", type=float, default=0.0, help="of the left rim, 0.05: 1.05")
    parser.add_argument("--gain-right", type=float, default=0.0, help="of the right rim")
    parser.add_argument("--start", type=float, default=STARTS, help="speed of pushed runs, m/s")
    parser.add_argument("--torque", type=float, default=TORQUE, help="peak on each rim, N m")
    parser.add_argument("--pushes", type=int, default=4)
    parser.add_argument("--coasts", type=int, default=4)
    parser.add_argument("--diagnose", action="store_true", help="some minutes")
    args = parser.parse_args(given)
    hidden = Hidden(args.rolling, gain_left=args.gain_left, gain_right=args.gain_right)
    person = Person(mass=args.mass, torque=args.torque)
    plan = Plan(person, hidden, args.pushes, args.coasts, start=args.start)
    raw, study, truth = (args.out / name for name in ("raw", "study", "truth"))
    every = write(plan, raw, truth, args.seed)
    print(f"hidden: {hidden}; {plan.person}; clocks, s: {LATE}; kept in {truth}")
    _, used = _mjchair(*gather_command(plan, raw, study))
    said = (study / "gather.log").read_text(encoding="utf-8")
    share = moved_share(study, truth, every)
    rows = [
        *clock_rows(said, every),
        ("displacement of the person", "1", f"{share:.3f}"),
        ("processor time of gather (s)", "", f"{used:.0f}"),
    ]
    if args.pushes:
        _mjchair("outcomes", f"{raw}/push1_left.csv", "--baseline", f"{raw}/baseline_left.csv")
    if args.diagnose:
        verdict = args.out / "verdict"
        _, used = _mjchair("diagnose", str(study), "--out", str(verdict))
        rows += verdict_rows(plan, verdict, share)
        rows.append(("processor time of diagnose (s)", "", f"{used:.0f}"))
    _print(rows)


if __name__ == "__main__":
    main()
