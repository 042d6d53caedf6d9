"""The report of a diagnosis: one page that opens offline.

In: a diagnosis and its figures. Out: HTML with style and figures inside. The first screen says what
is missing, how sure that is and what to do next, with one picture; the argument is folded below it.
The form is in templates/, the sentences are made in diagnosis_words/.
"""

from __future__ import annotations

import base64
import functools
import io
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import jinja2
import matplotlib
from markupsafe import Markup, escape
from matplotlib.figure import Figure

from mjchair.diagnosis.next_experiment.comparison import Experiment
from mjchair.diagnosis.next_experiment.wording import plain, plain_together, roughly_known
from mjchair.diagnosis.result import Candidate, Diagnosis
from mjchair.effects.library import find
from mjchair.errors import MjchairError
from mjchair.report import colours
from mjchair.report.diagnosis_figures import (
    candidates,
    gap,
    missing_force,
    probability,
    summary,
    where,
    whole_runs,
)
from mjchair.report.diagnosis_words import sections
from mjchair.report.diagnosis_words.first_screen import first_screen, next_step
from mjchair.report.diagnosis_words.forces import FORCES, known_drivers, regime
from mjchair.report.diagnosis_words.names import open_upwards
from mjchair.units import per_cent

TEMPLATE = "diagnosis.html"
CANDIDATES = 14  # rows of the table
EXPERIMENTS = 8
CELLS = 8
RESOLUTION = 120  # dots per inch


@dataclass(frozen=True)
class Head:
    """The head of a column, and whether it holds numbers."""

    text: str
    number: bool = False


@dataclass(frozen=True)
class Row:
    """Cells of a row, and whether it is the chosen one."""

    cells: Sequence[str]
    chosen: bool = False


@dataclass(frozen=True)
class Table:
    """A table of text; without rows it is not shown."""

    heads: Sequence[Head] = ()
    rows: Sequence[Row] = field(default_factory=list)


def figures(diagnosis: Diagnosis) -> dict[str, bytes]:
    """The figures as PNG, by name; those that have nothing to show are left out."""
    makers = {
        "summary": summary.figure,
        "where": where.figure,
        "force": missing_force.figure,
        "candidates": candidates.figure,
        "compared": whole_runs.figure,
        "gap": gap.figure,
        "probability": probability.figure,
    }
    with matplotlib.rc_context({"font.size": 9.5}):
        drawn = {name: make(diagnosis) for name, make in makers.items()}
    return {name: _png(figure) for name, figure in drawn.items() if figure is not None}


def _png(figure: Figure) -> bytes:
    out = io.BytesIO()
    figure.savefig(out, format="png", dpi=RESOLUTION, metadata={"Software": None})
    return out.getvalue()


def page(
    diagnosis: Diagnosis,
    drawn: Mapping[str, bytes],
    title: str = "Diagnosis",
    replay: str = "",
) -> str:
    """The page as HTML.

    Args:
      drawn: figures by name, as `figures` makes them.
      title: of the page, such as the study's.
      replay: HTML of a replay to show on the first screen; "": none.
    """
    evidence, gaps = diagnosis.evidence, diagnosis.gap
    said = {
        "gap": sections.gap_words(diagnosis),
        "process": sections.process_words(diagnosis),
        "drivers": sections.driver_words(diagnosis),
        "alike": sections.alike_words(diagnosis),
        "other_runs": sections.other_runs(diagnosis),
        "choice": sections.choice_words(diagnosis),
        "left": sections.left_words(diagnosis),
        "runs": sections.runs_words(diagnosis),
        "experiment": diagnosis.next_experiment or next_step(diagnosis),
        "experiments": _experiments_note(diagnosis),
    }
    tables = {
        "where": _cells(diagnosis),
        "drivers": _drivers(diagnosis),
        "candidates": _candidates(diagnosis),
        "effects": _effects(diagnosis),
        "gap": _gap(diagnosis),
        "experiments": _experiments(diagnosis),
        "moved": _moved(diagnosis),
    }
    return (
        _environment()
        .get_template(TEMPLATE)
        .render(
            title=title,
            verdict=str(diagnosis.verdict),
            first=first_screen(diagnosis),
            said=said,
            tables=tables,
            notes=sections.notes(diagnosis),
            captions={
                "summary": summary.caption(diagnosis),
                "where": where.caption(diagnosis),
                "force": missing_force.caption(diagnosis),
                "compared": whole_runs.CAPTION,
            },
            pictures={name: base64.b64encode(image).decode() for name, image in drawn.items()},
            replay=replay,
            corrected=bool(diagnosis.effects),
            highest=evidence.windows.highest if evidence else 0.0,
            scope=gaps.scope if gaps else "",
            colours={"after": colours.AFTER},
        )
    )


@functools.cache
def _environment() -> jinja2.Environment:
    """Everything that is put into the page is escaped, whatever its file is called."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("mjchair.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.filters["strong"] = lambda text: _marked(text, r"\*\*(.+?)\*\*", "b")
    environment.filters["code"] = lambda text: _marked(text, r"`([^`]+)`", "code")
    return environment


def _marked(text: str, pattern: str, tag: str) -> Markup:
    """Escaped text in which what the pattern's group holds stands in a tag."""
    return Markup(re.sub(pattern, rf"<{tag}>\1</{tag}>", str(escape(text))))


def _cells(diagnosis: Diagnosis) -> Table:
    heads = [
        Head("trial"),
        Head("channel"),
        Head("window"),
        Head("regime"),
        Head("chi² / dof (1)", True),
    ]
    rows = [
        Row(
            [
                w.trial,
                w.channel,
                f"{w.window[0]:.1f} to {w.window[1]:.1f} s",
                regime(diagnosis, w),
                f"{w.statistic:.3g}" if w.statistic < 1000 else f"{w.statistic:,.0f}",
            ]
        )
        for w in diagnosis.where[:CELLS]
    ]
    return Table(heads, rows)


def _drivers(diagnosis: Diagnosis) -> Table:
    rows = [
        Row(
            [
                FORCES.get(d.force, d.force),
                plain(str(d.goes_with)),
                f"{d.sigmas:.1f}",
            ]
        )
        for d in known_drivers(diagnosis)
    ]
    return Table([Head("force"), Head("goes with"), Head("sigma", True)], rows)


def _candidates(diagnosis: Diagnosis) -> Table:
    chosen = {(e.name, e.channel) for e in diagnosis.effects}
    heads = [
        Head("effect"),
        Head("what it looks like"),
        Head("size (sigma)", True),
        Head("gain left out (chi²)", True),
    ]
    leading = candidates.leading(diagnosis, CANDIDATES)
    closes, alike = any(c.closure for c in leading), bool(chosen)
    heads += [Head("closes", True)] * closes + [Head("|cos|", True)] * alike
    rows = [Row(_candidate(c, closes, alike), (c.name, c.channel) in chosen) for c in leading]
    return Table(heads, rows)


def _candidate(c: Candidate, closes: bool, alike: bool) -> list[str]:
    """Cells of an effect, with the share that it closes and its likeness where these are shown."""
    on = f" ({c.channel})" if c.channel else ""
    return [
        plain(c.name) + on,
        _signature(c),
        f"{c.detectability:.1f}",
        f"{c.held_out_gain:,.0f}",
        *([per_cent(c.closure)] if closes else []),
        *([f"{c.collinear:.2f}"] if alike else []),
    ]


def _signature(c: Candidate) -> str:
    """The effect's one line; nothing for an effect of the user's own."""
    try:
        return find(c.name, c.channel).signature
    except MjchairError:
        return ""


def _effects(diagnosis: Diagnosis) -> Table:
    heads = [
        Head("effect"),
        Head("parameter"),
        Head("value", True),
        Head("standard deviation", True),
        Head("unit"),
        Head("closes", True),
    ]
    rows = [
        Row(
            [
                plain(e.name) + (f" ({e.channel})" if e.channel else ""),
                plain(name),
                open_upwards(p) or f"{p.value:.4g}",
                "held" if p.std is None else f"{p.std:.2g}",
                p.unit,
                per_cent(e.closure),
            ]
        )
        for e in diagnosis.effects
        for name, p in e.parameters.items()
    ]
    return Table(heads, rows)


def _gap(diagnosis: Diagnosis) -> Table:
    """Before, after where there is a corrected chair, and noise."""
    g = diagnosis.gap
    if g is None:
        return Table()
    rows = [Row(["the chair as it was", f"{g.before:.2f}"])]
    if diagnosis.effects and g.after is not None:
        rows.append(Row(["the corrected chair", f"{g.after:.2f}"]))
    rows.append(Row(["noise alone", f"{g.noise_floor:.2f}"]))
    return Table([Head("what is left of"), Head("rms over noise (1)", True)], rows)


def _experiments(diagnosis: Diagnosis) -> Table:
    plan = diagnosis.evidence.plan if diagnosis.evidence else None
    if plan is None:
        return Table()
    heads = [
        Head("manoeuvre"),
        *(Head(f"from {plain_together(r)} (sigma)", True) for r in plan.rivals),
    ]
    rows = [
        Row([e.manoeuvre.name, *(_separated(e, t) for t in e.separations)], chosen=k == 0)
        for k, e in enumerate(plan.experiments[:EXPERIMENTS])
    ]
    return Table(heads, rows)


def _separated(experiment: Experiment, t: float) -> str:
    """T, chi2, in sigma; of what was not compared in full, what it is at most."""
    return f"{'at most ' if experiment.at_most else ''}{t**0.5:.1f}"


def _experiments_note(diagnosis: Diagnosis) -> str:
    plan = diagnosis.evidence.plan if diagnosis.evidence else None
    if plan is None:
        return ""
    shown = min(EXPERIMENTS, len(plan.experiments))
    return (
        f"{shown} of {len(plan.experiments)} manoeuvres, best first, and simplest first where "
        "they decide with a margin, simulated with the corrected chair: how far each explanation "
        "would fall behind after everything that is only roughly known, and its own parameters, "
        'have been fitted. "At most" is how far it differs before they are, where that is enough '
        "to see that another manoeuvre comes first."
    )


def _moved(diagnosis: Diagnosis) -> Table:
    heads = [
        Head("quantity"),
        Head("prior standard deviation", True),
        Head("unit"),
        Head("moved by", True),
        Head("in prior standard deviations", True),
    ]
    rows = [
        Row(
            [
                roughly_known(m.name),
                f"{m.std:.3g}",
                m.unit,
                f"{m.by * m.std:+.2g}",
                f"{m.by:+.2f}",
            ]
        )
        for m in (diagnosis.evidence.moved if diagnosis.evidence else ())
    ]
    return Table(heads, rows)
