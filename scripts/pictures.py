"""Make the pictures of README.md and docs/ again: `make pictures`.

In: nothing but this repository. Out: docs/images/*.png, each by the script or the command that the
documentation names for it. The learning curve needs the extra `learn` and half an hour; it is made
only where it is asked for by name.

    python scripts/pictures.py                 # all but the learning curve
    python scripts/pictures.py --only demo lab # those whose names begin so
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
IMAGES = ROOT / "docs" / "images"


@dataclass(frozen=True)
class Source:
    """What makes pictures.

    Attributes:
      name: to ask for it.
      commands: `mjchair ...` or a script with its arguments, one after another; {out} is the
        folder of all results.
      pictures: name in docs/images -> file below that folder.
      asked: whether it is made only where it is asked for by name.
    """

    name: str
    commands: Sequence[str]
    pictures: dict[str, str]
    asked: bool = False


SOURCES = (
    Source(
        "demo",
        (
            "scripts/demo.py --out {out}/demo",
            "mjchair render {out}/demo/recording.npz --frame 5 --size 1280x720 --out {out}/frame",
        ),
        {"demo.png": "frame/frame.png", "wheel_speed.png": "demo/wheel_speed.png"},
    ),
    Source(
        "lab",
        (
            "mjchair rig --tire rig_rigid --against rig_flexible --out {out}/rig",
            "mjchair rig --tire wheelchair --angles 0,5 --loads 200 --speeds 0.1 "
            "--kappas=-0.3,-0.1,-0.05,0,0.05,0.1,0.3 --out {out}/driven",
            "mjchair rig --tire wheelchair --noise 0.02 --seed 1 --out {out}/measured",
            "mjchair fit-tire {out}/measured/rig.csv --name mine --out {out}/fit",
        ),
        {
            "lab_traces.png": "rig/traces.png",
            "lab_lateral.png": "rig/lateral.png",
            "lab_compared.png": "rig/compared.png",
            "lab_driven.png": "driven/longitudinal.png",
            "lab_fit.png": "fit/fit.png",
        },
    ),
    Source(
        "diagnosis",
        ("scripts/hidden_effect.py --out {out}/hidden_effect",),
        {
            "diagnosis_where.png": "hidden_effect/diagnosis/where.png",
            "diagnosis_compared.png": "hidden_effect/diagnosis/compared.png",
        },
    ),
    Source(
        "power",
        tuple(
            command
            for name in ("power", "power_mid", "power_front")
            for command in (
                f"mjchair simulate --model {name} --torque 8,8 --duration 1 --sample-rate 50 "
                f"--out {{out}}/{name}",
                f"mjchair render {{out}}/{name}/recording.npz --frame 1 --view side "
                f"--size 640x540 --out {{out}}/{name}_side",
            )
        ),
        {f"{name}.png": f"{name}_side/frame.png" for name in ("power", "power_mid", "power_front")},
    ),
    Source(
        "designer_study",
        ("scripts/designer_study.py --out {out}/designer_study",),
        {"designer_study.png": "designer_study/designer_study.png"},
    ),
    Source(
        "tasks_lateral_force",
        ("scripts/lateral_force.py --out {out}/lateral_force",),
        {"tasks_lateral_force.png": "lateral_force/lateral_force.png"},
    ),
    Source(
        "tasks_learning",
        ("scripts/train_straight_line.py --out {out}/learning",),
        {"tasks_learning.png": "learning/learning.png"},
        asked=True,
    ),
)


def chosen(names: Sequence[str]) -> list[Source]:
    """The sources asked for by the beginning of their names; without names all usual ones."""
    if not names:
        return [s for s in SOURCES if not s.asked]
    return [s for s in SOURCES if s.name.startswith(tuple(names))]


def make(source: Source, out: Path) -> None:
    """Run the commands of a source and put its pictures in their place."""
    for command in source.commands:
        program, *words = command.format(out=out).split()
        start = ["-m", "mjchair"] if program == "mjchair" else [program]
        print("$", program, *words, flush=True)
        subprocess.run([sys.executable, *start, *words], cwd=ROOT, check=True)
    for name, file in source.pictures.items():
        shutil.copyfile(out / file, IMAGES / name)
        print(IMAGES / name, flush=True)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="*", default=[], metavar="NAME", help="beginnings of names")
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "pictures")
    args = parser.parse_args()
    for source in chosen(args.only):
        folder = args.out / source.name
        shutil.rmtree(folder, ignore_errors=True)
        make(source, folder)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
