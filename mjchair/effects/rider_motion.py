"""The occupant moves on the chair: trunk and arms swing with every push.

In: the specification of a chair. Out: the same chair with a motion of the rider, in one of two
forms. With a measured motion (the table column `rider_motion`, m, the forward displacement of the
rider's centre of mass in the chair's frame) a share of the rider's segments slides along the
chair's x and follows it. Without one, the force of a harmonic motion acts on the chair.

Such data determine only the product of mass and displacement: the fitted mass is right only if the
given displacement is that of the mass that moves.
"""

from __future__ import annotations

import math

import mujoco
import numpy as np

from mjchair.effects.effect import Effect, Parameter, Values, Wave
from mjchair.engine import element
from mjchair.model import moving_share, parts, slide

FREQUENCIES = tuple(float(f) for f in np.arange(0.4, 2.01, 0.05))  # Hz, that are searched
MOTION = "rider_motion"
HEIGHT = 0.85  # m above the ground: centre of mass of a seated trunk with head and arms
MASS = (
    40.0  # kg: head, arms and trunk of a person of 75 kg (Winter 2009: 0.68), less the seat's part
)
MOST = 75.0  # kg: the whole occupant of the shipped chairs


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
        # the accelerated mass gives a reaction force; its displaced weight gives a moment
        gear=[1.0, 0.0, 0.0, 0.0, gravity / rate**2, 0.0],
        gainprm=np.zeros(10),
        biastype=mujoco.mjtBias.mjBIAS_USER,
    )
    force = mass * amplitude * rate**2
    numbers = [element.TAG, element.SWAY, force, frequency, phase, 0.0]
    parts.write_actuator(spec, actuator, numbers)


def measured(spec: mujoco.MjSpec, mass: float) -> None:
    """Let `mass` (kg) of the occupant follow the measured motion (the control `rider_motion`).

    Raises:
      MjchairError: more mass than the rider of this chair has.
    """
    if mass <= 0.0:
        return
    moving = moving_share.take(spec, mass)
    slide.add(spec, MOTION, moving)
    slide.drive(spec, MOTION, MOTION, displacement=mass / moving.mass)


def _swaying(sine: float, cosine: float, frequency: float) -> Values:
    """Values of a sway whose force has these amplitudes (N) at a frequency (Hz)."""
    rate = 2.0 * math.pi * frequency
    size = math.hypot(sine, cosine) / (MASS * rate**2)
    phase = math.atan2(cosine, sine)
    amplitude = min(max(size, 1e-4), 0.4)
    return {"mass": MASS, "amplitude": amplitude, "frequency": frequency, "phase": phase}


SIGNATURE = "zero-mean fore-aft force at push frequency, with pitch"
SOURCE = "head, arms and trunk are 0.68 of body mass (Winter 2009); sway of 2-10 cm"
# weight over most other effects where a motion was measured, so that a person did move: assumption
MOVES = 10.0
HARMONIC = Effect(
    name="rider_motion",
    parameters=(
        Parameter("mass", "kg", MASS, 0.0, 120.0, MASS, fitted=False),
        Parameter("amplitude", "m", 0.03, 0.0, 0.5),
        Parameter("frequency", "Hz", 1.0, 0.2, 3.0, 1.0, scale=0.05, sized=False, cautious=0.015),
        Parameter("phase", "rad", 0.0, -20.0, 20.0, scale=0.3, sized=False, each_run=True),
    ),
    signature=SIGNATURE,
    source=SOURCE,
    edit=harmonic,
    wave=Wave(FREQUENCIES, ("amplitude", "frequency", "phase"), _swaying),
    example={"mass": MASS, "amplitude": 0.03, "frequency": 0.9, "phase": 0.5},
)
MEASURED = Effect(
    name="rider_motion",
    parameters=(Parameter("mass", "kg", 20.0, 0.0, MOST),),
    signature=SIGNATURE,
    source=SOURCE,
    edit=measured,
    measured=MOTION,
    common=MOVES,
    most=lambda spec: {"mass": moving_share.most(spec)},
)
