"""A joint that goes where its inputs tell, whatever the chair does, without implicit damping.

In: a joint of a specification, the gains of a spring and of a damper per inertia, and what each
input asks for. Out: the same joint with an armature, an equality constraint that damps it, and an
actuator for each input.

The armature is far above the inertia that the joint moves, so that the joint follows its inputs
as if nothing hung on it, while the chair feels only what really moves. The damping is an equality
constraint. A damper of an actuator or of a joint would not do: MuJoCo integrates these implicitly,
while its accelerometers show the acceleration before that, several times too large.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

ARMATURE = 100.0  # of the inertia that the joint moves
IMPEDANCE = 0.5  # of the constraint: the share of the joint's acceleration that it decides


@dataclass(frozen=True)
class Following:
    """Acceleration of a joint by gap (stiffness, 1/s^2) and by speed (damping, 1/s)."""

    stiffness: float
    damping: float


def damp(spec: mujoco.MjSpec, joint: mujoco.MjsJoint, inertia: float, following: Following) -> None:
    """Give the joint its armature and the constraint that damps it, in place.

    Args:
      inertia: that the joint moves: kg of a slide, kg m^2 of a hinge.
    """
    joint.armature = ARMATURE * inertia
    spec.add_equality(
        name=joint.name,
        type=mujoco.mjtEq.mjEQ_JOINT,
        objtype=mujoco.mjtObj.mjOBJ_JOINT,
        name1=joint.name,
        data=np.zeros(12),
        solref=[0.0, -following.damping],  # no stiffness
        solimp=[IMPEDANCE, IMPEDANCE, 1e-3, 0.5, 2.0],
    )


def drive(
    actuator: mujoco.MjsActuator,
    joint: mujoco.MjsJoint,
    following: Following,
    place: float = 1.0,
    holds: bool = True,
) -> None:
    """Let an actuator of the joint ask for a place; the places of several add.

    Args:
      place: that an input of 1 asks for, m or rad. holds: whether this actuator has the spring,
        which one of a joint's actuators must have.
    """
    stiffness = float(joint.armature) * following.stiffness / (1.0 - IMPEDANCE)
    gain, bias = np.zeros(10), np.zeros(10)
    gain[0] = stiffness * place
    bias[1] = -stiffness if holds else 0.0
    actuator.gainprm, actuator.biasprm = gain, bias
    actuator.biastype = mujoco.mjtBias.mjBIAS_AFFINE


def delay(model: mujoco.MjModel, joint: int) -> float:
    """Time (s) by which a joint comes after its inputs: damping over stiffness.

    Inputs that are given as much earlier make it follow. 0 for a joint without such inputs.
    """
    of_joint = model.actuator_trntype == mujoco.mjtTrn.mjTRN_JOINT
    of_joint &= model.actuator_trnid[:, 0] == joint
    stiffness, damping = -model.actuator_biasprm[of_joint, 1:3].sum(axis=0)
    if stiffness <= 0.0:
        return 0.0
    own = (model.eq_type == mujoco.mjtEq.mjEQ_JOINT) & (model.eq_obj1id == joint)
    own &= model.eq_obj2id < 0
    for k in np.flatnonzero(own):
        share = model.eq_solimp[k, 0]
        inertia = model.dof_armature[model.jnt_dofadr[joint]]
        damping -= inertia * model.eq_solref[k, 1] / (1.0 - share)
    return float(damping / stiffness)
