"""The calibration of a diagnosis' probabilities: fitted to drawn studies, checked on others.

What it does: takes the lines of `calibration_draws.py`, finds the temper under which what was
hidden is most probable, the factors of the clues (logistic regression), and by isotonic regression
(scikit-learn) how often a chosen hypothesis was right at the odds that the tempered evidence gives,
or at its sum of clues. Prints reliability on
base studies that the fit did not see, each fifth of them in turn, of the calibration that ships on
all of them, and of the real studies of `calibration_studies.py`, where these are there. In: the
folder of draws.jsonl. Out: with --write, mjchair/diagnosis/explain/calibration.toml.

    python benchmarks/calibration.py out/calibration --write
"""

from __future__ import annotations

import argparse
import datetime
import json
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import tomli_w
from numpy.typing import NDArray
from scipy.optimize import minimize, minimize_scalar
from scipy.special import expit, logsumexp
from scipy.stats import beta
from sklearn.isotonic import IsotonicRegression

from mjchair.diagnosis.explain.calibration import (
    CLUES,
    FILE,
    LINES,
    NONE,
    OUTSIDE,
    Calibration,
    Chosen,
    Line,
    Weight,
    clues,
    holds,
    kind,
    log_odds,
    shipped,
    spoken,
)

Array = NDArray[np.float64]
COMMAND = (
    "python benchmarks/calibration_studies.py out/calibration; "
    "python benchmarks/calibration_draws.py out/calibration; "
    "python benchmarks/calibration.py out/calibration --write"
)
FOLDS = 5
LEAST = 1e-4  # a probability of what was hidden, that counts in the fit of the temper
GROUP = 20  # studies that are alike for the isotonic regression
# the most that evidence is divided by: of 5709 studies a temper of 100 makes the hidden hypothesis
# e^0.16 times as probable as one of 12, and rivals that the data tell apart look alike
HOTTEST = 12.0
FAR = 1000.0  # log-odds beyond which all are alike
ONES = tuple(np.r_[-FAR, np.linspace(-30.0, 30.0, 121), FAR])
BANDS = (0.0, 0.5, 0.7, 0.9, 0.95, 0.99, 1.0)
EVEN = Line(values=ONES, right=tuple(expit(ONES)))
CLUED = ("effects", "remainder")  # lines that go by clues; choices with rivals go by odds as well
PULL = 1.0  # precision by which factors of standardised clues are held near 0


@dataclass(frozen=True)
class Drawn:
    """A study: its base, what was hidden, what was chosen, what spoke for each hypothesis."""

    study: str
    truth: str
    chosen: Chosen | None
    weights: dict[str, Weight]


def read(path: Path) -> list[Drawn]:
    """The lines of a file."""
    return [_drawn(json.loads(line)) for line in path.read_text(encoding="utf-8").splitlines()]


def _drawn(line: dict[str, Any]) -> Drawn:
    chosen = None
    if line["chosen"]:
        rivals = line["rivals"]  # a count, or the names for each effect
        there = any(rivals) if isinstance(rivals, list) else rivals > 0
        chosen = Chosen(line["chosen"], line["gap_left"], there)
    return Drawn(
        study=line["study"],
        truth=line["truth"] if "truth" in line else _truth(line["answer"]),
        chosen=chosen,
        weights={n: Weight(*w) for n, w in line["weights"].items()},
    )


def _truth(answer: dict[str, Any]) -> str:
    """Name of the hypothesis that is true of a study with an answer."""
    if answer["kind"] == "outside":
        return OUTSIDE
    channel = answer.get("channel", "")
    keys = [f"{n}:{channel}" if n.startswith("sensor") else n for n in answer["hidden"]]
    return "+".join(sorted(keys)) or NONE


def about(study: Drawn, logs: dict[str, float]) -> str:
    """The hypothesis that a probability is told of first: the chosen one, or the most probable."""
    return study.chosen.name if study.chosen else max(logs, key=lambda n: logs[n])


def uncalibrated(temper: float) -> Calibration:
    """Probabilities as the tempered evidence alone gives them."""
    return Calibration("", "", 0, temper, *(EVEN for _ in LINES))


def fit(studies: Sequence[Drawn], made: str = "") -> Calibration:
    """The calibration that these studies ask for."""

    def miss(temper: float) -> float:
        raw = uncalibrated(temper)
        return -float(np.mean([_log_of_truth(raw, s) for s in studies]))

    temper = float(minimize_scalar(miss, bounds=(1.0, HOTTEST), options={"xatol": 0.02}).x)
    raw = _with_factors(uncalibrated(temper), studies)
    kinds: dict[str, list[tuple[float, bool]]] = {name: [] for name in LINES}
    for study in studies:
        logs = raw.tempered(study.weights, study.chosen)
        name = about(study, logs)
        of = kind(name, study.chosen)
        line = getattr(raw, of)
        value = float(np.clip(spoken(line, logs, study.weights, study.chosen, name), -FAR, FAR))
        there = holds(study.truth, name)
        if name != OUTSIDE:
            kinds[of].append((value, there))
        if not there or name == OUTSIDE:
            others = {n: v for n, v in logs.items() if n == OUTSIDE or not holds(n, name)}
            odds = float(np.clip(log_odds(others, OUTSIDE), -FAR, FAR))
            kinds[OUTSIDE].append((odds, study.truth == OUTSIDE))
            del others[OUTSIDE]
            if study.truth != OUTSIDE and len(others) > 1:
                first = max(others, key=lambda n: others[n])
                odds = others.pop(first) - float(logsumexp(list(others.values())))
                kinds["next"].append((min(odds, FAR), study.truth == first))
        more = [v for n, v in logs.items() if n != name and holds(n, name)]
        if there and more:
            only = logs[name] - float(logsumexp(more))
            gap = study.chosen is not None and study.chosen.gap_left
            kinds["rest" if gap else "alone"].append((only, study.truth == name))
    lines = {
        name: msgspec.structs.replace(_line(pairs), by=getattr(raw, name).by)
        for name, pairs in kinds.items()
    }
    return Calibration(made, COMMAND, len(studies), round(temper, 3), **lines)


def _with_factors(raw: Calibration, studies: Sequence[Drawn]) -> Calibration:
    """The same with factors of the clues, on the lines that go by them."""
    found = {}
    for name in CLUED:
        told = [
            (_in_order(clues(s.weights, s.chosen.name)), holds(s.truth, s.chosen.name))
            for s in studies
            if s.chosen and kind(s.chosen.name, s.chosen) == name
        ]
        factors = _factors(*(np.array(part, float) for part in zip(*told, strict=True)))
        kept = {
            clue: round(float(f), 3) for clue, f in zip(CLUES, factors, strict=True) if f > 5e-4
        }
        found[name] = msgspec.structs.replace(getattr(raw, name), by=kept)
    return msgspec.structs.replace(raw, **found)


def _in_order(known: Mapping[str, float]) -> list[float]:
    """Clues in the order of CLUES."""
    return [known[clue] for clue in CLUES]


def _factors(told: Array, right: Array) -> Array:
    """Factors (clues,) of clues (studies, clues) by logistic regression; none is below zero.

    So more evidence never makes a choice less probable. scikit-learn's has no such bounds.
    """
    spread = told.std(axis=0) + 1e-9
    unit = (told - told.mean(axis=0)) / spread

    def miss(b: Array) -> tuple[float, Array]:
        odds = unit @ b[1:] + b[0]
        off = expit(odds) - right
        value = np.logaddexp(0.0, odds).sum() - right @ odds + 0.5 * PULL * b[1:] @ b[1:]
        return float(value), np.r_[off.sum(), unit.T @ off + PULL * b[1:]]

    bounds = [(None, None)] + [(0.0, None)] * unit.shape[1]
    found = minimize(miss, np.zeros(1 + unit.shape[1]), jac=True, bounds=bounds, method="L-BFGS-B")
    return np.asarray(found.x[1:] / spread)


def _log_of_truth(known: Calibration, study: Drawn) -> float:
    logs = known.tempered(study.weights, study.chosen)
    values = np.array(list(logs.values()))
    top = values.max()
    total = top + np.log(np.exp(values - top).sum())
    return float(max(logs.get(study.truth, -np.inf) - total, np.log(LEAST)))


def _line(pairs: Sequence[tuple[float, bool]]) -> Line:
    """Isotonic regression over groups of GROUP, as a line through both quartiles of each step.

    A step of n studies of which k were right stands at (k + 1) / (n + 2), also of none.
    """
    if not pairs:
        return Line(values=(-FAR, FAR), right=(0.5, 0.5))
    odds, right = np.array(sorted(pairs), float).T
    groups = np.array_split(np.arange(odds.size), max(odds.size // GROUP, 1))
    shares = IsotonicRegression().fit_transform(
        np.arange(len(groups)),
        [right[g].mean() for g in groups],
        sample_weight=[g.size for g in groups],
    )
    level = np.repeat(shares, [g.size for g in groups])
    steps = [level == value for value in np.unique(level)]
    share = [(right[mine].sum() + 1.0) / (mine.sum() + 2.0) for mine in steps]
    # small steps are drawn to the middle, which may set them out of order
    counts = [float(mine.sum()) for mine in steps]
    share = IsotonicRegression().fit_transform(np.arange(len(steps)), share, sample_weight=counts)
    points: dict[float, float] = {}
    for mine, value in zip(steps, share, strict=True):
        for at in np.quantile(odds[mine], (0.25, 0.75)):
            points[round(float(at), 3)] = round(float(value), 4)
    if len(points) == 1:
        points[next(iter(points)) + 1.0] = next(iter(points.values()))
    return Line(values=tuple(points), right=tuple(points.values()))


def folds(studies: Sequence[Drawn]) -> Iterable[tuple[Calibration, list[Drawn]]]:
    """A fit to some base studies, and the drawn studies of the others, in turn."""
    names = sorted({s.study for s in studies})
    for k in range(FOLDS):
        out = set(names[k::FOLDS])
        yield (
            fit([s for s in studies if s.study not in out]),
            [s for s in studies if s.study in out],
        )


def table(told: Sequence[tuple[float, bool]]) -> str:
    """Reliability: stated, how many, their mean, and the share that was right with its interval."""
    rows = []
    for low, high in pairwise(BANDS):
        mine = [(p, r) for p, r in told if low <= p < high or (high == 1.0 and p == 1.0)]
        if not mine:
            continue
        n, k = len(mine), sum(r for _, r in mine)
        below = beta.ppf(0.025, k, n - k + 1) if k else 0.0
        above = beta.ppf(0.975, k + 1, n - k) if k < n else 1.0
        mean = np.mean([p for p, _ in mine])
        rows.append(
            f"| {low:.0%}-{high:.0%} | {n} | {mean:.1%} | {k / n:.1%} | {below:.1%}-{above:.1%} |"
        )
    head = (
        "| stated | studies | mean stated | right | 95 % interval of it |\n|---|---|---|---|---|\n"
    )
    return head + "\n".join(rows) + f"\n\nexpected calibration error {error(told):.3f}"


def error(told: Sequence[tuple[float, bool]]) -> float:
    """Expected calibration error over ten equal bands."""
    place = np.minimum((10.0 * np.array([p for p, _ in told])).astype(int), 9)
    gap = [
        abs(np.sum([told[i][0] - told[i][1] for i in np.flatnonzero(place == b)]))
        for b in range(10)
    ]
    return float(np.sum(gap) / len(told))


def stated(known: Calibration, study: Drawn) -> tuple[float, bool]:
    """Probability that the first hypothesis' effects are there, and whether they are."""
    shares = known.probabilities(study.weights, study.chosen)
    name = about(study, shares)
    total = sum(p for n, p in shares.items() if holds(n, name))
    return total, holds(study.truth, name)


def top(known: Calibration, study: Drawn) -> tuple[float, bool]:
    """The largest probability, and whether just this hypothesis is true."""
    shares = known.probabilities(study.weights, study.chosen)
    name = max(shares, key=lambda n: shares[n])
    return shares[name], study.truth == name


def main() -> None:
    """Fit, check, and write if asked."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("out", type=Path)
    parser.add_argument("--write", action="store_true")
    args = parser.parse_args()
    studies = read(args.out / "draws.jsonl")
    before = uncalibrated(2.0)
    held = [(k, s) for k, mine in folds(studies) for s in mine]
    chosen_only = [(k, s) for k, s in held if s.chosen]
    print("\nchosen effects, as it was (evidence halved)\n")
    print(table([stated(before, s) for _, s in chosen_only]))
    print("\nchosen effects, calibrated on other base studies\n")
    print(table([stated(k, s) for k, s in chosen_only]))
    print("\nchosen effects, by the calibration that ships\n")
    print(table([stated(shipped(), s) for _, s in chosen_only]))
    print(
        "\nthe most probable hypothesis of all, just as it is, calibrated on other base studies\n"
    )
    print(table([top(k, s) for k, s in held]))
    print(table([top(before, s) for _, s in held]).splitlines()[-1], "as it was")
    known = fit(studies, datetime.date.today().isoformat())
    print(known)
    real = args.out / "real.jsonl"
    for study in read(real) if real.exists() else ():
        p, right = stated(known, study)
        name = study.chosen.name if study.chosen else "-"
        was = stated(before, study)[0]
        print(f"{study.study:10} {study.truth:40} {name:40} {p:.3f} {right} was {was:.3f}")
    if args.write:
        write(known)


def write(known: Calibration) -> None:
    """Put it beside the code that reads it."""
    table = msgspec.to_builtins(known)
    text = tomli_w.dumps({n: v for n, v in table.items() if not isinstance(v, dict)})
    for name, line in table.items():
        if isinstance(line, dict):
            rows = [f"{n} = {list(v)}" for n, v in line.items() if n != "by"]
            text += "\n".join([f"\n[{name}]", *(w for r in rows for w in _wrapped(r))]) + "\n"
            if line["by"]:
                text += "\n" + tomli_w.dumps({name: {"by": line["by"]}})
    FILE.write_text(text, encoding="utf-8")


def _wrapped(row: str) -> list[str]:
    return textwrap.wrap(row, 98, subsequent_indent="  ")


if __name__ == "__main__":
    main()
