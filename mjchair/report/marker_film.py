"""A film of the rider with the markers that moved it.

In: a `Motion`. Out: an MP4 with the chair and its rider in the measured posture, and a ball at
every visible marker. The distance from a ball to the marker's place on the rider is its residual.
"""

from __future__ import annotations

import os
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.errors import MjchairError
from mjchair.motion.inverse_kinematics import Motion
from mjchair.report import gl
from mjchair.rider.anatomy import JOINTS
from mjchair.storage import atomic_file

Array = NDArray[np.float64]
Frame = NDArray[np.uint8]

BALL = 0.012  # m, radius of a marker
COLOUR = (0.84, 0.37, 0.0)
SIZE = (960, 540)
FPS = 15.0
VIEW = (1.9, 150.0, -12.0)  # m from the rider, azimuth and elevation, deg


class MarkerFilm:
    """Draws samples of a motion. Use it as a context manager: it holds an OpenGL context.

    Args:
      motion: what to draw. width, height: of a frame, pixels.

    Raises:
      MjchairError: as mjchair.report.gl does.
    """

    def __init__(self, motion: Motion, width: int = SIZE[0], height: int = SIZE[1]) -> None:
        """Take an OpenGL context."""
        self.motion, self.model = motion, motion.model
        self.model.vis.global_.offwidth, self.model.vis.global_.offheight = width, height
        self.data = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, self.data)
        self._joints = np.array([int(self.model.joint(j.name).qposadr[0]) for j in JOINTS])
        self._context = gl.context(width, height)
        self._scene = mujoco.MjvScene(self.model, 1000)
        self._options = mujoco.MjvOption()
        self._rect = mujoco.MjrRect(0, 0, width, height)
        self._drawing = mujoco.MjrContext(self.model, mujoco.mjtFontScale.mjFONTSCALE_100)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._drawing)
        self._camera = mujoco.MjvCamera()
        self._camera.distance, self._camera.azimuth, self._camera.elevation = VIEW
        chair = self.model.body("chair").id
        self._base, self._axes = (
            self.data.xpos[chair].copy(),
            self.data.xmat[chair].reshape(3, 3).copy(),
        )
        self._camera.lookat[:] = self._base + self._axes @ np.array([0.15, 0.0, 0.6])

    def __enter__(self) -> MarkerFilm:
        """Itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Give the context back."""
        self._context.make_current()
        self._drawing.free()
        self._context.free()

    def frame(self, sample: int) -> Frame:
        """The picture (height, width, 3) of a sample."""
        self.data.qpos[self._joints] = self.motion.qpos[sample]
        mujoco.mj_forward(self.model, self.data)
        mujoco.mjv_updateScene(
            self.model, self.data, self._options, None, self._camera,
            mujoco.mjtCatBit.mjCAT_ALL, self._scene,
        )  # fmt: skip
        for place in self.motion.placed[sample]:
            if np.isfinite(place[0]):
                self._ball(self._base + self._axes @ place)
        pixels = np.empty((self._rect.height, self._rect.width, 3), np.uint8)
        self._context.make_current()  # a task may have drawn since
        mujoco.mjr_render(self._rect, self._scene, self._drawing)
        mujoco.mjr_readPixels(pixels, None, self._rect, self._drawing)
        return np.flipud(pixels)

    def _ball(self, middle: Array) -> None:
        if self._scene.ngeom >= self._scene.maxgeom:
            return
        geom = self._scene.geoms[self._scene.ngeom]
        rgba = np.array([*COLOUR, 1.0], np.float32)
        kind = mujoco.mjtGeom.mjGEOM_SPHERE
        mujoco.mjv_initGeom(geom, kind, np.full(3, BALL), middle, np.eye(3).ravel(), rgba)
        self._scene.ngeom += 1


def write_marker_film(motion: Motion, path: str | os.PathLike[str]) -> None:
    """Film a motion as MP4 (H.264), whole or not at all.

    Raises:
      MjchairError: no OpenGL, another suffix, a folder that cannot be written.
    """
    import imageio_ffmpeg
    import mediapy

    if Path(path).suffix != ".mp4":
        raise MjchairError(f"{path}: a film is written as .mp4")
    mediapy.set_ffmpeg(imageio_ffmpeg.get_ffmpeg_exe())
    rate = 1.0 / float(np.median(np.diff(motion.time)))
    wanted = np.arange(0, motion.time.size, max(1, round(rate / FPS)))
    with (
        atomic_file(path) as temporary,
        MarkerFilm(motion) as film,
        mediapy.VideoWriter(temporary, (SIZE[1], SIZE[0]), fps=FPS, crf=23) as writer,
    ):
        for sample in wanted:
            writer.add_image(film.frame(int(sample)))
