"""The floor is not level, the same everywhere: gravity leans in the world."""

from __future__ import annotations

import mujoco
import numpy as np

from mjchair.effects import directions
from mjchair.effects.effect import Effect, Parameter


def edit(spec: mujoco.MjSpec, x: float, y: float) -> None:
    """Let the floor rise by `x` and `y` (rise over run, 1) along the world's axes."""
    gravity = np.array(spec.option.gravity, dtype=float)
    size = np.linalg.norm(gravity)
    gravity[:2] -= size * np.array([x, y])
    spec.option.gravity = gravity * size / np.linalg.norm(gravity)


EFFECT = Effect(
    name="floor_slope",
    parameters=(
        Parameter("x", "1", 0.005, -0.2, 0.2),
        Parameter("y", "1", 0.005, -0.2, 0.2),
    ),
    signature="constant in the world frame, and there at v = 0",
    source="floors called level are so within 0.5 % to 1 %",
    edit=edit,
    common=2.0,
    remark=directions.remark(directions.WORLD, "%", 100.0, "the floor rises by"),
    by_hand="lay a digital level on the floor, along and across the track",
)
