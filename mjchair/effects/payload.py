"""A load on the chair: over its centre of mass, or anywhere along it.

Two forms, one name: a tray or a heavier rider, and a bag behind the backrest or under the seat.
"""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np

from mjchair.effects.effect import Effect, Parameter, Seed
from mjchair.model import inertials

LOW, HIGH = 0.3, 0.9  # m, heights whose responses are combined
MIDDLE, AWAY = 0.6, 0.3  # m, a height, and how far ahead and behind; likewise
LOAD = 8.0  # kg, of every load whose response is taken
NEUTRAL = {"height": 0.6, "ahead": 0.0}
BOUNDS = {"height": (0.0, 1.6), "ahead": (-0.6, 0.6)}


def edit(spec: mujoco.MjSpec, mass: float, height: float) -> None:
    """Put a point mass (kg) above the chair's centre of mass, `height` (m) over the ground."""
    body = inertials.explicit(spec, "chair")
    inertials.add_mass(body, mass, np.array([body.ipos[0], body.ipos[1], height]))


def along(spec: mujoco.MjSpec, mass: float, height: float, ahead: float) -> None:
    """Put a point mass (kg) `ahead` (m) of the chair's centre of mass, at a `height` (m)."""
    body = inertials.explicit(spec, "chair")
    inertials.add_mass(body, mass, np.array([body.ipos[0] + ahead, body.ipos[1], height]))


def _combine(coefficients: np.ndarray) -> dict[str, float]:
    """Loads at LOW and HIGH as one."""
    return _as_one(coefficients, height=(LOW, HIGH))


def _combine_along(coefficients: np.ndarray) -> dict[str, float]:
    """Loads at LOW and HIGH, and one behind, as one."""
    return _as_one(coefficients, height=(LOW, HIGH, MIDDLE), ahead=(0.0, 0.0, -AWAY))


def _as_one(coefficients: np.ndarray, **places: tuple[float, ...]) -> dict[str, float]:
    """Loads at places as one: their sum, in their centre; 0.1 kg in the middle for less."""
    loads = LOAD * np.asarray(coefficients, float)
    mass = float(loads.sum())
    if abs(mass) < 0.1:
        return {"mass": 0.1, **{name: NEUTRAL[name] for name in places}}
    out = {"mass": min(max(mass, -30.0), 80.0)}
    for name, place in places.items():
        low, high = BOUNDS[name]
        out[name] = min(max(float(loads @ np.array(place)) / mass, low), high)
    return out


EFFECT = Effect(
    name="payload",
    parameters=(
        Parameter("mass", "kg", 8.0, -30.0, 80.0),
        Parameter("height", "m", 0.6, *BOUNDS["height"], 0.6, scale=0.6, sized=False),
    ),
    signature="inertia and load together",
    source="a bag or a lap tray is 2-15 kg",
    edit=edit,
    seeds=(Seed(({"mass": LOAD, "height": LOW}, {"mass": LOAD, "height": HIGH}), _combine),),
    instead=("mass",),
)
ALONG = replace(
    EFFECT,
    parameters=(
        *EFFECT.parameters,
        Parameter("ahead", "m", 0.0, *BOUNDS["ahead"], 0.0, scale=0.3, sized=False, cautious=0.3),
    ),
    signature="inertia and load together, more of it on the rear wheels or on the casters",
    source="a bag behind the backrest is 2-15 kg, and hangs 0.3-0.4 m behind the middle; assumed",
    edit=along,
    seeds=(
        Seed(
            (
                {"mass": LOAD, "height": LOW, "ahead": 0.0},
                {"mass": LOAD, "height": HIGH, "ahead": 0.0},
                {"mass": LOAD, "height": MIDDLE, "ahead": -AWAY},
            ),
            _combine_along,
        ),
    ),
)
