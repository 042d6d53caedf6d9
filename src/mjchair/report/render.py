"""Frames and films of a recording, with an arrow for every force of every tire."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib
import mujoco
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont
from tqdm import tqdm

from mjchair.errors import MjchairError, nearest
from mjchair.report import gl
from mjchair.report.forces import COLOURS, Array, WheelForces, peak, round_up, wheel_forces
from mjchair.simulation.initial import tire_geoms
from mjchair.simulation.recording import Recording, Status
from mjchair.storage import whole

Frame = NDArray[np.uint8]

LONGEST = 0.6  # m, of the arrow of a force that 99 % of the samples stay below
SHAFT = 0.017  # m, radius of an arrow
LEAST = 0.02  # m; shorter arrows are not drawn
OUTWARD = 0.10  # m, from the contact to where the arrows start, so that the wheel hides none
LIFT = 0.02  # m, above the ground
BAR = 0.5  # m, of the white bar on the ground
DRAWN = 2.0  # MuJoCo draws an arrow half as long as the connector that it is given
# camera of each view: azimuth (deg, from the chair's heading), elevation (deg), distance (m)
VIEWS = {
    "front": (145.0, -27.0, 2.8),
    "behind": (35.0, -27.0, 2.8),
    "side": (90.0, -8.0, 2.9),
    "top": (90.0, -89.0, 3.6),
}
TURN_TIME = 2.0  # s, over which the camera averages the heading


@dataclass(frozen=True)
class Scale:
    """Newtons that one metre of arrow stands for."""

    horizontal: float
    load: float

    @staticmethod
    def of(recording: Recording) -> Scale:
        """Scales that keep the recording's forces in sight; horizontal ones share one."""
        size = max(peak(recording, "lateral"), peak(recording, "longitudinal"), 1e-3)
        load = max(peak(recording, "load"), 1e-3)
        return Scale(round_up(size / LONGEST), round_up(load / LONGEST))

    def newtons(self, component: str) -> float:
        """N a metre for a component of mjchair.report.forces.COLOURS."""
        return self.load if component == "load" else self.horizontal


class Film:
    """Draws samples of a recording. Use it as a context manager: it holds an OpenGL context.

    Args:
      recording: what to draw.
      width, height: of a frame, pixels.
      view: one of VIEWS; the camera goes along with the chair.

    Raises:
      MjchairError: an unknown view, or as mjchair.report.gl does.
    """

    def __init__(
        self, recording: Recording, width: int = 960, height: int = 540, view: str = "front"
    ) -> None:
        """Load the recorded model and take an OpenGL context."""
        if view not in VIEWS:
            raise MjchairError(f"unknown view {view!r}" + nearest(view, VIEWS))
        self.recording, self.view = recording, view
        self.scale = Scale.of(recording)
        self.model = recording.model.load()
        self.model.vis.global_.offwidth, self.model.vis.global_.offheight = width, height
        _draw_faster(self.model)
        self._heading = _smooth_heading(recording)
        self.data = mujoco.MjData(self.model)
        self._overlay = _overlay(width, height, self.scale, bool(recording.wheels))
        self._context: Any = gl.context(width, height)
        self._scene = mujoco.MjvScene(self.model, 2000)
        self._options = mujoco.MjvOption()
        self._rect = mujoco.MjrRect(0, 0, width, height)
        self._drawing = mujoco.MjrContext(self.model, mujoco.mjtFontScale.mjFONTSCALE_100)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._drawing)

    def __enter__(self) -> Film:
        """The film itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Free the OpenGL context."""
        self._drawing.free()
        self._context.free()

    def frame(self, sample: int) -> Frame:
        """The picture (height, width, 3) of a sample, 8 bit RGB."""
        self._pose(sample)
        camera = self._camera(sample)
        mujoco.mjv_updateScene(
            self.model,
            self.data,
            self._options,
            None,
            camera,
            mujoco.mjtCatBit.mjCAT_ALL,
            self._scene,
        )
        wheels = self.wheel_forces(sample)
        for wheel in wheels:
            self._draw(wheel)
        if wheels:
            self._draw_bar(wheels[0])
        pixels = np.empty((self._rect.height, self._rect.width, 3), np.uint8)
        mujoco.mjr_render(self._rect, self._scene, self._drawing)
        mujoco.mjr_readPixels(pixels, None, self._rect, self._drawing)
        return self._label(pixels[::-1], sample)

    def wheel_forces(self, sample: int) -> list[WheelForces]:
        """The forces that are drawn at a sample."""
        self._pose(sample)
        return wheel_forces(self.model, self.data, self.recording, sample)

    def arrows(self, wheel: WheelForces) -> Iterator[tuple[str, Array, Array]]:
        """Component, start and end (3,) m, world, of every arrow of a wheel that is long enough."""
        outward = wheel.left if self._is_left(wheel) else -wheel.left
        start = wheel.contact + OUTWARD * outward + np.array([0.0, 0.0, LIFT])
        for component, force in wheel.forces.items():
            arrow = force / self.scale.newtons(component)
            if np.linalg.norm(arrow) >= LEAST:
                yield component, start, start + arrow

    def pixel(self, point: Array, sample: int) -> tuple[int, int]:
        """Column and row at which a point (3,) m, world, appears in the frame of a sample."""
        self._pose(sample)
        self._scene.ngeom = 0
        camera = self._camera(sample)
        mujoco.mjv_updateCamera(self.model, self.data, camera, self._scene)
        eye = mujoco.mjv_averageCamera(self._scene.camera[0], self._scene.camera[1])
        forward, up = np.asarray(eye.forward, float), np.asarray(eye.up, float)
        seen = np.asarray(point, float) - np.asarray(eye.pos, float)
        depth = seen @ forward
        unit = self._rect.height * eye.frustum_near / (2.0 * eye.frustum_top)
        column = self._rect.width / 2 + unit * (seen @ np.cross(forward, up)) / depth
        row = self._rect.height / 2 - unit * (seen @ up) / depth
        return round(float(column)), round(float(row))

    def _pose(self, sample: int) -> None:
        self.data.qpos[:] = self.recording.qpos[sample]
        self.data.time = self.recording.time[sample]
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)
        mujoco.mj_camlight(self.model, self.data)

    def _camera(self, sample: int) -> mujoco.MjvCamera:
        camera = mujoco.MjvCamera()
        azimuth, camera.elevation, camera.distance = VIEWS[self.view]
        camera.azimuth = azimuth + float(np.rad2deg(self._heading[sample]))
        centres = [self.data.geom_xpos[i] for i in tire_geoms(self.model).values()]
        middle = np.mean(centres, axis=0) if centres else np.zeros(3)
        camera.lookat = middle + np.array([0.0, 0.0, 0.4])
        return camera

    def _is_left(self, wheel: WheelForces) -> bool:
        centres = [self.data.geom_xpos[i] for i in tire_geoms(self.model).values()]
        return bool((wheel.contact - np.mean(centres, axis=0)) @ wheel.left > 0.0)

    def _draw(self, wheel: WheelForces) -> None:
        for component, start, end in self.arrows(wheel):
            tip = start + DRAWN * (end - start)
            self._connect(mujoco.mjtGeom.mjGEOM_ARROW, start, tip, COLOURS[component])

    def _draw_bar(self, wheel: WheelForces) -> None:
        """A bar of known length on the ground, outside the wheel, along its heading."""
        forward = np.cross(wheel.left, wheel.forces["load"])
        forward /= max(float(np.linalg.norm(forward)), 1e-9)
        start = wheel.contact + 0.35 * wheel.left
        kind = mujoco.mjtGeom.mjGEOM_CAPSULE
        self._connect(kind, start, start + BAR * forward, (1.0, 1.0, 1.0))

    def _connect(
        self, kind: mujoco.mjtGeom, start: Array, end: Array, colour: tuple[float, float, float]
    ) -> None:
        if self._scene.ngeom >= self._scene.maxgeom:
            return
        geom = self._scene.geoms[self._scene.ngeom]
        rgba, nothing = np.array([*colour, 1.0], np.float32), np.zeros(3)
        mujoco.mjv_initGeom(geom, kind, nothing, nothing, np.eye(3).ravel(), rgba)
        mujoco.mjv_connector(geom, kind, SHAFT, start, end)
        geom.emission = 0.4
        geom.category = mujoco.mjtCatBit.mjCAT_DECOR
        self._scene.ngeom += 1

    def _label(self, pixels: Frame, sample: int) -> Frame:
        image = Image.fromarray(pixels)
        image.paste(self._overlay, (0, 0), self._overlay)
        text = f"t = {self.recording.time[sample]:.2f} s"
        last = sample == self.recording.time.size - 1
        if last and self.recording.status is not Status.COMPLETED:
            text += f"  {self.recording.status.value}: {self.recording.reason}"
        height = image.size[1]
        place = (round(0.02 * height), round(0.94 * height))
        ImageDraw.Draw(image).text(place, text, (20, 20, 20), _font(height // 27))
        return np.asarray(image)


def _draw_faster(model: mujoco.MjModel) -> None:
    """Fewer facets and a smaller shadow map: software OpenGL takes two thirds of the time."""
    quality = model.vis.quality
    quality.numslices, quality.numstacks = min(quality.numslices, 14), min(quality.numstacks, 8)
    quality.shadowsize = min(quality.shadowsize, 2048)


def _smooth_heading(recording: Recording) -> Array:
    """Heading (n,), rad, averaged over TURN_TIME, for the camera; 0 where it was not recorded."""
    try:
        heading = np.unwrap(recording["heading"])
    except MjchairError:
        return np.zeros(recording.time.size)
    span = np.ptp(recording.time)
    share = TURN_TIME / span if span > 0.0 else 1.0
    width = 2 * max(1, round(0.5 * min(share, 1.0) * heading.size)) - 1
    padded = np.pad(heading, width // 2, mode="edge")
    return np.convolve(padded, np.full(width, 1.0 / width), mode="valid")


def _font(size: int) -> ImageFont.FreeTypeFont:
    fonts = Path(matplotlib.get_data_path()) / "fonts" / "ttf"
    return ImageFont.truetype(str(fonts / "DejaVuSans.ttf"), size)


def _overlay(width: int, height: int, scale: Scale, tires: bool) -> Image.Image:
    """The legend: a colour, a name and a scale for each component."""
    image = Image.new("RGBA", (width, height))
    if not tires:
        return image
    draw, font, line = ImageDraw.Draw(image), _font(height // 30), height // 21
    left, top = round(0.02 * height), round(0.02 * height)
    names = {"lateral": "lateral force", "longitudinal": "longitudinal force", "load": "load"}
    rows = [(f"{names[c]}, {BAR * scale.newtons(c):g} N per bar", COLOURS[c]) for c in COLOURS]
    rows.append((f"bar on the ground, {BAR:g} m", (1.0, 1.0, 1.0)))
    wide = max(draw.textlength(text, font) for text, _ in rows)
    box = (left, top, left + 1.9 * line + wide, top + len(rows) * line + 0.5 * line)
    draw.rounded_rectangle(box, radius=line // 4, fill=(232, 234, 238, 215))
    for i, (text, colour) in enumerate(rows):
        y = top + round((i + 0.25) * line)
        swatch = (left + 0.35 * line, y + 0.35 * line, left + 1.35 * line, y + 0.65 * line)
        draw.rectangle(swatch, fill=tuple(round(255 * c) for c in colour))
        draw.text((left + 1.6 * line, y), text, (20, 20, 20), font)
    return image


def samples_at(recording: Recording, fps: float, speed: float = 1.0) -> list[int]:
    """The samples nearest to the times of a film's frames.

    Args:
      recording: what is filmed. fps: frames a second, Hz. speed: of the film, 1 is real time.

    Raises:
      MjchairError: a rate or a speed that is not positive.
    """
    if not (fps > 0.0 and speed > 0.0):
        raise MjchairError(f"fps is {fps:g} and speed {speed:g}; both must be positive")
    time = recording.time
    count = int((time[-1] - time[0]) * fps / speed) + 1
    at = time[0] + np.arange(count) * speed / fps
    return [int(i) for i in np.clip(np.searchsorted(time, at - 1e-9), 0, time.size - 1)]


def write_film(
    recording: Recording,
    path: str | os.PathLike[str],
    *,
    fps: float = 25.0,
    speed: float = 1.0,
    width: int = 960,
    height: int = 540,
    view: str = "front",
    progress: bool = False,
) -> None:
    """Film a recording as MP4 (H.264), whole or not at all.

    Args:
      recording: what to film; nothing is simulated again.
      path: ends in .mp4.
      fps: frames a second, Hz. speed: 1 is real time, 0.5 half as fast.
      width, height: pixels, even. view: one of VIEWS.
      progress: show a bar where standard error is a terminal.

    Raises:
      MjchairError: bad numbers, no OpenGL, another suffix, a folder that cannot be written.
    """
    import imageio_ffmpeg
    import mediapy

    if Path(path).suffix != ".mp4":
        raise MjchairError(f"{path}: a film is written as .mp4")
    if width <= 0 or height <= 0 or width % 2 or height % 2:
        raise MjchairError(f"a frame of {width} x {height} pixels; H.264 needs even numbers")
    mediapy.set_ffmpeg(imageio_ffmpeg.get_ffmpeg_exe())
    wanted = samples_at(recording, fps, speed)
    with (
        whole(path) as temporary,
        Film(recording, width, height, view) as film,
        mediapy.VideoWriter(temporary, (height, width), fps=fps, crf=23) as writer,
    ):
        for sample in tqdm(wanted, unit="frame", disable=None if progress else True):
            writer.add_image(film.frame(sample))


def write_frame(
    recording: Recording,
    path: str | os.PathLike[str],
    time: float,
    *,
    width: int = 1280,
    height: int = 720,
    view: str = "front",
) -> None:
    """Draw the sample nearest to `time` (s) as PNG; the rest as write_film."""
    if Path(path).suffix != ".png":
        raise MjchairError(f"{path}: a frame is written as .png")
    sample = int(np.argmin(np.abs(recording.time - time)))
    with Film(recording, width, height, view) as film:
        pixels = film.frame(sample)
    with whole(path) as temporary:
        Image.fromarray(pixels).save(temporary)
