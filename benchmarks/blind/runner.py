"""What the blind benchmarks share: a study diagnosed, cases on worker processes, runs that resume.

In: cases by number, and a function that does one. Out: a line of JSON for each, kept in a file.
"""

from __future__ import annotations

import argparse
import json
import os
import time
import traceback
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import mjchair
from mjchair.diagnosis.result import Diagnosis

KEPT = ("verdict", "effects", "alternatives", "gap", "notes", "probability", "more_missing",
        "material", "process")  # fmt: skip
SCREENED = ("name", "channel", "detectability", "collinear", "held_out_gain")


def diagnosed(study: Path, threads: int) -> tuple[Diagnosis | None, dict]:
    """The diagnosis of a study, and what a line keeps of it; a crash is a result, and counts."""
    began = time.perf_counter()
    found = None
    try:
        found = mjchair.diagnose(study, threads=threads)
        said = found.to_dict()
    except Exception:
        said = {"verdict": "error", "effects": [], "alternatives": [], "candidates": [],
                "gap": {}, "notes": [traceback.format_exc()]}  # fmt: skip
    kept = {k: said.get(k) for k in KEPT}
    kept["candidates"] = [{k: c.get(k) for k in SCREENED} for c in said["candidates"]]
    kept["fits"] = fits(found)
    return found, {"seconds": time.perf_counter() - began, **kept}


def fits(found: Diagnosis | None) -> dict[str, float]:
    """Name of every hypothesis that was fitted -> its chi2 over that of the chosen one."""
    choice = found.stages.choice if found is not None else None
    if choice is None:
        return {}
    least = {choice.hypothesis.name: 0.0}
    for tried in choice.tried:
        behind = tried.fitted.total - choice.fitted.total
        name = tried.hypothesis.name
        least[name] = min(behind, least.get(name, behind))
    return least


def parser(description: str | None, seed: int, count: int, work: str) -> argparse.ArgumentParser:
    """The options that every blind benchmark has, with these defaults."""
    options = argparse.ArgumentParser(description=description)
    options.add_argument("--seed", type=int, default=seed)
    options.add_argument("--first", type=int, default=0)
    options.add_argument("--count", type=int, default=count)
    options.add_argument("--numbers", type=int, nargs="+", help="cases, instead of first and count")
    options.add_argument("--trials", type=int, default=6)
    options.add_argument("--seconds", type=float, default=6.0)
    options.add_argument("--workers", type=int, default=2)
    options.add_argument("--work", type=Path, default=Path(work))
    return options


def resumed(
    path: Path, args: argparse.Namespace, one: Callable[..., dict], show: Callable[[dict], str]
) -> list[dict]:
    """Do the cases that have no line in the file yet, and return the lines of all.

    Args:
      args: of `parser`, and whatever else `one` reads. one: (args, number, threads) -> a line.
      show: what is printed of a line.
    """
    args.work.mkdir(parents=True, exist_ok=True)
    done = [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []
    have = {line["number"] for line in done}
    numbers: Sequence[int] = args.numbers or range(args.first, args.first + args.count)
    threads = max(1, (os.cpu_count() or 1) // args.workers)
    with ProcessPoolExecutor(args.workers, get_context("spawn")) as pool:
        running = [pool.submit(one, args, n, threads) for n in numbers if n not in have]
        for future in as_completed(running):
            line = future.result()
            with path.open("a") as file:
                file.write(json.dumps(line) + "\n")
            done.append(line)
            print(show(line), flush=True)
    return done
