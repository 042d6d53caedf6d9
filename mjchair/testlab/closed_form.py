"""The angle at which a rigid chair tips, from its masses and its geometry alone.

In: a compiled chair that stands. Out: the tilt (rad) of the platform at which the vertical through
the centre of mass meets the line about which the chair tips. This module shares no code with the
simulated tilting platform, for which it is the reference.

A rigid body on a platform starts to turn about a line of its support when the moment of its
weight about that line vanishes: tan(tilt) = distance / height, the distance (along the platform,
perpendicular to the line) and the height measured from the line to the centre of mass.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.testlab.design import REAR, Parts, center_of_mass, lowest

Array = NDArray[np.float64]
UP = np.array([0.0, 0.0, 1.0])

# direction -> the downhill wheels, and the downhill direction in the chair frame
DOWNHILL = {
    "forward": (("left_caster", "right_caster"), (1.0, 0.0)),
    "rearward": (("left_wheel", "right_wheel"), (-1.0, 0.0)),
    "left": (("left_wheel", "left_caster"), (0.0, 1.0)),
    "right": (("right_wheel", "right_caster"), (0.0, -1.0)),
}


def downhill(direction: str, points: Sequence[Array], chair: Array) -> Array:
    """The downhill unit vector (3,) in the level floor, perpendicular to the tip line.

    Args:
      direction: one of DOWNHILL. points: two points of the line. chair: (3, 3), its axes.
    """
    line = points[1] - points[0]
    line[2] = 0.0
    across = np.cross(line, UP)
    across /= np.linalg.norm(across)
    way = chair[:, :2] @ np.array(DOWNHILL[direction][1])
    return np.asarray(across if across @ way > 0.0 else -across)


def tip_angle(
    model: mujoco.MjModel, data: mujoco.MjData, parts: Parts, direction: str, locked: bool
) -> float:
    """Tilt (rad) at which the chair tips about its downhill wheels.

    Locked wheels turn with the chair, so the whole chair tips about their contacts. Wheels that are
    free on their axles, and that stops keep from rolling, stay in place: the rest of the chair tips
    about their axles.

    Args:
      data: of the chair standing on a level floor, with kinematics.
      direction: one of DOWNHILL; for left and right, locked and free wheels give the same
        angle.
    """
    wheels = DOWNHILL[direction][0]
    locked = locked or direction in ("left", "right")
    if locked:
        points = [lowest(model, data, parts.geoms[w], UP) for w in wheels]
        _, center = center_of_mass(model, data)
    else:
        points = [data.geom_xpos[parts.geoms[w]].copy() for w in wheels]
        _, center = center_of_mass(model, data, tuple(parts.bodies[w] for w in wheels))
    way = downhill(direction, [p.copy() for p in points], data.xmat[parts.chair].reshape(3, 3))
    pivot = points[0] if direction in ("left", "right") else 0.5 * (points[0] + points[1])
    return math.atan2(float((pivot - center) @ way), float(center[2] - pivot[2]))


def anti_tip_angle(model: mujoco.MjModel, data: mujoco.MjData, parts: Parts) -> float:
    """Tilt (rad) at which a chair that rests on its anti-tippers tips over them.

    The chair turns about its rear axle until the lowest anti-tipper touches the platform; then it
    tips about this contact. Anti-tippers are taken as spheres whose radius is the first size of the
    geom; this is exact for spherical rollers.

    Args:
      data: of the chair standing on a level floor, with kinematics; the chair has an anti-tipper.
    """
    axes = data.xmat[parts.chair].reshape(3, 3)
    hub = np.mean([data.geom_xpos[parts.geoms[w]] for w in REAR], axis=0)
    floor = min(lowest(model, data, parts.geoms[w], UP)[2] for w in REAR)
    _, center = center_of_mass(model, data)
    ahead, over = float((center - hub) @ axes[:, 0]), float(center[2] - hub[2])

    def turned(x: float, z: float, angle: float) -> tuple[float, float]:
        c, s = math.cos(angle), math.sin(angle)
        return x * c - z * s, x * s + z * c

    best = 0.0
    for geom in parts.anti_tippers:
        at, radius = data.geom_xpos[geom] - hub, float(model.geom_size[geom, 0])
        x, z = float(at @ axes[:, 0]), float(at[2])
        low = floor + radius - float(hub[2])
        size = math.hypot(x, z)
        if size < abs(low):
            continue
        # z cos(a) + x sin(a) = low, the smallest a that is not negative
        middle, half = math.atan2(x, z), math.acos(low / size)
        angles = [(middle + sign * half) % (2.0 * math.pi) for sign in (1.0, -1.0)]
        angle = min(angles)
        back, _ = turned(x, z, angle)
        front, height = turned(ahead, over, angle)
        best = max(best, math.atan2(front - back, height + float(hub[2]) - floor))
    return best
