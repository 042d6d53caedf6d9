"""A hidden effect is found: a practice study, its diagnosis, and the sealed answer.

Writes out/hidden_effect/: the study, the report and the corrected chair.
"""

from pathlib import Path

from mjchair.cli import main
from mjchair.diagnosis.practice import reveal

OUT = Path("out/hidden_effect")


def story() -> None:
    study, found = OUT / "study", OUT / "diagnosis"
    hidden = ["hide", "floor_slope", "--set", "x=0.004", "--seed", "7"]
    main([*hidden, "--out", str(study), "--force"])
    main(["diagnose", str(study), "--out", str(found), "--force"])
    main(["simulate", "--model", str(found / "model.xml"), "--duration", "3",
          "--out", str(OUT / "rolled"), "--force"])  # fmt: skip
    print("the seal says", reveal(study))


if __name__ == "__main__":
    story()
