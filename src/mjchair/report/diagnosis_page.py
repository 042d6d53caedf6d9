"""The report of a diagnosis: one page that opens offline and reads as an argument."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Iterable, Mapping, Sequence

import matplotlib
from matplotlib.figure import Figure

from mjchair.diagnosis.advice import plain
from mjchair.diagnosis.experiments import Plan
from mjchair.diagnosis.linear import BAND
from mjchair.diagnosis.verdict import CLOSES, Diagnosis, Named, Ranked
from mjchair.effects.library import find
from mjchair.errors import MjchairError
from mjchair.report import diagnosis_figures

STYLE = """
body{font:16px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;color:#222}
h1{font-size:1.6rem}h2{font-size:1.2rem;margin-top:2.4rem}img{max-width:100%}
table{border-collapse:collapse;font-size:.9rem;margin:1rem 0}
td,th{padding:.2rem .8rem .2rem 0;text-align:left;border-bottom:1px solid #ddd}
td.n,th.n{text-align:right}tr.chosen{background:#eef3f8}
.verdict{background:#eef3f8;padding:.8rem 1rem;border-left:4px solid #1f4e9c;font-size:1.1rem}
.note{color:#555;font-size:.9rem}
"""
FAMILY = 0.01  # level of the gap test
CANDIDATES = 14  # rows of the table
EXPERIMENTS = 8  # rows of theirs


def figures(diagnosis: Diagnosis) -> dict[str, bytes]:
    """The figures as PNG, by name."""
    makers = {
        "where": diagnosis_figures.where,
        "force": diagnosis_figures.missing_force,
        "candidates": diagnosis_figures.candidates,
        "compared": diagnosis_figures.compared,
        "gap": diagnosis_figures.gap,
    }
    if not diagnosis.candidates:
        del makers["candidates"]
    with matplotlib.rc_context({"font.size": 9.5}):
        return {name: _png(make(diagnosis)) for name, make in makers.items()}


def _png(figure: Figure) -> bytes:
    out = io.BytesIO()
    figure.savefig(out, format="png", dpi=120)
    return out.getvalue()


def page(diagnosis: Diagnosis, drawn: Mapping[str, bytes], title: str = "Diagnosis") -> str:
    """The page as HTML; figures and style are inside.

    Args:
      drawn: figures by name, as `figures` makes them. title: of the page, such as the study's.
    """
    parts = [
        '<!doctype html><html lang="en"><head><meta charset="utf-8">',
        f"<title>{html.escape(title)}</title><style>{STYLE}</style></head><body>",
        f"<h1>{html.escape(title)}</h1>",
        f'<p class="verdict">{sentence(diagnosis)}</p>',
        *_where(diagnosis, drawn),
        *_force(diagnosis, drawn),
        *_candidates(diagnosis, drawn),
        *_choice(diagnosis),
        *_compared(diagnosis, drawn),
        *_gap(diagnosis, drawn),
        *_next(diagnosis),
        *_assumed(diagnosis),
        "</body></html>",
    ]
    return "\n".join(parts) + "\n"


def sentence(diagnosis: Diagnosis) -> str:
    """The verdict in one sentence, as HTML."""
    effects = ", and ".join(_effect(e) for e in diagnosis.effects)
    if diagnosis.verdict == "none":
        return "The chair explains these runs: nothing is left that the noise would not give."
    if diagnosis.verdict == "named":
        return f"The chair lacks {effects}."
    if diagnosis.verdict == "ambiguous":
        sets = "; ".join(" or ".join(_bold(n) for n in group) for group in diagnosis.alternatives)
        undecided = (
            f"it may be {sets}, which these runs cannot tell apart"
            if sets
            else "the evidence for it is thin"
        )
        return f"Something is missing: {undecided}; the corrected chair has {effects}."
    return "Something is missing that no effect of the library explains, so none is named."


def _bold(name: str) -> str:
    return f"<b>{html.escape(name.replace('_', ' '))}</b>"


def _effect(effect: Named) -> str:
    """Name and parameters."""
    on = f" on {html.escape(effect.channel)}" if effect.channel else ""
    return f"{_bold(effect.name)}{on} ({', '.join(_parameters(effect))})"


def _parameters(effect: Named) -> Iterable[str]:
    for name, p in effect.parameters.items():
        unit = "" if p["unit"] == "1" else f" {html.escape(str(p['unit']))}"
        spread = " held" if p["std"] is None else f" ± {p['std']:.2g}"
        yield f"{html.escape(name.replace('_', ' '))} {p['value']:.4g}{spread}{unit}"


def _where(diagnosis: Diagnosis, drawn: Mapping[str, bytes]) -> list[str]:
    p = float(diagnosis.gap.get("p_value", 1.0))
    exists = (
        "is not worth a search: the verdict is none"
        if diagnosis.verdict == "none"
        else "is more than noise"
    )
    cells = diagnosis.where[:8]
    rows = [
        (
            html.escape(str(w["trial"])),
            html.escape(str(w["channel"])),
            f"{w['window'][0]:.1f} to {w['window'][1]:.1f} s",
            html.escape("; ".join(f"{k.replace('_', ' ')} {v}" for k, v in w["regime"].items())),
            f"{w['statistic']:.2f}",
        )
        for w in cells
    ]
    return [
        "<h2>1. Where model and measurement disagree</h2>",
        f"<p>Every window of about 2 s is simulated from its own fitted state, so that only forces "
        f"show. All tests together: chance of such a gap from noise alone {_p(p)}, "
        f"at a level of {FAMILY:g}. It {exists}.</p>",
        _image(drawn, "where", "Residual over noise, by channel and window"),
        _table(("trial", "channel", "window", "regime", "!chi² / dof (1)"), rows),
        f'<p class="note">chi² / dof of the residual below {BAND:g} Hz against the noise of the '
        "channel; 1 is what noise gives. The largest cells are listed.</p>",
    ]


def _p(p: float) -> str:
    """A probability; below what a number can hold it is said so."""
    return f"p = {p:.2g}" if p > 1e-300 else "p &lt; 1e-300"


def _force(diagnosis: Diagnosis, drawn: Mapping[str, bytes]) -> list[str]:
    rows = [
        (
            "forward force" if d["force"] == "Fx" else "yaw moment",
            html.escape(str(d["goes_with"]).replace("_", " ")),
            f"{d['sigmas']:.1f}",
        )
        for d in diagnosis.drivers
    ]
    left = "What is left goes with" if diagnosis.effects else "It goes with"
    said = (
        f"<p>{left}:</p>" + _table(("force", "goes with", "!sigma"), rows)
        if rows
        else "<p>After the correction no force is left that goes with anything tested.</p>"
        if diagnosis.effects
        else "<p>No force that goes with anything tested stands out.</p>"
    )
    return [
        "<h2>2. What force would close the gap, and what it goes with</h2>",
        "<p>In the chair's own frame, without any named effect: a constant level with the sign of "
        "the speed reads as rolling or bearing friction, a parabola over speed as air, a wave over "
        "the heading as a slope or wind.</p>",
        _image(drawn, "force", "Missing force against speed, yaw rate, heading and torque"),
        '<p class="note">Dots: every 0.2 s. Circles: means with standard errors, drawn towards '
        "zero where the data say little.</p>",
        said,
    ]


def _candidates(diagnosis: Diagnosis, drawn: Mapping[str, bytes]) -> list[str]:
    chosen = {(e.name, e.channel) for e in diagnosis.effects}
    shown = diagnosis_figures.leading(diagnosis, CANDIDATES)
    rows = [_candidate(c) for c in shown]
    marks = [(c.name, c.channel) in chosen for c in shown]
    head = (
        "effect",
        "what it looks like",
        "!size (sigma)",
        "!gain left out (chi²)",
        "!closes",
        "!|cos|",
        "!p",
    )
    sets = "; ".join(" / ".join(_bold(n) for n in group) for group in diagnosis.alternatives)
    apart = (
        f"Not to be told apart by these data: {sets}."
        if sets
        else "No two explanations are left that these data cannot tell apart."
        if diagnosis.verdict == "named"
        else ""
    )
    return [
        "<h2>3. Which effects could make it, and which look alike</h2>",
        "<p>Every effect alone, beside what is only roughly known (mass, centre of mass, inertia, "
        f"tire stiffness, sensor bias). {apart}</p>",
        _image(drawn, "candidates", "Candidates: size, gain on runs left out, likeness"),
        _table(head, rows, marks),
        '<p class="note">Gain: drop of chi² on each run when the effect was fitted to the others. '
        "Bars of losses are cut. |cos|: how much of the effect, in these data, looks like the "
        "chosen ones; 1 is alike. p: "
        "of the effect alone, for no effect; small values of many rows are one gap seen many times."
        "</p>",
    ]


def _candidate(c: Ranked) -> tuple[str, ...]:
    name = html.escape(c.name.replace("_", " ") + (f" ({c.channel})" if c.channel else ""))
    return (
        name,
        html.escape(_signature(c)),
        f"{c.detectability:.1f}",
        f"{c.held_out_gain:.0f}",
        f"{c.closure:.0%}",
        f"{c.collinear:.2f}",
        _p(c.p_value).removeprefix("p = ").removeprefix("p "),
    )


def _signature(c: Ranked) -> str:
    """The effect's one line; nothing for an effect of the user's own."""
    try:
        return find(c.name, c.channel).signature
    except MjchairError:
        return ""


def _choice(diagnosis: Diagnosis) -> list[str]:
    out = ["<h2>4. Which one it is</h2>"]
    if diagnosis.verdict == "none":
        return [*out, "<p>None is named, since there is no gap to explain.</p>"]
    if diagnosis.verdict == "unknown":
        return [
            *out,
            f"<p>None is named: no effect, nor two or three together, closes {CLOSES:.0%} of the "
            "gap and holds on runs left out. Section 2 is what is known of the force.</p>",
        ]
    rows = []
    for e in diagnosis.effects:
        for name, p in e.parameters.items():
            on = f" ({e.channel})" if e.channel else ""
            rows.append(
                (
                    html.escape(e.name.replace("_", " ") + on),
                    html.escape(name.replace("_", " ")),
                    f"{p['value']:.4g}",
                    "held" if p["std"] is None else f"{p['std']:.2g}",
                    html.escape(str(p["unit"])),
                    f"{e.closure:.0%}",
                )
            )
    head = ("effect", "parameter", "!value", "!standard deviation", "unit", "!closes")
    why = (
        "It is significant, holds on runs that it was not fitted to, closes most of the gap, and "
        "no rival comes near."
        if diagnosis.verdict == "named"
        else "It is one explanation that fits; another of its set fits about as well, or its "
        "parameter is not clearly away from nothing."
    )
    return [*out, f"<p>{why}</p>", _table(head, rows)]


def _compared(diagnosis: Diagnosis, drawn: Mapping[str, bytes]) -> list[str]:
    runs = diagnosis.stages["base"].bench.shooter.study.runs
    held = any(r.hold_out for r in runs)
    which = (
        "Runs that were held out of every fit"
        if held
        else "No run is held out in this study (`hold_out = true`), so these are runs of the fit"
    )
    return [
        "<h2>5. The corrected chair beside the old one</h2>",
        f"<p>{which}. Each is simulated in one go from its first state, with the measured inputs; "
        "small errors pile up here, which is why nothing above is judged by it.</p>",
        _image(drawn, "compared", "Measured, old and corrected chair over whole runs"),
    ]


def _gap(diagnosis: Diagnosis, drawn: Mapping[str, bytes]) -> list[str]:
    g = diagnosis.gap
    rows = [
        ("before", f"{g['before']:.2f}"),
        ("after", f"{g['after']:.2f}"),
        ("noise floor", f"{g['noise_floor']:.2f}"),
    ]
    left = ""
    if diagnosis.effects:
        p = float(g.get("p_value_after", 1.0))
        left = f"<p>All tests again on what is left: {_p(p)}"
        left += ", below the level: something small is left.</p>" if p < FAMILY else ": noise.</p>"
    return [
        "<h2>6. The gap before, after, and the noise</h2>",
        _image(drawn, "gap", "Gap of every trial before and after"),
        _table(("gap", "!rms over noise (1)"), rows),
        f'<p class="note">Scope of the table: {html.escape(str(g["scope"]))}.</p>',
        left,
    ]


def _next(diagnosis: Diagnosis) -> list[str]:
    said = html.escape(diagnosis.next_experiment) or "These data decide; none is needed."
    plan: Plan | None = diagnosis.stages.get("experiments")
    return [
        "<h2>7. The experiment to do next</h2>",
        f"<p>{said}</p>",
        *(_experiments(plan) if plan is not None else []),
    ]


def _experiments(plan: Plan) -> list[str]:
    head = ("manoeuvre", *(f"!from {html.escape(plain(rival))} (sigma)" for rival in plan.rivals))
    rows = [
        (html.escape(e.manoeuvre.name), *(f"{t**0.5:.1f}" for t in e.separations))
        for e in plan.experiments[:EXPERIMENTS]
    ]
    return [
        _table(head, rows, [k == 0 for k in range(len(rows))]),
        f'<p class="note">{len(rows)} of {len(plan.experiments)} manoeuvres, best first, and '
        "simplest first above 10 sigmas, simulated with the corrected chair: how far each "
        "explanation would fall behind, after everything that is only roughly known and its own "
        "parameters have done their best.</p>",
    ]


def _assumed(diagnosis: Diagnosis) -> list[str]:
    base, fitted = diagnosis.stages["base"], diagnosis_figures.fitted_fit(diagnosis)
    offsets = base.plain.fit.offsets if fitted is None else fitted.fit.offsets
    moved = [
        (
            html.escape(n.name.replace("_", " ")),
            f"{n.std:.3g}",
            html.escape(n.unit),
            f"{offsets[n.name]:+.2f}",
        )
        for n in base.bench.nuisances
        if n.name in offsets
    ]
    return [
        "<h2>8. What was assumed</h2>",
        "<ul>",
        *(f"<li>{html.escape(note)}</li>" for note in diagnosis.notes),
        "<li>The corrected chair (model.xml) has the effects of section 4 in it and nothing else: "
        "what is only roughly known stays as it was given.</li>",
        "</ul>",
        "<p>What is only roughly known, and how far the fit moved it:</p>",
        _table(
            ("quantity", "!prior sd", "unit", "!moved by (prior sd)"),
            moved,
        ),
    ]


def _image(drawn: Mapping[str, bytes], name: str, alt: str) -> str:
    if name not in drawn:
        return ""
    data = base64.b64encode(drawn[name]).decode()
    return f'<img alt="{html.escape(alt)}" src="data:image/png;base64,{data}">'


def _table(
    head: Sequence[str], rows: Sequence[Sequence[str]], marks: Sequence[bool] | None = None
) -> str:
    """A table of cells that are HTML; columns whose head starts with ! hold numbers."""
    if not rows:
        return ""
    kind = [' class="n"' if h.startswith("!") else "" for h in head]
    top = "".join(f"<th{k}>{h.lstrip('!')}</th>" for k, h in zip(kind, head, strict=True))
    body = ""
    for i, row in enumerate(rows):
        cells = "".join(f"<td{k}>{c}</td>" for k, c in zip(kind, row, strict=True))
        body += f'<tr class="chosen">{cells}</tr>' if marks and marks[i] else f"<tr>{cells}</tr>"
    return f"<table><tr>{top}</tr>{body}</table>"
