"""Moving air, fixed in the world."""

from __future__ import annotations

from collections.abc import Mapping

import mujoco
import numpy as np

from mjchair.effects import directions
from mjchair.effects.air import add_air
from mjchair.effects.effect import Effect, Parameter, Seed
from mjchair.units import with_error

DRAG_AREA = 0.6  # m^2, where a fit begins: slow runs tell drag area times speed squared alone
# a wind along an axis has nothing across it, give or take: the sign of that is no matter
AGAINST = -0.2
SPEED = 2.0  # m/s, of the points whose responses are combined
# of a light wind: beside a chair that is faster, its force is that of still air and a part that
# goes with the wind, of either sign
LIGHT = 0.1  # m/s
EITHER = -20.0


def edit(spec: mujoco.MjSpec, x: float, y: float, drag_area: float) -> None:
    """Let air move at (x, y) (m/s, world) past a drag area (m^2).

    There is no drag without wind, since still air is air_drag.
    """
    if x or y:
        add_air(spec, "wind", drag_area, x, y)


def _seed(a: float, b: float) -> Seed:
    def combine(coefficients: np.ndarray) -> dict[str, float]:
        u, v = (SPEED * np.sqrt(np.clip(float(c), 0.01, 50.0)) for c in coefficients)
        return {"x": float(a * u), "y": float(b * v), "drag_area": DRAG_AREA}

    along, across = {"x": a * SPEED, "y": 0.0}, {"x": 0.0, "y": b * SPEED}
    points = tuple({**point, "drag_area": DRAG_AREA} for point in (along, across))
    return Seed(points, combine, least=AGAINST)


def _light_seed() -> Seed:
    def combine(coefficients: np.ndarray) -> dict[str, float]:
        area = float(np.clip(DRAG_AREA * coefficients.sum(), 0.2, 1.5))
        x, y = LIGHT * DRAG_AREA / area * coefficients[1:]
        return {"x": float(x), "y": float(y), "drag_area": area}

    points = ({"x": 1e-3, "y": 0.0}, {"x": LIGHT, "y": 0.0}, {"x": 0.0, "y": LIGHT})
    return Seed(tuple({**p, "drag_area": DRAG_AREA} for p in points), combine, least=EITHER)


_blows = directions.remark(directions.WORLD, "m/s", 1.0, "it blows with")


def _words(values: Mapping[str, float], std: Mapping[str, float]) -> str:
    area = with_error(values["drag_area"], std.get("drag_area", 0.0) or None)
    return f"{_blows(values, std)}, on a drag area of {area} m^2"


EFFECT = Effect(
    name="wind",
    parameters=(
        Parameter("x", "m/s", 2.0, -20.0, 20.0),
        Parameter("y", "m/s", 2.0, -20.0, 20.0),
        Parameter("drag_area", "m^2", DRAG_AREA, 0.2, 1.5, DRAG_AREA, sized=False, cautious=0.2),
    ),
    signature="(v - w)^2, fixed in the world",
    source="a seated person has a drag area of 0.5-0.8 m^2 (Hoerner 1965); clothes and trays more",
    edit=edit,
    common=0.1,
    outdoors=True,
    remark=_words,
    by_hand="measure the wind on the track",
    example={"x": 2.0, "y": 2.0, "drag_area": DRAG_AREA},
    seeds=(*(_seed(a, b) for a in (1.0, -1.0) for b in (1.0, -1.0)), _light_seed()),
)
