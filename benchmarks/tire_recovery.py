"""How well fit-tire recovers known tires from noisy rig data, and names hidden causes.

    python benchmarks/tire_recovery.py [--seeds 30]

Tables have the paper's 4 angles, 3 loads and 2 speeds, with noise of 2 % of the peak on each cell.
For the causes, angles of both signs are measured as well, and the wheel turned round.
"""

import argparse
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from rig_data import made

from mjchair.identification.curves import curve
from mjchair.identification.fit import fit, identify
from mjchair.tire import read

TIRES = Path(__file__).parents[1] / "models" / "tires"
ANGLES = np.linspace(0.0, 15.0, 16)[:, None]
LOADS = np.array([30.0, 70.0, 110.0, 160.0, 210.0])[None, :]
HIDDEN = ({}, {"toe": 1.0}, {"camber": 4.0}, {"offset": 6.0}, {"conicity": 0.04})
DESIGNS = {
    "the paper's angles": {},
    "both signs": {"angles": (-15, -10, -5, 0, 5, 10, 15)},
    "both signs, turned round": {"angles": (-15, -10, -5, 0, 5, 10, 15), "turned": True},
}


def recovery(name: str, seeds: int) -> str:
    tire = read(TIRES / f"{name}.toml")
    true = tire.forces(LOADS, 0.0, np.radians(ANGLES)).Fy
    rms, worst, held = [], [], []
    for seed in range(seeds):
        table, peak = made(tire, seed)
        found = fit(table, curve("pac89", table), starts=1)
        force, half = found.lateral(ANGLES, LOADS)
        error = np.abs(force - true)
        rms.append(100.0 * np.sqrt(np.mean(error**2)) / peak)
        worst.append(100.0 * error.max() / peak)
        held.append(100.0 * np.mean(error <= half))
    return (
        f"{name:<20} {np.mean(rms):>8.2f} {np.max(rms):>8.2f} {np.mean(worst):>8.2f} "
        f"{np.mean(held):>8.1f}"
    )


def causes(seeds: int) -> Iterator[str]:
    tire = read(TIRES / "wheelchair.toml")
    for design, given in DESIGNS.items():
        for hidden in HIDDEN:
            found: Counter[str] = Counter()
            for seed in range(seeds):
                verdict = identify(made(tire, 1000 + seed, **given, **hidden)[0], starts=1)[1]
                named = "+".join(verdict.named) or "none"
                open_ = "/".join(verdict.undecided)
                found[named + (f", open {open_}" if open_ else "")] += 1
            said = "; ".join(f"{text}: {count}" for text, count in found.most_common())
            yield f"{design:<26} {next(iter(hidden), 'nothing'):<10} {said}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=30)
    seeds = parser.parse_args().seeds
    print(f"{seeds} seeds; % of the peak, over a grid of 16 angles and 5 loads")
    print("tire                 mean rms  max rms  mean max  held by 95 %")
    for name in ("wheelchair_a0_148", "wheelchair", "rig_flexible"):
        print(recovery(name, seeds), flush=True)
    print("hidden                                what the fit says")
    for line in causes(seeds):
        print(line, flush=True)


if __name__ == "__main__":
    main()
