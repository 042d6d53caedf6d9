"""Mass, centre of mass and yaw inertia of a chair with its occupant and its wheels.

In: a compiled model of a chair. Out: its `MassDistribution` in the initial pose.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from mjchair.model.rolling import chair_body, rolling_wheel
from mjchair.model.wheels import WHEELS


@dataclass(frozen=True)
class MassDistribution:
    """Mass of a chair with its occupant and its wheels, and where it is.

    Attributes:
      mass: kg.
      ahead: distance of the centre of mass ahead of the middle of the rear axle, along the chair's
        x, m.
      yaw_inertia: about the parallel to the chair's z through the centre of mass, kg m^2.
    """

    mass: float
    ahead: float
    yaw_inertia: float


def mass_distribution(model: mujoco.MjModel) -> MassDistribution:
    """The mass distribution of the chair in a compiled model, at its initial pose.

    Raises:
      MjchairError: the model has no rear wheels, or no joint named 'chair'.
    """
    axle = 0.5 * sum(rolling_wheel(model, wheel).ahead for wheel in WHEELS[:2])
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    chair = chair_body(model)
    centre = data.subtree_com[chair]
    to_chair = data.xmat[chair].reshape(3, 3).T
    yaw_inertia = 0.0
    for body in np.flatnonzero(model.body_rootid == chair):
        axes = to_chair @ data.ximat[body].reshape(3, 3)  # principal axes, in the chair's frame
        x, y, _ = to_chair @ (data.xipos[body] - centre)
        yaw_inertia += float(axes[2] ** 2 @ model.body_inertia[body])
        yaw_inertia += float(model.body_mass[body] * (x * x + y * y))
    ahead = float((to_chair @ (centre - data.xpos[chair]))[0]) - axle
    return MassDistribution(float(model.body_subtreemass[chair]), ahead, yaw_inertia)
