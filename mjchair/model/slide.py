"""A part of the chair's body on a slide along the chair's x that follows inputs, as a rider does.

In: the specification of a chair, what slides, and for each input the displacement that it asks for.
Out: the same chair with a body, a slide joint, its damping, and an actuator for each input.

The joint has an armature far above the mass that slides, so that the displacement follows the
inputs whatever the chair does, and the chair feels the mass alone. Its damping is an equality
constraint. A damper of an actuator or of a joint would not do: MuJoCo integrates these implicitly,
while its accelerometers show the acceleration before that, 1.4 times too large where 20 kg slide
and 4 times where 75 kg do (tests/test_rider_motion.py).
"""

from __future__ import annotations

import math

import mujoco
import numpy as np

from mjchair.model import inertials, parts
from mjchair.model.inertials import Inertial

FOLLOW = 2.0 * math.pi * 30.0  # rad/s, of the spring that takes the joint to its place
DAMPING = 0.7  # of critical damping: the joint is 2 DAMPING / FOLLOW = 7 ms late
ARMATURE = 100.0  # of the mass that slides
IMPEDANCE = 0.5  # of the constraint: the share of the joint's acceleration that it decides


def add(spec: mujoco.MjSpec, name: str, moving: Inertial) -> None:
    """Add the body and the joint `name`, in place.

    Args:
      moving: what slides, in the chair's frame; the chair's body must be without it already.
    """
    chair = parts.named(spec.bodies, "chair", "body")
    body = chair.add_body(name=name, pos=moving.centre)
    body.add_joint(
        name=name,
        type=mujoco.mjtJoint.mjJNT_SLIDE,
        axis=[1.0, 0.0, 0.0],
        armature=ARMATURE * moving.mass,
    )
    inertials.write(body, Inertial(moving.mass, np.zeros(3), moving.tensor))
    body.explicitinertial = True
    spec.add_equality(
        name=name,
        type=mujoco.mjtEq.mjEQ_JOINT,
        objtype=mujoco.mjtObj.mjOBJ_JOINT,
        name1=name,
        data=np.zeros(12),
        solref=[0.0, -2.0 * DAMPING * FOLLOW],  # no stiffness, damping in 1/s
        solimp=[IMPEDANCE, IMPEDANCE, 1e-3, 0.5, 2.0],
    )


def drive(
    spec: mujoco.MjSpec, slide: str, actuator: str, displacement: float, holds: bool = True
) -> None:
    """Add an actuator whose input asks for a place of the slide; the places of several add.

    Args:
      displacement: m, of an input of 1. holds: whether this actuator has the spring, which one of
        a slide's actuators must have.
    """
    armature = float(parts.named(spec.joints, slide, "joint").armature)
    stiffness = armature * FOLLOW**2 / (1.0 - IMPEDANCE)
    gain, bias = np.zeros(10), np.zeros(10)
    gain[0] = stiffness * displacement
    bias[1] = -stiffness if holds else 0.0
    spec.add_actuator(
        name=actuator,
        trntype=mujoco.mjtTrn.mjTRN_JOINT,
        target=slide,
        gainprm=gain,
        biastype=mujoco.mjtBias.mjBIAS_AFFINE,
        biasprm=bias,
    )


def delay(model: mujoco.MjModel, joint: int) -> float:
    """Time (s) by which a joint comes after its position inputs: damping over stiffness.

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
