"""The disclosure sheet: one page that opens offline, with a table and a picture for each test.

In: results by design and test. Out: `sheet.html`, which contains its style and pictures. The
jinja2 template is `sheet.html.jinja` in this folder.
"""

from __future__ import annotations

import base64
import io
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import jinja2
import matplotlib

matplotlib.use("Agg")

from matplotlib import pyplot as plt

from mjchair.storage import write_whole
from mjchair.testlab.classes import reached
from mjchair.testlab.laboratory import REPLAYS, TESTS, Request
from mjchair.testlab.result import Result, Value

COLOURS = ("#1f4e9c", "#b03060", "#2a7f3f", "#b8860b", "#6a3d9a", "#444444", "#008b8b", "#d2691e")


def number(value: Any, unit: str = "") -> str:
    """A value as text: degrees with one decimal, whole millimetres, others with three digits."""
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, str):
        return value
    if unit == "deg":
        return f"{value:.1f}"
    if unit in ("mm", "1/1") or (float(value).is_integer() and abs(value) < 1e6):
        return f"{value:.0f}"
    return f"{value:.3g}"


def interval(value: Value) -> str:
    """The interval of a value as text; "" where it has none."""
    if value.low is None or value.high is None:
        return ""
    return f"{number(value.low, value.unit)} to {number(value.high, value.unit)}"


def picture(result: Result) -> str:
    """The curves of a result as a PNG in base64; "" where it has no curves."""
    if not result.curves:
        return ""
    with matplotlib.rc_context({"font.size": 8.5}):
        figure, ax = plt.subplots(figsize=(4.6, 2.7), layout="constrained")
        for i, (name, (x, y)) in enumerate(result.curves.items()):
            marker = "o" if len(x) < 12 else ""
            ax.plot(
                x,
                y,
                color=COLOURS[i % len(COLOURS)],
                lw=1.3,
                marker=marker,
                ms=3.5,
                label=name.replace("_", " "),
            )
        ax.set_xlabel(result.axes[0])
        ax.set_ylabel(result.axes[1])
        ax.spines[["top", "right"]].set_visible(False)
        ax.grid(alpha=0.25)
        if len(result.curves) > 1:
            ax.legend(frameon=False, fontsize=7.5)
        out = io.BytesIO()
        figure.savefig(out, format="png", dpi=130)
        plt.close(figure)
    return base64.b64encode(out.getvalue()).decode()


def _rows(test: str, designs: Mapping[str, Mapping[str, Result]]) -> list[dict[str, Any]]:
    """One row for each key, with one cell for each design."""
    keys = dict.fromkeys(
        key for results in designs.values() if test in results for key in results[test].values
    )
    rows = []
    for key in keys:
        cells = [
            results[test].values.get(key) if test in results else None
            for results in designs.values()
        ]
        first = next(cell for cell in cells if cell is not None)
        rows.append(
            {
                "key": key,
                "name": key.replace("_", " "),
                "unit": first.unit,
                "cells": ["" if c is None else number(c.value, c.unit) for c in cells],
                "interval": _each(designs, [interval(c) if c else "" for c in cells]),
                "note": _each(designs, [c.note if c else "" for c in cells]),
                "source": first.source,
            }
        )
    return rows


def _each(designs: Iterable[str], texts: Sequence[str]) -> str:
    """What is said of every design, or of each by its name where it is not the same of all."""
    if len(set(texts)) == 1:
        return texts[0]
    named = zip(designs, texts, strict=True)
    return "; ".join(f"{name}: {text}" for name, text in named if text)


def page(
    title: str,
    about: Sequence[str],
    designs: Mapping[str, Mapping[str, Result]],
    replays: Sequence[str] = (),
) -> str:
    """The sheet as HTML.

    Args:
      title: of the page. about: sentences about the chair. designs: name -> test -> result.
      replays: paths, relative to the sheet, of replay pages named `<test>-<run>.html`.
    """
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["number"] = number
    tests: list[dict[str, Any]] = []
    for test, (_, heading) in TESTS.items():
        shown = next((name for name, results in designs.items() if test in results), None)
        if shown is None:
            continue
        result = designs[shown][test]
        tests.append(
            {
                "name": test,
                "heading": heading,
                "result": result,
                "of": shown if len(designs) > 1 else "",
                "rows": _rows(test, designs),
                "picture": picture(result),
                "replays": [r for r in replays if Path(r).name.startswith(f"{test}-")],
            }
        )
    return environment.get_template("sheet.html.jinja").render(
        title=title,
        about=about,
        designs=list(designs),
        tests=tests,
        classes=[(name, reached(results)) for name, results in designs.items()],
        intervals=any(row["interval"] for test in tests for row in test["rows"]),
    )


def about(request: Request) -> tuple[str, list[str]]:
    """The title, and sentences about the tested chair."""
    design = next(iter(request.designs.values()))
    spec = design.spec()
    model = spec.compile()
    mass = float(model.body_subtreemass[0])
    dummy = "with the model's own occupant"
    if design.occupant is not None:
        dummy = f"with a dummy of {design.occupant:g} kg"
    sentences = [
        f"Simulated with mjchair, {dummy}; {mass:.1f} kg in all. Not a certificate: the procedures "
        "follow the parts of ISO 7176 as far as docs/test_laboratory.md says, and nothing here was "
        "measured on a real chair."
    ]
    if request.draws:
        sentences.append(
            f"Intervals: 2.5 to 97.5 % of {len(request.draws)} chairs drawn from the ranges of "
            "masses, centre of mass and tires in mjchair/testlab/uncertainty.py."
        )
    return f"Test sheet: {Path(design.model).stem}", sentences


def write(
    path: str | os.PathLike[str],
    request: Request,
    by_design: Mapping[str, Mapping[str, Result]],
) -> None:
    """Write the sheet of a request's results, completely or not at all."""
    title, sentences = about(request)
    folder = Path(path).parent
    replays = sorted(p.relative_to(folder).as_posix() for p in folder.glob(f"**/{REPLAYS}/*.html"))
    write_whole(path, page(title, sentences, by_design, replays))
