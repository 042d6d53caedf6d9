"""The report of a diagnosis: one page that opens offline and reads as an argument."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from mjchair.diagnosis import force
from mjchair.diagnosis.shooting import residual
from mjchair.diagnosis.verdict import Diagnosis

STYLE = """
body{font:16px/1.5 system-ui,sans-serif;max-width:58rem;margin:2rem auto;padding:0 1rem;color:#222}
h1{font-size:1.6rem}h2{font-size:1.2rem;margin-top:2.2rem}img{max-width:100%}
table{border-collapse:collapse;font-size:.92rem}td,th{padding:.2rem .7rem;text-align:left;
border-bottom:1px solid #ddd}.verdict{background:#eef3f8;padding:1rem;border-left:4px solid #36c}
"""


def _png(figure: Figure) -> bytes:
    out = io.BytesIO()
    figure.savefig(out, format="png", dpi=110, bbox_inches="tight")
    return out.getvalue()


def figures(diagnosis: Diagnosis) -> dict[str, bytes]:
    """The figures as PNG, by name."""
    out = {
        "where": _png(_where(diagnosis)),
        "force": _png(_force(diagnosis)),
        "candidates": _png(_candidates(diagnosis)),
        "runs": _png(_runs(diagnosis)),
    }
    return out


def _where(diagnosis: Diagnosis) -> Figure:
    base, fitted = diagnosis.stages["base"], diagnosis.stages["fitted"]
    shooter = base.bench.shooter
    systems = [("before", base.system)] + ([("after", fitted.system)] if fitted else [])
    figure = Figure(figsize=(9, 0.28 * len(shooter.channels) + 1.6))
    axes = figure.subplots(1, len(systems), sharey=True, squeeze=False)[0]
    labels = [f"{shooter.study.runs[w.run].trial.name} {w.first:.0f} s" for w in shooter.windows]
    for ax, (name, system) in zip(axes, systems, strict=True):
        ratio = np.array([c.chi2 / np.maximum(c.dof, 1.0) for c in system.cells]).T
        image = ax.imshow(np.sqrt(ratio), aspect="auto", cmap="magma_r", vmin=0.5, vmax=4.0)
        ax.set_title(f"residual over noise, {name}")
        ax.set_xticks(range(len(labels)), labels, rotation=90, fontsize=6)
        ax.set_yticks(range(len(shooter.channels)), shooter.channels, fontsize=8)
    figure.colorbar(image, ax=list(axes), label="rms below 2 Hz / noise (1)")
    return figure


def _force(diagnosis: Diagnosis) -> Figure:
    base = diagnosis.stages["base"]
    found = force.residual_force(base.bench, base.track, base.pulses, base.answers)
    known = force.drivers(base.bench, base.track)
    figure = Figure(figsize=(9, 5.2))
    axes = figure.subplots(2, 3)
    shown = (("speed", "m/s"), ("yaw_rate", "rad/s"), ("heading", "rad"))
    for row, name in zip(axes, ("Fx", "Mz"), strict=True):
        mine = [k for k, p in enumerate(found.pulses) if p.force == name]
        for ax, (driver, unit) in zip(row, shown, strict=True):
            x = []
            for k in mine:
                d = known[found.pulses[k].window]
                at = min(int(np.searchsorted(d["time"], found.pulses[k].time)), len(d["time"]) - 1)
                x.append(d[driver][at])
            ax.errorbar(x, found.value[mine], found.std[mine], fmt=".", ms=3, lw=0.4, color="#36c")
            ax.axhline(0.0, color="#999", lw=0.6)
            ax.set_xlabel(f"{driver} ({unit})")
            ax.set_ylabel(f"missing {name} ({'N' if name == 'Fx' else 'N m'})")
    figure.tight_layout()
    return figure


def _candidates(diagnosis: Diagnosis) -> Figure:
    top = diagnosis.candidates[:14][::-1]
    figure = Figure(figsize=(9, 0.3 * max(len(top), 3) + 1.2))
    left, right = figure.subplots(1, 2, sharey=True)
    names = [c.name + (f" ({c.channel})" if c.channel else "") for c in top]
    left.barh(names, [c.held_out_gain for c in top], color="#36c")
    left.set_xlabel("gain on runs left out (chi2)")
    right.barh(names, [c.detectability for c in top], color="#c63")
    right.set_xlabel("alone: sigmas")
    figure.tight_layout()
    return figure


def _runs(diagnosis: Diagnosis) -> Figure:
    """Measured, old and new model, in the channels where the gap is largest."""
    base, fitted = diagnosis.stages["base"], diagnosis.stages["fitted"]
    shooter = base.bench.shooter
    places = []
    for entry in diagnosis.where:
        if (entry["trial"], entry["channel"]) not in places:
            places.append((entry["trial"], entry["channel"]))
    places = places[:4]
    figure = Figure(figsize=(9, 2.0 * max(len(places), 1)))
    axes = figure.subplots(max(len(places), 1), 1, squeeze=False)[:, 0]
    for ax, (trial, channel) in zip(axes, places, strict=False):
        k = shooter.channels.index(channel)
        for i, w in enumerate(shooter.windows):
            run = shooter.study.runs[w.run]
            if run.trial.name != trial:
                continue
            time = run.trial.time[w.rows]
            for track, colour, name in (
                (base.track, "#c63", "before"),
                (fitted.track if fitted else None, "#36c", "after"),
            ):
                if track is None:
                    continue
                miss = residual(shooter.measured(w), track.predicted[i], shooter.channels)[:, k]
                ax.plot(time, _smooth(miss), color=colour, lw=1.0, label=name if i == 0 else None)
            ax.axvline(w.first, color="#ddd", lw=0.6)
        noise = base.bench.noise[channel].total
        ax.axhspan(-noise, noise, color="#ccc", alpha=0.4, lw=0)
        ax.set_title(f"{trial}: measured minus simulated {channel}, smoothed", fontsize=9)
        ax.set_xlabel("time (s)")
    axes[0].plot([], [], color="#c63", label="before")
    axes[0].plot([], [], color="#36c", label="after")
    axes[0].legend(fontsize=8)
    figure.tight_layout()
    return figure


def _smooth(values: Any) -> Any:
    filled = np.where(np.isnan(values), np.nanmean(values), values)
    width = min(15, max(1, filled.size // 4))
    edge = np.pad(filled, width // 2, mode="edge")
    return np.convolve(edge, np.ones(width) / width, mode="valid")[: filled.size]


DECIDED = "These data decide; nothing is needed."
COLUMNS = (
    "name",
    "channel",
    "held_out_gain",
    "closure",
    "detectability",
    "p_value",
    "collinear",
)
WORDS = {
    "none": "The model explains these runs: nothing beyond the noise is left.",
    "named": "One explanation stands.",
    "ambiguous": "An effect is missing, and these runs cannot tell which of a few it is.",
    "unknown": "The model misses something that is not in the library.",
}


def page(diagnosis: Diagnosis, drawn: Mapping[str, bytes]) -> str:
    """The page as HTML; figures are inside."""
    found = diagnosis.to_dict()
    gap = found["gap"]
    parts = [
        "<!doctype html><html lang=en><meta charset=utf-8><title>Diagnosis</title>",
        f"<style>{STYLE}</style><h1>Diagnosis: {html.escape(found['verdict'])}</h1>",
        f"<p class=verdict>{WORDS[found['verdict']]}{_effects(found)}</p>",
        "<h2>1. Where model and measurement disagree</h2>",
        "<p>Each window of about 2 s starts from its own fitted state, so only forces show. Rms "
        f"of the whitened residual: <b>{gap['before']:.2f}</b> before, "
        f"<b>{gap['after']:.2f}</b> after, noise floor {gap['noise_floor']:.2f} "
        f"({html.escape(gap['scope'])}). The chance of such tests without any gap: "
        f"{gap['p_value']:.2g} before, {gap['p_value_after']:.2g} after.</p>",
        _image(drawn, "where"),
        _table(found["where"], ("trial", "channel", "window", "regime", "statistic")),
        "<h2>2. What force would close the gap, and what it goes with</h2>",
        _image(drawn, "force"),
        _table(found["drivers"], ("force", "goes_with", "sigmas")),
        "<h2>3. Which effects could make it</h2>",
        "<p>Every effect alone, fitted with what is only roughly known (mass, centre of mass, "
        "inertia, tire stiffness, sensor bias). Collinear: how much of it looks like the chosen "
        "one, 1 being alike.</p>",
        _image(drawn, "candidates"),
        _table(
            found["candidates"][:14],
            (
                "name",
                "channel",
                "held_out_gain",
                "closure",
                "detectability",
                "p_value",
                "collinear",
            ),
        ),
        "<h2>4. The corrected model beside the old one</h2>",
        _image(drawn, "runs"),
        "<h2>5. What to do next</h2>",
        f"<p>{html.escape(found['next_experiment'] or DECIDED)}</p>",
        "<h2>Notes</h2><ul>",
        *(f"<li>{html.escape(note)}</li>" for note in found["notes"]),
        "</ul></html>",
    ]
    return "\n".join(parts)


def _effects(found: Mapping[str, Any]) -> str:
    out = ""
    for e in found["effects"]:
        values = ", ".join(
            f"{k} {v['value']:.4g}"
            + (f" &plusmn; {v['std']:.2g}" if v["std"] is not None else " (held)")
            + f" {html.escape(v['unit'])}"
            for k, v in e["parameters"].items()
        )
        out += f" <b>{html.escape(e['name'])}</b>: {values}; closes {e['closure']:.0%}."
    for group in found["alternatives"]:
        out += " Cannot be told apart: " + html.escape(", ".join(group)) + "."
    return out


def _image(drawn: Mapping[str, bytes], name: str) -> str:
    data = base64.b64encode(drawn[name]).decode()
    return f'<img alt="{name}" src="data:image/png;base64,{data}">'


def _table(rows: list[dict[str, Any]], columns: tuple[str, ...]) -> str:
    head = "".join(f"<th>{c.replace('_', ' ')}</th>" for c in columns)
    body = "".join(
        "<tr>" + "".join(f"<td>{_cell(row.get(c, ''))}</td>" for c in columns) + "</tr>"
        for row in rows
    )
    return f"<table><tr>{head}</tr>{body}</table>"


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.3g}"
    if isinstance(value, dict):
        return html.escape(", ".join(f"{k} {v}" for k, v in value.items()))
    if isinstance(value, list):
        return " to ".join(f"{v:g}" for v in value) + " s"
    return html.escape(str(value))
