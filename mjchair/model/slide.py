"""A part of the chair's body on a slide along the chair's x that follows inputs, as a rider does.

In: the specification of a chair, what slides, and for each input the displacement that it asks for.
Out: the same chair with a body, a slide joint that follows, and an actuator for each input
(mjchair/rider/driven_joint.py).
"""

from __future__ import annotations

import math

import mujoco
import numpy as np

from mjchair.model import inertials, parts
from mjchair.model.inertials import Inertial
from mjchair.rider import driven_joint
from mjchair.rider.driven_joint import Following

RATE = 2.0 * math.pi * 30.0  # rad/s, of the spring that takes the joint to its place
DAMPING = 0.7  # of critical damping: the joint is 2 DAMPING / RATE = 7 ms late
FOLLOWING = Following(stiffness=RATE**2, damping=2.0 * DAMPING * RATE)


def add(spec: mujoco.MjSpec, name: str, moving: Inertial) -> None:
    """Add the body and the joint `name`, in place.

    Args:
      moving: what slides, in the chair's frame; the chair's body must be without it already.
    """
    chair = parts.named(spec.bodies, "chair", "body")
    body = chair.add_body(name=name, pos=moving.centre)
    joint = body.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[1.0, 0.0, 0.0])
    inertials.write(body, Inertial(moving.mass, np.zeros(3), moving.tensor))
    body.explicitinertial = True
    driven_joint.damp(spec, joint, moving.mass, FOLLOWING)


def drive(
    spec: mujoco.MjSpec, slide: str, actuator: str, displacement: float, holds: bool = True
) -> None:
    """Add an actuator whose input asks for a place of the slide; the places of several add.

    Args:
      displacement: m, of an input of 1. holds: whether this actuator has the spring, which one of
        a slide's actuators must have.
    """
    added = spec.add_actuator(name=actuator, trntype=mujoco.mjtTrn.mjTRN_JOINT, target=slide)
    joint = parts.named(spec.joints, slide, "joint")
    driven_joint.drive(added, joint, FOLLOWING, displacement, holds)
