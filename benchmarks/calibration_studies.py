"""Base studies of the calibration: made, screened, and kept as linear algebra.

What it does: makes short studies with the generators of benchmarks/blind, a power chair and a
person of five segments, diagnoses each up to its choice of effects, and keeps the white columns of
every effect, force, nuisance and disturbance (for `calibration_draws.py`), and what the real study
itself said (for a comparison). Out: a pickle for each study, and real.jsonl.

    python benchmarks/calibration_studies.py out/calibration
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import sys
import time
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).parent / "blind"))

import five_segments
import numpy as np
import planar
from cases import case, parameters, planar_case
from generator import MANOEUVRES, SEAL, Case, make, unseal
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from mjchair import practice
from mjchair.diagnosis.data.study_file import read_study
from mjchair.diagnosis.diagnose import study_effects
from mjchair.diagnosis.explain import missing_force
from mjchair.diagnosis.explain.candidates import Start
from mjchair.diagnosis.explain.choice import closure
from mjchair.diagnosis.explain.fits import Fits
from mjchair.diagnosis.explain.probability import OUTSIDE, weights
from mjchair.diagnosis.explain.screening import Base, gap_after, prepare, screen_columns, silent
from mjchair.diagnosis.explain.selection import choose
from mjchair.diagnosis.fit.bench import Bench
from mjchair.diagnosis.fit.column_ids import ColumnId
from mjchair.diagnosis.fit.elimination import eliminate_window
from mjchair.diagnosis.fit.process import KINDS, TURNING, Part
from mjchair.diagnosis.replay.pulses import Force
from mjchair.diagnosis.replay.sampling import residual
from mjchair.effects.library import find
from mjchair.model.engine_warnings import without_engine_warnings

Array = NDArray[np.float64]
SEED = 900
NOISES = 12  # runs of the planar chair with nothing hidden
FORCES = (Force.FORWARD, Force.LEFTWARD, Force.YAW)
SHAPED = (Part.PERSON, *TURNING)  # parts of the process that a time alone does not correlate
FEW = ("left_wheel_speed", "right_wheel_speed", "imu_gyro.z", "imu_accelerometer.x")


@dataclass(frozen=True)
class Made:
    """How a base study is made: by which generator, its number, trials, seconds, channels.

    drawn: whether studies are drawn from it; others are only compared with what is stated.
    """

    how: str
    number: int = 0
    trials: int = 4
    seconds: float = 4.0
    channels: tuple[str, ...] | None = None
    drawn: bool = True

    @property
    def name(self) -> str:
        """Of its files."""
        return f"{self.how}_{self.number:02d}"


MADE = (
    Made("planar", 1, 4), Made("mujoco", 2, 3), Made("planar", 2, 3, 5.0),
    Made("mujoco", 1, 4, 4.0, FEW), Made("power", 0, 3), Made("planar", 4, 6, 4.0),
    Made("planar", 0, 3), Made("mujoco", 5, 4), Made("five", 0, 4, 8.0), Made("planar", 6, 4),
    Made("mujoco", 7, 2, 6.0), Made("planar", 9, 4), Made("power", 1, 4), Made("mujoco", 4, 4),
    Made("planar", 7, 4, 4.0, FEW), Made("mujoco", 8, 9, 4.0, FEW), Made("planar", 11, 4),
    Made("five", 1, 4, 8.0), Made("planar", 12, 4, drawn=False), Made("mujoco", 9, 4, drawn=False),
    Made("planar", 14, 4, drawn=False), Made("planar", 16, 4, drawn=False),
    Made("planar", 17, 4, drawn=False),
)  # fmt: skip


@dataclass
class Block:
    """One window as white columns, by the noise that the study showed.

    Attributes:
      J: (n, p) nuisances, then effects and forces. Z: (n, k) of its state and its disturbances,
        with prior precision (k,). strange: (n, m) of forces that no effect of the library makes.
      pulses: force -> (times (q,), s; white answers (n, q)). shaped: part of the process -> white
        columns (n, q) of level 1. channel, frequency: (n,), of each row. run: index of its run.
    """

    J: Array
    Z: Array
    precision: Array
    states: int
    strange: Array
    pulses: dict[Force, tuple[Array, Array]]
    shaped: dict[Part, Array]
    channel: NDArray[np.int64]
    frequency: Array
    run: int


@dataclass
class Kept:
    """A base study.

    Attributes:
      columns: of J. nuisance: how many of them, at the start, are nuisances. hidden: columns that
        a free start takes away. starts: of the effects. fitted: windows that may be fitted to.
      manoeuvres: of the runs. levels: part of the process -> (runs,), N or N m.
      signals: what the planar generator's chair does with a hidden effect more than without, white
        (n,) a window, by the effect's name (OUTSIDE: of what is no effect). noises: what its chair,
        floor and sensors show beyond the model with nothing hidden, likewise.
    """

    name: str
    columns: list[ColumnId]
    nuisance: int
    hidden: NDArray[np.bool_]
    starts: list[Start]
    blocks: list[Block]
    fitted: NDArray[np.int64]
    manoeuvres: list[str]
    levels: dict[str, Array]
    signals: dict[str, list[list[Array]]] = field(default_factory=dict)
    noises: list[list[Array]] = field(default_factory=list)


def make_study(made: Made, folder: Path) -> dict:
    """Write the study; returns what is hidden in it."""
    if made.how == "planar":
        held = None if made.trials < 4 else made.number % made.trials
        # columns stand around the chair that was measured, so that noises and signals of the chair
        # without effects are only at home around that one
        hidden = Case("none") if made.drawn else planar_case(made.number, SEED)
        planar.make(folder, hidden, 1000 * SEED + made.number, made.trials, made.seconds, held)
        _only(folder, made.channels)
    elif made.how == "mujoco":
        hidden = case(made.number, SEED)
        make(folder, hidden, 1000 * SEED + made.number, made.trials, made.seconds, made.channels)
    elif made.how == "power":
        name = ("rolling_resistance", "floor_slope")[made.number]
        return _practice(folder, name, made.trials)
    else:
        name = ("strokes_rolling", "measured")[made.number]
        told = five_segments.CASES[name]
        five_segments.write(
            five_segments.Case(told.hidden, measured=told.measured, coasts=2, pushes=2), folder
        )
        return {"kind": "two", "hidden": {"rolling_resistance": {}, "rider_motion": {}}}
    answer: dict = unseal(folder / SEAL)
    return answer


def _practice(folder: Path, name: str, trials: int) -> dict:
    folder.mkdir(parents=True, exist_ok=True)
    whole = practice.manoeuvres
    practice.manoeuvres = lambda: whole()[:trials]  # type: ignore[assignment]
    try:
        files = practice.hide(find(name), seed=SEED, model="power")
    finally:
        practice.manoeuvres = whole
    for file, content in files.items():
        path = folder / file
        if isinstance(content, bytes):
            path.write_bytes(content)
        else:
            path.write_text(content, encoding="utf-8")
    return {"kind": "one", "hidden": {name: {}}}


def _only(folder: Path, channels: tuple[str, ...] | None) -> None:
    """Leave only these channels, time and torques in the tables."""
    import csv

    for path in folder.glob("*.csv") if channels else ():
        with path.open(encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        kept = [n for n in rows[0] if n in (*channels, "time", "left_wheel", "right_wheel")]
        with path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, kept, extrasaction="ignore")
            writer.writeheader()
            writer.writerows(rows)


def keep(name: str, base: Base) -> Kept:
    """A screened study as linear algebra."""
    bench, track = base.bench, base.around.track
    columns = {**base.nuisances, **base.columns}
    strange = strange_columns(base)
    blocks = []
    for i, w in enumerate(bench.simulator.windows):
        miss = residual(bench.simulator.measured(w), track.predicted[i], bench.simulator.channels)
        stacked = np.stack([c[i] for c in (*columns.values(), *strange)], axis=2)
        white = eliminate_window(
            bench.simulator, track, bench.whitener, i, miss, stacked, bench.process
        )
        assert bench.process is not None
        pulses = {}
        for force in FORCES:
            which = bench.process.members(i, force)
            times = np.array([bench.process.pulses[k].time for k in which])
            pulses[force] = (times, bench.process.answers_of(i, which, bench.whitener))
        blocks.append(
            Block(
                J=white.J[:, : len(columns)],
                Z=white.Z,
                precision=white.precision,
                states=white.states,
                strange=white.J[:, len(columns) :],
                pulses=pulses,
                shaped={part: _shaped(bench, i, part) for part in SHAPED},
                channel=bench.whitener.channel[i],
                frequency=bench.whitener.frequency[i],
                run=w.run,
            )
        )
    size = np.diag(base.system.G.sum(axis=0))
    hidden = size <= 0.0
    hidden[: base.system.nuisance] = False
    assert bench.process is not None
    return Kept(
        name=name,
        columns=list(columns),
        nuisance=base.system.nuisance,
        hidden=hidden,
        starts=base.starts,
        blocks=blocks,
        fitted=bench.windows,
        manoeuvres=[r.manoeuvre for r in bench.simulator.study.runs],
        levels={str(p): v for p, v in bench.process.levels.items()},
    )


def _shaped(bench: Bench, window: int, part: Part) -> Array:
    """White columns (n, q) of a part of the process of level 1, each of one standard deviation."""
    assert bench.process is not None
    force = KINDS[part].force
    return bench.process.force_columns(window, bench.whitener, force, {part: 1.0})


def add_planar(kept: Kept, base: Base, made: Made) -> None:
    """Signals and noises of the planar generator, on the windows of the study that it made.

    They are runs of the very chair of the study, so that their errors of form are a real chair's.
    """
    quiet = _planar_tables(made, Case("none"))
    rng = np.random.default_rng([SEED, made.number])
    for name in (*planar.EFFECTS, *planar.OUTSIDE):
        for _ in range(0 if name.startswith("sensor") else 2):
            case_ = Case("one", {name: parameters(name, rng)})
            moved = _planar_tables(made, case_)
            change = [{n: a[n] - b[n] for n in a} for a, b in zip(moved, quiet, strict=True)]
            key = OUTSIDE if name in planar.OUTSIDE else name
            kept.signals.setdefault(key, []).append(_white(base, change, nothing=True))
    for again in range(NOISES):
        kept.noises.append(_white(base, _planar_tables(made, Case("none"), 1 + again)))


def _planar_tables(made: Made, hidden: Case, again: int = 0) -> list[dict[str, Array]]:
    """Columns of each trial as the planar generator senses them; `again` 0: without noise."""
    seed = 1000 * SEED + made.number
    chair = planar.chair(np.random.default_rng([seed, 2]), hidden.hidden)
    kind = planar.senses(np.random.default_rng([seed, 1]))
    if not again:
        kind = replace(kind, noise=dict.fromkeys(kind.noise, 0.0))
    out = []
    for k in range(made.trials):
        man = MANOEUVRES[k % len(MANOEUVRES)]
        time_, states, _ = planar.drive(chair, man, made.seconds, 1000 * seed + k + 77 * again)
        exact = planar.exact(chair, time_, states)
        rng = np.random.default_rng([seed, 3, again])
        when, columns = planar.sense(rng, kind, time_, exact, Case("none"))
        out.append({"time": when, **columns})
    return out


def _white(base: Base, tables: list[dict[str, Array]], nothing: bool = False) -> list[Array]:
    """White (n,) a window, of measured columns less predictions; `nothing`: less nothing."""
    bench = base.bench
    out = []
    for i, w in enumerate(bench.simulator.windows):
        measured = bench.simulator.measured(w)
        time_ = bench.simulator.study.runs[w.run].trial.time[w.rows]
        table = tables[w.run]
        rows = np.clip(np.round(time_ * planar.RATE).astype(int), 0, len(table["time"]) - 1)
        values = np.column_stack([table[n][rows] for n in bench.simulator.channels])
        if not nothing:
            predicted = base.around.track.predicted[i]
            values = residual(values, predicted, bench.simulator.channels)
        values = np.where(np.isnan(measured), 0.0, np.nan_to_num(values))
        out.append(bench.whitener(i, values[:, :, None])[:, 0])
    return out


def strange_columns(base: Base) -> list[list[Array]]:
    """Forces that no effect makes: a strap, a bent rim, a gust, a corrugated floor, a side sail."""
    around = base.around
    known = missing_force.drivers(base.bench, around.track)
    rng = np.random.default_rng(5)
    at = []
    for p in around.pulses:
        d = known[p.window]
        row = int(np.clip(np.searchsorted(d["time"], p.time), 0, len(d["time"]) - 1))
        at.append({n: float(v[row]) for n, v in d.items()})
    value = {n: np.array([a[n] for a in at]) for n in at[0]}
    forward = np.array([float(p.force == Force.FORWARD) for p in around.pulses])
    yaw = np.array([float(p.force == Force.YAW) for p in around.pulses])
    run = np.array([base.bench.simulator.windows[p.window].run for p in around.pulses])
    way = np.sign(value["speed"])
    middle = float(np.median(np.abs(value["speed"])))
    sizes = []
    for share in (0.8, 1.1):
        catch = 0.5 * (1.0 + np.tanh((np.abs(value["speed"]) - share * middle) / 0.03)) * way
        sizes.append(-catch * forward + 0.25 * catch * yaw)
    for side, arm in (("left_angle", 0.28), ("right_angle", -0.28)):
        turn = np.sin(value[side] + rng.uniform(0.0, 6.3))
        sizes.append(turn * forward - arm * turn * yaw)
    for which in rng.permutation(np.unique(run))[:2]:
        mine = run == which
        first, last = value["time"][mine].min(), value["time"][mine].max()
        bell = np.exp(-0.5 * ((value["time"] - rng.uniform(first, last)) / 0.35) ** 2) * mine
        sizes.append(bell * (forward + 0.2 * yaw))
    for length in (0.7, 1.6):
        wave = np.sin(2.0 * np.pi / length * (value["x"] + 0.3 * value["y"]))
        sizes.append(wave * forward)
    sizes.append(np.abs(value["speed"]) * value["speed"] * yaw)
    sizes.append(-np.abs(value["yaw_rate"]) * way * forward)
    return [
        missing_force.shaped_column(base.bench, around.pulses, around.answers, s) for s in sizes
    ]


def one(made: Made, out: Path, known: bool = False) -> dict:
    """Make a study, diagnose it (unless that is known), keep its columns; what it said."""
    folder = out / f"study_{made.name}"
    answer = make_study(made, folder)
    began = time.perf_counter()
    with threadpool_limits(1, user_api="blas"), without_engine_warnings():
        study = read_study(folder)
        bench, first = prepare(study, threads=1)
        base = screen_columns(bench, first, study_effects(study))
        screened = time.perf_counter() - began
        import cloudpickle  # whoever only draws needs none

        with (out / f"{made.name}.pkl").open("wb") as file:
            kept = keep(made.name, base)
            if made.how == "planar" and made.drawn:
                add_planar(kept, base, made)
            cloudpickle.dump(kept, file)
        if known:
            shutil.rmtree(folder)
            return {}
        gap = gap_after(base, base.plain)
        choice = choose(Fits(base, silent)) if gap.exists else None
        found = {name: [w.prior, w.evidence, w.fitted] for name, w in weights(base, choice).items()}
    shutil.rmtree(folder)
    line = {
        "study": made.name,
        "made": asdict(made),
        "answer": answer,
        "gap": gap.exists,
        "chosen": "+".join(choice.hypothesis.keys) if choice is not None else "",
        "weights": found,
        "screened": screened,
        "seconds": time.perf_counter() - began,
    }
    if choice is not None:
        line |= {
            "gap_left": choice.after.exists,
            "rivals": [[r.hypothesis.keys for r in group] for group in choice.rivals],
            "closure": closure(gap, base, choice.fitted, choice.after),
        }
    return line


def main() -> None:
    """Every base study that has no line yet."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("out", type=Path)
    parser.add_argument("--only", nargs="*")
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    path = args.out / "real.jsonl"
    lines = path.read_text().splitlines() if path.exists() else []
    have = {json.loads(line)["study"] for line in lines}
    for made in MADE:
        known = made.name in have
        if (known and (args.out / f"{made.name}.pkl").exists()) or (
            args.only and made.name not in args.only
        ):
            continue
        try:
            line = one(made, args.out, known)
        except Exception as error:
            print(f"{made.name}: {type(error).__name__}: {error}", flush=True)
            continue
        if not line:
            print(made.name, flush=True)
            continue
        with path.open("a") as file:
            file.write(json.dumps(line) + "\n")
        print(made.name, line["answer"]["hidden"], "->", line["chosen"], flush=True)


if __name__ == "__main__":
    main()
