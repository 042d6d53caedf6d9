"""dm_control's physics of a chair, with the readings and the pictures that the tasks need.

In: a compiled model of a chair, and torques on its wheels. Out: positions, speeds and forces in
SI, whether the chair touches a wall or a post, and pictures.
"""

from __future__ import annotations

import math
from typing import Any

from mjchair.tasks import graphics  # isort: skip  # before dm_control is imported
import mujoco
import numpy as np
from dm_control import mujoco as control_mujoco
from dm_control.mujoco import engine, wrapper
from numpy.typing import NDArray

Array = NDArray[np.float64]

REAR = ("left_wheel", "right_wheel")
SMALL = 256  # pixels along the longer side, up to which a picture is not multisampled
SOLID = ("wall", "post")  # prefixes of the names of geoms that must not be touched


class Physics(control_mujoco.Physics):  # type: ignore[misc]
    """The readings of a chair, in SI.

    Readings of the tires are those at the beginning of the last time step (2 ms earlier); all
    others are those of the present state.
    """

    _contexts: Any  # dm_control's, for the user's own cameras
    _sized: dict[tuple[int, int], engine.Contexts] | None = None  # by height and width, pixels

    def render(self, height: int = 240, width: int = 320, *args: Any, **options: Any) -> Array:
        """A picture as dm_control's `render` gives it, with a quality that depends on its size.

        The buffer is as large as the picture, the shadow map has twice as many pixels along a
        side, and a picture of up to 256 pixels is not multisampled.

        Args:
          height, width: pixels. args, options: those of dm_control.

        Raises:
          NoGraphicsError: no OpenGL works on this machine.
        """
        before = self._contexts
        if self._sized is None:
            self._sized = {}
        if (height, width) not in self._sized:
            self._sized[height, width] = self._contexts_for(height, width)
        self._contexts = self._sized[height, width]
        try:
            return super().render(height, width, *args, **options)  # type: ignore[no-any-return]
        finally:
            self._contexts = before

    def _contexts_for(self, height: int, width: int) -> engine.Contexts:
        """Contexts of OpenGL and MuJoCo for pictures of one size; the model does not change."""
        size, quality = self.model.vis.global_, self.model.vis.quality
        before = size.offheight, size.offwidth, quality.shadowsize, quality.offsamples
        longest = max(height, width)
        size.offheight, size.offwidth = height, width
        quality.shadowsize = min(quality.shadowsize, max(512, 2 * longest))
        quality.offsamples = 0 if longest <= SMALL else quality.offsamples
        try:
            return self._new_contexts()
        finally:
            size.offheight, size.offwidth, quality.shadowsize, quality.offsamples = before

    def _new_contexts(self) -> engine.Contexts:
        size = self.model.vis.global_
        context = graphics.new_context(size.offwidth, size.offheight)
        return engine.Contexts(gl=context, mujoco=wrapper.MjrContext(self.model, context))

    def _make_rendering_contexts(self) -> None:
        """dm_control's contexts, for cameras that a user makes: the size is the model's."""
        self._contexts = self._new_contexts()

    def _reload_from_data(self, data: wrapper.MjData) -> None:
        self._free_sized()
        super()._reload_from_data(data)

    def free(self) -> None:
        """Free the model's data and everything that draws it."""
        self._free_sized()
        super().free()

    def _free_sized(self) -> None:
        for contexts in (self._sized or {}).values():
            contexts.mujoco.free()
            contexts.gl.free()
        self._sized = None

    def position(self) -> Array:
        """Position (2,) of the rear axle's middle: x, y in the world, m."""
        return np.array(self.named.data.site_xpos["axle"][:2])

    def heading(self) -> float:
        """Angle from the world's x axis to the chair's x axis about the world's z axis, rad."""
        turn = self.named.data.xmat["chair"]
        return math.atan2(turn[3], turn[0])

    def speed(self) -> float:
        """Speed of the rear axle's middle along the chair's x axis, m/s."""
        return float(self.named.data.sensordata["velocity"][0])

    def yaw_rate(self) -> float:
        """Yaw rate about the chair's z axis, rad/s."""
        return float(self.named.data.sensordata["imu_gyro"][2])

    def wheel_speeds(self) -> Array:
        """Angular speeds (2,) of the left and right rear wheel, rad/s."""
        return np.array([self.named.data.qvel[wheel][0] for wheel in REAR])

    def caster_angles(self) -> Array:
        """Swivel angles of both casters (4,): cosine left, right, then sine left, right."""
        angles = [self.named.data.qpos[f"{s}_caster_swivel"][0] for s in ("left", "right")]
        return np.concatenate([np.cos(angles), np.sin(angles)])

    def lateral_forces(self) -> Array:
        """Lateral tire forces Fy (2,) on the left and right rear wheel, positive to the left, N."""
        return np.array([self.named.data.sensordata[f"{wheel}_tire"][1] for wheel in REAR])

    def from_chair(self, point: Array) -> Array:
        """Position (2,), m, of a point of the floor in the chair frame, from the axle's middle.

        Args:
          point: (2,), x, y in the world, m.
        """
        c, s = math.cos(self.heading()), math.sin(self.heading())
        dx, dy = np.asarray(point) - self.position()
        return np.array([c * dx + s * dy, c * dy - s * dx])

    def touches(self) -> bool:
        """Whether a part of the chair touches a wall or a post."""
        for pair in self.data.contact.geom[: self.data.ncon]:
            for geom in pair:
                if self.model.id2name(int(geom), "geom").startswith(SOLID):
                    return True
        return False

    def place(self, qpos: Array, act: Array, x: float, y: float, heading: float) -> None:
        """Place the settled chair on a level floor, at rest.

        Args:
          qpos, act: of the settled chair, which stands at the origin with heading 0.
          x, y: where to place it, m. heading: its heading there, rad.
        """
        data = self.data
        data.qpos[:] = qpos
        data.act[:] = act
        data.qvel[:] = 0.0
        turn = np.array([math.cos(0.5 * heading), 0.0, 0.0, math.sin(0.5 * heading)])
        moved = np.zeros(4)
        mujoco.mju_mulQuat(moved, turn, qpos[3:7])
        data.qpos[3:7] = moved
        c, s = math.cos(heading), math.sin(heading)
        data.qpos[0] = x + c * qpos[0] - s * qpos[1]
        data.qpos[1] = y + s * qpos[0] + c * qpos[1]
