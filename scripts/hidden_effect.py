"""A complete example: an effect is hidden in simulated runs, diagnosed, and put into the chair.

    python scripts/hidden_effect.py --out out/hidden_effect

`hide` holds the pushed run out: no fit uses it, so it is an independent check of the corrected
chair. Each step is a command of the command line; see docs/diagnosis.md.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from mjchair import cli

EFFECT = "rolling_resistance"


def main() -> int:
    """Hide, diagnose, diagnose the corrected chair; returns the exit code of what failed, or 0."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--effect", default=EFFECT, help="default: %(default)s")
    parser.add_argument("--seed", default="3", help="of the practice study; default: %(default)s")
    parser.add_argument("--out", default="out/hidden_effect", help="default: %(default)s")
    args = parser.parse_args()
    out = Path(args.out)
    study, first, second = out / "study", out / "diagnosis", out / "again"
    steps = (
        ["hide", args.effect, "--seed", args.seed, "--out", str(study)],
        ["diagnose", str(study), "--out", str(first)],
        ["diagnose", str(study), "--out", str(second)],
    )
    for number, step in enumerate(steps):
        if number == 2:
            explain_by(study, first / "model.xml")
        print("$ mjchair", *step, flush=True)
        code = cli.main(step)
        if code:
            return code
    print("$ mjchair hide --reveal", study, flush=True)
    cli.main(["hide", "--reveal", str(study)])
    print(summary(first), summary(second), sep="\n")
    return 0


def explain_by(study: Path, model: Path) -> None:
    """Use another chair as the model of the study."""
    file = study / "study.toml"
    lines = file.read_text().splitlines()
    lines[0] = f'model = "{model.resolve()}"'  # brings its own floor
    file.write_text("\n".join(lines) + "\n")


def summary(folder: Path) -> str:
    """Verdict and gap of a diagnosis, on one line."""
    found = json.loads((folder / "diagnosis.json").read_text())
    gap = found["gap"]
    after = "" if gap["after"] is None else f" -> {gap['after']:.2f}"  # none where nothing is named
    return f"{folder.name}: {found['verdict']}, gap {gap['before']:.2f}{after}"


if __name__ == "__main__":
    sys.exit(main())
