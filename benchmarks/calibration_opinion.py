"""A second opinion on the calibrated probabilities: a classifier trained on the same studies.

What it does: trains gradient-boosted trees (scikit-learn) on numbers of a choice that the
calibration reads one of at a time, or not at all, to tell whether the chosen effects are there.
Each study is judged by trees that saw no study of its base. In: the folder of draws.jsonl. Out: the
log loss of both, and a table of the studies where they disagree most.

    python benchmarks/calibration_opinion.py out/calibration
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from calibration import Drawn, folds, read, stated
from numpy.typing import NDArray
from sklearn.ensemble import HistGradientBoostingClassifier
from sklearn.metrics import log_loss

from mjchair.diagnosis.explain.calibration import OUTSIDE, holds

Array = NDArray[np.float64]
APART = 0.5  # difference of two probabilities that is listed
SHOWN = 15


def features(study: Drawn) -> list[float]:
    """Numbers of a choice: evidence of it, of rivals and of all else, and its size."""
    assert study.chosen is not None
    name, weights = study.chosen.name, study.weights
    mine = weights[name].evidence
    others = {n: w for n, w in weights.items() if not holds(n, name)}
    tried = [w.evidence for w in others.values() if w.fitted]
    return [
        np.log1p(max(mine, 0.0)),
        mine - max(tried),
        mine - max(w.evidence for w in others.values()),
        (mine - max(tried)) / max(mine, 1.0),
        mine - weights[OUTSIDE].evidence,
        float(study.chosen.gap_left),
        float(study.chosen.rivals),
        float(name.count("+") + 1),
        float(sum("sensor" in key for key in name.split("+"))),
    ]


def main() -> None:
    """Train, compare, list."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("out", type=Path)
    studies = read(parser.parse_args().out / "draws.jsonl")
    rows: list[tuple[Drawn, float, float, bool]] = []
    for known, held in folds(studies):
        out = {s.study for s in held}
        seen = [s for s in studies if s.chosen and s.study not in out]
        trees = HistGradientBoostingClassifier(
            max_depth=3, max_iter=80, learning_rate=0.08, random_state=0
        )
        trees.fit([features(s) for s in seen], [stated(known, s)[1] for s in seen])
        for study in (s for s in held if s.chosen):
            p, right = stated(known, study)
            rows.append((study, p, float(trees.predict_proba([features(study)])[0, 1]), right))
    right = [r for *_, r in rows]
    ours, theirs = (np.array([row[i] for row in rows], float) for i in (1, 2))
    print(f"log loss: calibration {log_loss(right, ours):.3f}, trees {log_loss(right, theirs):.3f}")
    apart = sorted((r for r in rows if abs(r[1] - r[2]) > APART), key=lambda r: -abs(r[1] - r[2]))
    closer = sum(abs(r[3] - r[2]) < abs(r[3] - r[1]) for r in apart)
    print(f"{len(apart)} of {len(rows)} are {APART} apart; the trees are nearer in {closer}")
    print(
        "| base study | hidden | chosen | calibration | trees | right |\n|---|---|---|---|---|---|"
    )
    for study, p, q, there in apart[:SHOWN]:
        assert study.chosen is not None
        print(
            f"| {study.study} | {study.truth} | {study.chosen.name} | {p:.2f} | {q:.2f} | {there} |"
        )


if __name__ == "__main__":
    main()
