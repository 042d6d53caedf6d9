"""The chair's slow state: how a full state of the simulation is moved along it."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.simulation import names

Array = NDArray[np.float64]

# the slow state: what a window may start from. Everything else (sinking, pitching, tire
# deflections, wheel spin) settles on it within the lead of a window.
SLOW = ("x", "y", "heading", "speed", "yaw_rate", "left_caster", "right_caster")
STEPS = np.array([0.05, 0.05, 0.01, 0.02, 0.02, 0.03, 0.03])  # of finite differences
# prior where data see it; a caster turns back within the lead of a window, so that a wide prior
# would let a poor model throw it anywhere
BROAD = np.array([1.0, 1.0, 0.3, 0.3, 0.3, 0.05, 0.05])
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

    @staticmethod
    def _wheel(model: mujoco.MjModel, joint: int, name: str) -> tuple[int, float, float]:
        """Dof address, radius (m), lateral place in the chair (m)."""
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        geom = names.find(f"{name}_tire", names.geoms(model), "geom")
        chair = model.body(model.jnt_bodyid[names.find("chair", names.joints(model), "joint")]).id
        local = data.xmat[chair].reshape(3, 3).T @ (data.geom_xpos[geom] - data.xpos[chair])
        return int(model.jnt_dofadr[joint]), float(model.geom_size[geom, 0]), float(local[1])

    def stands(self, state: State) -> bool:
        """Whether the chair stands on its tires, within what a window can tell."""
        still = np.hypot(*state.qvel[self.dof : self.dof + 2]) < 0.02
        return bool(still and abs(state.qvel[self.dof + 5]) < 0.03)

    def moved(self, state: State, change: Array) -> State:
        """The state moved along the slow state.

        Args:
          change: (7,), in the order of SLOW: m, m, rad, m/s, rad/s, rad, rad.
        """
        out = state.copy()
        q, v = self.qpos, self.dof
        dx, dy, turn, speed, yaw, left, right = change
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
        swung = zip(self.casters, self.swivel_q, (left, right), strict=True)
        for (dof, radius, lateral), address, angle in swung:
            out.qvel[dof] += (speed - yaw * lateral) * np.cos(out.qpos[address]) / radius
            out.qpos[address] += angle
        return out
