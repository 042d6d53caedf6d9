"""The legend of a film: the scale of the arrows, and the grade of the floor.

In: the scale and the grade. Out: a picture with transparent background, drawn over each frame.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib
from PIL import Image, ImageDraw, ImageFont

from mjchair.report.colours import FORCES, rgb

BAR = 0.5  # m, of the white bar on the ground
INK, PAPER = (20, 20, 20), (232, 234, 238, 215)
NAMES = {"lateral": "lateral force", "longitudinal": "longitudinal force", "load": "load"}
WHITE = (1.0, 1.0, 1.0)
NARROW = 1.6  # width over height


@dataclass(frozen=True)
class Scale:
    """The force per metre of arrow; the same in every film, so that films can be compared.

    Attributes:
      horizontal: of lateral and longitudinal forces, N a metre. load: of loads, N a metre.
    """

    horizontal: float = 100.0
    load: float = 500.0

    def newtons(self, component: str) -> float:
        """N a metre for a component of mjchair.report.colours.FORCES."""
        return self.load if component == "load" else self.horizontal


def is_narrow(width: int, height: int) -> bool:
    """Whether a frame is so narrow that a legend at its upper left would hide the person's head."""
    return width < NARROW * height


def font(size: int) -> ImageFont.FreeTypeFont:
    """The font of frames, in pixels."""
    fonts = Path(matplotlib.get_data_path()) / "fonts" / "ttf"
    return ImageFont.truetype(str(fonts / "DejaVuSans.ttf"), size)


def legend(width: int, height: int, scale: Scale, tires: bool, grade: float) -> Image.Image:
    """The overlay (height, width) in pixels; along the bottom where the frame is narrow.

    Args:
      scale: of the arrows. tires: whether there are any. grade: of the floor, 0 is level.
    """
    image = Image.new("RGBA", (width, height))
    draw, line = ImageDraw.Draw(image), height // 21
    if tires:
        rows = [
            (f"{NAMES[c]}, {BAR * scale.newtons(c):g} N per bar", rgb(FORCES[c])) for c in NAMES
        ]
        rows.append((f"bar on the ground, {BAR:g} m", WHITE))
        if is_narrow(width, height):
            line = min(line, width // 28)
            _box(draw, rows, line, font(max(round(0.7 * line), 1)), 2, height)
        else:
            _box(draw, rows, line, font(height // 30))
    if grade:
        _slope(draw, width, line, grade, font(height // 30))
    return image


def _box(
    draw: ImageDraw.ImageDraw,
    rows: Sequence[tuple[str, tuple[float, float, float]]],
    line: int,
    letters: ImageFont.FreeTypeFont,
    columns: int = 1,
    bottom: int | None = None,
) -> None:
    """Draw rows with a colour and its meaning at the upper left, or above a bottom (pixels)."""
    many = math.ceil(len(rows) / columns)
    left = top = round(0.42 * line)
    if bottom is not None:
        top = bottom - top - round((many + 0.5) * line)
    wide = 1.9 * line + max(draw.textlength(text, letters) for text, _ in rows)
    box = (left, top, left + columns * wide, top + (many + 0.5) * line)
    draw.rounded_rectangle(box, radius=line // 4, fill=PAPER)
    for i, (text, colour) in enumerate(rows):
        x, y = left + (i // many) * wide, top + round((i % many + 0.25) * line)
        swatch = (x + 0.35 * line, y + 0.35 * line, x + 1.35 * line, y + 0.65 * line)
        draw.rectangle(swatch, fill=tuple(round(255 * c) for c in colour))
        draw.text((x + 1.6 * line, y), text, INK, letters)


def _slope(
    draw: ImageDraw.ImageDraw,
    width: int,
    line: int,
    grade: float,
    letters: ImageFont.FreeTypeFont,
) -> None:
    """Draw a triangle with the true slope of the floor, and its number, at the upper right."""
    text = f"floor {100 * grade:.3g} %, {math.degrees(math.atan(grade)):.2g}\N{DEGREE SIGN}"
    wide = draw.textlength(text, letters)
    run, top, margin = 3.0 * line, round(0.42 * line), round(0.35 * line)
    rise = min(run * grade, 3.0 * line)
    right = width - top
    left = right - wide - run - 3 * margin
    bottom = top + max(1.5 * line, rise + 2 * margin)
    draw.rounded_rectangle((left, top, right, bottom), radius=line // 4, fill=PAPER)
    foot = bottom - margin
    corners = [
        (left + margin, foot),
        (left + margin + run, foot),
        (left + margin + run, foot - rise),
    ]
    draw.polygon(corners, fill=(120, 118, 112))
    middle = 0.5 * (top + bottom)
    draw.text((right - margin, middle), text, INK, letters, anchor="rm")
