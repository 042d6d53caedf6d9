"""How long a diagnosis takes: nine trials of 10 s with eight channels, one of them held out.

    python benchmarks/blind/nine_trials.py --work out/nine_trials

In: nothing. Out: seconds and verdict of four studies, two that an effect explains and two that none
does. The aims are 60 s and 120 s on two processors that do nothing else. All studies are made
before the first is diagnosed, on two processors, in about ten minutes; one that is there is kept.
"""

from __future__ import annotations

import argparse
import os
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

from generator import SEAL, Case, make

import mjchair

CHANNELS = (
    "left_wheel_angle", "right_wheel_angle", "left_wheel_speed", "right_wheel_speed",
    "imu_gyro.z", "position.x", "position.y", "heading",
)  # fmt: skip
SIGMA = 25.0  # in the generator's measure
CASES = (
    Case("one", {"rolling_resistance": {"coefficient": 0.005}}, SIGMA),
    Case("one", {"air_drag": {"drag_area": 0.8}}, 2.0 * SIGMA),
    Case("outside", {"bent_rim": {"force": 4.0}}, SIGMA),
    Case("outside", {"strap": {"force": 4.0}}, SIGMA),
)


def made(work: Path, seed: int, number: int) -> Path:
    """The folder of a study, which is made where it is not there."""
    case = CASES[number]
    (hidden,) = case.hidden
    study = work / f"{seed + number}_{hidden}"
    if not (study / SEAL).exists():  # written last
        make(study, case, seed + number, trials=9, seconds=10.0, channels=CHANNELS, held=8)
    return study


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--seed", type=int, default=9901)
    options.add_argument("--work", type=Path, default=Path("out/nine_trials"))
    args = options.parse_args()
    count = len(CASES)
    with ProcessPoolExecutor(2) as pool:
        studies = list(pool.map(made, [args.work] * count, [args.seed] * count, range(count)))
    for study in studies:
        began = time.perf_counter()
        found = mjchair.diagnose(study)
        names = ", ".join(effect.name for effect in found.effects) or "nothing"
        seconds = time.perf_counter() - began
        print(f"{study.name}: {found.verdict}, {names}, {seconds:.0f} s", flush=True)


if __name__ == "__main__":
    main()
