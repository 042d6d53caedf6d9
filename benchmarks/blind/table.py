"""The table of a blind run: what was asked for, and what was reached."""

from __future__ import annotations

import numpy as np


def named(line: dict) -> list[str]:
    """Names that a verdict commits to."""
    return [e["name"] for e in line["effects"]] if line["verdict"] == "named" else []


def returned(line: dict) -> set[str]:
    """All names that a verdict leaves standing."""
    if line["verdict"] not in ("named", "ambiguous"):
        return set()
    return {e["name"] for e in line["effects"]} | {n for g in line["alternatives"] for n in g}


def first(line: dict) -> str:
    """The name a verdict puts first."""
    return line["effects"][0]["name"] if line["effects"] else ""


def _share(hits: list[bool]) -> str:
    return f"{sum(hits)} of {len(hits)}" if hits else "no case"


def _errors(lines: list[dict]) -> tuple[list[float], list[bool]]:
    errors, covered = [], []
    for line in lines:
        truth = line["answer"]["hidden"]
        for effect in line["effects"]:
            for name, value in truth.get(effect["name"], {}).items():
                fitted = effect["parameters"].get(name)
                if not fitted or not fitted["std"] or name in ("mass", "phase", "radius"):
                    continue
                errors.append(abs(fitted["value"] - value) / max(abs(value), 1e-12))
                covered.append(abs(fitted["value"] - value) < 1.96 * fitted["std"])
    return errors, covered


def table(lines: list[dict]) -> str:
    """Rows of figure, aim and result, in Markdown."""
    kind = {k: [x for x in lines if x["answer"]["kind"] == k] for k in
            ("none", "one", "two", "outside")}  # fmt: skip
    strong = [x for x in kind["one"] if x["answer"]["sigma"] >= 15.0]
    inside = [x for x in kind["one"] + kind["two"] if x["answer"]["sigma"] >= 15.0]
    errors, covered = _errors(strong)
    sizes = [len(returned(x)) for x in strong if returned(x)]
    false = [bool(named(x)) for x in kind["none"]]
    right = [first(x) in x["answer"]["hidden"] for x in strong]
    inset = [bool(set(x["answer"]["hidden"]) & returned(x)) for x in strong]
    wrong = [bool(set(named(x)) - set(x["answer"]["hidden"])) for x in inside]
    both = [set(x["answer"]["hidden"]) <= set(named(x)) for x in kind["two"]]
    quiet = [not named(x) for x in kind["outside"]]
    times = [x["seconds"] for x in lines]
    rows = [
        ("false names without an effect", "at most 1 of 60", _share(false)),
        ("right name first, 15 sigma or more", ">= 90 %", _share(right)),
        ("truth in the returned set, 15 sigma or more", ">= 97 %", _share(inset)),
        ("median size of the set", "<= 2", f"{np.median(sizes):g}" if sizes else "no case"),
        ("parameter error, median", "<= 5 %", f"{np.median(errors):.1%}" if errors else "no case"),
        ("95 % interval covers", "88-98 %", _share(covered)),
        ("a wrong name committed to", "none", _share(wrong)),
        ("both of two effects named", ">= 75 %", _share(both)),
        ("outside the library: no name", ">= 85 %", _share(quiet)),
        ("seconds, median", "", f"{np.median(times):.0f}" if times else ""),
    ]
    head = "| figure | aim | result |\n|---|---|---|\n"
    return head + "\n".join(f"| {a} | {b} | {c} |" for a, b, c in rows)
