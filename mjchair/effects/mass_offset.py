"""The centre of mass of frame and occupant is not where the model has it."""

from __future__ import annotations

import mujoco
import numpy as np

from mjchair.effects import directions
from mjchair.effects.effect import Effect, Parameter
from mjchair.model import inertials


def edit(spec: mujoco.MjSpec, x: float, y: float) -> None:
    """Move the centre of mass of body `chair` by `x`, `y` (m) in the chair's axes."""
    body = inertials.explicit(spec, "chair")
    body.ipos = np.asarray(body.ipos, float) + np.array([x, y, 0.0])


EFFECT = Effect(
    name="mass_offset",
    parameters=(
        Parameter("x", "m", 0.03, -0.3, 0.3),
        Parameter("y", "m", 0.015, -0.2, 0.2),
    ),
    signature="load shift: yaw with longitudinal acceleration (y), understeer (x)",
    source="a seated person leans a few centimetres",
    edit=edit,
    example={"x": 0.05, "y": 0.02},
    remark=directions.remark(directions.CHAIR, "mm", 1000.0),
    shared={"centre_x": ("x",), "centre_y": ("y",)},
    by_hand="weigh each caster and each rear wheel",
)
