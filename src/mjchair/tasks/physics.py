"""What the tasks see of a chair, through dm_control."""

from __future__ import annotations

import math

import mujoco
import numpy as np
from dm_control import mujoco as control_mujoco
from numpy.typing import NDArray

Array = NDArray[np.float64]

REAR = ("left_wheel", "right_wheel")
SOLID = ("wall", "post")  # what must not be touched: geoms whose names begin so


class Physics(control_mujoco.Physics):  # type: ignore[misc]
    """A chair's readings, in SI.

    The tires' own readings are of the last substep (2 ms), the others of now.
    """

    def position(self) -> Array:
        """(2,) x, y of the rear axle's middle, world, m."""
        return np.array(self.named.data.site_xpos["axle"][:2])

    def heading(self) -> float:
        """From the world's x to the chair's x about the world's z, rad."""
        turn = self.named.data.xmat["chair"]
        return math.atan2(turn[3], turn[0])

    def speed(self) -> float:
        """Of the rear axle's middle along the chair's x, m/s."""
        return float(self.named.data.sensordata["velocity"][0])

    def yaw_rate(self) -> float:
        """About the chair's z, rad/s."""
        return float(self.named.data.sensordata["imu_gyro"][2])

    def wheel_speeds(self) -> Array:
        """(2,) of the rear wheels, left and right, rad/s."""
        return np.array([self.named.data.qvel[wheel][0] for wheel in REAR])

    def caster_angles(self) -> Array:
        """(4,) cosines of both swivels, then their sines."""
        angles = [self.named.data.qpos[f"{s}_caster_swivel"][0] for s in ("left", "right")]
        return np.concatenate([np.cos(angles), np.sin(angles)])

    def lateral_forces(self) -> Array:
        """(2,) Fy on the rear wheels from their tires, to the left, N."""
        return np.array([self.named.data.sensordata[f"{wheel}_tire"][1] for wheel in REAR])

    def from_chair(self, point: Array) -> Array:
        """Where a point (2,) of the floor, world, m, is from the rear axle, in the chair frame."""
        c, s = math.cos(self.heading()), math.sin(self.heading())
        dx, dy = np.asarray(point) - self.position()
        return np.array([c * dx + s * dy, c * dy - s * dx])

    def touches(self) -> bool:
        """Whether any part of the chair touches a wall or a post."""
        for pair in self.data.contact.geom[: self.data.ncon]:
            for geom in pair:
                if self.model.id2name(int(geom), "geom").startswith(SOLID):
                    return True
        return False

    def tipped(self) -> bool:
        """Whether the chair leans by more than 30 degrees from the vertical."""
        return bool(self.named.data.xmat["chair"][8] < math.cos(math.radians(30.0)))

    def place(self, qpos: Array, act: Array, x: float, y: float, heading: float) -> None:
        """Put the settled chair elsewhere on a level floor, or turn it there.

        Args:
          qpos, act: of the settled chair, which stands at the origin. x, y: m. heading: rad.
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
