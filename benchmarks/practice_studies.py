"""What the practice study of each effect comes out as: the first thing that a person tries.

    python benchmarks/practice_studies.py --work out/practice [EFFECT ...]

In: effects, or all that `mjchair hide EFFECT` can hide in the manual chair at their usual values.
Out: a row of a table each, in Markdown: what was hidden, the verdict with what it names, seconds.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Mapping
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import mjchair
from mjchair.diagnosis.result import Diagnosis
from mjchair.effects.effect import Effect
from mjchair.effects.library import MECHANICAL, find
from mjchair.practice import hide, reveal
from mjchair.storage import output_folder, write_whole

SENSORS = (("sensor_bias", "imu_gyro.z"), ("sensor_scale", "left_wheel_speed"))


def effects(names: list[str]) -> list[Effect]:
    """The effects of these names, or all that a manual chair on its own can have."""
    if names:
        return [find(*name.split(":")) for name in names]
    first = {e.name: find(e.name) for e in MECHANICAL if e.drive is not True}
    return [*first.values(), *(find(*pair) for pair in SENSORS)]


def row(effect: Effect, study: Path, threads: int) -> str:
    """Hide an effect, diagnose the study, and say what came out."""
    for file, content in hide(effect).items():
        write_whole(output_folder(study, True) / file, content)
    began = time.perf_counter()
    found = mjchair.diagnose(study, threads=threads)
    seconds = time.perf_counter() - began
    hidden = ", ".join(f"{k} {v:g}" for k, v in _values(reveal(study)).items())
    return f"| {effect.key} | {hidden} | {found.verdict} | {_said(found)} | {seconds:.0f} |"


def _values(answer: Mapping[str, object]) -> dict[str, float]:
    values = answer["values"]
    assert isinstance(values, dict)
    return values


def _said(found: Diagnosis) -> str:
    """The effects that a verdict says, with their fitted numbers, and its rivals."""
    said = []
    for effect in found.effects:
        numbers = [
            f"{name} {p.value:.3g} ± {p.std:.2g}" for name, p in effect.parameters.items() if p.std
        ]
        said.append(f"{effect.name}: {', '.join(numbers)}")
    others = {name for one in found.alternatives for name in one} - {e.key for e in found.effects}
    return "; ".join(said) + (f"; or {', '.join(sorted(others))}" if others else "")


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("effects", nargs="*")
    options.add_argument("--work", type=Path, default=Path("out/practice"))
    options.add_argument("--threads", type=int, default=0)
    args = options.parse_args()
    print("| effect | hidden | verdict | it says | seconds |\n| --- | --- | --- | --- | --- |")
    for effect in effects(args.effects):
        study = args.work / effect.key.replace(":", "_")
        print(row(effect, study, args.threads), flush=True)


if __name__ == "__main__":
    main()
