"""A load on the chair."""

from __future__ import annotations

import mujoco
import numpy as np

from mjchair.effects.effect import Effect, Parameter, Seed
from mjchair.model import inertials

LOW, HIGH = 0.3, 0.9  # m, heights whose responses are combined


def edit(spec: mujoco.MjSpec, mass: float, height: float) -> None:
    """Put a point mass (kg) above the chair's centre of mass, `height` (m) over the ground."""
    body = inertials.explicit(spec, "chair")
    inertials.add_mass(body, mass, np.array([body.ipos[0], body.ipos[1], height]))


def _combine(coefficients: np.ndarray) -> dict[str, float]:
    low, high = (8.0 * float(c) for c in coefficients)
    mass = low + high
    if abs(mass) < 0.1:
        return {"mass": 0.1, "height": 0.6}
    height = (low * LOW + high * HIGH) / mass
    return {"mass": min(max(mass, -30.0), 80.0), "height": min(max(height, 0.0), 1.6)}


EFFECT = Effect(
    name="payload",
    parameters=(
        Parameter("mass", "kg", 8.0, -30.0, 80.0),
        Parameter("height", "m", 0.6, 0.0, 1.6, 0.6, scale=0.6, sized=False),
    ),
    signature="inertia and load together",
    source="a bag or a lap tray is 2-15 kg",
    edit=edit,
    seeds=(Seed(({"mass": 8.0, "height": LOW}, {"mass": 8.0, "height": HIGH}), _combine),),
    example={"mass": 25.0, "height": 0.6},
    instead=("mass",),
    by_hand="weigh the chair with all that was on it",
)
