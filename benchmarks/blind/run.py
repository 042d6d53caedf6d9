"""Make blind studies, diagnose them, open the seals, and write the table.

    python benchmarks/blind/run.py --seed 100 --count 200 --work out/blind

Resumes where it stopped: a study that has a line in results.jsonl is not run again.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from cases import case
from generator import SEAL, make, unseal
from table import table

import mjchair


def one(folder: Path, number: int, seed: int, trials: int, seconds: float) -> dict:
    """Make, diagnose, and only then open the seal of one study."""
    study = folder / f"study_{number:03d}"
    make(study, case(number, seed), 1000 * seed + number, trials, seconds)
    began = time.perf_counter()
    found = mjchair.diagnose(study).to_dict()
    took = time.perf_counter() - began
    answer = unseal(study / SEAL)
    shutil.rmtree(study)
    return {
        "number": number,
        "answer": answer,
        "seconds": took,
        "verdict": found["verdict"],
        "effects": found["effects"],
        "alternatives": found["alternatives"],
        "candidates": found["candidates"][:5],
        "gap": found["gap"],
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=100)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--trials", type=int, default=6)
    parser.add_argument("--seconds", type=float, default=6.0)
    parser.add_argument("--work", type=Path, default=Path("out/blind"))
    args = parser.parse_args()
    args.work.mkdir(parents=True, exist_ok=True)
    path = args.work / f"results_{args.seed}.jsonl"
    done = [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []
    have = {line["number"] for line in done}
    for number in range(args.first, args.first + args.count):
        if number in have:
            continue
        line = one(args.work, number, args.seed, args.trials, args.seconds)
        with path.open("a") as file:
            file.write(json.dumps(line) + "\n")
        done.append(line)
        names = [e["name"] for e in line["effects"]]
        print(number, line["answer"]["kind"], list(line["answer"]["hidden"]), line["verdict"],
              names, line["alternatives"], f"{line['seconds']:.0f} s", flush=True)  # fmt: skip
    print(table(done))


if __name__ == "__main__":
    main()
