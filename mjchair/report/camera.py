"""Where the camera of a film stands.

In: a view's name and the recording. Out: MuJoCo's camera for a sample. The vertical of every
picture is that of gravity. So a tilted floor appears tilted, both where the floor is turned and
where gravity is turned. Views from beside the chair turn with its averaged heading. The view from
above keeps its direction, so that the chair turns in the picture and not the floor.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from mjchair.errors import MjchairError, nearest
from mjchair.report.forces import Array
from mjchair.simulation.recording import Recording

TURN_TIME = 2.0  # s, over which the camera averages the heading
ABOVE = 0.4  # m, from the middle of the wheels up to the point that the camera looks at


@dataclass(frozen=True)
class View:
    """A position of the camera relative to the chair.

    Attributes:
      azimuth: deg, from the chair's heading, or from the world's x where it does not turn.
      elevation: deg. distance: to the point at which the camera looks, m.
      on_slope: elevation on a tilted floor, low enough for the horizon to be in the picture, deg.
      turns: whether the camera turns with the chair.
    """

    azimuth: float
    elevation: float
    distance: float
    on_slope: float
    turns: bool = True


VIEWS = {
    "front": View(145.0, -27.0, 2.8, -13.0),
    "behind": View(35.0, -27.0, 2.8, -13.0),
    "side": View(90.0, -8.0, 2.9, -5.0),
    "top": View(90.0, -89.9, 3.6, -89.9, turns=False),
}


def view_named(name: str) -> View:
    """The view of this name.

    Raises:
      MjchairError: there is none, with the nearest name.
    """
    if name not in VIEWS:
        raise MjchairError(f"unknown view {name!r}" + nearest(name, VIEWS))
    return VIEWS[name]


def camera_at(view: View, heading: float, middle: Array, sloped: bool) -> mujoco.MjvCamera:
    """The camera that looks at a chair.

    Args:
      view: from where. heading: of the chair, rad. middle: (3,), m, of its wheels, world.
      sloped: whether the floor is tilted.
    """
    camera = mujoco.MjvCamera()
    camera.azimuth = view.azimuth + (float(np.rad2deg(heading)) if view.turns else 0.0)
    camera.elevation = view.on_slope if sloped else view.elevation
    camera.distance = view.distance
    camera.lookat = middle + np.array([0.0, 0.0, ABOVE])
    return camera


def stand_upright(camera: mujoco.MjvGLCamera, down: Array, about: Array) -> None:
    """Turn a camera about a point until its vertical is that of gravity.

    Args:
      camera: of a scene that is drawn with the world's z up. down: direction of gravity, (3,), 1.
      about: (3,), m, world.
    """
    turn, matrix = np.empty(4), np.empty(9)
    mujoco.mju_quatZ2Vec(turn, -down)
    mujoco.mju_quat2Mat(matrix, turn)
    rotation = matrix.reshape(3, 3)
    camera.pos = about + rotation @ (np.asarray(camera.pos, float) - about)
    camera.forward = rotation @ np.asarray(camera.forward, float)
    camera.up = rotation @ np.asarray(camera.up, float)


def smooth_heading(recording: Recording) -> Array:
    """Heading (n,), rad, averaged over TURN_TIME; 0 where it was not recorded."""
    try:
        heading = np.unwrap(recording["heading"])
    except MjchairError:
        return np.zeros(recording.time.size)
    span = np.ptp(recording.time)
    share = TURN_TIME / span if span > 0.0 else 1.0
    width = 2 * max(1, round(0.5 * min(share, 1.0) * heading.size)) - 1
    padded = np.pad(heading, width // 2, mode="edge")
    return np.convolve(padded, np.full(width, 1.0 / width), mode="valid")
