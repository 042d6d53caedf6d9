"""The chair's slow state: where and how fast it rolls, and how a full state is moved along it.

In: a compiled model and a full state. Out: full states beside it, with their wheels rolling.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.model.rolling import rolling_wheel
from mjchair.model.wheels import wheels
from mjchair.simulation import names
from mjchair.simulation.initial import Initial, start

Array = NDArray[np.float64]

Rest = tuple[float, Array]  # height of the chair's joint (m) and its attitude (quaternion)

# the slow state: what a window may start from. Everything else (sinking, pitching, tire
# deflections, wheel spin) settles on it within the lead of a window. A caster's rate, and how far
# its tire gives way to the side, do so too unless it shimmies.
SLOW = (
    *("x", "y", "heading", "speed", "yaw_rate", "left_caster", "right_caster"),
    *("left_caster_rate", "right_caster_rate", "left_deflection", "right_deflection"),
)
ANGLES, SHIMMY = slice(5, 7), slice(7, 11)  # the casters' angles; what is free where they shimmy
DEFLECTIONS = slice(9, 11)  # of the casters' tires
# of finite differences
STEPS = np.array([0.05, 0.05, 0.01, 0.02, 0.02, 0.03, 0.03, 0.5, 0.5, 0.002, 0.002])
# prior where data see it; a caster turns back within the lead of a window, so that a wide prior
# would let a poor model throw it anywhere
BROAD = np.array([1.0, 1.0, 0.3, 0.3, 0.3, 0.05, 0.05])
# rad, rad/s and m, of casters that shimmy. A search goes one prior a step, and with wider ones it
# overshoots: with 0.3, 10 and 0.02 chi2 of the shimmying windows of the right chair became 708, and
# 360 with these (from the true states 264)
SWINGING = np.array([0.1, 0.1, 3.0, 3.0, 0.01, 0.01])
LATERAL = 1  # place of the lateral deflection in a tire's state (engine/wheel.py)
# a standing chair rocks on its tires when it is given a speed: there speed is not a slow state
STANDING = 0.002  # m/s and rad/s
LINKED = np.array([1.0, 1.0, 0.01, 0.05, 0.05, 0.05, 0.05])  # and where only the last window does


@dataclass
class State:
    """A full state of one simulation: qpos (nq,), qvel (nv,), act (na,)."""

    qpos: Array
    qvel: Array
    act: Array

    def copy(self) -> State:
        """Another one, equal."""
        return State(self.qpos.copy(), self.qvel.copy(), self.act.copy())


class Wheel(NamedTuple):
    """A wheel: address of its dof, radius (m), and place to the left of the chair's middle (m)."""

    dof: int
    radius: float
    left: float


class Chair:
    """Addresses of one chair's joints, and the geometry that ties its wheels to the ground."""

    def __init__(self, model: mujoco.MjModel) -> None:
        """Find the joints of the model."""
        known = names.joints(model)

        def joint(name: str) -> int:
            return names.find(name, known, "joint")

        base = joint("chair")
        self.qpos, self.dof = int(model.jnt_qposadr[base]), int(model.jnt_dofadr[base])
        self.rear = [self._wheel(model, joint(w), w) for w in ("left_wheel", "right_wheel")]
        self.casters = [self._wheel(model, joint(w), w) for w in ("left_caster", "right_caster")]
        swivels = [joint(f"{w}_swivel") for w in ("left_caster", "right_caster")]
        self.swivel_q = [int(model.jnt_qposadr[j]) for j in swivels]
        self.swivel_dof = [int(model.jnt_dofadr[j]) for j in swivels]
        tires = {wheel.joint: int(model.actuator_actadr[wheel.actuator]) for wheel in wheels(model)}
        self.deflections = [tires[joint(w)] + LATERAL for w in ("left_caster", "right_caster")]

    @staticmethod
    def _wheel(model: mujoco.MjModel, joint: int, name: str) -> Wheel:
        rolling = rolling_wheel(model, name)
        return Wheel(int(model.jnt_dofadr[joint]), rolling.radius, rolling.left)

    def statics(self, model: mujoco.MjModel) -> bytes:
        """What decides how a model rests on its tires."""
        parts = ("geom_size", "geom_pos", "body_pos", "body_quat", "body_mass", "body_ipos")
        return b"".join(getattr(model, name).tobytes() for name in parts)

    def rest(self, model: mujoco.MjModel) -> Rest:
        """How a model rests on the level; the tire callbacks must be in place."""
        qpos = start(model, Initial()).qpos
        return float(qpos[self.qpos + 2]), qpos[self.qpos + 3 : self.qpos + 7].copy()

    def lowered(self, state: State, here: Rest, there: Rest) -> State:
        """A state that rests like `here`, resting like `there`."""
        out = state.copy()
        out.qpos[self.qpos + 2] += there[0] - here[0]
        back, turn = np.zeros(4), np.zeros(4)
        mujoco.mju_negQuat(back, here[1])
        mujoco.mju_mulQuat(turn, back, there[1])
        at = slice(self.qpos + 3, self.qpos + 7)
        mujoco.mju_mulQuat(out.qpos[at], state.qpos[at].copy(), turn)
        return out

    def stands(self, state: State) -> bool:
        """Whether the chair stands on its tires, within what a window can tell."""
        still = np.hypot(*state.qvel[self.dof : self.dof + 2]) < 0.02
        return bool(still and abs(state.qvel[self.dof + 5]) < 0.03)

    def moved(self, state: State, change: Array) -> State:
        """The state moved along the slow state.

        Args:
          change: (11,), in the order of SLOW: m, m, rad, m/s, rad/s, rad, rad, rad/s, rad/s, m, m.
        """
        out = state.copy()
        q, v = self.qpos, self.dof
        dx, dy, turn, speed, yaw = change[:5]
        rotation = np.zeros(9)
        mujoco.mju_quat2Mat(rotation, out.qpos[q + 3 : q + 7])
        axes = rotation.reshape(3, 3)
        forward, up = axes[:, 0], axes[:, 2]
        out.qpos[q : q + 2] += dx, dy
        out.qpos[q + 2] -= (up[0] * dx + up[1] * dy) / up[2]
        out.qvel[v : v + 3] += speed * forward
        out.qvel[v + 5] += yaw
        if turn:
            quat = np.zeros(4)
            by = np.r_[np.cos(0.5 * turn), np.sin(0.5 * turn) * up]
            mujoco.mju_mulQuat(quat, by, out.qpos[q + 3 : q + 7].copy())
            out.qpos[q + 3 : q + 7] = quat
            spun = np.zeros(3)
            mujoco.mju_rotVecQuat(spun, out.qvel[v : v + 3].copy(), by)
            out.qvel[v : v + 3] = spun
        for dof, radius, lateral in self.rear:
            out.qvel[dof] += (speed - yaw * lateral) / radius
        swung = zip(self.casters, self.swivel_q, change[ANGLES], strict=True)
        for (dof, radius, lateral), address, angle in swung:
            out.qvel[dof] += (speed - yaw * lateral) * np.cos(out.qpos[address]) / radius
            out.qpos[address] += angle
        rates, deflections = np.split(change[SHIMMY], 2)
        out.qvel[self.swivel_dof] += rates
        out.act[self.deflections] += deflections
        return out

    def swung(self, state: State, side: int, angle: float, rate: float) -> State:
        """The state with a caster (0: left) at an angle (rad) and rate (rad/s), tire unbent."""
        out, at = state.copy(), self.swivel_q[side]
        out.qpos[at] += np.angle(np.exp(1j * (angle - out.qpos[at])))
        out.qvel[self.swivel_dof[side]] = rate
        out.act[self.deflections[side]] = 0.0
        return out
