"""Compare verdicts of studies and trajectories before and after a change of structure.

    python benchmarks/blind/frozen.py make out/frozen             # the studies, once
    python benchmarks/blind/frozen.py record out/frozen before.json
    python benchmarks/blind/frozen.py record out/frozen after.json    # with the changed code
    python benchmarks/blind/frozen.py compare before.json after.json

Trajectories are compared by digests of all states, so any difference of a bit is found. Of verdicts
the names, their rivals, and the values with a relative tolerance of 1e-6 are compared.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
import mujoco
import numpy as np

import mjchair

# of the blind generator, seed 77: no effect, single effects, a pair, one outside the library
STUDIES = (0, 1, 2, 4, 5, 7, 8, 9, 12, 14)
SCENES = (
    ("manual", "flat", None),
    ("manual", "ramp", 1 / 20),
    ("manual", "cross_slope", 0.04),
    ("manual", "threshold", None),
    ("power", "flat", None),
    ("power", "ramp", 1 / 12),
)


def trajectory(model: str, scene: str, grade: float | None) -> str:
    """Digest of the states of 3 s of driving in a curve."""
    kept = [1.0] if grade is None else [1.0, grade]
    m = mjchair.load_spec(model, scene=scene, grade=grade).compile()
    d = mujoco.MjData(m)
    drive = 4.0 if model == "manual" else 12.0
    full = mujoco.mjtState.mjSTATE_FULLPHYSICS
    state = np.empty(mujoco.mj_stateSize(m, full))
    found = hashlib.sha256(np.array(kept).tobytes())
    with mjchair.installed():
        for k in range(1500):
            turn = 0.5 * drive * np.sin(0.004 * k)
            d.ctrl[m.actuator("left_wheel").id] = drive - turn
            d.ctrl[m.actuator("right_wheel").id] = drive + turn
            mujoco.mj_step(m, d)
            mujoco.mj_getState(m, d, state, full)
            found.update(state.tobytes())
    return found.hexdigest()


def diagnosed(folder: Path) -> dict:
    """What a diagnosis says of one study."""
    said = mjchair.diagnose(folder, threads=1).to_dict()
    return {k: said[k] for k in ("verdict", "effects", "alternatives", "gap")}


def record(folder: Path) -> dict:
    """Digests and verdicts."""
    studies = sorted(p for p in folder.iterdir() if (p / "study.toml").is_file())
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        verdicts = dict(
            zip([p.name for p in studies], pool.map(diagnosed, studies, chunksize=1), strict=True)
        )
    paths = {f"{m} {s}": trajectory(m, s, g) for m, s, g in SCENES}
    return {"trajectories": paths, "verdicts": verdicts}


def make(folder: Path) -> None:
    """The studies, by the blind generator."""
    from cases import case
    from generator import make as generate

    for n in STUDIES:
        generate(folder / f"study_{n:02d}", case(n, 77), 77000 + n, 5, 4.0, held=n % 5)


def differences(one: object, two: object, place: str = "") -> list[str]:
    """Where two results differ, one line each."""
    if isinstance(one, dict) and isinstance(two, dict):
        keys = [*one, *(k for k in two if k not in one)]
        return [d for k in keys for d in differences(one.get(k), two.get(k), f"{place}/{k}")]
    if isinstance(one, list) and isinstance(two, list) and len(one) == len(two):
        return [d for i, (a, b) in enumerate(zip(one, two, strict=True))
                for d in differences(a, b, f"{place}/{i}")]  # fmt: skip
    if isinstance(one, float) and isinstance(two, float):
        return [] if np.isclose(one, two, rtol=1e-6, atol=1e-12) else [f"{place}: {one} -> {two}"]
    return [] if one == two else [f"{place}: {one} -> {two}"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=("make", "record", "compare"))
    parser.add_argument("paths", nargs="+", type=Path)
    args = parser.parse_args()
    if args.what == "make":
        make(args.paths[0])
    elif args.what == "record":
        args.paths[1].write_text(json.dumps(record(args.paths[0]), indent=1))
    else:
        said = differences(*(json.loads(p.read_text()) for p in args.paths))
        print("\n".join(said) or "equal")
        sys.exit(bool(said))


if __name__ == "__main__":
    main()
