"""Make blind studies, diagnose them, open the seals, and write the table.

    python benchmarks/blind/run.py --seed 100 --count 200 --work out/blind

Resumes where it stopped: a study that has a line in results_SEED.jsonl is not run again.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import time
import traceback
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import planar
from cases import case, planar_case
from generator import SEAL, make, unseal
from table import table

import mjchair


def one(
    folder: Path, number: int, seed: int, trials: int, seconds: float, threads: int, how: str
) -> dict:
    """Make, diagnose, and only then open the seal of one study."""
    study = folder / f"study_{how}_{seed}_{number:03d}"
    hidden, maker = (case, make) if how == "mujoco" else (planar_case, planar.make)
    maker(study, hidden(number, seed), 1000 * seed + number, trials, seconds, held=number % trials)
    began = time.perf_counter()
    try:
        found = mjchair.diagnose(study, threads=threads).to_dict()
    except Exception:  # a crash is a result, and the table counts it
        found = {"verdict": "error", "effects": [], "alternatives": [], "candidates": [],
                 "gap": {}, "notes": [traceback.format_exc()]}  # fmt: skip
    took = time.perf_counter() - began
    answer = unseal(study / SEAL)
    shutil.rmtree(study)
    return {
        "number": number,
        "answer": answer,
        "seconds": took,
        **{k: found[k] for k in ("verdict", "effects", "alternatives", "gap", "notes")},
        "candidates": [
            {
                k: c.get(k)
                for k in ("name", "channel", "detectability", "collinear", "held_out_gain")
            }
            for c in found["candidates"]
        ],
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=100)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--numbers", type=int, nargs="+", help="cases, instead of first and count")
    parser.add_argument("--trials", type=int, default=6)
    parser.add_argument("--seconds", type=float, default=6.0)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--generator", choices=("mujoco", "planar"), default="mujoco")
    parser.add_argument("--work", type=Path, default=Path("out/blind"))
    args = parser.parse_args()
    args.work.mkdir(parents=True, exist_ok=True)
    path = args.work / f"results_{args.generator}_{args.seed}.jsonl"
    done = [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []
    have = {line["number"] for line in done}
    numbers = args.numbers or range(args.first, args.first + args.count)
    todo = [n for n in numbers if n not in have]
    threads = max(1, (os.cpu_count() or 1) // args.workers)
    with ProcessPoolExecutor(args.workers, get_context("spawn")) as pool:
        running = [
            pool.submit(
                one, args.work, n, args.seed, args.trials, args.seconds, threads, args.generator
            )
            for n in todo
        ]
        for future in as_completed(running):
            line = future.result()
            with path.open("a") as file:
                file.write(json.dumps(line) + "\n")
            done.append(line)
            names = [e["name"] for e in line["effects"]]
            print(line["number"], line["answer"]["kind"], line["answer"]["reached"],
                  line["verdict"], names, line["alternatives"], f"{line['seconds']:.0f} s",
                  flush=True)  # fmt: skip
    print(table(done))


if __name__ == "__main__":
    main()
