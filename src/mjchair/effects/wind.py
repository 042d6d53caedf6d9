"""Moving air, fixed in the world."""

from __future__ import annotations

import mujoco
import numpy as np

from mjchair.effects.air import add_air
from mjchair.effects.effect import Effect, Parameter, Seed

DRAG_AREA = 0.6  # m^2, held: only drag area times speed squared shows
SPEED = 2.0  # m/s, of the points whose responses are combined


def edit(spec: mujoco.MjSpec, x: float, y: float) -> None:
    """Let air move at (x, y) (m/s, world); none without wind, since still air is air_drag."""
    if x or y:
        add_air(spec, "wind", DRAG_AREA, x, y)


def _seed(a: float, b: float) -> Seed:
    def combine(coefficients: np.ndarray) -> dict[str, float]:
        u, v = (SPEED * np.sqrt(np.clip(float(c), 0.01, 50.0)) for c in coefficients)
        return {"x": float(a * u), "y": float(b * v)}

    return Seed(({"x": a * SPEED, "y": 0.0}, {"x": 0.0, "y": b * SPEED}), combine)


EFFECT = Effect(
    name="wind",
    parameters=(
        Parameter("x", "m/s", 2.0, -20.0, 20.0),
        Parameter("y", "m/s", 2.0, -20.0, 20.0),
    ),
    signature="(v - w)^2, fixed in the world",
    source="drag area 0.6 m^2 as for air_drag; wind is told by its velocity alone",
    edit=edit,
    seeds=tuple(_seed(a, b) for a in (1.0, -1.0) for b in (1.0, -1.0)),
)
