"""Toe of the rear wheels: they do not point straight ahead, both alike or one alone.

Two forms, one name. The drag of a toed wheel goes with the square of its toe and acts on its own
side, so that what turns both and what turns them against one another do not add up to a toe of one
wheel: by linear algebra around none, 2 degrees of one wheel promised 167 of chi2 and bring 727.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import mujoco

from mjchair.effects.effect import Effect, Parameter
from mjchair.effects.left_and_right import size_words, wheel_words
from mjchair.model import edits, parts


def edit(spec: mujoco.MjSpec, symmetric: float, asymmetric: float) -> None:
    """Toe in by `symmetric` (rad) each; turn both to the left by `asymmetric` (rad)."""
    for wheel, side in parts.SIDE.items():
        edits.steer_wheel(spec, wheel, asymmetric - side * symmetric)


def of_one_side(spec: mujoco.MjSpec, left: float, right: float) -> None:
    """Toe in the rear wheels by `left` and `right` (rad)."""
    for (wheel, side), angle in zip(parts.SIDE.items(), (left, right), strict=True):
        edits.steer_wheel(spec, wheel, -side * angle)


def _of_one_side(values: Mapping[str, float], std: Mapping[str, float]) -> str:
    return f"{size_words(values, std, 1e3, '+.1f mrad')} inwards, {wheel_words(values)}"


EFFECT = Effect(
    name="toe",
    parameters=(
        Parameter("symmetric", "rad", 0.015, -0.15, 0.15, probe=1.0),
        Parameter("asymmetric", "rad", 0.01, -0.15, 0.15),
    ),
    signature="symmetric: drag that grows in turns; asymmetric: side force and yaw at v > 0",
    source="Vander Wiel et al., RESNA 2016: 1 deg of toe increases rolling resistance by a quarter",
    edit=edit,
    by_hand="measure how far apart the rear rims are in front of the hubs and behind them",
)
ONE_SIDED = replace(
    EFFECT,
    parameters=(
        Parameter("left", "rad", 0.02, -0.15, 0.15, probe=1.0),
        Parameter("right", "rad", 0.02, -0.15, 0.15, probe=1.0),
    ),
    signature="drag of one rear wheel with the square of its toe, and yaw towards it",
    edit=of_one_side,
    remark=_of_one_side,
)
