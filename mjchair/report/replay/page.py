"""The page of a replay: one HTML file that opens from disk and asks no network for anything.

In: a recording, and ghosts: other recordings, or measured runs. Out: a Replay, which is saved as a
page, or put into a notebook or a report as a frame. Everything that the page needs is inside it:
the drawing library three.js, whose licence stands in `viewer/`, the shapes, the motion, the
signals, and a still picture for a browser that draws nothing in three dimensions.
"""

from __future__ import annotations

import base64
import functools
import html
import io
import json
import math
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from mjchair.errors import MjchairError
from mjchair.measurement.trial import Trial
from mjchair.report import colours
from mjchair.report.camera import VIEWS
from mjchair.report.film import LONGEST, Film
from mjchair.report.film_legend import Scale
from mjchair.report.forces import COMPONENTS
from mjchair.report.gl import NoGraphicsError
from mjchair.report.replay.measured import measured_track
from mjchair.report.replay.packing import pack, packed
from mjchair.report.replay.shapes import Shapes, shapes
from mjchair.report.replay.track import MOST, Track, force_channels, track
from mjchair.simulation.recording import Recording
from mjchair.storage import write_whole

VIEWER = Path(__file__).parent / "viewer"
SPEEDS = (0.1, 0.25, 0.5, 1, 2, 4, 8)
STILL = (960, 540)  # pixels
QUALITY = 80  # of the still picture, JPEG
GHOSTS = (colours.BEFORE, colours.MEASURED, "#009e73", "#cc79a7")
BODY = colours.AFTER
FIRST_SHOWN = 3  # diagrams that are open at first
NO_FORCE = "no tire has a force in this run, so there are no arrows"
HEIGHT = 840  # pixels, of a frame in a notebook or a report

Shown = Recording | Trial


@dataclass(frozen=True)
class Replay:
    """A page that shows runs in three dimensions.

    Attributes:
      html: the whole page. notes: what a viewer should know, such as that the run is thinned.
    """

    html: str
    notes: tuple[str, ...] = ()

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the page, whole.

        Raises:
          MjchairError: another suffix, or a folder that cannot be written.
        """
        if Path(path).suffix.lower() not in (".html", ".htm"):
            raise MjchairError(f"{path}: a replay is written as .html")
        write_whole(path, self.html)

    def frame(self, height: int = HEIGHT) -> str:
        """HTML that shows the page inside another one; `height` in pixels."""
        # the page around it holds this one as text: no tag and no address of its own
        text = html.escape(self.html).replace("=", "&#61;").replace("://", ":&#47;/")
        return (
            f'<iframe class="replay" title="Replay" srcdoc="{text}" '
            f'style="width:100%;box-sizing:border-box;height:{height}px;border:1px solid #ccc">'
            "</iframe>"
        )

    def _repr_html_(self) -> str:
        """The page inside a notebook."""
        return self.frame()


def replay(
    recording: Recording,
    ghosts: Mapping[str, Shown] | None = None,
    *,
    title: str = "",
    label: str = "simulated",
    most: int = MOST,
) -> Replay:
    """A replay of a recording.

    Args:
      recording: what is drawn in its own colours, with its tires' forces.
      ghosts: name -> what is drawn as a ghost in the same scene. A measured run is laid on the
        first place and heading of the recording; see mjchair.report.replay.measured.
      title: of the page. label: what the recording is called beside its ghosts.
      most: samples of a run that are kept, at least 2; a longer run is thinned evenly, and the
        page says so.

    Raises:
      MjchairError: a recorded model that this MuJoCo cannot read, a measured run whose motion
        cannot be told from its channels, or fewer than 2 samples to keep.
    """
    if most < 2:
        raise MjchairError(f"a replay of {most} samples; it needs at least 2")
    given = dict(ghosts or {})
    tracks = [track(recording, label, most)]
    for name, other in given.items():
        if isinstance(other, Recording):
            tracks.append(track(other, name, most))
        else:
            tracks.append(measured_track(recording, other, name))
    sources = [recording, *(o if isinstance(o, Recording) else recording for o in given.values())]
    models, numbers = _models(sources, tracks)
    arrays: dict[str, NDArray[Any]] = {}
    for m, model in enumerate(models):
        for s, surface in enumerate(model.surfaces):
            arrays |= surface.arrays(f"model{m}.surface{s}")
    for t, one in enumerate(tracks):
        arrays |= one.arrays(f"track{t}")
    shown = np.searchsorted(recording.time, tracks[0].time)
    arrays["down"] = recording.down()[shown].astype(np.float32)
    blocks, text = pack(arrays)
    header = {
        "models": [_model(model) for model in models],
        "tracks": [
            _track(one, model, _colour_of(t))
            for t, (one, model) in enumerate(zip(tracks, numbers, strict=True))
        ],
        "forces": _forces(),
        "longest": LONGEST,
        "view": _view(recording),
        "panels": panels(tracks[0]),
        "blocks": blocks,
    }
    notes = tuple(_notes(tracks))
    page = _template().render(
        title=title or f"Replay: {recording.describe()}",
        style=_text("replay.css"),
        still=still(recording),
        speeds=SPEEDS,
        notes=notes,
        header=json.dumps(header, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c"),
        numbers=text,
        three=_three(),
        viewer=_text("viewer.js"),
    )
    return Replay(page, notes)


@functools.cache
def _text(name: str) -> str:
    return (VIEWER / name).read_text(encoding="utf-8")


@functools.cache
def _three() -> str:
    return packed(_text("three.min.js").encode())


@functools.cache
def _template() -> jinja2.Template:
    """Everything that is put into the page is escaped, unless the template says otherwise."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(VIEWER),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
    )
    return environment.get_template("replay.html")


def _models(
    recordings: Sequence[Recording], tracks: Sequence[Track]
) -> tuple[list[Shapes], list[int]]:
    """What the chairs look like, and the number of that of each track; equal ones once."""
    places: dict[bytes, int] = {}
    found: list[Shapes] = []
    numbers = []
    for recording, one in zip(recordings, tracks, strict=True):
        content = recording.model.content
        if content not in places:
            places[content] = len(found)
            found.append(shapes(recording.model.load(), one.path))
        numbers.append(places[content])
    return found, numbers


def _model(model: Shapes) -> dict[str, Any]:
    return {
        "bodies": model.bodies,
        "solids": [vars(solid) for solid in model.solids],
        "surfaces": [{"body": s.body, "colour": s.colour} for s in model.surfaces],
    }


def _colour_of(number: int) -> str:
    """The colour of a track: 0 is the body, others are ghosts."""
    return GHOSTS[(number - 1) % len(GHOSTS)] if number else BODY


def _track(one: Track, model: int, colour: str) -> dict[str, Any]:
    wheels = {wheel: force_channels(wheel) for wheel in one.contacts if _carry(one)}
    return {
        "label": one.label,
        "model": model,
        "colour": colour,
        "contacts": wheels,
        "signals": list(one.signals),
        "status": one.status,
    }


def _forces() -> dict[str, dict[str, Any]]:
    """Colour and scale (N a metre of arrow) of every component, as in films."""
    return {
        component: {"colour": colours.FORCES[component], "scale": Scale().newtons(component)}
        for component in COMPONENTS
    }


def _view(recording: Recording) -> dict[str, float]:
    """Where the camera stands at first: as in films, seen from the chair at its start."""
    view = VIEWS["front"]
    heading = float(recording["heading"][0]) if "heading" in recording else 0.0
    # MuJoCo's azimuth is where the camera looks to, this one where it stands
    azimuth = math.radians(view.azimuth + 180.0) + (heading if math.isfinite(heading) else 0.0)
    return {
        "azimuth": azimuth,
        "elevation": math.radians(-view.elevation),
        "distance": 1.15 * view.distance,
    }


def panels(one: Track) -> list[dict[str, Any]]:
    """The diagrams: signals that belong together, by name, with the colours of their lines."""
    groups: dict[tuple[str, str], list[str]] = {}
    for name in one.signals:
        groups.setdefault((_family(name), one.units.get(name, "")), []).append(name)
    leading = [*(f for f, _ in groups if f.endswith(("wheel", "joystick"))), "wheel speed"]
    leading += ["tire lateral force", "velocity"]
    moving = {f for (f, _), names in groups.items() if any(one.signals[n].any() for n in names)}
    shown = [family for family in dict.fromkeys(leading) if family in moving]
    order = sorted(groups, key=lambda g: shown.index(g[0]) if g[0] in shown else len(shown))
    return [
        {
            "title": _title(family, groups[family, unit], one),
            "unit": unit,
            "signals": groups[family, unit],
            "labels": [_label(name, len(groups[family, unit])) for name in groups[family, unit]],
            "colours": [_colour(name, i) for i, name in enumerate(groups[family, unit])],
            "shown": family in shown[:FIRST_SHOWN],
        }
        for family, unit in order
    ]


def _family(name: str) -> str:
    """What a signal shares with those beside it: no side, no axis, tires by their force."""
    stem, _, axis = name.rpartition(".")
    if stem.endswith("_tire"):
        names = {
            axis: f"tire {c} force".replace("load force", "load") for c, axis in COMPONENTS.items()
        }
        return names.get(axis, f"tire {axis}")
    return re.sub(r"(left|right)_", "", stem or name).replace("_", " ")


def _title(family: str, names: Sequence[str], one: Track) -> str:
    """The family; what drives the chair is named as such."""
    return f"input: {family}" if set(names) <= set(one.inputs) else family


def _label(name: str, beside: int) -> str:
    """What tells a signal from the others of its diagram."""
    if beside == 1:
        return ""
    stem, _, axis = name.rpartition(".")
    if stem.endswith("_tire"):
        return stem.removesuffix("_tire").replace("_", " ")
    side = re.search(r"left|right", name)
    return axis if stem else side[0] if side else name.replace("_", " ")


def _colour(name: str, index: int) -> str:
    for side, colour in colours.SIDES.items():
        if name.startswith(side):
            return colour
    return colours.SERIES[index % len(colours.SERIES)]


def _carry(one: Track) -> bool:
    """Whether a tire has a force at any time; a chair may also be held by MuJoCo's own contacts."""
    channels = [channel for wheel in one.contacts for channel in force_channels(wheel).values()]
    return any(one.signals[name].any() for name in channels if name in one.signals)


def _notes(tracks: Sequence[Track]) -> list[str]:
    """What is to be said of the runs in the page."""
    notes = []
    for one in tracks:
        name = f"{one.label}: " if len(tracks) > 1 else ""
        notes.append(f"{name}{one.status}")
        if one.contacts and not _carry(one):
            notes.append(f"{name}{NO_FORCE}")
        if one.rate is not None:
            notes.append(
                f"{name}thinned: {one.rate:.3g} samples a second are shown of those recorded; what "
                "happens between them is drawn as an even motion, and fast wheels may seem to turn "
                "backwards."
            )
    return notes


def still(recording: Recording) -> str:
    """A picture of the middle of a run, as a data address; of its path where nothing draws."""
    sample = recording.time.size // 2
    out = io.BytesIO()
    try:
        with Film(recording, *STILL) as film:
            Image.fromarray(np.ascontiguousarray(film.frame(sample))).save(
                out, "JPEG", quality=QUALITY
            )
    except NoGraphicsError:
        from mjchair.report.trajectory import trajectory

        trajectory(recording).savefig(out, format="jpeg", dpi=100)
    return f"data:image/jpeg;base64,{base64.b64encode(out.getvalue()).decode()}"
