"""Which share of the rider's segments moves on the chair, and the chair without it.

In: the specification of a chair, and the mass (kg) that moves. Out: the mass, centre of mass and
inertia of that share; `take` leaves the rest to the chair's body, so that both together are what
the chair was. The upper body moves first (head, chest, abdomen and arms, all alike), then the
rest of the person with it. So the whole of a person can move on a chair, and what is left is still
the frame, which has a mass and an inertia. A little more than the person can move too: mass and
displacement are measured as a product, and a displacement that is 5 % short makes the mass 5 %
large.
"""

from __future__ import annotations

import mujoco
import numpy as np

from mjchair.errors import MjchairError
from mjchair.model import inertials, merged_visual_geoms, seating
from mjchair.model.inertials import Inertial
from mjchair.model.wheels import base_name

STAYS = ("pelvis", "thigh", "shank", "foot")  # of the person: what rests on seat and footrest
MORE = 1.1  # of the person's mass that may move at most, of a displacement that is a tenth short
LEFT = 0.05  # of the mass of the chair's body that stays in any case
UNKNOWN = 0.9  # of the mass of a chair's body that may move where nobody says who sits on it


def person(spec: mujoco.MjSpec) -> tuple[Inertial, Inertial] | None:
    """The rider's upper body and the rest of the rider, in the chair's frame.

    None: the chair does not show its rider as the shipped ones do.
    """
    copy = spec.copy()
    merged_visual_geoms.separate(copy)
    try:
        seating.remember_masses(copy)
        geoms = seating.occupant(copy)
    except MjchairError:
        return None
    below = [g for g in geoms if base_name(g.name).endswith(STAYS)]
    upper = [g for g in geoms if not base_name(g.name).endswith(STAYS)]
    return inertials.of_geoms(upper), inertials.of_geoms(below)


def most(spec: mujoco.MjSpec) -> float:
    """The mass (kg) that can move on this chair: a tenth more than its rider's.

    Of a chair of unknown load, 0.9 of its body.
    """
    sitting, chair = person(spec), float(_chair(spec).mass)
    if sitting is None:
        return UNKNOWN * chair
    return min(MORE * (sitting[0].mass + sitting[1].mass), (1.0 - LEFT) * chair)


def share(spec: mujoco.MjSpec, mass: float) -> Inertial:
    """What moves when `mass` (kg) of the rider moves, in the chair's frame.

    Raises:
      MjchairError: a mass that is not positive, or more than `most`.
    """
    limit = most(spec)
    if not 0.0 < mass <= limit * (1.0 + 1e-9):
        raise MjchairError(
            f"{mass:g} kg cannot move on this chair; with its rider (occupant_mass) the mass that "
            f"moves must be positive and at most {limit:.4g} kg"
        )
    sitting = person(spec)
    chair = _chair(spec)
    if sitting is not None:
        upper, rest = sitting
        first = min(mass, upper.mass)
        moving = upper.scaled(first / upper.mass)
        second = min(mass - first, rest.mass)
        if second > 0.0:
            moving = moving.plus(rest.scaled(second / rest.mass))
        if mass > first + second:
            frame = inertials.of_body(chair).plus(moving, sign=-1.0)
            moving = moving.plus(frame.scaled((mass - first - second) / frame.mass))
        if _can_be(inertials.of_body(chair).plus(moving, sign=-1.0)):
            return moving
    # a chair whose inertia was changed apart from its rider's: an even share of all of it
    return inertials.of_body(chair).scaled(mass / float(chair.mass))


def take(spec: mujoco.MjSpec, mass: float) -> Inertial:
    """Take the share that moves off the chair's body, in place, and return it.

    Raises:
      MjchairError: as `share` does, or a chair lighter than what moves.
    """
    chair = _chair(spec)
    if mass >= float(chair.mass):
        raise MjchairError(
            f"{mass:g} kg cannot move on a chair that weighs {float(chair.mass):.4g} kg with its "
            "rider and without wheels"
        )
    moving = share(spec, mass)
    inertials.write(chair, inertials.of_body(chair).plus(moving, sign=-1.0))
    return moving


def _chair(spec: mujoco.MjSpec) -> mujoco.MjsBody:
    return inertials.explicit(spec, "chair")


def _can_be(left: Inertial) -> bool:
    """Whether a body has this mass and inertia, with a hundredth to spare."""
    if left.mass <= 0.0:
        return False
    low, middle, high = np.linalg.eigvalsh(left.tensor)
    return bool(low > 0.0 and low + middle > 1.01 * high)
