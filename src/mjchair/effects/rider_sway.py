"""The occupant's trunk and arms move on the chair as they push.

Two forms. With a measured motion a part of the occupant's mass slides on the chair and follows the
table column `rider_motion`; without one, the force of a harmonic motion acts on the chair.
"""

from __future__ import annotations

import math

import mujoco
import numpy as np

from mjchair.effects import parts
from mjchair.effects.effect import Effect, Parameter
from mjchair.engine import element

MOTION = "rider_motion"
HEIGHT = 0.85  # m above the ground: centre of mass of a seated trunk with head and arms
FOLLOW = 2.0 * math.pi * 8.0  # rad/s, bandwidth of the follower
MASS = (
    40.0  # kg: head, arms and trunk of a person of 75 kg (Winter 2009: 0.68), less the seat's part
)


def harmonic(
    spec: mujoco.MjSpec, mass: float, amplitude: float, frequency: float, phase: float
) -> None:
    """Let `mass` (kg) sway by `amplitude` (m) at `frequency` (Hz) and `phase` (rad at time 0)."""
    if amplitude == 0.0:
        return
    chair = parts.named(spec.bodies, "chair", "body")
    site = parts.unused_name(spec.sites, "rider_sway")
    chair.add_site(name=site, pos=[0.0, 0.0, HEIGHT], size=[0.01] * 3, group=4)
    rate = 2.0 * math.pi * frequency
    gravity = float(np.linalg.norm(spec.option.gravity))
    actuator = spec.add_actuator(
        name=parts.unused_name(spec.actuators, "rider_sway"),
        trntype=mujoco.mjtTrn.mjTRN_SITE,
        target=site,
        # the mass pushes back as it is accelerated, and its weight tips the chair as it is away
        gear=[1.0, 0.0, 0.0, 0.0, gravity / rate**2, 0.0],
        gainprm=np.zeros(10),
        biastype=mujoco.mjtBias.mjBIAS_USER,
    )
    force = mass * amplitude * rate**2
    numbers = [element.TAG, element.SWAY, force, frequency, phase, 0.0]
    parts.write_actuator(spec, actuator, numbers)


def measured(spec: mujoco.MjSpec, mass: float) -> None:
    """Let `mass` (kg) of the occupant follow the measured motion (the control `rider_motion`)."""
    if mass <= 0.0:
        return
    chair = parts.explicit_inertial(spec, "chair")
    place = np.array([chair.ipos[0], 0.0, HEIGHT])
    parts.add_mass(chair, -mass, place)
    body = chair.add_body(name=MOTION, pos=place)
    body.add_joint(name=MOTION, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[1.0, 0.0, 0.0])
    body.mass, body.inertia, body.ipos = mass, [1e-3] * 3, [0.0, 0.0, 0.0]
    body.explicitinertial = True
    gain, bias = np.zeros(10), np.zeros(10)
    gain[0] = mass * FOLLOW**2
    bias[1:3] = -mass * FOLLOW**2, -2.0 * mass * FOLLOW
    spec.add_actuator(
        name=MOTION,
        trntype=mujoco.mjtTrn.mjTRN_JOINT,
        target=MOTION,
        gainprm=gain,
        biastype=mujoco.mjtBias.mjBIAS_AFFINE,
        biasprm=bias,
    )


SIGNATURE = "zero-mean fore-aft force at push frequency, with pitch"
SOURCE = "head, arms and trunk are 0.68 of body mass (Winter 2009); sway of 2-10 cm"
HARMONIC = Effect(
    name="rider_sway",
    parameters=(
        Parameter("mass", "kg", MASS, 0.0, 120.0, MASS, fitted=False),
        Parameter("amplitude", "m", 0.03, 0.0, 0.5),
        Parameter("frequency", "Hz", 1.0, 0.2, 3.0, 1.0),
        Parameter("phase", "rad", 0.0, -20.0, 20.0),
    ),
    signature=SIGNATURE,
    source=SOURCE,
    edit=harmonic,
    tags={"wave": "amplitude frequency phase"},
)
MEASURED = Effect(
    name="rider_sway",
    parameters=(Parameter("mass", "kg", 20.0, 0.0, 80.0),),
    signature=SIGNATURE,
    source=SOURCE,
    edit=measured,
    measured=MOTION,
)
