"""Make blind studies, diagnose them, open the seals, and write the table.

    python benchmarks/blind/run.py --seed 100 --count 200 --work out/blind

Resumes where it stopped: a study that has a line in results_GENERATOR_SEED.jsonl is not run again.
"""

from __future__ import annotations

import argparse
import shutil

import planar
from cases import case, planar_case
from generator import SEAL, make, unseal
from runner import diagnosed, parser, resumed
from table import table


def one(args: argparse.Namespace, number: int, threads: int) -> dict:
    """Make, diagnose, and only then open the seal of one study."""
    study = args.work / f"study_{args.generator}_{args.seed}_{number:03d}"
    hidden, maker = (case, make) if args.generator == "mujoco" else (planar_case, planar.make)
    maker(study, hidden(number, args.seed), 1000 * args.seed + number, args.trials, args.seconds,
          held=number % args.trials)  # fmt: skip
    _, said = diagnosed(study, threads)
    answer = unseal(study / SEAL)
    shutil.rmtree(study)
    return {"number": number, "answer": answer, **said}


def show(line: dict) -> str:
    """One line for the terminal."""
    names = [e["name"] for e in line["effects"]]
    answer = line["answer"]
    return (f"{line['number']} {answer['kind']} {answer['reached']} {line['verdict']} {names} "
            f"{line['alternatives']} {line['seconds']:.0f} s")  # fmt: skip


def main() -> None:
    options = parser(__doc__, 100, 200, "out/blind")
    options.add_argument("--generator", choices=("mujoco", "planar"), default="mujoco")
    args = options.parse_args()
    path = args.work / f"results_{args.generator}_{args.seed}.jsonl"
    print(table(resumed(path, args, one, show)))


if __name__ == "__main__":
    main()
