"""The table of a blind run: aims and results.

python benchmarks/blind/table.py out/blind/results_100.jsonl
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

CLEAR = 12.0  # least sigmas reached by an effect that is counted as one of 15 sigma or more
SHOWS = "15 sigma or more"
FAINT = 5.0  # sigmas reached below which what is hidden counts as not there, as in the calibration
OPEN = ("unknown", "ambiguous")
# not counted: what a fit does not determine or states only to place an effect; the drag area of a
# wind is the generator's own
UNCOUNTED = ("mass", "phase", "radius", "drag_area")
SHAPES = ("slope", "rate")  # how an effect gives way: not counted where the answer has none
ALIKE = 0.95  # |cos| beyond which two effects cannot be told apart
RULED_OUT = 9.0  # chi2 behind the truth: what is nearer fits as well as the truth does


def truth(line: dict) -> set[str]:
    """Names of what was hidden."""
    return set(line["answer"]["hidden"])


def clear(line: dict) -> bool:
    """Whether everything that was hidden shows clearly."""
    return all(v >= CLEAR for v in line["answer"]["reached"].values())


def named(line: dict) -> set[str]:
    """Names that a verdict states without an alternative."""
    return put_first(line) if line["verdict"] == "named" else set()


def returned(line: dict) -> set[str]:
    """All names that a verdict does not exclude."""
    if line["verdict"] not in ("named", "ambiguous"):
        return set()
    rivals = {n for g in line["alternatives"] for names in g for n in names.split("+")}
    return put_first(line) | {n.split(":")[0] for n in rivals}  # without the channel of a sensor


def first(line: dict) -> str:
    """The name a verdict puts first."""
    return line["effects"][0]["name"] if line["effects"] else ""


def put_first(line: dict) -> set[str]:
    """All names of the answer that a verdict puts first, with rivals or without."""
    return {e["name"] for e in line["effects"]}


def alone(line: dict) -> bool:
    """Whether no other effect is similar to the one that was put first."""
    return not any(c["name"] != first(line) and c["collinear"] > ALIKE for c in line["candidates"])


def decided(line: dict) -> bool:
    """Whether no hypothesis that was fitted, and lacks a hidden effect, fits as well as the truth.

    Where the truth was not fitted, that is a failure and no excuse.
    """
    wanted, known = hypothesis(line), line.get("fits") or {}
    chi2 = {frozenset(name.split("+")): behind for name, behind in known.items()}
    own = chi2.get(wanted)
    others = [behind for keys, behind in chi2.items() if not wanted <= keys]
    return own is None or min(others, default=np.inf) > own + RULED_OUT


def right(line: dict) -> bool:
    """Whether the name put first is one that was hidden."""
    return first(line) in truth(line)


def both_named(line: dict) -> bool:
    """Whether a verdict names everything that was hidden."""
    return truth(line) <= named(line)


def kept(line: dict) -> bool:
    """Whether all hidden effects are among the names that are not excluded."""
    return truth(line) <= returned(line)


def wrong(line: dict) -> bool:
    """Whether a verdict states a name that was not hidden."""
    return bool(named(line) - truth(line))


def _median(values: Sequence[float]) -> float:
    return float(np.median(values)) if values else float("nan")


def _errors(lines: Sequence[dict]) -> tuple[list[float], list[bool]]:
    """Relative errors of the parameters of right names, and whether their intervals cover."""
    errors, covered = [], []
    for line in lines:
        for effect in line["effects"]:
            hidden = _hidden(line["answer"], effect["name"])
            if hidden is None or effect.get("channel", "") not in (line["answer"]["channel"], None):
                continue
            for name, fitted in effect["parameters"].items():
                if not fitted["std"] or name in UNCOUNTED:
                    continue
                if name in SHAPES and name not in hidden:
                    continue
                value = hidden.get(name, 0.0)
                off = abs(fitted["value"] - value)
                covered.append(off < 1.96 * fitted["std"])
                if value:
                    errors.append(off / abs(value))
    return errors, covered


def _hidden(answer: dict, name: str) -> dict[str, float] | None:
    """The numbers of an effect that was hidden, as the library has them; None: it was not."""
    hidden = answer["hidden"].get(name)
    if name == "caster_friction" and hidden is not None:  # the library's is of each caster
        return {**hidden, "left": hidden["moment"], "right": hidden["moment"]}
    return hidden


def _closed(lines: Sequence[dict]) -> str:
    """Excess on the held-out trial that is closed, of all these studies together."""
    before = sum(line["gap"]["before"] ** 2 - 1.0 for line in lines if line["effects"])
    after = sum(line["gap"]["after"] ** 2 - 1.0 for line in lines if line["effects"])
    return f"{1.0 - after / before:.0%}" if before > 0.0 else "no case"


def hypothesis(line: dict) -> frozenset[str]:
    """What was hidden and shows, as the keys of a hypothesis."""
    answer = line["answer"]
    shows = [n for n, size in answer["reached"].items() if size >= FAINT]
    if not shows:
        return frozenset(["none"])
    if answer["kind"] == "outside":
        return frozenset(["outside"])
    channel = answer["channel"]
    return frozenset(f"{n}:{channel}" if channel else n for n in shows)


def probable(line: dict) -> dict[frozenset[str], float]:
    """Probability of every hypothesis, the most probable first."""
    known = {frozenset(n.split("+")): p for n, p in (line.get("probability") or {}).items()}
    return dict(sorted(known.items(), key=lambda item: -item[1]))


def calibration_error(lines: Sequence[dict]) -> float:
    """Mean distance between what the most probable hypotheses say and how often they are right."""
    first = [next(iter(probable(x).items())) for x in lines]
    said = np.array([p for _, p in first])
    hit = np.array([h == hypothesis(x) for (h, _), x in zip(first, lines, strict=True)], float)
    return _distance(said, hit)


def calibration_by_chance(lines: Sequence[dict], draws: int = 2000) -> float:
    """The same, were every probability exactly right: what so few studies show by chance."""
    said = np.array([max(probable(x).values()) for x in lines])
    rng = np.random.default_rng(1)
    hits = rng.random((draws, said.size)) < said
    return float(np.mean([_distance(said, hit.astype(float)) for hit in hits]))


def _distance(said: NDArray[np.float64], hit: NDArray[np.float64]) -> float:
    """Of what was said from what was right (0 or 1), over ten equal bands."""
    bins = np.minimum((said * 10).astype(int), 9)
    parts = [abs((hit - said)[bins == b].sum()) for b in np.unique(bins)]
    return float(sum(parts) / max(said.size, 1))


def in_95_set(line: dict) -> bool:
    """Whether what was hidden is among the most probable hypotheses that make up 95 %."""
    whole = 0.0
    for keys, p in probable(line).items():
        if keys == hypothesis(line):
            return True
        whole += p
        if whole >= 0.95:
            break
    return False


def _kind(lines: Sequence[dict], kind: str, also: Callable[[dict], bool] = lambda _: True):  # type: ignore[no-untyped-def]
    return [x for x in lines if x["answer"]["kind"] == kind and also(x)]


def table(lines: Sequence[dict]) -> str:
    """Rows of figure, aim and result, in Markdown."""
    none, outside = _kind(lines, "none"), _kind(lines, "outside")
    one, two = _kind(lines, "one", clear), _kind(lines, "two", clear)
    faint = _kind(lines, "one", lambda x: not clear(x))
    unlike = [x for x in one if alone(x)]
    told_apart = [x for x in two if x.get("fits") and decided(x)]
    errors, covered = _errors([*one, *two])
    sizes = [len(returned(x)) for x in one if returned(x)]
    times = [x["seconds"] for x in lines]
    told = [x for x in lines if x.get("probability")]
    rows = [
        ("false names where nothing is hidden", "at most 1 of 60", none, lambda x: bool(named(x))),
        (f"right name first, {SHOWS}, no rival alike", ">= 90 %", unlike, right),
        (f"right name first, {SHOWS}, all", "", one, right),
        (f"truth in the returned set, {SHOWS}", ">= 97 %", one, kept),
        ("a wrong name committed to, one effect", "none", one, wrong),
        ("below that: named, and right", "", faint, lambda x: bool(named(x)) and not wrong(x)),
        ("below that: named, and wrong", "", faint, wrong),
        ("both of two effects named", ">= 85 %", two, both_named),
        ("both of two effects named, no other fits as well", "", told_apart, both_named),
        ("both of two effects first, named or not", "", two, lambda x: truth(x) == put_first(x)),
        ("both of two effects in the returned sets", "", two, kept),
        ("nothing hidden: verdict `none`", ">= 95 %", none, lambda x: x["verdict"] == "none"),
        ("what was hidden is in the 95 % set of hypotheses", "93-97 %", told, in_95_set),
        ("outside the library: no name", ">= 85 %", outside, lambda x: not named(x)),
        ("outside the library: seen, and no name", "", outside, lambda x: x["verdict"] in OPEN),
        ("crashes", "none", lines, lambda x: x["verdict"] == "error"),
    ]
    measured = [
        ("median size of the returned set", "<= 2", f"{_median(sizes):g}"),
        ("parameter error, median", "<= 5 %", f"{_median(errors):.1%}"),
        ("95 % interval covers", "88-98 %", f"{np.mean(covered or [0.0]):.0%} of {len(covered)}"),
        ("excess closed on the held-out trial, one effect", ">= 90 %", _closed(one)),
        ("excess closed on the held-out trial, two effects", ">= 80 %", _closed(two)),
        (
            "expected calibration error (were all probabilities right)",
            "<= 0.05",
            f"{calibration_error(told):.3f} ({calibration_by_chance(told):.3f}) of {len(told)}",
        ),
        ("seconds a study on one core, median", "", f"{_median(times):.0f}"),
    ]
    return markdown(("figure", "aim", "result"), [*counted(rows), *measured])


def counted(rows: Sequence[tuple]) -> list[tuple[str, str, str]]:  # type: ignore[type-arg]
    """Rows (what, aim, lines, whether a line is one) as (what, aim, how many of how many)."""
    return [
        (what, aim, f"{sum(map(hit, of))} of {len(of)}" if of else "no case")
        for what, aim, of, hit in rows
    ]


def markdown(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table in Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


if __name__ == "__main__":
    print(table([json.loads(line) for line in Path(sys.argv[1]).read_text().splitlines()]))
