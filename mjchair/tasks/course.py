"""A path on the floor as a function of its arc length.

In: points on the floor. Out: a smooth path through them: the nearest point to a position, and the
point, direction and curvature at an arc length.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline

from mjchair.errors import MjchairError

Array = NDArray[np.float64]
SPACING = 0.02  # m, between two samples of the path


class Course:
    """A smooth path through points, sampled evenly along its length.

    Attributes:
      points: (n, 2), world, m. directions: (n,), of the tangents, rad.
      curvature: (n,), 1/m, positive for a turn to the left. length: m.
    """

    def __init__(self, through: ArrayLike) -> None:
        """A cubic spline through the points (k, 2), m, in order.

        Raises:
          MjchairError: fewer than 3 points, or two equal ones after one another.
        """
        given = np.asarray(through, dtype=np.float64)
        if given.ndim != 2 or given.shape[1] != 2 or len(given) < 3 or not np.isfinite(given).all():
            raise MjchairError(
                f"a path has shape {given.shape}; it must be (k, 2) with k >= 3 and finite numbers"
            )
        chords = np.hypot(*np.diff(given, axis=0).T)
        if (chords <= 0.0).any():
            raise MjchairError("a path has two equal points in succession; remove one of them")
        spline = CubicSpline(np.r_[0.0, np.cumsum(chords)], given)
        fine = spline(np.linspace(0.0, chords.sum(), 20 * len(given) + 400))
        along = np.r_[0.0, np.cumsum(np.hypot(*np.diff(fine, axis=0).T))]
        self.length = float(along[-1])
        count = max(3, round(self.length / SPACING) + 1)
        at = np.linspace(0.0, self.length, count)
        self.points = np.column_stack([np.interp(at, along, fine[:, k]) for k in (0, 1)])
        self._step = self.length / (count - 1)
        directions = np.unwrap(np.arctan2(*np.gradient(self.points, axis=0).T[::-1]))
        self.directions = directions
        self.curvature = np.gradient(directions, self._step)

    def nearest(self, point: Array, around: float | None = None) -> float:
        """Arc length (m) of the sample of the path that is nearest to a point.

        Args:
          point: (2,), world, m. around: search only within 1 m of this arc length, m.
        """
        low, high = 0, len(self.points)
        if around is not None:
            low = max(0, int((around - 1.0) / self._step))
            high = min(high, int((around + 1.0) / self._step) + 2)
        distance = ((self.points[low:high] - point) ** 2).sum(axis=1)
        return (low + int(distance.argmin())) * self._step

    def at(self, s: float) -> tuple[Array, float, float]:
        """Point (2,) m, direction (rad) and curvature (1/m) at arc length s (m).

        Before its start and after its end the path continues straight.
        """
        inside = min(max(s, 0.0), self.length)
        index = inside / self._step
        k = min(int(index), len(self.points) - 2)
        f = index - k
        point = (1.0 - f) * self.points[k] + f * self.points[k + 1]
        direction = float((1.0 - f) * self.directions[k] + f * self.directions[k + 1])
        beyond = s - inside
        if beyond != 0.0:
            ahead = np.array([math.cos(direction), math.sin(direction)])
            return point + beyond * ahead, direction, 0.0
        return point, direction, float((1.0 - f) * self.curvature[k] + f * self.curvature[k + 1])

    def offset(self, point: Array, s: float) -> float:
        """Distance (m) of a point (2,) from the path at arc length s (m), positive to the left."""
        on, direction, _ = self.at(s)
        dx, dy = point - on
        return float(math.cos(direction) * dy - math.sin(direction) * dx)
