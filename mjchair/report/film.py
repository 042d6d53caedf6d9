"""Frames and films of a recording, with an arrow for every force of every tire.

In: a recording; nothing is simulated again. Out: pictures, as arrays, PNG or MP4. The arrows have
one scale in every film (mjchair.report.film_legend.Scale), so that films can be compared; an arrow
that would be longer than LONGEST is cut there, and the force is written at its tip.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw
from tqdm import tqdm

from mjchair.errors import MjchairError
from mjchair.report import gl
from mjchair.report.camera import camera_at, smooth_heading, stand_upright, view_named
from mjchair.report.colours import FORCES, rgb
from mjchair.report.film_legend import BAR, INK, WHITE, Scale, font, is_narrow, legend
from mjchair.report.forces import Array, WheelForces, wheel_forces
from mjchair.report.slope_scenery import Box, build_ramp, grade_of
from mjchair.simulation.floor import tire_geoms
from mjchair.simulation.recording import Recording, Status
from mjchair.storage import atomic_file

Frame = NDArray[np.uint8]

LONGEST = 1.0  # m, of an arrow
SHAFT = 0.017  # m, radius of an arrow
LEAST = 0.02  # m; shorter arrows are not drawn
OUTWARD = 0.10  # m, from the contact to where the arrows start, so that the wheel hides none
LIFT = 0.02  # m, above the ground
HALO = (240, 240, 240)  # about a number that stands in the picture
SMALLEST = 48  # pixels, of a side of a frame
DRAWN = 2.0  # MuJoCo draws an arrow half as long as the connector that it is given


def check_size(width: int, height: int) -> None:
    """Raise MjchairError unless a frame's width and height (pixels) can be drawn."""
    if not (SMALLEST <= width <= gl.LARGEST and SMALLEST <= height <= gl.LARGEST):
        raise MjchairError(
            f"size is {width}x{height} pixels; each side must be {SMALLEST} to {gl.LARGEST}"
        )


class DrawnArrow(NamedTuple):
    """An arrow of a film: component, start and end (3,) m in the world, size (N), whether cut."""

    component: str
    start: Array
    end: Array
    size: float
    cut: bool


class Film:
    """Draws samples of a recording. Use it as a context manager: it holds an OpenGL context.

    Args:
      recording: what to draw.
      width: of a frame, pixels. height: of a frame, pixels.
      view: one of mjchair.report.camera.VIEWS; the camera goes along with the chair.
      scale: of the arrows.

    Raises:
      MjchairError: an unknown view, a size out of SMALLEST to `gl.LARGEST`, or as mjchair.report.gl
        does.
    """

    def __init__(
        self,
        recording: Recording,
        width: int = 960,
        height: int = 540,
        view: str = "front",
        scale: Scale | None = None,
    ) -> None:
        """Load the recorded model and take an OpenGL context."""
        check_size(width, height)
        self.recording, self.view = recording, view_named(view)
        self.scale = scale or Scale()
        self.model = recording.model.load()
        self.model.vis.global_.offwidth, self.model.vis.global_.offheight = width, height
        _draw_faster(self.model)
        self._heading, self._down = smooth_heading(recording), recording.down()
        self.data = mujoco.MjData(self.model)
        self._pose(0)
        self._grade = grade_of(self.model, self.data)
        self._scenery = build_ramp(self.model, self.data, _path(recording)) if self._grade else []
        self._overlay = legend(width, height, self.scale, bool(recording.wheels), self._grade)
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
        self._context.make_current()
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
        self._stand_upright(sample, camera)
        for box in self._scenery:
            self._draw_box(box)
        wheels = self.wheel_forces(sample)
        arrows = [arrow for wheel in wheels for arrow in self.arrows(wheel)]
        for arrow in arrows:
            tip = arrow.start + DRAWN * (arrow.end - arrow.start)
            colour = rgb(FORCES[arrow.component])
            self._connect(mujoco.mjtGeom.mjGEOM_ARROW, arrow.start, tip, colour)
        if wheels:
            self._draw_bar(wheels[0])
        pixels = np.empty((self._rect.height, self._rect.width, 3), np.uint8)
        self._context.make_current()  # a task may have drawn since
        mujoco.mjr_render(self._rect, self._scene, self._drawing)
        mujoco.mjr_readPixels(pixels, None, self._rect, self._drawing)
        return self._write(pixels[::-1], sample, [arrow for arrow in arrows if arrow.cut])

    def wheel_forces(self, sample: int) -> list[WheelForces]:
        """The forces that are drawn at a sample."""
        self._pose(sample)
        return wheel_forces(self.model, self.data, self.recording, sample)

    def arrows(self, wheel: WheelForces) -> Iterator[DrawnArrow]:
        """Every arrow of a wheel that is long enough."""
        outward = wheel.left if self._is_left(wheel) else -wheel.left
        start = wheel.contact + OUTWARD * outward + np.array([0.0, 0.0, LIFT])
        for component, force in wheel.forces.items():
            arrow = force / self.scale.newtons(component)
            length = float(np.linalg.norm(arrow))
            if length >= LEAST:
                shown = arrow * min(1.0, LONGEST / length)
                size = float(np.linalg.norm(force))
                yield DrawnArrow(component, start, start + shown, size, length > LONGEST)

    def pixel(self, point: Array, sample: int) -> tuple[int, int]:
        """Column and row at which a point (3,) m, world, appears in the frame of a sample."""
        self._pose(sample)
        self._scene.ngeom = 0
        camera = self._camera(sample)
        mujoco.mjv_updateCamera(self.model, self.data, camera, self._scene)
        self._stand_upright(sample, camera)
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
        heading = float(self._heading[sample])
        return camera_at(self.view, heading, self._middle(), bool(self._grade))

    def _stand_upright(self, sample: int, camera: mujoco.MjvCamera) -> None:
        """Turn the scene's cameras, one for each eye, where gravity leans."""
        down = self._down[sample]
        if down[2] > -1.0 + 1e-9:
            for eye in self._scene.camera:
                stand_upright(eye, down, np.array(camera.lookat))

    def _middle(self) -> Array:
        """Middle of the wheels (3,), m, world."""
        centres = [self.data.geom_xpos[i] for i in tire_geoms(self.model).values()]
        return np.mean(centres, axis=0) if centres else np.zeros(3)

    def _is_left(self, wheel: WheelForces) -> bool:
        return bool((wheel.contact - self._middle()) @ wheel.left > 0.0)

    def _draw_box(self, box: Box) -> None:
        kind = mujoco.mjtGeom.mjGEOM_BOX
        geom = self._new_geom(kind, box.colour, box.half, box.middle, box.axes)
        if geom is not None:
            geom.specular = geom.shininess = 0.0

    def _draw_bar(self, wheel: WheelForces) -> None:
        """A bar of known length on the ground, outside the wheel, along its heading."""
        forward = np.cross(wheel.left, wheel.forces["load"])
        forward /= max(float(np.linalg.norm(forward)), 1e-9)
        start = wheel.contact + 0.35 * wheel.left
        kind = mujoco.mjtGeom.mjGEOM_CAPSULE
        self._connect(kind, start, start + BAR * forward, WHITE)

    def _connect(
        self, kind: mujoco.mjtGeom, start: Array, end: Array, colour: tuple[float, float, float]
    ) -> None:
        geom = self._new_geom(kind, colour, np.zeros(3), np.zeros(3), np.eye(3))
        if geom is not None:
            mujoco.mjv_connector(geom, kind, SHAFT, start, end)
            geom.emission, geom.specular, geom.shininess = 0.1, 0.0, 0.0  # as in the legend

    def _new_geom(
        self,
        kind: mujoco.mjtGeom,
        colour: tuple[float, float, float],
        half: Array,
        middle: Array,
        axes: Array,
    ) -> mujoco.MjvGeom | None:
        """One more geom of the scene, or None where the scene is full."""
        if self._scene.ngeom >= self._scene.maxgeom:
            return None
        geom = self._scene.geoms[self._scene.ngeom]
        rgba = np.array([*colour, 1.0], np.float32)
        mujoco.mjv_initGeom(geom, kind, half, middle, axes.ravel(), rgba)
        geom.category = mujoco.mjtCatBit.mjCAT_DECOR
        self._scene.ngeom += 1
        return geom

    def _write(self, pixels: Frame, sample: int, cut: list[DrawnArrow]) -> Frame:
        """The frame with its legend, the time, and the size of every force whose arrow is cut."""
        image = Image.fromarray(pixels)
        image.paste(self._overlay, (0, 0), self._overlay)
        height = image.size[1]
        draw, letters = ImageDraw.Draw(image), font(height // 32)
        written: list[tuple[float, float, float, float]] = []
        for arrow in cut:
            colour = tuple(round(200 * c) for c in rgb(FORCES[arrow.component]))
            place = self.pixel(arrow.end + 0.08 * (arrow.end - arrow.start), sample)
            text = f"{arrow.size:.0f} N"
            box = draw.textbbox(place, text, letters, "mm", stroke_width=2)
            if not any(_overlap(box, other) for other in written):
                draw.text(place, text, colour, letters, "mm", stroke_width=2, stroke_fill=HALO)
                written.append(box)
        text = f"t = {self.recording.time[sample]:.2f} s"
        last = sample == self.recording.time.size - 1
        if last and self.recording.status is not Status.COMPLETED:
            text += f"  {self.recording.status.value}: {self.recording.reason}"
        # where the legend is not
        place = (round(0.02 * height), round((0.02 if is_narrow(*image.size) else 0.94) * height))
        draw.text(place, text, INK, font(height // 27))
        return np.asarray(image)


def _overlap(
    first: tuple[float, float, float, float], second: tuple[float, float, float, float]
) -> bool:
    """Whether two boxes (left, top, right, bottom) share a part."""
    return (
        first[0] < second[2]
        and second[0] < first[2]
        and first[1] < second[3]
        and second[1] < first[3]
    )


def _path(recording: Recording) -> Array:
    """Places of the chair (n, 3), m, world; the floor's origin where they were not recorded."""
    try:
        return recording.vector("position")
    except MjchairError:
        return np.zeros((1, 3))


def _draw_faster(model: mujoco.MjModel) -> None:
    """Fewer facets and a smaller shadow map: software OpenGL takes two thirds of the time."""
    quality = model.vis.quality
    quality.numslices, quality.numstacks = min(quality.numslices, 14), min(quality.numstacks, 8)
    quality.shadowsize = min(quality.shadowsize, 2048)
    # a map of the chair's surroundings only: the floor at the rim of a wide one is speckled
    model.vis.map.shadowscale = min(model.vis.map.shadowscale, 0.3)


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
      width: pixels, even. height: pixels, even. view: one of mjchair.report.camera.VIEWS.
      progress: show a bar where standard error is a terminal.

    Raises:
      MjchairError: bad numbers, no OpenGL, another suffix, a folder that cannot be written.
    """
    import imageio_ffmpeg
    import mediapy

    if Path(path).suffix != ".mp4":
        raise MjchairError(f"{path}: a film is written as .mp4")
    check_size(width, height)
    if width % 2 or height % 2:
        raise MjchairError(f"a frame of {width} x {height} pixels; H.264 needs even numbers")
    mediapy.set_ffmpeg(imageio_ffmpeg.get_ffmpeg_exe())
    wanted = samples_at(recording, fps, speed)
    with (
        atomic_file(path) as temporary,
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
    with atomic_file(path) as temporary:
        Image.fromarray(pixels).save(temporary)
