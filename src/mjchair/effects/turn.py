"""Turn a rear wheel on its axle: toe about the vertical, camber about the heading."""

from __future__ import annotations

import mujoco
import numpy as np

from mjchair.effects import parts


def turn_wheel(spec: mujoco.MjSpec, wheel: str, axis: tuple[float, float, float], a: float) -> None:
    """Turn the wheel's body by `a` (rad) about an axis of the chair, through the wheel's centre."""
    body = parts.named(spec.bodies, wheel, "body")
    turn = np.r_[np.cos(0.5 * a), np.sin(0.5 * a) * np.array(axis)]
    out = np.zeros(4)
    mujoco.mju_mulQuat(out, turn, np.asarray(body.quat, float))
    body.quat = out
