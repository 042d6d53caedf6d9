"""Force elements that MuJoCo does not have: the drag of the air, and a rider who sways.

In: the views of a model and its data, and an actuator. Out: the force of that actuator.

An element is an actuator with `biastype="user"` and a block in its `user` field: the tag, the
kind, and the numbers of the kind. MuJoCo's transmission says where and along what the force acts;
only its size is computed here, so an element attaches, saves and copies as any actuator does.
MuJoCo calls this only for actuators with a user bias.

DRAG, one actuator per world axis (a site transmission with a `refsite` in the world): axis
(0 x, 1 y), half the air's density times the drag area (kg/m), wind x and y (m/s).
SWAY, on a site of the chair: amplitude of the force (N), frequency (Hz), phase (rad).
"""

from __future__ import annotations

import math

import mujoco
from numba.extending import register_jitable

from mjchair.engine.views import DataView, ModelView
from mjchair.engine.wheel import velocity_at

TAG = 5066309.0  # "MJE": the actuator is an element
TAG_AT = 0
KIND = 1
FIRST = 2
NUMBERS = 6  # of a block
DRAG, SWAY = range(2)


def hold_sway(model: mujoco.MjModel) -> None:
    """Let every rider of a model who sways sit still: the elements of kind SWAY have no force."""
    if model.nuser_actuator < NUMBERS:
        return
    user = model.actuator_user
    user[(user[:, TAG_AT] == TAG) & (user[:, KIND] == SWAY), FIRST] = 0.0


@register_jitable(forceinline=True)
def force(m: ModelView, d: DataView, actuator: int) -> float:
    """Force (N) along the actuator's transmission; 0 for an actuator that is no element."""
    user = m.actuator_user
    if user.shape[1] < NUMBERS or user[actuator, TAG_AT] != TAG:
        return 0.0
    if user[actuator, KIND] == SWAY:
        angle = 2.0 * math.pi * user[actuator, FIRST + 1] * d.time + user[actuator, FIRST + 2]
        return user[actuator, FIRST] * math.sin(angle)
    site = m.actuator_trnid[actuator, 0]
    at = d.site_xpos
    vx, vy, _, _, _, _ = velocity_at(
        m, d, m.site_bodyid[site], at[site, 0], at[site, 1], at[site, 2]
    )
    rx, ry = vx - user[actuator, FIRST + 2], vy - user[actuator, FIRST + 3]
    along = rx if user[actuator, FIRST] == 0.0 else ry
    return -user[actuator, FIRST + 1] * math.hypot(rx, ry) * along
